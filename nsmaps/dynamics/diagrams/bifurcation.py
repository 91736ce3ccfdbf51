"""Bifurcation diagrams: the attractors of a return map over the values of a parameter (figs. bifexact, bifapprox)."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import StateLike
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, diagram_so_far, unnamed
from nsmaps.dynamics.diagrams.parts import Sweep, attractors_at
from nsmaps.dynamics.diagrams.windows import windows
from nsmaps.dynamics.returnmap import check_values, map_along, starts_under
from nsmaps.errors import NsmapsError, check_choice
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.parameters import System
from nsmaps.parallel import SERIAL, Parallel, divides
from nsmaps.results import units_of

STATES = 0.7  #: share of the work that the states are assumed to take, for `progress`; the rest is that of these orbits


@divides
def bifurcation_diagram(
    system: System | Callable[[float], ReturnMap],
    parameter: str,
    values: ArrayLike,
    starts: StateLike,
    *,
    n_returns: int = 60,
    transient: int = 2000,
    direction: Literal["up", "down", "both"] | None = None,
    tolerance: float = 1e-6,
    borders: bool = False,
    parallel: Parallel = SERIAL,
) -> BifurcationDiagram:
    """The attractors over the values of a parameter, as in remark num_bif.

    What orbits end on is decided as by `nsmaps.dynamics.limits.decision.limits`, of those that do not repeat in the K returns
    that are stored by up to 5000 more: C names chaos alone, Q quasi-periodic motion, `unresolved` motion of which neither was
    shown, and `escapes` orbits that leave every bound. One on an unstable cycle up to rounding starts again from beside it.

    Args:
        system: a system, or a function of the parameter that gives the return map. A value at which it raises a ValueError, as
            for a parameter out of range, has no map and is skipped.
        parameter: its name.
        values: shape (V,).
        starts: one state, shape (n,) or by name, or some, shape (S, n), phases in radians; at each value they are one batch.
        n_returns: number stored at each value.
        transient: number computed before these and discarded as the transient.
        direction: the last states at one value are the starts at the next, in ascending ("up") or descending ("down") order. An
            orbit that ended starts again from its start at that value. With "both" there are 2 S orbits, the ascending ones
            first. With None the orbits at every value begin at the given starts.
        tolerance: largest difference of a coordinate after a period, of an angle in radians, of others relative to the extent
            of the motion, between events too; see `nsmaps.dynamics.scale.scale_of`.
        borders: whether the borders of the widest windows are located, too; see `nsmaps.dynamics.diagrams.windows.windows`.
        parallel: see `nsmaps.Parallel`. Parts are values, as many as make
            100,000 returns; with `direction` every start is followed through the values of a part separately.

    Raises:
        StateError: the starts do not have the map's coordinates.
        NsmapsError: another argument is not valid, the system has no such parameter, or no value has a map.
    """
    map_of, along = map_along(system, parameter), np.atleast_1d(np.asarray(values, float))
    now = np.atleast_2d(starts_under(map_of, along, starts))
    _check(along, n_returns, transient, direction)
    if direction == "both":
        how: Any = {"n_returns": n_returns, "transient": transient, "tolerance": tolerance}
        one_way = partial(bifurcation_diagram, map_of, parameter, along, now, **how)
        up = one_way(direction="up", parallel=parallel.share(0.0, 0.5, "up"))
        found = _beside(up, one_way(direction="down", parallel=parallel.share(0.5, 1.0, "down")))
    else:
        found = _diagram(map_of, parameter, along, now, n_returns, transient, tolerance, direction, parallel)
    wide = windows(found, map_of, now, transient, direction) if borders else ()
    return replace(found, windows=wide, units=units_of(system), direction=direction or "")


def _diagram(
    map_of: Callable[[float], ReturnMap],
    parameter: str,
    along: Floats,
    starts: Floats,
    n_returns: int,
    transient: int,
    tolerance: float,
    direction: Literal["up", "down"] | None,
    parallel: Parallel,
) -> BifurcationDiagram:
    """The diagram of starts (S, n) in one direction."""
    order = np.argsort(-along if direction == "down" else along, kind="stable")
    if not parallel.divided or not len(starts):
        first = starts if direction else None
        blocks = [(order, slice(None), attractors_at(map_of, along[order], starts, n_returns, transient, tolerance, first))]
    else:
        so_far = partial(diagram_so_far, parameter, along, starts)
        sweep = Sweep(map_of, along, order, n_returns, transient, tolerance, parallel.share(0.0, STATES, "states"), so_far)
        blocks = sweep.followed(starts) if direction else sweep.independent(starts)
    found = unnamed(parameter, along, starts, blocks)
    return found.named(map_of, tolerance, parallel.share(STATES, 1.0, "limits"))


def _beside(one: BifurcationDiagram, other: BifurcationDiagram) -> BifurcationDiagram:
    """The diagram of the orbits of both over the same values."""
    rows: Any = {
        name: np.concatenate([getattr(one, name), getattr(other, name)], axis=1)
        for name in ("states", "settled", "turns", "codes", "outcome", "period", "labels", "length")
    }
    ends = None if one.ends is None and other.ends is None else rows["settled"]
    return replace(one, ends=ends, **{name: row for name, row in rows.items() if name != "settled"})


def _check(values: Floats, n_returns: int, transient: int, direction: object) -> None:
    check_values(values)
    if n_returns < 1 or transient < 0:
        raise NsmapsError(f"{n_returns} returns after {transient}; expected: at least 1 after at least 0")
    check_choice("direction", direction, ("up", "down", "both", None))
