"""Branches of periodic orbits against closed forms and against Newton's method on implicit equations in 40 digits."""

from dataclasses import dataclass
from math import acos, cos, pi, sin, sqrt

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from dynamics_implicit import flight, gaps, multipliers_test, solve
from messages import message
from systems import BouncingBall, Cam, Oscillator

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics import CompleteChatter
from nsmaps.dynamics.continuation.follow import continue_branch, period_doubling_cascade, switch_branch
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

XY = Coordinates(("x", "y"))
HALF, QUARTER = mp.mpf(1) / 2, mp.mpf(1) / 4
G3, G6 = (mp.mpf("0.1245") * mp.mpf("9.8") * mp.sin(mp.pi / k) / 5 for k in (3, 6))  #: g_bar at beta = pi/3 and pi/6


@dataclass(frozen=True)
class Plane(ReturnMap):
    """A map of the plane without walls, by its formulas and their derivative; everything escapes where a is beyond `last`."""

    a: float
    kind: str
    last: float = np.inf
    coordinates: Coordinates = XY

    def first_return(self, states, derivative=False):
        x, y = np.asarray(states, float).T
        if self.kind == "henon":  # x' = a - x^2 + b y, y' = x
            image, rows = (self.a - x**2 + 0.3 * y, x), ((-2 * x, 0.3), (1, 0))
        elif self.kind == "ring":  # fixed points on the circle x^2 + a^2 = 1
            image, rows = (x + 0.3 * (1 - x**2 - self.a**2), y / 2), ((1 - 0.6 * x, 0), (0, 0.5))
        elif self.kind == "area":  # x' = a - x^2 - y, y' = x
            image, rows = (self.a - x**2 - y, x), ((-2 * x, -1), (1, 0))
        elif self.kind == "flip":  # the origin doubles its period at a = 1
            image, rows = (x**3 - self.a * x, y / 2), ((3 * x**2 - self.a, 0), (0, 0.5))
        else:  # the delayed logistic map: x' = a x (1 - y), y' = x
            image, rows = (self.a * x * (1 - y), x), ((self.a * (1 - y), -self.a * x), (1, 0))
        n = len(x)
        slopes = np.empty((n, 2, 2)) if derivative else None
        for i, j in np.ndindex(2, 2) if derivative else ():
            slopes[:, i, j] = rows[i][j]
        inside = self.a <= self.last
        made = np.column_stack(image) if inside else np.full((n, 2), np.nan)
        outcome = np.full(n, Outcome.returned if inside else Outcome.escaped, np.int8)
        turns, codes, time = np.zeros((n, 2), np.int32), np.ones(n, np.int64), np.full(n, np.nan)
        return Returns(self.coordinates, ("B",), np.asarray(states), made, turns, codes, outcome, time, slopes)


def only(branch, kind):
    """The one event of a kind."""
    (event,) = branch.of_kind(kind)
    assert event.precision < 1e-8
    assert "not located" not in event.detail
    return event


def test_fold_and_doubling_of_the_bouncing_ball():
    """Fixed points exist from Gamma = pi (1 - e)/(1 + e); the one that is born stable doubles where the closed form says."""
    e, start = 0.5, 1.2
    fold = pi * (1 - e) / (1 + e)
    doubling = sqrt(fold**2 + (2 * (1 + e**2) / (1 + e) ** 2) ** 2)
    assert abs(doubling - 1.5268237005) < 1e-10

    def ball(a):
        return BouncingBall(a=a, r=e)

    fixed = nsmaps.periodic_orbit(ball(start), [2 * pi / (1 + e), acos(fold / start)])
    up = continue_branch(ball, "p", fixed, start, (0.5, 2.5), direction="up")
    assert abs(only(up, "period doubling").value - doubling) < 1e-8
    down = continue_branch(ball, "p", fixed, start, (0.5, 2.5), direction="down")
    assert abs(only(down, "fold").value - fold) < 1e-8
    assert down.values[-1] == 2.5  # round the fold, on the saddle
    assert (np.diff(down.arclength) > 0).all()
    phase = np.array([acos(fold / a) for a in down.values])
    assert np.allclose(np.abs(np.angle(np.exp(1j * down.points[:, 0, 1]))), phase, atol=1e-9)
    assert np.allclose(down.points[:, 0, 0], 2 * pi / (1 + e), atol=1e-12)
    folded = down.arclength > down.arclength[np.argmin(down.values)]
    assert not down.stable[folded].any()


def test_saddle_of_the_bouncing_ball_grazes():
    """The flight of the saddle touches the table in between: gap and speed vanish together at a time s of its own."""
    e, fold = 0.5, pi / 3

    def touch(a, s):
        t = -mp.acos(fold / a)
        lift = 2 * mp.pi * HALF / (1 + HALF) + a * mp.cos(t)
        return [lift * s - s**2 / 2 - a * (mp.sin(t + s) - mp.sin(t)), lift - s - a * mp.cos(t + s)]

    a, _ = solve(touch, [2.5, 2.5])
    fixed = nsmaps.periodic_orbit(BouncingBall(a=1.2, r=e), [2 * pi / (1 + e), -acos(fold / 1.2)])
    made = continue_branch(lambda a: BouncingBall(a=a, r=e), "a", fixed, 1.2, (1.1, 4.0), direction="up")
    event = only(made, "grazing")
    assert made.ended == "grazing"
    assert event.detail == "a clearance is zero"
    assert abs(event.value - float(a)) < 1e-8


def test_doubling_of_the_pair_in_40_digits(pair):
    *_, d = solve(
        lambda v, phi, a, b, d: [
            *gaps("BTB", v, phi, [a, b], d, HALF, G3),
            multipliers_test("BTB", [v, phi, a, b], d, HALF, G3, -1),
        ],
        [0.804, 0.313, 1.263, 0.737, 0.324],
    )
    assert abs(d - 0.324188543) < 1e-9
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    made = continue_branch(pair(0.35), "d", fixed, 0.35, (0.26, 0.40), direction="down")
    assert abs(only(made, "period doubling").value - float(d)) < 1e-11
    assert np.array_equal(made.stable, made.values > float(d))
    assert made.ended == "the range ends at 0.26"
    assert made.values[[0, -1]].tolist() == [0.35, 0.26]
    assert set(made.words.ravel()) == {"BTB"}


def test_fold_of_the_pair_in_40_digits(pair):
    """The stable 1:1 motion and the saddle of the same words, joined where restitution is small."""
    *_, r = solve(
        lambda v, phi, a, b, r: [
            *gaps("BTB", v, phi, [a, b], mp.mpf("0.35"), r, G3),
            multipliers_test("BTB", [v, phi, a, b], mp.mpf("0.35"), r, G3, 1),
        ],
        [0.675, 1.911, 1.184, 0.816, 0.0356],
    )
    system = pair(0.35)
    stable, saddle = (nsmaps.periodic_orbit(system, guess) for guess in ([0.8, 0.4], [0.34325, 2.87685]))
    for start, other in ((stable, saddle), (saddle, stable)):
        made = continue_branch(system, "r", start, 0.5, (0, 0.6), direction="down")
        assert abs(only(made, "fold").value - float(r)) < 1e-11
        assert made.ended == "the range ends at 0.6"
        after = np.flatnonzero(np.diff(np.sign(made.values - 0.5)))[-1]
        passed = nsmaps.periodic_orbit(system, made.points[after][0])
        assert np.allclose(passed.states, other.states, atol=1e-10)


def test_saddles_of_the_pair_meet_in_a_graze(pair):
    """The saddle BB touches the wall T, the saddle BTB meets it with speed zero: both at once, a fold that is not smooth."""
    *_, d = solve(
        lambda v, phi, s, touch, d: [
            *gaps("BB", v, phi, [s], d, HALF, G3),
            flight(phi / mp.pi, d / 2, -HALF * v, touch, G3)[0] + d / 2,
            flight(phi / mp.pi, d / 2, -HALF * v, touch, G3)[1],
        ],
        [0.28177, 2.91844, 2, 1.3, 0.3],
    )
    system = pair(0.35)
    for guess, detail in (([0.28177, 2.91844], "a clearance is zero"), ([0.34325, 2.87685], "an impact speed is zero")):
        made = continue_branch(system, "d", nsmaps.periodic_orbit(system, guess), 0.35, (0.1, 0.4), direction="down")
        event = only(made, "grazing")
        assert (made.ended, event.detail, event.border) == ("grazing", detail, "non-smooth fold")
        assert abs(event.value - float(d)) < 1e-8


def test_a_fold_beside_a_graze_is_located_to_rounding(pair):
    """At r = 0.25, beta = pi/6 the 3:1 motion folds where one of its impacts nearly grazes; by Newton's method in 40 digits."""
    system = pair(0.18, r=0.25, beta=pi / 6)
    start = nsmaps.periodic_orbit(system, [0.56, 0.22], 3)
    fold = only(continue_branch(system, "d", start, 0.18, (0.17, 0.19), direction="up"), "fold")
    state, word = fold.orbit.states[0].tolist(), fold.orbit.word
    times = np.diff(system.at(d=fold.value).impacts(state, len(word)).time).tolist()
    *_, d = solve(
        lambda v, phi, *rest: [
            *gaps(word, v, phi, rest[:-1], rest[-1], QUARTER, G6),
            multipliers_test(word, [v, phi, *rest[:-1]], rest[-1], QUARTER, G6, 1),
        ],
        [*state, *times, fold.value],
    )
    assert abs(fold.value - float(d)) < 1e-12
    assert fold.precision < 1e-13


def test_bistable_window(pair):
    """At r = 0.25, beta = pi/6 the 2:1 motion folds, its saddle meets the 1:1 motion in a graze; 1:1 has doubled before."""
    system = pair(0.25, r=0.25, beta=pi / 6)
    one = continue_branch(system, "d", nsmaps.periodic_orbit(system, [0.68, 0.52]), 0.25, (0.15, 0.30), direction="down")
    cycle = nsmaps.orbit(system.at(d=0.21), [0.6, 0.3], 3000).final
    two = continue_branch(system, "d", nsmaps.periodic_orbit(system.at(d=0.21), cycle, 2), 0.21, (0.15, 0.30), direction="up")
    assert (one.labels[0], two.labels[0]) == ("1:1/T", "2:1/T")
    *_, d = solve(
        lambda v, phi, a, b, c, d: [
            *gaps("BBTB", v, phi, [a, b, c], d, QUARTER, G6),
            multipliers_test("BBTB", [v, phi, a, b, c], d, QUARTER, G6, 1),
        ],
        [0.6597, 0.4277, 0.482, 0.813, 0.705, 0.2277],
    )
    assert abs(only(two, "fold").value - float(d)) < 1e-10
    *_, d = solve(
        lambda v, phi, a, b, d: [
            *gaps("BTB", v, phi, [a, b], d, QUARTER, G6),
            multipliers_test("BTB", [v, phi, a, b], d, QUARTER, G6, -1),
        ],
        [0.6806, 0.5205, 1.33, 0.67, 0.2346],
    )
    assert abs(only(one, "period doubling").value - float(d)) < 1e-10
    *_, d = solve(
        lambda v, phi, a, b, touch, d: [
            *gaps("BTB", v, phi, [a, b], d, QUARTER, G6),
            flight(phi / mp.pi, d / 2, -QUARTER * v, touch, G6)[0] - d / 2,
            flight(phi / mp.pi, d / 2, -QUARTER * v, touch, G6)[1],
        ],
        [0.6541, 0.465, 1.355, 0.645, 0.586, 0.2146],
    )
    for branch in (one, two):
        assert abs(only(branch, "grazing").value - float(d)) < 1e-8
        assert only(branch, "grazing").border == "non-smooth fold"  # both on the side of larger d


def test_orbits_are_physically_there(pair):
    """Up to its grazes, no flight of a cycle leaves the capsule between its impacts: sampled densely, by the formula alone."""
    system = pair(0.21, r=0.25, beta=pi / 6)
    cycle = nsmaps.orbit(system, [0.6, 0.3], 3000).final
    made = continue_branch(system, "d", nsmaps.periodic_orbit(system, cycle, 2), 0.21, (0.15, 0.30), direction="up")
    nearest = []
    for d, states in zip(made.values, made.points, strict=True):
        impacts = system.at(d=d).impacts(states[0], 4)
        assert np.isclose(impacts.time[-1], 2, atol=1e-9)
        sides = np.where(impacts.wall == 0, d / 2, -d / 2)
        for k in range(3):
            t, s = impacts.phase[k] / pi, np.linspace(0, impacts.time[k + 1] - impacts.time[k], 2001)
            w = (-1 if impacts.wall[k] == 0 else 1) * 0.25 * impacts.speed[k]
            place = sides[k] + (w - np.sin(pi * t) / pi) * s + system.g_bar * s**2 / 2
            place -= (np.cos(pi * (t + s)) - np.cos(pi * t)) / pi**2
            assert abs(place[-1] - sides[k + 1]) < 1e-12
            assert np.abs(place).max() < d / 2 + 1e-12
            nearest.append(impacts.speed[1:].min())
    assert min(nearest) < 1e-5  # as far as the graze itself


def test_cascade_of_the_pair(pair):
    system = pair(0.35)
    branches = period_doubling_cascade(
        system, "d", nsmaps.periodic_orbit(system, [0.8, 0.4]), 0.35, (0.25, 0.36), direction="down", n_doublings=6
    )
    assert [branch.points.shape[1] for branch in branches] == [1, 2, 4, 8, 16, 32]
    found = np.array([only(branch, "period doubling").value for branch in branches])
    steps = np.diff(found)
    ratios = steps[:-1] / steps[1:]
    assert np.abs(ratios[-2:] - 4.669201609).max() < 0.1
    assert abs(ratios[-1] - 4.669201609) < abs(ratios[-2] - 4.669201609)
    for k in range(1, 4):  # between its doublings a cycle attracts, and the period is what follows from iteration alone
        middle = found[k - 1] + 0.7 * (found[k] - found[k - 1])
        made = nsmaps.bifurcation_diagram(system, "d", [middle], [0.8, 0.4], transient=20_000, n_returns=64)
        assert made.period.item() == 2**k


def test_doublings_of_the_henon_map():
    """With b = 0.3 fixed points are born at -(1 - b)^2/4 and double at 3 (1 - b)^2/4, the cycle at (1 - b)^2 + (1 + b)^2/4."""

    def henon(a):
        return Plane(a, "henon")

    fixed, bounds = nsmaps.periodic_orbit(henon(0.2), [0.2, 0.2]), (-1, 0.95)
    down = continue_branch(henon, "p", fixed, 0.2, bounds, direction="down")
    assert abs(only(down, "fold").value + 0.49 / 4) < 1e-8
    assert np.allclose(down.values, down.points[:, 0, 0] ** 2 + 0.7 * down.points[:, 0, 0], atol=1e-9)
    up = continue_branch(henon, "p", fixed, 0.2, bounds, direction="up")
    doubling = only(up, "period doubling")
    assert abs(doubling.value - 3 * 0.49 / 4) < 1e-8
    two = switch_branch(henon, "p", doubling, bounds)
    assert abs(only(two, "period doubling").value - (0.49 + 1.69 / 4)) < 1e-8
    back = continue_branch(henon, "p", two.orbits[-1], 0.95, bounds, direction="down")
    assert back.ended == "period halving"
    assert abs(only(back, "period halving").value - doubling.value) < 1e-8
    with pytest.raises(NsmapsError, match=message("dynamics.no-branch-from", event="fold")):
        switch_branch(henon, "p", down.of_kind("fold")[0], bounds)


def test_a_branch_in_both_directions_is_one():
    """The fixed points of the Henon map from the fold at -0.49/4, through the start, to the doubling at 0.3675 and beyond."""

    def henon(a):
        return Plane(a, "henon")

    fixed = nsmaps.periodic_orbit(henon(0.2), [0.2, 0.2])
    whole, up = (continue_branch(henon, "p", fixed, 0.2, (-1, 1.3), direction=direction) for direction in ("both", "up"))
    assert [event.kind for event in whole.events] == ["fold", "period doubling"]
    assert np.allclose([event.value for event in whole.events], [-0.49 / 4, 3 * 0.49 / 4], atol=1e-8)
    assert np.allclose(whole.values, whole.points[:, 0, 0] ** 2 + 0.7 * whole.points[:, 0, 0], atol=1e-9)
    assert whole.ended == f"the range ends at 1.3; {up.ended}"
    assert (np.diff(whole.arclength) > 0).all()
    assert whole.values[whole.arclength == 0] == [0.2]
    with pytest.raises(NsmapsError, match=message("errors.value", name="direction", value="'left'")):
        continue_branch(henon, "p", fixed, 0.2, (-1, 1.3), direction="left")


def test_torus_and_branch_point_of_the_delayed_logistic_map():
    """Its fixed point 1 - 1/a passes through zero at a = 1; a pair of multipliers exp(+-i pi/3) leaves the circle at a = 2."""

    def delayed(a):
        return Plane(a, "delayed")

    fixed = nsmaps.periodic_orbit(delayed(1.5), [0.33, 0.33])
    up = continue_branch(delayed, "p", fixed, 1.5, (0.5, 2.3), direction="up")
    torus = only(up, "Neimark-Sacker")
    assert abs(torus.value - 2) < 1e-8
    assert np.allclose(np.sort_complex(torus.multipliers), [complex(cos(pi / 3), s * sin(pi / 3)) for s in (-1, 1)], atol=1e-7)
    down = continue_branch(delayed, "p", fixed, 1.5, (0.5, 2.3), direction="down")
    assert abs(only(down, "branch point").value - 1) < 1e-8
    assert np.allclose(down.points[:, 0, 0], 1 - 1 / down.values, atol=1e-9)


def test_a_map_that_preserves_area_has_no_torus_but_its_doubling():
    """The product of its multipliers is one but for rounding, which passes one again and again."""
    orbit = nsmaps.periodic_orbit(Plane(0.3, "area"), [0.1, 0.1])
    assert abs(orbit.multipliers[0].imag) > 0.5
    branch = continue_branch(lambda a: Plane(a, "area"), "a", orbit, 0.3, (0.0, 4.0))
    assert [event.kind for event in branch.events] == ["period doubling"]
    assert only(branch, "period doubling").value == pytest.approx(3, abs=1e-9)


@pytest.mark.parametrize("step", [1 / 32, 0.03])
def test_an_event_at_an_orbit_of_the_branch_is_told_once(step):
    """In binary steps the branch of the origin meets a = 1 exactly, where the test is zero."""
    orbit = nsmaps.periodic_orbit(Plane(0.5, "flip"), [0.0, 0.0])
    branch = continue_branch(lambda a: Plane(a, "flip"), "a", orbit, 0.5, (0.0, 2.0), step=step)
    assert (branch.values == 1).any() == (step == 1 / 32)
    assert only(branch, "period doubling").value == pytest.approx(1, abs=1e-12)


def test_a_step_to_the_cycle_of_half_the_period_ends_a_branch():
    """The states of the doubled cycle solve x^2 - 0.7 x + 0.49 = a; it is born at a = 3 (1 - 0.3)^2/4, next to the start."""
    value, within = 0.3676, (0.3665, 0.3677)
    x = np.roots([1, -0.7, 0.49 - value])
    cycle = nsmaps.periodic_orbit(Plane(value, "henon"), [x, x[::-1]], 2, scale=[30, 30])
    back = continue_branch(lambda a: Plane(a, "henon"), "a", cycle, value, within, direction="down", step=0.05)
    assert back.ended == "period halving"
    assert only(back, "period halving").value == pytest.approx(0.3675, abs=1e-12)


@pytest.mark.thorough
def test_a_doubled_branch_leads_back_to_where_it_began():
    """Also by its own steps, which meet that place, a = 3 (1 - 0.3)^2/4, as exactly as Newton's method can."""
    within = 0.0, 0.7
    branch = continue_branch(
        lambda a: Plane(a, "henon"), "a", nsmaps.periodic_orbit(Plane(0.2, "henon"), [0.1, 0.1]), 0.2, within
    )
    doubled = switch_branch(lambda a: Plane(a, "henon"), "a", only(branch, "period doubling"), within)
    for orbit, a in zip(doubled.orbits[2::24], doubled.values[2::24], strict=True):
        back = continue_branch(lambda a: Plane(a, "henon"), "a", orbit, a, within, direction="down")
        assert back.ended == "period halving"
        assert only(back, "period halving").value == pytest.approx(0.3675, abs=1e-9)


def test_a_ring_of_fixed_points_closes():
    def ring(a):
        return Plane(a, "ring")

    made = continue_branch(ring, "p", nsmaps.periodic_orbit(ring(0.2), [0.9, 0.0]), 0.2, (-2, 2), direction="up", step=0.05)
    assert made.ended == "closed"
    assert np.allclose(made.points[:, 0, 0] ** 2 + made.values**2, 1, atol=1e-9)
    assert np.allclose([event.value for event in made.of_kind("fold")], [1, -1], atol=1e-8)
    assert (made.points[:, 0, 0].min() < -0.95) & (made.values.max() > 0.95)


def test_a_fold_next_to_the_start_closes_nothing():
    def henon(a):
        return Plane(a, "henon")

    start = -0.49 / 4 + 1e-5
    made = continue_branch(henon, "p", nsmaps.periodic_orbit(henon(start), [-0.34, -0.34]), start, (-1, 1), direction="down")
    assert abs(only(made, "fold").value + 0.49 / 4) < 1e-8
    assert made.ended == "the range ends at 1"


def test_end_of_the_valid_domain_is_told(pair):
    system = pair(0.35)
    fixed = nsmaps.periodic_orbit(system, [0.8, 0.4])
    made = continue_branch(system, "r", fixed, 0.5, (0.2, 1.5), direction="up")
    assert made.ended == "end of the valid domain"
    event = only(made, "end of the valid domain")
    assert abs(event.value - 1) < 1e-8
    assert "less than or equal to 1" in event.detail
    assert len(made.orbits) > 10

    none = continue_branch(system, "d", nsmaps.periodic_orbit(system, [np.nan, 0.4]), 0.35, (0.2, 0.4))
    why = "Newton's method does not converge, and the guess has no image: invalid"
    assert (len(none.orbits), none.ended) == (0, f"no orbit at 0.35: {why}")
    assert (none.points.shape, none.multipliers.shape, none.labels.shape) == ((0, 1, 2), (0, 2), (0,))
    none = continue_branch(system, "d", fixed, -0.5, (-1, 0.4))
    assert len(none.orbits) == 0
    assert "greater than 0" in none.ended


@dataclass(frozen=True)
class Steep(ReturnMap):
    """A linear map with multipliers -30 (1 + a) and 0.3 at zero: after a dozen returns rounding hides the second."""

    a: float
    coordinates: tuple[str, ...] = ("x", "y")

    def first_return(self, states, derivative=False):
        turn = np.array([[cos(1), -sin(1)], [sin(1), cos(1)]])
        slope = turn @ np.diag([-30 * (1 + self.a), 0.3]) @ turn.T
        states = np.asarray(states, float)
        n = len(states)
        none = np.zeros((n, 2), np.int32), np.ones(n, np.int64), np.zeros(n, np.int8), np.full(n, np.nan)
        given = np.broadcast_to(slope, (n, 2, 2)) if derivative else None
        return Returns(self.coordinates, ("B",), states, states @ slope.T, *none, given)


def test_multipliers_below_rounding_make_no_events():
    made = continue_branch(Steep, "p", nsmaps.periodic_orbit(Steep(0.0), [0.0, 0.0], 12), 0.0, (0, 1))
    assert np.abs(made.multipliers[:, 1]).max() > 1.5, "which is 0.3**12"
    assert (made.ended, made.events) == ("the range ends at 1", ())
    assert len(made.orbits) > 20


def test_a_guess_that_escapes_says_so():
    def none(a):
        return Plane(a, "henon", last=0.1)

    made = continue_branch(none, "p", nsmaps.periodic_orbit(none(0.2), [0.2, 0.2]), 0.2, (0, 1))
    assert made.ended == "no orbit at 0.2: Newton's method does not converge, and the guess has no image: B escaped"
    assert made.orbits == ()
    assert made.stable.shape == (0,)


def test_only_kinds_that_are_asked_for_are_located_and_others_still_end_a_branch():
    def henon(a):
        return Plane(a, "henon")

    fixed = nsmaps.periodic_orbit(henon(0.2), [0.2, 0.2])
    made = continue_branch(henon, "p", fixed, 0.2, (-1, 1.3), direction="up", kinds=("fold",))
    assert made.events == ()
    assert not made.stable[-1]
    made = continue_branch(henon, "p", fixed, 0.2, (-1, 1.3), direction="up", kinds=(), until=("period doubling",))
    assert [event.kind for event in made.events] == ["period doubling"]
    with pytest.raises(NsmapsError, match=message("dynamics.events", names="'folds'")):
        continue_branch(henon, "p", fixed, 0.2, (-1, 1.3), kinds=("folds",))
    with pytest.raises(NsmapsError, match=message("dynamics.value-outside", value=0.2, low=0.2, high=0.2)):
        continue_branch(henon, "p", fixed, 0.2, (0.2, 0.2))


def test_a_branch_that_ends_where_there_is_no_image_says_why():
    def some(a):
        return Plane(a, "henon", last=0.5)

    made = continue_branch(some, "p", nsmaps.periodic_orbit(some(0.2), [0.2, 0.2]), 0.2, (0, 1), direction="up")
    assert made.ended == "border collision"
    assert [event.kind for event in made.events] == ["period doubling", "border collision"]
    assert made.events[-1].detail == "beyond it there is no image: B escaped"
    assert abs(made.events[-1].value - 0.5) < made.events[-1].precision < 1e-7


def test_an_event_that_is_passed_but_not_located_is_told():
    """The doubling at 0.3675 lies where there is no map; steps pass over the gap."""

    def gap(a):
        if 0.3670 < a < 0.3680:
            raise ValueError("no map here")
        return Plane(a, "henon")

    made = continue_branch(gap, "p", nsmaps.periodic_orbit(gap(0.2), [0.2, 0.2]), 0.2, (0, 1), direction="up")
    (event,) = made.of_kind("period doubling")
    assert "not located" in event.detail
    assert abs(event.value - 0.3675) < event.precision < 0.03


def test_branches_can_be_left_and_wrong_calls_are_errors(pair):
    system = pair(0.35)
    fixed = nsmaps.periodic_orbit(system, [0.8, 0.4])
    made = continue_branch(system, "d", fixed, 0.35, (0.2, 0.4), direction="down", until=("period doubling",))
    assert made.ended == "period doubling"
    assert len(continue_branch(system, "d", fixed, 0.35, (0.2, 0.4), max_points=3).orbits) == 3
    with pytest.raises(NsmapsError, match=message("dynamics.value-outside", value=0.5, low=0.2, high=0.4)):
        continue_branch(system, "d", fixed, 0.5, (0.2, 0.4))
    with pytest.raises(NsmapsError, match=message("dynamics.orbits", step=0)):
        continue_branch(system, "d", fixed, 0.35, (0.2, 0.4), step=0)


@pytest.mark.parametrize("name", ["d", "r", "g_bar"])
def test_sensitivity_is_that_of_differences(pair, name):
    system, h = pair(0.35), 1e-4
    states = np.random.default_rng(0).uniform([0.05, 0], [1, 2 * pi], (500, 2))
    ends = [system.at(**{name: system.parameters[name] + k}).first_return(states) for k in (h, -h, h / 2, -h / 2)]
    wide, narrow = (ends[0].lifted - ends[1].lifted) / (2 * h), (ends[2].lifted - ends[3].lifted) / h
    smooth = np.all([end.codes == ends[0].codes for end in ends], axis=0) & (np.abs(wide - narrow).max(axis=1) < 1e-4)
    assert smooth.sum() > 450
    assert np.allclose(system.sensitivity(states, {name: 1.0})[smooth], ((4 * narrow - wide) / 3)[smooth], atol=1e-8)


def test_sensitivity_adds_up_and_knows_its_limits(pair):
    system = pair(0.35)
    both = system.sensitivity([[0.8, 0.4]], {"d": 2.0, "r": -1.0})
    parts = [system.sensitivity([[0.8, 0.4]], {name: 1.0}) for name in ("d", "r")]
    assert np.allclose(both, 2 * parts[0] - parts[1], atol=1e-10)
    assert not system.sensitivity([[0.8, 0.4]], {}).any()
    assert np.isnan(system.sensitivity([[np.nan, 0.4]], {"d": 1.0})).all()


@pytest.mark.thorough
def test_a_follower_detaches_from_its_cam():
    """Where the least force of the contact over a turn is zero: F = 0 and F' = 0, in 30 digits."""

    def force(w):
        a, b, k, c = mp.mpf("0.03"), mp.mpf("0.004"), 80, mp.mpf("0.7")

        def at(x):
            y, v = a * mp.cos(x) + b * mp.cos(2 * x), -a * mp.sin(x) - 2 * b * mp.sin(2 * x)
            return 35 + k * y + c * w * v - w**2 * (a * mp.cos(x) + 4 * b * mp.cos(2 * x))

        return at

    with mp.workdps(30):
        _, w = mp.findroot(lambda x, w: [force(w)(x), mp.diff(force(w), x)], [0.0, 29.0])
        assert min(force(w)(2 * mp.pi * j / 500) for j in range(500)) > -1e-6
    locked = CompleteChatter(Cam(w=1.02 * float(w), r=0.3, k=80, c=0.7, preload=35, a=0.03, b=0.004))
    start = nsmaps.periodic_orbit(locked, nsmaps.orbit(locked, [0.1, 2.0], 100).final)
    assert start.words == ("B~B",)
    branch = continue_branch(
        lambda w: locked.at(w=w), "w", start, 1.02 * float(w), (0.5 * float(w), 1.5 * float(w)), direction="down", step=0.1
    )
    event = only(branch, "detachment")
    assert branch.ended == "detachment"
    assert abs(event.value - float(w)) < 1e-12 * float(w)


class Wheel(HybridSystem):
    """A rimless wheel of linear flights down a slope, and an energy loss by c at each step."""

    slope: float
    c: float = 0.6
    k: float = 4.0

    states = ("x", "w")

    def modes(self, t, y):
        return {"leg": {"x": y.w, "w": self.k * y.x}}

    def guards(self, t, y):
        half = sp.Rational(3, 10)
        on = Guard("leg", self.slope + half - y.x, reset={"x": self.slope - half, "w": self.c * y.w})
        back = Guard("leg", y.x - self.slope + half, reset={"x": self.slope + half, "w": self.c * y.w})
        return {"F": on, "B": back}

    def section(self, t, y):
        return PoincareSection("F", ("w",))


def test_a_wheel_that_no_longer_passes_its_summit_is_a_homoclinic_orbit():
    """It starts a step with c w at slope - 0.3 and all but stands at 0: c w = 2 (0.3 - slope), and w^2 = 4 (0.3 + slope)^2."""
    slope = 0.3 * (1 - 0.6) / (1 + 0.6)
    system = Wheel(slope=1.5 * slope)
    start = nsmaps.periodic_orbit(system, [1.0])
    branch = continue_branch(system, "slope", start, system.slope, (0.01, 0.2), direction="down", step=0.1)
    event = only(branch, "homoclinic bifurcation")
    assert branch.ended == "homoclinic bifurcation"
    assert abs(event.value - slope) < event.precision


@pytest.mark.thorough
@pytest.mark.parametrize("zeta", [0.05, 0.02])
def test_an_oscillator_in_resonance_that_leaves_both_its_walls_at_once_is_a_graze(zeta: float):
    """x'' + 2 zeta x' + x = cos t has the amplitude 1/(2 zeta); impacts between the returns graze together with these."""
    amplitude = 1 / (2 * zeta)
    system = Oscillator(zeta=zeta, w=1.0, gap=amplitude / 8, r=0.7)
    start = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [3.0, 1.0], 400).final)
    branch = continue_branch(system, "gap", start, system.gap, (amplitude / 20, 2 * amplitude))
    (event,) = branch.of_kind("grazing")
    assert branch.ended == "grazing"
    assert abs(event.value - amplitude) < event.precision < 1e-6


def test_a_branch_next_to_a_graze_keeps_its_periods():
    """A cycle of two periods has the same word there; by Liouville's formula all have the determinant exp(-2 xi T)."""
    xi, w = 0.08, 0.8
    system = nsmaps.load_system("soft_impact", xi=xi, e=1, a=0.9, beta=29, w=w)
    branch = continue_branch(system, "a", nsmaps.periodic_orbit(system, [0.1, 0.5]), 0.9, (0.05, 3), direction="down")
    assert len(branch.orbits) > 30
    assert np.abs(np.prod(branch.multipliers, axis=1) / np.exp(-4 * pi * xi / w) - 1).max() < 1e-3  # 1e-4 at the graze
    doublings = [event.value for event in branch.of_kind("period doubling")]
    assert np.allclose(doublings, [0.890410935978, 0.597650896313], rtol=0, atol=1e-11)  # DOP853 with variational equations
    touching = sqrt((1 - w**2) ** 2 + (2 * xi * w) ** 2) / w**2  # the amplitude without a stop is e
    assert abs(only(branch, "grazing").value - touching) < 1e-8
