"""Conformance: whether a class that somebody wrote is what the rest of nsmaps takes it for, told in plain words."""

from nsmaps.testing.polyfits import check_polyfit
from nsmaps.testing.regions import check_region
from nsmaps.testing.systems import check_system

__all__ = ["check_polyfit", "check_region", "check_system"]
