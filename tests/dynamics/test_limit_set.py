"""What orbits end on, against maps whose cycles and multipliers are known in closed form."""

from fractions import Fraction

import numpy as np
import pytest

import nsmaps
from nsmaps import CompositeMap, ConditionRegion, bifurcation_diagram, orbit, periodic_orbit
from nsmaps.coordinates import Angle
from nsmaps.dynamics.attractors.limit_set import limit_set
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.reduced import PolyMap
from nsmaps.reduced.composite.composite import Piece


class Henon(ReturnMap):
    """x' = 1 - a x^2 + y, y' = b x: a plain return map, every return of the word BB."""

    coordinates = ("x", "y")

    def __init__(self, a: float, b: float = 0.3, smooth: bool = True) -> None:
        self.a, self.b, self.smooth = a, b, smooth

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        x, y = start.T
        image = np.column_stack([1 - self.a * x**2 + y, self.b * x])
        slopes = np.zeros((len(start), 2, 2))
        slopes[:, 0, 0], slopes[:, 0, 1], slopes[:, 1, 0] = -2 * self.a * x, 1, self.b
        if not self.smooth:
            slopes[:] = np.nan
        n = len(start)
        outcome, codes = np.full(n, Outcome.returned, np.int8), np.full(n, nsmaps.exact.returns.encode("BB", ("B",)), np.int64)
        turns = np.zeros((n, 2), np.int32)
        return Returns(self.coordinates, ("B",), start, image, turns, codes, outcome, np.ones(n), slopes if derivative else None)


def ends_of(return_map, n=400, start=(0.1, 0.1)):
    return limit_set(return_map, nsmaps.orbit(return_map, start, n))


def two_cycle(a, b=0.3):
    """x of the two-cycle in closed form: roots of a^2 x^2 - a (1 - b) x + (1 - b)^2 - a, the least first."""
    return np.sort(np.roots([a**2, -a * (1 - b), (1 - b) ** 2 - a]))


def test_a_fixed_point_with_its_multipliers():
    a, b = 0.2, 0.3
    x = (-(1 - b) + np.sqrt((1 - b) ** 2 + 4 * a)) / (2 * a)
    found = ends_of(Henon(a))
    assert (found.period, found.stable) == (1, True)
    assert found.states == pytest.approx(np.array([[x, b * x]]), abs=1e-10)
    assert np.sort(found.multipliers.real) == pytest.approx(np.sort(np.roots([1, 2 * a * x, -b])), abs=1e-10)
    assert found.text.startswith("stable fixed point, ")
    assert f"({x:.5g}, {b * x:.5g})" in found.text


def test_a_two_cycle_with_its_multipliers_from_its_least_state_on():
    a, b = 0.8, 0.3
    x = two_cycle(a)
    found = ends_of(Henon(a))
    assert (found.period, found.looked, found.stable, found.words) == (2, 200, True, ("BB", "BB"))
    assert found.states[:, 0] == pytest.approx(x, abs=1e-10)
    assert found.states[:, 1] == pytest.approx(b * x[::-1], abs=1e-10)
    product = np.array([[-2 * a * x[1], 1], [b, 0]]) @ np.array([[-2 * a * x[0], 1], [b, 0]])
    expected = np.linalg.eigvals(product).astype(complex)
    assert np.sort_complex(found.multipliers) == pytest.approx(np.sort_complex(expected), abs=1e-9)
    assert "cycle of 2 returns" in found.text


@pytest.mark.parametrize(("a", "n"), [(0.85, 60), (0.85, 100), (0.88, 100), (0.88, 150)])
def test_a_cycle_that_is_still_approached_is_found_by_newtons_method_with_its_least_period(a, n):
    """Its multipliers are near to -1: the orbit is off by far more than rounding, now on one side and now on the other."""
    path = nsmaps.orbit(Henon(a), [0.1, 0.1], n)
    off = np.abs(np.sort(path.states[-2:, 0]) - two_cycle(a)).max()
    assert 1e-9 < off < 1e-3
    found = limit_set(Henon(a), path)
    assert (found.period, found.more) == (2, 0)
    assert found.states[:, 0] == pytest.approx(two_cycle(a), abs=1e-9)


@pytest.mark.parametrize(("a", "n"), [(0.9, 6), (0.8, 3)])
def test_an_orbit_too_short_to_show_it_is_followed_on(a, n):
    found = ends_of(Henon(a), n)
    assert (found.period, found.looked, found.more) == (2, 512, 1024)
    assert found.states[:, 0] == pytest.approx(two_cycle(a), abs=1e-9)
    assert found.text.endswith(", found after 1024 more returns")


def test_chaos_has_no_period_and_the_states_that_it_visits():
    found = ends_of(Henon(1.4))
    assert (found.period, found.looked, found.stable, found.words) == (0, 512, None, ("BB",))
    assert found.states.shape == (1000, 2)
    assert found.text.startswith("chaos (1:0/C)")
    assert (
        abs(found.exponent - 0.419) < 4 * found.exponent_error < 0.1
    )  # the exponent: J. C. Sprott, Chaos and Time-Series Analysis


def test_an_unstable_cycle_is_not_taken_for_what_passes_by():
    """An orbit that starts within 1e-14 of the unstable fixed point is leaving it, and at 2e-3 from it at its end."""
    a, b = 1.4, 0.3
    x = (-(1 - b) + np.sqrt((1 - b) ** 2 + 4 * a)) / (2 * a)
    path = nsmaps.orbit(Henon(a), [x + 1e-14, b * x], 40)
    assert 1e-3 < np.abs(path.final - [x, b * x]).max() < 1e-2
    assert limit_set(Henon(a), path).period == 0


def test_a_cycle_without_derivatives_is_what_repeats():
    found = ends_of(Henon(0.8, smooth=False))
    assert (found.period, found.stable, len(found.multipliers)) == (2, None, 0)
    assert found.states[:, 0] == pytest.approx(two_cycle(0.8), abs=1e-6)
    assert found.text.startswith("seen cycle of 2 returns")


def test_an_orbit_that_ends_ends_on_nothing():
    path = nsmaps.orbit(Henon(3.0), [5.0, 5.0], 60)
    assert not np.isfinite(path.final).all()
    assert limit_set(Henon(3.0), path) is None


@pytest.mark.parametrize(("d", "name", "period"), [(0.35, "1:1/T", 1), (0.30, "1:1/2T", 2)])
def test_the_motions_of_the_paper(d, name, period):
    system = nsmaps.load_system("vi_pair", d=d, g_bar=0.21132751903147873)
    path = nsmaps.orbit(system, [0.2, 0.1], 120)
    found = limit_set(system, path)
    assert (found.label, found.period, found.stable) == (name, period, True)
    state = found.states[:1]
    for _ in range(period):  # it closes up under the map itself
        state = system.first_return(state).image
    assert state == pytest.approx(found.states[:1], abs=1e-9)


def test_a_map_that_does_not_tell_times_has_no_periods_of_the_forcing():
    """Fits are right but for whole turns, which differ from piece to piece: a sum of them would be any number."""
    names = ("v", Angle("phi"))
    domain = [(0.0, 1.0), (0.0, 6.0)]
    there = PolyMap.of_monomials(names, {"v": {(0, 0): Fraction(1, 2)}, "phi": {(0, 0): Fraction(7, 2)}}, domain)
    back = PolyMap.of_monomials(names, {"v": {(0, 0): Fraction(1, 2)}, "phi": {(0, 0): Fraction(13, 2)}}, domain)
    low, high = (ConditionRegion(coordinates=names, text=text) for text in ("phi < 3", "phi >= 3"))
    return_map = CompositeMap(names, ("B", "T"), (Piece("low", low, there, "BTB"), Piece("high", high, back, "BB")))
    path = orbit(return_map, (0.5, 0.2), 60)
    assert return_map.first_return([[0.5, 3.5]]).turns.tolist() == [[0, 1]]
    assert (path.turns == 0).all()
    assert limit_set(return_map, path).label == "2:1, period 2"
    assert periodic_orbit(return_map, (0.5, 0.2), 2).label == "2:1, period 2"
    assert bifurcation_diagram(lambda a: return_map, "a", [1.0], (0.5, 0.2), n_returns=8, transient=20).labels.tolist() == [
        ["2:1, period 2"]
    ]
