"""The speeds of impacts on every wall over a parameter, with or without noise: fig. comp_stoch."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import StateLike
from nsmaps.dynamics.noise.law import Noise
from nsmaps.dynamics.noise.orbits import noisy_orbits
from nsmaps.dynamics.returnmap import nearest_starts, starts_under
from nsmaps.errors import NsmapsError
from nsmaps.parallel import SERIAL, Arrays, Jobs, divides
from nsmaps.results import NONE, Result, array

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

KEPT = 3  #: impacts that are kept for each return


@dataclass(frozen=True, slots=True, eq=False)
class ImpactDiagram(Result):
    """Impacts after a transient, for V values of a parameter: K each, NaN where there were fewer."""

    walls: tuple[str, ...]
    noise: Noise
    direction: Literal["up", "down"]
    values: Floats = field(metadata=array("value", "values of the parameter, in the order in which they were taken"))
    wall: Floats = field(metadata=array("value impact", "index of the wall", NONE))
    speed: Floats = field(metadata=array("value impact", "impact speed, at least zero"))


@divides
def impact_diagram(
    system_of: "Callable[[float], System]",
    values: ArrayLike,
    state: StateLike,
    noise: Noise,
    direction: Literal["up", "down"],
    returns: int = 60,
    discard: int = 500,
    seed: int = 0,
    step: float | None = None,
    *,
    jobs: Jobs = SERIAL,
) -> ImpactDiagram:
    """The impacts of one orbit that is followed through ascending ("up") or descending ("down") values of a parameter.

    At each value `discard` returns are computed as the transient, and the impacts of the next `returns` are stored, at most
    three per return. The noise starts from its stationary law at each value. An orbit that ended starts again from `state`.
    Without noise (sigma = 0) these are the deterministic impacts. The whole orbit is one part of `jobs`, see `nsmaps.Jobs`.

    Raises:
        NsmapsError: the direction is neither "up" nor "down"; others as for `noisy_orbits`.
    """
    if direction not in ("up", "down"):
        raise NsmapsError(f"direction is {direction!r}; expected: 'up' or 'down'")
    along = np.sort(np.atleast_1d(np.asarray(values, float)))[:: 1 if direction == "up" else -1]
    parts = [(system_of, along, starts_under(system_of, along, state), noise, returns, discard, seed, step)]
    (tables,) = jobs.run(_impacts, parts)
    return ImpactDiagram(tuple(tables["walls"].tolist()), noise, direction, along, tables["wall"], tables["speed"])


def _impacts(
    system_of: "Callable[[float], System]",
    along: Floats,
    state: Floats,
    noise: Noise,
    returns: int,
    discard: int,
    seed: int,
    step: float | None,
) -> Arrays:
    """Walls and speeds at values, taken in this order, and the names of the walls."""
    now, kept = state, []
    for k, value in enumerate(along.tolist()):
        system = system_of(value)
        start = noisy_orbits(system, nearest_starts(system, now), discard, noise, 1, [seed, 2 * k], step).states[-1, 0]
        start = nearest_starts(system, start if np.isfinite(start).all() else state)
        orbits = noisy_orbits(system, start, returns, noise, 1, [seed, 2 * k + 1], step, impacts=KEPT * returns)
        now = orbits.states[-1, 0] if orbits.held.all() else state
        kept.append(orbits.impacts[0])
    table = np.stack(kept)
    return {"wall": table[..., 0], "speed": table[..., 1], "walls": np.array(orbits.walls, str)}
