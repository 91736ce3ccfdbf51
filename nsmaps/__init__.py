"""Global analysis of non-smooth dynamics: return maps of systems with impacts, their surrogates and attracting domains.

Each public name is imported when it is first used, so that `import nsmaps` takes little time.
"""

from nsmaps.lazy import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
