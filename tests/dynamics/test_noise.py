"""Noise against closed forms of 30 digits, Euler's method, the deterministic limit, and finer steps of the same path."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache

import mpmath as mp
import numpy as np
import pytest
from messages import message
from systems import BouncingBall, Oscillator, Table

import nsmaps
from nsmaps.dynamics.noise import orbits
from nsmaps.dynamics.noise.impacts import impact_diagram
from nsmaps.dynamics.noise.orbits import Noise, exact_step, linear_law, noisy_orbits
from nsmaps.dynamics.noise.residence import residence
from nsmaps.errors import NsmapsError, StateError, SystemDefinitionError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall

QUIET = Noise(sigma=0, tau=1)


@pytest.mark.parametrize("h", [1e-4, 1e-2, 0.3])
@mp.workdps(30)
def test_a_free_step_has_the_covariance_of_the_closed_form(h):
    """n = int (h - s) eta(s) ds: its moments as double integrals of exp(-|s - t|/tau), to 30 digits."""
    sigma, tau = 0.05, mp.mpf("0.4")
    transition, root = exact_step(0.0, 0.0, Noise(sigma=sigma, tau=0.4), h)

    @cache
    def through(power, u):
        """What an increment at u does by h."""
        x = mp.mpf(h) - u
        if power is None:
            return mp.exp(-x / tau)
        return mp.quad(lambda s: (x - s) ** power * mp.exp(-s / tau), [0, x])

    def moment(a, b):
        """Of int (h-s)^a and int (h-t)^b against the Brownian increments that eta is made of."""
        return 2 * mp.mpf(sigma) ** 2 / tau * mp.quad(lambda u: through(a, u) * through(b, u), [0, h])

    covariance = root @ root.T
    for i, a in enumerate((1, 0, None)):
        for j, b in enumerate((1, 0, None)):
            if i <= j:
                assert covariance[i, j] == pytest.approx(float(moment(a, b)), rel=1e-9)
    x = h / mp.mpf("0.4")
    expected = [tau**2 * (mp.exp(-x) - 1 + x), tau * (1 - mp.exp(-x)), mp.exp(-x)]
    assert np.allclose(transition[:, 2], [float(value) for value in expected], rtol=1e-9, atol=0)


def test_steps_compose():
    """Two steps of a damped oscillator are one of twice the length, in transition and covariance."""
    noise = Noise(sigma=0.3, tau=0.7)
    once, twice = exact_step(2.0, 0.3, noise, 0.1), exact_step(2.0, 0.3, noise, 0.2)
    assert np.allclose(once[0] @ once[0], twice[0], rtol=1e-12)
    square = once[1] @ once[1].T
    assert np.allclose(once[0] @ square @ once[0].T + square, twice[1] @ twice[1].T, rtol=1e-10)


@pytest.mark.parametrize(
    ("system", "law"),
    [
        (Oscillator(zeta=0.1, w=2.0, gap=0.5), (1.0, 0.2)),
        (Oscillator(zeta=1.7, w=2.0, gap=0.5, damping="over"), (1.0, 3.4)),
        (BouncingBall(a=0.3), (0.0, 0.0)),
        (Table(height=1.0), (0.0, 0.0)),
    ],
)
def test_the_law_of_a_flight_is_found(system, law):
    assert np.allclose(linear_law(system), law, atol=1e-9)


class Bent(ImpactSystem):
    """Parabolas z'' = g with g = w^2/2/(1 + z), which stays the same along each: flights that no linear law governs."""

    r: float = 0.5

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 1

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + hit.w * s + hit.w**2 / (4 * (1 + hit.z)) * s**2


def test_flights_without_a_linear_law_are_refused():
    with pytest.raises(SystemDefinitionError, match=message("exact.not-linear-in-hit", formula="hit.w**2")):
        noisy_orbits(Bent(), [0.1, 0.1], QUIET, n_returns=3)


def test_the_deterministic_limit_is_the_exact_map(pair):
    starts = np.random.default_rng(0).uniform([0.01, 0], [1.5, 2 * np.pi], (60, 2))
    for system in (pair(0.35), pair(0.2275, r=0.25, beta=np.pi / 6), Oscillator(zeta=0.1, w=2.0, gap=0.2), BouncingBall(a=1.5)):
        made = noisy_orbits(system, starts, QUIET, n_returns=20, n_realisations=60)
        exact = nsmaps.orbit(system, starts, 20, chatter=1e-6)
        assert np.array_equal(made.words, exact.words)
        assert np.array_equal(made.outcome, exact.outcome)
        assert np.array_equal(made.turns, exact.turns)
        assert np.allclose(made.states[1:], exact.states[1:], atol=1e-8, equal_nan=True)
        time = system.first_return(starts, chatter=1e-6).time
        assert np.allclose(made.time[0], time, atol=1e-9, equal_nan=True)


@pytest.mark.thorough
def test_finer_steps_of_the_same_path_agree_to_order_three_halves(pair, monkeypatch):
    def at(parts):
        monkeypatch.setattr(orbits, "SUBSTEPS", parts)
        noise = Noise(sigma=0.05, tau=0.5)
        return noisy_orbits(pair(0.35), [0.833, 0.364], noise, n_returns=3, n_realisations=200, rng=1, step=0.1 / 64 * parts)

    fine = at(1)
    off = [np.sqrt(((at(parts).states[-1] - fine.states[-1]) ** 2).mean(axis=0)) for parts in (8, 64)]
    order = np.log(off[1] / off[0]) / np.log(8)
    assert np.all((order > 1.3) & (order < 1.8))
    assert off[0].max() < 1e-4


def test_the_forcing_along_an_orbit_has_its_law(pair):
    made = noisy_orbits(pair(0.35), [0.833, 0.364], Noise(sigma=0.1, tau=2.0), n_returns=4000, n_realisations=1, rng=3)
    eta = made.eta[:, 0]
    assert eta.std() == pytest.approx(0.1, rel=0.1)
    apart = eta - eta.mean()
    correlation = (apart[:-1] * apart[1:]).mean() / eta.var()
    assert correlation == pytest.approx(np.exp(-made.time.mean() / 2.0), abs=0.06)


def test_noise_spreads_a_return_as_eulers_method_has_it(pair):
    """The spread of a first return beside that of Euler's method with steps of 1e-3 and impacts at their ends."""
    system, sigma, tau, count, h = pair(0.35), 0.05, 0.5, 400, 1e-3
    made = noisy_orbits(system, [0.83338599, 0.36361156], Noise(sigma=sigma, tau=tau), n_returns=1, n_realisations=4000, rng=2)
    rng = np.random.default_rng(7)
    t, z = np.full(count, 0.36361156 / np.pi), np.full(count, 0.175)
    w, eta = np.full(count, -0.5 * 0.83338599), sigma * rng.standard_normal(count)
    back, speed, decay = np.zeros(count, bool), np.zeros(count), np.exp(-h / tau)
    while not back.all():
        force = np.cos(np.pi * (t + h / 2)) + system.g_bar + eta
        z, w, t = z + w * h + force * h * h / 2, w + force * h, t + h
        eta = decay * eta + sigma * np.sqrt(1 - decay**2) * rng.standard_normal(count)
        top, here = z < -0.175, (z > 0.175) & ~back
        w, z = np.where(top & (w < 0), -0.5 * w, w), np.where(top, -0.175, z)
        speed[here], back = w[here], back | here
    assert made.states[1, :, 0].mean() == pytest.approx(speed.mean(), abs=4 * speed.std() / 20 + 2e-3)
    assert made.states[1, :, 0].std() == pytest.approx(speed.std(), rel=0.15)


def test_realisations_depend_on_seed_and_number_alone(pair):
    noise, system = Noise(sigma=0.03, tau=0.5), pair(0.3)
    alone = noisy_orbits(system, [0.8, 0.4], noise, n_returns=30, n_realisations=3, rng=4)
    with ThreadPoolExecutor(2) as pool:
        pooled = noisy_orbits(system, [0.8, 0.4], noise, n_returns=30, n_realisations=20, rng=4, parallel=nsmaps.Parallel(pool))
    many = noisy_orbits(system, [0.8, 0.4], noise, n_returns=30, n_realisations=20, rng=4)
    other = noisy_orbits(system, [0.8, 0.4], noise, n_returns=30, n_realisations=3, rng=5)
    assert np.array_equal(alone.states, many.states[:, :3])
    assert np.array_equal(pooled.states, many.states)
    assert not np.isclose(other.states[1:], alone.states[1:]).any()
    assert len({*many.states[-1, :, 0].tolist()}) == 20


def test_processes_give_the_same_numbers(pair):
    noise = Noise(sigma=0.03, tau=0.5)
    here = noisy_orbits(pair(0.3), [0.8, 0.4], noise, n_returns=5, n_realisations=9, rng=4)
    with ProcessPoolExecutor(1) as pool:
        there = noisy_orbits(pair(0.3), [0.8, 0.4], noise, n_returns=5, n_realisations=9, rng=4, parallel=nsmaps.Parallel(pool))
    assert np.array_equal(here.states, there.states)


def test_chatter_rest_and_escape_under_noise_end(pair):
    made = noisy_orbits(pair(0.35), [0.2, 0.1], Noise(sigma=0.02, tau=0.5), n_returns=60, n_realisations=20, rng=1)
    assert made.held.all()
    assert (made.outcome == Outcome.stuck).any(axis=0).all()
    assert any(word in ("B~", "B_") for word in made.words.ravel())
    heavy = pair(0.35).at(g_bar=5.0)  # pressed on B for ever
    still = noisy_orbits(heavy, [0.1, 0.1], Noise(sigma=0.02, tau=0.5), n_returns=200, n_realisations=1, step=0.1)
    assert still.ended() == {"rests": 1}
    assert noisy_orbits(heavy, [0.1, 0.1], QUIET, n_returns=200, n_realisations=1).ended() == {"rests": 1}
    away = noisy_orbits(BouncingBall(a=0.1), [[1.0, 0.0], [np.nan, 0.0], [-1.0, 0.0]], QUIET, n_returns=3, n_realisations=3)
    assert away.outcome[-1].tolist()[1:] == [Outcome.invalid] * 2
    assert np.isnan(away.states[1:, 1:]).all()
    assert noisy_orbits(pair(0.3), np.empty((0, 2)), QUIET, n_returns=3, n_realisations=0).states.shape == (4, 0, 2)


def test_impacts_are_those_of_the_trajectory(pair):
    made = noisy_orbits(pair(0.3), [0.8, 0.4], QUIET, n_returns=10, n_realisations=1, max_impacts=12)
    exact = pair(0.3).impacts([0.8, 0.4], 13)
    assert np.array_equal(made.impacts[0, :, 0], exact.wall[1:])
    assert np.allclose(made.impacts[0, :, 1:], np.column_stack([exact.speed, exact.phase])[1:], atol=1e-9)
    assert np.isnan(
        noisy_orbits(pair(0.3), [0.8, 0.4], QUIET, n_returns=2, n_realisations=1, max_impacts=12).impacts[0, 4:]
    ).all()


def test_residence_of_a_telegraph_has_its_rates():
    """A chain that leaves one motion with probability 1/50 a return and the other with 1/20; returns of motion 2:1 take 1/2."""
    rng, now, rows = np.random.default_rng(0), np.zeros(40, int), []
    leave = np.array([0.02, 0.05])
    for k in range(4000):
        now = np.where(rng.random(40) < leave[now] * (k % 2 == 0), 1 - now, now)  # between whole periods
        rows.append(now)
    modes = np.array(rows)
    words = np.where(modes == 0, "BTB", np.where(np.arange(4000)[:, None] % 2 == 0, "BB", "BTB"))
    time = np.where(modes == 0, 1.0, 0.5)
    made = residence(words, time, {"1:1": ["BTB"], "2:1": ["BB", "BTB"]}, min_returns=2)
    assert made.switches[0, 1] == pytest.approx((modes[1:] > modes[:-1]).sum(), rel=0.1)
    assert made.rates[0, 1] == pytest.approx(0.01, rel=0.15)
    assert made.rates[1, 0] == pytest.approx(0.05, rel=0.15)
    assert made.mean[0] == pytest.approx(100, rel=0.15)
    assert made.share.sum() == pytest.approx(1)
    assert made.time.sum() + made.unknown == pytest.approx(time.sum())
    with pytest.raises(NsmapsError, match=message("dynamics.residence", number=1)):
        residence(words, time, {"2:1": ["BB", "BTB"]}, min_returns=1)


def test_noise_leads_to_two_to_one_beyond_the_window(pair):
    """As fig. comp_stoch: at d where only 1:1 lives on, noise makes 2:1 appear, and more of it the larger it is."""
    system, modes, shares = pair(0.24, r=0.25, beta=np.pi / 6), {"1:1": ["BTB"], "2:1": ["BB", "BTB"]}, []
    for sigma in (0.0, 0.0447):
        made = noisy_orbits(system, [0.68, 0.5], Noise(sigma=sigma, tau=0.5), n_returns=600, n_realisations=16, rng=1)
        shares.append(residence(made.words[100:], made.time[100:], modes, min_returns=4).share[1])
    assert shares[0] == 0
    assert shares[1] > 0.005


def test_impact_diagrams_follow_a_parameter(pair):
    base = pair(0.2275, r=0.25, beta=np.pi / 6)
    made = impact_diagram(base, "d", [0.21, 0.24, 0.225], [0.68, 0.5], QUIET, "down", n_returns=20, transient=300)
    assert made.values.tolist() == [0.24, 0.225, 0.21]
    assert [len(set(np.round(made.speed[k][made.wall[k] == 0], 4))) for k in (0, 2)] == [1, 2]  # 1:1, then 2:1
    with pytest.raises(NsmapsError, match=message("errors.value", name="direction", value="'left'")):
        impact_diagram(base, "d", [0.21], [0.68, 0.5], QUIET, "left")


def test_wrong_calls_are_errors(pair):
    with pytest.raises(
        StateError, match=message("errors.shape", what="the start has", shape="(2, 2)", expected="(2,) or (3, 2)")
    ):
        noisy_orbits(pair(0.3), [[0.8, 0.4]] * 2, QUIET, n_returns=3, n_realisations=3)
    with pytest.raises(NsmapsError, match=message("dynamics.noise-step", step=2, impacts=0, tau=1)):
        noisy_orbits(pair(0.3), [0.8, 0.4], QUIET, n_returns=3, step=2.0)
