"""Noise in nonlinear flights: linear systems in bent coordinates, an integrator along the same path, orders, observables."""

import numpy as np
import pytest
import sympy as sp
from hybrid import BallUnderNoise
from nsmaps_duffing import DuffingStop
from nsmaps_pendulum import PendulumStop
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import nsmaps
from nsmaps import Guard, HybridSystem, ImpactSystem, Noise, PoincareSection, Wall, noisy_orbits
from nsmaps.dynamics.noise import orbits
from nsmaps.dynamics.noise.impacts import impact_diagram
from nsmaps.dynamics.noise.orbits import exact_step
from nsmaps.exact.kernel import STEPS
from nsmaps.exact.outcome import Outcome

LOUD, QUIET = Noise(sigma=0.05, tau=0.5), Noise(sigma=0, tau=0.5)
DUFFING = DuffingStop(c=0.1, a=1.0, b=0.5, f=0.8, w=1.1, d=0.2, r=0.8)
CYCLE = [1.25961545, 6.26252048]


class Straight(HybridSystem):
    """A linear oscillator between two stops, one of which may shake with the noise."""

    r: float = 0.8
    d: float = 0.3
    shake: float = 0.0

    states, noise = ("x", "v"), "eta"
    place = staticmethod(lambda y: y.x)
    rate = staticmethod(lambda y: y.v)

    def period(self):
        return 2 * sp.pi / sp.Rational(6, 5)

    def modes(self, t, y):
        x, first = self.place(y), self.states[0]
        force = sp.cos(sp.Rational(6, 5) * t) + y.eta - y.v / 10 - x
        return {"free": {first: self.rate(y), "v": force}}

    def guards(self, t, y):
        x = self.place(y)
        gaps = {"R": self.d - x, "L": self.d + self.shake * y.eta + x}
        return {name: Guard("free", gap, reset={"v": -self.r * y.v}) for name, gap in gaps.items()}

    def section(self, t, y):
        return PoincareSection("R", ("v", "phi"))


class Bent(Straight):
    """The same, where x = sinh q."""

    states = ("q", "v")
    place = staticmethod(lambda y: sp.sinh(y.q))
    rate = staticmethod(lambda y: y.v / sp.cosh(y.q))

    def section(self, t, y):
        return PoincareSection("R", ("v", "phi"), states={"q": sp.asinh(self.d)})


class TableWithPendulum(BallUnderNoise):
    """The same, beside an overdamped pendulum, for which all flights are integrated."""

    states = ("x", "v", "a")

    def modes(self, t, y):
        return {"flight": {**super().modes(t, y)["flight"], "a": -sp.sin(y.a)}}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi", "a"))


@pytest.mark.parametrize(
    ("plain", "bent", "start", "n"),
    [
        pytest.param(Straight(), Bent(), [0.9, 1.0], 12, marks=pytest.mark.thorough),
        (Straight(shake=0.01), Bent(shake=0.01), [0.9, 1.0], 8),
        (BallUnderNoise(), TableWithPendulum(), [-0.6, 1.0, 0.5], 25),
    ],
    ids=["coordinates", "guard", "contact"],
)
def test_a_linear_system_written_as_a_nonlinear_one_has_the_same_orbits(plain, bent, start, n):
    known, made = (
        noisy_orbits(plain, start[:2], LOUD, n_returns=n, n_realisations=4, rng=2, max_impacts=30),
        noisy_orbits(bent, start, LOUD, n_returns=n, n_realisations=4, rng=2, max_impacts=30),
    )
    assert known.held.all()
    assert (made.words == known.words).all()
    np.testing.assert_allclose(made.states[..., :2], known.states, rtol=0, atol=1e-10)
    np.testing.assert_allclose(made.time, known.time, atol=1e-10)
    np.testing.assert_allclose(made.eta, known.eta, atol=1e-10)
    np.testing.assert_allclose(made.impacts, known.impacts, atol=1e-10)
    assert (made.turns[..., :2] == known.turns).all()
    assert (known.outcome == Outcome.stuck).any() == isinstance(plain, BallUnderNoise)


class Falling(ImpactSystem):
    """The ball of `vi_pair`, by its acceleration."""

    d: float = 0.35
    r: float = 0.5
    g_bar: float = 0.2113

    def walls(self):
        return {"B": Wall(at=self.d / 2, side=1), "T": Wall(at=-self.d / 2, side=-1)}

    def period(self):
        return 2

    def acceleration(self, t, place, velocity):
        return sp.cos(sp.pi * t) + self.g_bar


def test_an_acceleration_takes_the_noise_as_a_displacement_does():
    pair = nsmaps.load_system("vi_pair", d=0.35, r=0.5, g_bar=0.2113)
    known = noisy_orbits(pair, [0.83, 0.36], LOUD, n_returns=20, n_realisations=3, rng=3, max_impacts=20)
    made = noisy_orbits(Falling(), [0.83, 0.36], LOUD, n_returns=20, n_realisations=3, rng=3, max_impacts=20)
    np.testing.assert_allclose(made.states, known.states, atol=1e-11)
    np.testing.assert_allclose(made.impacts, known.impacts, atol=1e-11)
    assert (made.words == known.words).all()


class Pit(Falling):
    """The same without an upper wall."""

    def walls(self):
        return {"B": Wall(at=self.d / 2, side=1), "T": Wall(at=-self.d / 2, side=-1, ends=True)}


def test_motions_end_at_walls_and_impacts_are_listed_over_a_parameter_under_noise():
    assert noisy_orbits(Pit(), [0.83, 0.36], LOUD, n_returns=20, n_realisations=3).ended() == {"escaped": 3}
    made = impact_diagram(DUFFING, "f", [0.75, 0.8], CYCLE, LOUD, "up", n_returns=5, transient=2)
    assert made.walls == ("B",)
    assert all((speeds[wall == 0] > 0).sum() >= 5 for wall, speeds in zip(made.wall, made.speed, strict=True))


@pytest.mark.parametrize("system", [DUFFING, PendulumStop(c=0.1, f=0.8, w=1.1, stop=0.3, r=0.8)], ids=["duffing", "pendulum"])
def test_without_strength_every_return_is_that_of_the_map(system):
    made = noisy_orbits(system, CYCLE, QUIET, n_returns=15)
    alone = system.first_return(made.states[:-1, 0])
    np.testing.assert_allclose(made.states[1:, 0], alone.image, rtol=1e-12, atol=1e-12)
    assert made.words[:, 0].tolist() == alone.words.tolist()
    assert (made.turns[:, 0] == alone.turns).all()


def cubics(noise, h, seed, number, count):
    """The polynomials of the noise over steps, by the powers of the time, from the generator of a realisation."""
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(number,))))
    eta, normals = noise.sigma * rng.standard_normal(), rng.standard_normal((STEPS, 1, 3))[:count, 0]
    transition, root = exact_step(0.0, 0.0, noise, h)
    k = np.arange(4)
    conditions = np.array([k == 0, h**k, h ** (k + 1) / (k + 1), h ** (k + 2) / ((k + 1) * (k + 2))], float)
    found = []
    for normal in normals:
        twice, once, last = transition @ [0.0, 0.0, eta] + root @ normal
        found.append(np.linalg.solve(conditions, [eta, last, once, twice]))
        eta = last
    return found


def integrated(system, state, noise, h, number, count):
    """Impacts of the Duffing oscillator along a path of the noise, by no engine: time and speed, and until then the work of the
    forcing, the loss by damping and the largest distance below zero.
    """
    v, phi = state
    y, t, hits, far = np.array([system.d, -system.r * v, 0.0, 0.0]), phi / system.w, [], 0.0
    begin = t
    for k, cubic in enumerate(cubics(noise, h, 4, number, count)):

        def field(s, y, cubic=cubic, start=begin + k * h):
            x, u, _, _ = y
            push = system.f * np.cos(system.w * s)
            force = push - system.c * u - system.a * x - system.b * x**3 + np.polyval(cubic[::-1], s - start)
            return [u, force, push * u, system.c * u * u]

        end = begin + (k + 1) * h
        while t < end:
            run = solve_ivp(field, (t, end), y, method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
            grid = np.linspace(t, end, 33)[1:]
            over = [s for s in grid if run.sol(s)[0] > system.d]
            if not over:
                t, y, far = end, run.y[:, -1], max(far, *-run.sol(grid)[0])
                break
            low = max([t + 1e-9, *(s for s in grid if s < over[0])])
            t = brentq(lambda s, flight=run.sol: flight(s)[0] - system.d, low, over[0], xtol=1e-14)
            y = run.sol(t)
            hits.append((t - begin, y[1], *y[2:], far))
            y[0], y[1] = system.d, -system.r * y[1]
    return np.array(hits)


def test_a_cubic_spring_follows_an_integrator_along_the_same_path():
    h, hard, n = 0.3, Noise(sigma=0.3, tau=0.5), 3
    made = noisy_orbits(DUFFING, CYCLE, hard, n_returns=n, n_realisations=2, rng=4, step=h)
    known = np.array([integrated(DUFFING, CYCLE, hard, h, number, 70)[:n] for number in range(2)])
    assert known.shape == (2, n, 5)
    np.testing.assert_allclose(np.cumsum(made.time, axis=0).T, known[..., 0], atol=1e-9)
    np.testing.assert_allclose(made.states[1:, :, 0].T, known[..., 1], atol=1e-9)
    rest = [{"name": "far", "formula": "-place", "of": "flights", "largest": True}]
    found = nsmaps.observe(DUFFING, made, ["work", "damping", "loss", "displacement", *rest]).per_return.value
    speeds = np.concatenate([np.full((2, 1), CYCLE[0]), known[:, :-1, 1]], axis=1)  # the impact at the start, not the last one
    losses = (1 - DUFFING.r**2) / 2 * (speeds**2).mean()
    np.testing.assert_allclose(found[:3], [*known[:, -1, 2:4].sum(axis=0) / (2 * n), losses], rtol=1e-9)
    np.testing.assert_allclose(found[3:], known[:, -1, 4].max(), rtol=1e-4)


class Spring(HybridSystem):
    """A hardening spring, seen once a period, which is a point of the grid in time."""

    states, noise = ("x", "v"), "eta"

    def period(self):
        return 4

    def modes(self, t, y):
        return {"free": {"x": y.v, "v": sp.cos(sp.pi * t / 2) + y.eta - y.v / 5 - y.x - y.x**3}}

    def guards(self, t, y):
        return {"s": Guard("free", -sp.sin(sp.pi * t / 2))}

    def section(self, t, y):
        return PoincareSection("s", ("x", "v"))


@pytest.mark.parametrize(("system", "start", "orders"), [(Spring(), [0.5, 0.3], (3, 3)), (DUFFING, CYCLE, (1.5, 2.5))])
def test_strong_errors_have_their_orders(system, start, orders, monkeypatch):
    """Of the same path on finer grids: 3 between events, of an impact 3/2 in the speed and 5/2 in the phase."""
    made = []
    for parts in (1, 4, 16, 64):
        monkeypatch.setattr(orbits, "SUBSTEPS", parts)
        made.append(noisy_orbits(system, start, LOUD, n_returns=1, n_realisations=100, rng=7, step=parts / 256).states[1])
    errors = np.array([np.sqrt(np.mean((each - made[0]) ** 2, axis=0)) for each in made[1:]])
    assert np.log2(errors[-1] / errors[0]) / 4 == pytest.approx(orders, abs=0.3)


OF_STOPS = [
    {"name": "impacts", "formula": "1", "of": "impacts", "at": "L"},
    {"name": "power", "formula": "v**2", "of": "flights"},
    {"name": "fastest", "formula": "v", "of": "flights", "largest": True},
]
OF_TABLE = [
    {"name": "loss", "formula": "(v**2 - v_after**2)/2", "of": "impacts"},
    {"name": "height", "formula": "x", "of": "flights", "largest": True},
    {"name": "rest", "formula": "1", "of": "flights", "at": "table"},
]


@pytest.mark.parametrize(
    ("system", "start", "n", "asked"),
    [
        (Bent(), [0.9, 1.0], 12, OF_STOPS),
        (BallUnderNoise(), [-0.6, 1.0], 40, OF_TABLE),
        (TableWithPendulum(), [-0.6, 1.0, 0.5], 40, OF_TABLE),
    ],
    ids=["coordinates", "contact", "contact, integrated"],
)
def test_observables_of_modes_have_the_values_of_the_map_without_noise(system, start, n, asked):
    found = nsmaps.observe(
        system, noisy_orbits(system, start, QUIET, n_returns=n, n_realisations=2, chatter=1e-12), asked
    ).per_time.value
    known = nsmaps.observe(system, start, asked, n_returns=n, n_batches=1).per_time.value
    assert (known > 0).all()
    np.testing.assert_allclose(found, known, rtol=1e-8)  # pieces of flights are longer without noise
