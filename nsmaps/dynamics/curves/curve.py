"""Bifurcation curves of a periodic orbit in two parameters, with their points of codimension two."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Control, correct, correct_beside, follow, passes, tangent
from nsmaps.dynamics.chatter.complete import CompleteChatter
from nsmaps.dynamics.continuation.events import DETACHMENT, BifurcationPoint
from nsmaps.dynamics.continuation.pieces import AtBorder
from nsmaps.dynamics.continuation.problem import curve_from
from nsmaps.dynamics.curves.contact import CLOSED, ContactCurve
from nsmaps.dynamics.curves.crossing import CrossingCurve
from nsmaps.dynamics.curves.problem import CriticalCurve, CriticalPoint, Kind, Side, off_piece
from nsmaps.dynamics.curves.special import ONE, TWO, Search, SpecialPoint, everywhere
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.dynamics.returnmap import Model, check_range, check_steps, map_along, map_or_reason
from nsmaps.errors import NsmapsError, check_class
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.parameters import System
from nsmaps.progress import shows
from nsmaps.results import NONE, Result, array

BEND = 0.98  #: least cosine between the directions at both ends of a step
SMALLEST = 1e-7  #: step at which a curve is abandoned
LEAST = 1e-4  #: clearance at which curves of grazes and borders are followed, in the units of branches
MOST = 3e-4  #: clearance of an orbit beside a graze or a border from which such a curve is begun
NEARER = {"grazing": (2, 4), "border collision": (8, 64, 128, 256)}  #: fractions of it, from which parameters are extrapolated
ASIDE = 1e-8, 0.1  #: distances, in units of the first parameter's range, within which an orbit beside it is looked for
JUST_BEYOND = 1e-6  #: distance from an orbit at a border, in scales of the coordinates, to states of the other piece
JUMP = 1e-3  #: of an image or a derivative between them, in this scale, from one piece of the map to another
Bounds = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BifurcationCurve(Result):
    """K orbits of q returns on a curve in two parameters, in its order."""

    kind: Kind
    parameters: Floats = field(
        metadata=array("orbit parameter", "values of both; at a graze or a border extrapolated to a clearance of zero")
    )
    points: Floats = field(
        metadata=array("orbit point state", "states; at a graze or a border at a small clearance, at a detachment beside it")
    )
    words: tuple[str, ...]  #: of the q returns
    multipliers: NDArray[np.complex128] = field(metadata=array("orbit multiplier", "the largest first", NONE))
    special: tuple[SpecialPoint, ...]  #: in the order of the curve
    ended: tuple[str, str]  #: the reasons why it ends, at its beginning and at its end
    everywhere: tuple[str, ...] = ()  #: kinds of such points that all orbits have up to rounding, and which are not in `special`
    names: tuple[str, str] = ("first parameter", "second parameter")  #: of the parameters
    picture: ClassVar[str] = "nsmaps.figures.parameters.curves"

    def summary(self) -> str:
        """The numbers that matter."""
        (x, y), special = self.parameters.T, ", ".join(dict.fromkeys(each.kind for each in self.special)) or "no special points"
        return f"{self.kind}, {len(x)} orbits, from ({x[0]:.6g}, {y[0]:.6g}) to ({x[-1]:.6g}, {y[-1]:.6g}); {special}"

    @classmethod
    def empty(cls, kind: Kind, reason: str) -> "BifurcationCurve":
        """A curve without orbits, and the reason why there are none."""
        return cls(kind, np.zeros((0, 2)), np.zeros((0, 1, 0)), (), np.zeros((0, 0), complex), (), (reason, reason))


@shows
def bifurcation_curve(
    system: Model,
    point: BifurcationPoint,
    bounds: Mapping[str, Bounds],
    second: float | None = None,
    *,
    step: float = 0.02,
    max_points: int = 500,
    tolerance: float = 1e-10,
) -> BifurcationCurve:
    """The curve of an event of a branch in two parameters, by pseudo-arclength continuation in both directions.

    The orbit and the event's condition are solved at once, so that the curve is followed around its own turning points. All
    orbits have the words of the first. At a `grazing` this is the orbit that does not touch, at a `border collision` that of the
    event: it is followed at a clearance of 1e-4 in the units of branches, and the parameters are extrapolated to zero, an
    estimate, from that clearance (at a border from 1/64 of it), its half and its quarter. Two points of codimension two of one
    kind within a step are missed; none is looked for on curves of branch points, grazes, borders and detachments. A
    Neimark-Sacker curve ends where its multipliers become real. The curve of a `branch point` ends where branches no longer
    cross. That of a `detachment` is found by bisection across it, on whether contact lasts for all times.

    Args:
        system: a system, its `CompleteChatter`, or the return map as a function of the values of both parameters.
        point: a `period doubling`, `fold`, `branch point`, `Neimark-Sacker`, `grazing`, `border collision` or `detachment` of a
            branch in the first parameter.
        bounds: least and greatest value of the first parameter, that of the branch, and of the second, by name; their differences
            are units of the arclength, in which coordinates count as shares of the orbit's `scale` and phases in radians.
        second: value of the second parameter on that branch; that of the system if omitted.
        step: longest step, in arclength; steps are shorter where the curve turns. Up to 1 saves most of the work where a mean
            moves by many extents of the motion, as a voltage by many of its ripples.
        max_points: greatest number of orbits in either direction.
        tolerance: largest residual of an orbit, as of `continue_branch`.

    Raises:
        NsmapsError: another kind of event, invalid bounds, or no orbit that meets the condition near the event.
    """
    check_class(point, BifurcationPoint, "a curve in two parameters begins at an event of a branch")
    event, map_of, (first, other) = point, map_along(system, *bounds), bounds
    if second is None:
        if not isinstance(system, System | CompleteChatter):
            raise NsmapsError(f"the value of {other} on the branch is not known; expected: `second` beside a function")
        second = system.parameters[other]
    ranges = bounds[first], bounds[other]
    _check(event, second, ranges, step, max_points)
    curve = _curve(map_of, event, second, ranges, tolerance)
    if curve.kind == DETACHMENT:
        return replace(_detachments(curve, event, second, step, max_points), names=(first, other))
    y = _beside(curve, event, second) if curve.least else curve.along.y(event.orbit.states, event.value)
    start = None if y is None else correct(curve, curve.unknowns(y, second), _upward(curve.unknowns(y, second)))
    if start is None or not curve.along.low <= start.values[0] <= curve.along.high:
        place = f"{event.value:.9g}, {second:.9g}"
        raise NsmapsError(f"no {event.kind} near {place}; expected: an orbit at the event, and these parameters")
    sense = tangent(start, _upward(start.y))
    control = Control(step, SMALLEST, BEND, low=curve.low / curve.unit, high=curve.high / curve.unit, parameters=2)
    ways = [_Way.followed(curve, start, sign * sense, control, max_points) for sign in (-1.0, 1.0)]
    return replace(_result(curve, start, *ways), names=(first, other))


def _detachments(curve: CriticalCurve, event: BifurcationPoint, second: float, step: float, max_points: int) -> BifurcationCurve:
    """The curve of a detachment, with the orbits beside it that are released, NaN where none is found."""
    boundary, start = ContactCurve(curve, event.orbit, step, max_points), np.array([event.value, second])
    (before, begun), (after, ended) = (boundary.way(start, sense) for sense in (-1.0, 1.0))
    parameters = np.concatenate([before[::-1] if ended != CLOSED else before[:0], [start], after])
    q, n = event.orbit.states.shape
    states, multipliers = np.full((len(parameters), q, n), np.nan), np.full((len(parameters), n), complex(np.nan, np.nan))
    for k, (first, second) in enumerate(parameters.tolist()):
        orbit = boundary.orbit_beside(first, second)
        if orbit is not None:
            states[k], multipliers[k] = orbit.states, orbit.multipliers
    return BifurcationCurve(curve.kind, parameters, states, event.orbit.words, multipliers, (), (begun, ended))


def _upward(y: Floats) -> Floats:
    """The direction among unknowns in which the second parameter alone changes."""
    return np.asarray(np.eye(1, len(y), len(y) - 1)[0])


def _beside(curve: CriticalCurve, event: BifurcationPoint, second: float) -> Floats | None:
    """An orbit beside a graze or a border that does not meet it, by little, as unknowns of a branch, or None."""
    branch, own = curve.in_first(second), event.orbit.returns.codes
    for side in (1.0, -1.0):
        share = ASIDE[0]
        while share < ASIDE[1]:
            value = event.value + side * share * branch.unit
            return_map, _ = map_or_reason(branch.map_of, value)
            if return_map is not None:
                states = event.orbit.states
                found = periodic_orbit(return_map, states, len(states), tolerance=branch.tolerance, scale=branch.scale)
                same = curve.side is None or np.array_equal(found.returns.codes, own)
                there = found.converged and found.exists and same
                if there and curve.least <= curve.clearance(return_map, found.states[None])[0] <= MOST:
                    return branch.y(found.states, value)
            share *= 1.5
    return None


@dataclass(frozen=True, slots=True)
class _Way:
    """A curve in one direction: its points after the first, their special points, and the reason of its end."""

    points: list[CriticalPoint]
    special: Search
    ended: str

    @classmethod
    def followed(cls, curve: CriticalCurve, start: CriticalPoint, along: Floats, control: Control, max_points: int) -> "_Way":
        points, special, ended = list[CriticalPoint](), Search([], set()), ""
        for step in follow(curve, start, along, control):
            special.add(curve, step)
            first = step.end.values[0]
            if not curve.along.low <= first <= curve.along.high:
                ended = f"the range of the first parameter ends before {first:.9g}"
                break
            points.append(step.end)
            if curve.kind == "Neimark-Sacker" and special.points and special.points[-1].kind in (ONE, TWO):
                points.pop()
                ended = special.points[-1].kind
                break
            if step.last:
                ended = f"the range of the second parameter ends at {step.end.values[1]:g}"
            elif len(points) > 3 and passes(curve, step, start, along, BEND):
                ended = "closed"
            elif len(points) >= max_points:
                ended = f"{max_points} orbits, before a range was covered"
            if ended:
                break
        return cls(points, special, ended or _lost(curve, points[-1] if points else start))


def _lost(curve: CriticalCurve, last: CriticalPoint) -> str:
    """The reason of a curve that cannot be continued."""
    first, second = last.values
    if isinstance(curve.side, AtBorder):
        also = curve.side.second(curve.map_of(first, second), last.orbit.states, curve.along.scale)
        if also:
            return f"{also}, at {first:.9g}, {second:.9g}"
    return (
        f"lost at {first:.9g}, {second:.9g}: no orbit of the words {', '.join(last.orbit.words)} that meets the condition beyond"
    )


def _result(curve: CriticalCurve, start: CriticalPoint, before: _Way, after: _Way) -> BifurcationCurve:
    """Both ways as one curve; one that is closed has the other's points."""
    back = [] if before.ended == "closed" and after.ended == "closed" else before.points[::-1]
    points = [*back, start, *after.points]
    special = (*(before.special.points[::-1] if back or not after.points else ()), *after.special.points)
    parameters = np.array([_parameters(curve, point) for point in points])
    states = np.array([point.orbit.states for point in points])
    multipliers = np.array([point.orbit.multipliers for point in points])
    about = special, (before.ended, after.ended), everywhere(curve, before.special, after.special)
    return BifurcationCurve(curve.kind, parameters, states, start.orbit.words, multipliers, *about)


def _parameters(curve: CriticalCurve, point: CriticalPoint) -> tuple[float, float]:
    """The parameters of a point, at a graze or a border extrapolated to a clearance of zero, or NaN."""
    if not curve.least:
        return point.values
    normal, rows, y = tangent(point, np.ones(len(point.y))), [point.values], point.y
    for part in NEARER[curve.kind]:
        nearer = replace(curve, least=curve.least / part)
        found = correct_beside(point, y, normal, partial(nearer.residual, codes=point.orbit.returns.codes))
        if found is None:
            return np.nan, np.nan
        y = found
        rows.append(curve.values(y))
    whole, half, quarter = np.array(rows[-3:])
    first, second = ((whole - 6 * half + 8 * quarter) / 3).tolist()
    return first, second


def _curve(
    map_of: Callable[[float, float], ReturnMap],
    event: BifurcationPoint,
    second: float,
    bounds: tuple[Bounds, Bounds],
    tolerance: float,
) -> CriticalCurve:
    """The curve of the event's condition."""
    if event.kind not in get_args(Kind):
        raise NsmapsError(f"the event is a {event.kind}; expected: {', '.join(get_args(Kind))}")
    orbit, kind, at = event.orbit, next(kind for kind in get_args(Kind) if kind == event.kind), event.at
    if at is not None:
        along = curve_from(at.along(lambda first: map_of(first, second)), orbit, event.value, bounds[0], tolerance)
        return CriticalCurve(at.along(map_of), along, *bounds[1], kind, side=at)
    along, side = curve_from(lambda first: map_of(first, second), orbit, event.value, bounds[0], tolerance), None
    if kind == "border collision":
        side = _side(map_of(event.value, second), orbit.states, along.scale)
    curve_class = CrossingCurve if kind == "branch point" else CriticalCurve
    return curve_class(map_of, along, *bounds[1], kind, LEAST if kind in NEARER else 0.0, side)


def _side(return_map: ReturnMap, states: Floats, scale: Floats) -> Side:
    """Where the border is nearest to an orbit that all but meets it.

    Raises:
        NsmapsError: the map has no border near the orbit.
    """
    steps = [sign * row for row in np.diag(scale) for sign in (1.0, -1.0)]
    sides = [side for k in range(len(states)) for step in steps for side in _sides(return_map, states, Side(k, step, scale))]
    distances = [side.distance(return_map, states[None])[0] for side in sides]
    if not sides or not min(distances) < LEAST:
        raise NsmapsError(
            f"the map has no border within {LEAST:g} of the orbit; expected: an orbit at the border (one that all states meet at "
            "one value of the parameter has no curve here; its value is that of `continue_branch` for each value of the other)"
        )
    return sides[int(np.argmin(distances))]


def _sides(return_map: ReturnMap, states: Floats, side: Side) -> tuple[Side, ...]:
    """That in which words change along a coordinate, or in which the image or the derivative jumps next to the state."""
    tried = states[side.state] + np.array([0.0, JUST_BEYOND])[:, None] * side.step
    returns = return_map.first_return(tried, derivative=True)
    if not returns.valid.all() or returns.derivative is None or returns.codes[0] != returns.codes[1]:
        return (side,)
    image, derivative = (each[0, 1] for each in off_piece(returns, (1, 2), side.scale))
    if np.abs(image).max() > JUMP:
        return (replace(side, image=image),)
    return (replace(side, derivative=derivative),) if np.abs(derivative).max() > JUMP else (side,)


def _check(event: BifurcationPoint, second: float, bounds: tuple[Bounds, Bounds], step: float, max_points: int) -> None:
    for value, ends in zip((event.value, second), bounds, strict=True):
        check_range(value, ends)
    check_steps(step, SMALLEST, max_points)
