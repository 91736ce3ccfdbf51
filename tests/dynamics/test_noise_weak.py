"""The weak order of the scheme of noise: expectations at a step against those at half of it, on the same coarse path.

The fine path and its mirror image, about the mean that the coarse grid points leave it, are equally likely on one coarse path.
In the mean of the two what is linear in the fine part cancels, which is all that is of the strong order 3/2.
"""

import numpy as np
import pytest

from nsmaps.dynamics.noise.orbits import Noise, _blank, exact_step, linear_law
from nsmaps.exact.kernel import STEPS

TAU, START = 0.5, (0.83338599, 0.36361156)  #: the fixed point at d = 0.35


class Given:
    """Normal numbers made before, in place of a generator."""

    def __init__(self, first, normals):
        self.first, self.normals = first, normals

    def standard_normal(self, shape=()):
        if shape == ():
            return self.first
        made, self.normals = np.split(self.normals, [shape[0] * shape[1]])
        return made.reshape(shape)


def mirror(transition, root, h):
    """What takes the six normals of two exact steps h/2 to those of the mirror image, which end in the same state."""
    both = np.hstack([transition @ root, root]) / np.array([h * h, h, 1])[:, None]
    return 2 * np.linalg.pinv(both) @ both - np.eye(6)


def states(system, noise, h, n, count, seed):
    """States after returns 1 to n at step h, at h/2, and at h/2 of the mirror images: shape (count, 3, n, 2)."""
    law, kernel, rng = linear_law(system), system._kernel(), np.random.default_rng(seed)
    step = exact_step(*law, noise, h / 2)
    reflect, numbers = mirror(*step, h).T, STEPS * 2 * (int(3 * n / h / STEPS) + 1)  # a return takes less than 3 here
    made = np.empty((count, 3, n, 2))
    for k in range(count):
        first, normals = rng.standard_normal(), rng.standard_normal((numbers, 3))
        other = (normals.reshape(-1, 6) @ reflect).reshape(-1, 3)
        for i, (path, parts) in enumerate([(normals, 2), (normals, 1), (other, 1)]):
            tables = _blank(n, 1, 0, 2)
            tables["states"][:, 0] = START
            rows = tuple(table[0] for table in tables.values())
            kernel.noisy_orbit((*law, h / 2 * parts, noise.sigma), step, parts, 1e-6, Given(first, path), rows)
            made[k, i] = tables["states"][0, 1:]
    return made


def gaps(system, sigma, steps, n, count, seed=1):
    """E[P_h - P_(h/2)] and its standard error for P = v, cos phi, sin phi after each return: shape (2, steps, n, 3)."""
    found = []
    for i, h in enumerate(steps):
        x = states(system, Noise(sigma=sigma, tau=TAU), h, n, count, (seed, i))
        p = np.stack([x[..., 0], np.cos(x[..., 1]), np.sin(x[..., 1])], axis=-1)
        off = p[:, 0] - p[:, 1:].mean(axis=1)
        found.append([off.mean(axis=0), off.std(axis=0) / count**0.5])
    return np.swapaxes(found, 0, 1)


def order_of(steps, gap, error):
    """The slope of log |gap| by log h, weighted, and its standard error."""
    weight, x = np.abs(gap / error), np.log(steps)
    (slope, _), covariance = np.polyfit(x, np.log(np.abs(gap)), 1, w=weight, cov="unscaled")
    return slope, covariance[0, 0] ** 0.5


def test_mirror_images_are_equally_likely_and_end_in_the_same_state():
    transition, root = exact_step(0.0, 0.0, Noise(sigma=0.1, tau=TAU), 0.05)
    reflect = mirror(transition, root, 0.1)
    assert np.allclose(reflect @ reflect.T, np.eye(6), atol=1e-12)
    assert np.allclose(np.hstack([transition @ root, root]) @ reflect, np.hstack([transition @ root, root]), atol=1e-15)


def test_the_phase_of_a_return_has_weak_order_three(pair):
    """Seven standard errors from order 5/2."""
    steps = [0.25, 0.125, 0.0625, 0.03125]
    gap, error = gaps(pair(0.35), 0.05, steps, 1, 1000)
    order, off = order_of(steps, gap[:, 0, 1], error[:, 0, 1])
    assert order == pytest.approx(3, abs=0.3)
    assert off < 0.07


@pytest.mark.thorough
@pytest.mark.parametrize(("sigma", "count"), [(0.03, 16_000), (0.05, 24_000)])
def test_weak_order_at_length(pair, sigma, count):
    steps = [0.125, 0.0625, 0.03125, 0.015625]
    gap, error = gaps(pair(0.35), sigma, steps, 2, count)
    for n, name, least, most in ((0, 1, 2.8, 3.2), (0, 2, 2.8, 3.2), (1, 1, 2, 3.5)):  # of the second a few paths graze
        order, off = order_of(steps, gap[:, n, name], error[:, n, name])
        assert least < order < most, f"return {n + 1}: {order:.3f} +- {off:.3f}"
    assert (np.abs(gap[:, 0, 0]) < np.abs(gap[:, 0, 1]) / 2 + 4 * error[:, 0, 0]).all()  # v is better still
