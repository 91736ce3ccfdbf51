"""The filter near the diagonals, eq. r1uniond: by hand, on analytic maps, and its union over a parameter."""

import math
from functools import partial

import numpy as np
import pytest
import sheets
from messages import message
from pydantic import ValidationError
from sheets import NAMES, TWO_PI, returns_of

from nsmaps.coordinates import Coordinates
from nsmaps.errors import FitError
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.filter import NearDiagonal, diagonal_region, near_diagonal, own_slopes
from nsmaps.reduced.fit.filter_errors import compare_deltas
from nsmaps.reduced.fit.polyfit import PolynomialFit

surface_of = partial(sheets.surface_of, v=(0.1, 1.0, 31), phi=(0.1, 3.0, 41))


def test_the_ratios_by_hand():
    start = [[1, 1], [1, 1], [1, 1], [1, 1], [0.6, 0.5], [0, 0.5], [0.5, 0], [1, 1], [1, 1]]
    image = [[1.19, 1], [1.21, 1], [1, 0.84], [1, 0.83], [0.7, 0.45], [0, 0.5], [0.5, 0], [np.nan, 1], [-1.1, 1]]
    expected = [True, False, True, False, True, False, False, False, True]
    assert near_diagonal(returns_of(start, image), 1.2).tolist() == expected


def test_the_ratio_is_strict():
    assert not near_diagonal(returns_of([[1, 1], [1.5, 1]], [[1.5, 1], [1, 1]]), 1.5).any()


def test_angles_are_compared_in_one_turn():
    start = [[1, 1], [1, 1 + TWO_PI], [1, 1 - TWO_PI], [1, 0.05]]
    lifted = [[1, 1.1 + 3 * TWO_PI], [1, 1.1], [1, 1.1], [1, -0.05]]
    assert near_diagonal(returns_of(start, lifted), 1.2).tolist() == [True, True, True, False]


def test_slopes_of_quadratics_are_exact_and_missing_at_edges():
    surface = surface_of(lambda v, phi: (v**2 * phi, 5 + 3 * phi**2 - v))
    slopes = surface.on_grid(own_slopes(surface)[:, 0]), surface.on_grid(own_slopes(surface)[:, 1])
    v, phi = surface.grid.mesh()
    np.testing.assert_allclose(slopes[0][1:-1], (2 * v * phi)[1:-1], rtol=1e-12)
    np.testing.assert_allclose(slopes[1][:, 1:-1], (6 * phi)[:, 1:-1], rtol=1e-10)
    assert np.isnan(slopes[0][[0, -1]]).all()
    assert np.isnan(slopes[1][:, [0, -1]]).all()


def test_slopes_are_missing_next_to_the_surfaces_own_edge():
    surface = surface_of(lambda v, phi: (v, phi), member=lambda v, phi: v < 0.52)
    slope = surface.on_grid(own_slopes(surface)[:, 0])
    last = np.flatnonzero(np.isfinite(surface.on_grid(surface.start[:, 0])[:, 0]))[-1]
    assert np.isnan(slope[last]).all()
    np.testing.assert_allclose(slope[last - 1], 1, rtol=1e-12)


def test_slopes_pass_over_the_seam_of_the_circle():
    surface = surface_of(lambda v, phi: (v, TWO_PI - 1 + 0.7 * phi))
    inner = surface.on_grid(own_slopes(surface)[:, 1])[:, 1:-1]
    np.testing.assert_allclose(inner, 0.7, rtol=1e-10)


def test_only_gentle_slopes_attract():
    surface = surface_of(lambda v, phi: (0.8 + 3 * (v - 0.8) ** 2, 0.9 * phi))
    near = NearDiagonal(delta=1.2)
    gentle = NearDiagonal(delta=1.2, slope=1.0)
    v = surface.start[:, 0]
    inner = surface.on_grid(np.ones(len(v)))
    passing = near.near(surface).member[surface.member]
    inner[[0, -1]] = inner[:, [0, -1]] = 0
    expected = passing & (np.abs(6 * (v - 0.8)) <= 1) & (inner.ravel()[surface.member] > 0)
    np.testing.assert_array_equal(gentle.near(surface).start, surface.start[expected])
    assert 0 < expected.sum() < passing.sum()


def test_a_region_restricts():
    surface = surface_of(lambda v, phi: (v, phi))
    for region in (
        ConditionRegion(text="phi < pi/2", coordinates=NAMES),
        Box(coordinates=NAMES, bounds={"phi": (0, "pi/2"), "v": (0, 2)}),
    ):
        kept = NearDiagonal(delta=1.2, region=region).near(surface).start
        np.testing.assert_array_equal(kept, surface.start[surface.start[:, 1] < math.pi / 2])


def test_the_union_over_a_parameter():
    sweeps = [(c, surface_of(lambda v, phi, c=c: (np.full_like(v, c), phi))) for c in (0.4, 0.5, 0.8)]
    found = diagonal_region(NearDiagonal(delta=1.25), sweeps)
    v = np.linspace(0.1, 1.0, 31)
    passing = [v[(c / v < 1.25) & (c / v > 0.8)] for c in (0.4, 0.5, 0.8)]
    union = np.unique(np.concatenate(passing))
    np.testing.assert_array_equal(np.unique(found.start[:, 0]), union)
    assert len(found.start) == len(union) * 41
    assert len(np.unique(found.start, axis=0)) == len(found.start)
    np.testing.assert_array_equal(found.box, [[union.min(), union.max()], [0.1, 3.0]])
    assert [value for value, _ in found.values] == [0.4, 0.5, 0.8]
    assert [len(states) for _, states in found.values] == [41 * len(each) for each in passing]
    assert found.coordinates == Coordinates(NAMES)
    for c, (_, states), images in zip((0.4, 0.5, 0.8), found.values, found.images, strict=True):
        np.testing.assert_allclose(images, np.column_stack([np.full(len(states), c), states[:, 1]]), rtol=1e-15)


def test_fits_are_compared_for_each_delta_once():
    surface = surface_of(lambda v, phi: (0.5 * np.ones_like(v), phi + v**2 / 100))
    orders = {"line": PolynomialFit(degrees={"v": 1, "phi": 1}), "square": PolynomialFit(degrees={"v": 2, "phi": 1})}
    made = compare_deltas(NearDiagonal(delta=1.2), surface, [1.5, 1.2, 1.8], orders)
    assert [near.delta for near in made] == [1.2, 1.5, 1.8]
    v = np.linspace(0.1, 1.0, 31)
    for near in made:
        inside = v[(0.5 / v < near.delta) & (0.5 / v > 1 / near.delta)]
        np.testing.assert_array_equal(np.unique(near.surface.start[:, 0]), inside)
        line = np.column_stack([np.ones_like(inside), inside])
        missed = inside**2 / 100 - line @ np.linalg.lstsq(line, inside**2 / 100)[0]
        assert near.maps["line"].report.sse[1] == pytest.approx(41 * missed @ missed, rel=1e-9)
        assert near.maps["square"].report.max_error[1] < 1e-14


def test_a_fit_that_fails_names_its_delta_and_its_order():
    surface = surface_of(lambda v, phi: (0.5 * np.ones_like(v), phi))
    orders = {"high": PolynomialFit(degrees={"v": 9, "phi": 1})}
    with pytest.raises(FitError, match=message("reduced.at-values", number=10, at="delta 1.1: fit 'high': v'")):
        compare_deltas(NearDiagonal(delta=1.8), surface, [1.1], orders)


def test_no_state_near_the_diagonals_is_an_answer():
    found = diagonal_region(NearDiagonal(delta=1.2), [(0.0, surface_of(lambda v, phi: (9 * v, phi)))])
    assert found.start.shape == (0, 2)
    assert np.isnan(found.box).all()


def test_what_is_refused():
    with pytest.raises(FitError, match=message("reduced.surfaces-of-fits")):
        diagonal_region(NearDiagonal(delta=1.2), [])
    for bad in ({"delta": 1.0}, {"delta": "1/2"}, {"delta": 1.2, "slope": 0}, {"delta": math.inf}, {"delta": 1.2, "slop": 1}):
        with pytest.raises(ValidationError):
            NearDiagonal(**bad)
