"""Derivatives against differences in 50 digits, evaluations per flight, and memory of large batches."""

import subprocess
import sys
import tracemalloc

import mpmath as mp
import numpy as np
import pytest

from nsmaps.exact.surfaces.surface import Axis, Grid


def precise_return(system, word, times, v, phi):
    """The return of one state in 50 digits, each impact found next to the time that the kernel gave it."""
    d, r, g = (mp.mpf(x) for x in (system.d, system.r, system.g_bar))
    place = {"B": d / 2, "T": -d / 2}
    for start, end, time in zip(word, word[1:], times, strict=False):
        w = -r * v if start == "B" else r * v

        def gap(s, w=w, phi=phi, start=start, end=end):
            bend = (mp.cos(mp.pi * s + phi) - mp.cos(phi)) / mp.pi**2
            return place[start] - place[end] + (w - mp.sin(phi) / mp.pi) * s + g * s**2 / 2 - bend

        s = mp.findroot(gap, mp.mpf(float(time)), tol=mp.mpf(10) ** -90, verify=False)
        velocity = w + g * s + (mp.sin(mp.pi * s + phi) - mp.sin(phi)) / mp.pi
        v, phi = abs(velocity), phi + mp.pi * s
    return v, phi


@pytest.mark.parametrize("d", [0.35, 0.26])
def test_derivatives_against_50_digit_differences(pair, d):
    """Below 1e-9, relative to the largest entry, on ordinary states; entrywise below 1e-8."""
    system = pair(d)
    rng = np.random.default_rng(11)
    states = np.column_stack([rng.uniform(0.1, 1.1, 25), rng.uniform(0, 2 * np.pi, 25)])
    returns = system.first_return(states, derivative=True)
    checked = 0
    with mp.workdps(50):
        h = mp.mpf(10) ** -18
        for state, word, derivative in zip(states, returns.words, returns.derivative, strict=True):
            if np.abs(derivative).max() > 50:  # next to a graze
                continue
            times = np.diff(system.impacts(state, len(word)).time)
            columns = []
            for k in range(2):
                ends = []
                for sign in (1, -1):
                    moved = [mp.mpf(float(x)) for x in state]
                    moved[k] += sign * h
                    ends.append(precise_return(system, word, times, *moved))
                columns.append([float((a - b) / (2 * h)) for a, b in zip(*ends, strict=True)])
            exact = np.array(columns).T
            assert np.abs(derivative - exact).max() < 1e-9 * np.abs(exact).max()
            assert derivative == pytest.approx(exact, rel=1e-8, abs=1e-10)
            checked += 1
    assert checked > 15


def test_the_determinant_over_a_cycle(pair):
    """r^(2 x impacts) over the two-cycle of d = 0.30, four impacts: to 1e-10."""
    system = pair(0.30)
    state = np.array([[0.81, 0.41]])
    for _ in range(1000):
        state = system.first_return(state).image
    product = np.eye(2)
    for _ in range(2):
        returns = system.first_return(state, derivative=True)
        product, state = returns.derivative[0] @ product, returns.image
    assert np.linalg.det(product) == pytest.approx(0.5**8, rel=1e-10)


def test_evaluations_per_flight():
    """At most 25 for every system, counted in the uncompiled engine; 3 on average for the vibro-impact pair."""
    code = """
import sys; sys.path[:0] = sys.argv[1:]
import numpy as np
from conftest import vi_pair
from systems import BouncingBall, Oscillator
from nsmaps.exact.engine import march, returns
from nsmaps.exact.engine.flight import flow
for system, top in ((vi_pair(0.3), 1.2), (BouncingBall(a=1.3), 3.0), (Oscillator(zeta=0.05, w=0.81, gap=0.7), 2.0)):
    count, per_flight = [0], []
    evaluate, flight = flow.evaluate, march.first_impact
    def counted(p, s):
        count[0] += 1
        return evaluate(p, s)
    def watched(*args):
        before = count[0]
        found = flight(*args)
        per_flight.append(count[0] - before)
        return found
    march.evaluate, returns.first_impact = counted, watched
    rng = np.random.default_rng(0)
    for state in np.column_stack([rng.uniform(0.01, top, 300), rng.uniform(0, 6.28, 300)]):
        system.first_return([state])
    march.evaluate, returns.first_impact = evaluate, flight
    print(max(per_flight), sum(per_flight) / len(per_flight))
"""
    import os

    run = subprocess.run(
        [sys.executable, "-c", code, *sys.path], env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    rows = [tuple(map(float, line.split())) for line in run.stdout.splitlines()]
    assert len(rows) == 3
    assert max(most for most, _ in rows) <= 25


def test_a_million_returns_need_little_memory(pair):
    """At most 100 bytes each, the result included, beyond the states given."""
    system = pair(0.35)
    n = 1_000_000
    rng = np.random.default_rng(0)
    states = np.column_stack([rng.uniform(0, 1.5, n), rng.uniform(0, 2 * np.pi, n)])
    system.first_return(states[:10])
    tracemalloc.start()
    system.first_return(states)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100 * n


def test_a_large_grid_runs_in_chunks(pair):
    system = pair(0.35)
    grid = Grid(axes={"v": Axis(low=0.01, high=1, points=700), "phi": Axis(low=0, high=3, points=500)})
    tracemalloc.start()
    codes = [system.first_return(grid.states(k, k + 50_000)).codes for k in range(0, grid.size, 50_000)]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 150 * 50_000 + 8 * grid.size
    assert np.array_equal(np.concatenate(codes), system.first_return(grid.states()).codes)
