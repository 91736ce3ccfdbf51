"""Flights in balls hold the exact motion of states and times within them, in 60 digits."""

from functools import cache
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from systems import DraggedBall, Oscillator, Textbook

from nsmaps.exact.compiling.compiled import njit
from nsmaps.exact.enclosure.arithmetic import elementary
from nsmaps.exact.enclosure.arithmetic.balls import Ball
from nsmaps.exact.enclosure.flight import flow
from nsmaps.exact.enclosure.impacts import ball_flow, enclosed_table

SYSTEMS = {
    "dragged": DraggedBall(a=3.0, r=0.8),
    "critical": Oscillator(zeta=1.0, w=1.7, gap=0.1, damping="critical"),
    "overdamped": Textbook(zeta=3.0),
}


@njit(part=False)
def motions(p, phi, z, w, s):
    """Displacement and its rates, and derivatives of the first of these by phase, velocity and phase twice."""
    flow.ball_begin(p, p.one, elementary.bangle(phi), z, w)
    flow.at_time(p, s)
    return flow.ball_motion(p, p.one, w, 3), flow.ball_tangent(p, p.one, 2), flow.ball_bends(p, p.one)


@cache
def exact_motions(system):
    """What `motions` encloses, as functions of phase, place and velocity of the start and of time, in as many digits as asked."""
    phi, z, w, s = symbols = sp.symbols("phi z w s", real=True)
    fields = {name: sp.Rational(value) if isinstance(value, float) else value for name, value in system.model_dump().items()}
    exact = type(system).model_construct(**fields)
    begin = phi * exact.period() / (2 * sp.pi)
    d = exact.displacement(begin + s, SimpleNamespace(t=begin, z=z, w=w)) - z
    rates = [sp.diff(d, s, n) for n in range(4)]
    tangents = [sp.diff(rates[n], x) for n in range(3) for x in (phi, w)]
    return sp.lambdify(symbols, [*rates, *tangents, *(sp.diff(rate, phi, 2) for rate in rates[:2])], "mpmath", cse=True)


@pytest.mark.parametrize("kind", ["pair", *SYSTEMS])
@pytest.mark.parametrize("radius", [0.0, 1e-6, 1e-2])
def test_flights_in_balls_hold_exact_ones(kind, radius, pair):
    system = pair(0.35) if kind == "pair" else SYSTEMS[kind]
    p, exact, rng = ball_flow(enclosed_table(system)), exact_motions(system), np.random.default_rng(1)
    widths = []
    for _ in range(20):
        centre = rng.uniform(0, 2 * np.pi), float(rng.choice(system._kernel().places)), rng.normal(), rng.uniform(0, 5)
        radii = radius * rng.random(4) * [1, 0, 1, 1]
        found = [ball for balls in motions(p, *map(Ball, centre, radii)) for ball in balls]
        with mp.workdps(60):
            place = [mp.mpf(x) + mp.mpf(r) * mp.mpf(t) for x, r, t in zip(centre, radii, rng.uniform(-1, 1, 4), strict=True)]
            values = [mp.re(value) for value in exact(*place)]
            assert all(abs(value - mp.mpf(c)) <= mp.mpf(r) for (c, r), value in zip(found, values, strict=True))
        widths += [r / (1 + abs(c)) for c, r in found]
    assert max(widths) < (1e-11 if radius == 0 else 1e4 * radius)  # and say something
