"""What a figure takes, counted: layouts, drawings, texts set and states mapped; and that its file holds what was drawn."""

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

from nsmaps.cli.drawing import _settled
from nsmaps.figures.composite import cobweb
from nsmaps.figures.png import write_png
from nsmaps.figures.returns.facets import Facets
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.study import result as results
from nsmaps.study.pictures.draw import draw
from nsmaps.study.study import CATALOGUE


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


EVERY = ("png", "svg", "pdf")
SHEETS = ["words", "surfaces", "projections", "auxiliary", "envelopes", "cobweb", "basins", "exit_times"]


@pytest.mark.parametrize(("name", "formats"), [*((name, ("png",)) for name in SHEETS), ("surfaces", EVERY), ("envelopes", EVERY)])
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


@pytest.mark.parametrize("file_format", ["png", "svg"])
def test_the_triangles_of_a_surface_are_no_paths(result, tmp_path, monkeypatch, file_format):
    paths, once = [], Collection.draw

    def drawn(self, renderer):
        paths.append(max(len(self.get_offsets()), len(self.get_paths())))
        return once(self, renderer)

    monkeypatch.setattr(Collection, "draw", drawn)
    (path,) = draw(result, ["surfaces"], tmp_path, [file_format], dpi=40)
    assert len(result.mesh("BTB").triangles) > 1000 > 10 * max(paths, default=0)
    assert path.stat().st_size < 400_000


def test_triangles_are_computed_once_for_all_panels_and_figures(result, tmp_path, count):
    counts = count(type(result.system), "first_return", lambda states, *_: len(states))
    results._mesh.cache_clear()
    draw(result, ["surfaces"], tmp_path, dpi=40)
    vertices = sum(len(result.mesh(family).returns) for family in result.surfaces)
    assert vertices < counts["first_return"] < 60 * vertices
    before = counts["first_return"]
    draw(result, ["surfaces"], tmp_path, dpi=40)
    assert counts["first_return"] == before


def seen_from(elevation, azimuth, points, triangles, colours):
    """The pixels of facets in a cube of side 1."""
    figure = Figure(figsize=(3, 3), dpi=100)
    canvas = FigureCanvasAgg(figure)
    ax = figure.add_axes((0, 0, 1, 1), projection="3d")
    ax.set_axis_off()
    Facets(ax, points, triangles, colours)
    ax.set(xlim=(0, 1), ylim=(0, 1), zlim=(0, 1))
    ax.view_init(elev=elevation, azim=azimuth)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3] / 255


@pytest.mark.parametrize("azimuth", [-128, -60, 52, 140])
def test_a_high_wall_and_a_low_floor_hide_each_other_as_they_stand(azimuth):
    sides = np.linspace(0, 1, 40)
    wall = np.array([[0.5, y, z] for z in (0, 1) for y in sides])
    floor = np.array([[x, y, 0.2] for x in (0.02, 0.48) for y in sides])
    strips = np.array([[k, k + 1, k + 40] for k in range(39)] + [[k + 1, k + 41, k + 40] for k in range(39)])
    red, blue = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
    both = np.concatenate([wall, floor]), np.concatenate([strips, strips + 80]), np.array([red] * 80 + [blue] * 80)
    pixels = seen_from(20, azimuth, *both)
    alone = seen_from(20, azimuth, floor, strips, both[2][80:])
    floor_seen, whole = ((np.abs(each - blue).max(axis=-1) < 0.02).sum() for each in (pixels, alone))
    in_front = np.cos(np.radians(azimuth)) < 0  # the floor lies at smaller x, the eye there too
    assert floor_seen > 0.97 * whole if in_front else floor_seen < 0.9 * whole


def test_pieces_are_drawn_without_loading_the_compiler():
    code = """
import sys
import numpy as np
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.composite.areas import pieces_on
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.reduced.conditions.region import ConditionRegion

names = ("x", "y")
piece = Piece("R1", ConditionRegion(text="x > 0.5", coordinates=names), PolyMap.reset(names, {"x": 1.0}))
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
