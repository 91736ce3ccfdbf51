"""Figures of attracting domains: which are drawn, their looks, their legends."""

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib import rc_context

from nsmaps.figures.domains.domain_size import domain_size
from nsmaps.figures.domains.domain_size import sheets as size_sheets
from nsmaps.figures.domains.envelopes import envelopes, shown
from nsmaps.figures.domains.envelopes import sheets as envelope_sheets
from nsmaps.figures.domains.second_iterate import second_iterate
from nsmaps.figures.parts import Bounded
from nsmaps.figures.style import STYLE
from nsmaps.study.study import CATALOGUE


def by_label(ax):
    return {line.get_label(): line for line in ax.lines}


def test_envelopes_show_the_first_second_and_last_update_of_domains_that_hold(result):
    fitted = result.domains["fitted"]
    assert shown(fitted) == [0, 1, 4]
    assert shown(replace(fitted, updates=fitted.updates[:1] + 2 * fitted.updates[-1:])) == [0, 2], "of two alike the last"
    assert shown(replace(fitted, updates=3 * fitted.updates[:1])) == [0]
    assert shown(result.domains["loose"]) == [0]
    assert [(sheet.name, len(sheet.panels)) for sheet in envelope_sheets(result.domains)] == [("envelopes", 6)]
    (alone,) = envelope_sheets({"loose": result.domains["loose"]})
    assert (alone.name, len(alone.panels), alone.title) == ("envelopes", 2, "loose: exact map, sampled, no bound")


def test_domain_size_has_a_line_a_domain_that_holds(result, ax):
    domain_size(result.domains, ax, "phi")
    lines = by_label(ax)
    assert list(lines) == ["fitted map R1: bounded"]
    (line,) = lines.values()
    assert np.array_equal(line.get_ydata(), result.domains["fitted"].sizes[:, 1])
    assert np.array_equal(line.get_xdata(), np.arange(6))
    assert ax.get_ylabel() == r"width in $\phi$ (rad)"


def test_domains_of_one_kind_have_one_colour_and_differ_in_dashes_and_marks(result, ax):
    fitted = result.domains["fitted"]
    exact = replace(fitted, status="enclosed", of="exact map")
    domain_size({"fitted": fitted, "one": exact, "two": exact}, ax, "v")
    looks = {name: (line.get_color(), line.get_linestyle(), line.get_marker()) for name, line in by_label(ax).items()}
    first, one, two = looks.values()
    assert list(looks) == ["fitted map R1: bounded", "one: exact map, enclosed", "two: exact map, enclosed"]
    assert first[0] != one[0] == two[0]
    assert one[1] != two[1]
    assert len({look[2] for look in looks.values()}) == 3


def test_sizes_have_one_legend_and_a_box_that_leads_out_at_once_is_hollow(result, ax):
    (sheet,) = size_sheets(result.domains)
    with rc_context(STYLE):
        figure = sheet.figure()
    assert [panel.get_legend() for panel in figure.axes] == [None, None]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["fitted map R1: bounded"]
    domain_size({"loose": result.domains["loose"]}, ax, "v")
    line = by_label(ax)["loose: exact map, sampled, no bound, not forward invariant"]
    assert len(line.get_xdata()) == len(result.domains["loose"].sizes) == 1
    assert (line.get_markerfacecolor(), line.get_linestyle()) == ("white", "None")


@pytest.mark.parametrize("name", ["auxiliary", "envelopes", "domain_size", "second_iterate"])
def test_a_legend_has_what_is_drawn_and_nothing_else(result, name):
    for sheet in CATALOGUE[name].sheets(result):
        with rc_context(STYLE):
            figure = sheet.figure()
        told = {text.get_text() for text in figure.legends[0].get_texts()}
        drawn = {each.get_label() for ax in figure.axes for each in (*ax.lines, *ax.patches)}
        assert told == {name for name in drawn if not name.startswith("_")}


def test_the_cycle_lies_on_top_of_everything(result, ax):
    fitted = result.domains["fitted"]
    for draw in (
        lambda: envelopes(fitted, ax, "v"),
        lambda: second_iterate(result.second_iterate, ax, Bounded("fitted", fitted), "v"),
    ):
        draw()
        others = [each.get_zorder() for each in (*ax.lines, *ax.collections) if each.get_label() != "$p$, $q$"]
        assert by_label(ax)["$p$, $q$"].get_zorder() > max(others)
        ax.clear()


def test_a_polynomial_that_departs_from_the_box_is_told(result, ax):
    steep = replace(result.second_iterate, alpha=(-5.0, 7.0))
    second_iterate(steep, ax, Bounded("fitted", result.domains["fitted"]), "v")
    (name,) = [name for name in by_label(ax) if name.startswith("polynomial")]
    assert re.fullmatch(r"polynomial, degree 1, \d+ % of it beyond the box", name)
