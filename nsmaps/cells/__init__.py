"""The state space in cells: transition graphs, Morse sets, exit times, and periodic points found by excluding cells."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
