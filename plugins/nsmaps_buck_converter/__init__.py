"""The voltage-mode controlled buck converter: two linear circuits, switched by a ramp."""

from nsmaps_buck_converter.system import BuckConverter

__all__ = ["BuckConverter"]
