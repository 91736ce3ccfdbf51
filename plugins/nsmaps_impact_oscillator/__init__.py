"""The impact oscillator: a damped linear oscillator under harmonic forcing, with one wall."""

from nsmaps_impact_oscillator.system import ImpactOscillator

__all__ = ["ImpactOscillator"]
