"""The speeds of impacts on every wall over a parameter, with or without noise: fig. comp_stoch."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.dynamics.noise.orbits import Noise, noisy_orbits
from nsmaps.errors import NsmapsError
from nsmaps.parallel import SERIAL, Arrays, Jobs, divides

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

KEPT = 3  #: impacts that are kept for each return


@dataclass(frozen=True, slots=True, eq=False)
class ImpactDiagram:
    """Impacts in the long run, for V values of a parameter: K each, NaN where there were fewer."""

    walls: tuple[str, ...]
    noise: Noise
    follow: Literal["up", "down"]
    values: Floats  #: shape (V,), in the order in which they were taken
    wall: Floats  #: shape (V, K), index of the wall
    speed: Floats  #: shape (V, K), impact speed, at least zero


@divides
def impact_diagram(
    system_of: "Callable[[float], ImpactSystem]",
    values: ArrayLike,
    state: ArrayLike,
    noise: Noise,
    follow: Literal["up", "down"],
    returns: int = 60,
    transient: int = 500,
    seed: int = 0,
    step: float | None = None,
    *,
    jobs: Jobs = SERIAL,
) -> ImpactDiagram:
    """The impacts of one orbit that is followed through growing ("up") or falling ("down") values of a parameter.

    At each value the transient's returns are made and forgotten, and the impacts of `returns` more are kept, three a return at
    most. The noise begins anew from its long-run law. An orbit that ended starts again from the state given. Without noise
    (sigma = 0) these are the deterministic impacts. The whole orbit is one part of `jobs`, see `nsmaps.Jobs`.

    Raises:
        NsmapsError: a direction that is none; others as `noisy_orbits`.
    """
    if follow not in ("up", "down"):
        raise NsmapsError(f"follow is {follow!r}; expected: 'up' or 'down'")
    along = np.sort(np.atleast_1d(np.asarray(values, float)))[:: 1 if follow == "up" else -1]
    parts = [(system_of, along, np.asarray(state, float), noise, returns, transient, seed, step)]
    (made,) = jobs.run(_impacts, parts)
    return ImpactDiagram(tuple(made["walls"].tolist()), noise, follow, along, made["wall"], made["speed"])


def _impacts(
    system_of: "Callable[[float], ImpactSystem]",
    along: Floats,
    state: Floats,
    noise: Noise,
    returns: int,
    transient: int,
    seed: int,
    step: float | None,
) -> Arrays:
    """Walls and speeds at values, taken in this order, and the names of the walls."""
    now, kept = state, []
    for k, value in enumerate(along.tolist()):
        system = system_of(value)
        settled = noisy_orbits(system, now, transient, noise, 1, [seed, 2 * k], step).states[-1, 0]
        settled = settled if np.isfinite(settled).all() else state
        made = noisy_orbits(system, settled, returns, noise, 1, [seed, 2 * k + 1], step, impacts=KEPT * returns)
        now = made.states[-1, 0] if made.held.all() else state
        kept.append(made.impacts[0])
    table = np.stack(kept)
    return {"wall": table[..., 0], "speed": table[..., 1], "walls": np.array(made.walls, str)}
