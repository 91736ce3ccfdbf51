"""Random systems with modes against an independent march in 30 digits: matrix exponentials, and events by signs and bisection."""

from types import SimpleNamespace

import mpmath as mp
import numpy as np
import sympy as sp
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from nsmaps import Guard, HybridSystem, Outcome, PoincareSection

STEP, HORIZON, BITS = 0.02, 12.0, 90  # of the march, its longest time, bisections of a step
COUNT, MARCHED = 18, 4  # starts, which are computed in parallel, and how many of them are marched
BESIDE, ROUNDED = 1e-9, 1e-13  # distance of starts by which the bend of a map is measured, and by how much rounding moves a start
CLEAR, FAST = 0.02, 0.05  # margins of returns that the march, which looks at signs alone, cannot miss


def random_system(n, m, rng):
    """A system of n states and m modes with rates of order one, walls x0 = 1 and x0 = -1, and its numbers."""
    names = tuple(f"x{k}" for k in range(n))
    rates = np.round(rng.uniform(-1, 1, (m, n, n + 2)), 3)
    rates[:, 0, n] += np.where(np.arange(m) % 2 == 0, 0.3, -0.3)
    jumps = np.round(rng.uniform(-0.9, 0.9, (2, n)), 3)
    jumps[0, 0], jumps[1, 0] = 0.7, -0.7

    class Random(HybridSystem):
        """A random system."""

        unit: float = 1.0

        states = names
        horizon = HORIZON / 6.283185307179586

        def period(self):
            return 2 * sp.pi

        def modes(self, t, y):
            features = [*(getattr(y, name) for name in names), self.unit, sp.cos(t)]
            row = lambda row: sum(sp.Float(float(a)) * f for a, f in zip(row, features, strict=True))  # noqa: E731
            return {f"m{k}": dict(zip(names, map(row, rows), strict=True)) for k, rows in enumerate(rates)}

        def guards(self, t, y):
            found = {}
            for k in range(m):
                for name, sign, jump in (("U", 1, jumps[0]), ("L", -1, jumps[1])):
                    after = {x: sp.Float(float(a)) for x, a in zip(names, jump, strict=True)}
                    found[f"{name}{k}"] = Guard(f"m{k}", 1 - sign * y.x0, to=f"m{(k + 1) % m}", reset=after)
            return found

        def section(self, t, y):
            return PoincareSection("U0", (*names[1:], "phi"))

    return Random(), SimpleNamespace(n=n, m=m, rates=rates, jumps=jumps)


def matrix(given, mode):
    """The rates of (states, 1, cos t, sin t) in these."""
    n = given.n
    full = mp.zeros(n + 3, n + 3)
    for i in range(n):
        for j in range(n + 2):
            full[i, j] = mp.mpf(float(given.rates[mode, i, j]))
    full[n + 1, n + 2], full[n + 2, n + 1] = -1, 1
    return full


def series(full, z):
    """The coefficients of the powers of s in exp(full s) z, the highest first, shape (60, n + 3)."""
    terms = [z]
    for k in range(1, 60):
        terms.append(full * terms[-1] / k)
    return [*reversed(terms)]


def march(given, mode, z, steps):
    """The word and the features of a first return, and its time, from just after the event of a start; None if there is none."""
    t, word = mp.mpf(0), ""
    while t < HORIZON:
        new = steps[mode] * z
        if abs(new[0]) < 1:
            z, t = new, t + STEP
            continue
        columns, low, high = [*zip(*series(matrix(given, mode), z), strict=True)], mp.mpf(0), mp.mpf(STEP)
        for _ in range(BITS):
            middle = (low + high) / 2
            low, high = (middle, high) if abs(mp.polyval(columns[0], middle)) < 1 else (low, middle)
        z, t = mp.matrix([mp.polyval(column, high) for column in columns]), t + high
        up = z[0] > 0
        word += "U" if up else "L"
        if up and mode == 0:
            return word, z, t
        z, mode = after(given, z, up), (mode + 1) % given.m
    return None


def after(given, z, up):
    """The features just after an event."""
    z = z.copy()
    for i in range(given.n):
        z[i] = mp.mpf(float(given.jumps[0 if up else 1, i]))
    return z


@example(3, 3, 186)  # 0.005 past a graze: in 40 digits the derivative 540.09 of a start changes by 2.1e6 a radian
@settings(max_examples=4, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(1, 4), st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_random_systems_return_as_a_march_in_many_digits_has_them(n, m, seed):
    rng = np.random.default_rng(seed)
    system, given = random_system(n, m, rng)
    rows = np.column_stack([rng.uniform(-1, 1, (COUNT, n - 1)), rng.uniform(0, 6.28, COUNT)])
    returns = system.first_return(rows, derivative=True)
    alone = [system.first_return(row[None], derivative=True) for row in rows]
    assert returns.outcome.tolist() == [int(each.outcome[0]) for each in alone]
    assert returns.words.tolist() == [each.words[0] for each in alone]
    for slopes, each, bend in zip(returns.derivative, alone, bends(system, rows, returns), strict=True):
        allowed = ROUNDED * ((1 + np.nansum(np.abs(slopes))) ** 2 + bend)
        assert np.allclose(slopes, each.derivative[0], rtol=0, atol=allowed, equal_nan=True)
    allowed = {Outcome.returned, Outcome.escaped, Outcome.undecided, Outcome.invalid, Outcome.simultaneous, Outcome.endless}
    assert {Outcome(x) for x in returns.outcome} <= allowed
    with mp.workdps(30):
        steps = [mp.expm(matrix(given, mode) * mp.mpf(STEP)) for mode in range(m)]
        short = np.flatnonzero(returns.valid & (returns.time < HORIZON - 1))
        near = system.itineraries(rows[short])
        for k in short[(near.clearance > CLEAR) & (near.slowest > FAST)][:MARCHED]:
            marched = judged(given, rows[k], steps)
            assert marched is not None
            word, states, phase, time = marched
            assert str(returns.words[k])[1:] == word
            size = 1 + np.abs(returns.derivative[k]).sum()
            assert abs(returns.time[k] - time) < 1e-13 * size
            assert np.abs(system.coordinates.difference(returns.image[k], [*states, phase])).max() < 1e-13 * size


def bends(system, rows, returns):
    """How fast the derivatives change with the starts, per unit, shape (N,): two orbits that rounding parts differ by as much."""
    beside = system.first_return(rows + BESIDE, derivative=True)
    moved = np.nan_to_num(np.abs(beside.derivative - returns.derivative)).max(axis=(1, 2)) / BESIDE
    return np.where(beside.words == returns.words, moved, 0.0)


def judged(given, row, steps):
    """Word, coordinates and time of a first return by the march."""
    t = mp.mpf(float(row[-1]))
    z = mp.matrix([1, *map(mp.mpf, row[:-1].tolist()), 1, mp.cos(t), mp.sin(t)])
    found = march(given, 1 % given.m, after(given, z, True), steps)
    if found is None:
        return None
    word, z, time = found
    return word, [float(z[i]) for i in range(1, given.n)], float((t + time) % (2 * mp.pi)), float(time)
