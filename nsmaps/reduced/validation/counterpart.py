"""The map that a reduced map approximates."""

from nsmaps.dynamics.iterated import Iterated
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.reduced.composite.composite import CompositeMap


def counterpart(map: ReturnMap, reduced: object) -> ReturnMap:
    """The exact map, iterated as often as the pieces of a composite map have returns; the same map where all have one."""
    return Iterated(map, reduced.returns_of) if isinstance(reduced, CompositeMap) and reduced.several else map
