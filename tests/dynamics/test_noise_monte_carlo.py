"""Noise in systems with modes beside a Monte Carlo of their own equations: other random numbers, steps and events.

Means of the states and of their squares agree within four standard errors of both samples; those of a noise that is half as large
again do not.
"""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import sympy as sp

import nsmaps
from nsmaps.arrays import Floats

SIGMA, TAU = 0.3, 0.5


class Cushion(nsmaps.HybridSystem):
    """A mass on a spring that meets a stiff and damped cushion at x = 1, seen once a period."""

    states, noise = ("x", "v"), "eta"

    def period(self):
        return 5

    def modes(self, t, y):
        force = sp.cos(2 * sp.pi * t / 5) + y.eta - y.v / 10 - y.x
        return {"free": {"x": y.v, "v": force}, "held": {"x": y.v, "v": force - 20 * (y.x - 1) - y.v}}

    def guards(self, t, y):
        return {
            "meets": nsmaps.Guard("free", 1 - y.x, to="held"),
            "leaves": nsmaps.Guard("held", y.x - 1, to="free"),
            "seen": nsmaps.Guard(("free", "held"), -sp.sin(2 * sp.pi * t / 5), letter="s"),
        }

    def section(self, t, y):
        return nsmaps.PoincareSection("seen", ("x", "v"))


class Pendulum(nsmaps.HybridSystem):
    """A pendulum whose support is shaken with noise, x'' = -(1 + eta) sin x + 1/2, and that hits a stop at x = 0.6."""

    states, noise = ("x", "v"), "eta"

    def modes(self, t, y):
        return {"swings": {"x": y.v, "v": sp.Rational(1, 2) - (1 + y.eta) * sp.sin(y.x)}}

    def guards(self, t, y):
        return {"S": nsmaps.Guard("swings", sp.Rational(3, 5) - y.x, reset={"v": -sp.Rational(9, 10) * y.v})}

    def section(self, t, y):
        return nsmaps.PoincareSection("S", ("v",))


def paths(force: Callable[..., Floats], x: Floats, v: Floats, sigma: float, h: float) -> Iterator[None]:
    """Change places and velocities by one step of the midpoint rule after another, with noise drawn at half steps."""
    rng = np.random.default_rng(11)
    decay, t = np.exp(-h / 2 / TAU), 0.0
    eta = sigma * rng.standard_normal(len(x))
    while True:
        middle = decay * eta + sigma * np.sqrt(1 - decay**2) * rng.standard_normal(len(x))
        speed = v + h / 2 * force(t, x, v, eta)
        x[:], v[:] = x + h * speed, v + h * force(t + h / 2, x + h / 2 * v, speed, middle)
        eta = decay * middle + sigma * np.sqrt(1 - decay**2) * rng.standard_normal(len(x))
        t += h
        yield


def cushioned(sigma: float, count: int) -> Floats:
    """States after two periods, shape (count, 2)."""
    x, v = np.full(count, 0.5), np.full(count, 0.2)

    def force(t: float, x: Floats, v: Floats, eta: Floats) -> Floats:
        return np.cos(2 * np.pi * t / 5) + eta - v / 10 - x - np.where(x > 1, 20 * (x - 1) + v, 0)

    for _ in zip(range(2000), paths(force, x, v, sigma, 0.005), strict=False):
        pass
    return np.column_stack([x, v])


def hitting(sigma: float, count: int) -> Floats:
    """Speeds at the second impact after the start, shape (count, 1); impacts are placed within their step along a line."""
    x, v = np.full(count, 0.6), np.full(count, -0.9)
    hits, found, stop = np.zeros(count, int), np.full(count, np.nan), 0.6
    for _ in paths(lambda t, x, v, eta: 0.5 - (1 + eta) * np.sin(x), x, v, sigma, 0.005):
        hit = (x > stop) & (v > 0)
        late = np.where(hit, (x - stop) / np.where(hit, v, 1.0), 0.0)
        speed = v - late * (0.5 - np.sin(stop))
        hits += hit
        found = np.where(hit & (hits == 2), speed, found)
        x[:], v[:] = np.where(hit, stop - 0.9 * late * v, x), np.where(hit, -0.9 * speed, v)
        if (hits >= 2).all():
            return found[:, None]
    raise AssertionError


def distance(one: Floats, other: Floats) -> float:
    """The largest difference of the means of the coordinates and of their squares, in standard errors of both samples."""
    centre = one.mean(axis=0)
    rows = [np.concatenate([each, (each - centre) ** 2], axis=1) for each in (one, other)]
    error = np.sqrt(sum(each.var(axis=0) / len(each) for each in rows))
    return float((abs(rows[0].mean(axis=0) - rows[1].mean(axis=0)) / error).max())


@pytest.mark.parametrize(("system", "start", "alone"), [(Cushion(), [0.5, 0.2], cushioned), (Pendulum(), [1.0], hitting)])
def test_moments_are_those_of_a_monte_carlo(system, start, alone) -> None:
    noise = nsmaps.Noise(sigma=SIGMA, tau=TAU)
    made = nsmaps.noisy_orbits(system, start, noise, n_returns=2, n_realisations=500, rng=5).states[-1]
    assert distance(alone(SIGMA, 2000), made) < 4
    assert distance(alone(1.5 * SIGMA, 2000), made) > 6
