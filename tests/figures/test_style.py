"""Labels, colours and lines."""

import doctest

import numpy as np
import pytest

from nsmaps.exact.impacts import Angle
from nsmaps.figures import lines, style
from nsmaps.figures.sheet import _letter


@pytest.mark.parametrize("module", [style, lines])
def test_docstrings_are_true(module):
    assert doctest.testmod(module).failed == 0


def test_labels_carry_their_unit():
    assert style.label("v", "k") == "$v_{k}$ (dimensionless)"
    assert style.label(Angle("phi"), "k+1") == r"$\phi_{k+1}$ (rad)"


def test_colours_of_families_are_told_apart():
    assert len(set(style.family_colours(["BB", "BTB", "BBTB", "BTTB", "main"]).values())) == 5


def test_resets_are_white_and_pieces_are_told_apart():
    colours = style.piece_colours(["reset", "R1", "R1+", "R2", "mine"], [True, False, False, False, False])
    assert colours[0] == "#FFFFFF"
    assert len(set(colours)) == 5


@pytest.mark.parametrize(("value", "text"), [(0, "0"), (np.pi, r"$\pi$"), (-np.pi / 2, r"$-\pi/2$"), (0.75 * np.pi, r"$3\pi/4$")])
def test_ticks_in_pi(value, text):
    assert style._in_pi(value) == text


def test_a_line_is_cut_where_it_jumps():
    assert np.array_equal(lines.cut(np.array([1.0, 6.0, 6.1]), 3.0), [np.nan, 6.0, 6.1], equal_nan=True)


def test_panels_are_lettered_beyond_z():
    assert [_letter(k) for k in (0, 25, 26, 27)] == ["a", "z", "aa", "ab"]
