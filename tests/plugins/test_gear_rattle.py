"""Gear rattle against first returns of 40 digits (`make_gear_returns.py`), closed forms, and the studies that come with it."""

import json
from itertools import pairwise
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from nsmaps_gear_rattle import GearRattle
from scipy.integrate import solve_ivp

import nsmaps
from nsmaps.coordinates import TWO_PI
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.exact.outcome import Outcome
from nsmaps.testing import check_system

REFERENCES = json.loads((Path(__file__).parents[1] / "data" / "gear_rattle.json").read_text())
FORMS = {"delta": 0.6, "r": 0.9}
ROUNDING = 4e-15


def one_impact(n, delta, r):
    """Speed, eps of the onset and of the doubling of the orbit with one impact on D in n periods, if it does not meet C.

    The place after n periods gives the velocity after the impact, that before it gives v, and what is left eps sin phi; the
    determinant of the map is r^2 exp(-delta n), and its trace 1 + r^2 exp(-delta n) less a multiple of eps cos phi.
    """
    decay = np.exp(-delta * n)
    sine = 2 - 2 * n * delta * decay / (1 - decay) - 2 * n * delta / (1 + r)
    cosine = 2 * n * delta**2 * (1 + r**2 * decay) / (np.pi * (1 + r) ** 2 * (1 - decay))
    return 4 * np.pi * n * delta / (1 + r), abs(sine), np.hypot(sine, cosine)


@pytest.mark.parametrize("name", REFERENCES)
def test_first_returns_have_forty_digits_to_agree_with(name):
    rows, parameters = REFERENCES[name]["returns"], REFERENCES[name]["parameters"]
    returns = GearRattle(**parameters).first_return([row["start"] for row in rows])
    assert returns.words.tolist() == [row["word"] for row in rows]
    with mp.workdps(40):
        for row, image, time in zip(rows, returns.lifted, returns.time, strict=True):
            found = *image, time
            expected = [mp.mpf(x) for x in (*row["image"], row["time"])]
            for a, b in zip(found, expected, strict=True):
                assert abs(a - b) < ROUNDING * (1 + row["slope"]) * (1 + abs(b))


def test_edges_are_edges():
    """The states of a pair are within 1e-9 and their words differ."""
    pairs = 0
    for each in REFERENCES.values():
        edges = [row for row in each["returns"] if row["kind"] == "edge"]
        for a, b in list(pairwise(edges))[::2]:
            assert np.abs(np.subtract(a["start"], b["start"])).sum() < 1.1e-9
            assert a["word"] != b["word"]
            pairs += 1
    assert pairs == 6 * len(REFERENCES)


def test_a_flight_obeys_the_equation_by_an_integrator():
    gear = GearRattle(eps=1.0, **FORMS)
    v, phi = 9.0, 2.0
    t0 = phi / TWO_PI

    def motion(t, y):
        force = 4 * np.pi * 0.6 - 4 * np.pi**2 * np.cos(TWO_PI * t) - TWO_PI * 0.6 * np.sin(TWO_PI * t)
        return [y[1], force - 0.6 * y[1]]

    places, times = gear.trajectory([v, phi], 2)[::-1]
    flown = solve_ivp(motion, (t0, t0 + times[-1]), [1, -0.9 * v], method="DOP853", rtol=1e-12, atol=1e-12, t_eval=t0 + times)
    assert places == pytest.approx(flown.y[0], abs=1e-9)


@pytest.mark.parametrize(("n", "delta", "r"), [(1, 0.6, 0.9), (1, 0.8, 0.7), (2, 0.15, 0.6)])
def test_one_impact_in_n_periods(n, delta, r):
    """Its speed, the fold at which it begins, and its doubling."""
    speed, onset, doubling = one_impact(n, delta, r)
    eps = (onset + doubling) / 2
    sine = 2 - 2 * n * delta / np.expm1(delta * n) - 2 * n * delta / (1 + r)
    phase = np.arcsin(sine / eps) % TWO_PI
    start = nsmaps.periodic_orbit(GearRattle(delta=delta, eps=eps, r=r), [speed, phase])
    assert start.converged
    assert (start.label, start.words) == (f"1:0/{n}T" if n > 1 else "1:0/T", ("DD",))
    assert start.states[0] == pytest.approx([speed, phase], abs=1e-12)
    assert np.prod(start.multipliers).real == pytest.approx(r**2 * np.exp(-delta * n), rel=1e-10)
    bounds = 0.98 * onset, 1.02 * doubling
    events = []
    for direction in ("up", "down"):
        branch = continue_branch(lambda e: GearRattle(delta=delta, eps=e, r=r), "e", start, eps, bounds, direction=direction)
        events += [(event.kind, event.value) for event in branch.events]
    assert min(abs(at - doubling) for kind, at in events if kind == "period doubling") < 1e-8
    assert min(abs(at - onset) for kind, at in events if kind == "fold") < 1e-8


def test_silence_and_rattle():
    """Where the force never leaves D, a gear without speed stays there, and one with speed may rattle."""
    silent = 2 * 0.6 / np.hypot(TWO_PI, 0.6)
    below, above = (GearRattle(eps=eps, **FORMS) for eps in (silent * (1 - 1e-9), silent * (1 + 1e-9)))
    phases = np.column_stack([np.zeros(50), np.linspace(0, 6.28, 50)])
    assert set(below.first_return(phases).outcome.tolist()) == {Outcome.rests}
    assert Outcome.rests not in above.first_return(phases).outcome
    speed, onset, _ = one_impact(1, **FORMS)
    assert onset < 0.1 < silent
    assert np.isfinite(nsmaps.orbit(GearRattle(eps=0.1, **FORMS), [speed, 4.7], 1000).final).all()


def test_its_class_passes_the_conformance_test():
    def acceleration(t, place, velocity):
        drive = 4 * sp.pi**2 * sp.cos(2 * sp.pi * t) + 2 * sp.pi * FORMS["delta"] * sp.sin(2 * sp.pi * t)
        return 4 * sp.pi * FORMS["delta"] - drive - FORMS["delta"] * velocity

    check_system(GearRattle(eps=1.0, **FORMS), acceleration)


def test_three_motions_coexist():
    """The attractors that the study finds, each with multipliers in the unit circle whose product is that of the dissipation."""
    study = nsmaps.load_study("gear_rattle/basins")
    gear = nsmaps.load_system(study.system, **study.parameters)
    states = np.stack(np.meshgrid(np.linspace(0.5, 15, 12), np.linspace(0, 6, 12)), axis=-1).reshape(-1, 2)
    found = nsmaps.basins(gear, states).attractors
    assert {str(each.label) for each in found} == {"1:1/T", "2:1/T", "1:2/T"}
    for each in found:
        orbit = nsmaps.periodic_orbit(gear, each.states[0], period=len(each.states))
        impacts = sum(len(word) - 1 for word in orbit.words)
        assert np.prod(orbit.multipliers).real == pytest.approx(0.9 ** (2 * impacts) * np.exp(-0.6), rel=1e-9)
        assert (np.abs(orbit.multipliers) < 1).all()


@pytest.mark.thorough
def test_the_diagram_begins_and_doubles_where_the_closed_form_says():
    made = nsmaps.run_study("gear_rattle/diagram").bifurcation_diagram["exact"]
    _, onset, doubling = one_impact(1, **FORMS)
    labels = made.labels
    single, double = (made.values[(labels == label).any(axis=1)] for label in ("1:0/T", "1:0/2T"))
    step = made.values[1] - made.values[0]
    assert 0 <= single.min() - onset < step
    assert 0 <= doubling - single.max() < step
    assert 0 <= double.min() - doubling < step
