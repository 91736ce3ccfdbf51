"""Diagrams, basins, sweeps and planes of maps given by formulas: orbits that diverge, exponents."""

import numpy as np
import pytest
import sympy as sp
from nsmaps_border_collision import BorderCollision, BorderCollision1, BorderCollision3, Lozi, UnitTent
from nsmaps_square_root import SquareRoot, SquareRootPlane

import nsmaps
from nsmaps import Axis, Grid
from nsmaps.dynamics.attractors.coexistence import match_attractors

SPACE = BorderCollision3(tau_L=0.8, sigma_L=0.2, delta_L=0.3, tau_R=-1.9, sigma_R=0.1, delta_R=-0.3)
FORM = BorderCollision(tau_L=0.2, delta_L=0.8, tau_R=-1.5, delta_R=0.9)


def grid(points, low, high, *names):
    return Grid(axes={name: Axis(low=low, high=high, points=points) for name in names})


def iterated(return_map, n):
    """The largest coordinate on an orbit of the normal form, by hand."""
    x, y, largest = 0.1, 0.1, 0.0
    for _ in range(n):
        tau, delta = (return_map.tau_L, return_map.delta_L) if x < 0 else (return_map.tau_R, return_map.delta_R)
        x, y = tau * x + y + 1.0, -delta * x
        largest = max(largest, abs(x))
        if not largest < 1e6:
            break
    return largest


def test_an_orbit_escapes_where_it_does():
    rng, escaped = np.random.default_rng(1), 0
    for _ in range(40):
        values = rng.uniform([-3, -2, -3, -2], [3, 2, 3, 2])
        return_map = BorderCollision(**dict(zip(("tau_L", "delta_L", "tau_R", "delta_R"), values.tolist(), strict=True)))
        label = nsmaps.bifurcation_diagram(
            lambda mu, return_map=return_map: return_map.at(mu=mu), "mu", [1.0], [0.1, 0.1]
        ).labels.item()
        assert (label == "escapes") == (iterated(return_map, 10_000) >= 1e6), values
        escaped += label == "escapes"
    assert 10 < escaped < 40


def test_no_attractor_is_made_of_orbits_that_diverge():
    gone = nsmaps.basins(Lozi(a=2.5, b=0.3), grid(40, -2, 2, "x", "y"))
    assert (gone.attractors, gone.fractions.tolist()) == ((), [0.0, 1.0])
    some = nsmaps.basins(Lozi(), grid(40, -2, 2, "x", "y"))
    assert [attractor.label for attractor in some.attractors] == ["C"]
    left = Lozi().first_return(np.array([[-0.9, -0.45]])).start[0]  # beside the saddle L, beyond its stable manifold
    assert nsmaps.basins(Lozi(), left[None], attractors=some.attractors).label.tolist() == [-2]
    tent = nsmaps.basins(UnitTent(a=0.3), grid(100, -0.5, 1.5, "x"))
    inside = (tent.start[:, 0] >= 0) & (tent.start[:, 0] <= 1)  # what leaves the unit interval does not come back
    assert np.array_equal(tent.label == 0, inside)
    swept = nsmaps.global_continuation(Lozi(), "a", [1.6, 2.4], {"x": (-0.5, 0.5), "y": (-0.2, 0.2)}, n_samples=200)
    assert swept.ended.tolist() == [0.0, 1.0]


def test_two_attractors_and_their_boundary():
    """LLR and R at once; the boundary is the stable manifold of the saddle between them, RLR, up to the tolerance."""
    found = nsmaps.basins(FORM, grid(14, -3, 3, "x", "y"))
    assert [attractor.label for attractor in found.attractors] == ["LLR, period 3", "R, period 1"]
    points = nsmaps.basin_boundary(FORM, found, tolerance=1e-8, max_returns=300).points
    saddle = nsmaps.periodic_orbit(FORM, [0.41, 0.21], 3)
    assert (sorted(saddle.words), saddle.stable) == (["L", "R", "R"], False)
    apart = np.abs(nsmaps.orbit(FORM, points, 50).states[:, :, None] - saddle.states).max(axis=-1).min(axis=(0, 2))
    assert np.median(apart) < 1e-3


def test_a_transient_is_not_an_attractor_beside_the_one_it_comes_to():
    """Next to tau_R = -2.521, where LLR goes to infinity, orbits take long to reach it."""
    diagram = nsmaps.bifurcation_diagram(
        FORM, "tau_R", np.linspace(-2.49, -2.45, 17), [0.1, 0.1], transient=100, direction="both"
    )
    assert set(diagram.labels.ravel()) == {"LLR, period 3"}
    assert diagram.ends is not None
    assert match_attractors([diagram]).counts.tolist() == [1] * 17
    for k, value in enumerate(diagram.values):
        for orbit in diagram.settled[k]:
            cycle = nsmaps.periodic_orbit(FORM.at(tau_R=value), orbit[-1], 3)
            assert np.abs(cycle.states - orbit[-1]).max(axis=1).min() < 1e-3 * np.ptp(cycle.states)


EXPONENTS = [  #: by independent runs of 1.5e8 to 6e8 returns, in closed form of the tent
    (Lozi(), [0.470223, -1.163370]),
    (
        BorderCollision3(tau_L=0.8, sigma_L=0.2, delta_L=0.3, tau_R=-1.9, sigma_R=0.1, delta_R=-0.3),
        [0.207748, -0.497756, -0.913965],
    ),
    (UnitTent(a=0.3), [-0.3 * np.log(0.3) - 0.7 * np.log(0.7)]),
    (BorderCollision1(a_L=0.5, a_R=-2.5, mu=1.0), [0.273159]),
    (SquareRoot(a=0.8, mu=0.05), [0.227171]),
    (SquareRootPlane(alpha=0.65, gamma=0.05, tau2=0.25, rho=0.01), [0.198824, -3.571851]),
    (BorderCollision1(a_L=0.5, a_R=0.5, mu=0.3, jump=-1.0), [np.log(0.5)]),
]


@pytest.mark.parametrize(("return_map", "expected"), EXPONENTS, ids=lambda each: type(each).__name__)
def test_exponents(return_map, expected):
    found = nsmaps.lyapunov(return_map, starts=np.full(len(return_map.coordinates), 0.05), n_returns=100_000)
    assert found.exponents == pytest.approx(expected, abs=6e-3)
    assert (np.abs(found.exponents - expected) <= 5 * found.error + 2e-4).all()


class Angles(nsmaps.PiecewiseMap):
    """Two angles with the fixed points 2.4 pi = 0.4 pi and -0.4 pi = 1.6 pi: each makes a turn, of which none is a forcing's."""

    coordinates = (nsmaps.Angle("phi"), nsmaps.Angle("psi"))

    def pieces(self, x):
        return {"A": (True, {"phi": x.phi / 2 + 2.2 * sp.pi, "psi": x.psi / 2 + 2.8 * sp.pi})}


def test_turns_of_several_angles_are_no_periods():
    cycle = nsmaps.periodic_orbit(Angles(), [0.4 * np.pi, 1.6 * np.pi])
    assert (cycle.converged, cycle.turns.tolist(), cycle.label) == (True, [[1, 1]], "A, period 1")
    assert nsmaps.bifurcation_diagram(lambda _: Angles(), "p", [0.0], [1.0, 5.0]).labels.tolist() == [["A, period 1"]]
