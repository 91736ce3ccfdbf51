"""The Duffing oscillator and the pendulum with a stop against Taylor series in 40 digits, and what is known of them."""

import json
import sys

import numpy as np
import pytest
from flint import arb, ctx
from nsmaps_duffing import DuffingStop
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_pendulum import PendulumStop
from scipy.integrate import solve_ivp
from taylor_flights import DIGITS, Stop, cubic, sine

import nsmaps
from nsmaps.dynamics.attractors.basins import basins
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.walls import Wall
from nsmaps.study.pictures.draw import draw

pytest.importorskip("heyoka")

SYSTEMS = {
    "hardening": DuffingStop(c=0.1, a=1, b=0.5, f=0.7, w=0.81, d=0.6, r=0.8),
    "two wells": DuffingStop(c=0.1, a=-1, b=1, f=0.4, w=1.2, d=0.9, r=0.7),
    "pendulum": PendulumStop(c=0.1, f=0.5, w=0.7, stop=0.5, r=0.8),
}


def reference(system):
    """The same system in balls."""
    values = {name: arb(value) for name, value in system.parameters.items()}
    if isinstance(system, PendulumStop):
        return Stop(sine, values["c"], values["f"], values["w"], values["stop"], values["r"])
    return Stop(cubic(values["a"], values["b"]), *(values[name] for name in "cfwdr"))


def next_to_a_graze(system, distance):
    """States on either side of a graze, at most this distance apart."""
    states = np.column_stack([np.full(400, 0.5), np.linspace(0, 6.28, 400)])
    codes = system.itineraries(states).codes
    k = next(k for k in range(399) if codes[k] != codes[k + 1])
    low, high = states[k], states[k + 1]
    while np.abs(high - low).max() > distance:
        middle = (low + high) / 2
        codes = system.itineraries([low, middle]).codes
        low, high = (middle, high) if codes[0] == codes[1] else (low, middle)
    return low, high


def trial_states(system):
    """Random states, slow ones, and some next to a graze."""
    rng = np.random.default_rng(8)
    states = np.column_stack([rng.uniform(0.05, 2, 22), rng.uniform(0, 6.28, 22)])
    states[:6, 0] = 10.0 ** -np.arange(2, 13, 2)
    return np.vstack([states, *(next_to_a_graze(system, distance) for distance in (1e-3, 1e-6, 1e-9))])


@pytest.mark.parametrize("name", SYSTEMS)
def test_first_returns_have_the_digits_of_taylor_series(name):
    system = SYSTEMS[name]
    states = trial_states(system)
    returns = system.first_return(states, derivative=True, chatter=0)
    assert set(returns.counts()) <= {"returned", "undecided"}
    assert (returns.outcome[returns.image[:, 0] > 1e-5] == Outcome.returned).all()
    assert returns.words.tolist() == ["BB"] * len(states)
    with ctx.workdps(DIGITS):
        exact = reference(system)
        for i, (v, phi) in enumerate(states):
            speed, lifted, time = exact.first_return(arb(v), arb(phi))
            steep = max(1, np.abs(returns.derivative[i]).max())  # by which the rounding of a flight is multiplied
            assert abs(returns.image[i, 0] - speed) < 2e-15 * steep
            assert abs(returns.lifted[i, 1] - lifted) < 5e-15 * steep
            assert abs(returns.time[i] - time) < 5e-15 * steep
            if steep == 1:
                assert abs(returns.image[i, 0] / speed - 1) < 2e-14
                assert abs(returns.time[i] / time - 1) < 2e-14


@pytest.mark.parametrize(("name", "place"), [("hardening", {"d": -0.5}), ("two wells", {}), ("pendulum", {"stop": -0.5})])
def test_slow_returns_keep_relative_digits(name, place):
    system = SYSTEMS[name].at(**place)  # where the spring presses on the stop at many phases
    states = np.column_stack([10.0 ** np.linspace(-14, -3, 40), np.linspace(0, 62.8, 40)])
    returns = system.first_return(states, chatter=0)
    short = returns.time < 1e-2
    assert short.sum() > 10
    with ctx.workdps(DIGITS):
        exact = reference(system)
        for (v, phi), image, time in zip(states[short], returns.image[short], returns.time[short], strict=True):
            speed, _, expected = exact.first_return(arb(v), arb(phi))
            assert abs(image[0] / speed - 1) < 1e-13
            assert abs(time / expected - 1) < 1e-13


@pytest.mark.parametrize("name", SYSTEMS)
def test_derivatives_are_those_of_differences(name):
    system, step = SYSTEMS[name], arb(10) ** -16
    states = trial_states(system)[4:10]
    slopes = system.first_return(states, derivative=True).derivative
    ways = {parameter: system.sensitivity(states, {parameter: 1.0}) for parameter in system.parameters}
    with ctx.workdps(DIGITS):
        exact = reference(system)
        for i, (v, phi) in enumerate(states):
            base = exact.first_return(arb(v), arb(phi))
            for j in range(2):
                moved = exact.first_return(arb(v) + step * (j == 0), arb(phi) + step * (j == 1))
                difference = [(new - old) / step for new, old in zip(moved[:2], base[:2], strict=True)]
                assert slopes[i, :, j] == pytest.approx([float(x) for x in difference], rel=1e-11, abs=1e-12)
    for parameter, moves in ways.items():
        with ctx.workdps(DIGITS):
            up, down = (changed(system, parameter, sign * arb(10) ** -12).first_return(*map(arb, states[0])) for sign in (1, -1))
            difference = [float((a - b) / 2e-12) for a, b in zip(up[:2], down[:2], strict=True)]
        assert moves[0] == pytest.approx(difference, rel=1e-9, abs=1e-9)


def changed(system, parameter, change):
    """The reference with a parameter changed by a ball."""
    exact = reference(system)
    if parameter in "ab":
        values = {name: arb(getattr(system, name)) + (change if name == parameter else 0) for name in "ab"}
        return Stop(cubic(**values), exact.c, exact.f, exact.w, exact.d, exact.r)
    name = {"stop": "d"}.get(parameter, parameter)
    values = {field: getattr(exact, field) for field in ("spring", "c", "f", "w", "d", "r")}
    return Stop(**{**values, name: values[name] + change})


@pytest.mark.parametrize("wall", [0.6, 0, -0.3])
def test_without_its_cubic_term_it_is_the_linear_oscillator(wall):
    duffing = DuffingStop(c=0.1, a=1, b=0, f=0.7, w=0.81, d=wall, r=0.8)
    linear = ImpactOscillator(zeta=0.05, w=0.81, A=0.7, wall=wall, r=0.8)
    rng = np.random.default_rng(2)
    states = np.column_stack([rng.uniform(0, 2, 300), rng.uniform(0, 6.28, 300)])
    states[:50, 0] = 10 ** rng.uniform(-12, -1, 50)
    got, expected = (system.first_return(states, derivative=True) for system in (duffing, linear))
    assert got.words.tolist() == expected.words.tolist()
    assert got.outcome.tolist() == expected.outcome.tolist()
    steep = np.maximum(1, np.abs(expected.derivative).max(axis=(1, 2)))[:, None]
    assert np.nanmax(np.abs(got.lifted - expected.lifted) / steep) < 1e-13
    assert np.nanmax(np.abs(duffing.at(b=1e-9).first_return(states).lifted - expected.lifted) / steep) < 1e-7


class BriefPendulum(PendulumStop):
    """A pendulum whose flights are given up after 30 periods, as those beyond the graze of its branch are."""

    horizon = 30.0


@pytest.mark.parametrize(
    ("system", "start", "multiplier", "events"),
    [
        (
            DuffingStop(c=0.1, a=-1, b=1, f=0.5, w=1.2, d=0.9, r=0.8),
            [1.61489428, 0.35536591],
            -0.52926746 + 0.31464625j,
            {"down": ("fold", 0.2457434), "up": ("period doubling", 0.6318815)},
        ),
        (
            BriefPendulum(c=0.1, f=0.5, w=0.75, stop=0.5, r=0.8),
            [1.04491073, 6.11158166],
            0.095308 + 0.51752416j,
            {"down": ("grazing", 0.6707813), "up": ("fold", 1.3159637)},
        ),
    ],
)
def test_known_numbers_of_the_pages(system, start, multiplier, events):
    orbit = periodic_orbit(system, start)
    assert orbit.states[0] == pytest.approx(start, abs=1e-8)
    assert np.abs(orbit.multipliers - multiplier).min() < 1e-7
    with ctx.workdps(DIGITS):
        speed, lifted, _ = reference(system).first_return(*map(arb, orbit.states[0]))
        assert abs(speed - orbit.states[0, 0]) < 1e-13
        assert abs((lifted - orbit.states[0, 1]) / (2 * arb.pi()) - 1) < 1e-13
    parameter, bounds = ("f", (0.2, 0.7)) if isinstance(system, DuffingStop) else ("w", (0.5, 1.5))
    for direction, (kind, value) in events.items():
        branch = continue_branch(
            lambda x: system.at(**{parameter: x}),
            "x",
            orbit,
            getattr(system, parameter),
            bounds,
            direction=direction,
            until=(kind,),
        )
        assert [event.kind for event in branch.events][:1] == [kind]
        assert branch.events[0].value == pytest.approx(value, abs=1e-7)


def test_chatter_ends_in_the_release_that_single_impacts_approach():
    system = DuffingStop(c=0.1, a=1, b=0.5, f=0.5, w=0.5, d=-0.4, r=0.6)
    single = nsmaps.orbit(system, [0.05, 2.0], 60, chatter=0)
    summed = nsmaps.orbit(system, [0.05, 2.0], 60, chatter=np.inf)
    k = summed.words.tolist().index("B~")
    assert 5 < k < 40
    assert set(single.words) == {"BB"}
    release = summed.states[k + 1, 1]
    assert summed.states[k + 1, 0] == 0
    assert 0.5 * np.cos(release) == pytest.approx(-0.4 + 0.5 * -(0.4**3), abs=1e-14)  # the force of the wall vanishes
    assert single.states[-1, 0] < 1e-12
    assert single.final[1] < release


def test_a_stop_that_always_presses_ends_the_motion():
    system = DuffingStop(c=0.1, a=1, b=0.5, f=0.1, w=0.5, d=-0.4, r=0.6)
    assert system.first_return([[0.0, 1.0]]).counts() == {"rests": 1}


@pytest.mark.parametrize(("name", "parameter", "bounds"), [("hardening", "f", (0.5, 0.9)), ("pendulum", "f", (0.4, 0.7))])
def test_orbits_branches_exponents_and_basins(name, parameter, bounds):
    system = SYSTEMS[name]
    final = nsmaps.orbit(system, [0.8, 1.0], 400).final
    orbit = periodic_orbit(system, final)
    assert orbit.converged
    assert orbit.stable
    q = len(orbit.returns)
    r, c = system.r, system.c
    contraction = r ** (2 * q) * np.exp(-c * orbit.returns.time.sum())  # of areas, by Liouville's theorem
    assert np.prod(orbit.multipliers).real == pytest.approx(contraction, rel=1e-10)
    exponents = lyapunov(system, starts=final, n_returns=500, transient=0).exponents
    assert exponents.max() == pytest.approx(np.log(np.abs(orbit.multipliers).max()) / q, abs=1e-2)
    branch = continue_branch(lambda value: system.at(**{parameter: value}), "value", orbit, getattr(system, parameter), bounds)
    assert len(branch.points) > 5
    found = bifurcation_diagram(
        lambda value: system.at(**{parameter: value}), "value", np.linspace(*bounds, 5), [0.8, 1.0], transient=200, n_returns=20
    )
    assert len(found.values) == 5
    axes = {"v": nsmaps.Axis(low=0.1, high=1.5, points=6), "phi": nsmaps.Axis(low=0, high=6, points=6)}
    assert basins(system, nsmaps.Grid(axes=axes)).attractors[0].period == q


STUDY = """
title: a quick study
system: {file}
parameters: {parameters}
grid:
  v: {{from: 0.2, to: 1.5, points: 5}}
  phi: {{from: 0, to: 6, points: 5}}
families: {{BB: [BB]}}
orbits: [{{start: {{v: 0.8, phi: 1}}, n_returns: 60, track: 4}}]
bifurcation_diagram: {{parameter: f, from: 0.5, to: 0.6, points: 3, starts: [{{v: 0.8, phi: 1}}], transient: 100, n_returns: 20}}
branches: [{{name: main, parameter: f, bounds: [0.5, 0.6], start: {{v: 0.8, phi: 1}}, value: 0.55}}]
lyapunov: {{parameter: f, from: 0.5, to: 0.6, points: 2, starts: [{{v: 0.8, phi: 1}}], n_returns: 100, transient: 50}}
basins: {{max_returns: 300}}
figures: [surfaces, orbits, bifurcation_diagram, branches, lyapunov, basins, motion, impacts]
"""


@pytest.mark.parametrize("name", [pytest.param("hardening", marks=pytest.mark.thorough), "pendulum"])
def test_a_study_runs_to_its_end(name, tmp_path):
    system = SYSTEMS[name]
    file = f"{sys.modules[type(system).__module__].__file__}:{type(system).__name__}"
    (tmp_path / "quick.yaml").write_text(STUDY.format(file=file, parameters=json.dumps(system.parameters)))
    result = nsmaps.run_study(tmp_path / "quick.yaml", out=tmp_path / "run")
    paths = draw(result, ["bifurcation_diagram", "basins", "motion", "impacts", "surfaces"], tmp_path / "figures", dpi=40)
    assert all(path.stat().st_size > 1000 for path in paths)
    assert (result.orbits[0].exact.words == "BB").all()
    again = nsmaps.read_result(tmp_path / "run")
    assert np.array_equal(again.bifurcation_diagram["exact"].states, result.bifurcation_diagram["exact"].states, equal_nan=True)
    assert not result.surfaces["BB"].returns.certified.any()


class Corridor(PendulumStop):
    """A pendulum between two stops."""

    def walls(self):
        return {"B": Wall(at=self.stop, side=1), "T": Wall(at=-self.stop, side=-1)}


def by_events(system, v, phi):
    """The first return by Runge-Kutta steps with events: the word, speed and time. Flights start just inside the wall."""

    def rates(t, y):
        return [y[1], system.f * np.cos(system.w * t) - system.c * y[1] - np.sin(y[0])]

    def wall(side):
        def gap(t, y):
            return side * y[0] - system.stop

        gap.terminal, gap.direction = True, 1
        return gap

    word, side, speed, t = "B", 1, v, phi / system.w
    while word in "BT" or word[-1] != "B":
        start = [side * (system.stop - 1e-13), -side * system.r * speed]
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "max_step": 0.02}
        flown = solve_ivp(rates, (t, t + 100), start, events=[wall(1), wall(-1)], **options)
        side = 1 if len(flown.t_events[0]) else -1
        word, t, speed = word + ("B" if side == 1 else "T"), flown.t[-1], abs(flown.y[1, -1])
    return word, speed, t - phi / system.w


def test_words_between_two_stops_are_those_of_an_integrator_with_events():
    system = Corridor(c=0.1, f=1.5, w=1.3, stop=0.6, r=0.8)
    rng = np.random.default_rng(6)
    states = np.column_stack([rng.uniform(0.1, 1.5, 60), rng.uniform(0, 6.28, 60)])
    returns = system.first_return(states, margin=True)
    clear = returns.valid & (returns.margin.clearance > 1e-3) & (returns.margin.slowest > 1e-2)
    assert clear.sum() > 40
    assert {"BB", "BTB", "BTTB"} <= set(returns.words[clear])
    for k in np.flatnonzero(clear):
        word, speed, time = by_events(system, *states[k])
        assert word == returns.words[k]
        assert speed == pytest.approx(returns.image[k, 0], abs=1e-8)
        assert time == pytest.approx(returns.time[k], abs=1e-8)
