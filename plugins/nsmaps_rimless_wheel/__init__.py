"""A wheel of spokes without a rim that rolls down a slope."""

from nsmaps_rimless_wheel.system import RimlessWheel

__all__ = ["RimlessWheel"]
