"""Random systems between tilted, shaken walls against an independent march: starts behind walls, and derivatives through them."""

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import expm
from scipy.optimize import brentq

from nsmaps import Guard, HybridSystem, Outcome, PoincareSection

STEP, LONGEST = 2 * np.pi / 240, 9.0  # of the march
CLEAR, FAST = 0.01, 0.05  # margins of motions that the march, which looks at ends of steps, cannot miss
H = 1e-6  # of differences


def random_system(rng):
    """A system of some modes between two walls in each, and its numbers: flows of (states, 1, cos t, sin t), walls, resets."""
    n, m = int(rng.integers(2, 4)), int(rng.integers(1, 4))
    names = tuple(f"x{k}" for k in range(n))
    rates = np.round(rng.uniform(-1, 1, (m, n, n + 3)), 3)
    rates[:, 0, n] += np.where(np.arange(m) % 2 == 0, 0.3, -0.3)
    walls = np.zeros((m, 2, n + 3))
    walls[:, :, 0], walls[:, :, n] = [-1, 1], 1
    walls[:, :, 1:n] = np.round(rng.uniform(-0.3, 0.3, (m, 2, n - 1)), 3)
    walls[:, :, n + 1 :] = np.round(rng.uniform(-0.1, 0.1, (m, 2, 2)), 3)
    resets = np.round(rng.uniform(-0.5, 0.5, (m, 2, n, n + 3)), 3)

    class Random(HybridSystem):
        """A random system."""

        unit: float = 1.0

        states = names
        horizon = LONGEST / 6.283185307179586

        def period(self):
            return 2 * sp.pi

        def rows(self, t, y, rows):
            features = [*(getattr(y, name) for name in names), self.unit, sp.cos(t), sp.sin(t)]
            return [sum(sp.Float(a) * f for a, f in zip(row.tolist(), features, strict=True)) for row in rows]

        def modes(self, t, y):
            return {f"m{k}": dict(zip(names, self.rows(t, y, rates[k]), strict=True)) for k in range(m)}

        def guards(self, t, y):
            found = {}
            for k in range(m):
                for name, wall, reset in zip("UL", self.rows(t, y, walls[k]), resets[k], strict=True):
                    after = dict(zip(names, self.rows(t, y, reset), strict=True))
                    found[f"{name}{k}"] = Guard(f"m{k}", wall, to=f"m{(k + 1) % m}", reset=after)
            return found

        def section(self, t, y):
            return PoincareSection("U0", (*names[1:], "phi"))

    flows = np.zeros((m, n + 3, n + 3))
    flows[:, :n] = rates
    flows[:, n + 1, n + 2], flows[:, n + 2, n + 1] = -1, 1
    return Random(), (flows, walls, resets, [expm(flow * STEP) for flow in flows])


def features(given, row):
    """The features at the section: x0 from the zero of the wall U0."""
    wall = given[1][0, 0]
    z = np.array([0, *row[:-1], 1, np.cos(row[-1]), np.sin(row[-1])])
    z[0] = -wall @ z / wall[0]
    return z


def march(given, row):
    """Outcome, word, image and time of a first return, and whether the march cannot have missed anything."""
    flows, walls, resets, steps = given
    z, mode, t, word, sure = features(given, row), 0, 0.0, "U", True
    rate = walls[0, 0] @ flows[0] @ z
    if rate > 0:
        return Outcome.invalid, "", None, 0.0, rate > FAST
    side, sure = 0, -rate > FAST
    while True:
        z = np.append(resets[mode, side] @ z, z[-3:])
        mode = (mode + 1) % len(flows)
        gaps = walls[mode] @ z
        sure &= bool((abs(gaps) > CLEAR).all())
        if (gaps < 0).any():
            return Outcome.blocked, word, None, t, sure
        z, side, s, clear = flight(walls[mode], flows[mode], steps[mode], z)
        t, sure = t + s, sure and clear and abs(walls[mode, side] @ flows[mode] @ z) > FAST
        if t > LONGEST - 1:
            return Outcome.escaped, word, None, t, False
        word += "UL"[side]
        if side == mode == 0:
            n = len(z) - 3
            return Outcome.returned, word, np.append(z[1:n], (row[-1] + t) % (2 * np.pi)), t, sure


def flight(walls, flow, step, z):
    """The features at the next wall, which it is, the time until then, and whether no other contact is near."""
    seen = [z]
    for k in range(int(LONGEST / STEP)):
        new = step @ z
        seen.append(new)
        hit = np.flatnonzero(walls @ new < 0)
        if len(hit):
            ends = [brentq(lambda s, f=walls[i]: f @ expm(flow * s) @ z, 0, STEP, xtol=1e-15) for i in hit]  # noqa: B023
            s, side = min(zip(ends, hit.tolist(), strict=True))
            gaps = np.array(seen[:-1]) @ walls.T
            turns = (gaps[:-2] > gaps[1:-1]) & (gaps[1:-1] < gaps[2:])
            near = bool((turns & (gaps[1:-1] < CLEAR)).any())
            return expm(flow * s) @ z, side, k * STEP + s, not near and len(hit) == 1
        z = new
    return z, 0, LONGEST, False


@pytest.mark.parametrize("seed", range(4))
def test_random_systems_return_between_walls_or_are_blocked(seed):
    rng = np.random.default_rng(seed)
    system, given = random_system(rng)
    n = len(system.coordinates)
    rows = np.column_stack([rng.uniform(-1, 1, (24, n - 1)), rng.uniform(0, 6.28, 24)])
    returns, parallel = system.first_return(rows, derivative=True), system.first_return(rows)
    assert parallel.outcome.tolist() == returns.outcome.tolist()
    assert parallel.words.tolist() == returns.words.tolist()
    checked = 0
    for k, row in enumerate(rows):
        outcome, word, image, time, sure = march(given, row)
        if not sure:
            continue
        assert (returns.outcome[k], str(returns.words[k])) == (outcome, word if outcome != Outcome.invalid else "")
        if image is not None:
            size = 1 + np.abs(returns.derivative[k]).sum()
            assert abs(returns.time[k] - time) < 1e-13 * size
            assert np.abs(system.coordinates.difference(returns.image[k], image)).max() < 1e-12 * size
            checked += derivative_checked(system, given, row, returns.derivative[k]) if checked < 2 else 0


def derivative_checked(system, given, row, derivative):
    """Whether differences of the march could be compared with a derivative."""
    found = []
    for h in (H, H / 2):
        ends = [[march(given, row + sign * h * unit)[2] for sign in (1, -1)] for unit in np.eye(len(row))]
        if any(end is None for pair in ends for end in pair):
            return 0
        found.append(np.array([system.coordinates.difference(*pair) / (2 * h) for pair in ends]).T)
    rough = np.abs(found[0] - found[1]).max()
    assert np.abs(found[1] - derivative).max() < 10 * rough + 1e-7 * (1 + np.abs(derivative).max())
    return 1
