"""Colours that occur together are told apart, by normal sight and with the cones of one kind missing."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from nsmaps.figures.grey import alike_in_grey, in_grey, lightness
from nsmaps.figures.longrun.basins import COLOURS, basin_colour
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, FAMILIES, INK, INKS, LOOKS, MOTIONS, OPEN, OTHERS, PIECES, QUASI, REST, fill_of, tint

#: From linear RGB to what is seen: Machado, Oliveira and Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009), severity 1.
SIGHT = {
    "normal": np.eye(3),
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
}
XYZ = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
WHITE = [0.95047, 1.0, 1.08883]  # D65


def lab(colour, sight="normal"):
    """A colour in CIELAB, shape (3,), as it is seen."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = np.array(XYZ) @ np.clip(np.array(SIGHT[sight]) @ linear, 0, 1) / WHITE
    x, y, z = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def least(colours, sight):
    """The least distance of two of some colours."""
    seen = [lab(colour, sight) for colour in colours]
    return min(float(np.linalg.norm(a - b)) for a, b in combinations(seen, 2))


def test_the_coordinates_of_known_colours():
    assert lab("white") == pytest.approx([100, 0, 0], abs=0.02)
    assert lab("red") == pytest.approx([53.24, 80.09, 67.20], abs=0.02)


@pytest.mark.parametrize("sight", SIGHT)
def test_fills_of_pieces_are_told_apart(sight):
    assert least([fill_of(colour) for colour in PIECES], sight) >= 25
    assert least([*(fill_of(colour) for colour in PIECES), "white"], sight) >= 23
    assert least([*(fill_of(colour) for colour in PIECES), REST], sight) >= 16


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize("amount", [0.0, 0.15, 0.25, 0.4])
def test_families_are_told_apart_at_every_tint(sight, amount):
    assert least([tint(colour, amount) for colour in FAMILIES], sight) >= 26


@pytest.mark.parametrize("sight", SIGHT)
def test_lines_differ_in_colour_and_in_dashes_or_marker(sight):
    assert least([colour for colour, *_ in LOOKS], sight) >= 17
    assert len({look[1:] for look in LOOKS}) == len(LOOKS)


@pytest.mark.parametrize("sight", SIGHT)
def test_areas_of_periods_are_told_apart(sight):
    assert least([*MOTIONS, OTHERS, BLACK, "white"], sight) >= 30
    assert least([*MOTIONS, OTHERS, BLACK, "white", QUASI, OPEN], sight) >= 22


def test_areas_of_periods_differ_in_lightness():
    assert np.diff(sorted(lightness(colour) for colour in (*MOTIONS, BLACK, "white"))).min() >= 7
    assert not alike_in_grey(dict(zip("123456", MOTIONS, strict=True)), 9.5)


@pytest.mark.parametrize("sight", SIGHT)
def test_inks_are_told_apart_and_dark_on_white(sight):
    """The contrast is that of WCAG 2, from luminances as of CIELAB's lightness."""
    assert least([*INKS, INK], sight) >= 25
    assert max(float(((lab(colour)[0] + 16) / 116) ** 3) for colour in (*INKS, INK)) <= 1.05 / 4.3 - 0.05


def test_distances_without_missing_cones_are_larger_for_red_and_green():
    pair = "#D55E00", "#8A8000"
    assert least(pair, "deuteranopia") < least(pair, "normal")


def test_what_is_alike_in_grey_is_named(ax):
    """Pure red has L* 53.2 and grey of luminance 0.2126 the same (IEC 61966-2-1)."""
    grey = 1.055 * 0.2126 ** (1 / 2.4) - 0.055
    ax.fill_between([0, 1], 1, color="#ff0000", lw=0, label="red")
    ax.fill_between([0, 1], 2, color=str(grey), lw=0, label="grey")
    ax.plot([0, 1], color="#ff0000", label="red line")
    ax.plot([0, 1], color=str(grey), label="grey line")
    ax.plot([0, 1], "--", color=str(grey), label="dashed")
    ax.legend()
    pairs = alike_in_grey(ax.figure)
    assert [(pair.one, pair.other) for pair in pairs] == [("red", "grey"), ("red line", "grey line")]
    assert max(pair.difference for pair in pairs) < 1e-3
    assert lightness("#ff0000") == pytest.approx(53.24, abs=0.01)


def test_basins_differ_in_lightness():
    light = sorted(lightness(basin_colour(colour)) for colour in COLOURS)
    assert len(light) == 6
    assert np.diff(light).min() >= 10


def test_pixels_without_colour_keep_their_luminance():
    """The grey of pure red is the one above; black, white and greys stay."""
    pixels = np.array([[[255, 0, 0, 255], [0, 0, 0, 255], [255, 255, 255, 255], [90, 90, 90, 255]]], np.uint8)
    grey = round(255 * (1.055 * 0.2126 ** (1 / 2.4) - 0.055))
    assert in_grey(pixels)[0].tolist() == [[each] * 3 + [255] for each in (grey, 0, 255, 90)]


@pytest.mark.parametrize(("colour", "said"), [("#ff0000", True), ("#0000ff", False)])
def test_a_sheet_in_grey_names_what_is_alike(tmp_path, colour, said):
    """L* of pure red is 53.2, of pure green 87.7, of pure blue 32.3, of grey 0.5 53.4 (CIE 15)."""

    def panel(ax):
        for name, own in (("one", colour), ("grey", "0.5")):
            ax.fill_between([0, 1], 1, color=own, label=name)
        ax.legend()
        return ax

    paths = Sheet("areas", (panel,), 1).save(tmp_path, ("png",), 40, grey=True)
    assert [path.name for path in paths] == ["areas.png", "grey-areas.png", "grey-areas.txt"][: 2 + said]
    with Image.open(paths[1]) as picture:
        pixels = np.asarray(picture)
    assert (pixels[..., :1] == pixels[..., :3]).all()
    if said:
        assert paths[2].read_text().startswith("'one' and 'grey' differ by 0.")
