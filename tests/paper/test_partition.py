"""The paper's own partition as printed, for one d, and the composite map as a function of d."""

from functools import lru_cache

import numpy as np
import pytest
import scipy.optimize
import sympy as sp
from messages import message

import nsmaps
from nsmaps import continue_branch, periodic_orbit
from nsmaps.coordinates import Angle
from nsmaps.dynamics.attractors.distance import hausdorff
from nsmaps.errors import NsmapsError
from nsmaps.reduced.fit.lifts import unwrapped

DEGREES = {"R2": (5, 5), "R4": (8, 4), "R5": (4, 3)}  # eqs. r2map, R4eqn, R5eqn


@lru_cache
def ran(name):
    return nsmaps.run_study(nsmaps.load_study(f"vi_pair/{name}"))


def test_the_pseudocode_as_printed_says_where_it_fails():
    result = ran("paper")
    assert [piece.name for piece in result.composite.pieces] == ["reset", "R1", "R2", "R4", "R5", "R3"]
    covered = next(v for v in result.verdicts if v.name == "covered")
    assert not covered.holds
    assert not covered.required
    start = result.returns.start
    in_hole = (start[:, 0] < 0.55) & (start[:, 0] > 0.63 - 0.53 * start[:, 1]) & (start[:, 1] < 1.1)
    assert 1 - result.coverage.fraction == pytest.approx(in_hole.mean(), abs=0.003)
    assert in_hole.mean() == pytest.approx(0.076, abs=0.001)


def test_representative_curves_are_the_papers():
    """Figs. r2approx, r5approx: R2 along phi = 0.35 and v = 0.85, R4 along 1.35 and 0.12, R5 along 3.05 and 0.12."""
    result = ran("paper")
    for name, v, phi in (("R2", 0.85, 0.35), ("R4", 0.12, 1.35), ("R5", 0.12, 3.05)):
        piece = result.composite.piece(name)
        surface = result.surfaces[piece.word]
        inside = surface.restrict(piece.region.contains(surface.start))
        for i, (own, other, value) in enumerate(((0, 1, phi), (1, 0, v))):
            line = inside.start[:, other] == inside.start[np.argmin(np.abs(inside.start[:, other] - value)), other]
            fitted = np.polynomial.Polynomial.fit(inside.start[line, own], unwrapped(inside)[1][line, i], DEGREES[name][i])
            states = inside.start[line][:: max(1, line.sum() // 9)]
            ours = piece.map(states)[:, i]
            expected = fitted(states[:, own])
            assert ours == pytest.approx(np.abs(expected) if (name, i) == ("R5", 0) else expected, abs=1e-9)


def test_r4_and_r5_are_carried_beyond_their_curves():
    """Along the paper's curves both have speeds that no return has, down to -2: extrapolated, and told by the report."""
    composite = ran("paper").composite
    r4 = composite.piece("R4")
    grid = ran("paper").returns.start
    speeds = r4.map(grid[r4.region.contains(grid)])[:, 0]
    assert speeds.min() < -1.5
    assert any("the largest error is 2.6" in text for text in r4.map.report.warnings)


@lru_cache
def in_d():
    """The parametric map, compared with the exact one at 46 values of d."""
    study = nsmaps.load_study("vi_pair/parametric").without("bifurcation_diagram", "figures")
    compare = study.parametric_map.compare.model_copy(update={"points": 46})
    return nsmaps.run_study(
        study.model_copy(update={"parametric_map": study.parametric_map.model_copy(update={"compare": compare})})
    )


@pytest.mark.thorough
def test_the_parametric_map_has_the_attractors_of_the_exact_map():
    """Cases FP, PD and CD, and every period but in the windows that the study states; orders in d are the paper's."""
    found = in_d().agreement
    for d, exact, ours in ((0.35, "1:1/T", "1:1, period 1"), (0.30, "1:1/2T", "1:1, period 2"), (0.26, "1:1/C", "1:1/C")):
        k = np.argmin(np.abs(found.values - d))
        assert (found.values[k], found.exact[k, 0], found.labels[k, 0]) == (pytest.approx(d), exact, ours)
    (verdict,) = (v for v in in_d().verdicts if v.name == "parametric_map: follows")
    assert (verdict.holds, verdict.required) == (True, True), verdict.text
    assert found.distance[found.values > 0.2766][:, 0].max() > 0.4  # another attractor of the exact map near d = 0.336
    for name, orders in {"R1": (2, 2), "R2": (4, 5), "R3": (0, 0), "R4": (4, 5), "R5": (4, 4)}.items():
        of = in_d().parametric_map.piece(name).map.exponents
        assert tuple(int(each[:, 2].max()) for each in of[:2]) == orders


@pytest.mark.thorough
def test_period_doublings_of_the_parametric_map_beside_the_exact_ones():
    """Newton's method and bisection on the polynomials in (v, phi, d) of R1; those of the exact map are of 50 digits."""
    v, phi, d = sp.symbols("v phi d", real=True)
    f, g = (in_d().parametric_map.piece("R1").map.symbolic(name) for name in ("v", "phi"))
    image = sp.lambdify((v, phi, d), [f, g])
    slope = sp.lambdify((v, phi, d), [[x.diff(y) for y in (v, phi)] for x in (f, g)])

    def cycle(value, period, x):
        for _ in range(30):
            y, along = x, np.eye(2)
            for _ in range(period):
                y, along = np.array(image(*y, value)), np.array(slope(*y, value)) @ along
            x = x - np.linalg.solve(along - np.eye(2), y - x)
        return x, 1 + np.trace(along) + np.linalg.det(along)

    def test(value, period, near):
        return cycle(value, period, np.array(near))[1]

    parametric = in_d().parametric_map.at
    for period, low, high, near, exact, off in (
        (1, 0.320, 0.330, (0.80, 0.31), 0.32418854, 3e-4),
        (2, 0.270, 0.280, (0.79, 0.45), 0.27649856, 2.2e-3),
    ):
        value = scipy.optimize.brentq(test, low, high, (period, near), 1e-12)
        assert abs(value - exact) < off
        orbit = periodic_orbit(parametric(high), near, period)
        branch = continue_branch(
            parametric, "p", orbit, high, (low, high), direction="down", step=0.1, kinds=("period doubling",)
        )
        (event,) = branch.of_kind("period doubling")
        assert event.value == pytest.approx(value, abs=1e-8)


@pytest.mark.thorough
@pytest.mark.parametrize(("d", "near"), [(0.35, 0.005), (0.33, 0.005), (0.30, 0.03), (0.29, 0.03)])
def test_orbits_of_the_parametric_map_arrive_where_the_exact_ones_do(pair, d, near):
    composite = in_d().parametric_map.at(d)
    ours, exact = (nsmaps.orbit(each, [0.2, 0.1], 300).states[-4:] for each in (composite, pair(d)))
    assert np.abs(ours[:, None] - exact[None]).max(axis=2).min(axis=0).max() < near


def test_beyond_the_papers_range_of_d_there_is_no_map():
    parametric = in_d().parametric_map
    with pytest.raises(NsmapsError, match=message("reduced.outside-fitted", parameter="d", value=0.36, low=0.26, high=0.35)):
        parametric.at(0.36)


def test_coefficients_in_d_written_out_lose_few_digits():
    piece = in_d().parametric_map.piece("R1")
    assert piece.map.coordinates.names == ("v", "phi", "d")
    assert {str(symbol) for symbol in piece.map.symbolic("v").free_symbols} == {"v", "phi", "d"}
    for name in ("v", "phi"):
        assert 1e-16 < piece.map.monomial_error(name) < 1e-4


@pytest.mark.thorough
def test_pieces_between_attracting_boxes_make_no_cycles_of_their_own(pair):
    """At d = 0.27 a loose piece there had two, and all orbits ended in them."""
    grid = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.0033, high=1, points=300), "phi": nsmaps.Axis(low=0, high=np.pi, points=300)})
    made = nsmaps.partition(pair(0.27), grid, nsmaps.Partition(tolerance=1e-3))
    starts = np.random.default_rng(3).uniform([0.01, 0], [1, 3.1], (60, 2))
    ours, exact = (nsmaps.orbit(each, starts, 700).states[-16:].reshape(-1, 2) for each in (made.composite, pair(0.27)))
    assert hausdorff(ours, exact, ("v", Angle("phi"))) < 2e-3
