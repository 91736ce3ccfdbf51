"""What a figure takes, counted: layouts, drawings, texts set and states mapped; and that its file holds what was drawn."""

import doctest
import gc
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.layout_engine import ConstrainedLayoutEngine

from nsmaps.cli.commands import _settled
from nsmaps.figures import draw
from nsmaps.figures.catalogue import CATALOGUE
from nsmaps.figures.composite import cobweb
from nsmaps.figures.png import write_png
from nsmaps.figures.returns import dots
from nsmaps.figures.returns.dots import Dots, nearest
from nsmaps.reduced.fit.polymap import PolyMap


def test_docstrings_are_true():
    assert doctest.testmod(dots).failed == 0


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
@pytest.mark.parametrize("name", ["words", "surfaces", "projections", "auxiliary", "envelopes", "cobweb", "basins", "exit_times"])
def test_a_sheet_is_laid_out_once_and_drawn_once_a_file(result, tmp_path, count, name, formats):
    count(Figure, "draw")
    counts = count(ConstrainedLayoutEngine, "execute")
    paths = draw(result, [name], tmp_path, formats, dpi=40)
    assert counts == {"execute": len(CATALOGUE[name].sheets(result)), "draw": len(paths)}


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


def test_what_is_there_before_figures_are_drawn_is_not_searched_meanwhile():
    with _settled():
        assert gc.get_freeze_count() > 1000
    assert gc.get_freeze_count() == 0


def test_the_pieces_of_a_cobweb_map_each_state_once_for_all_orbits(result, tmp_path, count):
    counts = count(PolyMap, "__call__", len)
    cobweb._images.cache_clear()
    draw(result, ["cobweb"], tmp_path, dpi=40)
    grid = next(iter(result.surfaces.values())).grid
    number = result.composite.piece_of(grid.states()).reshape(grid.shape)
    edges = sum((np.diff(number, axis=axis) != 0).sum() for axis in (0, 1))
    extremes = 2 * len(result.composite.pieces) * sum(grid.shape)
    assert 2 * grid.size < counts["__call__"] < 2 * grid.size + cobweb._FINER * (edges + 2 * extremes) < 20 * grid.size


@pytest.mark.parametrize("format", ["png", "svg"])
def test_the_dots_of_a_surface_are_no_paths(result, tmp_path, monkeypatch, format):
    paths, once = [], Collection.draw

    def drawn(self, renderer):
        paths.append(max(len(self.get_offsets()), len(self.get_paths())))
        return once(self, renderer)

    monkeypatch.setattr(Collection, "draw", drawn)
    draw(result, ["surfaces"], tmp_path, [format], dpi=40)
    assert sum(len(surface.start) for surface in result.surfaces.values()) > 1000 > 10 * max(paths)


def test_the_dots_that_are_seen_are_the_nearest():
    generator = np.random.default_rng(5)
    place, depth, radius = generator.uniform(6, 30, (60, 2)), generator.uniform(0, 1, 60), 4.3
    seen = nearest(place, depth, radius)
    for y, x in np.ndindex(seen.shape):
        over = np.flatnonzero(np.hypot(*(np.floor(place) - [x, y]).T) <= radius)
        assert seen[y, x] == (over[np.argmin(depth[over])] if len(over) else -1)


@pytest.mark.parametrize(("elevation", "on_top"), [(90, (1, 0, 0)), (-90, (0, 0, 1))])
def test_dots_look_as_matplotlib_draws_them_one_by_one(elevation, on_top):
    points = np.array([[0.3, 0.5, 0.0], [0.32, 0.5, 1.0], [0.7, 0.6, 0.5]])
    colours = np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 0.5, 0]])
    pictures = []
    for made in (
        lambda ax: Dots(ax, points, colours, 20),
        lambda ax: ax.scatter(*points.T, c=colours, s=400, lw=0, depthshade=False),
    ):
        figure = Figure(figsize=(3, 3), dpi=100)
        canvas = FigureCanvasAgg(figure)
        ax = figure.add_subplot(projection="3d")
        ax.set_axis_off()
        made(ax)
        ax.set(xlim=(0, 1), ylim=(0, 1), zlim=(0, 1))
        ax.view_init(elev=elevation, azim=0)
        canvas.draw()
        pictures.append(np.asarray(canvas.buffer_rgba())[..., :3] / 255)
    ours, theirs = pictures
    assert np.abs(ours - theirs).mean() < 0.01 < np.abs(1 - theirs).mean()
    assert (np.abs(ours - theirs).max(axis=-1) > 0.5).mean() < 0.002, "rims alone"
    shown = [(np.abs(ours - colour).max(axis=-1) < 0.02).sum() for colour in colours]
    assert shown[0 if on_top == (0, 0, 1) else 1] > 1.05 * shown[1 if on_top == (0, 0, 1) else 0]


def test_pieces_are_drawn_without_loading_the_compiler():
    code = """
import sys
import numpy as np
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.composite.areas import pieces_on
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.reduced.conditions.region import Where

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
