"""Noise in systems with modes: the noiseless map, impact systems, integration of the same path, finer steps, closed forms."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from itertools import accumulate

import numpy as np
import pytest
import sympy as sp
from hybrid import BallUnderNoise
from messages import message
from nsmaps_belt import Belt
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_recoil_pair import RecoilPair
from nsmaps_rocking_block import RockingBlock
from nsmaps_soft_impact import SoftImpact
from nsmaps_vi_pair import VIPair
from scipy.linalg import solve_continuous_lyapunov
from systems import Coulomb

import nsmaps
from nsmaps import Guard, HybridSystem, Noise, Parallel, PoincareSection, noisy_orbits
from nsmaps.dynamics.noise import orbits
from nsmaps.dynamics.noise.impacts import impact_diagram
from nsmaps.dynamics.noise.orbits import exact_step
from nsmaps.dynamics.noise.residence import residence
from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.kernel import STEPS
from nsmaps.exact.outcome import Outcome

SOFT = SoftImpact(xi=0.01, e=1.26, a=0.7, beta=29, w=0.85)
BELT = Belt(zeta=0.02, vb=0.5, mu_k=0.4, mu_s=0.6, A=0.3, w=1.3)
PAIR = RecoilPair(eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, r=0.5, g_bar=0.2113)
STARTS = {SOFT: [1.0, 1.0], BELT: [0.6 - 0.02 + 0.3 * np.cos(1.0), 1.0], PAIR: [0.84, 0.19, -0.67, 0.32]}
SYSTEMS = pytest.mark.parametrize("system", STARTS, ids=["soft", "belt", "pair"])
LOUD, QUIET = Noise(sigma=0.05, tau=0.5), Noise(sigma=0, tau=0.5)


class Pushed(Coulomb):
    """The belt with equal static and kinetic friction, as a surface of sliding, with noise in its force."""

    noise = "push"

    def force(self, t, y):
        return super().force(t, y) + y.push


class Linear(HybridSystem):
    """A linear oscillator, seen once a period."""

    zeta: float
    w: float

    states, noise = ("x", "v"), "eta"

    def period(self):
        return 2 * sp.pi / self.w

    def modes(self, t, y):
        return {"free": {"x": y.v, "v": sp.cos(self.w * t) + y.eta - 2 * self.zeta * y.v - y.x}}

    def guards(self, t, y):
        return {"s": Guard("free", -sp.sin(self.w * t))}

    def section(self, t, y):
        return PoincareSection("s", ("x", "v"))


@SYSTEMS
@pytest.mark.parametrize("step", [None, 0.003, 0.5])
def test_without_strength_every_return_is_that_of_the_map(system, step):
    made = noisy_orbits(system, STARTS[system], QUIET, n_returns=30, step=step)
    assert made.held.all()
    alone = system.first_return(made.states[:-1, 0])
    np.testing.assert_allclose(made.states[1:, 0], alone.image, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(made.time[:, 0], alone.time, rtol=1e-12)
    assert made.words[:, 0].tolist() == alone.words.tolist()
    assert (made.turns[:, 0] == alone.turns).all()
    assert (made.outcome[:, 0] == alone.outcome).mean() > 0.9  # a doubt within rounding may differ
    assert not made.eta.any()


def test_without_strength_contact_lasts_as_without_noise():
    system = BallUnderNoise()
    made = noisy_orbits(system, [-0.6, 1.0], QUIET, n_returns=40)
    alone = system.first_return(made.states[:-1, 0], chatter=1e-6)
    assert (made.outcome == Outcome.stuck).any()
    assert made.outcome[:, 0].tolist() == alone.outcome.tolist()
    assert made.words[:, 0].tolist() == alone.words.tolist()
    np.testing.assert_allclose(made.states[1:, 0], alone.image, rtol=1e-11, atol=1e-12)


def test_a_light_ball_moves_as_in_the_pair_of_one_displacement():
    """The capsule is not acted on, without spring and damping: the same numbers drive the same path."""
    pair = RecoilPair(eta=0, kappa=0, Lambda=0, d=0.35, r=0.5, g_bar=0.2113)
    plain = VIPair(d=0.35, r=0.5, g_bar=0.2113)
    made = noisy_orbits(pair, [0.83, 0.19, -0.67, 0.36], LOUD, n_returns=40, n_realisations=6, rng=3, max_impacts=60)
    known = noisy_orbits(plain, [0.83, 0.36], LOUD, n_returns=40, n_realisations=6, rng=3, max_impacts=60)
    np.testing.assert_allclose(made.states[..., [0, 3]], known.states, atol=1e-11)
    np.testing.assert_allclose(made.time, known.time, atol=1e-11)
    np.testing.assert_allclose(made.eta, known.eta, atol=1e-11)
    np.testing.assert_allclose(made.impacts, known.impacts, atol=1e-11)
    assert (made.words == known.words).all()
    assert (made.turns[..., 3] == known.turns[..., 1]).all()
    modes = {"1:1": ["BTB"]}
    stays = [residence(each.words, each.time, modes).time for each in (made, known)]
    assert stays[0] == pytest.approx(stays[1], rel=1e-12)


def test_chatter_and_rest_are_those_of_the_bouncing_ball():
    """Releases are zeros of the same force, so that paths agree through them; impacts that are summed up differ a little."""
    ball, same = BouncingBall(Gamma=1.2, r=0.4), BallUnderNoise()
    made = noisy_orbits(same, [-0.6, 1.0], LOUD, n_returns=60, n_realisations=8, rng=2)
    known = noisy_orbits(ball, [0.6, 1.0], LOUD, n_returns=60, n_realisations=8, rng=2)
    assert made.held.all()
    assert (made.outcome == Outcome.stuck).any()
    assert (known.outcome == Outcome.stuck).any()
    first = np.argmax(known.outcome == Outcome.stuck, axis=0)
    for k, r in enumerate(first.tolist()):
        np.testing.assert_allclose(made.states[: r + 1, k, 0], -known.states[: r + 1, k, 0], atol=1e-9)
    shares = [(each.outcome == Outcome.stuck).mean() for each in (made, known)]
    assert shares[0] == pytest.approx(shares[1], abs=0.05)


def test_sliding_is_stick_with_equal_frictions():
    given = noisy_orbits(
        Belt(mu_k=0.6, mu_s=0.6, zeta=0.02, vb=0.5, A=0.3, w=1.3), STARTS[BELT], LOUD, n_returns=30, n_realisations=4, rng=1
    )
    derived = noisy_orbits(Pushed(), STARTS[BELT], LOUD, n_returns=30, n_realisations=4, rng=1)
    assert (given.words == derived.words).all()
    np.testing.assert_allclose(derived.states, given.states, atol=1e-12)


def fine_path(noise, h, seed, number, parts):
    """The noise at the points of a grid `parts` times as fine as the step, of the generator of a realisation."""
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(number,))))
    first, normals = noise.sigma * rng.standard_normal(), rng.standard_normal((STEPS, parts, 3)).reshape(-1, 3)
    transition, root = exact_step(0.0, 0.0, noise, h / parts)
    decay = float(transition[2, 2])
    return list(accumulate((normals @ root[2]).tolist(), lambda eta, more: decay * eta + more, initial=first))


class Integrated:
    """The formulas of a class, followed by a Runge-Kutta method along a polygonal path of the noise; no engine is used."""

    def __init__(self, system):
        t, names = sp.Symbol("t"), (*system.states, "noise")
        y = system._arguments(dict(zip(names, sp.symbols(names), strict=True)))
        symbols, states = (t, *sp.symbols(names)), sp.symbols(system.states)
        self.rates = {m: sp.lambdify(symbols, list(f.values())) for m, f in system.modes(t, y).items()}
        self.guards = [
            (one, sp.lambdify(symbols, one.function), sp.lambdify(symbols, list(one.where)),
             sp.lambdify(symbols, [one.reset.get(str(s), s) for s in states]))
            for one in system.guards(t, y).values()
        ]  # fmt: skip

    def step(self, mode, t, y, h, first, last):
        def f(s, slopes):
            z = [x + s * h * slope for x, slope in zip(y, slopes, strict=True)]
            return self.rates[mode](t + s * h, *z, first + s * (last - first))

        a = f(0, [0.0] * len(y))
        b = f(0.5, a)
        c = f(0.5, b)
        return [x + h / 6 * (k + 2 * m + 2 * n + p) for x, k, m, n, p in zip(y, a, b, c, f(1, c), strict=True)]

    def events(self, t, mode, y, path, h, most):
        """Times since t, and states before, at the first events from a state at time t."""
        found, k, s = [], 0, 0.0  # s is the share of the step k that is behind
        while len(found) < most:
            ends = path[k] + s * (path[k + 1] - path[k]), path[k + 1]
            new = self.step(mode, t + (k + s) * h, y, (1 - s) * h, *ends)
            best = None
            for one, g, where, reset in self.guards:
                if mode in one.watched and g(t + (k + 1) * h, *new, ends[1]) <= 0 < (was := g(t + (k + s) * h, *y, ends[0])):
                    x = was / (was - g(t + (k + 1) * h, *new, ends[1]))
                    at = ends[0] + x * (ends[1] - ends[0])
                    then = self.step(mode, t + (k + s) * h, y, x * (1 - s) * h, ends[0], at)
                    time = (k + s + x * (1 - s)) * h
                    if min([0.0, *where(t + time, *then, at)]) == 0 and (best is None or time < best[0]):
                        best = time, then, one.to or mode, reset(t + time, *then, at)
            if best is None:
                y, k, s = new, k + 1, 0.0
            else:
                found.append(best[:2])
                s, mode, y = best[0] / h - k, best[2], best[3]
        return found


#: mode and states just after the start; how the image follows from time and states at the second event after it
AFTER = {
    SOFT: ("contact", [SOFT.e, 1.0]),
    BELT: ("slower", [STARTS[BELT][0], BELT.vb]),
    PAIR: ("flight", [0.175, -0.42, 0.19, -0.67 - 0.05 * 1.5 / 1.05 * 0.84]),
}


@SYSTEMS
def test_paths_are_those_of_an_integrator_along_the_same_noise(system, monkeypatch):
    """With noise that is a polygon over 64 points of each step, whose error of order one is the larger one.

    A belt that sticks is released where the noise first reaches a value, which is of order 1/2 only: there both take all points.
    """
    parts, turn, errors, firsts, effects = 64, float(system.period()) / (2 * np.pi), [], [], []
    h, quiet, formulas = 2 * np.pi * turn / 100, system.first_return([STARTS[system]]), Integrated(system)
    monkeypatch.setattr(orbits, "SUBSTEPS", 1 if system is BELT else parts)
    made = noisy_orbits(
        system,
        STARTS[system],
        LOUD,
        n_returns=1,
        n_realisations=4,
        rng=5,
        step=h / parts if system is BELT else h,
        max_impacts=2,
    )
    for k in range(4):
        mode, state = AFTER[system]
        t, path = STARTS[system][-1] * turn, fine_path(LOUD, h, 5, k, parts)
        found = formulas.events(t, mode, state, path, h / parts, len(made.words[0, k]) - 1)
        (first, _), (time, before) = found[0], found[-1]
        known = dict(zip(system.states, before, strict=True)) | {"phi": (t + time) / turn % (2 * np.pi)}
        image = np.array([known[name] for name in system.coordinates])
        errors.append(abs(np.append(made.states[1, k] - image, made.time[0, k] - time)).max())
        firsts.append(abs(np.exp(1j * made.impacts[k, 0, 2]) - np.exp(1j * (t + first) / turn)))
        effects.append(abs(made.time[0, k] - quiet.time[0]))
    assert max(firsts) < 1e-3
    assert max(errors) < (0.02 if system is BELT else 1e-3)
    assert max(errors) < 0.1 * max(effects)


@pytest.mark.thorough
def test_strong_errors_have_their_orders(monkeypatch):
    """Of an event 3/2 in the speed and 5/2 in the phase, over the same path: a grid has every second point of a finer one."""
    made = []
    for parts in (1, 4, 8, 16, 32):
        monkeypatch.setattr(orbits, "SUBSTEPS", parts)
        made.append(noisy_orbits(SOFT, STARTS[SOFT], LOUD, n_returns=1, n_realisations=200, rng=7, step=parts * 0.006).states[1])
    errors = np.array([np.sqrt(np.mean((each - made[0]) ** 2, axis=0)) for each in made[1:]])
    orders = np.log2(errors[-1] / errors[0]) / 3
    assert orders[0] == pytest.approx(1.5, abs=0.2)
    assert orders[1] == pytest.approx(2.5, abs=0.5)
    assert errors[-1, 0] < 2e-4


def test_a_linear_oscillator_has_the_moments_of_its_closed_form():
    """x'' + 2 zeta x' + x = cos w t + eta: the covariance of (x, v, eta) from Lyapunov's equation, the mean as without noise."""
    zeta, w, noise = 0.25, 1.3, Noise(sigma=0.4, tau=0.7)
    system = Linear(zeta=zeta, w=w)
    made = noisy_orbits(system, [0.0, 0.0], noise, n_returns=400, n_realisations=64, rng=1, step=0.2)
    rates = np.array([[0, 1, 0], [-1, -2 * zeta, 1], [0, 0, -1 / noise.tau]])
    known = solve_continuous_lyapunov(rates, -np.diag([0, 0, 2 * noise.sigma**2 / noise.tau]))
    rows = np.concatenate([made.states[20:], made.eta[20:, :, None]], axis=-1)
    mean = nsmaps.periodic_orbit(system, [0.0, 0.0]).states[0]
    covariance = np.einsum("kri,krj->rij", rows - [*mean, 0], rows - [*mean, 0]) / len(rows)
    assert (abs(covariance.mean(axis=0) - known) < 4 * covariance.std(axis=0) / 8).all()
    averages = rows[..., :2].mean(axis=0)
    assert (abs(averages.mean(axis=0) - mean) < 4 * averages.std(axis=0) / 8).all()
    assert (covariance.std(axis=0) / 8 < 0.05 * known[2, 2]).all()


def test_results_depend_on_seeds_alone():
    start, how = [0.84, 0.19, -0.67, 0.32], {"n_returns": 6, "n_realisations": 20, "rng": 4}
    alone = noisy_orbits(PAIR, start, LOUD, **how)
    with ThreadPoolExecutor(3) as threads, ProcessPoolExecutor(2) as processes:
        for parallel in (Parallel(threads, part=3), Parallel(processes, part=7)):
            assert np.array_equal(noisy_orbits(PAIR, start, LOUD, **how, parallel=parallel).states, alone.states)
    assert np.array_equal(noisy_orbits(PAIR, start, LOUD, n_returns=4, n_realisations=20, rng=4).states, alone.states[:5])
    assert not np.array_equal(noisy_orbits(PAIR, start, LOUD, n_returns=6, n_realisations=20, rng=5).states, alone.states)
    assert len({*alone.states[3, :, 0].tolist()}) == 20


def test_impacts_over_a_parameter_are_those_of_the_orbit_without_strength():
    made = impact_diagram(PAIR, "eta", [0.05, 0.2], STARTS[PAIR], QUIET, "up", n_returns=8, transient=300)
    assert made.walls == ("B", "T")
    assert [len(set(np.round(made.speed[k][made.wall[k] == 0], 7))) for k in range(2)] == [1, 2]  # doubled at 0.115
    orbit = nsmaps.periodic_orbit(PAIR, STARTS[PAIR])
    assert made.speed[0][made.wall[0] == 0][-1] == pytest.approx(orbit.states[0, 0], abs=1e-7)


class Silent(Linear):
    """Noise that no formula has."""

    noise = "hiss"

    def modes(self, t, y):
        return {"free": {"x": y.v, "v": sp.cos(self.w * t) - 2 * self.zeta * y.v - y.x}}


class Taken(Linear):
    """Noise with the name of a state."""

    noise = "x"


def test_systems_without_noise_say_so():
    block = RockingBlock(**dict.fromkeys(RockingBlock.parameter_names(), 0.5))
    with pytest.raises(NsmapsError, match=message("exact.no-noise", system="RockingBlock")):
        noisy_orbits(block, np.full(len(block.coordinates), 0.5), LOUD, n_returns=5)
    with pytest.raises(SystemDefinitionError, match=message("exact.noise-nowhere", cls="Silent", name="hiss")):
        noisy_orbits(Silent(zeta=0.1, w=1), [0, 0], LOUD, n_returns=5)
    with pytest.raises(SystemDefinitionError, match=message("errors.value", name="Taken.noise", value="'x'")):
        Taken(zeta=0.1, w=1).first_return([[0, 0]])
    with pytest.raises(NsmapsError, match=message("errors.shape", what="the start has", shape="(2, 4)")):
        noisy_orbits(PAIR, [[0.8, 0.4, 0.1, 0.2]] * 2, LOUD, n_returns=5, n_realisations=3)


def test_motions_that_end_say_why():
    made = noisy_orbits(SOFT.at(a=0.1), [1.0, 1.0], Noise(sigma=0, tau=0.5), n_returns=400, n_realisations=2, step=0.5)
    assert made.ended() == {"escaped": 2}
    assert noisy_orbits(PAIR, [-1.0, 0.19, -0.67, 0.32], LOUD, n_returns=3, n_realisations=2).ended() == {"invalid": 2}
