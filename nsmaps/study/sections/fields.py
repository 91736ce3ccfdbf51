"""The fields of a study's result, by the sections that compute them."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from nsmaps.arrays import Floats
from nsmaps.results import Result, array

if TYPE_CHECKING:
    from nsmaps.coordinates import Coordinates
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.exact.events import ModeTrack, Track


@dataclass(frozen=True, slots=True, eq=False)
class OrbitPair(Result):
    """The orbits of one start: of the exact map and, if the study has one, of the composite map."""

    start: Floats = field(metadata=array("coordinate", "initial state of both"))
    exact: "Orbit"
    composite: "Orbit | None"
    track: "Track | ModeTrack | None" = (
        None  #: the exact motion at and between its first impacts or events, if the study requests it
    )
    ends: "LimitSet | None" = None  #: the limit set of the exact orbit; None if the orbit ended
    composite_ends: "LimitSet | None" = None
    counterpart_ends: "LimitSet | None" = None  #: as `ends`, but only of the states after as many returns as the pieces have

    @property
    def coordinates(self) -> "Coordinates":
        """Those of the exact map, which are those of both."""
        return self.exact.coordinates


@dataclass(frozen=True, slots=True, eq=False)
class NoisyOptimum(Result):
    """The observable at an optimum under noise, for each of K amplitudes."""

    sigma: tuple[float, ...]
    value: Floats = field(metadata=array("amplitude", "mean over all realisations that did not end"))
    error: Floats = field(metadata=array("amplitude", "standard error"))
