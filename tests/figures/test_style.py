"""Labels, colours and lines."""

import doctest
from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from messages import message
from nsmaps_vi_pair import VIPair

from nsmaps import load_system
from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.figures import lines, style, ticks
from nsmaps.figures.page import Sheet, _letter, lay_out
from nsmaps.results import units_of
from nsmaps.study.pictures.draw import draw


class Metric(VIPair):
    """The pair as if its quantities had units."""

    dimensionless: ClassVar[bool] = False
    units: ClassVar[dict[str, str]] = {}


@pytest.mark.parametrize("module", [style, lines])
def test_docstrings_are_true(module):
    assert doctest.testmod(module).failed == 0


def test_labels_carry_their_unit():
    assert style.label("v", "k") == "$v_{k}$"
    assert style.label(Angle("phi"), "k+1") == r"$\phi_{k+1}$ (rad)"


def test_colours_of_families_are_told_apart():
    assert len(set(style.family_colours(["BB", "BTB", "BBTB", "BTTB", "main"]).values())) == 5


def test_resets_are_white_and_pieces_are_told_apart():
    colours = style.piece_colours(["reset", "R1", "R1+", "R2", "mine"], [True, False, False, False, False])
    assert colours[0] == "#FFFFFF"
    assert len(set(colours)) == 5


@pytest.mark.parametrize(("value", "text"), [(0, "0"), (np.pi, r"$\pi$"), (-np.pi / 2, r"$-\pi/2$"), (0.75 * np.pi, r"$3\pi/4$")])
def test_ticks_in_pi(value, text):
    assert ticks._in_pi(value) == text


def test_a_line_is_cut_where_it_jumps():
    assert np.array_equal(lines.cut(np.array([1.0, 6.0, 6.1]), 3.0), [np.nan, 6.0, 6.1], equal_nan=True)


def test_panels_are_lettered_beyond_z():
    assert [_letter(k) for k in (0, 25, 26, 27)] == ["a", "z", "aa", "ab"]


X = np.linspace(0, 1, 200)
JUMPS = {
    "to and fro between sheets": (np.where(np.arange(200) % 2 == 0, X, X + 0.5), 199),
    "a parabola": (4 * (X - 0.5) ** 2, 0),
    "a square root": (np.sqrt(np.maximum(1 - X, 0)), 0),
    "a seam": (np.mod(0.6 + X, 1.0), 1),
    "a lone step between two jumps": (np.concatenate([X[:100], [0.9, 0.93], X[102:] - 0.5]), 3),
}


@pytest.mark.parametrize("line", JUMPS)
def test_jumps_are_told_from_steep_parts(line):
    values, count = JUMPS[line]
    assert lines.jumps(values, 0.02).sum() == count
    assert np.array_equal(lines.jumps(np.stack([values, X]), 0.02)[0], lines.jumps(values, 0.02))


@pytest.mark.parametrize(("span", "in_pi"), [(0.92, False), (1.5, False), (np.pi, True), (2 * np.pi, True)])
def test_a_short_span_of_a_phase_has_decimal_ticks(ax, span, in_pi):
    ax.set(xlim=(0.1, 0.1 + span), ylim=(0, 1))
    style.dress(ax, (Angle("phi"), "k"), ("v", "k"))
    ax.figure.canvas.draw()
    inside = [tick.get_text() for tick in ax.get_xticklabels() if 0.1 <= tick.get_position()[0] <= 0.1 + span]
    assert any("pi" in text for text in inside) == in_pi
    assert len(inside) >= 2


def test_a_system_that_says_nothing_of_units_has_none(ax):
    with style.drawing(units_of(Metric(d=0.35, r=0.5, g_bar=0.2))):
        style.dress(ax, (Angle("phi"), "k"), ("a", ""))
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\phi_{k}$ (rad)", "$a$")


def test_units_are_those_of_the_system_whose_files_are_drawn(result, tmp_path):
    for units in ({}, {"v": "m/s"}):
        Metric.units = units
        system = Metric(**result.system.parameters)
        (path,) = draw(replace(result, system=system), ["domain_size"], tmp_path, ["svg"])
        assert ("(m/s)" in path.read_text()) == bool(units)


def test_a_journal_has_units_and_titles_in_the_caption(result, tmp_path):
    Metric.units = {"v": "m/s"}
    path, caption = draw(
        replace(result, system=Metric(**result.system.parameters)), ["envelopes"], tmp_path, ["svg"], style="journal"
    )[:2]
    assert "(m/s)" not in path.read_text()
    assert "STIXGeneral" in path.read_text()
    assert "$v_{k}$ in m/s." in caption.read_text().splitlines()
    assert any(line.startswith("(a) update 1") for line in caption.read_text().splitlines())
    with pytest.raises(NsmapsError, match=message("figures.style")):
        draw(result, ["envelopes"], tmp_path, style="siam")


def test_units_that_a_system_names_are_on_its_axes(ax):
    system = load_system("impact_oscillator", zeta=0.02, w=0.81, A=0.35, wall=1)
    with style.drawing(units_of(system)):
        style.dress(ax, ("A", ""), ("v", "k"))
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("$A$ (ℓ)", "$v_{k}$ (ω₀ℓ)")
        assert style.label("zeta") == r"$\zeta$"
        assert style.label(Angle("phi")) == r"$\phi$ (rad)"
        assert style.with_unit("time", "time") == "time (1/ω₀)"


def test_both_axes_of_a_phase_have_ticks_of_one_kind(ax):
    ax.set(xlim=(0.1, 1.0), ylim=(0, 6))
    style.dress(ax, (Angle("phi"), "k"), (Angle("phi"), "k+1"))
    ax.figure.canvas.draw()
    assert not any("pi" in text.get_text() for text in (*ax.get_xticklabels(), *ax.get_yticklabels()))


def test_a_long_title_is_broken_so_that_it_leaves_room_for_the_letter():
    long = "exact map, by fitted map R1+, update 1, not forward invariant"
    panels = [lambda ax, text=text: ax.set_title(text) and ax for text in ("short", "update 11: width 0.00582", long)]
    with rc_context(style.STYLE):
        figure = Sheet("envelopes", tuple(panels), 2, 0.76).figure()
    short, middle, broken = (ax.get_title() or ax.get_title("right") for ax in figure.axes)
    assert (short, middle) == ("short", "update 11: width 0.00582")
    assert broken.replace("\n", " ") == long
    figure.draw_without_rendering()
    for ax in figure.axes:
        for title in (ax.title, ax._right_title):
            assert not title.get_text() or not title.get_window_extent().overlaps(ax._left_title.get_window_extent())


def test_a_title_over_a_panel_that_a_scale_makes_narrow_stands_behind_the_letter():
    def panel(ax):
        ax.figure.colorbar(ScalarMappable(), ax=ax, label="largest exponent per return", pad=0.4)
        ax.set_title("period in returns")
        return ax

    with rc_context(style.STYLE):
        figure = Sheet("two", (panel, panel), 2).figure()
        lay_out(figure)
    for ax in (each for each in figure.axes if each.get_title()):
        assert ax.title.get_window_extent().x0 > ax._left_title.get_window_extent().x1


@pytest.mark.parametrize(("name", "signs"), [("B~", ["chatter"]), ("BT_B, period 2", ["rest"]), ("v_after", []), ("1:0/C", [])])
def test_signs_in_words_are_explained_by_the_legend(name, signs):
    figure = _drawn(lambda ax: ax.plot([0, 1], label=name) and ax.legend() and ax)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [name, *signs]


def test_fractions_of_pi_are_as_many_as_have_room():
    figure = Figure(figsize=(1.6, 3))
    ax = figure.add_subplot()
    ax.set(xlim=(0, 3.6), ylim=(0, 3.6))
    style.dress(ax, (Angle("phi"), "k"), (Angle("phi"), "k+1"))
    figure.draw_without_rendering()
    across, up = ({tick.get_text() for tick in ticks} for ticks in (ax.get_xticklabels(), ax.get_yticklabels()))
    assert {r"$\pi/2$", r"$\pi$"} <= across
    assert up - across >= {r"$\pi/4$", r"$3\pi/4$"}


def test_what_the_ticks_of_a_very_small_interval_share_is_in_the_label_of_its_axis(ax):
    ax.set(xlim=(5.440521, 5.440522), ylim=(0.1, 0.2))
    style.dress(ax, ("v", "k"), ("w", "k"))
    ax.figure.draw_without_rendering()
    assert float(ax.get_xlabel().rpartition("+")[2]) == pytest.approx(5.440521, abs=1e-5)
    assert not ax.xaxis.get_offset_text().get_visible()
    assert max(len(text.get_text()) for text in ax.get_xticklabels()) <= 4
    assert "ticks" not in ax.get_ylabel()


def test_panels_of_a_narrow_page_stand_one_below_the_other():
    sheet = Sheet("two", (lambda ax: ax, lambda ax: ax), 2, 0.8)
    wide, narrow = (sheet.figure(50, width=width) for width in (5.1, 3.4))
    for figure in (wide, narrow):
        lay_out(figure)
    assert wide.axes[0].get_position().y0 == pytest.approx(wide.axes[1].get_position().y0)
    assert narrow.axes[0].get_position().y0 > narrow.axes[1].get_position().y1
    assert narrow.get_size_inches().tolist() == pytest.approx([3.4, 2 * 0.75 * 0.8 * 3.4])


def _drawn(*panels):
    """A figure of one row, placed and drawn in the style of the package."""
    with rc_context(style.STYLE):
        figure = Sheet("one", panels, len(panels), legend=True).figure(100)
        lay_out(figure)
        figure.canvas.draw()
    return figure


def test_the_names_of_ticks_are_those_for_which_panels_were_placed():
    def panel(ax):
        ax.plot([0, 1], [0, 0.11])
        ax.set(ylim=(0, 0.121), ylabel="width")
        return ax

    figure = _drawn(panel, panel)
    boxes = [ax.get_tightbbox() for ax in figure.axes]
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.width for box in boxes)
    assert boxes[0].x1 <= boxes[1].x0


def test_one_legend_has_the_entries_in_the_order_of_the_panels():
    def panel(names, ax):
        for name in names:
            ax.plot([0, 1], [0, 1], label=name)
        ax.legend()
        return ax

    figure = _drawn(*(partial(panel, names) for names in ("ace", "abcd", "xy", "ay")))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list("abcdexy")
