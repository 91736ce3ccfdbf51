"""The borders between two successive runs of a bifurcation diagram: where one motion ends and where the other begins."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.events import DOUBLING, HALVING
from nsmaps.dynamics.diagrams.borders import LABEL, LOST, NOT_LOCATED, End
from nsmaps.dynamics.diagrams.diagram import Border
from nsmaps.dynamics.diagrams.runs import LONGER, Runs
from nsmaps.dynamics.motion import UNRESOLVED, kind_of

CHANGED = 1e-5  #: share of the range to which a change of motion is bisected by orbits
LASTING = 16  #: times as many returns, for which a motion must last that orbits have shown
ASIDE = 4, 16, 64  #: distances, in this share, beyond the first value of a run at which its motion is seen to be there too
NEAR, NEARER = 16, 6  #: the distance from the end of a cycle is divided by this up to so many times, to see where orbits go

Pair = tuple[Border, Border]  #: where the first run ends, and where the second begins


@dataclass(frozen=True, eq=False)
class Change:
    """The change from one run to another that follows it."""

    runs: Runs
    one: int
    other: int

    @property
    def wide(self) -> tuple[bool, bool]:
        """Which of the runs are windows, whose borders are wanted."""
        return self.runs.is_window(self.one), self.runs.is_window(self.other)

    def borders(self) -> Pair:
        """Where the motion of the first run ends, and where that of the second begins."""
        ends, begins = self.runs.end(self.one, 1), self.runs.end(self.other, -1)
        if self.runs.cycle(self.one, 1) is None:
            return self._by_orbits() if self.runs.cycle(self.other, -1) is None else self._to_cycle(begins)
        if self.runs.cycle(self.other, -1) is None:
            return self._from_cycle(ends)
        return self._of_cycles(ends, begins)

    @property
    def inner(self) -> float:
        """The last value of the first run."""
        return self.runs.value(self.runs.runs[self.one][1])

    @property
    def outer(self) -> float:
        """The first value of the second run."""
        return self.runs.value(self.runs.runs[self.other][0])

    @property
    def state(self) -> Floats:
        """Where an orbit starts that shows the motion between the runs."""
        kept = self.runs.kept(self.runs.runs[self.one][1])[-1]
        return kept if self.runs.directed and np.isfinite(kept).all() else self.runs.start

    def _beyond(self, value: float, other: float) -> float:
        """How far a value lies beyond another, in the sense in which the values are taken."""
        return (value - other) * float(np.sign(self.outer - self.inner))

    def _of_cycles(self, ends: End | None, begins: End | None) -> Pair:
        """Between two cycles. Where they coexist, one that is followed lasts to its end."""
        if ends is None or ends.border.kind == LOST:
            if begins is not None and self._beyond(begins.border.value, self.inner) >= 0:
                return self._by_orbits()[0], begins.border
            return (self._stepped(), self._stepped()) if self.runs.directed else self._by_orbits()
        end = ends.border
        if begins is None or begins.border.kind == LOST:
            return (end, end) if self.runs.directed else self._by_orbits()
        begin = begins.border
        gap, near = self._beyond(begin.value, end.value), begin.precision + end.precision
        if abs(gap) <= near:
            sharp = min(end, begin, key=lambda border: border.precision)
            return replace(sharp, kind=end.kind), replace(sharp, kind=begin.kind)
        if gap > 0:
            return end, begin
        return (end, end) if self.runs.directed else self._by_orbits()

    def _stepped(self) -> Border:
        """A change between two values at which an orbit leaves a motion that is still there, as its steps are long."""
        return Border((self.inner + self.outer) / 2, abs(self.outer - self.inner) / 2, LABEL)

    def _from_cycle(self, ends: End | None) -> Pair:
        """From a cycle to motion without a period, or none."""
        if ends is None or ends.border.kind == LOST or not (self.runs.directed or self._ends_before(ends)):
            return self._by_orbits()
        if not self.wide[1]:
            return ends.border, NOT_LOCATED
        onset, (_, last) = self._onset(ends, self.outer, self.one, -1), self.runs.origin(self.one, 1)
        border = ends.border if last is None else last.border
        onset = onset or self._beside(border, self.runs.motion(self.other))
        return ends.border, onset or self._bracket(border.value, self._not_yet)

    def _ends_before(self, ends: End) -> bool:
        """True if a cycle ends before the second run, or orbits that have not converged there go to it."""
        if self._beyond(ends.border.value, self.outer) <= ends.border.precision:
            return True
        cycle = self.runs.cycle(self.one, 1)
        return cycle is not None and self.runs.arrives(self.runs.runs[self.other][0], self.one, cycle)

    def _onset(self, end: End, chaos: float, run: int, back: int) -> Border | None:
        """Where period doublings from the end of a run's cycle accumulate, before a value without a cycle; None if they do not.

        Earlier doublings that the diagram shows count too.
        """
        if end.event is None or end.border.kind != DOUBLING:
            return None
        value, (before, first) = end.border.value, self._before(run, back)
        found = self.runs.cycles.onset(end.event, value + 3 * (chaos - value), before, first)
        return found if found is None or (found.value - chaos) * np.sign(chaos - value) <= found.precision else None

    def _before(self, run: int, back: int) -> tuple[list[float], str]:
        """The doublings by which the motion of a run has come from another, in their order, and this motion."""
        born, values = self.runs.end(run, back), list[float]()
        while born is not None and born.border.kind == HALVING:
            values.insert(0, born.border.value)
            before = self.runs.beside(run, back)
            if before is None or 2 * self.runs.length(before) != self.runs.length(run):
                origin = self.runs.origin(run, back)[0]
                return values, self.runs.motion(run) if origin is None else origin.cycle.label
            run, born = before, self.runs.end(before, back)
        return values, self.runs.motion(run)

    def _to_cycle(self, begins: End | None) -> Pair:
        """From motion without a period, or none, to a cycle."""
        if begins is None or begins.border.kind == LOST or self._beyond(begins.border.value, self.inner) < 0:
            return self._across(None if begins is None or begins.border.kind == LOST else begins.border)
        border = begins.border
        if not self.wide[0]:
            return NOT_LOCATED, border
        if not kind_of(self.runs.motion(self.one)):  # a cycle too long to be followed, as with chatter
            return self._by_orbits()[0], border
        if onset := self._onset(begins, self.inner, self.other, 1):
            return onset, border
        at, first = self.runs.origin(self.other, -1)
        motion = self.runs.motion(self.other) if first is begins or at is None else at.cycle.label
        beside = None if first is None else self._beside(first.border, motion)
        return (beside, border) if beside else self._by_orbits()

    def _across(self, begin: Border | None) -> Pair:
        """To a cycle that is there before the first run ends: from its begin on, if the orbits go to it from there on."""
        first, last = self.runs.runs[self.one]
        reached = [p for p in range(first, last + 1) if begin is None or self._beyond(begin.value, self.runs.value(p)) <= 0]
        cycle = self.runs.cycle(self.other, -1)
        if cycle is None or not self.runs.arrives(reached[0], self.other, cycle):  # they coexist
            return self._by_orbits()
        if begin is not None and reached[0] != first:
            return begin, begin
        return NOT_LOCATED, Change(self.runs, self.one - 1, self.other).borders()[1] if self.one else NOT_LOCATED

    def _beside(self, border: Border, motion: str) -> Border | None:
        """The end of a cycle, to the least distance beyond at which orbits have a motion; None if they have not."""
        if abs(self.outer - border.value) <= border.precision:
            return border
        nearest = 0.0
        for k in range(1, NEARER):
            off = (self.outer - border.value) / NEAR**k
            if self.runs.motion_at(border.value + off, self.state)[0] != motion:
                break
            nearest = abs(off)
        return replace(border, precision=border.precision + nearest) if nearest else None

    def _by_orbits(self) -> Pair:
        """By orbits that start from the last states of the first run; in chaos there are windows of other motions."""
        into = self.runs.cycle(self.other, -1) is not None
        first = self._bracket(self.inner, self._not_yet if into else self._still)
        way = -np.sign(self.outer - self.inner) if into else np.sign(self.outer - self.inner)
        there = "" if np.isnan(first.value) else self.runs.motion_at(first.value + way * first.precision, self.state)[0]
        if self._still(there) if into else not self._not_yet(there):
            return first, first
        wanted = self.wide[0] if into else self.wide[1]
        second = self._bracket(self.inner, self._still if into else self._not_yet) if wanted else NOT_LOCATED
        return (second, first) if into else (first, second)

    def _still(self, motion: str) -> bool:
        return motion == self.runs.motion(self.one)

    def _not_yet(self, motion: str) -> bool:
        return motion != self.runs.motion(self.other)

    def _bracket(self, low: float, holds: Callable[[str], bool]) -> Border:
        """Where a statement on the motion ceases to hold, from where it is shown to where the contrary is.

        Where more returns move this, the bracket has both places. Where it is so at the first value of the second run alone, as
        where basins are intertwined, the change is somewhere between the runs.
        """
        limits = low if low != self.inner else self.runs.value(sum(self.runs.runs[self.one]) // 2), self._well_outside
        low, high, state, beyond = self._bisected(low, self.state, lambda motion: not self._is_open(motion) and holds(motion))
        if high == self.outer and self._holds_beside(high, state, holds):
            return self._stepped()
        if self._is_open(beyond):
            _, high, *_ = self._bisected(high, state, lambda motion: self._is_open(motion) or holds(motion))
        while self._is_open(motion := self.runs.motion_at(low, self.state, LASTING)[0]) or not holds(motion):
            if low == limits[0]:
                return NOT_LOCATED
            low = self._farther(low, high, limits[0])
        while self._is_open(motion := self.runs.motion_at(high, state, LONGER)[0]) or holds(motion):
            if high == limits[1]:
                return NOT_LOCATED
            high = self._farther(high, low, limits[1])
        return Border((low + high) / 2, 2 * abs(high - low), LABEL)

    def _holds_beside(self, value: float, state: Floats, holds: Callable[[str], bool]) -> bool:
        """True if a statement that does not hold at the first value of the second run does a little beyond."""
        way = CHANGED * self.runs.unit * float(np.sign(self.outer - self.inner))
        beside = (self.runs.motion_at(value + aside * way, state)[0] for aside in ASIDE)
        return self.runs.is_window(self.other) and any(holds(motion) for motion in beside)

    def _bisected(self, low: float, state: Floats, holds: Callable[[str], bool]) -> tuple[float, float, Floats, str]:
        """Values between which a statement ceases to hold, the state of an orbit at the first, and the motion at the second."""
        high, beyond = self.outer, self.runs.motion(self.other)
        while abs(high - low) > CHANGED * self.runs.unit:
            middle = (low + high) / 2
            motion, states = self.runs.motion_at(middle, state)
            if not holds(motion):
                high, beyond = middle, motion
                continue
            low, state = middle, states[-1] if self.runs.directed and np.isfinite(states[-1]).all() else state
        return low, high, state, beyond

    def _is_open(self, motion: str) -> bool:
        """True of a motion that was not resolved, unless this is what a run has."""
        runs = kind_of(self.runs.motion(self.one)), kind_of(self.runs.motion(self.other))
        return kind_of(motion) == UNRESOLVED and UNRESOLVED not in runs

    @property
    def _well_outside(self) -> float:
        """The value in the middle of the second run."""
        return self.runs.value(sum(self.runs.runs[self.other]) // 2)

    def _farther(self, value: float, other: float, limit: float) -> float:
        """A value four times as far from another, at most a limit."""
        far = other + 4 * (value - other)
        return limit if abs(far - other) > abs(limit - other) else far
