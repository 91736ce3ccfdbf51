"""Observables of periodic orbits with their derivatives, of branches, diagrams, basins and orbits under noise."""

from math import pi

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.exact.observables.formulas import plan_of
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.observables.totals import slopes_of
from nsmaps.exact.systems.system import ImpactSystem

STEADY = {"d": 0.35, "M": 0.1245, "g": 9.8, "beta": pi / 3, "F": 5}
CHOSEN = ["loss", "work", "speed", {"name": "wave", "formula": "r*v + sin(phi)*place"}]


@pytest.fixture(scope="module")
def pair() -> ImpactSystem:
    return nsmaps.load_system("vi_pair", **STEADY)


def test_the_derivative_of_a_closed_form() -> None:
    """With one impact a period the loss is (1 - r) (2 pi)^2/(2 (1 + r)), and does not depend on Gamma."""
    ball = nsmaps.load_system("bouncing_ball", Gamma=1.5)
    orbit = nsmaps.periodic_orbit(ball, [4.19, 0.79])
    by_r = nsmaps.observe(ball, orbit, ["loss", "work", "speed"], rates={"r": 1.0}).per_period
    r = ball.r
    value, slope = (2 * pi) ** 2 / 2 * (1 - r) / (1 + r), -((2 * pi) ** 2) / (1 + r) ** 2
    assert np.allclose(by_r.value, [value, value, 2 * pi / (1 + r)], rtol=1e-12)
    assert np.allclose(by_r.derivative, [slope, slope, -2 * pi / (1 + r) ** 2], rtol=1e-11)
    by_gamma = nsmaps.observe(ball, orbit, ["loss", "work"], rates={"Gamma": 1.0})
    assert np.abs(by_gamma.per_time.derivative).max() < 1e-11


def compared(system: object, orbit: nsmaps.dynamics.PeriodicOrbit, chosen: list[object], name: str, h: float = 1e-4) -> None:
    """Derivatives against differences of the means of neighbouring periodic orbits, extrapolated."""

    def means(value: float) -> np.ndarray:
        there = system.at(**{name: value})
        cycle = nsmaps.periodic_orbit(there, orbit.states, len(orbit.states), tolerance=1e-13)
        found = nsmaps.observe(there, cycle, chosen)
        return np.array([found.per_return.value, found.per_time.value, found.per_period.value])

    found, value = nsmaps.observe(system, orbit, chosen, rates={name: 1.0}), getattr(system, name)
    wide, narrow = ((means(value + x) - means(value - x)) / (2 * x) for x in (h, h / 2))
    exact = np.array([found.per_return.derivative, found.per_time.derivative, found.per_period.derivative])
    assert np.abs(exact).max() > 0.01
    assert np.allclose(exact, (4 * narrow - wide) / 3, rtol=1e-7, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("name", ["d", "r", "g_bar"])
def test_the_derivatives_of_a_cycle_are_those_of_differences(pair: ImpactSystem, name: str) -> None:
    system = pair.at(d=0.3)
    compared(system, nsmaps.periodic_orbit(system, [0.8, 0.4], 2), CHOSEN, name)


def test_the_period_of_the_forcing_counts_in_the_derivative() -> None:
    oscillator = nsmaps.load_system("impact_oscillator", zeta=0.1, w=2.0, A=1.5, wall=0.3)
    orbit = nsmaps.periodic_orbit(oscillator, nsmaps.orbit(oscillator, [0.8, 1.0], 1000).final)
    compared(oscillator, orbit, ["work", "loss", "damping", {"name": "sway", "formula": "place**2*w", "of": "flights"}], "w")


@pytest.mark.parametrize("name", ["eta", "d"])
def test_the_derivatives_of_a_system_with_modes(name: str) -> None:
    recoil = nsmaps.load_system("recoil_pair", eta=0.1, kappa=0.04, Lambda=0.2, d=0.35, r=0.5, g_bar=0.2113)
    orbit = nsmaps.periodic_orbit(recoil, [0.84, 0.19, -0.67, 0.32])
    compared(recoil, orbit, ["loss", "work", "damping", "ball"], name)


def test_along_a_branch_the_derivative_is_that_of_the_means(pair: ImpactSystem) -> None:
    map_of, fixed = nsmaps.exact.Along(pair, "d"), nsmaps.periodic_orbit(pair, [0.8, 0.4])
    branch = nsmaps.continue_branch(map_of, "p", fixed, 0.35, bounds=(0.33, 0.35), direction="down")
    found = nsmaps.observe(map_of, branch, ["loss", "work", "displacement"])
    value, slope = found.per_period.value, found.per_period.derivative
    gap = np.diff(branch.values)
    trapezia = gap[:, None] * (slope[1:] + slope[:-1]) / 2
    assert np.allclose(np.diff(value, axis=0)[:, :2], trapezia[:, :2], rtol=1e-3)
    assert np.allclose(value[:, 0], value[:, 1], rtol=1e-12)
    assert np.isnan(slope[:, 2]).all()
    assert np.allclose(value[:, 2], branch.values / 2, rtol=1e-12)


def test_a_diagram_has_the_means_of_its_attractors(pair: ImpactSystem) -> None:
    map_of = nsmaps.exact.Along(pair, "d")
    diagram = nsmaps.bifurcation_diagram(map_of, "p", [0.35, 0.3, 0.26, -0.1], [0.83, 0.36], transient=3000)
    found = nsmaps.observe(map_of, diagram, CHOSEN, n_returns=64)
    assert found.per_period.value.shape == (4, 1, 4)
    for k, guess in enumerate(([0.83, 0.36], [0.8, 0.4])):
        system = map_of(diagram.values[k])
        cycle = nsmaps.observe(system, nsmaps.periodic_orbit(system, guess, k + 1), CHOSEN)
        assert np.allclose(found.per_period.value[k, 0], cycle.per_period.value, rtol=1e-9)
        assert np.nanmax(found.per_period.error[k]) < 1e-9
    assert (found.per_return.error[2, 0] > 1e-6).any()
    assert np.isnan(found.per_time.value[3]).all()
    parts = nsmaps.observe(map_of, diagram, CHOSEN, n_returns=64, parallel=nsmaps.Parallel(part=1))
    assert np.array_equal(parts.per_time.value, found.per_time.value, equal_nan=True)


def test_attractors_have_means_of_their_own(pair: ImpactSystem) -> None:
    bistable = pair.at(r=0.25, g_bar=0.1245 * 9.8 * np.sin(pi / 6) / 5, d=0.2265)
    starts = [[0.6, 0.3], [0.3, 2.0], [0.9, 5.0], [0.1, 1.0]]
    basins = nsmaps.basins(bistable, starts)
    found = nsmaps.observe(bistable, basins.attractors, ["loss", "impacts"])
    assert found.per_period.value.shape == (len(basins.attractors), 2)
    for attractor, row in zip(basins.attractors, found.per_period.value, strict=True):
        if attractor.label == "2:1/T":
            assert row[1] == pytest.approx(3.0)


def test_orbits_under_noise_have_means_over_realisations(pair: ImpactSystem) -> None:
    def realised(sigma: float) -> nsmaps.dynamics.noise.orbits.NoisyOrbits:
        return nsmaps.noisy_orbits(
            pair,
            [0.83338599, 0.36361156],
            nsmaps.Noise(sigma=sigma, tau=0.5),
            n_returns=30,
            n_realisations=6,
            max_impacts=100,
        )

    quiet = nsmaps.observe(pair, realised(0.0), ["loss", "speed"])
    exact = nsmaps.observe(pair, nsmaps.periodic_orbit(pair, [0.83, 0.36]), ["loss", "speed"])
    assert np.allclose(quiet.per_period.value, exact.per_period.value, rtol=1e-6)
    noisy = nsmaps.observe(pair, realised(0.05), ["loss", "speed", {"name": "hardest", "formula": "v", "largest": True}])
    assert (noisy.per_period.error[:2] > 1e-4).all()
    assert noisy.per_period.value[2] > 0.84
    with pytest.raises(nsmaps.NsmapsError, match=message("dynamics.flights-under-noise", name="work")):
        nsmaps.observe(pair, realised(0.05), ["work"])
    few = nsmaps.noisy_orbits(
        pair, [0.83, 0.36], nsmaps.Noise(sigma=0.05, tau=0.5), n_returns=30, n_realisations=6, max_impacts=10
    )
    with pytest.raises(nsmaps.NsmapsError, match=message("dynamics.impacts-under-noise", number=10)):
        nsmaps.observe(pair, few, ["loss"])


def test_orbits_and_parameters_that_are_not_there_are_refused(pair: ImpactSystem) -> None:
    orbit = nsmaps.periodic_orbit(pair, [0.83, 0.36])
    with pytest.raises(nsmaps.NsmapsError, match=message("errors.unknown", kind="parameter", name="q")):
        nsmaps.observe(pair, orbit, ["loss"], rates={"q": 1.0})
    with pytest.raises(nsmaps.NsmapsError, match=message("dynamics.lost-orbit")):
        nsmaps.observe(pair, nsmaps.periodic_orbit(pair, [np.nan, 1.0]), ["loss"])


class Racket(HybridSystem):
    """A ball on a racket that adds 1 to half of its speed, without parameters; its height has a word of Python as name."""

    states = ("lambda", "v")

    def modes(self, t, y):
        return {"flight": {"lambda": y.v, "v": -1}}

    def guards(self, t, y):
        return {"R": Guard("flight", getattr(y, "lambda"), reset={"v": 1 - y.v / 2})}

    def section(self, t, y):
        return PoincareSection("R", ("v",))


def test_a_system_without_parameters_has_derivatives_by_states() -> None:
    """The integral of the height's square after an impact of speed v is 4/15 (1 - v/2)^5, that of the speed is zero."""
    racket, chosen = Racket(), (Observable(name="square", formula="lambda**2 + v", of="flights"),)
    v = np.array([[-1.0], [-0.2], [-3.0]])
    slopes = slopes_of(racket, plan_of(racket, chosen), v, np.zeros(0))
    assert slopes[:, 0, 0] == pytest.approx(-2 / 3 * (1 - v[:, 0] / 2) ** 4, rel=1e-12)
    assert (slopes[:, 0, 1] == 0).all()
    orbit = nsmaps.periodic_orbit(racket, [-1.9])
    found = nsmaps.observe(racket, orbit, chosen).per_return
    assert orbit.states[0, 0] == pytest.approx(-2)
    assert found.value == pytest.approx(4 / 15 * 2**5)
    assert found.derivative == pytest.approx(0, abs=0)


class Served(Racket):
    """The same ball with its weight as a parameter."""

    g: float = 1.0

    def modes(self, t, y):
        return {"flight": {"lambda": y.v, "v": -self.g}}


def test_derivatives_along_no_parameter_are_zero(pair: ImpactSystem) -> None:
    """Of a system with walls and of one with modes, whose derivative by its parameter is not."""
    for system, state, speed in ((pair, [0.8, 0.4], "velocity"), (Served(), [-1.0], "v")):
        plan = plan_of(system, (Observable(name="square", formula=f"{speed}**2", of="flights"),))
        rates = np.zeros(len(system.parameters))
        slopes = slopes_of(system, plan, np.array([state]), rates)
        assert np.isfinite(slopes).all()
        assert (slopes[..., -1] == 0).all()
        assert (slopes_of(system, plan, np.array([state]), rates + 1)[..., -1] != 0).all()
