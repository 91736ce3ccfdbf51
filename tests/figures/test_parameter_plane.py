"""A plane shows each pixel's period in its fixed colour, hatches what coexists or is refused, and draws curves over it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from messages import message

import nsmaps
from nsmaps.dynamics.curves.curve import BifurcationCurve
from nsmaps.dynamics.curves.special import SpecialPoint
from nsmaps.dynamics.planes.motions import Motion
from nsmaps.dynamics.planes.plane import ParameterPlane
from nsmaps.errors import NsmapsError
from nsmaps.figures.page import lay_out
from nsmaps.figures.parameters.parameter_plane import COLOURS, MINUS_INFINITY, UNKNOWN, exponents, mean, parameter_plane, sheets
from nsmaps.figures.style import drawing
from nsmaps.study.store.archive import FORMAT
from nsmaps.study.study import CATALOGUE

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}" / "plane"
MOTIONS = (*(Motion(f"1:1/{n}T", ("BTB",) * n, n, turns) for n, turns in ((1, 1), (2, 4), (12, 12))), Motion("C", (), 0, 0))
MOTION = np.array([[0, 1, 3], [2, 0, -1]])
REFUSED = np.array([[False] * 3, [False, False, True]])
ATTRACTOR = np.array([[[0, 0], [0, 1], [0, 0]], [[0, 0], [0, 0], [-1, -1]]], np.int8)


def made(motion=MOTION, refused=REFUSED):
    shape = motion.shape
    return ParameterPlane(
        coordinates=("v", nsmaps.Angle("phi")),
        parameters=("d", "r"),
        along=np.array([0.1, 0.2, 0.3]),
        across=np.array([0.5, 0.6]),
        motions=MOTIONS,
        motion=np.repeat(motion[..., None], 2, axis=2).astype(np.int32),
        attractor=ATTRACTOR,
        exponent=np.where(motion == 3, 0.4, -0.2)[..., None].repeat(2, axis=2),
        outcome=np.zeros((*shape, 2), np.int8),
        state=np.zeros((*shape, 2, 2)),
        observables=("loss",),
        means=np.where(motion < 0, np.nan, motion + 0.5)[..., None, None].repeat(2, axis=2),
        refused=refused,
        computed=np.ones(shape, bool),
        reason="r is 2",
        n_returns=100,
    )


def colours(ax):
    mesh = ax.collections[0]
    return [to_hex(colour) for colour in mesh.to_rgba(mesh.get_array().reshape(2, 3)).reshape(-1, 4)]


def test_periods_have_their_colours_in_every_chart(ax):
    parameter_plane(made(), ax)
    one, two, grey, black, white = (to_hex(COLOURS[k]) for k in (0, 1, 6, 7, 10))
    assert colours(ax) == [one, two, black, grey, one, white]
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["1", "2", "above 6", "chaos", "several attractors", "refused parameters: 1 pixels"]
    patches = {patch.get_label(): to_hex(patch.get_facecolor()) for patch in ax.get_legend().get_patches()[:4]}
    assert patches == {"1": one, "2": two, "above 6": grey, "chaos": black}
    assert len(set(COLOURS)) == 12


def test_what_coexists_and_what_is_refused_are_hatched(ax):
    parameter_plane(made(), ax)
    several, refused = ax.collections[1:]
    assert (several.hatches, refused.hatches) == (["////"], ["xxxx"])
    assert several.get_paths()[0].contains_point((0.2, 0.5))
    assert not several.get_paths()[0].contains_point((0.3, 0.6))
    assert refused.get_paths()[0].contains_point((0.3, 0.6))
    ax.clear()
    parameter_plane(made(refused=np.zeros((2, 3), bool)), ax)
    assert [each.get_text() for each in ax.get_legend().get_texts()][-2:] == ["no attractor", "several attractors"]


def test_the_colours_may_be_by_periods_of_the_forcing(ax):
    parameter_plane(made(), ax, by="turns")
    assert colours(ax)[1] == to_hex(COLOURS[3])
    with pytest.raises(NsmapsError, match=message("figures.colours-of-plane", name="words")):
        parameter_plane(made(), ax, by="words")


def test_motions_have_the_colours_that_the_legend_gives_them(ax):
    parameter_plane(made(refused=np.zeros((2, 3), bool)), ax, by="motion")
    names = {to_hex(patch.get_facecolor()): patch.get_label() for patch in ax.get_legend().get_patches()[:5]}
    assert [names[colour] for colour in colours(ax)] == ["1:1/1T", "1:1/2T", "chaos", "1:1/12T", "1:1/1T", "no attractor"]
    assert (ax.get_title(), ax.get_xlabel(), ax.get_ylabel()) == ("motion", "$d$", "$r$")


def test_motions_beyond_the_six_most_frequent_are_grey(ax):
    motions = tuple(Motion(f"1:{n}/T", ("BTB",), 1, 1) for n in range(8))
    motion = np.resize(np.concatenate([np.arange(8), np.arange(6)]), (2, 3 * 7))
    row = wide(np.zeros((2, 21)))
    parameter_plane(replace(row, motions=motions, motion=motion[..., None].astype(np.int32)), ax, by="motion")
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == [*(f"1:{n}/T" for n in range(6)), "other motions"]
    numbers = ax.collections[0].get_array().reshape(2, 21)
    assert np.array_equal(numbers, np.minimum(motion, 6) + 1)


def test_curves_lie_over_it_with_their_special_points(ax):
    line = np.array([[0.2, 0.5], [0.9, 0.55], [0.3, 0.6]])
    cusp = SpecialPoint("cusp", (0.25, 0.55), (1e-9, 1e-9), None)
    fold = BifurcationCurve("fold", line, np.zeros((3, 1, 2)), ("BTB",), np.ones((3, 2), complex), (cusp,), ("", ""))
    doubling = replace(fold, kind="period doubling", parameters=line[:1], special=())
    parameter_plane(made(), ax, curves={"fold of 1:1": fold, "period doubling of 1:1": doubling})
    drawn = {each.get_label(): each.get_xydata() for each in ax.lines}
    assert np.array_equal(drawn["fold of 1:1"], line)
    assert np.array_equal(drawn["cusp"], [[0.25, 0.55]])
    assert np.array_equal(drawn["period doubling of 1:1"], line[:1])
    assert ax.get_xlim() == pytest.approx((0.05, 0.35))  # that of the plane
    assert [text.get_text() for text in ax.get_legend().get_texts()][-3:] == ["fold of 1:1", "period doubling of 1:1", "cusp"]


def test_exponents_are_centred_at_zero(ax):
    exponents(made(), ax)
    mesh = ax.collections[0]
    assert mesh.norm(0.0) == 0.5
    assert np.allclose(mesh.get_array().reshape(2, 3), made().exponent[..., 0])
    (bar,) = [each for each in ax.figure.axes if each is not ax]
    assert [tick.get_text() for tick in bar.get_yticklabels()] == ["−0.2", "−0.1", "0", "0.2", "0.4"]


def test_the_colours_of_exponents_leave_out_what_lies_beyond_and_a_side_without_exponents(ax):
    values = np.linspace(-1.0, -0.01, 200).reshape(10, 20)
    values[0, 0], values[5, 5] = -50.0, 0.3
    exponents(wide(values), ax)
    (bar,) = [each for each in ax.figure.axes if each is not ax]
    ends = [float(tick.get_text().replace("−", "-")) for tick in bar.get_yticklabels()]
    assert ends == pytest.approx([-0.98, -0.49, 0.0], abs=0.02), "no side for one of 200 pixels"
    mesh = ax.collections[0]
    red, blue = mesh.to_rgba(0.3), mesh.to_rgba(-50.0)
    assert (red[0] > red[2], blue[0] < blue[2]) == (True, True)
    assert mesh.to_rgba(0.0)[2] < 0.8 < mesh.to_rgba(0.0)[0], "yellow at zero, no white, which means something else"


def test_minus_infinity_and_what_was_not_computed_have_colours_of_their_own(ax):
    values = np.array([[-np.inf, 0.0, 0.4], [np.nan, -0.2, -0.2]])[..., None].repeat(2, axis=2)
    exponents(replace(made(), exponent=values, computed=np.array([[True] * 3, [False, True, True]])), ax)
    meshes = [each for each in ax.collections if isinstance(each, QuadMesh)]
    shown = [np.ma.filled(mesh.get_array().astype(float), np.nan).reshape(2, 3) for mesh in meshes]
    assert np.array_equal(shown[0], np.where(np.isfinite(values[..., 0]), values[..., 0], np.nan), equal_nan=True)
    assert np.isfinite(shown[1]).tolist() == [[True, False, False], [False, False, False]]
    assert np.isfinite(shown[2]).tolist() == [[False, False, False], [True, False, False]]
    assert [each.get_text() for each in ax.get_legend().get_texts()] == ["exponent minus infinity", "not computed"]
    drawn = [to_hex(mesh.to_rgba(1.0)) for mesh in meshes[1:]]
    assert drawn[0] == to_hex(MINUS_INFINITY)
    assert len({*drawn, to_hex(ax.collections[0].to_rgba(0.0))}) == 3
    (dots,) = [each for each in ax.collections if not isinstance(each, QuadMesh)]
    assert dots.hatches == [UNKNOWN]
    assert dots.get_paths()[0].contains_point((0.1, 0.6))
    assert not dots.get_paths()[0].contains_point((0.2, 0.6))


def test_where_nothing_attracts_an_exponent_is_white_and_not_called_unknown(ax):
    missing = np.where(MOTION[..., None] < 0, np.nan, made().exponent)
    plain = replace(made(refused=np.zeros((2, 3), bool)), exponent=missing)
    exponents(plain, ax)
    (entry,) = ax.get_legend().legend_handles
    assert (entry.get_label(), to_hex(entry.get_facecolor())) == ("no attractor", "#ffffff")


def test_an_exponent_that_is_zero_but_for_rounding_is_zero(ax):
    values = np.where(np.arange(200) < 20, 2.2e-16, -0.1).reshape(10, 20)
    exponents(wide(values), ax)
    (bar,) = [each for each in ax.figure.axes if each is not ax]
    assert [tick.get_text() for tick in bar.get_yticklabels()] == ["−0.1", "−0.05", "0"]
    assert np.count_nonzero(ax.collections[0].get_array() == 0.0) == 20


def test_a_lowest_exponent_that_many_pixels_share_but_for_rounding_has_nothing_below_it(ax):
    values = np.where(np.arange(200) < 150, np.log(0.25) * (1 + 1e-15 * np.arange(200)), -0.5).reshape(10, 20)
    exponents(wide(values), ax)
    (bar,) = [each for each in ax.figure.axes if each is not ax]
    assert bar._colorbar.extend == "neither"


def test_what_was_not_computed_is_told_apart_from_what_has_no_attractor(ax):
    computed = np.array([[True] * 3, [True, True, False]])
    parameter_plane(replace(made(refused=np.zeros((2, 3), bool)), computed=computed), ax)
    assert colours(ax)[-1] == to_hex(COLOURS[11])
    assert [each.hatches for each in ax.collections if not isinstance(each, QuadMesh)] == [[UNKNOWN], ["////"]]
    assert "not computed" in [each.get_text() for each in ax.get_legend().get_texts()]
    assert ax.get_title() == "period, 83 % computed"


def wide(exponent):
    """A plane of these exponents, of motions of period 1 in its left half and of period 2 in its right one."""
    rows, columns = exponent.shape
    shape = (rows, columns, 1)
    motion = np.where(np.arange(columns) < columns // 2, 0, 1) * np.ones((rows, 1), int)
    arrays = {
        "motion": motion[..., None].astype(np.int32),
        "exponent": exponent[..., None],
        "attractor": np.zeros(shape, np.int8),
    }
    arrays |= {"outcome": np.zeros(shape, np.int8), "state": np.zeros((*shape, 2)), "means": np.zeros((*shape, 1))}
    arrays |= {"refused": np.zeros(shape[:2], bool), "computed": np.ones(shape[:2], bool)}
    return replace(made(), along=np.arange(columns) * 1.0, across=np.arange(rows) * 1.0, **arrays)


def test_wide_areas_have_the_name_of_their_period_or_motion(ax):
    parameter_plane(wide(np.zeros((20, 40))), ax)
    assert [(text.get_text(), text.get_color()) for text in ax.texts] == [("2", "black"), ("1", "black")]
    (one, _), (two, _) = sorted(text.get_position() for text in ax.texts)
    assert 5 <= one <= 14
    assert 25 <= two <= 34
    ax.clear()
    parameter_plane(wide(np.zeros((20, 40))), ax, "motion")
    assert sorted(text.get_text() for text in ax.texts) == ["1:1/1T", "1:1/2T"]
    ax.clear()
    parameter_plane(made(), ax)
    assert len(ax.texts) <= 16


def test_an_optimum_is_a_star_of_the_legend_in_every_panel():
    found = SimpleNamespace(parameters={"d": 0.2, "r": 0.55, "M": 1.0})
    figure, motions = (sheet.figure() for sheet in sheets(made(), optimum=found))
    stars = [line for each in (figure, motions) for ax in each.axes for line in ax.lines if line.get_marker() == "*"]
    assert [line.get_xydata().tolist() for line in stars] == [[[0.2, 0.55]]] * 4
    assert [text.get_text() for text in figure.legends[0].get_texts()].count("optimum") == 1


def test_the_legend_of_three_panels_stands_in_the_place_of_the_fourth():
    sheet, _ = sheets(made())
    figure = sheet.figure()
    (legend,) = figure.legends
    box = legend.get_window_extent().transformed(figure.transFigure.inverted())
    assert box.x0 >= 0.5 - 1e-6
    assert box.y1 <= 0.5 + 1e-6
    assert figure.get_size_inches()[1] == pytest.approx(2 * 0.85 * 5.1 / 2)


def test_labels_of_colours_keep_their_distance_from_the_edge_of_the_page():
    sheet, _ = sheets(wide(np.linspace(-1.4, 0.3, 200).reshape(10, 20)))
    with drawing({}):
        figure = sheet.figure(100)
        lay_out(figure)
        figure.canvas.draw()
    ends = [ax.yaxis.label.get_window_extent().x1 for ax in figure.axes if ax.get_label() == "<colorbar>"]
    assert len(ends) == 2
    assert max(ends) <= figure.bbox.width - 3


def test_means_are_shown_by_name(ax):
    mean(replace(made(), units={"loss": "J"}), ax, "loss")
    assert [each.get_ylabel() for each in ax.figure.axes if each is not ax] == ["loss (J)"]
    assert np.allclose(ax.collections[0].get_array().reshape(2, 3).filled(-1), np.where(MOTION < 0, -1, MOTION + 0.5))
    with pytest.raises(NsmapsError, match=message("figures.colours-of-plane", name="gain")):
        mean(made(), ax, "gain")


def test_the_sheet_of_a_stored_run_has_its_curve():
    result = nsmaps.read_result(STORED)
    figure, motions = (sheet.figure() for sheet in CATALOGUE["parameter_plane"].sheets(result))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "period doubling of 1:1" in texts
    assert {"largest exponent per return", "loss", "fastest"} < {ax.get_ylabel() for ax in figure.axes}
    assert "refused parameters: 5 pixels" in texts
    assert {"1:1/T", "period doubling of 1:1"} < {text.get_text() for text in motions.legends[0].get_texts()}


def test_one_panel_alone_and_no_motions_where_their_names_are_periods():
    (one,) = sheets(made(), by="turns")
    assert [ax.get_title() for ax in one.figure().axes] == ["period in periods of the forcing"]
    named = tuple(replace(each, label=f"period {each.period}") if each.period else each for each in MOTIONS)
    assert [sheet.name for sheet in sheets(replace(made(), motions=named))] == ["parameter_plane"]
