"""The map of strips against the exact map, its edges against grazes found in 40 digits."""

import re

import mpmath
import numpy as np
import pytest
from messages import message
from systems import BouncingBall, Oscillator

from nsmaps import orbit
from nsmaps.errors import NsmapsError
from nsmaps.exact import ReturnMap
from nsmaps.exact.outcome import Outcome
from nsmaps.reduced.adaptive import surrogate
from nsmaps.reduced.adaptive.scanlines import lines
from nsmaps.reduced.adaptive.surrogate import strip_map
from nsmaps.reduced.adaptive.validate import held_out

PAPER = (0.01, 1.0), (0.0, np.pi)
WIDE = (0.001, 1.07), (0.0, 2 * np.pi)


@pytest.fixture(scope="module", autouse=True)
def edges_found_once():
    """The bands between edges do not depend on the tolerance; those of a system in a box are found once."""
    found, search = {}, surrogate.slabs

    def slabs(system, speeds, phases, work):
        key = repr(system), speeds, phases
        bands, complete = found[key] = found.get(key) or search(system, speeds, phases, work)
        return list(bands), complete

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surrogate, "slabs", slabs)
        yield


@pytest.fixture(scope="module")
def wide(pair):
    """The map at d = 0.30 over every phase."""
    return strip_map(pair(0.30), WIDE, 1e-6)


@pytest.mark.parametrize("d", [0.35, 0.30, pytest.param(0.26, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_tolerance_is_kept_everywhere(pair, d, tolerance):
    made = strip_map(pair(d), PAPER, tolerance)
    uniform, beside = held_out(made, 200_000)
    assert uniform.over == beside.over == 0, (uniform, beside)
    assert uniform.wrong_words == beside.wrong_words == 0
    assert uniform.largest > 1e-3 * tolerance  # the figures are errors, not zeros
    assert made.strips.report.exact_share < 1e-4
    assert uniform.by_exact_map < 1e-4 * uniform.points


@pytest.mark.thorough
@pytest.mark.parametrize("d", [0.35, 0.26])
def test_tolerance_is_kept_on_the_circle(pair, d):
    made = strip_map(pair(d), WIDE, 1e-8)
    uniform, beside = held_out(made, 200_000)
    assert uniform.over == 0
    assert uniform.wrong_words == beside.wrong_words == 0
    assert beside.largest < 4e-8  # within 3e-11 of an edge rounding is magnified to about the tolerance
    assert beside.over <= 1e-4 * beside.points
    assert made.strips.report.exact_share < 5e-4


@pytest.mark.parametrize("v", [0.05, 0.3, 0.6, 0.9])
def test_edges_are_grazes(pair, v):
    """Grazes of either wall on the first flight, to 40 digits, are among the edges found."""
    system = pair(0.30)
    found = lines(system, [v], 0.0, 2 * np.pi)[0]
    grazes = _first_flight_grazes(v, found.phi)
    assert grazes
    for graze in grazes:
        assert np.abs(found.phi - graze).min() < 2e-15 * max(1, abs(graze)) + 1e-15


def _first_flight_grazes(v, guesses):
    """Phases near the guesses at which the first flight touches a wall with speed zero."""
    with mpmath.workdps(40):
        d, r = mpmath.mpf("0.3"), mpmath.mpf("0.5")
        g = mpmath.mpf("0.1245") * mpmath.mpf("9.8") * mpmath.sin(mpmath.pi / 3) / 5
        found = []
        for guess in guesses:
            for gap in (0, d):  # the displacement falls from the base wall at 0 to the other at -d
                for s in (0.4, 0.8, 1.2, 1.6, 2.0, 2.4):
                    try:
                        phi, time = mpmath.findroot(
                            lambda p, t, gap=gap: (_displacement(v, r, g, p, t) + gap, _velocity(v, r, g, p, t)), (guess, s)
                        )
                    except (ValueError, ZeroDivisionError):
                        continue
                    if abs(phi - guess) < 1e-6 and time > 0.05:
                        found.append(float(phi))
        return sorted(set(found))


def _displacement(v, r, g, phi, t):
    pi = mpmath.pi
    return -r * v * t - (mpmath.cos(pi * t + phi) - mpmath.cos(phi)) / pi**2 - mpmath.sin(phi) * t / pi + g * t**2 / 2


def _velocity(v, r, g, phi, t):
    return -r * v + (mpmath.sin(mpmath.pi * t + phi) - mpmath.sin(phi)) / mpmath.pi + g * t


def test_it_is_a_return_map(wide):
    assert isinstance(wide, ReturnMap)
    states = np.array([[0.5, 1.0], [0.5, 1.0 + 4 * np.pi], [0.5, 1.0 - 2 * np.pi], [2.0, 1.0], [np.nan, 1.0], [-1.0, 0.0]])
    ours, exact = wide.first_return(states, derivative=True), wide.system.first_return(states)
    assert ours.outcome.tolist() == [*[Outcome.returned] * 3, Outcome.uncovered, Outcome.invalid, Outcome.uncovered]
    np.testing.assert_array_equal(ours.words[:3], exact.words[:3])
    np.testing.assert_allclose(ours.lifted[:3], exact.lifted[:3], atol=1e-6)
    np.testing.assert_allclose(ours.time[:3], exact.time[:3], atol=1e-6)
    assert np.isnan(ours.image[3:]).all()
    assert not ours.certified.any()


def test_turns_and_times_are_those_of_the_exact_map(wide):
    states = np.random.default_rng(3).uniform((0.001, -20), (1.07, 20), (20_000, 2))
    ours, exact = wide.first_return(states), wide.system.first_return(states)
    np.testing.assert_array_equal(ours.codes, exact.codes)
    np.testing.assert_allclose(ours.lifted, exact.lifted, atol=1e-6)
    np.testing.assert_allclose(ours.time, exact.time, atol=1e-6)


@pytest.mark.thorough
def test_the_circle_has_no_gap_where_it_is_cut(pair):
    """Floats next to the cut on any turn: rounding puts some of them below it, some above a turn from it."""
    made = strip_map(pair(0.30), WIDE, 1e-2)
    cut = made.strips.bounds[1, 0] + 2 * np.pi * np.arange(-60, 60)
    phases = (cut[:, None] + np.spacing(cut)[:, None] * np.arange(-4, 5)).ravel()
    states = np.column_stack([np.full(len(phases), 0.5), phases])
    own = made.first_return(states)
    assert (own.outcome == Outcome.returned).all()
    assert (made.orbits(states, 1).outcome == Outcome.returned).all()
    far = made.first_return([[0.5, 9.9e9], [0.5, 1.4e10]])
    assert far.outcome.tolist() == [Outcome.returned, Outcome.invalid]
    assert far.turns[0, 1] == round(9.9e9 / (2 * np.pi))
    apart = (own.image - pair(0.30).first_return(states).image)[:, 1]
    assert np.abs(apart - 2 * np.pi * np.round(apart / (2 * np.pi))).max() < 1e-2


def test_derivative_is_that_of_the_polynomials(pair):
    """Against the exact derivative, whose largest entries are beside edges, and against differences of the map itself."""
    made = strip_map(pair(0.30), PAPER, 1e-8)
    states = np.random.default_rng(4).uniform((0.02, 0.01), (0.99, 3.1), (20_000, 2))
    ours, exact = (m.first_return(states, derivative=True).derivative for m in (made, made.system))
    error = np.abs(ours - exact).max(axis=(1, 2)) / (1 + np.abs(exact).max(axis=(1, 2)))
    assert np.quantile(error, 0.99) < 1e-6
    h = 1e-6
    few = states[:2000]
    leaf = made.leaf_of(few)
    for k, step in enumerate(np.eye(2) * h):
        same = (made.leaf_of(few + step) == leaf) & (made.leaf_of(few - step) == leaf) & (leaf >= 0)
        difference = (made.first_return(few + step).lifted - made.first_return(few - step).lifted) / (2 * h)
        scale = 1 + np.abs(ours[:2000][same]).max(axis=(1, 2))
        assert np.quantile(np.abs(difference[same] - ours[:2000][same, :, k]).max(axis=1) / scale, 0.9) < 1e-7


def test_next_to_an_edge_the_exact_map_answers(wide):
    slab = max(wide.strips.slabs, key=lambda slab: slab.high - slab.low)
    s = np.linspace(-0.9, 0.9, 50)
    states = np.column_stack([slab.speeds(s), slab.phases(s)[1]])
    assert (wide.leaf_of(states) == -1).all()
    np.testing.assert_array_equal(wide.first_return(states).image, wide.system.first_return(states).image)


def test_an_orbit_is_a_chain_of_first_returns(wide):
    slab = max(wide.strips.slabs, key=lambda slab: slab.high - slab.low)
    edge = np.column_stack([slab.speeds(np.linspace(-0.9, 0.9, 20)), slab.phases(np.linspace(-0.9, 0.9, 20))[1]])
    inside = np.random.default_rng(7).uniform((0.001, -20), (1.07, 20), (60, 2))
    start = np.concatenate([edge, inside, [[2.0, 1.0], [np.nan, 1.0], [0.5, np.inf]]])
    made = orbit(wide, start, 40)
    ended = np.full(len(start), Outcome.invalid, np.int8)
    for k, now in enumerate(made.states[:-1]):
        asked = wide.first_return(now)
        ended = np.where(np.isnan(now).any(axis=1), ended, asked.outcome).astype(np.int8)
        np.testing.assert_array_equal(made.outcome[k], ended)
        np.testing.assert_allclose(made.states[k + 1], asked.image, rtol=0, atol=1e-13)
        np.testing.assert_array_equal(made.turns[k], asked.turns)
        np.testing.assert_array_equal(made.codes[k], asked.codes)
    np.testing.assert_array_equal(made.states[1, :20], wide.system.first_return(edge).image)
    times = wide.orbits(start, 2).time.reshape(2, -1)
    np.testing.assert_allclose(times[0], wide.first_return(start).time, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("system", "box"),
    [
        pytest.param(BouncingBall(a=1.2, r=0.6), ((0.05, 6.0), (0.0, 2 * np.pi)), marks=pytest.mark.thorough),
        (Oscillator(zeta=0.1, w=0.9, gap=0.5, r=0.8), ((0.5, 0.6), (1.0, 1.3))),
    ],
)
def test_other_systems(system, box):
    made = strip_map(system, box, 1e-4)
    uniform, beside = held_out(made, 50_000)
    assert uniform.over == beside.over == 0
    assert uniform.wrong_words == beside.wrong_words == 0
    assert made.strips.report.leaves > 0


def test_one_leaf_may_do(pair):
    made = strip_map(pair(0.30), ((0.75, 0.7501), (0.2, 0.2001)), 1e-6)
    assert made.strips.report.leaves == 1
    assert held_out(made, 1000)[0].over == 0


@pytest.mark.parametrize(
    ("speeds", "phases", "tolerance", "what"),
    [
        ((0.1, 1.0), (0.0, 1.0), 0.0, message("reduced.tolerance", tolerance=0.0)),
        ((0.1, 1.0), (0.0, 1.0), np.nan, message("errors.value", name="tolerance", value="nan")),
        ((0.1, 1.0), (0.0, 1.0), 1e-13, message("reduced.tolerance", tolerance=1e-13)),
        ((0.0, 1.0), (0.0, 1.0), 1e-3, message("reduced.speeds")),
        ((1.0, 0.1), (0.0, 1.0), 1e-3, message("coordinates.box-with-angles", box="v from 1.0 to 0.1")),
        ((0.1, np.inf), (0.0, 1.0), 1e-3, message("coordinates.box-with-angles", box="v from 0.1 to inf")),
        ((0.1, 1.0), (1.0, 1.0), 1e-3, message("coordinates.box-with-angles", box=re.compile("phi from .*"))),
        ((0.1, 1.0), (0.0, 7.0), 1e-3, message("coordinates.box-with-angles", box=re.compile("phi from .*"))),
    ],
)
def test_bad_boxes_are_refused(pair, speeds, phases, tolerance, what):
    with pytest.raises(NsmapsError, match=what):
        strip_map(pair(0.30), (speeds, phases), tolerance)
