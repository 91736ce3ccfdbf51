"""The bouncing ball against closed forms of its literature, 40-digit flights of ball and table apart, and an ODE solver."""

import mpmath as mp
import numpy as np
import pytest
from nsmaps_bouncing_ball import BouncingBall
from scipy.integrate import solve_ivp

import nsmaps
from nsmaps.coordinates import TWO_PI
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.exact.outcome import Outcome

EXISTS = np.pi * 0.5 / 1.5  # 1.0471975512
DOUBLES = np.sqrt(EXISTS**2 + (2 * 1.25 / 1.5**2) ** 2)  # 1.5268237005


def one_period(gamma, r=0.5):
    """The stable orbit of one impact a period in closed form."""
    return np.array([TWO_PI / (1 + r), np.arccos(np.pi * (1 - r) / (gamma * (1 + r)))])


def next_impact(gamma, r, v, phi):
    """The next impact (v, t) by the ball's height over the ground and the table's, scanned and bisected in 40 digits."""
    gamma, v, t0 = mp.mpf(gamma), mp.mpf(v), mp.mpf(phi)
    up = r * v + gamma * mp.cos(t0)

    def gap(s):
        return up * s - s**2 / 2 + gamma * mp.sin(t0) - gamma * mp.sin(t0 + s)

    ticks = np.linspace(0, 2 * float(up) + 2 * np.sqrt(float(up) ** 2 + 4 * float(gamma)) + 1, 4000)[1:]
    rough = float(up) * ticks - ticks**2 / 2 + float(gamma) * (np.sin(float(t0)) - np.sin(float(t0) + ticks))
    below = int(np.argmax(rough < 0))
    s = mp.findroot(gap, (ticks[below - 1], ticks[below]), solver="anderson", tol=1e-60)
    return gamma * mp.cos(t0 + s) - up + s, t0 + s


def test_first_returns_are_those_of_ball_and_table_apart():
    rng = np.random.default_rng(3)
    states = np.column_stack([rng.uniform(1, 9, 40), rng.uniform(0, TWO_PI, 40)])
    returns = BouncingBall(Gamma=1.7, r=0.6).first_return(states)
    with mp.workdps(40):
        for (v, phi), image, turns in zip(states, returns.image, returns.turns, strict=True):
            speed, t = next_impact(1.7, mp.mpf(0.6), v, phi)
            assert abs(image[0] - speed) < 1e-12
            assert abs(image[1] + TWO_PI * turns[1] - t) < 1e-12


def test_first_returns_are_those_of_an_ode_solver():
    ball = BouncingBall(Gamma=1.3)

    def touches(t, x):
        return x[0] - 1.3 * np.sin(t)

    touches.terminal, touches.direction = True, -1
    for v, phi in [(4.0, 0.5), (2.0, 2.0), (6.0, 5.0)]:
        start = [1.3 * np.sin(phi) + 1e-13, 0.5 * v + 1.3 * np.cos(phi)]
        flown = solve_ivp(lambda t, x: [x[1], -1], (phi, phi + 60), start, events=touches, rtol=1e-12, atol=1e-13, max_step=0.02)
        t, (_, velocity) = flown.t_events[0][0], flown.y_events[0][0]
        image = ball.first_return([[v, phi]]).lifted[0]
        assert image == pytest.approx([1.3 * np.cos(t) - velocity, t], abs=1e-9)


@pytest.mark.parametrize("above", [1e-6, 1e-3, 0.1])
def test_one_impact_a_period_is_there_from_its_threshold_on(above):
    assert pytest.approx(1.0471975512, abs=1e-10) == EXISTS
    gamma = EXISTS + above
    orbit = nsmaps.periodic_orbit(BouncingBall(Gamma=gamma), one_period(gamma) + np.array([0, 1e-4]))
    assert orbit.converged
    assert orbit.exists
    assert orbit.states[0] == pytest.approx(one_period(gamma), abs=1e-9)
    assert (orbit.label, orbit.stable) == ("1:0/T", True)
    assert np.prod(orbit.multipliers).real == pytest.approx(0.25, abs=1e-12)


def test_below_its_threshold_no_start_finds_it():
    ball = BouncingBall(Gamma=EXISTS - 1e-3)
    for phase in np.linspace(0, TWO_PI, 24, endpoint=False):
        orbit = nsmaps.periodic_orbit(ball, [TWO_PI / 1.5, phase])
        assert not (orbit.converged and orbit.exists and orbit.label == "1:0/T")


def test_it_ends_in_a_fold():
    """Followed down it turns back at the threshold, where a multiplier is one."""
    value = EXISTS + 0.1
    start = nsmaps.periodic_orbit(BouncingBall(Gamma=value), one_period(value))
    branch = continue_branch(
        lambda gamma: BouncingBall(Gamma=gamma), "gamma", start, value, (EXISTS - 0.1, value), direction="down"
    )
    (fold,) = branch.of_kind("fold")
    assert fold.value == pytest.approx(EXISTS, abs=1e-12)
    assert fold.multipliers[0] == pytest.approx(1, abs=1e-6)
    assert branch.values.min() > EXISTS - 1e-12


def test_it_doubles_its_period_where_the_closed_form_says():
    assert pytest.approx(1.5268237005, abs=1e-10) == DOUBLES
    start = nsmaps.periodic_orbit(BouncingBall(Gamma=1.5), one_period(1.5))
    (found,) = continue_branch(lambda gamma: BouncingBall(Gamma=gamma), "gamma", start, 1.5, (1.5, 1.55)).of_kind(
        "period doubling"
    )
    assert found.value == pytest.approx(DOUBLES, abs=1e-9)
    assert sorted(found.orbit.multipliers.real) == pytest.approx([-1, -0.25], abs=1e-8)


def test_beyond_it_the_attractor_has_two_impacts():
    made = nsmaps.bifurcation_diagram(
        lambda gamma: BouncingBall(Gamma=gamma), "gamma", [1.51, 1.54], one_period(1.5), transient=4000
    )
    assert made.labels[:, 0].tolist() == ["1:0/T", "1:0/2T"]


def test_chatter_accumulates_where_the_series_says_and_is_released():
    """Impacts followed one by one in 60 digits until they are 1e-15 apart; what is left is a geometric series."""
    gamma, v, phi = 1.2, 0.05, 3.0
    ball = BouncingBall(Gamma=gamma)
    orbit = nsmaps.orbit(ball, [v, phi], 60, chatter=np.inf)
    end = orbit.words.tolist().index("B~")
    assert orbit.states[end + 1] == pytest.approx([0, np.arcsin(1 / gamma)], abs=1e-14)
    with mp.workdps(60):
        speed, t = mp.mpf(v), mp.mpf(phi)
        for k in range(40):
            press = 1 - mp.mpf(gamma) * mp.sin(t)
            if k == end:
                summed = t + 2 * speed / press * mp.mpf(0.5) / (1 - mp.mpf(0.5))
            guess = speed / press  # 2 r v / press, with r = 1/2
            up = speed / 2 + gamma * mp.cos(t)
            s = mp.findroot(
                lambda s, t=t, up=up: up - s / 2 - gamma * (mp.sin(t + s) - mp.sin(t)) / s, guess, tol=1e-50, verify=False
            )
            speed, t = gamma * mp.cos(t + s) - up + s, t + s
        left = 2 * speed / (1 - gamma * mp.sin(t))
        assert speed < 1e-13
        assert abs(summed - (t + left)) < 1e-4
        assert mp.sin(t) < 1 / mp.mpf(gamma)  # it rests while the table's acceleration presses it on
        assert abs(orbit.states[end, 1] - float(t)) < 1e-2


def test_rest_is_for_ever_where_the_table_never_throws():
    assert BouncingBall(Gamma=0.9).first_return([[0.0, 1.0]]).outcome[0] == Outcome.rests
    released = BouncingBall(Gamma=1.1).first_return([[0.0, 3.0]])
    assert released.words.tolist() == ["B_"]
    assert released.image[0] == pytest.approx([0, np.arcsin(1 / 1.1)], abs=1e-14)


def test_locking_is_everyday():
    """At Gamma = 2 every orbit sticks again and again: the attractor passes through the release."""
    rng = np.random.default_rng(0)
    starts = np.column_stack([rng.uniform(0, 8, 200), rng.uniform(0, TWO_PI, 200)])
    orbit = nsmaps.orbit(BouncingBall(Gamma=2), starts, 400, chatter=np.inf)
    tail = orbit.states[-100:]
    assert (tail[:, :, 0] == 0).any(axis=0).all()
    at_rest = tail[tail[:, :, 0] == 0]
    assert at_rest[:, 1] == pytest.approx(np.full(len(at_rest), np.pi / 6), abs=1e-12)
