"""The bilinear oscillator: a linear oscillator with an elastic stop."""

from nsmaps_soft_impact.system import SoftImpact

__all__ = ["SoftImpact"]
