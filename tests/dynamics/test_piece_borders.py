"""Border collisions of maps given by formulas, against closed forms, exact polynomials and values of sixty digits."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from messages import message
from nsmaps_border_collision import BorderCollision, BorderCollision1
from nsmaps_circle_map import GapCircleMap, PlateauCircleMap
from nsmaps_square_root import SquareRoot, SquareRootPlane

import nsmaps
from nsmaps.dynamics.continuation.border import GAP, NONSMOOTH_FOLD, PERSISTENCE, WITH_DOUBLING
from nsmaps.dynamics.continuation.follow import continue_branch, period_doubling_cascade, switch_branch
from nsmaps.errors import NsmapsError

EXACT = 1e-14


def ending(return_map, name, cycle, bounds, direction):
    """The branch of a cycle, and the event at its end."""
    branch = continue_branch(return_map, name, cycle, getattr(return_map, name), bounds, direction=direction, step=0.1)
    event = branch.events[-1]
    assert branch.ended == event.kind
    return branch, event


def gap(mu, q, a=0.5):
    """The map with a gap, and its cycle."""
    return_map = BorderCollision1(a_L=a, a_R=a, mu=mu, jump=-1.0)
    cycle = nsmaps.periodic_orbit(return_map, nsmaps.orbit(return_map, [0.1], 500).final, q)
    assert cycle.converged
    return return_map, cycle


@pytest.mark.parametrize(("p", "q"), [(1, 2), (2, 5), (1, 9)])
def test_a_cycle_of_a_gap_map_ends_where_a_state_is_at_the_border(p, q):
    """The window of p/q: x_k = mu/(1 - a) - the sum of the subtractions, by fractions; its ends are where a state is zero."""
    a = Fraction(1, 2)
    subtracted = [(k + 1) * p // q - k * p // q for k in range(q)]
    weights = [sum(a ** ((k - j - 1) % q) * subtracted[j] for j in range(q)) / (1 - a**q) for k in range(q)]
    low, high = (
        (1 - a) * most(w for w, s in zip(weights, subtracted, strict=True) if s == own) for most, own in ((max, 1), (min, 0))
    )
    assert low < high
    return_map, cycle = gap(float((low + high) / 2), q)
    for direction, end, letter, other in (("down", low, "R", "L"), ("up", high, "L", "R")):
        _, event = ending(return_map, "mu", cycle, (-0.1, 1.1), direction)
        assert abs(event.value - float(end)) <= event.precision < 1e-13
        assert event.border == GAP
        k = event.at.states[0]
        assert (cycle.words[k], event.orbit.states[k, 0]) == (letter, pytest.approx(0, abs=EXACT))
        assert event.detail == f"state {k + 1} ({letter}) at x = 0, beyond which is {other}; the map jumps"
    with pytest.raises(NsmapsError, match=message("dynamics.jump-at-border")):
        switch_branch(return_map, "mu", event, (-0.1, 1.1))


def test_the_border_of_a_gap_map_is_a_curve():
    return_map, cycle = gap(0.5, 2)
    _, event = ending(return_map, "mu", cycle, (0.2, 0.8), "up")
    curve = nsmaps.bifurcation_curve(
        lambda mu, a: return_map.at(mu=mu, a_L=a, a_R=a), event, {"mu": (0.2, 0.8), "a": (0.3, 0.9)}, 0.5, step=0.2
    )
    mu, a = curve.parameters.T
    assert len(a) > 5
    assert np.abs(mu - 1 / (1 + a)).max() < EXACT
    assert curve.kind == "border collision"


def test_a_fixed_point_of_tents_passes_the_border_and_doubles_there():
    """For mu < 0 L with the multiplier 1/2; for mu > 0 R with -3/2, unstable, and LR with -3/4."""
    return_map = BorderCollision1(a_L=0.5, a_R=-1.5, mu=-0.5)
    first, event = ending(return_map, "mu", nsmaps.periodic_orbit(return_map, [-1.0]), (-1, 1), "up")
    assert abs(event.value) <= event.precision < 1e-13
    assert (event.border, event.detail) == (
        PERSISTENCE + WITH_DOUBLING,
        "state 1 (L) at x = 0, beyond which is R; multipliers 0.5 and -1.5",
    )
    assert first.points[-1] == pytest.approx(0, abs=EXACT)
    beyond = switch_branch(return_map, "mu", event, (-1, 1))
    assert beyond.points[:, 0, 0] == pytest.approx(beyond.values / 2.5, abs=1e-12)
    assert beyond.multipliers.ravel() == pytest.approx(np.full(len(beyond.values), -1.5))
    doubled = switch_branch(return_map, "mu", event, (-1, 1), doubled=True)
    assert sorted(doubled.words[0]) == ["L", "R"]
    assert doubled.multipliers.ravel() == pytest.approx(np.full(len(doubled.values), -0.75))
    assert (beyond.values[-1], doubled.values[-1]) == (1, 1)
    whole = period_doubling_cascade(return_map, "mu", nsmaps.periodic_orbit(return_map, [-1.0]), -0.5, (-1, 1), step=0.1)
    assert [branch.period for branch in whole] == [1, 2]
    passing = period_doubling_cascade(
        return_map.at(a_R=-0.5), "mu", nsmaps.periodic_orbit(return_map, [-1.0]), -0.5, (-1, 1), step=0.1
    )
    assert [(branch.period, str(branch.words[0, 0])) for branch in passing] == [(1, "L"), (1, "R")]


PLANE = {"tau_L": Fraction(1, 5), "delta_L": Fraction(4, 5), "delta_R": Fraction(9, 10)}


def test_a_cycle_of_the_plane_folds_at_a_border_or_goes_to_infinity():
    """LLR of the normal form: x = 0 at tau_R = -1.02, and det(1 - J) = 0 for the product J of the derivatives."""
    tau = sp.Symbol("tau")
    left, right = (sp.Matrix([[t, 1], [-d, 0]]) for t, d in ((sp.Rational(1, 5), sp.Rational(4, 5)), (tau, sp.Rational(9, 10))))
    (infinite,) = sp.solve((sp.eye(2) - right * left**2).det(), tau)
    return_map = BorderCollision(**{name: float(value) for name, value in PLANE.items()}, tau_R=-1.5)
    cycle = nsmaps.periodic_orbit(return_map, [[-0.5, -0.5], [-0.3, 0.4], [1.3, 0.2]], 3)
    assert sorted(cycle.words) == ["L", "L", "R"]
    _, event = ending(return_map, "tau_R", cycle, (-4, 0), "up")
    assert event.value == pytest.approx(-1.02, abs=1e-13)
    assert event.border == NONSMOOTH_FOLD
    curve = nsmaps.bifurcation_curve(return_map, event, {"tau_R": (-3, 0), "delta_R": (0.5, 2)}, 0.9, step=0.2)
    assert curve.ended[1].startswith("state 1 is at x = 0 too, two borders at once")
    assert curve.parameters[-1] == pytest.approx([-1, 1], abs=1e-6)  # there x = 0, 0, 1 and y = -1, 0, 0
    partner = switch_branch(return_map, "tau_R", event, (-2, 0), max_points=5)
    assert sorted(partner.words[0]) == ["L", "R", "R"]
    assert (partner.values[1:] < -1.02).all()
    gone, at = ending(return_map, "tau_R", cycle, (-4, 0), "down")
    assert at.kind == "cycle at infinity"
    assert at.value == pytest.approx(float(infinite), abs=1e-12)
    assert len(gone.values) < 100


def test_a_doubling_of_affine_pieces_is_degenerate():
    """At tau_R = -1 - delta_R a segment of states has period two; the cycle LR begins where it meets the border."""
    return_map = BorderCollision(tau_L=1.4, delta_L=0.5, tau_R=-1.2, delta_R=0.4)
    branches = period_doubling_cascade(
        return_map,
        "tau_R",
        nsmaps.periodic_orbit(return_map, [0.4, -0.2]),
        -1.2,
        (-1.6, -1.0),
        direction="down",
        n_doublings=3,
        step=0.1,
    )
    assert [sorted(branch.words[0]) for branch in branches] == [["R"], ["R", "R"], ["L", "R"]]
    assert branches[0].events[0].detail.startswith("degenerate: the pieces are affine")
    assert np.abs(branches[1].values + 1.4).max() < 1e-12
    assert branches[1].events[-1].border == ""
    assert branches[2].values[-1] == -1.6
    back = nsmaps.periodic_orbit(return_map.at(tau_R=-1.6), branches[2].orbits[-1].states, 2)
    branch = continue_branch(return_map, "tau_R", back, -1.6, (-1.7, -1.0), step=0.1)
    assert branch.ended == "period halving"
    assert abs(branch.events[-1].value + 1.4) <= branch.events[-1].precision
    assert branch.events[-1].detail == branches[0].events[0].detail


def test_a_doubling_of_affine_pieces_has_one_name_on_either_side():
    """Tents of slopes 3/5 and b: LR has the multiplier 3 b/5, which is -1 where chaos begins, and R the multiplier b."""
    return_map = BorderCollision1(a_L=0.6, a_R=-1.5, mu=1.0)
    diagram = nsmaps.bifurcation_diagram(return_map, "a_R", np.linspace(-1.9, -0.8, 102), [0.1], borders=True)
    chaos, doubled, fixed = diagram.windows
    assert [window.label for window in diagram.windows] == ["C", "LR, period 2", "R, period 1"]
    assert (chaos.high.kind, doubled.low.kind) == ("period doubling", "period doubling")
    assert (doubled.high.kind, fixed.low.kind) == ("period halving", "period doubling")
    assert [chaos.high.value, doubled.low.value] == pytest.approx([-5 / 3] * 2, abs=1e-12)
    assert [doubled.high.value, fixed.low.value] == pytest.approx([-1, -1], abs=1e-12)


def test_square_roots_have_an_infinite_slope_at_the_border():
    """LR of Nordmark's map ends at mu = 1; in the plane 0.169720659347409857371 was found with sixty digits."""
    return_map = SquareRoot(a=0.5, mu=0.5625)
    cycle = nsmaps.periodic_orbit(return_map, [0.49], 2)
    _, event = ending(return_map, "mu", cycle, (0.1, 1.2), "up")
    assert event.value == pytest.approx(1.0, abs=1e-14)
    assert event.border == NONSMOOTH_FOLD
    assert event.detail.endswith("(L) at x = 0, beyond which is R; the slope of R is infinite")
    curve = nsmaps.bifurcation_curve(return_map, event, {"mu": (0.1, 1.2), "a": (0.1, 0.9)}, 0.5, step=0.2)
    assert curve.parameters[:, 0] == pytest.approx(np.ones(len(curve.parameters)), abs=1e-13)  # R maps 1 to 0 at mu = 1
    plane = SquareRootPlane(alpha=0.65, gamma=0.05, tau2=0.25, rho=0.1)
    cycle = nsmaps.periodic_orbit(plane, nsmaps.orbit(plane, [0.1, 0.0], 300).final, 3)
    _, event = ending(plane, "rho", cycle, (0.005, 0.5), "up")
    assert event.value == pytest.approx(0.169720659347409857371, abs=1e-15)
    whole = period_doubling_cascade(
        return_map, "mu", nsmaps.periodic_orbit(return_map.at(mu=-0.5), [-1.0]), -0.5, (-1, 1), n_doublings=1, step=0.1
    )
    assert [str(branch.words[0, 0]) for branch in whole] == ["L", "R"]
    assert whole[1].events[0].value == pytest.approx(0.75, abs=1e-12)  # 1/(2 sqrt(x)) = 1 at x = 1/4
    low = nsmaps.periodic_orbit(return_map.at(mu=0.07), [0.0596], 3)
    _, event = ending(return_map.at(mu=0.07), "mu", low, (0.0, 0.2), "down")
    assert event.kind == "period doubling" or event.detail.startswith("all 3 states")


def test_borders_lie_at_the_cut_of_an_angle_too():
    """Rotation number 1/2: of the plateau a state is at its ends, of the gap map b and 1 - ... are b = 2/3 and b = 5/6."""
    plateau = PlateauCircleMap(w=0.5, Omega=0.3)
    cycle = nsmaps.periodic_orbit(plateau, nsmaps.orbit(plateau, [0.1], 100).final, 2)
    assert sorted(cycle.words) == ["F", "S"]
    places = []
    for direction in ("down", "up"):
        _, event = ending(plateau, "Omega", cycle, (0.0, 1.0), direction)
        assert event.border == NONSMOOTH_FOLD
        places.append((event.value, event.detail.split(" at ")[1].split(",")[0]))
    (low, at_low), (high, at_high) = places
    assert (low, high) == pytest.approx((1 / 6, 1 / 3), abs=1e-14)
    assert (at_high, at_low) == ("phi = 0", "phi = 2*pi*(1 - w)")
    gapped = GapCircleMap(a=0.5, b=0.75)
    cycle = nsmaps.periodic_orbit(gapped, nsmaps.orbit(gapped, [0.1], 100).final, 2)
    ends = [ending(gapped, "b", cycle, (0.5, 0.99), direction)[1] for direction in ("down", "up")]
    assert [event.value for event in ends] == pytest.approx([2 / 3, 5 / 6], abs=1e-14)
    assert [event.border for event in ends] == [GAP, GAP]


class Hidden(nsmaps.exact.ReturnMap):
    """A map of which no formulas are known."""

    def __init__(self, return_map):
        self.map, self.coordinates = return_map, return_map.coordinates

    def first_return(self, states, derivative=False):
        return self.map.first_return(states, derivative)


def test_a_jump_to_another_state_of_the_cycle_is_one():
    """In narrow windows states are so close that the jump leads next to another one; a return is not left out."""
    return_map, cycle = gap(0.0118, 7)
    branch = continue_branch(lambda mu: Hidden(return_map.at(mu=mu)), "mu", cycle, 0.0118, (-0.1, 1.1), step=0.1)
    assert branch.events[-1].border == GAP
    assert branch.events[-1].value == pytest.approx(2 / 127, abs=3e-8)  # mu (2 - 2^-6) is 1 / 32 there


def test_events_on_the_way_to_infinity_are_met():
    """The fixed point R is at infinity where delta_R = tau_R - 1, and on the way a pair of multipliers passes the unit circle."""
    return_map = BorderCollision(tau_L=0.2, delta_L=0.8, tau_R=1.7, delta_R=1.1)
    branch = continue_branch(
        return_map, "delta_R", nsmaps.periodic_orbit(return_map, [5.0, -4.0]), 1.1, (0.1, 2), direction="down", step=0.1
    )
    found = [(event.kind, pytest.approx(event.value, abs=1e-12)) for event in branch.events]
    assert found == [("Neimark-Sacker", 1.0), ("cycle at infinity", 0.7)]


def test_a_small_cycle_at_an_infinite_slope_is_not_at_a_gap() -> None:
    """A motion of extent 5e-4: the root of what is left of a distance is no jump, as it falls with the distance."""
    a, mu = 0.2, 6.4888945e-08
    half = a**6 / 2
    root = np.sqrt(half**2 + mu * (1 - a**7) / (1 - a)) - half
    system = SquareRoot(a=a, mu=mu)
    cycle = nsmaps.periodic_orbit(system, [root**2], 7)
    branch = nsmaps.continue_branch(system, "mu", cycle, mu, (0.9 * mu, 1.2 * mu), direction="up", step=0.5)
    assert branch.events[-1].border == "non-smooth fold"
