"""What we put in the map's place: regions, polynomials fitted on them, the composite map."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
