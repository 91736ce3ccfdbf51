"""Auxiliary maps and the attracting domains that they bound (section 6 of the paper)."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
