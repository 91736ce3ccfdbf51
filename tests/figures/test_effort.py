"""What a figure takes, counted: layouts, drawings, texts set and states mapped; and that its file holds what was drawn."""

import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.layout_engine import ConstrainedLayoutEngine

from nsmaps.figures import cobweb, draw
from nsmaps.figures.png import write_png
from nsmaps.figures.sheets import SHEETS
from nsmaps.reduced.polymap import PolyMap


@pytest.fixture
def count(monkeypatch):
    """How often methods are called that were named by `of(class, name)`, and with how many rows if they have such an argument."""
    counts = Counter()

    def of(owner, name, size=lambda *_: 1):
        method = getattr(owner, name)

        def counted(self, *args, **kwargs):
            counts[name] += size(*args)
            return method(self, *args, **kwargs)

        monkeypatch.setattr(owner, name, counted)
        return counts

    return of


@pytest.mark.parametrize("formats", [("png",), ("png", "svg", "pdf")])
@pytest.mark.parametrize("name", ["words", "surfaces", "projections", "auxiliary", "envelopes", "cobweb", "basins", "transient"])
def test_a_sheet_is_laid_out_once_and_drawn_once_a_file(result, tmp_path, count, name, formats):
    count(Figure, "draw")
    counts = count(ConstrainedLayoutEngine, "execute")
    paths = draw(result, [name], tmp_path, formats, dpi=40)
    assert counts == {"execute": len(SHEETS[name](result)), "draw": len(paths)}


def test_a_mathematical_text_is_parsed_once_for_all_figures(result, tmp_path, monkeypatch):
    from matplotlib._mathtext import Parser

    parsed, parse = Counter(), Parser.parse

    def counted(self, s, font, size, dpi):
        parsed[s, size, dpi] += 1
        return parse(self, s, font, size, dpi)

    monkeypatch.setattr(Parser, "parse", counted)
    draw(result, ["domain_size", "second_iterate"], tmp_path, dpi=41)
    assert len(parsed) > 5
    assert set(parsed.values()) == {1}


def test_the_pieces_of_a_cobweb_map_each_state_once_for_all_orbits(result, tmp_path, count):
    counts = count(PolyMap, "__call__", len)
    cobweb._images.cache_clear()
    draw(result, ["cobweb"], tmp_path, dpi=40)
    shape = next(iter(result.surfaces.values())).grid.shape
    assert 0 < counts["__call__"] <= sum(points * cobweb._ACROSS for points in shape)


def test_pieces_are_drawn_without_loading_the_compiler():
    code = """
import sys
import numpy as np
from nsmaps.exact.surface import Axis, Grid
from nsmaps.figures.areas import pieces_on
from nsmaps.reduced.composite import CompositeMap, Piece
from nsmaps.reduced.polymap import PolyMap
from nsmaps.reduced.region import Where

names = ("x", "y")
piece = Piece("R1", Where(text="x > 0.5", coordinates=names), PolyMap.reset(names, {"x": 1.0}))
grid = Grid(axes={name: Axis(low=0, high=1, points=101) for name in names})
assert (pieces_on(CompositeMap(names, ("B",), (piece,)), grid) == np.where(grid.states()[:, 0] > 0.5, 0, -1)).all()
sys.exit("numba" in sys.modules)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_png_holds_the_pixels_and_the_dots_per_inch(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (7, 5, 4), np.uint8)
    write_png(tmp_path / "one.png", pixels, 200)
    assert np.array_equal(np.round(imread(tmp_path / "one.png") * 255), pixels)
    from PIL import Image

    with Image.open(tmp_path / "one.png") as image:
        image.verify()
        assert image.info["dpi"] == pytest.approx((200, 200), rel=1e-4)
