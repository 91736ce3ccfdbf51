"""Proofs by computation: certificates are computed here and checked in `nsmaps.verify`."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
