"""Stability diagrams: the attracting motion over two parameters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.coordinates import StateLike
from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram
from nsmaps.dynamics.returnmap import starts_under
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.parallel import NOT_COMPUTED, SERIAL, Arrays, Jobs, concatenated, divides


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StabilityDiagram:
    """The attractor that one start reaches at W values of one parameter by V of another, rows followed along the other."""

    __repr__ = brief

    along: Floats  #: shape (V,), values of the parameter along which attractors are followed
    across: Floats  #: shape (W,), values of the other
    period: NDArray[np.int64]  #: shape (W, V), in returns; 0: none up to `max_period`, -1: no attractor
    labels: NDArray[np.str_]  #: shape (W, V), such as 1:1/2T; "" where there is no attractor
    outcome: NDArray[np.int8]  #: shape (W, V), values of `Outcome`, of the last return; `invalid` without a map
    reasons: tuple[str, ...]  #: W texts, the first reason why a row has no map; "" where all values have one

    def share(self, period: int) -> float:
        """The fraction of the points that have this period."""
        return float((self.period == period).mean())


@dataclass(frozen=True, slots=True, eq=False)
class EventCurve:
    """The values of one parameter at which an event occurs, over W values of another, as runs of earlier versions hold them."""

    kind: str
    values: Floats  #: shape (W,), of the parameter that is continued; NaN where no event was found
    across: Floats  #: shape (W,), of the other
    precision: Floats  #: shape (W,), of the values
    reasons: tuple[str, ...]  #: W texts, the reason why a branch ended without the event; "" where it has the event

    @property
    def parameters(self) -> Floats:
        """Shape (W, 2), as of a `BifurcationCurve`."""
        return np.column_stack([self.values, self.across])

    @property
    def ended(self) -> tuple[str, ...]:
        """The reasons why it has no point, without repetition."""
        return tuple(dict.fromkeys(filter(None, self.reasons)))

    @property
    def special(self) -> tuple[()]:
        """None was located."""
        return ()


@divides
def stability_diagram(
    map_of: Callable[[float, float], ReturnMap],
    along: ArrayLike,
    across: ArrayLike,
    start: StateLike,
    max_period: int = 16,
    discard: int = 1000,
    direction: Literal["up", "down"] | None = "down",
    tolerance: float = 1e-6,
    *,
    jobs: Jobs = SERIAL,
) -> StabilityDiagram:
    """The motions that attract over two parameters: a bifurcation diagram along one for each value of the other.

    If the transient is too short, as near a period doubling, a point may be classified as chaos.

    Args:
        map_of: the return map at a value of each, such as `lambda d, r: system.at(d=d, r=r)`. It may raise a ValueError.
        along: shape (V,), of the first parameter, followed as in `bifurcation`.
        across: shape (W,), of the second.
        start: one state, shape (n,), of every row.
        max_period: longest period tested, in returns.
        discard, direction, tolerance: as in `bifurcation`.
        jobs: see `nsmaps.Jobs`; each row is a part, and `map_of` may then be such as `nsmaps.Along(system, "d", "r")`.

    Raises:
        NsmapsError, StateError: as for `bifurcation`, if no row has a map.
    """
    rows, columns = np.atleast_1d(np.asarray(across, float)), np.atleast_1d(np.asarray(along, float))
    if rows.ndim != 1:
        raise NsmapsError(f"the values across have shape {rows.shape}; expected: one or more numbers, shape (W,)")
    pairs = np.array([(x, y) for y in rows for x in columns]).reshape(-1, 2)
    now, how = starts_under(map_of, pairs, start), (2 * max_period, discard, direction, tolerance)
    cuts = jobs.cuts(len(rows))
    parts = [(map_of, columns, rows[cut], now, *how) for cut in cuts]

    def unfinished(found: Mapping[int, Arrays]) -> StabilityDiagram:
        missing = [_stacked([_without_map(columns, NOT_COMPUTED)] * len(rows[cut])) for cut in cuts]
        return _diagram(columns, rows, concatenated([found.get(k, part) for k, part in enumerate(missing)]))

    if not parts:
        raise NsmapsError("none of 0 rows has a map: no value across")
    found = _diagram(columns, rows, concatenated(jobs.run(_rows, parts, unfinished)))
    if all(found.reasons) and (found.outcome == Outcome.invalid).all():
        raise NsmapsError(f"none of {len(rows)} rows has a map: {found.reasons[0]}")
    return found


def _diagram(columns: Floats, rows: Floats, tables: Arrays) -> StabilityDiagram:
    """The diagram of the arrays of all rows."""
    return StabilityDiagram(
        columns, rows, tables["period"], tables["labels"], tables["outcome"], tuple(tables["reason"].tolist())
    )


def _rows(map_of: Callable[[float, float], ReturnMap], columns: Floats, rows: Floats, *how: Any) -> Arrays:
    """The arrays of `_row` at some values of the other parameter."""
    return _stacked([_row(map_of, columns, value, *how) for value in rows.tolist()])


def _stacked(rows: list[Arrays]) -> Arrays:
    """The arrays of several rows, along their first axis."""
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def _without_map(columns: Floats, reason: str) -> Arrays:
    """The arrays of a row without a map, for this reason."""
    none = {"period": np.full(len(columns), -1), "labels": np.full(len(columns), "")}
    return {**none, "outcome": np.full(len(columns), Outcome.invalid, np.int8), "reason": np.array(reason)}


def _row(
    map_of: Callable[[float, float], ReturnMap],
    columns: Floats,
    value: float,
    start: Floats,
    n_returns: int,
    transient: int,
    direction: Literal["up", "down"] | None,
    tolerance: float,
) -> Arrays:
    """Periods and labels over the columns at one value of the other parameter, or the reason why there are none."""
    try:
        diagram = bifurcation_diagram(
            _at(map_of, value),
            "",
            columns,
            start,
            n_returns=n_returns,
            transient=transient,
            direction=direction,
            tolerance=tolerance,
        )
    except NsmapsError as error:
        return _without_map(columns, str(error))
    period = np.where(diagram.held[:, 0], diagram.period[:, 0], -1)
    reason = np.array(next(filter(None, diagram.reasons), ""))
    return {"period": period, "labels": diagram.labels[:, 0], "outcome": diagram.outcome[:, 0], "reason": reason}


def _at(map_of: Callable[[float, float], ReturnMap], second: float) -> Callable[[float], ReturnMap]:
    return lambda first: map_of(first, second)
