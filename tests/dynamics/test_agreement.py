"""Whether two maps have the same attractors over a parameter, on the quadratic map, whose attractors are known in closed form."""

from functools import lru_cache

import numpy as np
import pytest
from messages import message

from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.diagrams.agreement import agreement
from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram
from nsmaps.errors import NsmapsError
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.polymap import PolyMap

NAMES = Coordinates(("x",))


def quadratic(a, unit=1.0):
    """The map x -> unit (1 - a (x / unit)^2): periods double at a = 3/4 and 5/4."""
    box = np.array([[-2.0, 2.0]]) * unit
    polymap = PolyMap.of_monomials(NAMES, {"x": {(0,): unit, (2,): -a / unit}}, box)
    return CompositeMap(NAMES, ("B",), (Piece("P", ConditionRegion(text="0 < 1", coordinates=NAMES), polymap, "BB"),))


@lru_cache
def diagram(low, high, count, moved=0.0, unit=1.0, returns=64):
    values = np.linspace(low, high, count)
    return bifurcation_diagram(
        lambda a: quadratic(a + moved, unit), "a", values, [[0.3 * unit]], n_returns=returns, transient=2000
    )


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e5])
def test_maps_disagree_between_their_period_doublings(unit):
    """The other map is 0.02 ahead: it doubles at 0.73 and 1.23."""
    exact, other = diagram(0.605, 1.295, 70, 0.0, unit), diagram(0.605, 1.295, 70, 0.02, unit)
    found = agreement(exact, other, 0.1)
    first, second = found.disagreements()
    assert (first.low, first.high, first.count) == (pytest.approx(0.735), pytest.approx(0.745), 2)
    assert (second.low, second.high, second.count) == (pytest.approx(1.235), pytest.approx(1.245), 2)
    assert (exact.period[13, 0], other.period[13, 0], exact.period[63, 0], other.period[63, 0]) == (1, 2, 2, 4)
    assert not list(found.disagreements([(0.73, 0.75), (1.23, 1.25)]))
    assert [each.low for each in found.disagreements([(0.73, 0.75)])] == [second.low]


def test_cycles_of_one_period_disagree_where_they_are_far_apart():
    """The fixed point is at (-1 + sqrt(1 + 4 a)) / (2 a)."""
    exact, other = diagram(0.3, 0.7, 5), diagram(0.3, 0.7, 5, 0.02)
    x, y = ((-1 + np.sqrt(1 + 4 * a)) / (2 * a) for a in (exact.values, exact.values + 0.02))
    found = agreement(exact, other, 0.0135, np.array([0.5]))
    assert found.distance[:, 0] == pytest.approx((x - y) / 0.5, rel=1e-6)
    assert found.holds.tolist() == ((x - y) / 0.5 <= 0.0135).tolist() == [False, False, True, True, True]
    assert agreement(exact, other).scale == pytest.approx(np.ptp(x))
    (only,) = found.disagreements()
    assert (only.low, only.high, only.count) == (*exact.values[:2], 2)
    assert only.distance == pytest.approx((x - y)[0] / 0.5)


def test_chaos_agrees_with_chaos_on_the_same_states_alone():
    """At a = 2 the attractor is [-1, 1], at 1.9 [-0.9, 1], at 1.5 two bands; 1.75 + 0.003 lies in the window of period 3."""
    far, near, other = diagram(1.9, 2.0, 2, 0.0), diagram(1.9, 2.0, 2, -0.001), diagram(1.5, 1.6, 2, 0.0)
    assert (far.period == 0).all()
    assert agreement(far, near, 0.1).holds.all()
    values = far.values
    moved = bifurcation_diagram(lambda a: quadratic(a - 0.4), "a", values, [[0.3]], n_returns=64, transient=2000)
    assert not agreement(far, moved, 0.05).holds.any()
    cycle = bifurcation_diagram(lambda a: quadratic(1.753), "a", values, [[0.3]], n_returns=64, transient=2000)
    assert (cycle.period == 3).all()
    assert not agreement(far, cycle, 10.0).holds.any()
    with pytest.raises(NsmapsError, match=message("dynamics.other-diagrams")):
        agreement(far, other)


def test_orbits_that_escape_agree_with_those_that_escape():
    exact, other = diagram(1.9, 2.2, 4), diagram(1.9, 2.2, 4, 0.05)
    assert [bool(held) for held in exact.held[:, 0]] == [True, True, False, False]
    found = agreement(exact, other, 0.2)
    assert found.holds.tolist() == [True, False, True, True]
    (only,) = found.disagreements()
    assert np.isnan(only.distance)
    none = diagram(2.3, 2.4, 2)
    with pytest.raises(NsmapsError, match=message("dynamics.exact-without-attractor")):
        agreement(none, none)


def test_orbits_that_have_not_reached_their_cycle_do_not_agree():
    """The cycle of period 3 at a = 1.76 is found of either orbit, but the first nine states from 0.3 are not on it."""
    values = np.array([1.76])
    early = bifurcation_diagram(quadratic, "p", values, [[0.3]], n_returns=9, transient=0)
    late = bifurcation_diagram(quadratic, "p", values, [[0.3]], n_returns=9, transient=2000)
    assert (early.period[0, 0], late.period[0, 0]) == (3, 3)
    scale = np.array([1.0])
    found = agreement(early, late, 1e-3, scale)
    assert (found.holds.tolist(), np.isnan(found.distance).all()) == ([False], True)
    assert agreement(late, late, 1e-3, scale).distance == 0


def test_samples_of_one_chaotic_attractor_agree():
    """At a = 2, from 40 starts, whose orbits have nothing in common but the attractor [-1, 1]."""
    starts = np.random.default_rng(0).uniform(-0.9, 0.9, (40, 1))
    one, other = (
        bifurcation_diagram(quadratic, "p", [2.0], some, n_returns=100, transient=100) for some in (starts, starts[::-1] + 0.01)
    )
    assert agreement(one, other, 1e-3).holds.all()
