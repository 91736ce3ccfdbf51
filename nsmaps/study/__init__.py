"""A file in, results out: studies in YAML, their runs, their verdicts, and the folders that keep them."""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
