"""The end of a stable cycle as a parameter changes: the cycle itself is followed, not the orbits that approach it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.continuation.events import AFFINE, DOMAIN, DOUBLING, FOLD, HALVING, TESTS, TORUS, BifurcationPoint
from nsmaps.dynamics.continuation.follow import continue_branch, switch_branch
from nsmaps.dynamics.diagrams.diagram import Border
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.periodic import PeriodicOrbit, least_period, newton_step
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.exact.returnmap import ReturnMap

LOCATED = 1e-8  #: share of the range to which an end other than an event of a branch is bisected
STEP, LONGEST = 0.05, 60  #: longest step of a branch beside its end, in its arclength, and most orbits on it
ROUNDING = 1e-14  #: of the parameter, as a share of its range and value
MOST_TRIED = 300  #: values at which a cycle is sought, one after another
NEWTON, TOLERANCE = 12, 1e-10  #: steps of Newton's method at one value, and its residual
MOVED, APART = 0.1, 1e-5  #: in the scale: a cycle's largest change in a step, the least difference of its states
ASIDE = 1e-3  #: share of the spacing of values: distance from a period halving at which the cycle of half the period is sought
LEFT = 200  #: periods in which an orbit leaves a cycle that has ceased to exist
AWAY = 2**14  #: returns in which an orbit leaves a cycle of affine pieces just beyond its doubling
AT_ONE = 0.01  #: largest distance from 1 or -1 of a multiplier of the last cycle before a fold or a doubling
FEIGENBAUM = 4.669201609102990  #: ratio of successive intervals between period doublings, in the limit
LEAST_RATIO = 1.5  #: least ratio of two such intervals from which their sum is extrapolated with it
MOST_STATES = 32  #: of the longest cycle that is followed: longer ones lie beside chaos, and cost more than orbits
LABEL, WORDS, RANGE, LOST = "change of motion", "change of words", "end of the range", "not located"
NO_RETURN, ACCUMULATION = "no return", "accumulation of period doublings"
NOT_LOCATED = Border(np.nan, np.nan, LOST)


@dataclass(frozen=True, slots=True, eq=False)
class End:
    """Where a cycle ceases to exist or to be stable."""

    border: Border
    event: BifurcationPoint | None = None  #: of its branch, where it is one at which stability is lost
    half: "Located | None" = None  #: at a period halving, the cycle of half the period a little beyond


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """A stable cycle at a value of the parameter."""

    value: float
    cycle: PeriodicOrbit


@dataclass(frozen=True, slots=True, eq=False)
class CycleSearch:
    """The stable cycles of a map over a parameter."""

    map_of: Callable[[float], ReturnMap]
    parameter: str
    scale: Floats  #: shape (n,), extent of the motion in each coordinate
    unit: float  #: the range of the parameter

    def at(self, value: float, states: Floats, like: PeriodicOrbit | None = None) -> PeriodicOrbit | None:
        """The stable cycle of least period near some states (q, n), with the words of another; None where there is none."""
        return_map, _ = map_or_reason(self.map_of, value)
        if return_map is None or len(states) > MOST_STATES:
            return None
        near = self._near(return_map, states) or self._settled(return_map, states)
        if near is None:
            return None
        found = self._least(return_map, near)
        if not (found.converged and found.returns.valid.all() and found.stable):
            return None
        if like is not None and found.words != like.words:
            return None
        repeated = np.tile(found.states, (len(states) // len(found.states), 1))
        moved = np.abs(found.returns.coordinates.difference(repeated, states) / self.scale).max()
        return found if moved <= MOVED else None

    def distance(self, cycle: PeriodicOrbit, state: Floats) -> float:
        """How far a state is from the nearest one of a cycle, in the scale."""
        return float((np.abs(cycle.returns.coordinates.difference(cycle.states, state)) / self.scale).max(axis=1).min())

    def _near(self, return_map: ReturnMap, states: Floats) -> PeriodicOrbit | None:
        """The cycle to which Newton's whole steps lead from states; None if they diverge, or without a derivative."""
        coordinates = Coordinates(return_map.coordinates)
        for _ in range(NEWTON):
            returns = return_map.first_return(coordinates.wrap(states), derivative=True)
            if returns.derivative is None or not returns.valid.all():
                return None
            cycle, step = PeriodicOrbit(returns, TOLERANCE, self.scale), newton_step(returns, self.scale)
            size = np.abs(step / self.scale).max()
            if not size <= 1:
                return None
            if size <= TOLERANCE and cycle.converged:
                return cycle
            states = np.where(np.abs(step) > ROUNDING * self.scale, returns.start + step, returns.start)  # a rest stays one
        return None

    def _settled(self, return_map: ReturnMap, states: Floats) -> PeriodicOrbit | None:
        """As `_near`, from two periods later, as for a cycle with a rest, whose release no other state determines."""
        q, coordinates = len(states), Coordinates(return_map.coordinates)
        path = orbit(return_map, states[0], 2 * q).states[-q:]
        if not np.isfinite(path).all():
            return None
        turned = [np.roll(path, k, axis=0) for k in range(q)]
        return self._near(
            return_map, min(turned, key=lambda own: float(np.abs(coordinates.difference(own, states) / self.scale).max()))
        )

    def _least(self, return_map: ReturnMap, cycle: PeriodicOrbit) -> PeriodicOrbit:
        """A cycle with its least period."""
        part = self._part(cycle)
        return cycle if part == len(cycle.states) else self._near(return_map, cycle.states[:part]) or cycle

    def _part(self, cycle: PeriodicOrbit) -> int:
        """The least period of a cycle."""
        return least_period(cycle.states, cycle.returns.coordinates, self.scale, APART)

    def end(self, at: Located, limit: float, spacing: float) -> End | None:
        """Where a cycle ends on the way from its value to a limit; None if it continues to there.

        It ends at the first event of its branch at which it ceases to be stable. Elsewhere, as where its words change, it ends
        between the last value at which Newton's method leads to it and one at which the returns from it have other words or no
        image.

        Args:
            spacing: of the values of a diagram; the end is expected within one.
        """
        reach, way = spacing, np.sign(limit - at.value)
        while way * (limit - at.value) > 0:
            reach *= 2
            far = at.value + way * min(reach, abs(limit - at.value))
            branch = self._branch(at, far)
            event = next((event for event in branch.events if event.kind in (HALVING, *TESTS)), None)
            held = int(np.argmin([*(branch.stable == True), False]))  # noqa: E712
            if event is not None and held >= len(branch.values) - 1:
                return End(self._border(event), event, self._half(event, way * spacing) if event.kind == HALVING else None)
            if held and branch.values[held - 1] == far:
                at = Located(far, branch.orbits[-1])
                continue
            last = Located(float(branch.values[held - 1]), branch.orbits[held - 1]) if held else at
            found = self._walk(last, limit, spacing)
            if isinstance(found, Located):
                return None
            known = next((event for event in branch.events if abs(event.value - found.value) <= found.precision), None)
            sharp = known is not None and found.kind != LOST and known.precision <= found.precision
            return End(self._border(known) if known and sharp else found)
        return None

    def _border(self, event: BifurcationPoint) -> Border:
        """An event as a border, to no less than rounding."""
        rounding = ROUNDING * (self.unit + abs(event.value))
        return Border(event.value, max(event.precision, rounding), event.kind)

    def _half(self, event: BifurcationPoint, spacing: float) -> Located | None:
        """The stable cycle of half the period beside a period halving; None if it is not found."""
        value = event.value + ASIDE * spacing
        half = self.at(value, event.orbit.states[: self._part(event.orbit)])
        return None if half is None else Located(value, half)

    def _branch(self, at: Located, far: float) -> Branch:
        cycle = PeriodicOrbit(at.cycle.returns, at.cycle.tolerance, self.scale)
        direction: Literal["up", "down"] = "up" if far > at.value else "down"
        return continue_branch(
            self.map_of,
            self.parameter,
            cycle,
            at.value,
            _bounds(at.value, far),
            direction=direction,
            step=STEP,
            max_points=LONGEST,
            until=tuple(TESTS),
        )

    def _walk(self, at: Located, limit: float, spacing: float) -> "Border | Located":
        """The end of a cycle by Newton's method at one value after another, with steps that are halved where it fails."""
        step, way, before, failed = spacing / 4, float(np.sign(limit - at.value)), at, limit
        for _ in range(MOST_TRIED):
            if step <= max(LOCATED * self.unit, 4 * np.spacing(abs(at.value))):
                return Border((at.value + failed) / 2, abs(failed - at.value), self._kind(at.cycle, failed))
            there = at.value + way * min(step, abs(limit - at.value))
            found = self.at(there, self._predicted(before, at, there), at.cycle)
            if found is None:
                step, failed = step / 2, there
                continue
            before, at = at, Located(there, found)
            if there == limit:
                return at
            step *= 1 if way * (at.value + way * 2 * step - failed) >= 0 else 2
        return NOT_LOCATED  # as of chatter, whose number of impacts changes from step to step

    def _predicted(self, before: Located, at: Located, value: float) -> Floats:
        """The states expected at a value from those at two others."""
        states, coordinates = at.cycle.states, at.cycle.returns.coordinates
        if before.value == at.value:
            return states
        share = (value - at.value) / (at.value - before.value)
        moved = np.clip(share * coordinates.difference(states, before.cycle.states), -MOVED * self.scale, MOVED * self.scale)
        return coordinates.wrap(np.where(states == 0, states, states + moved))

    def _kind(self, cycle: PeriodicOrbit, beyond: float) -> str:
        """What ends a cycle between its value and one beyond."""
        return_map, _ = map_or_reason(self.map_of, beyond)
        if return_map is None:
            return DOMAIN
        there = return_map.first_return(cycle.states)
        if not there.valid.all():
            return NO_RETURN
        multipliers = cycle.multipliers
        if np.abs(multipliers + 1).min() < AT_ONE:
            return DOUBLING
        if np.abs(multipliers - 1).min() < AT_ONE:
            return FOLD
        if np.abs(multipliers).max() > 1 - AT_ONE and np.abs(multipliers.imag).max() > 0:
            return TORUS
        return self._leaves(return_map, cycle)

    def _leaves(self, return_map: ReturnMap, cycle: PeriodicOrbit) -> str:
        """How orbits from a cycle that attracted leave it: with other words, without a return, or to other states."""
        q = len(cycle.states)
        path = orbit(return_map, cycle.states[0], LEFT * q)
        if not np.isfinite(path.final).all():
            return NO_RETURN
        if (path.codes.reshape(LEFT, q) != cycle.returns.codes).any():
            return WORDS
        moved = cycle.returns.coordinates.difference(path.states[:-1].reshape(LEFT, q, -1), cycle.states)
        return LABEL if (np.abs(moved) / self.scale).max() > APART else LOST

    def onset(self, event: BifurcationPoint, far: float, before: list[float], first: str) -> Border | None:
        """Where motion without a period begins beyond a period doubling: at the accumulation of further ones, by extrapolation.

        It is the end of a doubled cycle where another event ends it, or the end of the cycle of twice the period that is born at
        a border; of affine pieces the doubling itself, unless the cycle born there attracts, which is followed to its end.
        None where no stable cycle is born.

        Args:
            far: a value at which there is no cycle any more.
            before: values of the doublings before this one, where they are known.
            first: the motion with which the doublings begin.
        """
        if event.detail == AFFINE:
            value, q = event.value + ASIDE * (far - event.value), 2 * len(event.orbit.states)
            path = orbit(self.map_of(value), event.orbit.states[0] + MOVED * self.scale, AWAY)
            cycle = self.at(value, path.states[-q:])
            left = None if cycle is None else self.end(Located(value, cycle), far, abs(far - value))
            return self.onset(left.event, far, before, first) if left is not None and left.event else self._border(event)
        values, given = [*before, event.value], len(before) + 1
        while abs(far - values[-1]) > LOCATED * self.unit and (len(values) == 1 or 2 * len(event.orbit.states) <= MOST_STATES):
            bounds, until = _bounds(values[-1], far), tuple(TESTS)
            branch = switch_branch(self.map_of, "", event, bounds, step=STEP, max_points=LONGEST, until=until, doubled=True)
            if len(branch.values) < 2 or not any(branch.stable[1:]):
                return None if len(values) == given else _accumulation(values, first)
            end = next((each for each in branch.events if each.kind in TESTS), next(iter(branch.events), None))
            if end is None or end.kind != DOUBLING:
                return self._border(end) if end else None
            event = end
            values.append(event.value)
            if len(values) > given + 1:
                far = values[-1] + (values[-1] - values[-2])
        return _accumulation(values, first) if len(values) > 1 else None


def _bounds(value: float, far: float) -> tuple[float, float]:
    """Bounds of a branch from a value to another, and a little to the other side: branches may begin at one value."""
    near = value - (far - value) / 10
    return min(near, far), max(near, far)


def _accumulation(values: list[float], first: str) -> Border:
    """The limit of two or more period doublings, and how far it moves if the last one is left out.

    Its kind names the motion that doubles first: narrow windows in chaos have cascades of their own.
    """

    def limit(known: list[float]) -> float:
        gaps = np.diff(known[-3:])
        ratio = gaps[0] / gaps[1] if len(gaps) == 2 and gaps[0] / gaps[1] > LEAST_RATIO else FEIGENBAUM
        return float(known[-1] + gaps[-1] / (ratio - 1))

    found = limit(values)
    return Border(found, abs(found - (limit(values[:-1]) if len(values) > 2 else values[-1])), f"{ACCUMULATION} from {first} on")
