"""Iterates of a return map, with the words of all their impacts."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.dynamics.scale import extents_of
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.compose import iterate_returns


@dataclass(frozen=True, slots=True)
class IteratedMap(ReturnMap):
    """The iterate of a return map of order `times`: words are joined; an orbit that ends keeps its outcome.

    Words are joined as BBTB for BB and BTB. The order may depend on the state: `times` is then a function of states (N, n) with
    orders (N,), such as the `returns_of` of a composite map with pieces of several returns, whose counterpart this is.
    """

    map: ReturnMap
    times: int | Callable[[Floats], Ints]

    def __post_init__(self) -> None:
        ReturnMap.require(self.map, "an iterate")
        if not callable(self.times) and self.times < 1:
            raise NsmapsError(f"{self.times} returns; expected: at least one")

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the map."""
        return Coordinates(self.map.coordinates)

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The last of `times` returns of states of shape (N, n), with the words, turns, times and derivatives of all of them."""
        x = as_states(states, self.coordinates)
        times = self.times(x) if callable(self.times) else np.full(len(x), self.times)
        return iterate_returns(self.map, self.map.first_return(x, derivative), times)

    def extents(self, states: ArrayLike) -> Floats | None:
        """As of the map whose iterate it is; None where that has none."""
        return extents_of(self.map, as_states(states, self.coordinates))
