"""What any return map does, exact or fitted alike."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
