"""Optima of observables over parameters: closed forms, conditions that bind, gradients, and what is refused."""

import re
from collections.abc import Callable
from itertools import pairwise
from math import pi
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from messages import message
from nsmaps_vi_pair import VIPair

import nsmaps
from nsmaps.dynamics.design.conditions import stability

PAIR = nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113275192854541)
NEAR = {"d": 0.35, "g_bar": 0.2113275192854541}
BOUNDS = {"d": (0.2, 1.2), "g_bar": (-0.1, 0.24)}
START = [0.83, 0.36]
BALL = nsmaps.load_system("bouncing_ball", Gamma=1.15, r=0.5)
RECOIL = nsmaps.load_system("recoil_pair", eta=0.1, kappa=0.04, Lambda=0.2, d=0.35, r=0.5, g_bar=0.2113)
ALONE: dict[str, Any] = {"bounds": {"d": (0.34, 0.355)}, "guess": {"d": 0.35}}
TABLE = {"Gamma": (1.1, 1.2), "r": (0.3, 0.7)}


@pytest.fixture(scope="module")
def harvester() -> nsmaps.dynamics.Optimum:
    return nsmaps.optimize(PAIR.at, "loss", BOUNDS, guess=NEAR, start=START, motion="1:1/T", n_guesses=3)


def test_all_starts_lead_to_the_optimum_of_the_closed_form(harvester: nsmaps.dynamics.Optimum) -> None:
    """No 1:1 motion of the pair loses more in a period than 4 (1 + r)/(pi^2 (1 - r)), and one without tilt loses that.

    With impacts at the phases a and b the work of the forcing is (1 + r)(v sin a - w sin b)/pi <= (1 + r)(v + w)/pi, the loss
    (1 - r^2)(v^2 + w^2)/2, and the impacts balance gravity, (1 + r)(v - w) = 2 g_bar. So the loss is bounded, most at v = w. Both
    impacts are in phase with the velocity of the capsule if flights last half a period: g_bar = 0, d = (1 + r)/(pi (1 - r)).
    """
    r = PAIR.r
    expected = {"d": (1 + r) / (pi * (1 - r)), "g_bar": 0.0}
    assert len(harvester.attempts) == 3
    for attempt in harvester.attempts:
        assert attempt.feasible
        assert attempt.end == pytest.approx(expected, rel=1e-6, abs=1e-6 * 0.34)
        assert attempt.value == pytest.approx(4 * (1 + r) / (pi**2 * (1 - r)), rel=1e-12)
    assert harvester.active == ()
    assert harvester.residual < 1e-6
    assert harvester.orbit.word == "BTB"
    assert harvester.orbit.states[0] == pytest.approx([2 / (pi * (1 - r)), pi / 2], rel=1e-6)
    assert harvester.evaluations == sum(attempt.evaluations for attempt in harvester.attempts) > 3


def least_restitution(bound: Any, drive: Any) -> Any:
    """The restitution at which a multiplier of the ball's motion is the bound; see `test_chart.py` for the multipliers."""

    def at(s: Any) -> Any:
        q = mp.sqrt(drive**2 - s**2) / mp.pi
        return (1 - q) / (1 + q)

    def beyond(s: Any) -> Any:
        return bound + at(s) ** 2 / bound - 1 - at(s) ** 2 + (1 + at(s)) ** 2 * s

    return at(mp.findroot(beyond, 0.04))


@pytest.mark.thorough
def test_an_optimum_on_the_bound_of_a_multiplier_has_the_closed_form() -> None:
    """The ball's loss is 2 pi^2 (1 - r)/(1 + r), so that r is as small as the multiplier 0.9 and the drive allow."""
    found = nsmaps.optimize(
        BALL.at, "loss", TABLE, guess={"Gamma": 1.15, "r": 0.5}, start=[4.2, 0.4], multiplier=0.9, n_guesses=1
    )
    with mp.workdps(30):
        r = least_restitution(mp.mpf("0.9"), mp.mpf("1.2"))
        slope = -4 * mp.pi**2 / (1 + r) ** 2
        by_bound = slope * mp.diff(lambda bound: least_restitution(bound, mp.mpf("1.2")), mp.mpf("0.9"))
        by_drive = slope * mp.diff(lambda drive: least_restitution(mp.mpf("0.9"), drive), mp.mpf("1.2"))
        assert found.value == pytest.approx(float(2 * mp.pi**2 * (1 - r) / (1 + r)), rel=1e-8)
    assert found.parameters == pytest.approx({"Gamma": 1.2, "r": float(r)}, rel=1e-6)
    assert found.active == ("multiplier", "Gamma")
    assert found.gradient == pytest.approx({"Gamma": 0.0, "r": float(slope)}, rel=1e-8, abs=1e-8)
    gains = {one.name: one.gain for one in found.conditions}
    assert gains["multiplier"] == pytest.approx(float(by_bound), rel=1e-5)
    assert gains["Gamma"] == pytest.approx(float(by_drive), rel=1e-5)
    assert found.residual < 1e-8
    assert {one.name: one.margin for one in found.conditions}["multiplier"] == pytest.approx(0.0, abs=1e-7)


def value_at(system: Any, orbit: nsmaps.dynamics.PeriodicOrbit) -> float:
    """The loss per period of the motion near one, refined by Newton's method."""
    found = nsmaps.periodic_orbit(system, orbit.states, len(orbit.states))
    assert found.words == orbit.words
    return float(nsmaps.observe(system, found, ["loss"]).per_period.value[0])


def differences(system_of: Callable[..., Any], found: nsmaps.dynamics.Optimum, steps: dict[str, float]) -> dict[str, float]:
    """The derivatives of the loss by the parameters: central differences of four widths, extrapolated (Romberg)."""
    slopes = {}
    for name, step in steps.items():
        rows = []
        for k in range(4):
            h = step / 2**k
            ends = [value_at(system_of(**{**found.parameters, name: found.parameters[name] + x}), found.orbit) for x in (h, -h)]
            rows.append((ends[0] - ends[1]) / (2 * h))
        for order in (1, 2, 3):
            rows = [(4**order * b - a) / (4**order - 1) for a, b in pairwise(rows)]
        slopes[name] = rows[0]
    return slopes


@pytest.mark.parametrize(
    ("system", "bounds", "start", "steps"),
    [
        (PAIR, {"d": (0.34, 0.36), "r": (0.45, 0.55)}, START, {"d": 4e-3, "r": 8e-3}),
        (RECOIL, {"d": (0.34, 0.36), "kappa": (0.03, 0.05)}, [0.84, 0.19, -0.67, 0.32], {"d": 4e-3, "kappa": 4e-3}),
    ],
    ids=["vi_pair", "recoil_pair"],
)
def test_the_gradient_is_that_of_extrapolated_differences(
    system: Any, bounds: dict[str, tuple[float, float]], start: list[float], steps: dict[str, float]
) -> None:
    """On the bounds of the parameters, where the gradient does not vanish; its gains are the gradient's sizes."""
    guess = nsmaps.orbit(system, start, 500).final
    x0 = {name: sum(ends) / 2 for name, ends in bounds.items()}
    found = nsmaps.optimize(system.at, "loss", bounds, guess=x0, start=guess, n_guesses=1)
    assert found.active == tuple(bounds)
    assert found.gradient == pytest.approx(differences(system.at, found, steps), rel=1e-8)
    assert found.conditions[-1].gain == pytest.approx(abs(found.gradient[found.conditions[-1].name]), rel=1e-12)


def harvester_of(s: float, beta: float) -> Any:
    """The pair by the length of the capsule in m and its tilt in radians."""
    return VIPair(s=s, beta=beta, M=0.1245, g=9.8, F=5, omega=5 * pi)


@pytest.mark.thorough
def test_physical_parameters_have_the_same_optimum() -> None:
    found = nsmaps.optimize(
        harvester_of,
        "loss",
        {"s": (0.5, 2.0), "beta": (-0.2, pi / 2)},
        guess={"s": 0.6, "beta": 0.5},
        start=[0.85, 0.5],
        n_guesses=1,
    )
    assert found.parameters == pytest.approx({"s": 3 / pi * 5 / (0.1245 * 25), "beta": 0.0}, rel=1e-6, abs=1e-6)


@pytest.fixture(scope="module")
def double() -> tuple[Any, ...]:
    """The first arguments for the motion with two impacts on B in a period."""
    pair = nsmaps.load_system("vi_pair", d=0.2, r=0.25, M=0.1245, g=9.8, beta=pi / 6, F=5)
    return pair, "loss", {"d": (0.15, 0.3)}, nsmaps.orbit(pair, [0.5, 0.5], 2000).final


def test_impacts_stay_away_from_a_graze(double: tuple[Any, ...]) -> None:
    found = nsmaps.optimize(*double, period=2, graze=0.15, n_guesses=2)
    assert found.active == ("impact speed",)
    assert found.attempts[0].end == pytest.approx(found.attempts[1].end, rel=1e-6)
    hits = double[0].at(**found.parameters).impacts(found.orbit.states[0], 4)
    assert hits.speed.min() == pytest.approx(0.15 * hits.speed[hits.wall == 0].max(), rel=1e-6)
    gain = {one.name: one.gain for one in found.conditions}["impact speed"]
    wider = nsmaps.optimize(*double, period=2, graze=0.1499, n_guesses=1)
    assert (wider.value - found.value) / 1e-4 == pytest.approx(gain, rel=0.01)
    assert found.residual < 1e-6


@pytest.mark.thorough
def test_a_flight_that_turns_back_beside_a_wall_ends_the_search(double: tuple[Any, ...]) -> None:
    """The loss falls with d to where a flight first turns back, at once nearer to the wall than the margin."""
    found = nsmaps.optimize(*double, period=2, sense="min", graze=0.02, n_guesses=1)
    (attempt,) = found.attempts
    assert attempt.feasible
    assert "edge" in attempt.message

    def nearest(d: float) -> float:
        orbit = nsmaps.periodic_orbit(double[0].at(d=d), found.orbit.states, 2)
        return float(double[0].at(d=d).itineraries(orbit.states).clearance.min())

    d = found.parameters["d"]
    assert nearest(d) > 20 * nearest(d - 1e-4)
    assert found.active == ("existence",)
    assert found.residual > 0.01
    assert not attempt.optimal


@pytest.mark.thorough
def test_a_class_that_refuses_some_parameters_shortens_the_steps() -> None:
    """Beyond d = 0.8 there is no system, and the optimum is beyond: every start ends below, none with an error."""

    def short(d: float, g_bar: float) -> VIPair:
        if d > 0.8:
            raise nsmaps.NsmapsError(f"d is {d:g}; expected: up to 0.8")
        return VIPair(d=d, g_bar=g_bar)

    found = nsmaps.optimize(short, "loss", {"d": (0.2, 1.2), "g_bar": (0.0, 0.24)}, guess=NEAR, start=START, n_guesses=2)
    assert all(attempt.feasible and attempt.end["d"] <= 0.8 for attempt in found.attempts)
    assert found.parameters["d"] == pytest.approx(0.8, abs=1e-4)
    assert [attempt.start["d"] for attempt in found.attempts] == pytest.approx([0.35, 0.7])
    assert "existence" in found.active


@pytest.mark.thorough
def test_a_share_of_the_basin_takes_from_the_optimum(harvester: nsmaps.dynamics.Optimum) -> None:
    """The share is counted again from orbits of the same states."""
    grid = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.05, high=1.95, points=12), "phi": nsmaps.Axis(low=0, high=6, points=12)})
    how = PAIR.at(d=0.7, g_bar=0.1), "loss", {"d": (0.5, 1.2)}, [1.08, 1.0]
    found = nsmaps.optimize(*how, states=grid, share=0.8, n_guesses=1, max_returns=300, tolerances={"d": 0.01})
    assert found.active == ("share",)
    shares = []
    for d in found.parameters["d"] + np.array([0, 0.01, -0.01, 7e-4, -7e-4]):
        system = PAIR.at(g_bar=0.1, d=d)
        cycle = nsmaps.periodic_orbit(system, found.orbit.states).states[0]
        last = nsmaps.orbit(system, grid.states(), 300).final
        shares.append((np.abs(last - cycle).max(axis=1) < 1e-4).mean())
    assert 0.8 <= min(shares) == found.conditions[-1].value
    assert 0.8 * harvester.value < found.value < harvester.value
    assert np.isnan([found.residual, found.conditions[-1].gain]).all()
    assert found.basins is not None
    assert found.basins.fractions[0] == shares[0]


@pytest.mark.thorough
@pytest.mark.parametrize("tolerance", [0.01, 0.01 * (1 + 1e-13)])
def test_a_share_that_changes_erratically_is_kept_near_the_most_whatever_the_rounding(tolerance: float) -> None:
    """A search that continues from one point ends between 57.8/64.5 and 66.7/64.5, or without one, by such changes."""
    grid = nsmaps.Grid(
        axes={"v": nsmaps.Axis(low=0.05, high=1.95, points=16), "phi": nsmaps.Axis(low=0, high=2 * pi * 15 / 16, points=16)}
    )
    bounds, kept = {"d": (0.3, 1.2), "g_bar": (0, 0.24402)}, {"d": tolerance, "g_bar": 0.01}
    how = PAIR.at, {"name": "energy", "formula": "(v**2 - v_after**2)/2"}, bounds, START
    found = nsmaps.optimize(
        *how, guess=NEAR, motion="1:1/T", states=grid, share=0.9, tolerances=kept, max_returns=300, n_guesses=1
    )
    assert found.conditions[-1].value >= 0.9
    assert found.value > 66.3 / 64.5


class TwoWells(nsmaps.PiecewiseMap):
    """x' = y, y' = a y - x/5 - y^3 + c in units U: two fixed points, x = y, with x (a - 6/5) - x^3 + c = 0, share the states."""

    a: float
    c: float
    U: float = 1.0
    coordinates = ("x", "y")

    def pieces(self, s: Any) -> Any:
        return {"A": (True, {"x": s.y, "y": self.a * s.y - s.x / 5 - s.y**3 / self.U**2 + self.c * self.U})}


def wells_on_a_grid(starts: np.ndarray, share: float, points: int = 41) -> float:
    """The largest x of the upper fixed point on a grid of parameters where it, and the neighbours on the grid, hold a share."""
    a, c = (axis[..., None] for axis in np.meshgrid(np.linspace(1.4, 2.9, points), np.linspace(-0.2, 0.4, points), indexing="ij"))
    cycle = np.full_like(a, 1.3)
    for _ in range(50):
        cycle = cycle - ((a - 1.2) * cycle - cycle**3 + c) / (a - 1.2 - 3 * cycle**2)
    x, y = (np.broadcast_to(part, (points, points, len(starts))) for part in starts.T)
    with np.errstate(all="ignore"):
        for _ in range(200):
            x, y = y, a * y - x / 5 - y**3 + c
        holds = ((np.abs(x - cycle) < 1e-6) & (np.abs(y - cycle) < 1e-6)).mean(axis=2) >= share
    inner = holds[1:-1, 1:-1] & holds[2:, 1:-1] & holds[:-2, 1:-1] & holds[1:-1, 2:] & holds[1:-1, :-2]
    return float(cycle[1:-1, 1:-1, 0][inner].max())


@pytest.mark.thorough
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_a_share_of_another_map_has_the_optimum_of_a_grid_in_any_units(unit: float) -> None:
    starts = np.random.default_rng(3).uniform(-1.5, 1.5, (100, 2))
    how: Any = {"name": "x", "formula": "x/U"}, {"a": (1.4, 2.9), "c": (-0.2, 0.4)}, [0.9 * unit, 0.9 * unit]
    given: dict[str, Any] = {
        "guess": {"a": 2.0, "c": 0.0},
        "states": starts * unit,
        "share": 0.85,
        "max_returns": 200,
        "n_guesses": 1,
    }
    found = nsmaps.optimize(lambda a, c: TwoWells(a=a, c=c, U=unit), *how, **given)
    assert found.conditions[-1].value >= 0.85
    assert found.value > wells_on_a_grid(starts, 0.85)


class Cubic(nsmaps.PiecewiseMap):
    """x' = a x - x^3 + b."""

    a: float
    b: float
    coordinates = ("x",)

    def pieces(self, s: Any) -> Any:
        return {"A": (True, {"x": self.a * s.x - s.x**3 + self.b})}


@pytest.mark.thorough
def test_a_share_that_few_parameters_hold_is_found() -> None:
    """A tenth of the bounds holds it, far from the optimum without it; the share is counted again in a loop."""
    bounds, states = {"a": (1.2, 2.2), "b": (0.0, 1.0)}, np.linspace(-2.5, 2.5, 60)
    how: dict[str, Any] = {"states": states[:, None], "share": 0.6, "max_returns": 200, "n_guesses": 1}
    found = nsmaps.optimize(Cubic(a=1.5, b=0.1), "x", bounds, [0.8], **how)
    a, b, x = found.parameters["a"], found.parameters["b"], states
    with np.errstate(all="ignore"):
        for _ in range(200):
            x = a * x - x**3 + b
        assert (np.abs(x - found.orbit.states[0]) < 1e-6).mean() >= 0.6
    assert found.value > 0.85


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"multiplier": 0.2, **ALONE},
            message("dynamics.no-optimum", multiplier=re.compile("0.8.*"), most=0.2),
        ),
        (
            {"motion": "2:1/T"},
            message("dynamics.other-motion", place="d = 0.35, g_bar = 0.211328", motion="1:1/T", word="BTB", expected="2:1/T"),
        ),
        (
            {"bounds": {"d": (0.2, 0.3)}, "guess": {"d": 0.35}},
            message("dynamics.start-outside", name="d", start=0.35, low=0.2, high=0.3),
        ),
        ({"bounds": {"d": (0.3, float("inf"))}, "guess": {"d": 0.35}}, message("dynamics.start-outside")),
        ({"guess": {"d": 0.35}}, message("dynamics.bounds-and-guess", bounds="d, g_bar", guess="d")),
        ({"sense": "most"}, message("errors.value", name="sense", value="'most'", expected="'max' or 'min'")),
        ({"period": "min"}, message("errors.value", name="period", value="'min'", expected="a whole number, as in optimize")),
        ({"n_guesses": 0}, message("dynamics.count", name="n_guesses", value=0)),
        ({"n_guesses": 2.5}, message("errors.value", name="n_guesses", value=2.5, expected="a whole number")),
        ({"max_returns": -1}, message("errors.value", name="max_returns", value=-1, expected="a whole number")),
        ({"graze": "0.1"}, message("errors.value", name="graze", value="'0.1'", expected="a number")),
        ({"bounds": {"d": 0.3, "g_bar": (0, 1)}}, message("dynamics.bounds")),
        ({"bounds": {"q": (0.3, 1)}, "guess": {"q": 0.5}}, message("errors.unknown", kind="parameter", name="q")),
        ({"multiplier": 1.5}, message("dynamics.conditions", multiplier=1.5, graze=0.01, share=0)),
        ({"share": 0.5}, message("dynamics.share", share=0.5)),
        ({"tolerances": {"r": 0.1}}, message("dynamics.tolerances", name="r", value=0.1, names="d, g_bar")),
        ({"tolerances": {"d": 0.0}}, message("dynamics.tolerances", name="d", value=0)),
        ({"per": "year"}, message("errors.value", name="per", value="'year'", expected="'period' or 'return' or 'time'")),
        ({"observable": "los"}, message("exact.observable-near", name="los", map="VIPair", near="loss")),
        (
            {"observable": {"name": "peak", "formula": "v", "largest": True}},
            message("dynamics.no-derivative", name="peak", place=re.compile("d = 0.35.*")),
        ),
        ({"start": [0.01, 3.0], "period": 7}, message("dynamics.no-orbit-from-start", place="d = 0.35, g_bar = 0.211328")),
        (
            {"graze": 0.06, "start": [0.0820254, 3.7085256], "period": 3},
            message("dynamics.margin", place="d = 0.35, g_bar = 0.211328", least=0.06),
        ),
        (
            {"states": [[1.9, 0.1]], "share": 1.0, "max_returns": 1, **ALONE},
            message("dynamics.basin-of-optimum", most=0, states=1),
        ),
    ],
)
def test_what_cannot_be_answered_is_refused(changes: dict[str, Any], said: str) -> None:
    given = {"observable": "loss", "bounds": BOUNDS, "guess": NEAR, "start": START, "n_guesses": 1} | changes
    with pytest.raises(nsmaps.NsmapsError, match=said):
        nsmaps.optimize(PAIR, **given)


def test_a_function_needs_the_first_parameters() -> None:
    with pytest.raises(nsmaps.NsmapsError, match=message("dynamics.no-system-or-guess", guess="None")):
        nsmaps.optimize(PAIR.at, "loss", BOUNDS, START)


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_the_numbers_of_stability_are_determinants(n: int) -> None:
    """det(1 - J), det(1 + J), and det(1 - B) with the bialternate square B, the minors of two rows and two columns."""
    matrix, bound = np.random.default_rng(n).normal(size=(n, n)), 0.9
    scaled = matrix / bound
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    minors = np.array([[np.linalg.det(scaled[np.ix_(rows, columns)]) for columns in pairs] for rows in pairs])
    expected = [np.linalg.det(np.eye(n) - scaled), np.linalg.det(np.eye(n) + scaled)]
    expected.append(np.linalg.det(np.eye(len(pairs)) - minors) if pairs else 1.0)
    assert stability(matrix, bound) == pytest.approx(expected, rel=1e-10, abs=1e-12)
