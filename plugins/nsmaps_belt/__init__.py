"""Stick-slip: a mass on a belt, held by a spring, with static and kinetic friction."""

from nsmaps_belt.system import Belt

__all__ = ["Belt"]
