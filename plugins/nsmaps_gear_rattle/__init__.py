"""Gear rattle: the relative rotation of two gears between the ends of their backlash."""

from nsmaps_gear_rattle.system import GearRattle

__all__ = ["GearRattle"]
