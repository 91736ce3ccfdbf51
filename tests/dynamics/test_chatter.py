"""Complete chatter as one event, against impacts summed in 50 digits; where it ends; and the cascade beyond."""

import mpmath as mp
import numpy as np
import pytest
from chattering import after_release, slopes_to_rest, sums_to_rest, until_rest
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_impact_oscillator import ImpactOscillator
from systems import DraggedBall

import nsmaps
from nsmaps import continue_branch
from nsmaps.dynamics import CompleteChatter, chatter_cascade, chatter_scaling
from nsmaps.errors import NsmapsError

GAMMA, R = 1.3, 0.5
ENDS = "end of complete chatter"
BALL = CompleteChatter(BouncingBall(Gamma=GAMMA, r=R))


def test_the_image_is_the_flight_from_the_release_after_the_summed_impacts():
    states = [[1.0, 2.0], [0.3, 3.5], [3.0, 5.0]]
    made = BALL.first_return(states, derivative=True)
    assert made.words.tolist() == ["B~B"] * 3
    assert (made.derivative == 0).all()
    v, phase = after_release(GAMMA)
    assert np.abs(made.image - [float(v), float(phase)]).max() < 1e-13
    rests = BALL.rests(states)
    for rest, (speed, start) in zip(rests[:2], states, strict=False):
        accumulated = until_rest(GAMMA, R, speed, start)
        assert rest == pytest.approx(float((mp.asin(1 / mp.mpf(GAMMA)) - accumulated) % (2 * mp.pi)), abs=1e-4)
    assert made.time == pytest.approx(made.lifted[:, 1] - np.array(states)[:, 1], abs=1e-12)


def test_the_derivative_by_a_parameter_is_that_of_release_and_flight():
    with mp.workdps(60):
        h = mp.mpf(10) ** -15
        ends = [after_release(GAMMA + sign * h) for sign in (-1, 1)]
        exact = [float((b - a) / (2 * h)) for a, b in zip(*ends, strict=True)]
    found = BALL.sensitivity([[1.0, 2.0], [0.3, 3.5]], {"Gamma": 1.0})
    assert np.abs(found - exact).max() < 1e-12
    assert (BALL.sensitivity([[1.0, 2.0]], {"r": 1.0}) == 0).all()


def test_means_of_observables_sum_the_impacts_without_number():
    cycle, impacts = nsmaps.periodic_orbit(BALL, [1.0, 2.0]), []
    until_rest(GAMMA, R, *after_release(GAMMA), impacts)
    with mp.workdps(60):
        loss = float(sum((1 - mp.mpf(R) ** 2) * v**2 / 2 for v, _ in impacts))
        wave = float(sum(v * mp.cos(phase) for v, phase in impacts))
    chosen = ["loss", {"name": "wave", "formula": "v*cos(phi)"}, {"name": "hardest", "formula": "v", "largest": True}, "impacts"]
    found = nsmaps.observe(BALL, cycle, chosen)
    expected = [loss, wave, float(impacts[0][0]), np.inf]
    for means in (found.per_return, found.per_period):
        assert means.value == pytest.approx(expected, rel=1e-12)
    assert found.per_time.value[:2] == pytest.approx(np.array([loss, wave]) / (2 * np.pi), rel=1e-12)


SUMMED = [
    "loss",
    {"name": "wave", "formula": "v*cos(phi)"},
    {"name": "gap", "formula": "place + Gamma*sin(phi)**2", "of": "flights"},
]


@pytest.mark.parametrize(("name", "by"), [("Gamma", (1, 0)), ("r", (0, 1))])
def test_derivatives_of_means_are_those_of_the_summed_impacts(name, by):
    cycle = nsmaps.periodic_orbit(BALL, [1.0, 2.0])
    found = nsmaps.observe(BALL, cycle, SUMMED, rates={name: 1.0})
    value, slope = sums_to_rest(GAMMA, R).astype(float), slopes_to_rest(GAMMA, R, by)
    held = np.array([0, 0, np.pi])  # what the second part of the last formula adds, in flight and rest
    assert found.per_period.value[:3] == pytest.approx(value + GAMMA * held, rel=1e-12)
    assert found.per_period.derivative[:3] == pytest.approx(slope + by[0] * held, rel=1e-11)
    assert found.per_time.derivative[:3] == pytest.approx((slope + by[0] * held) / (2 * np.pi), rel=1e-11)
    assert np.isnan(found.per_time.derivative[3:]).all()


@pytest.mark.parametrize("name", ["zeta", "w", "A", "wall", "r"])
def test_the_balance_of_energy_holds_in_the_derivatives_by_every_parameter(name):
    return_map = CompleteChatter(ImpactOscillator(zeta=0.05, w=0.7, A=1.65, wall=-0.5, r=0.6))
    cycle = nsmaps.periodic_orbit(return_map, nsmaps.orbit(return_map, [0.2, 0.1], 30).states[-1])
    work, loss, damping = nsmaps.observe(return_map, cycle, ["work", "loss", "damping"], rates={name: 1.0}).per_time.derivative
    assert min(abs(work), abs(loss), abs(damping)) > 0.01
    assert work == pytest.approx(loss + damping, abs=1e-12 * max(abs(loss), abs(damping)))


@pytest.mark.thorough
def test_the_work_of_the_forcing_is_the_loss_along_a_branch_with_complete_chatter():
    oscillator = ImpactOscillator(zeta=0.05, w=0.7, A=1.65, wall=-0.5, r=0.6)
    for name, system, losses in (("A", oscillator, ["loss", "damping"]), ("Gamma", BALL.system, ["loss"])):
        return_map, map_of, value = CompleteChatter(system), chattering(system, name), getattr(system, name)
        cycle = nsmaps.periodic_orbit(return_map, nsmaps.orbit(return_map, [0.2, 0.1], 30).states[-1])
        branch = continue_branch(map_of, "p", cycle, value, (0.98 * value, 1.02 * value))
        means = nsmaps.observe(map_of, branch, ["work", *losses]).per_period
        for work, *lost in (means.value.T, means.derivative.T):
            assert len(work) > 1
            assert (work > 0).all()
            assert work == pytest.approx(sum(lost), rel=1e-12)


def chattering(system, name):
    """The map with complete chatter at values of a parameter."""
    return lambda value: CompleteChatter(system).at(**{name: value})


def test_states_that_do_not_chatter_return_as_in_the_system(pair):
    system = pair(0.35)
    states = np.random.default_rng(0).uniform([0, 0], [2, 6.28], (300, 2))
    made, single = CompleteChatter(system).first_return(states, derivative=True), system.first_return(states, derivative=True)
    chatter = np.char.find(made.words, "B~") == 0
    assert 0 < chatter.sum() < 300
    assert np.array_equal(made.image[~chatter], single.image[~chatter])
    assert np.array_equal(made.derivative[~chatter], single.derivative[~chatter])
    assert set(made.words[chatter]) == {"B~TB"}
    release = system.first_return([[0.0, np.arccos(-system.g_bar)]])
    assert np.abs(made.image[chatter] - release.image).max() < 1e-12


def test_the_branch_ends_where_impacts_accumulate_at_the_release():
    orbit = nsmaps.periodic_orbit(BALL, [1.0, 2.0])
    branch = continue_branch(lambda gamma: BALL.at(Gamma=gamma), "Gamma", orbit, GAMMA, (1.0, 2.0))
    assert branch.ended == ENDS
    assert set(branch.words.ravel()) == {"B~B"}
    assert (branch.multipliers == 0).all()
    (end,) = branch.events
    assert end.precision < 2e-9
    for step, complete in ((-end.precision, True), (end.precision, False)):
        gamma = mp.mpf(end.value) + step
        v, phase = after_release(gamma)
        assert (until_rest(gamma, R, v, phase) is not None) == complete


@pytest.mark.parametrize("k", [1, 2])
def test_the_inelastic_ball_lands_at_its_release(k):
    """A flight from the release, Gamma sin = 1, lasts k periods if Gamma cos = pi k."""
    border = np.sqrt(1 + (np.pi * k) ** 2)
    ball = CompleteChatter(BouncingBall(Gamma=border - 0.1, r=0))
    orbit = nsmaps.periodic_orbit(ball, [1.0, 1.0])
    assert orbit.words == ("B_B",)
    branch = continue_branch(lambda gamma: ball.at(Gamma=gamma), "Gamma", orbit, border - 0.1, (border - 0.5, border + 0.5))
    (end,) = branch.events
    assert end.kind == ENDS
    assert abs(end.value - border) < 2 * end.precision < 1e-11


@pytest.mark.thorough
def test_a_ball_that_does_not_rebound_is_followed_by_single_returns_to_either_end_of_its_rest():
    """In air of drag k: released where a (sin - k cos) = 1, if a sqrt(1 + k^2) > 1; a flight of a period leaves no rest."""
    k = 0.3
    system = DraggedBall(a=1.8, r=0.0, drag=k)
    start = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [1.0, 1.0], 20).final, 2)
    assert sorted(start.words) == ["BB", "B_"]
    branches = [continue_branch(system, "a", start, 1.8, (0.5, 9.0), direction=way, step=0.3) for way in ("up", "down")]
    (above,), (below,) = (branch.events for branch in branches)
    assert max(len(branch.orbits) for branch in branches) < 60
    assert (above.kind, below.kind) == (ENDS, "detachment")
    assert abs(below.value - 1 / np.hypot(1, k)) < 1e-11
    curve = nsmaps.bifurcation_curve(system, below, {"a": (0.5, 3.0), "drag": (0.1, 1.0)}, k, step=0.2)
    a, drag = curve.parameters.T
    assert (drag[0], drag[-1]) == (0.1, 1.0)
    assert np.abs(a * np.hypot(1, drag) - 1).max() < 1e-12
    assert (curve.words, np.isfinite(curve.points).all(axis=(1, 2)).sum() > 2) == (start.words, True)

    def landing(a):
        phase, s = mp.asin(1 / (a * mp.sqrt(1 + k**2))) + mp.atan(k), 2 * mp.pi
        return (a * mp.cos(phase) + 1 / mp.mpf(k)) * (1 - mp.exp(-k * s)) / k - s / k

    assert abs(above.value - float(mp.findroot(landing, above.value))) < 2 * above.precision < 1e-11


@pytest.mark.thorough
def test_a_ball_that_rests_once_in_three_returns_is_followed_to_either_end_of_its_rest():
    """Two flights from the release take two periods, with no rest; or the first one meets the table with speed zero."""
    k = 0.1
    system = DraggedBall(a=4.9, r=0.0, drag=k)
    start = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [1.0, 1.0], 60).final, 3)
    assert sorted(start.words) == ["BB", "BB", "B_"]
    branches = [continue_branch(system, "a", start, 4.9, (4.0, 6.0), direction=way, step=0.1) for way in ("up", "down")]
    (above,), (below,) = (branch.events for branch in branches)
    assert max(len(branch.orbits) for branch in branches) < 40
    assert (above.kind, below.kind) == ("grazing", ENDS)

    def released(a):
        return mp.asin(1 / (a * mp.sqrt(1 + k**2))) + mp.atan(k)

    def height(a, phase, s):
        return (a * mp.cos(phase) + 1 / k) * (1 - mp.exp(-k * s)) / k - s / k - a * (mp.sin(phase + s) - mp.sin(phase))

    def landings(a, s):
        return height(a, released(a), s), height(a, released(a) + s, 4 * mp.pi - s)

    def graze(a, s):
        return height(a, released(a), s), mp.diff(lambda t: height(a, released(a), t), s)

    for event, equations in ((below, landings), (above, graze)):
        time = event.orbit.returns.time[[word == "BB" for word in event.orbit.words]][0]
        exact = mp.findroot(equations, (event.value, time))[0]
        assert abs(event.value - float(exact)) < 2 * event.precision < 1e-8


@pytest.mark.parametrize("value", [6.7, 6.9])
def test_a_graze_is_found_though_rounding_lets_the_release_dip(value):
    """The second flight from the release of a cycle of three returns comes to touch the table on its way."""
    system = BouncingBall(Gamma=6.9, r=0.0)
    start = nsmaps.periodic_orbit(system.at(Gamma=value), nsmaps.orbit(system.at(Gamma=value), [4.19, 0.63], 60).final, 3)
    (event,) = continue_branch(system, "Gamma", start, value, (value - 1, value + 1), step=0.05).events
    assert (event.kind, event.detail) == ("grazing", "a clearance is zero")

    def height(a, phase, s):
        return a * mp.sin(phase) + a * mp.cos(phase) * s - s**2 / 2 - a * mp.sin(phase + s)

    def touching(a, first, s):
        released = mp.asin(1 / a)
        there = released + first
        return height(a, released, first), height(a, there, s), mp.diff(lambda t: height(a, there, t), s)

    exact = mp.findroot(touching, (7.184, 13.4597, 7.328))[0]
    assert abs(event.value - float(exact)) < event.precision < 1e-8


def test_where_another_impact_is_the_last_before_the_sum_no_border_of_the_motion_is_stated():
    system = BouncingBall(Gamma=1.3, r=0.1)
    passed = nsmaps.orbit(system, [1.0, 1.0], 60)
    period = int(np.flatnonzero(np.char.endswith(passed.words, "~"))[-2:] @ [-1, 1])
    start = nsmaps.periodic_orbit(system, passed.final, period)
    assert start.converged
    branch = continue_branch(system, "Gamma", start, 1.3, (1.0, 2.0), step=0.1)
    assert "where the number of impacts before chatter is summed changes; expected: complete chatter" in branch.ended
    assert branch.events == ()


@pytest.mark.parametrize("r", [0.2, 0.5, 0.9])
def test_the_scaling_is_that_of_a_force_that_vanishes_in_time(r):
    """x'' = t: impacts from u = k t^2 on are at the times s t, s^2 t, ..., and others leave them by the ratio of parameters."""
    scaling = chatter_scaling(r)
    with mp.workdps(40):

        def onward(u, t):
            s = 3 * (-t / 2 - mp.sqrt(t**2 / 4 - 2 * u / 3))
            return r * -(u + t * s + s**2 / 2), t + s

        s = mp.mpf(scaling.time)
        k, h = (1 - s) * (2 + s) / 6, mp.mpf(10) ** -10
        u, t = onward(k, mp.mpf(-1))
        assert -t == pytest.approx(scaling.time, abs=1e-14)
        assert u / t**2 == pytest.approx(float(k), abs=1e-14)
        beside = [u / t**2 for u, t in (onward(k + sign * h, mp.mpf(-1)) for sign in (-1, 1))]
        assert float((beside[1] - beside[0]) / (2 * h)) == pytest.approx(scaling.parameter, rel=1e-12)
    assert scaling.parameter ** (-scaling.exponent / 2) == pytest.approx(scaling.time)


def measured(return_map, name, orbit, value, bounds, reach, orbits):
    """The ratio of the distances of successive grazes from the border orbit, extrapolated by the next power in the theory."""
    branch = continue_branch(lambda x: return_map.at(**{name: x}), "x", orbit, value, bounds)
    end = branch.events[-1]
    assert end.kind == ENDS
    found = chatter_cascade(return_map, name, end, (bounds[0], end.value + reach), orbits)
    numbers = [each.impacts for each in found]
    assert numbers == list(range(numbers[0], numbers[0] + orbits))
    assert all(each.near.ended == "grazing" for each in found)
    distances = np.array([each.near.events[-1].value - end.value for each in found])
    scaling, ratios = chatter_scaling(return_map.parameters["r"]), distances[:-1] / distances[1:]
    part = scaling.parameter ** (1 - scaling.exponent)
    assert abs(ratios[-1] / scaling.parameter - 1) < 0.02
    return (ratios[-1] - part * ratios[-2]) / (1 - part), scaling.parameter


@pytest.mark.thorough
def test_orbits_of_the_ball_with_incomplete_chatter_accumulate_by_the_ratio_of_the_theory():
    orbit = nsmaps.periodic_orbit(BALL, [1.0, 2.0])
    ratio, expected = measured(BALL, "Gamma", orbit, GAMMA, (1.0, 2.0), 2e-6, 3)
    assert ratio == pytest.approx(expected, rel=3e-3)


@pytest.mark.thorough
def test_orbits_of_the_oscillator_with_incomplete_chatter_accumulate_so_too():
    return_map = CompleteChatter(ImpactOscillator(zeta=0.05, w=0.7, A=1.65, wall=-0.5, r=0.6))
    orbit = nsmaps.periodic_orbit(return_map, nsmaps.orbit(return_map, [0.2, 0.1], 30).states[-1])
    ratio, expected = measured(return_map, "A", orbit, 1.65, (1.6, 1.7), 1.2e-5, 3)
    assert ratio == pytest.approx(expected, rel=1e-3)


def test_what_has_no_chatter_or_no_cascade_is_refused():
    with pytest.raises(NsmapsError, match=message("dynamics.no-rests", system="BuckConverter")):
        CompleteChatter(nsmaps.load_system("buck_converter", E=12.0))
    with pytest.raises(NsmapsError, match=message("dynamics.restitution", value=1)):
        chatter_scaling(1.0)
    orbit = nsmaps.periodic_orbit(BALL, [1.0, 2.0])
    event = nsmaps.dynamics.BifurcationPoint("fold", GAMMA, 1e-9, orbit)
    with pytest.raises(NsmapsError, match=message("dynamics.cascade", number=3, event="fold")):
        chatter_cascade(BALL, "Gamma", event, (1.0, 2.0), 3)
    with pytest.raises(NsmapsError, match=message("dynamics.rest-on-orbit", word="B~B")):
        nsmaps.observe(BALL.system, orbit, ["loss"])
    with pytest.raises(NsmapsError, match=message("dynamics.no-impact-follows", time=6.28319)):
        nsmaps.observe(BALL.at(Gamma=1.5), orbit, ["loss"])
    lost = BALL.first_return([[np.nan, 1.0], [1.0, 2.0]])
    assert lost.counts() == {"returned": 1, "invalid": 1}
