"""The square-root map: references M4a and M4b, the closed forms of its windows at other parameters, and its studies."""

import mpmath as mp
import numpy as np
import pytest
from nsmaps_square_root import SquareRoot, SquareRootPlane
from piecewise_references import numbers, rows

import nsmaps
from nsmaps.proof.maps.prove import prove_map
from nsmaps.testing import check_system
from nsmaps.verify.certificate import verify

LINE, PLANE = rows("M4a"), rows("M4b")
WINDOWS = [(float(case["parameters"]["a"]), window) for case in LINE["cases"] for window in case["windows"]]
STABLE = [pair for pair in WINDOWS if pair[1]["stable_window"]]
LONG = [(cls, run) for cls, table in ((SquareRoot, LINE), (SquareRootPlane, PLANE)) for run in table["long_runs"]]
RETURNS = 50_000  #: of a run whose exponents are compared


def named(value):
    return value["word"] if isinstance(value, dict) and "word" in value else None


def letters(words):
    return "".join(words)


@pytest.mark.parametrize(("a", "window"), STABLE, ids=named)
def test_a_cycle_of_a_window(a, window):
    """From a guess a percent away: word, point, multiplier, and the exponent of an orbit on it."""
    sample, period = window["sample"], window["period"]
    system = SquareRoot(a=a, mu=float(sample["mu"]))
    orbit = nsmaps.periodic_orbit(system, [1.01 * float(sample["point_R"])], period)
    assert letters(orbit.words) == "R" + window["word"][:-1]
    assert orbit.exists
    assert orbit.stable
    assert orbit.states[0, 0] == pytest.approx(float(sample["point_R"]), rel=1e-12)
    assert orbit.multipliers[0].real == pytest.approx(float(sample["multiplier"]), rel=1e-12)
    run = nsmaps.lyapunov(system, starts=orbit.states[0], n_returns=32 * period, transient=100)
    assert run.exponents[0] == pytest.approx(float(sample["exponent"]), rel=1e-11)


@pytest.mark.parametrize(("a", "window"), STABLE, ids=named)
def test_a_window_begins_at_its_doubling(a, window):
    sample, value = window["sample"], float(window["mu_period_doubling"])
    system = SquareRoot(a=a, mu=float(sample["mu"]))
    orbit = nsmaps.periodic_orbit(system, [float(sample["point_R"])], window["period"])
    branch = nsmaps.continue_branch(system, "mu", orbit, system.mu, (value / 2, 2 * system.mu), direction="down", step=0.5)
    assert branch.events[0].kind == "period doubling"
    assert branch.events[0].value == pytest.approx(value, rel=1e-12)


def root(a, n, mu):
    """The square root of the point of L^(n-1) R on the right, in 40 digits: s^2 + a^(n-1) s = mu (1 - a^n)/(1 - a)."""
    with mp.workdps(40):
        a, mu = mp.mpf(a), mp.mpf(mu)
        half = a ** (n - 1) / 2
        return mp.sqrt(half**2 + mu * (1 - a**n) / (1 - a)) - half


def doubling_and_border(a, n):
    with mp.workdps(40):
        a = mp.mpf(a)
        return 3 * a ** (2 * n - 2) * (1 - a) / (4 * (1 - a**n)), (a ** (n - 2) * (1 - a) / (1 - a ** (n - 1))) ** 2


@pytest.mark.parametrize(("a", "n"), [(0.37, 2), (0.13, 3), (0.62, 4), (0.41, 9)])
def test_windows_at_other_parameters(a, n):
    """Point, multiplier and doubling in closed form, of words down to windows of width 1e-7."""
    doubles, collides = doubling_and_border(a, n)
    system = SquareRoot(a=a, mu=float((doubles + collides) / 2))
    s = root(a, n, system.mu)
    orbit = nsmaps.periodic_orbit(system, [float(s**2) * (1 + 1e-3)], n)
    assert letters(orbit.words) == "R" + "L" * (n - 1)
    assert orbit.states[0, 0] == pytest.approx(float(s**2), rel=1e-12)
    assert orbit.multipliers[0].real == pytest.approx(float(-(mp.mpf(a) ** (n - 1)) / (2 * s)), rel=1e-12)
    bounds = float(doubles) / 2, 2 * system.mu
    branch = nsmaps.continue_branch(system, "mu", orbit, system.mu, bounds, direction="down", step=0.5)
    assert branch.events[0].value == pytest.approx(float(doubles), rel=1e-12)


@pytest.mark.parametrize(("a", "window"), WINDOWS, ids=named)
def test_a_window_ends_where_its_last_point_meets_the_border(a, window):
    """Also where it has no stable part, and where n - 1 returns contract to 6e-5: the cycle is known from the closed form."""
    n, value = window["period"], float(window["mu_border_collision"])
    assert float(doubling_and_border(a, n)[1]) == pytest.approx(value, rel=1e-14)
    assert float(doubling_and_border(a, n)[0]) == pytest.approx(float(window["mu_period_doubling"]), rel=1e-14)
    assert (doubling_and_border(a, n)[0] < value) == window["stable_window"]
    system = SquareRoot(a=a, mu=0.99 * value)
    orbit = nsmaps.periodic_orbit(system, [float(root(a, n, system.mu) ** 2)], n)
    assert (letters(orbit.words), orbit.stable) == ("R" + window["word"][:-1], window["stable_window"])
    bounds = 0.9 * value, 1.1 * value
    (event,) = nsmaps.continue_branch(system, "mu", orbit, system.mu, bounds, direction="up", step=0.5).events
    assert (event.kind, event.value) == ("border collision", pytest.approx(value, rel=1e-12))
    assert abs(event.value - value) <= event.precision
    assert f"state {n} (L) at x = 0, beyond which is R" in event.detail


@pytest.mark.parametrize("side", ["down", "up"])
def test_curves_of_doublings_and_borders_in_two_parameters(side):
    """Those of LLR for a from 0.4 to 0.9."""
    system = SquareRoot(a=0.5, mu=0.07)
    orbit = nsmaps.periodic_orbit(system, [0.06], 3)
    branch = nsmaps.continue_branch(system, "mu", orbit, system.mu, (0.01, 0.3), direction=side, step=0.5)
    curve = nsmaps.bifurcation_curve(system, branch.events[0], {"mu": (0.01, 0.3), "a": (0.4, 0.9)}, 0.5, step=0.1)
    mu, a = np.array(curve.parameters).T
    exact = [float(doubling_and_border(each, 3)[side == "up"]) for each in a]
    assert len(mu) > 8
    assert mu == pytest.approx(exact, rel=1e-13)


def test_the_fixed_point_with_an_impact_doubles():
    """s^2 + s = mu and -1/(2 s) = -1: at mu = 3/4, from above."""
    system = SquareRoot(a=0.5, mu=2.0)
    orbit = nsmaps.periodic_orbit(system, [1.1])
    assert orbit.states[0, 0] == pytest.approx(1.0, rel=1e-13)
    (event,) = nsmaps.continue_branch(system, "mu", orbit, 2.0, (0.5, 2.5), direction="down", until=["period doubling"]).events
    assert event.value == pytest.approx(0.75, rel=1e-12)


@pytest.mark.parametrize("case", PLANE["cases"], ids=named)
def test_a_cycle_in_the_plane(case):
    """Points, both multipliers and exponents, and the doubling, with the multipliers there."""
    given, points = numbers(case["parameters"]), np.array(case["points"], float)
    system = SquareRootPlane(**given)
    orbit = nsmaps.periodic_orbit(system, 1.01 * points[0], case["period"])
    multipliers = np.array(case["multipliers"], float)[:, 0]
    assert letters(orbit.words) == case["word"]
    assert orbit.stable
    assert np.abs(orbit.states / points - 1).max() < 1e-12
    assert orbit.multipliers.real == pytest.approx(multipliers, rel=1e-11)
    assert np.log(np.abs(orbit.multipliers)) / case["period"] == pytest.approx(np.array(case["exponents"], float), rel=1e-11)
    value = float(case["rho_period_doubling"])
    branch = nsmaps.continue_branch(system, "rho", orbit, system.rho, (value / 2, 1), direction="down", step=0.5)
    doubling = branch.events[0]
    assert (doubling.kind, doubling.value) == ("period doubling", pytest.approx(value, rel=1e-12))
    assert sorted(doubling.multipliers.real) == pytest.approx(
        [complex(each.replace(" ", "")).real for each in case["rho_period_doubling_multipliers"]], rel=1e-9
    )


@pytest.mark.parametrize("case", PLANE["cases"], ids=named)
def test_a_cycle_in_the_plane_ends_at_its_border(case):
    system, value = SquareRootPlane(**numbers(case["parameters"])), float(case["rho_border_collision"])
    orbit = nsmaps.periodic_orbit(system, np.array(case["points"][0], float), case["period"])
    bounds = system.rho / 2, 1.2 * value
    (event,) = nsmaps.continue_branch(system, "rho", orbit, system.rho, bounds, direction="up", step=0.5).events
    assert (event.kind, event.border) == ("border collision", "non-smooth fold")
    assert event.value == pytest.approx(value, rel=1e-13)
    there = [complex(each.replace(" ", "")).real for each in case["rho_border_collision_multipliers"]]
    assert event.multipliers.real == pytest.approx(there, rel=1e-9)


@pytest.mark.parametrize(("cls", "run"), LONG, ids=lambda part: part.__name__ if isinstance(part, type) else None)
def test_exponents_of_long_orbits(cls, run):
    system, known = cls(**numbers(run["parameters"])), run["lyapunov"]
    found = nsmaps.lyapunov(system, starts=np.full(len(system.coordinates), 0.01), n_returns=RETURNS)
    error = np.hypot(found.error, np.array(known["standard_errors"], float))
    assert (np.abs(found.exponents - np.array(known["values"], float)) < 5 * error).all()
    words = nsmaps.orbit(system, np.full(len(system.coordinates), 0.01), RETURNS).words
    assert (words == "R").mean() == pytest.approx(float(known["share_of_R"]), abs=2e-3)


def test_without_the_second_multiplier_the_plane_is_the_line():
    x = np.linspace(-0.4, 0.4, 9)
    line = SquareRoot(a=0.65, mu=0.1).first_return(x[:, None], derivative=True)
    plane = SquareRootPlane(alpha=0.65, gamma=0, rho=0.1).first_return(np.stack([x, 0 * x], axis=1), derivative=True)
    assert plane.image[:, 0] == pytest.approx(line.image[:, 0], abs=1e-16)
    assert plane.derivative[:, 0, 0] == pytest.approx(line.derivative[:, 0, 0], rel=1e-15)
    assert np.array_equal(plane.words, line.words)


def test_next_to_the_border_the_slope_grows_and_on_it_the_left_piece_holds():
    returns = SquareRoot(a=0.5, mu=0.1).first_return([[0.0], [5e-324], [1e-300]], derivative=True)
    assert returns.words.tolist() == ["L", "R", "R"]
    assert returns.derivative[:, 0, 0].tolist() == [0.5, pytest.approx(-0.5 / np.sqrt(5e-324)), -5e149]


def test_check_system_finds_no_fault():
    check_system(SquareRoot(a=0.5, mu=0.1))
    check_system(SquareRootPlane(alpha=0.5, gamma=0.05, rho=0.1))


def test_the_cells_that_are_proved_to_be_forward_invariant_cover_the_attractor():
    """The map carries [mu - sqrt(mu), mu] into itself, for a < 1: its cells and few beside them; the root there is steep."""
    pytest.importorskip("flint")
    made = prove_map(SquareRoot(a=0.8, mu=0.05), cycles=[([0.0023], 1)], start=[0.01], box=[[-0.5, 0.5]], n_cells=1024)
    proved = verify(made)
    low, high = (0.05 - np.sqrt(0.05) + 0.5) * 1024, (0.05 + 0.5) * 1024
    inside = np.flatnonzero(made.codes == 0)
    assert proved.closed.size == len(inside) < high - low + 4
    assert {*range(int(low) + 1, int(high))} <= set(inside.tolist())
