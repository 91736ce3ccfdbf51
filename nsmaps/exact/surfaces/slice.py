"""First returns along one coordinate at fixed values of the others: a section of the return surfaces."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.continuation.bisection import bisect_change
from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Axis
from nsmaps.results import NONE, Result, array, array_property, units_of

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

HALVINGS = 60  #: share of the interval in which the itinerary changes: to rounding
APART = 1e-2  #: share of the largest speed, or radians: images on the sides of a jump differ by more, of a graze by less


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Slice(Result):
    """The first returns of N states along one coordinate, in order, and the places where the map jumps between two of them."""

    along: str  #: the coordinate that varies
    at: dict[str, float]  #: the others
    returns: Returns
    jump: NDArray[np.bool_] = field(
        metadata=array("step", "the image jumps from this state to the next, or an angle of it is wrapped", NONE)
    )
    units: Mapping[str, str] = field(default_factory=dict)
    picture: ClassVar[str] = "nsmaps.figures.returns.slices"

    def summary(self) -> str:
        """The numbers that matter."""
        at = ", ".join(f"{name} = {value:.4g}" for name, value in self.at.items())
        return f"along {self.along} at {at}: {int(self.jump.sum())} jumps; {self.returns}"

    @property
    def coordinates(self) -> Coordinates:
        """The names of the coordinates."""
        return self.returns.coordinates

    @array_property("value", "starts along the coordinate that varies", name="along")
    def values(self) -> Floats:
        """Shape (N,)."""
        return self.returns.start[:, self.coordinates.index(self.along)]

    @array_property("value coordinate", "where the return arrives; angles in [0, 2 pi)")
    def image(self) -> Floats:
        """Shape (N, n)."""
        return self.returns.image

    @array_property("value", "impact word", NONE)
    def words(self) -> NDArray[np.str_]:
        """Shape (N,)."""
        return self.returns.words


def slice_along(system: "System", along: str, axis: Axis, at: Mapping[str, float]) -> Slice:
    """The first returns along one coordinate of a system, the others held at given values.

    Besides those of the axis there are the two states on either side of each edge of the map's smooth pieces: where the itinerary
    (`ImpactSystem.itineraries`) changes, found by bisection, one edge between two values of the axis. A jump is an edge with
    different images on its sides; a graze need not be one.

    Raises:
        NsmapsError: the coordinates are not the system's, each once.
    """
    if along in at or {along, *at} != set(system.coordinates):
        given = ", ".join([along, *at])
        raise NsmapsError(f"a slice of the coordinates {given}; expected: {system.coordinates}, each once")

    def states(x: Floats) -> Floats:
        return np.column_stack([x if name == along else np.full(len(x), at[name]) for name in system.coordinates])

    x = axis.values()
    keys = _keys(system, states(x))
    changed = (keys[1:] != keys[:-1]).any(axis=1)
    sides = x[:-1][changed], x[1:][changed], keys[:-1][changed], keys[1:][changed]
    low, high, _ = bisect_change(lambda x: _keys(system, states(x)), *sides, halvings=HALVINGS)
    x = np.unique(np.concatenate([x, low, high]))
    returns = system.first_return(states(x))
    below = np.isin(x[:-1], low) & np.isin(x[1:], high)
    scale = np.where(system.coordinates.angles, 1.0, np.nanmax(np.abs(returns.image), axis=0, initial=0.0))
    near = (np.abs(np.diff(returns.image, axis=0)) <= APART * scale).all(axis=1)
    return Slice(along, dict(at), returns, below & ~near, units_of(system))


def _keys(system: "System", states: Floats) -> NDArray[np.int64]:
    """The invariants of one smooth piece of the map: itinerary, whether there is an image, turns; shape (N, 2 + n)."""
    returns = system.first_return(states)
    return np.column_stack([system.itineraries(states).codes, returns.valid, returns.turns])
