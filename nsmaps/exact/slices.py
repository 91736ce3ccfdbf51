"""First returns along one coordinate while the others are held: a cut through the return surfaces."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Returns
from nsmaps.exact.surface import Axis

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem


@dataclass(frozen=True, slots=True, eq=False)
class Slice:
    """The first returns of N states along one coordinate, in order, and where the map jumps between two of them."""

    along: str  #: the coordinate that runs
    at: dict[str, float]  #: the others
    returns: Returns
    jump: NDArray[np.bool_]  #: shape (N - 1,), whether the map jumps from a state to the next; `slice_along`


def slice_along(system: "ImpactSystem", along: str, axis: Axis, at: Mapping[str, float]) -> Slice:
    """The first returns along one coordinate of a system, the others held at given values.

    A jump is a change of the outcome, of a whole turn of an angle, or of the itinerary, the walls met and turning points passed
    (`ImpactSystem.legs`): two neighbours with the same lie on one smooth piece. So a birth of turning points counts too.

    Raises:
        NsmapsError: the coordinates are not the system's, each once.
    """
    if along in at or {along, *at} != set(system.coordinates):
        given = ", ".join([along, *at])
        raise NsmapsError(f"a slice of the coordinates {given}; accepted: {', '.join(system.coordinates)}, each once")
    columns = [axis.values() if name == along else np.full(axis.points, at[name]) for name in system.coordinates]
    returns = system.first_return(np.column_stack(columns))
    own = np.column_stack([system.legs(returns.start).codes, returns.outcome, returns.turns])
    return Slice(along, dict(at), returns, np.asarray((own[1:] != own[:-1]).any(axis=1)))
