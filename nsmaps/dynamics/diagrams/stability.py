"""Stability diagrams: the attracting motion over two parameters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import StateLike
from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram
from nsmaps.dynamics.returnmap import map_along, starts_under
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.parameters import System
from nsmaps.parallel import NOT_COMPUTED, SERIAL, Arrays, Parallel, concatenated, divides
from nsmaps.results import NONE, RETURNS, Result, array, frequent, range_text, units_of


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StabilityDiagram(Result):
    """The attractor that one start reaches at W values of one parameter by V of another, rows followed along the other."""

    picture: ClassVar[str] = "nsmaps.figures.parameters.stability"

    parameters: tuple[str, str]  #: names of the one along which attractors are followed, and of the other
    along: Floats = field(metadata=array("along", "values of the first parameter", name="first"))
    across: Floats = field(metadata=array("across", "values of the second parameter", name="second"))
    period: NDArray[np.int64] = field(metadata=array("across along", "0: none up to `max_period`, -1: no attractor", RETURNS))
    labels: NDArray[np.str_] = field(metadata=array("across along", "motion, such as 1:1/2T; empty without attractor", NONE))
    outcome: NDArray[np.int8] = field(metadata=array("across along", f"of the last return: {OUTCOMES}", NONE))
    reasons: tuple[str, ...]  #: W texts, the first reason why a row has no map; "" where all values have one
    units: Mapping[str, str] = field(default_factory=dict)  #: of parameters, by name

    def summary(self) -> str:
        """The numbers that matter."""
        along, across = range_text(self.first, self.along), range_text(self.second, self.across)
        return f"{along}, {across}: {frequent(self.labels)}"

    @property
    def first(self) -> str:
        """The name of the parameter along."""
        return self.parameters[0]

    @property
    def second(self) -> str:
        """The name of the parameter across."""
        return self.parameters[1]

    def share(self, period: int) -> float:
        """The fraction of the points that have this period."""
        return float((self.period == period).mean())


@divides
def stability_diagram(
    system: System | Callable[[float, float], ReturnMap],
    plane: Mapping[str, ArrayLike],
    start: StateLike,
    *,
    max_period: int = 16,
    transient: int = 1000,
    direction: Literal["up", "down"] | None = "down",
    tolerance: float = 1e-6,
    parallel: Parallel = SERIAL,
) -> StabilityDiagram:
    """The motions that attract over two parameters: a bifurcation diagram along one for each value of the other.

    If the transient is too short, as near a period doubling, a point may be classified as chaos.

    Args:
        system: a system, or a function of both parameters that gives the return map and may raise a ValueError.
        plane: the values of two parameters by name, shapes (V,) and (W,), followed along the first as in `bifurcation_diagram`.
        start: one state, shape (n,), of every row.
        max_period: longest period tested, in returns.
        transient, direction, tolerance: as in `bifurcation_diagram`.
        parallel: see `nsmaps.Parallel`; each row is a part.

    Raises:
        NsmapsError, StateError: as for `bifurcation_diagram`, there are not two parameters, or no row has a map.
    """
    if len(plane) != 2:
        raise NsmapsError(f"the plane is of {', '.join(plane) or 'no parameter'}; expected: two parameters with their values")
    parameters = tuple(map(str, plane))
    map_of = map_along(system, *parameters)
    columns, rows = (np.atleast_1d(np.asarray(values, float)) for values in plane.values())
    if rows.ndim != 1:
        raise NsmapsError(f"the values across have shape {rows.shape}; expected: one or more numbers, shape (W,)")
    pairs = np.array([(x, y) for y in rows for x in columns]).reshape(-1, 2)
    now, how = starts_under(map_of, pairs, start), (2 * max_period, transient, direction, tolerance)
    cuts = parallel.cuts(len(rows))
    parts = [(map_of, columns, rows[cut], now, *how) for cut in cuts]

    def diagram(tables: Arrays) -> StabilityDiagram:
        found = tables["period"], tables["labels"], tables["outcome"], tuple(tables["reason"].tolist())
        return StabilityDiagram((parameters[0], parameters[1]), columns, rows, *found, units_of(system))

    def unfinished(found: Mapping[int, Arrays]) -> StabilityDiagram:
        missing = [_stacked([_without_map(columns, NOT_COMPUTED)] * len(rows[cut])) for cut in cuts]
        return diagram(concatenated([found.get(k, part) for k, part in enumerate(missing)]))

    if not parts:
        raise NsmapsError("there is no value across; expected: one or more, each of which is a row")
    found = diagram(concatenated(parallel.run(_rows, parts, unfinished)))
    if all(found.reasons) and (found.outcome == Outcome.invalid).all():
        raise NsmapsError(f"none of {len(rows)} rows has a map: {found.reasons[0]}")
    return found


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
