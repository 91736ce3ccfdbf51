"""The speeds of impacts on every wall over a parameter, with or without noise: fig. comp_stoch."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Random, entropy_of
from nsmaps.coordinates import StateLike
from nsmaps.dynamics.noise.law import Noise
from nsmaps.dynamics.noise.orbits import noisy_orbits
from nsmaps.dynamics.returnmap import map_along, nearest_starts, starts_under
from nsmaps.errors import check_choice
from nsmaps.parallel import SERIAL, Arrays, Parallel, divides
from nsmaps.results import NONE, Result, array, range_text, units_of

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

KEPT = 3  #: impacts that are kept for each return


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ImpactDiagram(Result):
    """Impacts after a transient, for V values of a parameter: K each, NaN where there were fewer."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.noise"

    walls: tuple[str, ...]
    noise: Noise
    direction: Literal["up", "down"]
    parameter: str
    values: Floats = field(
        metadata=array("value", "values of the parameter, in the order in which they were taken", name="parameter")
    )
    wall: Floats = field(metadata=array("value impact", "index of the wall", NONE))
    speed: Floats = field(metadata=array("value impact", "impact speed, at least zero"))
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates and the parameter, by name

    def summary(self) -> str:
        """The numbers that matter."""
        impacts = int(np.isfinite(self.speed).sum())
        over = range_text(self.parameter, self.values)
        return f"{over}, {self.direction}, sigma = {self.noise.sigma:g}: {impacts} impacts"


@divides
def impact_diagram(
    model: "System | Callable[[float], System]",
    parameter: str,
    values: ArrayLike,
    start: StateLike,
    noise: Noise,
    direction: Literal["up", "down"],
    n_returns: int = 60,
    transient: int = 500,
    rng: Random = 0,
    step: float | None = None,
    *,
    parallel: Parallel = SERIAL,
) -> ImpactDiagram:
    """The impacts of one orbit that is followed through ascending ("up") or descending ("down") values of a parameter.

    At each value the impacts of `n_returns` returns after the transient are stored, at most three per return. The noise starts
    from its stationary law at each value. An orbit that ended starts again from `start`. Without noise (sigma = 0) these are the
    deterministic impacts. The whole orbit is one part of `parallel`, see `nsmaps.Parallel`.

    Args:
        model: a system with this parameter, or a function of its value that gives the system.

    Raises:
        NsmapsError: the direction is neither "up" nor "down", or there is no such parameter; others as for `noisy_orbits`.
    """
    check_choice("direction", direction, ("up", "down"))
    along = np.sort(np.atleast_1d(np.asarray(values, float)))[:: 1 if direction == "up" else -1]
    system_of = map_along(model, parameter)
    parts = [(system_of, along, starts_under(system_of, along, start), noise, n_returns, transient, entropy_of(rng), step)]
    (tables,) = parallel.run(_impacts, parts)
    about = tuple(tables["walls"].tolist()), noise, direction, parameter, along
    return ImpactDiagram(*about, tables["wall"], tables["speed"], units_of(model))


def _impacts(
    system_of: "Callable[[float], System]",
    along: Floats,
    state: Floats,
    noise: Noise,
    returns: int,
    discard: int,
    seed: int | Sequence[int],
    step: float | None,
) -> Arrays:
    """Walls and speeds at values, taken in this order, and the names of the walls."""
    now, kept, entropy = state, [], np.atleast_1d(np.asarray(seed)).tolist()
    for k, value in enumerate(along.tolist()):
        system = system_of(value)
        before = noisy_orbits(system, nearest_starts(system, now), noise, n_returns=discard, rng=[*entropy, 2 * k], step=step)
        start = before.states[-1, 0]
        start = nearest_starts(system, start if np.isfinite(start).all() else state)
        orbits = noisy_orbits(
            system, start, noise, n_returns=returns, rng=[*entropy, 2 * k + 1], step=step, max_impacts=KEPT * returns
        )
        now = orbits.states[-1, 0] if orbits.held.all() else state
        kept.append(orbits.impacts[0])
    table = np.stack(kept)
    return {"wall": table[..., 0], "speed": table[..., 1], "walls": np.array(orbits.walls, str)}
