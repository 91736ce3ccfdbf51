"""The paper's own partition as printed, for one d, and the composite map as a function of d."""

from functools import lru_cache

import numpy as np
import pytest

import nsmaps
from nsmaps.coordinates import Angle
from nsmaps.dynamics.attractors.distance import hausdorff
from nsmaps.errors import NsmapsError
from nsmaps.reduced.fit.polyfit import unwrapped

DEGREES = {"R2": (5, 5), "R4": (8, 4), "R5": (4, 3)}  # eqs. r2map, R4eqn, R5eqn


@lru_cache
def ran(name):
    return nsmaps.run(nsmaps.load_study(f"vi_pair/{name}"))


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
        inside = surface.restricted(piece.region.contains(surface.start))
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


def test_the_parametric_map_follows_refits():
    parametric = ran("parametric").parametric
    assert parametric.report.follows
    k = parametric.report.names.index("R1")
    assert parametric.report.difference[k].max() < 5e-4
    assert parametric.condition < 10


@pytest.mark.parametrize(("d", "near"), [(0.35, 0.01), (0.33, 0.01), (0.30, 0.01), (0.29, 0.02)])
def test_orbits_of_the_parametric_map_arrive_where_the_exact_ones_do(pair, d, near):
    composite = ran("parametric").parametric.at(d)
    ours, exact = (nsmaps.orbit(each, [0.2, 0.1], 300).states[-4:] for each in (composite, pair(d)))
    assert np.abs(ours[:, None] - exact[None]).max(axis=2).min(axis=0).max() < near


def test_beyond_the_papers_range_of_d_there_is_no_map():
    parametric = ran("parametric").parametric
    with pytest.raises(NsmapsError, match=r"d is 0.36; expected: d from 0.26 to 0.35"):
        parametric.at(0.36)


def test_coefficients_in_d_written_out_lose_few_digits():
    piece = ran("parametric").parametric.piece("R1")
    assert piece.map.coordinates.names == ("v", "phi", "d")
    assert {str(symbol) for symbol in piece.map.symbolic("v").free_symbols} == {"v", "phi", "d"}
    for name in ("v", "phi"):
        assert 1e-16 < piece.map.monomial_error(name) < 1e-4


def test_pieces_between_attracting_boxes_make_no_cycles_of_their_own(pair):
    """At d = 0.27 a loose piece there had two, and all orbits ended in them."""
    grid = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.0033, high=1, points=300), "phi": nsmaps.Axis(low=0, high=np.pi, points=300)})
    made = nsmaps.partition(pair(0.27), grid, nsmaps.Partition(tolerance=1e-3))
    starts = np.random.default_rng(3).uniform([0.01, 0], [1, 3.1], (60, 2))
    ours, exact = (nsmaps.orbit(each, starts, 700).states[-16:].reshape(-1, 2) for each in (made.composite, pair(0.27)))
    assert hausdorff(ours, exact, ("v", Angle("phi"))) < 2e-3
