"""The same system in other units of time and length has the same words, attractors, basins, events, exponents and domains."""

from functools import cache
from math import pi

import numpy as np
import pytest
from units import UNITS, Ball, Capsule, Oscillator, Units

import nsmaps
from nsmaps.dynamics.attractors.limit_set import limit_set
from nsmaps.exact.surfaces.slice import slice_along

SYSTEMS = {
    "ball": (Ball(g=1, a=1.1, w=1, r=0.6), 6.0),
    "capsule": (Capsule(d=0.35, g=0.2113, f=1, w=pi, r=0.5), 1.0),
    "oscillator": (Oscillator(zeta=0.1, k=1, w=2.1, a=1.5, wall=0.2, r=0.8), 2.0),
}
FEW = [UNITS[k] for k in (0, 2, 7, 8)]  #: where what is looked at takes long

every = pytest.mark.parametrize("name", SYSTEMS)
units = pytest.mark.parametrize("unit", UNITS, ids=str)
few = pytest.mark.parametrize("unit", FEW, ids=str)


def start(name: str, count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform([0, 0], [SYSTEMS[name][1], 2 * pi], (count, 2))


@every
@units
def test_words_outcomes_and_images(name, unit):
    """Of slow starts too, which chatter: it is summed up at the same returns."""
    plain, there = SYSTEMS[name][0], Units(*unit)
    states = start(name, 300)
    states[:100, 0] *= np.geomspace(1e-12, 1, 100)
    one, other = nsmaps.orbit(plain, states, 40), nsmaps.orbit(there.of(plain), there.states(states), 40)
    assert np.array_equal(one.words, other.words)
    assert np.array_equal(one.outcome, other.outcome)
    assert np.allclose(other.states[:3] / there.states([1, 1]), one.states[:3], rtol=0, atol=1e-11, equal_nan=True)


@every
@few
def test_attractors_and_basins(name, unit):
    plain, there = SYSTEMS[name][0], Units(*unit)
    states = start(name, 60)
    one, other = (nsmaps.basins(each.of(plain), each.states(states), max_period=64) for each in (Units(1, 1), there))
    assert np.array_equal(one.label, other.label)
    assert [each.label for each in one.attractors] == [each.label for each in other.attractors]
    for a, b in zip(one.attractors, other.attractors, strict=True):
        assert a.period == b.period > 0
        assert np.allclose(b.states[:, 0] / there.states([1, 1])[0], a.states[:, 0], atol=1e-5)
    assert np.array_equal(one.arrival, other.arrival)


SWEEPS = {"ball": ("a", 0.9, 1.4), "capsule": ("d", 0.26, 0.35), "oscillator": ("a", 1.0, 1.6)}


@every
@few
def test_motions_over_a_parameter(name, unit):
    (plain, _), there, (key, low, high) = SYSTEMS[name], Units(*unit), SWEEPS[name]
    values = np.linspace(low, high, 10)
    scaled = [there.parameter(plain, key, value) for value in values]
    one = nsmaps.bifurcation_diagram(lambda value: plain.at(**{key: value}), "value", values, start(name, 1), transient=1500)
    system, begun = there.of(plain), there.states(start(name, 1))
    other = nsmaps.bifurcation_diagram(lambda value: system.at(**{key: value}), "value", scaled, begun, transient=1500)
    assert np.array_equal(one.period, other.period)
    assert (one.period > 0).any()
    assert np.array_equal(one.labels, other.labels)


@few
def test_what_an_orbit_ends_on(unit):
    plain, there = SYSTEMS["capsule"][0], Units(*unit)
    for returns in (25, 100):  # nearly there, and there
        one = limit_set(plain, nsmaps.orbit(plain, [0.8, 0.4], returns))
        other = limit_set(there.of(plain), nsmaps.orbit(there.of(plain), there.states([0.8, 0.4]), returns))
        assert (one.period, one.words, one.more) == (other.period, other.words, other.more)
        assert np.allclose(one.multipliers, other.multipliers, atol=1e-9)


@cache
def branch(units):
    """The branch of a motion of the capsule in some units, and what is 1 of its lengths."""
    plain = SYSTEMS["capsule"][0]
    system, ends = units.of(plain), [units.parameter(plain, "d", d) for d in (0.2, 0.4)]
    orbit = nsmaps.periodic_orbit(system, units.states([0.8, 0.4]))
    assert orbit.converged
    found = nsmaps.continue_branch(system, "d", orbit, system.d, tuple(ends), direction="down")
    return found, units.parameter(plain, "d", 1)


@few
def test_branches_and_their_events(unit):
    (one, _), (other, size) = branch(Units(1, 1)), branch(Units(*unit))
    assert [event.kind for event in one.events] == [event.kind for event in other.events]
    assert one.of_kind("period doubling")
    assert other.ended.split(" at ")[0] == one.ended.split(" at ")[0]
    for a, b in zip(one.events, other.events, strict=True):
        assert abs(b.value / size - a.value) < 1e-8
    assert abs(len(one.orbits) - len(other.orbits)) <= 1
    assert np.allclose(other.arclength[-1], one.arclength[-1], rtol=1e-3)


@cache
def doublings(units):
    """The values of the first two doublings of the capsule, found in some units."""
    plain, values = SYSTEMS["capsule"][0], []
    system, ends = units.of(plain), [units.parameter(plain, "d", d) for d in (0.26, 0.4)]
    orbit = nsmaps.periodic_orbit(system, units.states([0.8, 0.4]))
    for branch in nsmaps.period_doubling_cascade(system, "d", orbit, system.d, tuple(ends), direction="down", n_doublings=2):
        event = branch.of_kind("period doubling")[0]
        there = nsmaps.periodic_orbit(system.at(d=event.value), event.orbit.states, branch.period)
        assert abs(there.multipliers[0] + 1) < 1e-7
        values.append(event.value / units.parameter(plain, "d", 1))
    return values


@few
def test_doublings(unit):
    assert np.allclose(doublings(Units(*unit)), doublings(Units(1, 1)), rtol=1e-9)


@every
@few
def test_exponents(name, unit):
    plain, there, begun = SYSTEMS[name][0], Units(*unit), start(name, 1)[0]
    one = nsmaps.lyapunov(plain, starts=begun, n_returns=3000, transient=500)
    other = nsmaps.lyapunov(there.of(plain), starts=there.states(begun), n_returns=3000, transient=500)
    assert np.allclose(one.exponents, other.exponents, rtol=1e-6, atol=5e-3)


@few
def test_attracting_domains(unit):
    plain, there = SYSTEMS["capsule"][0], Units(*unit)
    box = np.array([[0.8284, 0.8384], [0.3537, 0.3735]])
    one = nsmaps.attracting_domain(plain, box, max_updates=2, n_samples=51, bounds_kind="sampled")
    other = nsmaps.attracting_domain(there.of(plain), there.states(box.T).T, max_updates=2, n_samples=51, bounds_kind="sampled")
    assert one.forward_invariant == other.forward_invariant
    assert one.forward_invariant, one.reason
    assert np.allclose(other.boxes / there.states([1, 1])[:, None], one.boxes, atol=1e-9)
    for a, b in zip(one.cycles, other.cycles, strict=True):
        assert a.agree == b.agree
        assert a.places == b.places
        assert abs(a.slope - b.slope) < 1e-3


@cache
def curves(units):
    """The grazing curves of the capsule in some units."""
    box = {"v": units.states([[0.1, 0], [1, 0]])[:, 0].tolist(), "phi": (0, 2 * pi)}
    found = units.of(SYSTEMS["capsule"][0]).grazing_curves(box, n_lines=100)
    return sorted((c.wall, c.word, c.closed, c.jumps, c.words, float(c.length[-1])) for c in found)


@few
def test_grazing_curves_and_jumps(unit):
    plain, there = SYSTEMS["capsule"][0], Units(*unit)
    one, other = curves(Units(1, 1)), curves(there)
    assert one
    assert [each[:-1] for each in one] == [each[:-1] for each in other]
    # the curvature grows without bound towards the end of one curve: steps that fail by rounding would end it early
    assert [each[-1] for each in one] == pytest.approx([each[-1] for each in other], rel=1e-6)
    axis = nsmaps.Axis(low=0, high=6.2, points=40)
    cut = [slice_along(each.of(plain), "phi", axis, {"v": each.states([0.5, 0])[0]}) for each in (Units(1, 1), there)]
    assert np.array_equal(cut[0].jump, cut[1].jump)
    assert cut[0].jump.any()


@few
def test_images_of_boxes(unit):
    plain, there = SYSTEMS["capsule"][0], Units(*unit)
    boxes = np.array([[[0.7, 0.72], [0.2, 0.22]], [[0.3, 0.31], [1.0, 1.2]], [[0, 1e-3], [1, 2]]])
    scaled = np.swapaxes(there.states(np.swapaxes(boxes, 1, 2)), 1, 2)
    one, other = plain.image_boxes(boxes), there.of(plain).image_boxes(scaled)
    assert np.array_equal(one.words, other.words)
    assert np.array_equal(one.bounded, other.bounded)
    assert np.allclose(other.images / there.states([1, 1])[:, None], one.images, rtol=1e-6)
