"""The agreement of the attractors of two maps over a parameter, such as a fitted map and the exact one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from math import nan

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.distance import extents, hausdorff
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
from nsmaps.dynamics.motion import kind_of
from nsmaps.errors import NsmapsError
from nsmaps.results import NONE, Result, array

SAMPLE = 50  #: fewest states without a period whose halves are compared
SETTLED = 0.1  #: largest change of the states of a cycle in a period, in the tolerance of its distance from another


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Agreement(Result):
    """The attractors of a map beside those of the exact map at V values of a parameter, from S starts each."""

    coordinates: Coordinates
    parameter: str
    values: Floats = field(metadata=array("value", "values of the parameter, ascending", name="parameter"))
    exact: NDArray[np.str_] = field(metadata=array("value start", "motion of the exact map; empty where an orbit ended", NONE))
    labels: NDArray[np.str_] = field(metadata=array("value start", "motion of the other map", NONE))
    distance: Floats = field(metadata=array("value start", "Hausdorff distance; NaN without both attractors or a cycle", "scale"))
    holds: Bools = field(metadata=array("value", "where the attractors agree", NONE))
    tolerance: float  #: largest distance of attractors that agree, in the scale
    scale: Floats = field(metadata=array("coordinate", "unit of distances in each coordinate"))
    starts: Floats | None = field(default=None, metadata=array("start coordinate", "of the orbits that were compared"))

    def disagreements(self, apart_from: Sequence[tuple[float, float]] = ()) -> Iterator["Disagreement"]:
        """The intervals of neighbouring values at which the maps disagree, outside some closed intervals."""
        bad = ~self.holds & ~self.in_intervals(apart_from)
        for is_bad, run in groupby(range(len(self.values)), lambda k: bool(bad[k])):
            rows = list(run)
            if is_bad:
                exact, labels = (tuple(dict.fromkeys(of[rows].ravel().tolist())) for of in (self.exact, self.labels))
                distances = self.distance[rows]
                furthest = float(np.nanmax(distances)) if np.isfinite(distances).any() else nan
                yield Disagreement(float(self.values[rows[0]]), float(self.values[rows[-1]]), len(rows), exact, labels, furthest)

    def in_intervals(self, intervals: Sequence[tuple[float, float]]) -> Bools:
        """Which values lie in one of some closed intervals, shape (V,)."""
        inside = [(low <= self.values) & (self.values <= high) for low, high in intervals]
        return np.logical_or.reduce(inside) if inside else np.zeros(len(self.values), bool)


@dataclass(frozen=True, slots=True)
class Disagreement:
    """An interval of the parameter at all of whose values two maps have different attractors."""

    low: float
    high: float
    count: int  #: number of values
    exact: tuple[str, ...]  #: motions of the exact map there
    labels: tuple[str, ...]  #: motions of the other map
    distance: float  #: largest distance of the attractors, in the scale; NaN where one of them is missing


def agreement(
    exact: BifurcationDiagram, other: BifurcationDiagram, tolerance: float = 0.03, scale: Floats | None = None
) -> Agreement:
    """The agreement of two diagrams over the same values, from the same starts.

    Attractors agree if they have the same period in returns, or the same kind of motion without one, and if their Hausdorff
    distance, the largest in a coordinate, is at most the tolerance; for samples without a period, of 50 states or more, at most
    twice that of the two halves of either sample, if this is larger. Orbits that end agree if both do. Orbits
    that had not reached their cycles in the returns of the diagram do not agree.

    Args:
        tolerance: largest distance, in the scale.
        scale: shape (n,), such as the sides of the box of states of interest; extents of all exact attractors if omitted.

    Raises:
        NsmapsError: the diagrams have other coordinates, values or numbers of starts, or the exact map has no attractor.
    """
    if exact.coordinates != other.coordinates or exact.held.shape != other.held.shape or (exact.values != other.values).any():
        raise NsmapsError("the diagrams have other coordinates, values or starts; expected: two maps over the same values")
    if not exact.held.any():
        raise NsmapsError("the exact map has no attractor at any value; expected: a start from which orbits do not end")
    if scale is None:
        scale = extents(exact.states[exact.held].reshape(-1, len(exact.coordinates)), exact.coordinates)
    distance, alike = np.full(exact.held.shape, np.nan), np.zeros(exact.held.shape, bool)
    for v, s in np.ndindex(*exact.held.shape):
        if exact.held[v, s] and other.held[v, s]:
            distance[v, s], alike[v, s] = _compared(exact, other, (v, s), tolerance, scale)
        else:
            alike[v, s] = exact.held[v, s] == other.held[v, s] and exact.labels[v, s] == other.labels[v, s]
    order = np.argsort(exact.values, kind="stable")
    labels, holds = (exact.labels[order], other.labels[order]), np.asarray(alike[order].all(axis=1))
    return Agreement(exact.coordinates, exact.parameter, exact.values[order], *labels, distance[order], holds, tolerance, scale)


def _compared(
    one: BifurcationDiagram, other: BifurcationDiagram, at: tuple[int, int], near: float, scale: Floats
) -> tuple[float, bool]:
    """The distance of two attractors, NaN where an orbit had not reached its cycle yet, and whether they agree."""
    coordinates, (p, q) = one.coordinates, (int(one.period[at]), int(other.period[at]))
    a, b = (_states(of, at, near * scale) for of in (one, other))
    if a is None or b is None:
        return nan, False
    distance = hausdorff(a, b, coordinates, scale, np.inf)
    if p or q:
        return distance, p == q and distance <= near
    halves = [np.array_split(states, 2) for states in (a, b) if len(states) >= SAMPLE]
    own = [2 * hausdorff(first, second, coordinates, scale, np.inf) for first, second in halves]
    return distance, kind_of(str(one.labels[at])) == kind_of(str(other.labels[at])) and distance <= max([near, *own])


def _states(diagram: BifurcationDiagram, at: tuple[int, int], near: Floats) -> Floats | None:
    """The last states of a period, or a sample of motion without one; None where the states do not repeat yet."""
    states, count = diagram.states[at], int(diagram.length[at])
    if not count:
        return states
    last, before = states[-count:], states[-2 * count : -count]
    settled = len(before) == count and (np.abs(diagram.coordinates.difference(last, before)) <= SETTLED * near).all()
    return last if settled else None
