"""The windows of a bifurcation diagram: the values over which a motion attracts, with borders located by bisection."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.continuation.bisection import bisect_change
from nsmaps.dynamics.continuation.events import DOUBLING, FOLD, HALVING, TORUS
from nsmaps.dynamics.diagrams.bifurcation import Bifurcation, bifurcation
from nsmaps.dynamics.motion import without_turns
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.dynamics.returnmap import ReturnMap, map_or_reason
from nsmaps.errors import NsmapsError

NARROWEST = 0.02  #: share of the range of the parameter: narrower windows have no borders
FEWEST = 4  #: values in a window; beside a doubling, motions that have not converged pass for chaos
LOCATED, CHANGED = 1e-8, 1e-6  #: shares of the range to which the end of a cycle and a change of motion are bisected
HALVED = 1e-6  #: the same where a cycle comes so near to one of half its period that Newton's method leads to this
BESIDE = 3  #: values by which the cycle of a window may reach into the window before it
MOVED, APART = (
    0.1,
    1e-5,
)  #: of the diagram's unit: a cycle's largest change in a step, its states' least difference
AT_ONE = 0.01  #: largest distance from 1 or -1 of a multiplier of the last cycle before a fold or a doubling
LABEL, WORDS, RANGE = "change of motion", "change of words", "end of the range"


@dataclass(frozen=True, slots=True)
class Border:
    """An end of a window."""

    value: float  #: of the parameter
    precision: float  #: length of the interval that was bisected to it; 0 at an end of the range
    kind: str  #: an event of its cycle, such as `period doubling`, `change of words`; `change of motion`, `end of the range`


@dataclass(frozen=True, slots=True)
class Window:
    """An interval of the parameter over which the first orbit of a diagram has one motion; "" where it has none."""

    label: str  #: the motion, such as 1:1/2T
    by_returns: str  #: its name where whole turns are unknown, as of fitted maps, such as 1:1, period 2
    low: Border
    high: Border


def windows(
    diagram: Bifurcation,
    map_of: Callable[[float], ReturnMap],
    starts: Floats,
    discard: int,
    direction: Literal["up", "down", "both"] | None = None,
) -> tuple[Window, ...]:
    """The windows of a diagram that are at least 1/50 of its range wide and have four values, in ascending order.

    A window with a cycle ends where the cycle ceases to be stable or to exist, by bisection with Newton's method to 1e-8 of the
    range. Elsewhere, as for chaos and at a crisis, it ends where an orbit that starts from the last states before the change has
    another motion, by bisection to 1e-6 of the range.

    Args:
        diagram: from `bifurcation` with the same other arguments; with "both" its first orbit is followed upwards.
        starts: shape (n,) or (S, n).
    """
    order = np.argsort(-diagram.values if direction == "down" else diagram.values, kind="stable")
    search = _Search(diagram, map_of, np.atleast_2d(starts)[0], discard, direction is not None, order)
    motions, begins, ends = list[tuple[str, str]](), list[Border](), list[Border]()
    for names, one, other in search.ends():
        motions, begins, ends = [*motions, names], [*begins, one], [*ends, other]
    for k in range(1, len(motions)):
        ends[k - 1], begins[k] = _as_doubled(ends[k - 1], begins[k], BESIDE * search.unit / len(order))
    pairs = [sorted(pair, key=lambda border: border.value) for pair in zip(begins, ends, strict=True)]
    found = [Window(*names, *pair) for names, pair in zip(motions, pairs, strict=True)]
    return tuple(sorted(found, key=lambda window: window.low.value))


@dataclass(frozen=True, eq=False)
class _Search:
    """A diagram whose values are taken in the order in which they are followed; a place is a position in this order."""

    diagram: Bifurcation
    map_of: Callable[[float], ReturnMap]
    start: Floats
    discard: int
    directed: bool
    order: NDArray[np.int64]

    def value(self, place: int) -> float:
        """The value of the parameter there."""
        return float(self.diagram.values[self.order[place]])

    @property
    def unit(self) -> float:
        """The range of the parameter."""
        return float(np.ptp(self.diagram.values))

    @cached_property
    def labels(self) -> NDArray[np.str_]:
        """The motion of the first orbit at each place."""
        return self.diagram.labels[self.order, 0]

    def ends(self) -> Iterator[tuple[tuple[str, str], Border, Border]]:
        """Both names of the motion of each window, where it begins and where it ends, in the order of the places."""
        labels = self.labels
        edges = np.flatnonzero(labels[1:] != labels[:-1])
        runs = zip([0, *(edges + 1).tolist()], [*edges.tolist(), len(labels) - 1], strict=True)
        wide = [(first, last) for first, last in runs if self._is_wide(first, last)]
        before = None
        for k, (first, last) in enumerate(wide):
            end = wide[k - 1][1] if k else -1
            begins = self._end(first, last, -1, max(end - BESIDE, 0))
            if begins is None:
                begins = before if before is not None and end + 1 == first else self._change(first, -1)
            limit = sum(wide[k + 1]) // 2 if k + 1 < len(wide) else len(labels) - 1
            before = self._end(last, first, 1, limit) or self._change(last, 1)
            yield (str(labels[first]), self._by_returns((first + last) // 2)), begins, before

    def _by_returns(self, place: int) -> str:
        """The name of the motion there, as if whole turns were unknown."""
        return without_turns(str(self.labels[place]), int(self.diagram.period[self.order[place], 0]))

    def _is_wide(self, first: int, last: int) -> bool:
        return last - first + 1 >= FEWEST and abs(self.value(last) - self.value(first)) >= NARROWEST * self.unit

    def _end(self, place: int, other: int, way: int, limit: int) -> Border | None:
        """Where the cycle of a window ends beyond its end at a place, up to a limit; None without a cycle, or if it continues.

        The cycle is first that at the middle of the window, which has converged.
        """
        row = self.order[(place + other) // 2]
        period = int(self.diagram.period[row, 0])
        value, states = self.value((place + other) // 2), self.diagram.states[row, 0, :period]
        found = self._cycle(value, states, None) if period == len(states) > 0 else None
        at, stride = (place + other) // 2, max(abs(place - other) // 2, 1)
        while found is not None and at != limit:
            there = min(at + stride, limit) if way > 0 else max(at - stride, limit)
            ahead = self._cycle(self.value(there), found.states, found)
            if ahead is None and stride == 1:
                return self._bisected(found, self.value(at), self.value(there))
            at, found, stride = (at, found, stride // 2) if ahead is None else (there, ahead, 2 * stride)
        return None if found is None or limit not in (0, len(self.order) - 1) else self._range(limit)

    def _range(self, place: int) -> Border:
        return Border(self.value(place), 0.0, RANGE)

    def _cycle(self, value: float, states: Floats, like: PeriodicOrbit | None) -> PeriodicOrbit | None:
        """The stable cycle of least period at a value near such states, with the words of another; None where there is none."""
        return self._continued(self._newton(value, states), states, like)

    def _continued(self, found: PeriodicOrbit | None, states: Floats, like: PeriodicOrbit | None) -> PeriodicOrbit | None:
        """The cycle to which Newton's method led from such states, if it is one as `_cycle` returns."""
        if (
            found is None
            or not found.stable
            or self._separation(found) <= APART
            or (like is not None and found.words != like.words)
        ):
            return None
        moved = np.abs(found.returns.coordinates.difference(found.states, states) / self.scale).max()
        return found if moved <= MOVED else None

    @cached_property
    def scale(self) -> Floats:
        """The unit of each coordinate in the diagram, shape (n,)."""
        return self.diagram.unit

    def _separation(self, cycle: PeriodicOrbit) -> float:
        """The least difference of a cycle from itself shifted by a part of its period, in the scale; inf for period 1."""
        states, coordinates = cycle.states, cycle.returns.coordinates
        shifts = [q for q in range(1, len(states) // 2 + 1) if len(states) % q == 0]
        gaps = [np.abs(coordinates.difference(np.roll(states, q, axis=0), states) / self.scale).max() for q in shifts]
        return float(min(gaps, default=np.inf))

    def _newton(self, value: float, states: Floats) -> PeriodicOrbit | None:
        """The cycle to which Newton's method leads from such states; None without one, or without a map or its derivative."""
        map, _ = map_or_reason(self.map_of, value)
        if map is None or map.first_return(states, derivative=True).derivative is None:
            return None
        found = periodic_orbit(map, states, len(states))
        return found if found.converged and found.exists else None

    def _bisected(self, cycle: PeriodicOrbit, value: float, beyond: float) -> Border:
        """The last value of the parameter with the cycle, between one with it and one without it.

        Where Newton's method leads to an unstable cycle of a part of the period, that has not yet taken the place of the cycle.
        """
        last, halved = [cycle], list[float]()

        def persists(values: Floats) -> NDArray[np.bool_]:
            states = last[-1].states
            found = self._newton(float(values[0]), states)
            if (cycle := self._continued(found, states, last[-1])) is not None:
                last.append(cycle)
                return np.array([True])
            part = found is not None and self._separation(found) <= APART
            halved.extend(values if part else [])
            return np.array([part and found is not None and found.stable is False])

        ends, yes = (np.array([value]), np.array([beyond])), np.array([True])
        low, high, _ = bisect_change(persists, *ends, yes, ~yes, LOCATED * self.unit)
        kind, width = HALVING if halved else _kind(last[-1]), float(np.abs(high - low)[0])
        return Border(float(low[0] + high[0]) / 2, max(width, HALVED * self.unit) if halved else width, kind)

    def _change(self, place: int, way: int) -> Border:
        """Where the motion of a window changes between its end at a place and the next place."""
        if place + way not in range(len(self.order)):
            return self._range(place)
        kept = self.diagram.states[self.order[min(place, place + way)], 0, -1]
        start = kept if self.directed and np.isfinite(kept).all() else self.start
        returns = self.diagram.states.shape[2]

        def motion(values: Floats) -> NDArray[np.str_]:
            try:
                return bifurcation(self.map_of, values, start, returns, self.discard).labels[:, 0]
            except NsmapsError:  # no map
                return np.array([""])

        places = [place, place + way]
        ends, labels = np.array([self.value(k) for k in places])[:, None], self.labels[places][:, None]
        low, high, _ = bisect_change(motion, ends[0], ends[1], labels[0], labels[1], CHANGED * self.unit)
        return Border(float(low[0] + high[0]) / 2, float(np.abs(high - low)[0]), LABEL)


def _as_doubled(one: Border, other: Border, near: float) -> tuple[Border, Border]:
    """The borders of two neighbours; where a cycle doubles, the doubled one ends, whose own end is less sharp."""
    if {one.kind, other.kind} != {DOUBLING, HALVING} or abs(one.value - other.value) > near:
        return one, other
    sharp = one if one.kind == DOUBLING else other
    return replace(sharp, kind=one.kind), replace(sharp, kind=other.kind)


def _kind(cycle: PeriodicOrbit) -> str:
    """What ends a cycle just beyond this one."""
    multipliers = cycle.multipliers
    if np.abs(multipliers + 1).min() < AT_ONE:
        return DOUBLING
    if np.abs(multipliers - 1).min() < AT_ONE:
        return FOLD
    return TORUS if np.abs(multipliers).max() > 1 - AT_ONE and np.abs(multipliers.imag).max() > 0 else WORDS
