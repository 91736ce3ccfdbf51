"""The map that a reduced map approximates."""

from collections.abc import Callable
from dataclasses import dataclass

from nsmaps.dynamics.iterated import IteratedMap
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.reduced.composite.composite import CompositeMap


def counterpart(return_map: ReturnMap, reduced: ReturnMap | None) -> ReturnMap:
    """The exact map, iterated as often as the pieces of a composite map have returns; the same map where all have one."""
    return IteratedMap(return_map, reduced.returns_of) if isinstance(reduced, CompositeMap) and reduced.several else return_map


@dataclass(frozen=True, slots=True)
class CounterpartAlong:
    """As `counterpart`, of maps over a parameter: a function of its value that can be pickled."""

    map_of: Callable[[float], ReturnMap]
    reduced_of: Callable[[float], CompositeMap]

    def __call__(self, value: float) -> ReturnMap:
        """The counterpart at a value."""
        return counterpart(self.map_of(value), self.reduced_of(value))
