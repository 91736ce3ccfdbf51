"""The pictures of fits: near the diagonals by delta and order, and separable maps beside the exact one."""

from dataclasses import replace

import numpy as np
import pytest
from figures.conftest import SECTIONS, panel, study_of
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgba
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.figures.fits.diagonal import diagonal
from nsmaps.figures.fits.fit_error import fit_error
from nsmaps.figures.fits.fit_error import sheets as error_sheets
from nsmaps.figures.fits.orders import orders
from nsmaps.figures.returns.diagonal_surface import diagonal_surface
from nsmaps.figures.style import GREEN, ORANGE
from nsmaps.reduced.fit.filter import Attracting, NearDiagonal
from nsmaps.study.study import CATALOGUE

TWO_PI = 2 * np.pi
IMAGE = (lambda v, phi: 0.95 - 0.15 * phi - 0.2 * v, lambda v, phi: (0.5 - 0.3 * phi + 0.05 * v) % TWO_PI)
LABELS = (
    ("$v_{k}$", "$v_{k+1}$"),
    (r"$\phi_{k}$ (rad)", r"$\phi_{k+1}$ (rad)"),
)
both = pytest.mark.parametrize(("coordinate", "i"), [("v", 0), ("phi", 1)])


def near_by_hand(states, delta):
    """The states whose image by the toy's formula is within the ratio in both coordinates, and lies on the surface BTB."""
    v, phi = states.T
    with np.errstate(divide="ignore"):
        ratios = np.array([IMAGE[0](v, phi) / v, IMAGE[1](v, phi) / phi])
    return states[((ratios < delta) & (ratios > 1 / delta)).all(axis=0) & (v > 0.5 - 0.2 * phi)]


def rows(points):
    return {tuple(row) for row in np.asarray(points).round(9).tolist()}


@both
def test_the_diagonal_shows_one_value_within_all(result, ax, coordinate, i):
    panel(diagonal, result, ax, coordinate=coordinate, value=2)
    shown = {line.get_label(): line for line in ax.lines}
    union, here = [line.get_xydata() for line in ax.lines if line.get_marker() == "o"]
    states = near_by_hand(result.surfaces["BTB"].grid.states(), 1.2)
    inner = states[states[:, 0] > 0.72]
    assert 0 < len(inner) < len(states)
    assert rows(union) == rows(np.column_stack([states[:, i], IMAGE[i](*states.T)]))
    assert rows(here) == rows(np.column_stack([inner[:, i], IMAGE[i](*inner.T)]))
    assert {"4 values of $d$ in [0.1, 0.3]", "one value of $d$", "ratio $1.2^{\\pm 1}$"} <= set(shown)
    assert ax.get_title() == "$d$ = 0.17"
    assert (ax.get_xlabel(), ax.get_ylabel()) == LABELS[i]


def test_the_diagonal_has_rows_for_the_first_the_middle_and_the_last_value(result):
    (sheet,) = CATALOGUE["diagonal"].sheets(result)
    assert [panel.keywords["value"] for panel in sheet.panels] == [0, 0, 2, 2, 3, 3]


def test_the_diagonal_has_rows_for_the_values_that_the_study_names(result):
    section = SECTIONS["diagonal"]
    study = study_of(diagonal={**section, "shown": [0.1, 0.3, 0.3 - 0.2 / 3]})
    (sheet,) = CATALOGUE["diagonal"].sheets(replace(result, study=study))
    assert [panel.keywords["value"] for panel in sheet.panels[::2]] == [3, 0, 1]
    with pytest.raises(ValueError, match=message("study.not-swept", name="shown", value=0.2)):
        study_of(diagonal={**section, "shown": [0.2]})
    with pytest.raises(ValueError, match=message("study.not-swept", name="shown", value=0.3)):
        study_of(diagonal={"family": "BTB", "delta": 1.2, "shown": [0.3]})


def test_the_diagonal_without_a_sweep_shows_the_studys_own_parameters(result, ax):
    alone = study_of(diagonal={"family": "BTB", "delta": 1.2})
    panel(diagonal, replace(result, study=alone), ax)
    assert ax.get_legend().get_texts()[0].get_text() == "the study's own parameters"


@both
def test_the_surface_is_blue_near_the_diagonals_and_only_there(result, ax3d, coordinate, i):
    panel(diagonal_surface, result, ax3d, coordinate=coordinate)
    (facets,) = ax3d.collections
    drawn = facets.points
    assert drawn[:, 2] == pytest.approx(IMAGE[i](*drawn[:, :2].T), abs=1e-12)
    blue = facets.colours[:, 2] > facets.colours[:, 0] + 0.1
    (of_blue,) = {tuple(row) for row in blue[facets.triangles]} - {(False, False, False)}
    assert of_blue == (True, True, True), "no triangle has both colours"
    states = drawn[np.unique(facets.triangles[blue[facets.triangles[:, 0]]]), :2]
    assert set(rows(near_by_hand(result.surfaces["BTB"].grid.states(), 1.2))) <= set(rows(states))
    images = np.column_stack([IMAGE[k](*states.T) for k in (0, 1)])
    ratio = np.maximum(images / states, states / images)
    assert ratio.max() == pytest.approx(1.2, abs=1e-6), "up to the border of the filter"
    assert ax3d.get_title().startswith(("$v_{k+1}$", r"$\phi_{k+1}$")[i])


def test_a_bound_on_slopes_is_that_of_exact_derivatives():
    system, family = nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113), WordFamily(name="BTB", words=("BTB",))
    start = np.random.default_rng(2).uniform((0.6, 0.2), (0.9, 0.5), (400, 2))
    returns = system.first_return(start)
    returns = returns.select(returns.has_word("BTB"))
    free, bound = (Attracting(NearDiagonal(delta=1.4, slope=slope), system, family)(returns) for slope in (None, 0.5))
    step = 1e-6 * np.eye(2)
    slopes = [np.abs(system.first_return(returns.start + h).lifted - system.first_return(returns.start - h).lifted) for h in step]
    gentle = np.column_stack([slopes[k][:, k] for k in (0, 1)]).max(axis=1) / 2e-6
    clear = np.abs(gentle - 0.5) > 1e-3
    assert np.array_equal((free * (gentle <= 0.5))[clear], bound[clear])
    assert 0 < bound.sum() < free.sum()


@both
@pytest.mark.parametrize("statistic", ["r2", "sse"])
def test_orders_are_those_of_a_least_squares_solver(result, ax, coordinate, i, statistic):
    orders(result.near, ax, coordinate, statistic)
    assert [text.get_text() for text in ax.get_xticklabels()] == ["poly01", "poly11"], "by their number of terms"
    assert ax.get_yscale() == "log"
    for line, delta in zip(ax.lines, (1.2, 1.4), strict=True):
        v, phi = near_by_hand(result.surfaces["BTB"].grid.states(), delta).T
        image = IMAGE[i](v, phi)
        columns = np.column_stack([np.ones_like(v), v])
        sse = np.sum((columns @ np.linalg.lstsq(columns, image)[0] - image) ** 2)
        expected = sse if statistic == "sse" else sse / np.sum((image - image.mean()) ** 2)
        assert line.get_ydata()[0] == pytest.approx(expected, rel=1e-9)
        assert line.get_ydata()[1] < 1e-12, "the map is linear"
        assert f"$\\delta = {delta}$ ({len(v)} states)" == line.get_label()


@both
def test_errors_are_painted_in_the_cells_of_their_states(result, ax, coordinate, i):
    fit_error(result.near, ax, coordinate, 1, "poly01")
    (mesh,) = [artist for artist in ax.collections if isinstance(artist, QuadMesh)]
    states = near_by_hand(result.surfaces["BTB"].grid.states(), 1.4)
    image, columns = IMAGE[i](*states.T), np.column_stack([np.ones(len(states)), states[:, 0]])
    error = np.abs(columns @ np.linalg.lstsq(columns, image)[0] - image)
    painted = np.ma.filled(mesh.get_array(), np.nan).ravel()
    corners = mesh.get_coordinates()
    cells = ((corners[:-1, :-1] + corners[1:, 1:]) / 2).reshape(-1, 2)[np.isfinite(painted)]
    assert rows(cells) == rows(states)
    expected = dict(zip(map(tuple, states.round(9).tolist()), np.maximum(error, mesh.norm.vmin), strict=True))
    drawn = dict(zip(map(tuple, cells.round(9).tolist()), painted[np.isfinite(painted)], strict=True))
    assert drawn == pytest.approx(expected, rel=1e-9)
    assert mesh.norm.vmax == pytest.approx(error.max())
    assert mesh.norm.vmin == pytest.approx(error.max() / 1e4)


def test_errors_have_a_file_an_order_and_a_row_a_delta(result):
    made = error_sheets(result.near)
    assert [sheet.name for sheet in made] == ["fit_error", "fit_error-poly01"]
    assert [(panel.keywords["delta"], panel.keywords["coordinate"]) for panel in made[0].panels] == [
        (0, "v"),
        (0, "phi"),
        (1, "v"),
        (1, "phi"),
    ]


@pytest.mark.parametrize(("width", "scales"), [(5.1, 2), (3.4, 4)])
def test_errors_of_one_coordinate_share_a_scale_where_their_panels_stand_in_a_column(result, width, scales):
    figure = error_sheets(result.near)[0].figure(width=width)
    bars = [ax for ax in figure.axes if "error" in ax.get_ylabel()]
    assert len(bars) == scales


@both
def test_separable_curves_are_those_of_both_maps(result, ax, coordinate, i):
    CATALOGUE["separable"].sheets(result)[0].panels[i](ax)
    by_colour = {to_rgba(line.get_color()): line.get_xydata() for line in ax.lines if line.get_linestyle() != "None"}
    exact, fitted = by_colour[to_rgba(GREEN)], by_colour[to_rgba(ORANGE)]
    held = 0.825, 13 * np.pi / 40  # the grid lines nearest to v = 0.83 and phi = 1
    state = [exact[:, 0], held[1]] if i == 0 else [held[0], exact[:, 0]]
    assert np.mod(exact[:, 1] - IMAGE[i](*state) + 1, 2 * np.pi) == pytest.approx(1, abs=1e-12)
    assert fitted[:, 1] == pytest.approx(((0.9 - 0.2 * fitted[:, 0]), (0.5 - 0.1 * fitted[:, 0]))[i], abs=1e-12)
    assert (fitted[0, 0], fitted[-1, 0]) == pytest.approx((exact[0, 0], exact[-1, 0]))
    assert (ax.get_xlabel(), ax.get_ylabel()) == LABELS[i]


def test_separable_curves_lie_on_the_surface(result, ax3d):
    CATALOGUE["separable"].sheets(result)[0].panels[2](ax3d)
    exact, fitted = (np.column_stack(line.get_data_3d()) for line in ax3d.lines)
    assert exact[:, 2] == pytest.approx(IMAGE[0](*exact[:, :2].T), abs=1e-12)
    assert fitted[:, 2] == pytest.approx(0.9 - 0.2 * fitted[:, 0], abs=1e-12)
    assert len(np.unique(exact[:, 1])) == len(np.unique(fitted[:, 1])) == 1
    (facets,) = ax3d.collections
    drawn = facets.points[np.unique(facets.triangles)]
    assert drawn[:, 0].min() == pytest.approx(0.3, abs=1e-6), "the region of the piece, up to its border"


def test_separable_without_lines_of_its_own_is_shown_along_the_medians(result, ax):
    piece = {"name": "R2", "where": "v > 0.3", "family": "BTB", "fit": {"separable": {"v": 1, "phi": 1}}}
    CATALOGUE["separable"].sheets(replace(result, study=study_of(composite=[piece])))[0].panels[0](ax)
    start = result.surfaces["BTB"].start
    median = np.median(start[start[:, 0] > 0.3, 1])
    assert ax.get_title() == f"$\\phi_{{k}}$ = {median:.4g}"


def test_a_gap_of_the_surface_is_a_gap_of_the_curve(result, ax):
    surface = result.surfaces["BTB"]
    holed = surface.restrict(np.abs(surface.start[:, 0] - 0.6) > 0.06)
    CATALOGUE["separable"].sheets(result.with_parts({"surfaces": {"BTB": holed}}))[0].panels[0](ax)
    (exact,) = [line.get_xydata() for line in ax.lines if line.get_label() == "exact map"]
    (gap,) = np.flatnonzero(np.isnan(exact[:, 0]))
    assert exact[gap - 1, 0] < 0.55 < 0.65 < exact[gap + 1, 0]


def test_separable_has_planes_above_surfaces(result):
    (sheet,) = CATALOGUE["separable"].sheets(result)
    assert (sheet.projection, sheet.columns) == ((None, None, "3d", "3d"), 2)


def test_no_fit_to_show_is_an_error_that_names_one(result, ax):
    bare = (replace(result.near[0], maps={}),)
    with pytest.raises(NsmapsError, match=message("study.not-in-result", figure="orders", sections="'orders' in 'diagonal'")):
        CATALOGUE["orders"].sheets(result.with_parts({"near": bare}))
    study = study_of(composite=SECTIONS["composite"][:1])
    with pytest.raises(
        NsmapsError,
        match=message("study.not-in-result", figure="separable", sections="a piece of 'composite' with a 'separable' fit"),
    ):
        CATALOGUE["separable"].sheets(replace(result, study=study))


def test_no_state_near_the_diagonals_is_an_error_that_says_so(result, ax):
    surface = result.near[0].surface
    none = (replace(result.near[0], surface=surface.restrict(np.zeros(len(surface.start), bool)), maps={}),)
    with pytest.raises(NsmapsError, match=message("figures.nothing-near-diagonals")):
        CATALOGUE["orders"].sheets(result.with_parts({"near": none}))


def test_a_run_that_kept_no_images_says_so(result, ax):
    older = replace(result.diagonal, images=())
    with pytest.raises(NsmapsError, match=message("study.not-in-result", what="the region near the diagonals with its images")):
        panel(diagonal, result.with_parts({"diagonal": older}), ax)
