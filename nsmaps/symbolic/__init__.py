"""Closed forms: exact polynomial formulas, iterates of curves and maps, two-cycles."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
