"""Lyapunov exponents against closed forms, multipliers, the conserved form of the pair, and plain NumPy."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
import sympy as sp
from messages import message

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection, SlidingSurface
from nsmaps.coordinates import Angle, Coordinates
from nsmaps.dynamics.exponents.frames import carried
from nsmaps.dynamics.exponents.growth import determinants
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

X, XY = Coordinates(["x"]), Coordinates(["x", "y"])


@dataclass(frozen=True)
class Logistic(ReturnMap):
    """x -> 4 x (1 - x), whose exponent is log 2, beside y -> y/3 + x; x beyond [0, 1] escapes."""

    coordinates: Coordinates = XY

    def first_return(self, states, derivative=False):
        x, y = np.asarray(states, float).T
        inside = (x >= 0) & (x <= 1)
        image = np.where(inside[:, None], np.column_stack([4 * x * (1 - x), y / 3 + x]), np.nan)
        slopes = np.zeros((len(x), 2, 2))
        slopes[:, 0, 0], slopes[:, 1, 0], slopes[:, 1, 1] = 4 - 8 * x, 1, 1 / 3
        outcome = np.select([np.isnan(x), ~inside], [Outcome.invalid, Outcome.escaped], Outcome.returned).astype(np.int8)
        turns, codes, time = np.zeros((len(x), 2), np.int32), np.ones(len(x), int), np.full(len(x), 0.5)
        return Returns(self.coordinates, ("B",), np.asarray(states), image, turns, codes, outcome, time, slopes)


@dataclass(frozen=True)
class Tent(ReturnMap):
    """Up to 1 over [0, a] and down again over [a, 1]."""

    a: float
    coordinates: Coordinates = X

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        up, blank = x < self.a, np.zeros(len(x), np.int8)
        image, slopes = np.where(up, x / self.a, (1 - x) / (1 - self.a)), np.where(up, 1 / self.a, 1 / (self.a - 1))
        turns = np.zeros(x.shape, np.int32)
        return Returns(self.coordinates, ("B",), x, image, turns, blank, blank, blank * np.nan, slopes[:, :, None])


@dataclass(frozen=True)
class Linear(ReturnMap):
    """A linear map of any number of coordinates, on a circle so that nothing grows."""

    matrix: np.ndarray

    @cached_property
    def coordinates(self):
        return Coordinates([Angle(f"a{k}") for k in range(len(self.matrix))])

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        image, n = (start @ self.matrix.T) % (2 * np.pi), len(start)
        slopes = np.tile(self.matrix, (n, 1, 1))
        blank = np.zeros(n, np.int8)
        return Returns(self.coordinates, ("B",), start, image, 0 * start.astype(np.int32), blank, blank, blank * np.nan, slopes)


def test_logistic_map_has_log_2():
    starts = np.random.default_rng(1).uniform(0.01, 0.99, (200, 2))
    made = nsmaps.lyapunov(Logistic(), starts=starts, n_returns=3200, transient=100)
    off = made.exponents - [np.log(2), -np.log(3)]
    assert np.abs(off[:, 1]).max() < 5e-3
    assert abs(off[:, 0].mean()) < 1e-3
    assert (np.abs(off[:, 0]) < 4 * made.error[:, 0]).all()
    assert np.allclose(made.per_time, 2 * made.exponents)
    assert np.allclose(made.per_time_error, 2 * made.error)


def test_the_error_says_how_far_single_orbits_are_off():
    """The skewed tent stretches by 1/a or 1/(1 - a) with probabilities a and 1 - a, independently: all is known."""
    a, n = 0.2, 3200
    made = nsmaps.lyapunov(Tent(a), starts=np.random.default_rng(1).uniform(0.01, 0.99, (200, 1)), n_returns=n, transient=100)
    exact = -a * np.log(a) - (1 - a) * np.log(1 - a)
    spread = np.sqrt(a * (1 - a) / n) * abs(np.log(a / (1 - a)))
    assert abs(made.exponents.mean() - exact) < 4 * spread / np.sqrt(200)
    assert made.exponents.std() == pytest.approx(spread, rel=0.2)
    assert 0.9 < made.error.mean() / spread < 1.3


@pytest.mark.parametrize("count", [3, 4])
def test_linear_maps_have_the_moduli_of_their_eigenvalues(count):
    matrix = np.random.default_rng(count).integers(-3, 4, (count, count)) + 4.0 * np.diag(np.arange(count))
    made = nsmaps.lyapunov(Linear(matrix), starts=np.ones(count), n_returns=2000, transient=2000)
    assert np.allclose(made.exponents, np.sort(np.log(np.abs(np.linalg.eigvals(matrix))))[::-1], atol=5e-3)
    assert made.exponents.sum() == pytest.approx(np.log(abs(np.linalg.det(matrix))), abs=1e-12)
    assert np.isnan(made.per_time).all()


@pytest.mark.parametrize("transient", [0, 10])
@pytest.mark.parametrize(
    ("matrix", "largest"),
    [
        ([[0, 0], [1, 2]], [2]),
        ([[0, 5], [0, 3]], [3]),
        ([[1, 1, 0], [0, 0, 0], [1, 2, 3]], [3, 1]),
        ([[0, 0, 0], [1, 2, 1], [1, 1, 3]], [(5 + 5**0.5) / 2, (5 - 5**0.5) / 2]),
    ],
)
def test_resets_keep_the_exponents_of_what_they_do_not_reset(matrix, largest, transient):
    made = nsmaps.lyapunov(Linear(np.array(matrix, float)), starts=np.ones(len(matrix)), n_returns=4000, transient=transient)
    assert np.allclose(made.exponents[: len(largest)], np.log(largest), atol=2e-3)
    assert (made.exponents[len(largest) :] == -np.inf).all()


def test_cycles_have_the_logarithms_of_their_multipliers(pair):
    fixed = nsmaps.lyapunov(pair(0.35), starts=[0.8, 0.4], n_returns=320)
    assert np.allclose(fixed.exponents, np.log([0.82672902, 0.07559914]), atol=2e-7)
    assert (fixed.error < 1e-12).all()
    assert np.allclose(fixed.per_time, fixed.exponents / 2, atol=1e-9)  # one period of the forcing a return
    assert fixed.running.shape == (32, 2)
    cycle = nsmaps.lyapunov(pair(0.27), starts=[0.8, 0.4], n_returns=6400)
    own = nsmaps.periodic_orbit(pair(0.27), nsmaps.orbit(pair(0.27), [0.8, 0.4], 3000).final, 4)
    expected = np.log(np.abs(own.multipliers)) / 4
    assert np.allclose(cycle.exponents, expected, atol=2e-3)
    assert (np.abs(cycle.exponents - expected) < 3 * cycle.error + 1e-9).all()


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
def test_the_sum_is_log_det_and_what_the_pair_conserves(pair, d):
    """Flights keep v dv dphi and impacts on either wall shrink it by r^2: an independent sum over the impacts."""
    system, start, n = pair(d, r=0.45), [0.8, 0.4], 6400
    made = nsmaps.lyapunov(system, starts=start, n_returns=n, transient=0)
    path = nsmaps.orbit(system, start, n)
    impacts = sum(len(word) - 1 for word in path.words)
    expected = (2 * impacts * np.log(0.45) + np.log(path.states[0, 0] / path.states[-1, 0])) / n
    assert made.exponents.sum() == pytest.approx(expected, abs=1e-10)
    assert made.log_det == pytest.approx(expected, abs=1e-10)
    assert made.defect < 1e-12


def test_chaos_is_told_from_order(pair):
    made = nsmaps.lyapunov(pair(0.26), starts=[0.8, 0.4], n_returns=20_000)
    frame, path, grown = np.eye(2), nsmaps.orbit(pair(0.26), [0.8, 0.4], 21_000).states, np.zeros(2)
    for k, step in enumerate(pair(0.26).first_return(path[:-1], derivative=True).derivative):
        frame, r = np.linalg.qr(step @ frame)
        grown += np.log(np.abs(np.diag(r))) * (k >= 1000)
    assert np.allclose(made.exponents, grown / 20_000, atol=1e-8)
    assert made.exponents[0] > 30 * made.error[0] > 0


class Slow(ReturnMap):
    """A system's map without its compiled loop."""

    def __init__(self, system):
        self.coordinates, self.system = system.coordinates, system

    def first_return(self, states, derivative=False):
        return self.system.first_return(states, derivative)


def test_the_compiled_loop_is_that_of_single_returns(pair):
    starts = np.random.default_rng(2).uniform([0.3, 0], [1, 2 * np.pi], (3, 2, 2))
    quick, slow = (
        nsmaps.lyapunov(formulas, starts=starts, n_returns=64, transient=100) for formulas in (pair(0.30), Slow(pair(0.30)))
    )
    assert quick.exponents.shape == (3, 2, 2)
    assert quick.outcome.shape == (3, 2)
    assert np.allclose(quick.exponents, slow.exponents, atol=1e-9, equal_nan=True)
    assert np.array_equal(quick.outcome, slow.outcome)


def test_orbits_that_end_and_none_at_all_are_data():
    made = nsmaps.lyapunov(Logistic(), starts=[[0.3, 0.1], [2.0, 0.1], [np.nan, 0.0]], n_returns=64, transient=10)
    assert made.outcome.tolist() == [Outcome.returned, Outcome.escaped, Outcome.invalid]
    assert np.isfinite(made.exponents).all(axis=-1).tolist() == [True, False, False]
    assert np.isnan(made.error[1:]).all()
    assert nsmaps.lyapunov(Logistic(), starts=np.empty((0, 2)), n_returns=64).exponents.shape == (0, 2)


def test_a_rest_forgets_where_it_came_from(pair):
    made = nsmaps.lyapunov(pair(0.35), starts=[[0.2, 0.1], [0.8, 0.4]], n_returns=64, transient=0)
    assert nsmaps.orbit(pair(0.35), [0.2, 0.1], 64).outcome.max() == Outcome.stuck
    assert (made.exponents[0] == -np.inf).all()
    assert made.log_det[0] == -np.inf
    assert np.isfinite(made.exponents[1]).all()
    alone = nsmaps.lyapunov(pair(0.35), starts=[0.2, 0.1], n_returns=64, transient=0)
    assert str(alone) == "exponents -inf, -inf per return, 64 returns"


class Slider(HybridSystem):
    """y slides at zero for part of each period, from which it is released at a phase that depends on x."""

    states = ("x", "y")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        slope, push = y.y - y.x / 2, 1.5 * sp.cos(t) + y.x / 10
        return {"above": {"x": slope, "y": push - 1}, "below": {"x": slope, "y": push + 1}}

    def guards(self, t, y):
        modes = ("above", "below", "slide")
        return {"slide": SlidingSurface("above", "below", y.y), "strobe": Guard(modes, -sp.sin(t))}

    def section(self, t, y):
        return PoincareSection("strobe", ("x", "y"))


def test_sliding_forgets_a_direction():
    """Differences of images in both directions are parallel; the word has the letter of the section between its ends."""
    slider = Slider()
    end = nsmaps.orbit(slider, [0.1, 0.2], 60).final
    images = slider.first_return(end + 1e-4 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])).image
    slopes = (images[::2] - images[1::2]).T / 2e-4
    made = nsmaps.lyapunov(slider, starts=end, n_returns=64)
    assert made.exponents[0] == pytest.approx(np.log(abs(np.trace(slopes))), abs=1e-6)
    assert made.exponents[1] == made.log_det == -np.inf
    assert nsmaps.periodic_orbit(slider, end).label == "ssbsas/T"


@pytest.mark.parametrize("unit", [1.0, 1e-12, 1e12])
def test_units_do_not_make_a_derivative_singular(unit):
    slopes = np.array(
        [[[0.5, unit], [0.4 / unit, 0.9]], [[0.5, unit], [0.45 / unit, 0.9]], [[0.1 + 0.2, unit], [0.3 / unit, 1.0]]]
    )
    assert determinants(slopes) == pytest.approx([0.05, 0, 0], rel=1e-13, abs=0)


def test_a_plastic_impact_forgets_the_speed():
    """Without restitution a return depends on the phase alone: one exponent is that of a map of the circle."""
    plastic = nsmaps.load_system("impact_oscillator", zeta=0.05, w=2.5, A=1.0, wall=0.1, r=0.0)
    path = nsmaps.orbit(plastic, [0.5, 1.0], 320)
    assert set(path.words[20:]) == {"BB"}
    h = [0.0, 1e-6]
    ahead, behind = (plastic.first_return(path.states[:-1] + side * np.array(h)).image[:, 1] for side in (1, -1))
    slopes = np.log(np.abs((ahead - behind + np.pi) % (2 * np.pi) - np.pi) / 2e-6)[100:]
    for return_map in (plastic, Slow(plastic)):
        made = nsmaps.lyapunov(return_map, starts=path.states[80], n_returns=220, transient=20)
        assert made.exponents[0] == pytest.approx(slopes.mean(), abs=1e-6)
        assert made.exponents[1] == -np.inf


def test_sweeps_are_loops_over_values(pair):
    made = lyapunov(pair(0.3), "d", [0.26, -1.0, 0.35], [0.8, 0.4], n_returns=640, direction="down")
    first = nsmaps.lyapunov(pair(0.35), starts=[0.8, 0.4], n_returns=640)
    assert np.array_equal(made.exponents[2], first.exponents)
    assert np.array_equal(made.exponents[0], nsmaps.lyapunov(pair(0.26), starts=first.final, n_returns=640).exponents)
    assert np.isnan(made.exponents[1]).all()
    assert "greater than 0" in made.reasons[1]
    with pytest.raises(NsmapsError, match=message("dynamics.no-map-greater", number=1)):
        lyapunov(lambda d: pair(0.3).at(d=d), "d", [-1.0], [0.8, 0.4], n_returns=640)


def test_wrong_calls_are_errors(pair):
    with pytest.raises(StateError, match=message("errors.shape", what="the start has", shape="(3,)")):
        nsmaps.lyapunov(pair(0.3), starts=[1, 2, 3], n_returns=64)
    with pytest.raises(NsmapsError, match=message("dynamics.returns-in-batches", number=10, transient=1000)):
        nsmaps.lyapunov(pair(0.3), starts=[0.8, 0.4], n_returns=10)


def test_sweeps_of_no_points_are_errors(pair):
    for values in ([], [np.nan], [[0.3, 0.3]]):
        with pytest.raises(NsmapsError, match=message("errors.shape", what="the values have")):
            lyapunov(lambda d: pair(d), "d", values, [0.8, 0.4], n_returns=640)


@pytest.mark.parametrize("count", [1, 40])
def test_derivatives_of_orbits_are_those_of_single_returns(pair, count):
    """One by one and side by side; an orbit that ended has none."""
    starts = np.random.default_rng(3).uniform([0.4, 0.1], [0.9, 1.0], (count, 2))
    starts[1:2] = np.nan
    made = pair(0.3).orbits(starts, 6, derivative=True)
    single = pair(0.3).first_return(made.start, derivative=True)
    assert np.allclose(made.derivative, single.derivative, rtol=1e-12, atol=1e-13, equal_nan=True)
    assert np.isfinite(made.derivative).all(axis=(1, 2)).sum() == np.isfinite(made.start).all(axis=1).sum()


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_frames_are_those_of_a_qr_decomposition(unit):
    """Against Householder's reflections, but for the signs of the columns; lengths are multiplied by the unit."""
    derivatives = np.random.default_rng(5).normal(size=(1, 7, 3, 3))
    frames, growth = np.tile(np.eye(3), (7, 1, 1)), np.empty((1, 7, 3))
    carried(derivatives * unit, frames, growth)
    for k in range(7):
        q, r = np.linalg.qr(derivatives[0, k])
        assert np.allclose(frames[k], q * np.sign(np.diag(r)), atol=1e-13)
        assert np.allclose(growth[0, k], np.log(np.abs(np.diag(r))) + np.log(unit), atol=1e-12)


@pytest.mark.parametrize("rank", [0, 1, 2])
def test_a_frame_stays_one_where_directions_are_forgotten(rank):
    """Columns that are not zero come first, with finite lengths, and span the image; the others fill the space."""
    derivative = np.random.default_rng(8).normal(size=(3, 3))
    derivative[:, : 3 - rank] = 0
    frames, growth = np.eye(3)[None].copy(), np.empty((1, 1, 3))
    carried(derivative[None, None], frames, growth)
    basis = frames[0]
    assert np.allclose(basis.T @ basis, np.eye(3), atol=1e-13)
    assert np.allclose(basis[:, :rank] @ basis[:, :rank].T @ derivative, derivative, atol=1e-13)
    assert np.isfinite(growth[0, 0]).tolist() == [True] * rank + [False] * (3 - rank)
