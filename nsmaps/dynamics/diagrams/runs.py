"""The runs of one motion in a bifurcation diagram, and where their cycles end."""

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.dynamics.diagrams.borders import MOST_STATES, WORDS, CycleSearch, End, Located
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, continued_diagram
from nsmaps.dynamics.limits.limit import Limit
from nsmaps.dynamics.limits.path import Path
from nsmaps.dynamics.motion import CHAOS, UNRESOLVED, kind_of, without_turns
from nsmaps.dynamics.orbit import returns_of
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.dynamics.rotation.number import only_counted, steps
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.piecewise import PiecewiseMap

NARROWEST = 0.02  #: share of the range of the parameter: narrower windows have no borders
FEWEST = 4  #: values in a window; beside a doubling, motions that have not converged pass for chaos
LONGER = 4  #: times as many returns, with which orbits that have not converged, and changes that they show, are tried again
ARRIVED = 0.02  #: in the scale of the motion: largest distance of an orbit that approaches a cycle
TRIED = 3  #: values at the end of a run at which its cycle is sought, where it may not have converged


@dataclass(frozen=True, eq=False)
class Runs:
    """A diagram whose values are taken in the order in which they are followed; a place is a position in this order.

    A run is a range of places with one motion of the first orbit: its first and last place.
    """

    diagram: BifurcationDiagram
    map_of: Callable[[float], ReturnMap]
    start: Floats
    transient: int
    directed: bool
    order: NDArray[np.int64]
    known: dict[tuple[int, int], tuple[Located | None, End | None]] = field(default_factory=dict)

    def value(self, place: int) -> float:
        """The value of the parameter there."""
        return float(self.diagram.values[self.order[place]])

    def kept(self, place: int) -> Floats:
        """The last states of the first orbit there, shape (K, n)."""
        return self.diagram.states[self.order[place], 0]

    @cached_property
    def unit(self) -> float:
        """The range of the parameter."""
        return float(np.ptp(self.diagram.values))

    @cached_property
    def labels(self) -> list[str]:
        """The motion of the first orbit at each place."""
        return self.diagram.labels[self.order, 0].tolist()

    @cached_property
    def runs(self) -> list[tuple[int, int]]:
        """The first and the last place of each run."""
        edges = [k for k in range(1, len(self.labels)) if self.labels[k] != self.labels[k - 1]]
        return list(zip([0, *edges], [*(k - 1 for k in edges), len(self.labels) - 1], strict=True))

    def is_window(self, run: int) -> bool:
        """True of a wide run, and of chaos next to the doublings of a wide one, which is cut by windows of cycles."""
        return self._is_wide(run) or (kind_of(self.motion(run)) == CHAOS and any(self._doubles(run, way) for way in (-1, 1)))

    def _is_wide(self, run: int) -> bool:
        first, last = self.runs[run]
        return last - first + 1 >= FEWEST and abs(self.value(last) - self.value(first)) >= NARROWEST * self.unit

    def _doubles(self, run: int, way: int) -> bool:
        """True if the runs on one side of another are cycles, each of half the period of the one before, up to a wide one."""
        other = self.beside(run, way)
        while other is not None and self.length(other) and not self._is_wide(other):
            further = other + way
            is_half = 0 <= further < len(self.runs) and 2 * self.length(further) == self.length(other)
            other = further if is_half else None
        return other is not None and self.length(other) > 0

    def length(self, run: int) -> int:
        """The states of a run's cycle, in its middle; 0 without one."""
        return int(self.diagram.length[self.order[sum(self.runs[run]) // 2], 0])

    def beside(self, run: int, way: int) -> int | None:
        """The run on one side of another, beyond narrow ones that are unresolved or long cycles; None at the end of the range."""
        near = other = run + way
        while 0 <= other < len(self.runs) and not self._is_wide(other) and self._is_passed(other, way):
            other += way
        if 0 <= other < len(self.runs) and self.motion(other) != self.motion(run):
            return other
        return near if 0 <= near < len(self.runs) else None

    def _is_passed(self, run: int, way: int) -> bool:
        """True of a run without a known motion, and of a cycle too long to be followed that a doubling beside it has made."""
        beyond, length = run + way, self.length(run)
        is_long = length > MOST_STATES and 0 <= beyond < len(self.runs) and 2 * self.length(beyond) == length
        return is_long or kind_of(self.motion(run)) == UNRESOLVED

    def motion(self, run: int) -> str:
        """The motion of a run."""
        return self.labels[self.runs[run][0]]

    @cached_property
    def cycles(self) -> CycleSearch:
        """The cycles of the map, in the unit of the diagram."""
        return CycleSearch(self.map_of, self.diagram.parameter, self.diagram.scale, self.unit)

    def name_by_returns(self, run: int) -> str:
        """The motion of a run, as if whole turns were unknown."""
        row = self.order[sum(self.runs[run]) // 2]
        return without_turns(self.motion(run), int(self.diagram.period[row, 0]))

    def rotation(self, run: int) -> str:
        """The rotation number p/q of a run's cycle; "" without one, and of maps not given by formulas."""
        row = self.order[sum(self.runs[run]) // 2]
        period, (return_map, _) = int(self.diagram.period[row, 0]), map_or_reason(self.map_of, float(self.diagram.values[row]))
        name = only_counted(return_map, self.diagram.coordinates) if period and isinstance(return_map, PiecewiseMap) else ""
        turns, words = self.diagram.turns[row, 0, :period].astype(np.int64), self.diagram.words[row, 0, :period].tolist()
        return str(Fraction(steps(turns, words, self.diagram.coordinates, name), period)) if name else ""

    def cycle(self, run: int, way: int) -> Located | None:
        """The stable cycle of a run near its end on one side (way 1 or -1); None if it has none."""
        return self._side(run, way)[0]

    def end(self, run: int, way: int) -> End | None:
        """Where this cycle ends, up to the middle of the next window; None without one, or if it continues."""
        return self._side(run, way)[1]

    def _side(self, run: int, way: int) -> tuple[Located | None, End | None]:
        if (run, way) not in self.known:
            at, end = self._cycle(run, way), None
            if at is not None:
                end = self._end(at, run, way)
            if end is not None and end.border.kind == WORDS and self._is_inside(end.border.value, run, way):
                at, end = None, None
            self.known[run, way] = at, end
        return self.known[run, way]

    def _is_inside(self, value: float, run: int, way: int) -> bool:
        """True of a value before the last one of a run: its cycle has other words there, as chatter with more impacts."""
        first, last = (self.value(place) for place in self.runs[run][::way])
        return (value - last) * (last - first) < 0

    def _end(self, at: Located, run: int, way: int) -> End | None:
        """Where a cycle of a run ends, up to the middle of the next window."""
        beyond = (k for k in range(run + way, len(self.runs) if way > 0 else -1, way) if self.is_window(k))
        limit = next((sum(self.runs[k]) // 2 for k in beyond), len(self.labels) - 1 if way > 0 else 0)
        return self.cycles.end(at, self.value(limit), self.unit / max(len(self.labels) - 1, 1))

    def origin(self, run: int, way: int) -> tuple[Located | None, End | None]:
        """The cycle from which that of a run has come by period doublings on one side, and where it ends there."""
        at, end = self._side(run, way)
        while end is not None and end.half is not None:
            at, end = end.half, self._end(end.half, run, way)
        return at, end

    def _cycle(self, run: int, way: int) -> Located | None:
        """The cycle at the end of a run, or where it has converged nearest to this."""
        first, last = self.runs[run]
        near, far = (last, first) if way > 0 else (first, last)
        places = (near - way * k for k in range(TRIED) if first <= near - way * k <= last)
        for place in dict.fromkeys([*places, (near + far) // 2]):
            length = int(self.diagram.length[self.order[place], 0])
            states = self.kept(place)[:length]
            found = self.cycles.at(self.value(place), states) if length == len(states) > 0 else None
            if found is not None and len(found.states) == length:
                return Located(self.value(place), found)
        return None

    def motion_at(self, value: float, state: Floats, longer: int = 1) -> tuple[str, Floats]:
        """The motion of an orbit at a value of the parameter after so many times the transient, and its states (K, n) then."""
        try:
            how = self.diagram.states.shape[2], longer * self.transient
            found = continued_diagram(self.map_of, value, state[None], self.start[None], *how)
        except NsmapsError:  # no map
            return "", np.full((1, self.start.size), np.nan)
        name, states = str(found.labels[0, 0]), found.states[0, 0]
        if longer > 1 and kind_of(name) == CHAOS != name:  # of rare events its short sample may have none
            path = Path.of(
                Returns.concatenate([*returns_of(self.map_of(value), states[-1:], longer * self.transient)]), states[-1:]
            )
            name = Limit(CHAOS, path).label
        return name, states

    def arrives(self, place: int, run: int, cycle: Located) -> bool:
        """True if the orbit of a place, which has not converged there, goes to the motion of a run, which is such a cycle.

        Where it still has not, it must have come nearer to a cycle of the same words.
        """
        value, state = self.value(place), self.kept(place)[-1]
        motion, later = self.motion_at(value, state, LONGER)
        there = self.cycles.at(value, later[-len(cycle.cycle.states) :])
        if motion == self.motion(run) or there is None or sorted(there.words) != sorted(cycle.cycle.words):
            return motion == self.motion(run)
        return self.cycles.distance(there, later[-1]) < min(self.cycles.distance(there, state), ARRIVED)
