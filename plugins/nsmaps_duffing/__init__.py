"""The Duffing impact oscillator: a spring with a cubic term under harmonic forcing, before a stop."""

from nsmaps_duffing.system import DuffingStop

__all__ = ["DuffingStop"]
