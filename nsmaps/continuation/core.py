"""Pseudo-arclength continuation (Keller 1977) of a curve F(y) = 0 of m equations in m + 1 unknowns.

The unknowns y are in units in which the curve is of order one: lengths and directions are those of this scaled space. Equations
may have any units, for each is measured by its own gradient.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from nsmaps.arrays import Floats

MAX_CORRECTIONS = 20  #: steps of Newton's method
ROUNDING = 4e-16  #: error of an unknown of order one that Newton's method may leave in a corrected point
STALLED = 1e-12  #: a Newton step below this that is at least half as long as the last one is rounding
BLUR = 5e-15  #: rounding of the equations, each in units of its gradient's length
WORST = 1e-9  #: error of a point, by this rounding, above which it is rejected: where two curves cross
SHARE = 0.1  #: of a step: change of the parameters, below which its length is that of their change alone, up to 1/SHARE as long
STRAY = 0.1  #: share of a step: largest distance of the first point of a closed curve from its chord


class Point(Protocol):
    """Values and derivatives of the equations at a point."""

    @property
    def y(self) -> Floats:
        """The unknowns, scaled, shape (m + 1,)."""

    @property
    def residual(self) -> Floats:
        """The equations, shape (m,)."""

    @property
    def jacobian(self) -> Floats:
        """Their derivatives by the unknowns, shape (m, m + 1)."""


P = TypeVar("P", bound=Point)


class Curve(Protocol[P]):
    """Equations whose solutions form a curve."""

    def evaluate(self, y: Floats) -> P | None:
        """The equations at unknowns, shape (m + 1,); None where they have no value."""

    def exists(self, point: P) -> bool:
        """True if a solution of the equations represents an object of the problem."""

    def connects(self, one: P, other: P) -> bool:
        """True if two neighbouring solutions belong to one smooth curve."""

    def difference(self, one: Floats, other: Floats) -> Floats:
        """The unknowns `one - other`, with angles the shorter way round."""


@dataclass(frozen=True, slots=True)
class Control:
    """The resolution of a curve, and the bounds of its last unknown."""

    max_step: float  #: longest step, in arclength
    shortest: float  #: step at which the curve is abandoned
    cosine: float  #: least cosine between the directions at both ends of a step
    growth: float = 1.5  #: largest growth from a step to the next
    low: float = -np.inf  #: least value of the last unknown; a step that would cross it ends on it
    high: float = np.inf  #: greatest value of the last unknown
    parameters: int = 0  #: last unknowns, of which alone a step is long where the others change by much more, as a mean value


@dataclass(frozen=True, slots=True)
class Step(Generic[P]):
    """One step along a curve."""

    start: P
    direction: Floats  #: unit tangent at the start, shape (m + 1,)
    end: P
    turned: Floats  #: unit tangent at the end, in the same sense
    length: float  #: of the step along `direction`
    last: bool  #: True if it leads to the least or greatest value of the last unknown


def length(y: Floats) -> float:
    """The Euclidean length of a vector."""
    return math.sqrt(y.dot(y))


def scaled_rows(point: Point) -> tuple[Floats, Floats]:
    """The equations divided by the lengths of their gradients, and these gradients: (residual, jacobian)."""
    lengths = np.sqrt((point.jacobian**2).sum(axis=1))
    lengths[~(lengths > 0)] = 1.0
    return point.residual / lengths, point.jacobian / lengths[:, None]


def tangent(point: Point, sense: Floats) -> Floats:
    """The unit tangent of the curve at a point, oriented by `sense`: the null vector of the Jacobian."""
    along = np.linalg.svd(scaled_rows(point)[1])[2][-1]
    return np.asarray(along * np.copysign(1.0, along @ sense))


def correct(curve: Curve[P], y: Floats, normal: Floats) -> P | None:
    """The point of a curve in the plane through y with this normal, by Newton's method; None where there is none.

    The iteration ends when the remaining error is below rounding, if it decreases by the ratio of the last two steps, or when
    a step consists of rounding only, which grows where the equations are nearly singular.
    """
    last, plane = np.nan, y
    for _ in range(MAX_CORRECTIONS):
        here = curve.evaluate(y)
        step = None if here is None else _newton_step(here, normal, float(normal @ curve.difference(plane, here.y)))
        if here is None or step is None:
            return None
        size, y = length(step), here.y + step
        stalls = WORST >= size >= 0.5 * last and (size <= STALLED or size * least_gain(here, normal) <= BLUR)
        if size <= ROUNDING or size * (size / last) <= ROUNDING or stalls:
            there = curve.evaluate(y)
            return there if there is not None and curve.exists(there) else None
        last = size
    return None


def correct_beside(
    point: Point, y: Floats, normal: Floats, residual: Callable[[Floats], tuple[Floats, Floats] | None]
) -> Floats | None:
    """The unknowns in the plane through y with this normal that solve equations whose derivatives are all but those at a point.

    None where a step is not much shorter than the last one, until it is rounding.

    Args:
        residual: at unknowns, these as they are best represented, and the equations; None where they have no value.
    """
    lengths = np.linalg.norm(point.jacobian, axis=1)
    lengths[~(lengths > 0)] = 1.0
    matrix, last = np.vstack([point.jacobian / lengths[:, None], normal]), np.inf
    for _ in range(MAX_CORRECTIONS):
        there = residual(y)
        if there is None:
            return None
        try:
            step = np.linalg.solve(matrix, np.append(-there[1] / lengths, 0.0))
        except np.linalg.LinAlgError:
            return None
        size, y = length(step), there[0] + step
        if size <= STALLED and (size >= 0.5 * last or size <= ROUNDING):
            return y
        if not size < 0.5 * last:
            return None
        last = size
    return None


def _newton_step(point: Point, normal: Floats, off: float) -> Floats | None:
    """Newton's step into the plane with this normal, this far off; None where the equations are singular."""
    right, matrix = _bordered(point, normal)
    right[-1] = off
    try:
        step = np.asarray(np.linalg.solve(matrix, right), float)
    except np.linalg.LinAlgError:
        return None
    return step if np.isfinite(step).all() else None


def _bordered(point: Point, normal: Floats) -> tuple[Floats, Floats]:
    """The scaled equations with that of the plane with this normal: (minus the residual, jacobian)."""
    right, matrix = np.zeros(len(normal)), np.empty((len(normal), len(normal)))
    residual, matrix[:-1] = scaled_rows(point)
    right[:-1], matrix[-1] = -residual, normal
    return right, matrix


def least_gain(point: Point, normal: Floats) -> float:
    """The least length of the scaled equations' change for a unit step in the plane, or off it: their smallest singular value."""
    return float(np.linalg.svd(_bordered(point, normal)[1], compute_uv=False)[-1])


def follow(curve: Curve[P], start: P, direction: Floats, control: Control) -> Iterator[Step[P]]:
    """The steps along a curve from a point on it in a direction, until a step of the shortest length fails.

    It also ends at the least and greatest value of the last unknown. A step is halved if it finds no point, a point that is
    not a neighbour, or if the curve turns by too much.
    """
    h = control.max_step
    while h > control.shortest:
        step = _try(curve, start, direction, _to_the_end(start, direction, h, control), control)
        if step is None:
            h = _to_the_end(start, direction, h, control) / 2
            continue
        yield step
        if step.last:
            return
        gentle = step.turned @ direction > 1 - (1 - control.cosine) / 4
        h = min(control.growth * step.length, _largest_step(step.turned, control)) if gentle else step.length
        start, direction = step.end, step.turned


def _largest_step(direction: Floats, control: Control) -> float:
    """The largest step in a direction: larger than the control has it where the parameters change by less than a share of it."""
    share = length(direction[len(direction) - control.parameters :]) / SHARE
    return control.max_step / max(share, SHARE) if control.parameters and share < 1 else control.max_step


def _to_the_end(point: Point, direction: Floats, h: float, control: Control) -> float:
    """A step, shortened if it would pass the least or greatest value of the last unknown."""
    end = control.high if direction[-1] > 0 else control.low
    left = (end - point.y[-1]) / direction[-1] if direction[-1] else np.inf
    return float(left) if 0 < left < h else h


def _try(curve: Curve[P], start: P, direction: Floats, h: float, control: Control) -> Step[P] | None:
    """A step of this length, None if it fails."""
    y, normal = start.y + h * direction, direction
    if last := not control.low < y[-1] < control.high:
        y[-1] = control.high if direction[-1] > 0 else control.low
        normal = np.append(np.zeros(len(y) - 1), 1.0)
    end = correct(curve, y, normal)
    if end is None or not curve.connects(start, end) or length(curve.difference(end.y, start.y)) > 2 * h:
        return None
    turned = tangent(end, direction)
    inside = last or control.low <= end.y[-1] <= control.high
    return Step(start, direction, end, turned, h, last) if turned @ direction >= control.cosine and inside else None


def passes(curve: Curve[P], step: Step[P], point: P, direction: Floats, cosine: float) -> bool:
    """True if a step passes a point at which the curve has this direction, such as the first one where a curve closes.

    The directions there and at the end of the step may differ by twice the angle by which a step may turn.
    """
    if not step.turned @ direction > 2 * cosine**2 - 1:
        return False
    chord, back = curve.difference(step.end.y, step.start.y), curve.difference(point.y, step.start.y)
    return passes_by(chord, back)


def passes_by(chord: Floats, back: Floats) -> bool:
    """True if a step along a chord passes a point, which is given by its difference from the start of the step."""
    share = float(back @ chord) / float(chord @ chord)
    return 0 < share <= 1 and length(back - share * chord) < STRAY * length(chord)
