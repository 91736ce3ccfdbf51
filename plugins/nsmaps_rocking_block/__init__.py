"""The rocking block of Housner for small angles: a flight that grows, an impact at each crossing, overturning."""

from nsmaps_rocking_block.system import RockingBlock

__all__ = ["RockingBlock"]
