"""Two masses on springs, the first with a stop."""

from nsmaps_two_masses.system import TwoMasses

__all__ = ["TwoMasses"]
