"""From measured data to parameters: records, estimates with their errors, and what they imply for the motion."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
