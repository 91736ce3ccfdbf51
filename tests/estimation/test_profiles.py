"""Profile likelihoods of sums of squares that are known in closed form, and intervals beside other minima."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from nsmaps.estimation.shooting.fitting import Fit
from nsmaps.estimation.shooting.inference import crossing, profile, spread_of
from nsmaps.estimation.shooting.problem import Problem
from nsmaps.estimation.summary import Found, with_rivals

HEIGHT, WIDTH = 1e4, 0.02


class Valley:
    """Residuals p and one that is zero on s = p^2 alone and falls beyond `WIDTH` of it, where steps miss it."""

    model = SimpleNamespace(free=("p",))
    size = 2

    def sizes(self, number: int, pairing: Any) -> tuple[int, int, int, int]:
        return 2, 0, 0, 0

    def residuals(self, x: np.ndarray, pairings: Any, weight: float) -> tuple[np.ndarray, np.ndarray]:
        p, u = x[0], (x[1] - x[0] ** 2) / WIDTH
        slope = HEIGHT * (1 - u**2) / (1 + u**2) ** 2 / WIDTH
        return np.array([p, HEIGHT * u / (1 + u**2)]), np.array([[1.0, 0.0], [-2 * p * slope, slope]])


def test_the_profile_follows_a_narrow_curved_valley() -> None:
    shooting: Any = Valley()
    ends = np.full(2, -10.0), np.full(2, 10.0)
    problem = Problem(shooting, ends, np.ones(2), "linear", (True,))
    pairings: Any = (None,)
    values, slopes = shooting.residuals(np.zeros(2), pairings, 1.0)
    found = Fit(np.zeros(2), pairings, 0.0, values, slopes, 0, True)
    line = profile(problem, found, 0, 1.0, spread_of(found, 1, problem.scale))
    np.testing.assert_allclose(line.chi2, line.values**2, atol=1e-3)
    assert crossing(line.values, line.chi2, 4.0) == pytest.approx((-2.0, 2.0), abs=1e-3)


def test_a_profile_that_ends_below_a_level_has_no_crossing() -> None:
    ends = crossing(np.arange(4.0), np.array([1.0, 0.0, 1.0, np.nan]), 4.0)
    assert ends[0] == -np.inf
    assert np.isnan(ends[1])


def test_intervals_enclose_another_minimum_by_the_level_that_its_sum_of_squares_leaves() -> None:
    """A second minimum at 5, with chi2 3 above and a standard error of 2, ends at 5 + 2 sqrt(4 - 3) for two errors."""

    def one(place: float, chi2: float, error: float) -> Found:
        spread: Any = SimpleNamespace(covariance=np.array([[error**2]]))
        return Found(Fit(np.array([place]), (), chi2, np.zeros(1), np.zeros((1, 1)), 0, True), spread, 0)

    intervals, limits = np.array([[[-1.0, 1.0], [-2.0, 2.0]]]), (np.array([-9.0]), np.array([9.0]))
    wider = with_rivals(intervals, [one(0.0, 7.0, 1.0), one(5.0, 10.0, 2.0)], 1.0, limits)
    np.testing.assert_allclose(wider, [[[-1.0, 1.0], [-2.0, 7.0]]], atol=2e-3)
