"""The points at which two branches of periodic orbits cross, and the other branch there.

At such a point the derivative A of the gaps by states and parameter has two null vectors. Bordered by a column and two rows, the
last entries of the row that solves the bordered equations are zero exactly there: two conditions. An unknown share of the column
added to the gaps, zero at a crossing, makes as many unknowns as equations, which are regular, so that Newton's method finds
the point from either branch: W.-J. Beyn et al., in: Handbook of Dynamical Systems 2 (2002) 149.

The combinations v of the null vectors with w F'' v v = 0 are the tangents, w the left null vector, the second root of the
bifurcation equation: H. B. Keller, in: Applications of Bifurcation Theory, Academic Press (1977) 359.
"""

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.continuation.core import MAX_CORRECTIONS, WORST, Step, length
from nsmaps.continuation.zeros import PRECISION
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint

STEP = 1e-4  #: of the differences of the derivative along the null vectors, in the curve's units
H = 1e-5  #: of those of the conditions
ASTRAY = 0.1  #: share of a step, by which a crossing may lie beyond its ends

Borders = tuple[Floats, Floats]


def crossing_within(curve: OrbitCurve, step: Step[OrbitPoint]) -> tuple[float, OrbitPoint, float] | None:
    """The arclength within a step at which another branch crosses, the orbit there, and the precision of its parameter, or None.

    The iteration ends where steps consist of rounding, which is the precision.
    """
    y, share, last = step.start.y + curve.difference(step.end.y, step.start.y) / 2, 0.0, np.inf
    borders = borders_of(step.start.jacobian)
    for _ in range(MAX_CORRECTIONS):
        here = curve.evaluate(y)
        slopes = None if here is None else slopes_of(curve, here, borders)
        if here is None or slopes is None:
            return None
        size = len(here.residual)
        matrix = np.zeros((size + 2, size + 2))
        matrix[:size, 0], matrix[:size, 1:], matrix[size:, 1:] = borders[0], here.jacobian, slopes
        change = np.linalg.solve(matrix, -np.append(here.residual + share * borders[0], conditions(here.jacobian, borders)))
        moved = float(np.linalg.norm(change[1:]))
        if moved <= WORST and moved >= last / 2:
            return _placed(curve, step, here, moved)
        y, share, last = here.y + change[1:], share + change[0], moved
    return None


def _placed(curve: OrbitCurve, step: Step[OrbitPoint], found: OrbitPoint, error: float) -> tuple[float, OrbitPoint, float] | None:
    """As `crossing_within`, of a point at which the conditions hold; None where the gaps are not zero, or it is elsewhere."""
    off = curve.difference(found.y, step.start.y)
    s = float(off @ step.direction)
    inside = -ASTRAY * step.length <= s <= (1 + ASTRAY) * step.length and length(off - s * step.direction) <= step.length
    if not (inside and curve.exists(found) and curve.connects(step.start, found)):
        return None
    return s, found, float((4 * error + PRECISION) * curve.unit + np.spacing(abs(found.value)))


def borders_of(jacobian: Floats) -> Borders:
    """A column (m,) and two rows (2, m + 1) that make a matrix (m, m + 1) with at most two null vectors regular."""
    left, _, right = np.linalg.svd(jacobian)
    return left[:, -1] * np.copysign(1.0, left[np.abs(left[:, -1]).argmax(), -1]), right[-2:]


def conditions(jacobian: Floats, borders: Borders) -> Floats:
    """Two numbers that are zero where a matrix (m, m + 1) has two null vectors, shape (2,)."""
    size = len(jacobian)
    bordered = np.zeros((size + 2, size + 2))
    bordered[:size, :-1], bordered[:size, -1], bordered[size:, :-1] = jacobian, *borders
    return np.asarray(np.linalg.solve(bordered.T, np.eye(1, size + 2, size + 1)[0])[size:])


def slopes_of(curve: OrbitCurve, here: OrbitPoint, borders: Borders) -> Floats | None:
    """The derivatives of both conditions by states and parameter, shape (2, m + 1), by central differences, or None."""
    codes, steps = here.orbit.returns.codes, H * np.eye(len(here.y))
    slopes = [slope_of((curve, curve), (here.y + step, here.y - step), codes, borders) for step in steps]
    found = [slope for slope in slopes if slope is not None]
    return np.array(found).T if len(found) == len(slopes) else None


def slope_of(curves: tuple[OrbitCurve, OrbitCurve], y: tuple[Floats, Floats], codes: Ints, borders: Borders) -> Floats | None:
    """The difference of the conditions at unknowns of two curves, above and below, by 2 H, shape (2,); None for other words."""
    found = list[Floats]()
    for curve, unknowns in zip(curves, y, strict=True):
        there = curve.evaluate(unknowns)
        if there is None or not np.array_equal(there.orbit.returns.codes, codes):
            return None
        found.append(conditions(there.jacobian, borders))
    return np.asarray((found[0] - found[1]) / (2 * H))


def other_tangent(curve: OrbitCurve, here: OrbitPoint, own: Floats) -> Floats | None:
    """The unit tangent of the other branch at a point where one with the tangent `own` is crossed; None where none is found."""
    left, _, right = np.linalg.svd(here.jacobian)
    null, w = right[-2:], left[:, -1]
    form = np.empty((2, 2))
    for row, along in zip(form, null, strict=True):
        low, high = (curve.evaluate(here.y + sign * STEP * along) for sign in (-1, 1))
        if low is None or high is None or not (curve.connects(here, low) and curve.connects(here, high)):
            return None
        row[:] = w @ (high.jacobian - low.jacobian) @ null.T
    values, vectors = np.linalg.eigh(form + form.T)
    if not values[0] < 0 < values[1]:
        return None
    shares = np.sqrt([values[1], -values[0]])
    tangents = (np.array([[1, 1], [1, -1]]) * shares) @ vectors.T @ null
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    return np.asarray(tangents[np.argmin(np.abs(tangents @ own))])
