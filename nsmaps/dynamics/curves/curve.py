"""Bifurcation curves of a periodic orbit in two parameters, with their points of codimension two."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, brief
from nsmaps.continuation.core import Control, Step, correct, follow, passes, tangent
from nsmaps.continuation.zeros import locate
from nsmaps.dynamics.continuation.events import Event
from nsmaps.dynamics.continuation.problem import OrbitCurve
from nsmaps.dynamics.curves.problem import CriticalCurve, CriticalPoint, Kind, Side
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.dynamics.returnmap import ReturnMap, map_or_reason
from nsmaps.errors import NsmapsError, check_class
from nsmaps.progress import shows

BEND = 0.98  #: least cosine between the directions at both ends of a step
SMALLEST = 1e-7  #: step at which a curve is abandoned
LEAST = 1e-4  #: clearance at which curves of grazes and borders are followed, in the units of branches
MOST = 3e-4  #: clearance of an orbit beside a graze or a border from which such a curve is begun
NEARER = {"grazing": (2, 4), "border collision": (8, 64, 128, 256)}  #: fractions of it, from which parameters are extrapolated
ASIDE = (
    1e-8,
    0.1,
)  #: distances from it, in units of the first parameter's range, within which that orbit is looked for
COARSEST = 1e-8  #: precision of a point of codimension two, in units of the parameters' ranges
CUSP, FLIP, ONE, TWO = "cusp", "fold-flip", "1:1 resonance", "1:2 resonance"
RESONANCES = {ONE: 2.0, TWO: -2.0, "1:3 resonance": -1.0, "1:4 resonance": 0.0}  #: sums of the two multipliers on the unit circle
Bounds = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class SpecialPoint:
    """A point of codimension two: two conditions hold at once.

    On curves of folds a `cusp` (two folds meet), a `fold-flip` (another multiplier is -1) or a `1:1 resonance` (a second is 1);
    on curves of period doublings a `fold-flip` (another multiplier is 1) or a `1:2 resonance` (a second is -1). On Neimark-Sacker
    curves the strong resonances: both multipliers are 1 or -1, where such a curve ends, or third or fourth roots of 1.
    """

    kind: str
    parameters: tuple[float, float]
    precision: tuple[float, float]  #: of these, as estimated from the last steps towards them
    orbit: PeriodicOrbit


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BifurcationCurve:
    """K orbits of q returns on a curve in two parameters, in its order."""

    __repr__ = brief

    kind: Kind
    parameters: Floats  #: shape (K, 2); at a graze or a border extrapolated to a clearance of zero
    points: Floats  #: shape (K, q, n), the states; at a graze or a border those at a small clearance
    words: tuple[str, ...]  #: of the q returns
    multipliers: NDArray[np.complex128]  #: shape (K, n), the largest first
    special: tuple[SpecialPoint, ...]  #: in the order of the curve
    ended: tuple[str, str]  #: the reasons why it ends, at its beginning and at its end

    @classmethod
    def empty(cls, kind: Kind, reason: str) -> "BifurcationCurve":
        """A curve without orbits, and the reason why there are none."""
        return cls(kind, np.zeros((0, 2)), np.zeros((0, 1, 0)), (), np.zeros((0, 0), complex), (), (reason, reason))


@shows
def bifurcation_curve(
    map_of: Callable[[float, float], ReturnMap],
    event: Event,
    second: float,
    bounds: tuple[Bounds, Bounds],
    step: float = 0.02,
    max_points: int = 500,
    tolerance: float = 1e-10,
) -> BifurcationCurve:
    """The curve of an event of a branch in two parameters, by pseudo-arclength continuation in both directions.

    The orbit and the event's condition are solved at once, so that the curve is followed around its own turning points. All
    orbits have the words of the first. At a `grazing` this is the orbit that does not touch, at a `border collision` that of the
    event: it is followed at a clearance of 1e-4 in the units of branches, and the parameters are extrapolated to zero, an
    estimate, from that clearance (at a border from 1/64 of it), its half and its quarter. Two points of codimension two of one
    kind within a step are missed; none is looked for on curves of grazes and borders. A Neimark-Sacker curve ends where its
    multipliers become real.

    Args:
        map_of: the return map at a value of each parameter, such as `nsmaps.Along(system, "d", "r")`.
        event: a `period doubling`, `fold`, `Neimark-Sacker`, `grazing` or `border collision` of a branch in the first parameter.
        second: value of the second parameter on that branch.
        bounds: least and greatest value of the first parameter, and of the second; their differences are units of the
            arclength, in which speeds count as shares of the largest on the orbit and phases in radians.
        step: longest step, in arclength.
        max_points: greatest number of orbits in either direction.
        tolerance: largest residual of an orbit, as of `continue_branch`.

    Raises:
        NsmapsError: another kind of event, invalid bounds, or no orbit that meets the condition near the event.
    """
    check_class(event, Event, "a curve in two parameters begins at an event of a branch")
    _check(event, second, bounds, step, max_points)
    curve = _curve(map_of, event, second, bounds, tolerance)
    y = _beside(curve, event, second) if curve.least else curve.along.y(event.orbit.states, event.parameter)
    fixed = np.append(np.zeros(event.orbit.states.size + 1), 1.0)
    start = None if y is None else correct(curve, np.append(y, second / curve.unit), fixed)
    if start is None or not curve.along.low <= start.values[0] <= curve.along.high:
        place = f"{event.parameter:.9g}, {second:.9g}"
        raise NsmapsError(f"no {event.kind} near {place}; expected: an orbit at the event, and these parameters")
    sense = tangent(start, fixed)
    control = Control(step, SMALLEST, BEND, low=curve.low / curve.unit, high=curve.high / curve.unit)
    ways = [_Way.followed(curve, start, sign * sense, control, max_points) for sign in (-1.0, 1.0)]
    return _result(curve, start, *ways)


def _beside(curve: CriticalCurve, event: Event, second: float) -> Floats | None:
    """An orbit beside a graze or a border that does not meet it, by little, as unknowns of a branch, or None."""
    branch, own = curve.in_first(second), event.orbit.returns.codes
    for side in (1.0, -1.0):
        share = ASIDE[0]
        while share < ASIDE[1]:
            value = event.parameter + side * share * branch.unit
            map, _ = map_or_reason(branch.map_of, value)
            if map is not None:
                states = event.orbit.states
                found = periodic_orbit(map, states, len(states), branch.tolerance, branch.scale)
                same = curve.side is None or np.array_equal(found.returns.codes, own)
                there = found.converged and found.exists and same
                if there and curve.least <= curve.clearance(map, found.states[None])[0] <= MOST:
                    return branch.y(found.states, value)
            share *= 1.5
    return None


@dataclass(frozen=True, slots=True)
class _Way:
    """A curve in one direction: its points after the first, their special points, and the reason of its end."""

    points: list[CriticalPoint]
    special: list[SpecialPoint]
    ended: str

    @classmethod
    def followed(cls, curve: CriticalCurve, start: CriticalPoint, along: Floats, control: Control, max_points: int) -> "_Way":
        points, special, ended = list[CriticalPoint](), list[SpecialPoint](), ""
        for step in follow(curve, start, along, control):
            special += _special(curve, step)
            first = step.end.values[0]
            if not curve.along.low <= first <= curve.along.high:
                ended = f"the range of the first parameter ends before {first:.9g}"
                break
            points.append(step.end)
            if curve.kind == "Neimark-Sacker" and special and special[-1].kind in (ONE, TWO):
                points.pop()
                ended = special[-1].kind
                break
            if step.last:
                ended = f"the range of the second parameter ends at {step.end.values[1]:g}"
            elif len(points) > 3 and passes(curve, step, start, along, BEND):
                ended = "closed"
            elif len(points) >= max_points:
                ended = f"{max_points} orbits"
            if ended:
                break
        return cls(points, special, ended or _lost(curve, points[-1] if points else start))


def _lost(curve: CriticalCurve, last: CriticalPoint) -> str:
    """The reason of a curve that cannot be continued."""
    first, second = last.values
    return (
        f"lost at {first:.9g}, {second:.9g}: no orbit of the words {', '.join(last.orbit.words)} that meets the condition beyond"
    )


def _result(curve: CriticalCurve, start: CriticalPoint, before: _Way, after: _Way) -> BifurcationCurve:
    """Both ways as one curve; one that is closed has the other's points."""
    back = [] if before.ended == "closed" and after.ended == "closed" else before.points[::-1]
    points = [*back, start, *after.points]
    special = (*(before.special[::-1] if back or not after.points else ()), *after.special)
    parameters = np.array([_parameters(curve, point) for point in points])
    states = np.array([point.orbit.states for point in points])
    multipliers = np.array([point.orbit.multipliers for point in points])
    ended = (before.ended, after.ended)
    return BifurcationCurve(curve.kind, parameters, states, start.orbit.words, multipliers, special, ended)


def _parameters(curve: CriticalCurve, point: CriticalPoint) -> tuple[float, float]:
    """The parameters of a point, at a graze or a border extrapolated to a clearance of zero, or NaN."""
    if not curve.least:
        return point.values
    normal, rows = tangent(point, np.ones(len(point.y))), [point.values]
    for part in NEARER[curve.kind]:
        nearer = correct(replace(curve, least=curve.least / part), point.y, normal)
        if nearer is None:
            return np.nan, np.nan
        point = nearer
        rows.append(point.values)
    whole, half, quarter = np.array(rows[-3:])
    first, second = ((whole - 6 * half + 8 * quarter) / 3).tolist()
    return first, second


def _remaining(point: CriticalPoint, known: float) -> Floats:
    """The characteristic polynomial of the multipliers but for a known one, highest power first, as shares of their sum."""
    whole = np.poly(point.orbit.derivative).real
    remaining = np.polydiv(whole, [1.0, -known])[0]
    return np.asarray(remaining / np.abs(remaining).sum())


Test = Callable[[CriticalPoint, Floats], float]


def _beyond(value: float, point: CriticalPoint, _: Floats) -> float:
    """The sum of the two multipliers whose product is nearest to 1, less a value."""
    multipliers = point.orbit.multipliers
    i, j = np.triu_indices(len(multipliers), 1)
    k = int(np.abs(multipliers[i] * multipliers[j] - 1).argmin())
    return float((multipliers[i[k]] + multipliers[j[k]]).real) - value


def _tests(kind: Kind, direction: Floats) -> dict[str, Test]:
    """The functions whose zeros are points of codimension two."""
    if kind in NEARER:
        return {}
    if kind == "Neimark-Sacker":
        return {name: partial(_beyond, value) for name, value in RESONANCES.items()}
    own = -1.0 if kind == "period doubling" else 1.0

    def at(x: float) -> Test:
        return lambda point, _: float(np.polyval(_remaining(point, own), x)) if len(point.orbit.derivative) > 1 else 1.0

    if kind == "period doubling":
        return {FLIP: at(1.0), TWO: at(-1.0)}
    return {FLIP: at(-1.0), ONE: at(1.0), CUSP: lambda _, along: float(along[-2:] @ direction[-2:])}


def _special(curve: CriticalCurve, step: Step[CriticalPoint]) -> list[SpecialPoint]:
    """The points of codimension two within a step, in order."""
    found = []
    for kind, test in _tests(curve.kind, step.direction).items():
        if test(step.start, step.direction) * test(step.end, step.turned) < 0:
            zero = locate(curve, step.start, step.direction, step.length, test)
            if zero is not None and (zero.error[-2:] <= COARSEST).all():
                first, second = curve.values(zero.y)
                near = (float(zero.error[-2] * curve.along.unit), float(zero.error[-1] * curve.unit))
                found.append((zero.arclength, SpecialPoint(kind, (first, second), near, zero.point.orbit)))
    return [point for _, point in sorted(found, key=lambda pair: pair[0])]


def _curve(
    map_of: Callable[[float, float], ReturnMap],
    event: Event,
    second: float,
    bounds: tuple[Bounds, Bounds],
    tolerance: float,
) -> CriticalCurve:
    """The curve of the event's condition."""
    if event.kind not in get_args(Kind):
        raise NsmapsError(f"the event is a {event.kind}; expected: {', '.join(get_args(Kind))}")
    orbit, kind = event.orbit, next(kind for kind in get_args(Kind) if kind == event.kind)
    coordinates = orbit.returns.coordinates
    scale = coordinates.magnitudes(orbit.states) if orbit.scale is None else orbit.scale

    def nothing(value: float) -> ReturnMap:
        raise NsmapsError("the second parameter is not known")

    along = OrbitCurve(nothing, len(orbit.states), *bounds[0], tolerance, coordinates, scale)
    side = None
    if kind == "border collision":
        side = _side(map_of(event.parameter, second), orbit.states, scale)
    return CriticalCurve(map_of, along, *bounds[1], kind, LEAST if kind in NEARER else 0.0, side)


def _side(map: ReturnMap, states: Floats, scale: Floats) -> Side:
    """Where the border is nearest to an orbit that all but meets it.

    Raises:
        NsmapsError: there are no states of other words near the orbit.
    """
    steps = [sign * row for row in np.diag(scale) for sign in (1.0, -1.0)]
    sides = [Side(k, step) for k in range(len(states)) for step in steps]
    distances = [side.distance(map, states[None])[0] for side in sides]
    if not min(distances) < LEAST:
        raise NsmapsError(f"no state within {LEAST:g} of the orbit has other words; expected: an orbit at the border")
    return sides[int(np.argmin(distances))]


def _check(event: Event, second: float, bounds: tuple[Bounds, Bounds], step: float, max_points: int) -> None:
    for value, (low, high) in zip((event.parameter, second), bounds, strict=True):
        if not (low <= value <= high and low < high):
            raise NsmapsError(f"the value {value:g} is not between {low:g} and {high:g}; expected: bounds that contain it")
    if not 10 * SMALLEST < step <= 1 or max_points < 1:
        raise NsmapsError(f"{max_points} orbits, step {step:g}; expected: at least one orbit, a step up to 1")
