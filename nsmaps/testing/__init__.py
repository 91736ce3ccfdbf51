"""Conformance tests: whether a class fulfils its contract with nsmaps; every failure is a sentence."""

from nsmaps.testing.families import check_family
from nsmaps.testing.polyfits import check_polyfit
from nsmaps.testing.regions import check_region
from nsmaps.testing.systems import check_system

__all__ = ["check_family", "check_polyfit", "check_region", "check_system"]
