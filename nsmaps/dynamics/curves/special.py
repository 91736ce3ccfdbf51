"""Points of codimension two on bifurcation curves: places where a second condition holds, or that it holds everywhere."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Step
from nsmaps.continuation.zeros import locate
from nsmaps.dynamics.curves.problem import CriticalCurve, CriticalPoint, Kind
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.results import Result

COARSEST = 1e-8  #: precision of a point of codimension two, in units of the parameters' ranges
IDENTICAL = 1e-9  #: a test within this bound at both ends of a step is zero up to rounding, as where a map preserves area
CUSP, FLIP, ONE, TWO = "cusp", "fold-flip", "1:1 resonance", "1:2 resonance"
RESONANCES = {ONE: 2.0, TWO: -2.0, "1:3 resonance": -1.0, "1:4 resonance": 0.0}  #: sums of the two multipliers on the unit circle
UNKNOWN = ("branch point", "grazing", "border collision", "detachment")  #: kinds of curves on which no points are looked for


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpecialPoint(Result):
    """A point of codimension two: two conditions hold at once.

    On curves of folds a `cusp` (two folds meet), a `fold-flip` (another multiplier is -1) or a `1:1 resonance` (a second is 1);
    on curves of period doublings a `fold-flip` (another multiplier is 1) or a `1:2 resonance` (a second is -1). On Neimark-Sacker
    curves the strong resonances: both multipliers are 1 or -1, where such a curve ends, or third or fourth roots of 1.
    """

    kind: str
    parameters: tuple[float, float]
    precision: tuple[float, float]  #: of these, as estimated from the last steps towards them
    orbit: PeriodicOrbit

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{self.kind} at ({self.parameters[0]:.10g}, {self.parameters[1]:.10g}) +- {max(self.precision):.1g}"


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
    if kind in UNKNOWN:
        return {}
    if kind == "Neimark-Sacker":
        return {name: partial(_beyond, value) for name, value in RESONANCES.items()}
    own = -1.0 if kind == "period doubling" else 1.0

    def at(x: float) -> Test:
        return lambda point, _: float(np.polyval(_remaining(point, own), x)) if len(point.orbit.derivative) > 1 else 1.0

    if kind == "period doubling":
        return {FLIP: at(1.0), TWO: at(-1.0)}
    return {FLIP: at(-1.0), ONE: at(1.0), CUSP: lambda _, along: float(along[-2:] @ direction[-2:])}


@dataclass(slots=True)
class Search:
    """The points of codimension two on a part of a curve, and the kinds whose conditions do not hold all along it."""

    points: list[SpecialPoint]
    isolated: set[str]

    def add(self, curve: CriticalCurve, step: Step[CriticalPoint]) -> None:
        """The points within a step, in order."""
        found = []
        for kind, test in _tests(curve.kind, step.direction).items():
            ends = test(step.start, step.direction), test(step.end, step.turned)
            if max(map(abs, ends)) <= IDENTICAL:
                continue
            self.isolated.add(kind)
            zero = locate(curve, step.start, step.direction, step.length, test) if ends[0] * ends[1] < 0 else None
            if zero is not None and (zero.error[-2:] <= COARSEST).all():
                first, second = curve.values(zero.point.y)
                near = (float(zero.error[-2] * curve.along.unit), float(zero.error[-1] * curve.unit))
                found.append((zero.arclength, SpecialPoint(kind, (first, second), near, zero.point.orbit)))
        self.points += [point for _, point in sorted(found, key=lambda pair: pair[0])]


def everywhere(curve: CriticalCurve, *searched: Search) -> tuple[str, ...]:
    """The kinds of points whose condition holds at all orbits of a curve, up to rounding."""
    isolated = set[str]().union(*(each.isolated for each in searched))
    return tuple(kind for kind in _tests(curve.kind, np.zeros(2)) if isolated and kind not in isolated)
