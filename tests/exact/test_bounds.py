"""Bounds on the rates of flights hold for as long as they say, and are not much larger than what they bound."""

from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp
from digits import in_balls, number
from flint import ctx
from numba import njit
from systems import BouncingBall, Dragged, Oscillator, Saddle, Table, Textbook

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.flight import bounds, flow

SYSTEMS = {
    "ball": BouncingBall(a=1.3),
    "parabolas": Table(height=0.6),
    "underdamped": Oscillator(zeta=0.05, w=0.81, gap=0.7),
    "critical": Oscillator(zeta=1.0, w=1.7, gap=0.1, damping="critical"),
    "nearly critical": Oscillator(zeta=1 - 1e-9, w=1.7, gap=0.1),
    "textbook": Textbook(zeta=3.0),
    "nearly critical from above": Textbook(zeta=1 + 1e-9),
    "resonance": Textbook(zeta=0.0, w=1 + 1e-6, by="cos"),
    "drag": Dragged(c=30.0, a=60.0),
    "saddle": Saddle(k=6.0),
}


@njit
def limits(p, phi, z, w, s):
    flow.begin(p, flow.angle(phi), z, w)
    return bounds.limits(p, s)


@pytest.mark.parametrize("kind", SYSTEMS)
def test_bounds_hold_for_as_long_as_they_say(kind):
    system = SYSTEMS[kind]
    t, t0, z0, w0 = sp.symbols("t t0 z0 w0", real=True)
    exact = type(system).model_construct(
        **{k: sp.Rational(v) if isinstance(v, float) else v for k, v in system.model_dump().items()}
    )
    given = exact.displacement(t, SimpleNamespace(t=t0, z=z0, w=w0))
    place = in_balls((t, t0, z0, w0), given)
    rates = in_balls((t, t0, z0, w0), [sp.diff(given, t, n) for n in (2, 3, 4, 5, 6)])
    kernel, rng, slack = system._kernel(), np.random.default_rng(2), []
    for trial in range(12):
        phi, z, w = rng.uniform(0, TWO_PI), kernel.places[rng.integers(2)], rng.normal()
        s = 0.0 if trial % 2 else rng.uniform(0, 3 * float(system.period()))
        jerk, snap, crackle, pop, reach, acceleration, size = limits(kernel.flow, phi, z, w, s)
        times = phi / system.phase_rate() + s + np.linspace(0, min(reach, 10.0), 101)
        start = [number(x) for x in (phi / system.phase_rate(), z, w)]
        with ctx.workdps(40):
            seen = [[float(abs(number(0) + rate).upper()) for rate in rates(number(x), *start)] for x in times]
        for largest, bound in zip(np.max(seen, axis=0), (acceleration, jerk, snap, crackle, pop), strict=True):
            assert largest <= bound * (1 + 1e-9) + 1e-9
            slack += [bound / largest] if s == 0 and largest > 1e-3 else []
        with ctx.workdps(40):
            assert abs(float(place(number(times[0]), *start)) - z) <= size * (1 + 1e-9) + 1e-12
    assert np.median(slack) < 30 if slack else kind == "parabolas"
