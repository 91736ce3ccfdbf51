"""Random systems that slide against an independent march: matrix exponentials of the fields and of their combination."""

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import expm
from scipy.optimize import brentq

from nsmaps import Guard, HybridSystem, Outcome, PoincareSection, SlidingSurface

STEPS = 400  # of the march in one period
CLEAR, FAST = 0.01, 0.05  # margins of returns that the march cannot miss
NAMES = "x", "y"


def random_system(rng):
    """A system of two states with a relay on h = 0, and the matrices of (x, y, 1, cos t, sin t) above, below and on it; h."""
    free = np.round(rng.uniform(-0.8, 0.8, (2, 5)), 3) - 0.4 * np.eye(2, 5)
    push = np.round(rng.uniform(-0.5, 0.5, 2), 3)
    h = np.array([*np.round(rng.uniform(0.2, 1, 2) * rng.choice([-1, 1], 2), 3), np.round(rng.uniform(-0.2, 0.2), 3), 0, 0])
    push = push + 0.8 * np.sign(h[:2])

    class Random(HybridSystem):
        """A random system."""

        unit: float = 1.0

        states = NAMES

        def period(self):
            return 2 * sp.pi

        def modes(self, t, y):
            features = [y.x, y.y, self.unit, sp.cos(t), sp.sin(t)]
            row = lambda k, sign: sum(map(sp.Mul, map(sp.Float, free[k]), features)) + sign * sp.Float(push[k])  # noqa: E731
            return {name: {x: row(k, sign) for k, x in enumerate(NAMES)} for name, sign in (("above", -1), ("below", 1))}

        def guards(self, t, y):
            surface = sp.Float(h[0]) * y.x + sp.Float(h[1]) * y.y + sp.Float(h[2])
            return {
                "stick": SlidingSurface("above", "below", surface, letters={"stick": "K", "above": "a", "below": "b"}),
                "O": Guard(("above", "below", "stick"), -sp.sin(t)),
            }

        def section(self, t, y):
            return PoincareSection("O", NAMES)

    fields = []
    for sign in (-1, 1):
        field = np.zeros((5, 5))
        field[:2] = free
        field[:2, 2] += sign * push
        field[3, 4], field[4, 3] = -1, 1
        fields.append(field)
    above, below = fields
    jump = above - below
    slide = below - np.outer(jump[:, 2], h @ below) / (h @ jump[:, 2])
    return Random(), {"above": above, "below": below, "stick": slide}, h


def exits(flows, h, mode):
    """Rows that fall through zero at the ends of a mode."""
    return {"above": [h], "below": [-h], "stick": [-h @ flows["above"], h @ flows["below"]]}[mode]


def following(flows, h, mode, k, z):
    """The mode after an event, and its letter."""
    if mode == "stick":
        return ("above", "a") if k == 0 else ("below", "b")
    other, presses = ("below", h @ flows["below"] @ z > 0) if mode == "above" else ("above", h @ flows["above"] @ z < 0)
    return ("stick", "K") if presses else (other, other[0])


def march(flows, h, row):
    """Word and states after one period."""
    z, t, word = np.array([*row, 1.0, 1.0, 0.0]), 0.0, "O"
    mode, step = "above" if h @ z > 0 else "below", 2 * np.pi / STEPS
    while t < 2 * np.pi * (1 - 1e-12):
        dt = min(step, 2 * np.pi - t)
        found = []
        for k, row_of_exit in enumerate(exits(flows, h, mode)):
            value = lambda s, r=row_of_exit: r @ expm(flows[mode] * s) @ z  # noqa: B023, E731
            if value(dt) < 0 and value(1e-9) > 0:
                found.append((brentq(value, 1e-9, dt, xtol=1e-15), k))
        s, k = min(found, default=(dt, -1))
        z, t = expm(flows[mode] * s) @ z, t + s
        if k >= 0:
            mode, letter = following(flows, h, mode, k, z)
            word += letter
    return word + "O", z[:2]


@pytest.mark.parametrize("seed", range(4))
def test_random_systems_slide_as_a_march_has_them(seed):
    rng = np.random.default_rng(seed)
    system, flows, h = random_system(rng)
    rows = rng.uniform(-1, 1, (24, 2))
    returns, parallel, near = system.first_return(rows, derivative=True), system.first_return(rows), system.itineraries(rows)
    assert returns.outcome.tolist() == [Outcome.returned] * len(rows)
    assert returns.words.tolist() == parallel.words.tolist()
    assert returns.image == pytest.approx(parallel.image, rel=1e-12, abs=1e-12)
    sure = np.flatnonzero((near.clearance > CLEAR) & (near.slowest > FAST))
    assert len(sure) > 4
    for k in sure[:4]:
        word, states = march(flows, h, rows[k])
        assert str(returns.words[k]) == word
        assert returns.image[k] == pytest.approx(states, abs=1e-11)
