"""What composite maps keep of the exact map's long run: doublings, multipliers, attractors."""

import numpy as np
import pytest
from scipy.optimize import brentq

import nsmaps
from nsmaps.dynamics.attractors.distance import hausdorff
from nsmaps.reduced.adaptive.surrogate import strip_map

DOUBLING = 0.32418854
MULTIPLIERS = [-0.82672902, -0.07559914]
AROUND = (0.55, 1.0), (0.0, 1.5)  #: holds the attractors for d in [0.26, 0.35]


@pytest.mark.thorough
@pytest.mark.parametrize(("tolerance", "off"), [(1e-3, 1e-3), (1e-4, 2e-5)])
def test_doubling_of_strips(pair, tolerance, off):
    def of(d):
        return strip_map(pair(d), ((0.6, 0.95), (0.05, 1.0)), tolerance)

    def orbit(d):
        found = nsmaps.periodic_orbit(of(d), [0.8, 0.31])
        assert found.converged
        return found

    ends = DOUBLING - off, DOUBLING + off  # where the doubling is not between the ends, there is an error
    value = brentq(lambda d: np.linalg.det(orbit(d).derivative + np.eye(2)), *ends, xtol=off / 20)
    assert 0 < abs(value - DOUBLING) < off
    assert np.isclose(orbit(value).multipliers[0], -1, atol=off)


def test_multipliers_of_strips(pair):
    made = nsmaps.periodic_orbit(strip_map(pair(0.35), AROUND, 1e-4), [0.8, 0.4])
    assert made.converged
    assert np.allclose(made.multipliers, MULTIPLIERS, rtol=1e-2)
    assert np.allclose(made.states, [[0.83338599, 0.36361156]], atol=1e-4)


def attractor(return_map):
    """States of the attractor from two hundred starts, shape (40000, 2), none of which may leave the map."""
    starts = np.random.default_rng(1).uniform([0.79, 0.29], [0.81, 0.31], (200, 2))
    made = nsmaps.bifurcation_diagram(lambda _: return_map, "p", [0.0], starts, n_returns=200, transient=3000)
    assert made.held.all()
    return made.states.reshape(-1, 2)


@pytest.mark.thorough
@pytest.mark.parametrize(("d", "most"), [(0.26, 2e-3), (0.27, 1e-4), (0.30, 1e-4), (0.35, 1e-4)])
def test_attractor_of_strips(pair, d, most):
    strips = strip_map(pair(d), AROUND, 1e-4)
    assert 0 < hausdorff(attractor(pair(d)), attractor(strips), strips.coordinates) < most
