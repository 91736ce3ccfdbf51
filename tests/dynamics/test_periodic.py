"""Periodic orbits against 50-digit values, brute force, and the determinant that restitution fixes."""

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.periodic import PeriodicOrbit, dependent, shooting_jacobian
from nsmaps.errors import NsmapsError, StateError

DOUBLING = 0.32418854


@pytest.mark.parametrize(
    ("guess", "state", "multipliers", "word"),
    [
        ([0.8, 0.4], [0.833385990208561, 0.363611564551622], [-0.82672902, -0.07559914], "BTB"),
        ([0.28, 2.9], [0.281770025375305, 2.91844362963194], [-9.106, -0.0275], "BB"),
        ([0.34, 2.87], [0.343255510718990, 2.87685171619735], [129.95, 4.8e-4], "BTB"),
    ],
)
def test_fixed_points_at_035(pair, guess, state, multipliers, word):
    made = nsmaps.periodic_orbit(pair(0.35), guess)
    assert made.converged
    assert made.exists
    assert made.words == (word,)
    assert np.allclose(made.states, [state], atol=1e-13, rtol=0)
    assert np.allclose(made.multipliers, multipliers, rtol=2e-3, atol=1e-8)
    assert made.stable == (abs(multipliers[0]) < 1)


def test_two_cycle_at_030(pair):
    made = nsmaps.periodic_orbit(pair(0.30), [0.8, 0.4], 2)
    assert np.allclose(made.states, [[0.810226, 0.412905], [0.730550, 0.222750]], atol=5e-7)
    assert made.label == "1:1/2T"
    assert made.stable
    inner = nsmaps.periodic_orbit(pair(0.30), [0.77, 0.26])
    assert np.allclose(inner.states, [[0.776278, 0.266398]], atol=5e-7)
    assert not inner.stable


@pytest.mark.parametrize(
    ("d", "guess", "period"), [(0.35, [0.8, 0.4], 1), (0.35, [0.28, 2.9], 1), (0.30, [0.8, 0.4], 2), (0.27, None, 4)]
)
def test_determinant_is_that_of_the_impacts(pair, d, guess, period):
    guess = nsmaps.orbit(pair(d), [0.8, 0.4], 3000).final if guess is None else guess
    made = nsmaps.periodic_orbit(pair(d), guess, period)
    assert made.converged
    impacts = sum(len(word) - 1 for word in made.words)
    assert np.isclose(np.prod(made.multipliers), 0.5 ** (2 * impacts), rtol=1e-10)


def test_derivative_is_that_of_differences(pair):
    system = pair(0.27)
    made = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [0.8, 0.4], 3000).final, 4)
    h = 1e-6
    moved = made.states[0] + h * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    ends = nsmaps.orbit(system, moved, 4).final
    assert np.allclose(made.derivative, np.stack([ends[0] - ends[1], ends[2] - ends[3]], axis=1) / (2 * h), atol=1e-7)


def test_phases_are_taken_on_the_circle(pair):
    far = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4 - 4 * np.pi])
    assert np.allclose(far.states, [[0.83338599, 0.36361156]], atol=1e-8)


def test_what_does_not_converge_says_so(pair):
    lost = nsmaps.periodic_orbit(pair(0.35), [np.nan, 0.4])
    assert not lost.converged
    assert not lost.exists
    assert np.isnan(lost.multipliers).all()
    assert lost.stable is None, "no multiplier is known"
    near = nsmaps.periodic_orbit(pair(0.35), [0.02, 4.0])
    assert not near.converged
    assert str(near).startswith("not converged, residual ")
    assert near.returns.valid.all(), "it has words, which are not those of a cycle"
    assert near.label == "unresolved"
    assert "stable" not in str(near)


def test_first_doubling(pair):
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    (found,) = continue_branch(pair, "p", fixed, 0.35, (0.30, 0.35), direction="down").of_kind("period doubling")
    assert abs(found.value - DOUBLING) < 1e-8
    assert np.allclose(found.orbit.states, [[0.804034, 0.313096]], atol=5e-7)
    assert np.allclose(found.orbit.multipliers, [-1, -0.0625], atol=1e-8)  # their product is r^4
    for d, settled in ((found.value + 1e-3, 1), (found.value - 1e-3, 2)):
        assert nsmaps.bifurcation_diagram(pair, "d", [d], [0.8, 0.31], transient=20_000).period.item() == settled


def test_second_doubling_is_between_settled_cycles(pair):
    cycle = nsmaps.periodic_orbit(pair(0.30), [0.8, 0.4], 2)
    (found,) = continue_branch(pair, "p", cycle, 0.30, (0.27, 0.30), direction="down").of_kind("period doubling")
    around = [found.value + 1e-3, found.value - 1e-3]
    assert nsmaps.bifurcation_diagram(pair, "d", around, found.orbit.states[0], transient=20_000).period.ravel().tolist() == [
        2,
        4,
    ]


def test_orbit_is_followed_along_a_parameter(pair):
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    branch = continue_branch(pair, "p", fixed, 0.35, (0.26, 0.35), direction="down")
    assert branch.values[[0, -1]].tolist() == [0.35, 0.26]
    for d, found in zip(branch.values, branch.orbits, strict=True):
        assert np.allclose(pair(d).first_return(found.states).image, found.states, atol=1e-13)
    assert [found.stable for found in branch.orbits] == [d > DOUBLING for d in branch.values]


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_shooting_is_the_derivative_of_the_gaps(pair, unit):
    """Of a cycle of two returns, by differences of its gaps, in units of the speed."""
    cycle, scale, h = nsmaps.periodic_orbit(pair(0.30), [0.8, 0.4], 2), np.array([0.8, 1.0]), 1e-6
    made = shooting_jacobian(cycle.returns.derivative * [[1, unit], [1 / unit, 1]], scale * [unit, 1])
    for j in range(4):
        step = h * np.eye(4)[j].reshape(2, 2) * scale
        ends = [pair(0.30).first_return(cycle.states + side * step) for side in (-1, 1)]
        gaps = [end.image - np.roll(end.start, -1, axis=0) for end in ends]
        assert np.allclose(made[:, j], ((gaps[1] - gaps[0]) / scale / (2 * h)).ravel(), atol=1e-7)


def test_wrong_calls_are_errors(pair):
    with pytest.raises(NsmapsError, match=message("dynamics.period", period=0)):
        nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4], 0)
    with pytest.raises(StateError, match=message("errors.shape", what="the guess has", shape="(3, 2)")):
        nsmaps.periodic_orbit(pair(0.35), [[0.8, 0.4]] * 3, 2)


@pytest.mark.parametrize("rows", [8, 40])
@pytest.mark.parametrize("extra", [0, 1])
def test_equations_are_dependent_if_a_row_is_a_sum_of_others(rows, extra):
    """Few and many equations, with and without a column of a parameter, on scales that differ by nine orders."""
    equations = np.random.default_rng(rows).standard_normal((rows, rows + extra)) * np.logspace(0, 9, rows)[:, None]
    assert not dependent(equations)
    equations[-1] = equations[0] - equations[1]
    assert dependent(equations)


def test_turns_are_those_up_to_the_next_state():
    r = 0.5
    ball = nsmaps.load_system("bouncing_ball", Gamma=np.pi * (1 - r) / (1 + r), r=r)  # the fold, with the phase 0
    states = [[2 * np.pi / (1 + r) * (1 + share), 0.0] for share in (-1e-12, 0.0, 1e-12)]
    orbits = [PeriodicOrbit(ball.first_return([state]), 1e-10, np.ones(2)) for state in states]
    assert {int(each.returns.turns[0, 1]) for each in orbits} == {0, 1}  # an image is just below a whole turn, another is not
    assert [(each.label, each.turns.tolist()) for each in orbits] == [("1:0/T", [[0, 1]])] * 3
