"""The study of fits: table TableDeltaErr and figs. R1compared, r2approx, r5approx by independent computations."""

import numpy as np
import pytest

import nsmaps
from nsmaps.study.pictures.draw import draw
from nsmaps.study.study import CATALOGUE

#: poly11, ..., as exponents of v and phi in MATLAB's order: in phi and v at most the two digits, in total the larger
TERMS = {
    name: [(a, b) for a in range(v + 1) for b in range(phi + 1) if a + b <= max(v, phi)]
    for name, (phi, v) in {"poly11": (1, 1), "poly22": (2, 2), "poly23": (2, 3), "poly33": (3, 3)}.items()
}


@pytest.fixture(scope="module")
def fits():
    return nsmaps.run_study("vi_pair/fits")


def near(fits, delta):
    """The BTB returns near both diagonals with phi < pi/2, by looking at each state of the grid: starts and images."""
    returns = fits.returns.select(fits.returns.valid & fits.returns.has_word("BTB"))
    with np.errstate(divide="ignore"):
        ratio = returns.image / returns.start
    keep = ((ratio < delta) & (ratio > 1 / delta)).all(axis=1) & (returns.start[:, 1] < np.pi / 2)
    return returns.start[keep], returns.image[keep]


@pytest.mark.parametrize(("k", "delta", "states"), [(0, 1.2, 666), (1, 1.3, 1594), (2, 1.4, 2239)])
def test_the_table_of_orders_is_that_of_plain_least_squares(fits, k, delta, states):
    start, image = near(fits, delta)
    made = fits.near[k]
    assert (made.delta, len(start), len(made.surface.start)) == (delta, states, states)
    x = (start - start.mean(axis=0)) / start.std(axis=0)
    for name, terms in TERMS.items():
        columns = np.column_stack([x[:, 0] ** a * x[:, 1] ** b for a, b in terms])
        sse = np.sum((columns @ np.linalg.lstsq(columns, image)[0] - image) ** 2, axis=0)
        assert made.maps[name].report.sse == pytest.approx(sse, rel=1e-6)
        assert 1 - made.maps[name].report.r2 == pytest.approx(sse / (len(image) * image.var(axis=0)), rel=1e-6)


def test_the_region_at_each_d_lies_on_the_exact_map(fits, pair):
    values = [value for value, _ in fits.diagonal.values]
    assert values == pytest.approx(np.linspace(0.35, 0.26, 10))
    for (d, start), image in zip(fits.diagonal.values, fits.diagonal.images, strict=True):
        assert image == pytest.approx(pair(d).first_return(start).image, abs=1e-12)
        assert ((image / start < 1.2) & (start / image < 1.2)).all()


def test_separable_maps_are_as_far_off_along_their_lines_as_the_page_says(fits):
    told = {"R2": (0.053, 0.093), "R4": (0.045, 0.49), "R5": (0.19, 0.068)}
    for name, errors in told.items():
        assert fits.composite.piece(name).map.report.max_error == pytest.approx(errors, rel=0.05)


def sheets(fits):
    return [sheet.name for name in fits.study.figures for sheet in CATALOGUE[name].sheets(fits)]


def test_all_figures_have_their_sheets(fits):
    orders, pieces = ["poly33", "poly22", "poly11"], ["R4", "R5"]
    assert sheets(fits) == [
        *("diagonal_surface", "orders"),
        *("fit_error", *(f"fit_error-{order}" for order in orders)),
        *("separable", *(f"separable-{piece}" for piece in pieces)),
    ]


@pytest.mark.thorough
def test_all_figures_are_drawn(fits, tmp_path):
    assert [path.stem for path in draw(fits, fits.study.figures, tmp_path, dpi=30)] == sheets(fits)
