"""Means of observables: energy balances, closed forms, errors, and what is refused."""

from math import pi

import mpmath as mp
import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.dynamics.observables.means import ratio
from nsmaps.errors import ConditionError

STEADY = {"d": 0.35, "M": 0.1245, "g": 9.8, "beta": pi / 3, "F": 5}
STICKING = {"zeta": 0.02, "vb": 0.3, "mu_k": 0.4, "mu_s": 0.6, "w": 0.9, "A": 0.25}
FRICTION = [  #: power that the belt's friction takes from the mass, by mode
    {"name": "slower", "formula": "-mu_k*u", "of": "flights", "at": "slower"},
    {"name": "faster", "formula": "mu_k*u", "of": "flights", "at": "faster"},
    {"name": "held", "formula": "(A*cos(w*t) - 2*zeta*vb - x)*vb", "of": "flights", "at": "stick"},
]
ALL = ["work", "loss", "damping"]
ORBITS = {
    "vi_pair": (STEADY, [0.83, 0.36], 1, ALL),
    "bouncing_ball": ({"Gamma": 1.5}, [4.19, 0.79], 1, ALL),
    "impact_oscillator": ({"zeta": 0.1, "w": 2.0, "A": 1.5, "wall": 0.3}, [0.8, 1.0], 1, ALL),
    "gear_rattle": ({"delta": 0.6, "eps": 0.6}, [0.8, 1.0], 1, ALL),
    "recoil_pair": (
        {"eta": 0.1, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113},
        [0.84, 0.19, -0.67, 0.32],
        1,
        ALL,
    ),
    "two_masses": ({"w": 2.0}, [0.5, 0.0, 0.0, 1.0], 1, ALL),
    "rocking_block": ({"a": 0.8, "w": 4.0, "r": 0.9}, [0.5275, 1.336], 1, ["work", "loss"]),
    "belt": (
        {"zeta": 0.02, "vb": 0.3, "mu_k": 0.4, "mu_s": 0.6, "w": 0.9, "A": 0.25},
        [0.838, 0.0],
        1,
        ["work", "damping", *FRICTION],
    ),
    "soft_impact": ({"xi": 0.05, "e": 0.8, "a": 0.7, "beta": 29, "w": 0.8}, [0.5, 1.0], 1, ["work", "damping"]),
}


def attractor(name: str) -> tuple[object, np.ndarray, int]:
    """A system and a periodic orbit on its attractor: the states."""
    values, start, period, _ = ORBITS[name]
    system = nsmaps.load_system(name, **values)
    last = nsmaps.orbit(system, start, 2000).final
    for period in (1, 2, 3, 4, 5, 6):
        found = nsmaps.periodic_orbit(system, last, period)
        if found.converged and found.exists:
            return system, found.states, period
    raise AssertionError(f"no periodic orbit of {name}")


@pytest.mark.parametrize("name", ORBITS)
def test_the_work_of_the_forcing_is_the_loss_of_a_cycle(name: str) -> None:
    system, states, period = attractor(name)
    result = nsmaps.observe(system, states[0], ORBITS[name][3], n_returns=period, n_batches=1)
    work, *losses = result.totals[0]
    assert work > 0
    assert abs(work - sum(losses)) < 1e-12 * work


def test_a_motion_with_one_impact_a_period_has_the_closed_form() -> None:
    """v = 2 pi/(1 + r) at cos phi = pi (1 - r)/(Gamma (1 + r)); the loss is (1 - r^2) v^2/2."""
    with mp.workdps(30):
        r = mp.mpf("0.5")
        v = 2 * mp.pi / (1 + r)
        loss = (1 - r**2) * v**2 / 2
        expected = [float(x) for x in (1, v, loss, (1 + r) * v, loss)]
    system, states, _ = attractor("bouncing_ball")
    result = nsmaps.observe(system, states[0], ["impacts", "speed", "loss", "momentum", "work"], n_returns=10)
    assert np.allclose(result.per_period.value, expected, rtol=1e-12, atol=0)
    assert np.allclose(result.per_time.value * 2 * pi, [1, 2 * pi * expected[1], *expected[2:]], rtol=1e-12, atol=0)
    assert (result.per_return.error < 1e-12).all()


def test_a_sum_is_that_of_the_impacts_one_by_one() -> None:
    system = nsmaps.load_system("vi_pair", **STEADY).at(d=0.26)
    chosen = [
        {"name": "at T", "formula": "r*v + sin(phi)*place + t", "at": "T"},
        {"name": "fastest", "formula": "v", "largest": True},
        {"name": "scaled", "formula": "v**3", "scale": 2.5, "unit": "W"},
    ]
    result = nsmaps.observe(system, [0.7, 0.4], chosen, n_returns=40, n_batches=4)
    hits = system.impacts([0.7, 0.4], 1 + int(sum(map(len, nsmaps.orbit(system, [0.7, 0.4], 40).words)) - 40))
    v, phi, top = hits.speed[:-1], hits.phase[:-1], hits.wall[:-1] == 1
    terms = system.r * v + np.sin(phi) * np.where(top, -system.d / 2, system.d / 2) + phi / pi
    expected = [terms[top].sum() / 40, v.max(), 2.5 * (v**3).sum() / 40]
    assert np.allclose(result.per_return.value, expected, rtol=1e-11, atol=0)
    assert np.array_equal(result.final, nsmaps.orbit(system, [0.7, 0.4], 40).final)
    assert f", largest fastest {v.max():.6g}, " in result.summary()  # without an error


def test_the_largest_displacement_is_that_of_the_parabola() -> None:
    ball = nsmaps.load_system("bouncing_ball", Gamma=1e-6, r=1.0)
    result = nsmaps.observe(ball, [3.0, 0.0], ["displacement"], n_returns=1)
    assert result.per_return.value[0] == pytest.approx(4.5, abs=2e-5)
    assert np.isnan(result.per_return.error[0])


def test_errors_are_those_of_correlated_batches() -> None:
    noise = np.random.default_rng(0).normal(size=(64, 4000))
    for k in range(1, 64):
        noise[k] += 0.5 * noise[k - 1]
    mean = ratio(3 + noise, np.ones_like(noise))
    covered = (np.abs(mean.value - 3) < mean.error).mean()
    assert 0.58 < covered < 0.72  # 0.68 for errors that are known


def test_an_orbit_that_ends_has_no_mean() -> None:
    still = nsmaps.load_system("bouncing_ball", Gamma=0.5)
    result = nsmaps.observe(still, [[1.0, 1.0], [2.0, 0.0]], ["loss"], n_returns=500)
    assert np.isnan(result.per_return.value).all()
    assert (result.outcome == nsmaps.Outcome.rests).all()


def test_impacts_without_number_lose_the_energy_that_is_left() -> None:
    """Up to its release a ball loses the energy of its first impact and all work of the table."""
    ball, start = nsmaps.load_system("bouncing_ball", Gamma=1.2), [1.0, 3.5]
    returns = nsmaps.orbit(ball, start, 200)
    n = 1 + int(np.flatnonzero(returns.outcome == nsmaps.Outcome.stuck)[0])
    result = nsmaps.observe(ball, start, ["loss", "work", "impacts"], n_returns=n, n_batches=1)
    loss, work, impacts = result.totals[0]
    assert loss == pytest.approx(0.5 + work, rel=1e-12)
    assert np.isinf(impacts)
    assert result.final[0] == 0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("losss", message("exact.observable-near", name="losss", map="VIPair", near="loss")),
        (
            {"name": "a", "formula": "v*q"},
            message("errors.unknown", kind="name", name="q", known="d, r, g_bar, phi, t, v", at="formula 'v*q', column 3"),
        ),
        ({"name": "a", "formula": "velocity"}, message("errors.unknown", kind="name", name="velocity")),
        ({"name": "a", "formula": "v", "of": "flights"}, message("errors.unknown", kind="name", name="v")),
        ({"name": "a", "formula": "v", "at": "X"}, message("exact.observable-at", event="an impact", letter="X", letters="B, T")),
        ({"name": "a", "formul": "v"}, message("errors.unknown-near", kind="key", name="formul", near="formula")),
        ({"name": "a", "formula": "v", "largest": True, "per": "1"}, message("exact.largest-and-per")),
        ({"name": "a", "formula": "v +"}, message("reduced.unread")),
        ({"name": "a", "formula": "__import__('os')"}, message("errors.no-such", kind="function", name="__import__")),
        ({"name": "a", "formula": "v**9**9"}, message("reduced.too-high")),
    ],
)
def test_an_observable_that_is_not_one_is_refused(given: object, said: str) -> None:
    system = nsmaps.load_system("vi_pair", **STEADY)
    with pytest.raises((nsmaps.NsmapsError, ConditionError), match=said):
        nsmaps.observe(system, [0.8, 0.3], [given], n_returns=10)


def test_maps_and_systems_without_formulas_are_refused() -> None:
    system = nsmaps.load_system("vi_pair", **STEADY)
    with pytest.raises(nsmaps.NsmapsError, match=message("exact.varied", what="observables")):
        nsmaps.observe(nsmaps.dynamics.IteratedMap(system, 2), [0.8, 0.3], ["loss"], n_returns=10)
    with pytest.raises(nsmaps.NsmapsError, match=message("exact.two-observables", name="loss")):
        nsmaps.observe(system, [0.8, 0.3], ["loss", "loss"], n_returns=10)
    with pytest.raises(nsmaps.NsmapsError, match=message("exact.no-observable")):
        nsmaps.observe(system, [0.8, 0.3], [], n_returns=10)
    soft = nsmaps.load_system("soft_impact", **ORBITS["soft_impact"][0])
    with pytest.raises(nsmaps.NsmapsError, match=message("exact.no-changing-event")):
        nsmaps.observe(soft, [0.5, 1.0], ["impacts"], n_returns=10)


def test_means_are_a_dataset() -> None:
    pytest.importorskip("xarray")
    system = nsmaps.load_system("vi_pair", **STEADY)
    result = nsmaps.observe(system, [[0.83, 0.36], [0.8, 0.4]], ["loss", "speed"], n_returns=64, transient=300)
    found = result.to_xarray()
    assert found["totals"].dims == ("batch", "axis_0", "observable")
    assert found["final"].dims == ("axis_0", "coordinate")
    assert found["names"].values.tolist() == ["loss", "speed"]
    assert np.array_equal(result.per_period.to_xarray()["error"], result.per_period.error)


class Saw(HybridSystem):
    """x grows from -u to b u in the time 1 + b, again and again."""

    b: float = 0.7
    u: float = 1.0
    states = ("x", "c")

    def modes(self, t, y):
        return {"up": {"x": self.u, "c": 1}}

    def guards(self, t, y):
        return {"J": Guard("up", self.b * self.u - y.x, reset={"x": -self.u, "c": 0 * y.c})}

    def section(self, t, y):
        return PoincareSection("J", ("c",))


@pytest.mark.parametrize("u", [1e-6, 1e6])
def test_formulas_with_kinks_and_jumps_and_steep_ones_are_integrated_to_rounding(u):
    formulas = "abs(x)", f"max(x, {0.2 * u!r})", f"{u!r}*sin(40*x/{u!r})", f"{u!r}*sign(x - {0.3 * u!r})"
    chosen = [{"name": text, "formula": text, "of": "flights"} for text in formulas]
    found = nsmaps.observe(Saw(u=u), nsmaps.periodic_orbit(Saw(u=u), [1.7]), chosen, rates={"b": 1.0}).per_return
    expected = [(1 + 0.7**2) / 2, 0.2 * 1.2 + (0.7**2 - 0.2**2) / 2, (np.cos(40) - np.cos(28)) / 40, 0.4 - 1.3]
    assert found.value / u == pytest.approx(expected, rel=1e-12)
    assert found.derivative[:3] / u == pytest.approx([0.7, 0.7, np.sin(28)], rel=1e-12)
    assert np.isnan(found.derivative[3])


def test_the_way_of_a_ball_is_twice_its_height_with_the_derivative():
    """Flights in closed form, whose velocity changes its sign once; derivatives by differences of the height."""
    path = {"name": "path", "formula": "abs(velocity)", "of": "flights"}

    def found(r, chosen):
        ball = nsmaps.load_system("bouncing_ball", Gamma=1.2, r=r)
        return nsmaps.observe(ball, nsmaps.periodic_orbit(ball, [4.2, 0.5]), chosen, rates={"r": 1.0}).per_period

    def height(r):
        return found(r, ["displacement"]).value[0]

    both, h = found(0.5, [path]), 2e-4
    assert both.value[0] == pytest.approx(2 * height(0.5), rel=1e-13)
    slope = (8 * (height(0.5 + h) - height(0.5 - h)) - height(0.5 + 2 * h) + height(0.5 - 2 * h)) / (12 * h)
    assert both.derivative[0] == pytest.approx(2 * slope, rel=1e-8)
