"""The test functions of events: shares, so that no large multiplier makes rounding look like an event."""

from types import SimpleNamespace

import numpy as np
import pytest

from nsmaps.dynamics.continuation.events import BRANCH_POINT, CONSERVED, DOUBLING, TESTS, TORUS


def point(*multipliers):
    return SimpleNamespace(orbit=SimpleNamespace(multipliers=np.array(multipliers, complex)))


@pytest.mark.parametrize("large", [1.0, 1e3, 1e6])
@pytest.mark.parametrize(("kind", "sign"), [(DOUBLING, -1.0), (BRANCH_POINT, 1.0)])
def test_a_multiplier_at_one_up_to_rounding_is_zero_beside_a_large_one(kind, sign, large):
    beside = point(3 * large, sign * (1 + 1e-12))
    assert abs(TESTS[kind](beside, np.zeros(0))) <= CONSERVED
    assert abs(TESTS[kind](point(3 * large, sign * 1.01), np.zeros(0))) > CONSERVED


@pytest.mark.parametrize("large", [3.0, 1e3, 1e6])
def test_conserved_areas_are_zero_and_others_are_not(large):
    assert abs(TESTS[TORUS](point(large, (1 + 1e-13) / large), np.zeros(0))) <= CONSERVED
    assert abs(TESTS[TORUS](point(large, 0.98 / large), np.zeros(0))) > CONSERVED


def test_the_signs_are_those_of_the_products():
    rng = np.random.default_rng(0)
    for _ in range(100):
        a, b, c = rng.uniform(-3, 3, 3)
        real = point(a, b, c)
        assert np.sign(TESTS[DOUBLING](real, np.zeros(0))) == np.sign((1 + a) * (1 + b) * (1 + c))
        assert np.sign(TESTS[BRANCH_POINT](real, np.zeros(0))) == np.sign((1 - a) * (1 - b) * (1 - c))
        assert np.sign(TESTS[TORUS](real, np.zeros(0))) == np.sign((a * b - 1) * (a * c - 1) * (b * c - 1))
