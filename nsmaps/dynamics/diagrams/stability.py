"""Stability diagrams: which motion attracts over two parameters, and the curves on which it changes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.dynamics.continuation.events import FOLD
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.diagrams.bifurcation import bifurcation
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.dynamics.returnmap import ReturnMap, map_or_reason
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.parallel import SERIAL, Arrays, Jobs, concatenated, divides
from nsmaps.progress import shows


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StabilityDiagram:
    """The attractor that one start reaches at W values of one parameter by V of another, rows followed along the other."""

    __repr__ = brief

    along: Floats  #: shape (V,), values of the parameter along which attractors are followed
    across: Floats  #: shape (W,), values of the other
    period: NDArray[np.int64]  #: shape (W, V), in returns; 0: none up to the longest looked for, -1: no attractor
    labels: NDArray[np.str_]  #: shape (W, V), such as 1:1/2T; "" where there is no attractor
    outcome: NDArray[np.int8]  #: shape (W, V), values of `Outcome`, of the last return; `invalid` where there is no map
    reasons: tuple[str, ...]  #: W texts, why there is no map at the first value of a row that has none; "" where all have

    def share(self, period: int) -> float:
        """Which share of the points has this period."""
        return float((self.period == period).mean())


@dataclass(frozen=True, slots=True, eq=False)
class EventCurve:
    """Where an event lies in one parameter over W values of another."""

    kind: str
    values: Floats  #: shape (W,), of the parameter that is continued; NaN where no event was found
    across: Floats  #: shape (W,), of the other
    precision: Floats  #: shape (W,), of the values
    reasons: tuple[str, ...]  #: W texts, why a branch ended without the event; "" where it has one


@divides
def stability_diagram(
    map_of: Callable[[float, float], ReturnMap],
    along: ArrayLike,
    across: ArrayLike,
    start: ArrayLike,
    longest: int = 16,
    transient: int = 1000,
    follow: Literal["up", "down"] | None = "down",
    tolerance: float = 1e-6,
    *,
    jobs: Jobs = SERIAL,
) -> StabilityDiagram:
    """The motions that attract over two parameters: a bifurcation diagram along one for each value of the other.

    A transient that is too short, as next to a period doubling, passes for chaos.

    Args:
        map_of: the return map at a value of each, such as `lambda d, r: system.at(d=d, r=r)`. A ValueError says there is none.
        along: shape (V,), of the first parameter, followed as in `bifurcation`.
        across: shape (W,), of the second.
        start: one state, shape (n,), of every row.
        longest: period looked for, in returns.
        transient, follow, tolerance: as in `bifurcation`.
        jobs: see `nsmaps.Jobs`; each row is a part, and `map_of` may then be such as `nsmaps.Along(system, "d", "r")`.

    Raises:
        NsmapsError, StateError: as `bifurcation`, where no row can be made.
    """
    rows, columns = np.atleast_1d(np.asarray(across, float)), np.atleast_1d(np.asarray(along, float))
    if rows.ndim != 1:
        raise NsmapsError(f"the values across have shape {rows.shape}; expected: one or more numbers in a row")
    how = np.asarray(start, float), longest, transient, follow, tolerance
    parts = [(map_of, columns, rows[cut], *how) for cut in jobs.cuts(len(rows))]
    made = concatenated(jobs.run(_rows, parts)) if parts else {}
    reasons = tuple(made["reason"].tolist()) if made else ()
    if all(reasons) and all((row == Outcome.invalid).all() for row in made.get("outcome", ())):
        raise NsmapsError(f"there is no row of {len(rows)}: {reasons[0] if reasons else 'no value across'}")
    return StabilityDiagram(columns, rows, made["period"], made["labels"], made["outcome"], reasons)


def _rows(map_of: Callable[[float, float], ReturnMap], columns: Floats, rows: Floats, *how: Any) -> Arrays:
    """What `_row` finds at some values of the other parameter, one after the other."""
    made = [_row(map_of, columns, value, *how) for value in rows.tolist()]
    return {name: np.stack([row[name] for row in made]) for name in made[0]}


def _row(
    map_of: Callable[[float, float], ReturnMap], columns: Floats, value: float, start: Floats, longest: int, *how: Any
) -> Arrays:
    """Periods and labels over the columns at one value of the other parameter, or why there are none."""
    try:
        made = bifurcation(_at(map_of, value), columns, start, 2 * longest, *how)
    except NsmapsError as error:
        none = {"period": np.full(len(columns), -1), "labels": np.full(len(columns), "")}
        outcome = np.full(len(columns), Outcome.invalid, np.int8)
        return {**none, "outcome": outcome, "reason": np.array(str(error))}
    period = np.where(made.held[:, 0], made.period[:, 0], -1)
    reason = np.array(next(filter(None, made.reasons), ""))
    return {"period": period, "labels": made.labels[:, 0], "outcome": made.outcome[:, 0], "reason": reason}


@shows
def event_curve(
    map_of: Callable[[float, float], ReturnMap],
    orbit: PeriodicOrbit,
    value: float,
    across: ArrayLike,
    kind: str,
    bounds: tuple[float, float],
    direction: Literal["up", "down"] = "down",
    step: float = 0.02,
) -> EventCurve:
    """The first event of a kind on the branch of an orbit in one parameter, before it folds, for each value of another.

    The orbit at `value` is taken from one value of the other parameter to the next, so that they should lie close; from there its
    branch is followed to the event.

    Args:
        map_of: the return map at a value of each parameter.
        orbit: at `value` and the first value across.
        across: shape (W,), in the order in which they are taken.
        kind: of the event, such as `period doubling`; see `Event`.
        value, bounds, direction, step: as in `continue_branch`.
    """
    rows = np.atleast_1d(np.asarray(across, float))
    found, precision = np.full((2, len(rows)), np.nan)
    reasons = [""] * len(rows)
    for k, other in enumerate(rows.tolist()):
        map, reasons[k] = map_or_reason(map_of, value, other)
        if map is None:
            continue
        here = periodic_orbit(map, orbit.states, len(orbit.states))
        made = continue_branch(_at(map_of, other), here, value, bounds, direction, step, until=(kind, FOLD))
        if events := made.of_kind(kind):
            found[k], precision[k] = events[0].parameter, events[0].precision
        else:
            reasons[k] = made.ended
        orbit = here if here.converged else orbit
    return EventCurve(kind, found, rows, precision, tuple(reasons))


def _at(map_of: Callable[[float, float], ReturnMap], second: float) -> Callable[[float], ReturnMap]:
    return lambda first: map_of(first, second)
