"""Continuation of curves whose points, lengths, folds and ends are known in closed form, in units from 1e-6 to 1e6."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle

import numpy as np
import pytest

from nsmaps.continuation.core import Control, correct, follow, passes, tangent
from nsmaps.continuation.zeros import locate

UNITS = [1e-6, 1.0, 1e6]
ALONG = Control(max_step=0.1, shortest=1e-9, cosine=0.98)


@dataclass(frozen=True)
class Solution:
    y: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray


@dataclass(frozen=True)
class Equations:
    """Equations f(x, a) with derivatives by x, for a size a of the curve and in a unit of f; unknowns are shares of the size."""

    f: Callable
    size: float = 1.0
    unit: float = 1.0

    def evaluate(self, y):
        value, slopes = self.f(y * self.size, self.size)
        return Solution(y, np.atleast_1d(value) * self.unit, np.atleast_2d(slopes) * self.unit * self.size)

    def exists(self, point):
        return True

    def connects(self, one, other):
        return True

    def difference(self, one, other):
        return one - other


def circle(x, a):
    return x @ x - a * a, 2 * x


def parabola(x, a):
    """The last unknown turns back at 0."""
    return a * x[1] - x[0] ** 2, [-2 * x[0], a]


def hairpin(x, a):
    """A parabola p = 1000 x^2 that turns back at its tip within a radius of 1/2000, like a cusp."""
    return a * x[1] - 1000 * x[0] ** 2, [-2000 * x[0], a]


def helix(x, a):
    """Three equations in four unknowns: x = cos p, z = sin p, w = x z."""
    x, z, w, p = x / a
    slopes = np.array([[1, 0, 0, np.sin(p)], [0, 1, 0, -np.cos(p)], [-z, -x, 1, 0]])
    return np.array([x - np.cos(p), z - np.sin(p), w - x * z]), slopes / a


def cross(x, a):
    """Two lines, p = 0 and x = 0, through the origin: no tangent there."""
    return x[0] * x[1], [x[1], x[0]]


def steps(curve, y, sense, control=ALONG, most=1000):
    """The steps along a curve from a point on it."""
    start = curve.evaluate(np.array(y, float))
    along = follow(curve, start, tangent(start, np.array(sense, float)), control)
    return [step for step, _ in zip(along, range(most), strict=False)]


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("size", UNITS)
def test_a_circle_is_followed_all_around(size, unit):
    """Its points lie on it to rounding; it closes after 2 pi, however large it is and whatever its equation's unit."""
    curve, start = Equations(circle, size, unit), np.array([1.0, 0.0])
    taken = steps(curve, start, [0, 1], most=65)
    closing = [passes(curve, step, curve.evaluate(start), np.array([0.0, 1.0]), ALONG.cosine) for step in taken]
    radius = np.array([np.linalg.norm(step.end.y) for step in taken])
    assert np.abs(radius - 1).max() < 3e-16
    assert np.flatnonzero(closing).tolist() == [closing.index(True)]
    before, behind = (taken[closing.index(True)].start.y, taken[closing.index(True)].end.y)
    assert before[1] < 0 <= behind[1] + 1e-15
    assert 2 * np.pi < 0.1003 * (closing.index(True) + 1) < 2 * np.pi + 0.11


@pytest.mark.parametrize("unit", UNITS)
def test_a_circle_is_not_closed_where_it_is_passed_the_other_way(unit):
    curve = Equations(circle, unit=unit)
    start = curve.evaluate(np.array([1.0, 0.0]))
    taken = steps(curve, [1, 0], [0, 1], most=65)
    assert not any(passes(curve, step, start, np.array([0.0, -1.0]), ALONG.cosine) for step in taken)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("size", UNITS)
def test_a_fold_is_passed_and_located(size, unit):
    """From the left arm of a parabola to the right one, to the end of the range; the fold at the zero of the last component."""
    curve, control = Equations(parabola, size, unit), Control(0.1, 1e-9, 0.98, low=-1.0, high=1.0)
    taken = steps(curve, [-0.9, 0.81], [0, -1], control)
    assert taken[-1].end.y[1] == 1.0  # the end of the range itself
    assert abs(taken[-1].end.y[0] - 1) < 1e-15
    (folding,) = [step for step in taken if step.direction[1] * step.turned[1] <= 0]
    zero = locate(curve, folding.start, folding.direction, folding.length, lambda _, along: along[1])
    assert abs(zero.point.y[0]) < 3e-13
    assert abs(zero.point.y[1]) < 1e-15
    assert (np.abs(zero.point.y) <= zero.error).all()


def test_no_zero_where_the_test_keeps_its_sign():
    curve = Equations(circle)
    start = curve.evaluate(np.array([1.0, 0.0]))
    assert locate(curve, start, np.array([0.0, 1.0]), 0.1, lambda point, _: point.y[0]) is None


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("size", UNITS)
def test_a_tight_turn_is_followed_in_small_steps(size, unit):
    """Steps shrink to the turn's radius and grow again behind it; every one of them turns by little."""
    taken = steps(Equations(hairpin, size, unit), [-0.03, 0.9], [0, -1], Control(0.1, 1e-9, 0.98, low=-1.0, high=1.0))
    y = np.array([step.end.y for step in taken])
    assert (np.diff(y[:, 0]) > 0).all()
    assert y[-1, 1] == 1.0
    assert np.abs(y[:, 0] / np.sign(y[:, 0]) - np.sqrt(y[:, 1] / 1000)).max() < 1e-15
    assert 1e-5 < min(step.length for step in taken) < 5e-4
    assert max(step.length for step in taken if step.start.y[0] > 0.01) == 0.1
    assert all(step.turned @ step.direction >= 0.98 for step in taken)


@pytest.mark.parametrize(("slope", "number"), [(1, 29), (20, 201), (1000, 2001)])
def test_steps_are_long_where_a_parameter_changes_by_little(slope, number):
    """On a line x = slope p, 2 slope long or more: steps of 0.1 beyond a share 1/10 of the parameter, up to ten times as long."""

    def line(x, a):
        return x[0] - slope * x[1], [1, -slope]

    taken = steps(Equations(line), [-slope, -1], [0, 1], Control(0.1, 1e-9, 0.98, low=-1.0, high=1.0, parameters=1), 5000)
    assert taken[-1].end.y.tolist() == [slope, 1]
    assert abs(len(taken) - number) <= 3 + 0.01 * number
    assert max(step.end.y[1] - step.start.y[1] for step in taken) < 0.1


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("size", UNITS)
def test_three_equations_in_four_unknowns(size, unit):
    """A turn of a helix: points and tangents by its formulas, and the unknown w = sin(2 p)/2 is zero at pi/2."""
    curve = Equations(helix, size, unit)
    taken = steps(curve, [1, 0, 0, 0], [0, 0, 0, 1], Control(0.1, 1e-9, 0.98, low=0.0, high=2 * np.pi))
    p = np.array([step.end.y[3] for step in taken])
    exact = np.column_stack([np.cos(p), np.sin(p), np.sin(2 * p) / 2, p])
    assert np.abs(np.array([step.end.y for step in taken]) - exact).max() < 2e-15
    slopes = np.column_stack([-np.sin(p), np.cos(p), np.cos(2 * p), np.ones_like(p)])
    slopes /= np.linalg.norm(slopes, axis=1)[:, None]
    assert np.abs(np.array([step.turned for step in taken]) - slopes).max() < 1e-14
    assert p[-1] == 2 * np.pi
    (step,) = [step for step in taken if step.start.y[3] < np.pi / 2 <= step.end.y[3]]
    zero = locate(curve, step.start, step.direction, step.length, lambda point, _: point.y[2])
    assert abs(zero.point.y[3] - np.pi / 2) <= zero.error[3] < 1e-12


def test_a_curve_that_ends_is_given_up_next_to_its_end():
    """Where no solutions exist beyond x = 0.5 steps shrink to the shortest one, and none is beyond."""

    class Ending(Equations):
        def exists(self, point):
            return point.y[0] <= 0.5

    taken = steps(Ending(parabola), [-0.5, 0.25], [1, 0])
    assert 0.5 - 1e-8 < taken[-1].end.y[0] <= 0.5


def test_where_two_curves_cross_no_zero_is_found():
    """On the line p = 0 the Jacobian vanishes at the origin: the test x is zero there."""
    curve = Equations(cross)
    start = curve.evaluate(np.array([-0.25, 0.0]))
    assert locate(curve, start, np.array([1.0, 0.0]), 0.5, lambda point, _: point.y[0]) is None
    assert correct(curve, np.zeros(2), np.array([1.0, 0.0])) is None


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize(("beside", "found"), [(1e-4, True), (1e-8, False)])
def test_rounding_next_to_a_crossing_leaves_a_point_until_it_is_too_large(beside, found, unit):
    """Equations known to 1e-15 give a point to 1e-15 over their distance from singular ones."""
    noise = cycle([1e-15, -1e-15])

    def rounded(x, a):
        """The line x = p = 0, along which the equations are the more singular the nearer y is to zero."""
        y, x, p = x / a
        return np.array([x, x + y * p + next(noise)]), np.array([[0, 1, 0], [p, 1, y]]) / a

    point = correct(Equations(rounded, unit=unit), np.array([beside, 1e-9, 1e-9]), np.array([1.0, 0.0, 0.0]))
    assert (point is not None) == found
    assert point is None or np.abs(point.y[1:]).max() < 1e-14 / beside
