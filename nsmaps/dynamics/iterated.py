"""Iterates of a return map, with the words of all their impacts."""

from dataclasses import dataclass

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.dynamics.scale import extents_of
from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.compose import joined


@dataclass(frozen=True, slots=True)
class Iterated:
    """The iterate of a return map of order `times`: words are joined, such as BBTB for BB and BTB; an orbit that ends keeps
    its outcome.
    """

    map: ReturnMap
    times: int

    def __post_init__(self) -> None:
        if self.times < 1:
            raise NsmapsError(f"{self.times} returns; expected: at least one")

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the map."""
        return Coordinates(self.map.coordinates)

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The last of `times` returns of states of shape (N, n), with the words, turns, times and derivatives of all of them."""
        returns = self.map.first_return(as_states(states, self.coordinates), derivative)
        for _ in range(self.times - 1):
            returns = joined(returns, self.map.first_return(returns.image, derivative))
        return returns

    def extents(self, states: ArrayLike) -> Floats | None:
        """As of the map whose iterate it is; None where that has none."""
        return extents_of(self.map, as_states(states, self.coordinates))
