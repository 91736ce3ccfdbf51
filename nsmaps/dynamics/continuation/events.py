"""Events along the curve of a periodic orbit: a multiplier crosses the unit circle, or the orbit ceases to exist."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Step, correct, tangent
from nsmaps.continuation.zeros import PRECISION, locate
from nsmaps.dynamics.continuation.border import WITH_DOUBLING
from nsmaps.dynamics.continuation.crossing import crossing_within
from nsmaps.dynamics.continuation.pieces import AtBorder
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.results import NONE, Result, array

DOUBLING, FOLD, BRANCH_POINT, TORUS = "period doubling", "fold", "branch point", "Neimark-Sacker"
HALVING = "period halving"
GRAZING, BORDER, DOMAIN = "grazing", "border collision", "end of the valid domain"
CHATTER_ENDS, DETACHMENT, HOMOCLINIC, HOPF = "end of complete chatter", "detachment", "homoclinic bifurcation", "Hopf bifurcation"
AT_INFINITY = "cycle at infinity"
ROUNDING = 1e-13  #: share of the largest multiplier, below which others are unknown
CONSERVED = 1e-9  #: a test of a share within this bound is zero up to rounding, as for area where a map preserves it
DEFICIENT = 0.01  #: share of the least singular value beside a point, below which its equations may be dependent next to it
TURNS = "the branch turns back, as the two halves of a pitchfork do"
ASIDE = 1e-2  #: share of the distance of two neighbours, within which halves of a cycle coincide
AFFINE = "degenerate: the pieces are affine, and a segment of states has twice the period, at this value alone"
MERGED = 1e-4  #: share of the distance of the halves of a cycle, below which a step has led to the cycle that both are
COARSEST = 1e-8  #: share of the parameter's range, to which an event must be located


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BifurcationPoint(Result):
    """A bifurcation or another event of a periodic orbit at a value of the parameter.

    A `period doubling`, `fold` (the branch turns back in the parameter), `branch point` (two branches cross),
    `Neimark-Sacker` (a pair leaves the unit circle), `period halving` (a doubled cycle ends on the original one), `grazing`
    (an impact speed or a clearance falls to zero and the words change), `border collision` (the words change without a graze),
    `end of complete chatter` (impacts accumulate at the release; see `CompleteChatter`), `detachment` (beyond it a body that is
    released from its contact remains there for all times), `homoclinic bifurcation` (the orbit takes ever more time, next to an
    equilibrium), `Hopf bifurcation` (it shrinks to an equilibrium), `cycle at infinity` (its states grow without bound, as a
    multiplier of affine pieces tends to 1) or `end of the valid domain` (there is no map beyond).
    """

    kind: str
    value: float  #: of the parameter
    precision: float  #: of the value, as estimated from the last steps towards it
    orbit: PeriodicOrbit  #: the orbit there; for a grazing, a border or the end of the domain, the last one before it
    detail: str = ""  #: the margin that falls to zero, the reason why there is no map, or that an event was not located
    border: str = ""  #: `persistence` or `non-smooth fold`, perhaps `with doubling`, or `end at a gap`; "" where unknown
    towards: Floats | None = field(
        default=None, metadata=array("unknown", "at a branch point, how states and parameter change along the branch", NONE)
    )
    at: AtBorder | None = None  #: at a border of pieces given by formulas, which states are there, and the pieces beyond it
    parameter: str = ""  #: its name

    def summary(self) -> str:
        """The kind and the value with its precision."""
        return f"{self.kind} at {self.parameter and f'{self.parameter} = '}{self.value:.12g} +- {self.precision:.1g}"

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Of the orbit, shape (n,)."""
        return self.orbit.multipliers

    @property
    def doubles(self) -> bool:
        """True if a branch of twice the period begins here, and can be followed."""
        return self.kind == DOUBLING or (self.at is not None and self.border.endswith(WITH_DOUBLING))


def _known(point: OrbitPoint) -> NDArray[np.complex128]:
    """The multipliers, with zero for those within rounding of the largest: for a long chaotic cycle they may have any value."""
    values = point.orbit.multipliers
    return np.where(np.abs(values) > ROUNDING * np.abs(values[0]), values, 0)


def _share(values: NDArray[np.complex128], one: float) -> float:
    """The product of sums with 1 or -1, each as a share of the sizes of its terms: no large multiplier hides a zero."""
    return float(np.prod((values + one) / (1 + np.abs(values))).real)


def _doubling(point: OrbitPoint, _: Floats) -> float:
    return _share(_known(point), 1.0)


def _fold(_: OrbitPoint, along: Floats) -> float:
    return float(along[-1])


def _one(point: OrbitPoint, _: Floats) -> float:
    return _share(-_known(point), 1.0)


def _torus(point: OrbitPoint, _: Floats) -> float:
    """The product of (a b - 1), as shares, over pairs of multipliers."""
    values = _known(point)
    i, j = np.triu_indices(len(values), 1)
    return _share(values[i] * values[j], -1.0)


Test = Callable[[OrbitPoint, Floats], float]
TESTS: dict[str, Test] = {DOUBLING: _doubling, FOLD: _fold, BRANCH_POINT: _one, TORUS: _torus}


def between(curve: OrbitCurve, step: Step[OrbitPoint], kinds: Collection[str]) -> list[BifurcationPoint]:
    """The events of these kinds within a step along a curve, in order.

    A doubled cycle that ends on the original one is reported whether or not it is among the kinds.
    """
    found: list[tuple[float, BifurcationPoint]] = []
    tests = [(kind, test) for kind, test in TESTS.items() if kind in (FOLD, *kinds)]
    ends = {kind: (test(step.start, step.direction), test(step.end, step.turned)) for kind, test in tests}
    passed = {kind for kind, (a, b) in ends.items() if (a * b < 0 or a != 0 == b) and max(abs(a), abs(b)) > CONSERVED}
    if FOLD in passed:
        passed.discard(BRANCH_POINT)
    if (passed & {FOLD, BRANCH_POINT} and swapped(curve, step.start, step.end)) or merged(curve, step):
        passed = {HALVING}
    for kind in passed & {*kinds, HALVING}:
        turns = False
        if kind == HALVING:
            known = halving(curve, step)
        elif kind == BRANCH_POINT:
            known = crossing_within(curve, step)
        elif ends[kind][1] == 0:
            known = step.length, step.end, float(PRECISION * curve.unit + np.spacing(abs(step.end.value)))
        else:
            known = located(curve, step.start, step.direction, step.length, TESTS[kind])
            if kind == FOLD and (known is None or may_cross(step, known[1])):
                crossing = crossing_within(curve, step)
                known, turns = crossing or known, crossing is not None
        s, point, precision = known or (step.length, step.end, abs(step.end.value - step.start.value))
        if kind != TORUS or np.abs(point.orbit.multipliers.imag).max() > 0:  # otherwise two real ones whose product is one
            detail = _degenerate(curve, point, kind) if known else "not located: somewhere in the step before this orbit"
            event = BifurcationPoint(kind, point.value, precision, point.orbit, detail)
            if turns:
                event = replace(event, kind=BRANCH_POINT, detail=TURNS)
            if event.kind == BRANCH_POINT:
                event = replace(event, towards=curve.physical(curve.difference(step.end.y, step.start.y)))
            found.append((s, event))
    return [event for _, event in sorted(found, key=lambda pair: pair[0])]


def _degenerate(curve: OrbitCurve, point: OrbitPoint, kind: str) -> str:
    """What is special of a period doubling of a cycle of affine pieces."""
    return_map = curve.map_of(point.value) if kind == DOUBLING else None
    return AFFINE if return_map is not None and return_map.is_affine else ""


def may_cross(step: Step[OrbitPoint], point: OrbitPoint) -> bool:
    """True if another branch may pass next to a point within a step: the equations there are nearly dependent."""
    at, *ends = (np.linalg.svd(each.jacobian, compute_uv=False)[-1] for each in (point, step.start, step.end))
    return bool(at <= DEFICIENT * max(ends))


def located(curve: OrbitCurve, at: OrbitPoint, along: Floats, h: float, test: Test) -> tuple[float, OrbitPoint, float] | None:
    """The arclength within h of a point at which a test is zero, the point there, and the precision of its parameter.

    None where it is not found, or known to less than a share of 1e-8 of the parameter's range.
    """
    zero = locate(curve, at, along, h, test)
    if zero is None:
        return None
    point = zero.point
    precision = float(zero.error[-1] * curve.unit + np.spacing(abs(point.value)))
    return (zero.arclength, point, precision) if precision <= COARSEST * curve.unit else None


def swapped(curve: OrbitCurve, at: OrbitPoint, new: OrbitPoint) -> bool:
    """True if the halves of a cycle change places between neighbours on its branch."""
    q = curve.period
    rolled = curve.y(np.roll(new.orbit.states, q // 2, axis=0), new.value)
    other, same = (float(np.linalg.norm(curve.difference(at.y, y))) for y in (rolled, new.y))
    return q % 2 == 0 and other < (1 + ASIDE) * same  # or coincide, where they change places


def merged(curve: OrbitCurve, step: Step[OrbitPoint]) -> bool:
    """True if the halves of a cycle coincide at the end of a step, which has led to the cycle of half the period."""
    if curve.period % 2:
        return False
    halves = (np.split(each.orbit.states, 2) for each in (step.start, step.end))
    start, end = (np.abs(curve.coordinates.difference(*pair) / curve.scale).max() for pair in halves)
    return bool(start > curve.tolerance and end < MERGED * start)


def halving(curve: OrbitCurve, step: Step[OrbitPoint]) -> tuple[float, OrbitPoint, float] | None:
    """The place within a step where a cycle has half its period, as in `located`: a doubling of the cycle of half the period."""
    half, at = replace(curve, period=curve.period // 2), step.start
    first, second = np.split(at.orbit.states, 2)
    middle = first + curve.coordinates.difference(second, first) / 2
    upward = np.append(np.zeros(middle.size), 1.0)
    here = correct(half, half.y(middle, at.value), upward)
    if here is None:
        return None
    along = tangent(here, upward)
    before = correct(half, here.y - step.length * along, along)
    return located(half, before, along, 2 * step.length, TESTS[DOUBLING]) if before else None
