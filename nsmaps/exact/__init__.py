"""What the physics does: systems, their flights and impacts, first returns, families and surfaces."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
