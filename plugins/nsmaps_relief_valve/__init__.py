"""A pressure relief valve that strikes its seat."""

from nsmaps_relief_valve.system import ReliefValve, ReliefValveLift

__all__ = ["ReliefValve", "ReliefValveLift"]
