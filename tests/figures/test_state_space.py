"""The pictures of the plane of states: words, pieces, surfaces, projections and orbits."""

import re
from dataclasses import replace

import numpy as np
import pytest
from figures.conftest import GRID, panel, regions_of
from matplotlib.collections import LineCollection, PathCollection, QuadMesh, TriMesh
from matplotlib.colors import to_rgba
from matplotlib.patches import Rectangle
from messages import message
from sheets import Analytic, surface_of

from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.composite.areas import borders, pieces_on
from nsmaps.figures.composite.orbits import around, orbits
from nsmaps.figures.composite.orbits import sheets as orbit_sheets
from nsmaps.figures.composite.partition import partition
from nsmaps.figures.composite.regions import regions
from nsmaps.figures.composite.strips import strips
from nsmaps.figures.returns.projections import projections
from nsmaps.figures.returns.surfaces import surfaces
from nsmaps.figures.returns.words import words
from nsmaps.figures.style import BROWN, GREEN, ORANGE, RED
from nsmaps.reduced.adaptive.accurate import accurate
from nsmaps.reduced.adaptive.kernel import DEGREE
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.filter import NearDiagonal, diagonal_region
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.study.sections.longrun.orbits import OVER
from nsmaps.study.study import CATALOGUE


def project(result, family, ax, coordinate):
    """The projections of one surface of a result."""
    mesh = lambda surface: result.mesh(family)  # noqa: E731
    return projections(result.surfaces[family], ax, coordinate, mesh=mesh, diagonal=result.diagonal)


def drawn(result, ax, number=0):
    """The orbits of a start over the pieces of the result."""
    return orbits(result.orbits, ax, number, over=OVER.of(result, "orbits"))


def labels(ax):
    return ax.get_xlabel(), ax.get_ylabel()


def legend_texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_words_are_painted_up_to_their_borders(result, ax):
    assert panel(words, result, ax) is ax
    areas = [artist for artist in ax.collections if isinstance(artist, TriMesh)]
    assert labels(ax) == ("$v_k$".replace("_k", "_{k}"), r"$\phi_{k}$ (rad)")
    assert legend_texts(ax) == ["BB", "BTB", "near both diagonals"]
    ax.get_legend().remove()
    ax.figure.canvas.draw()
    pixels = np.asarray(ax.figure.canvas.buffer_rgba())[::-1, :, :3] / 255
    states = np.random.default_rng(3).uniform((0.1, 0), (1, np.pi), (2000, 2))
    clear = np.abs(states[:, 0] - 0.5 + 0.2 * states[:, 1]) > 0.004  # of a pixel; a cell of the grid is 0.025 wide
    assert clear.sum() > 1800
    x, y = ax.transData.transform(states[clear]).T.astype(int)
    word = result.system.first_return(states[clear]).words
    off_frame = (np.minimum(x - ax.bbox.x0, ax.bbox.x1 - x) > 4) & (np.minimum(y - ax.bbox.y0, ax.bbox.y1 - y) > 4)
    left, right, low, high = *result.diagonal.box[0], *result.diagonal.box[1]
    box = ax.transData.transform([[left, low], [right, high]])
    on_outline = np.min(np.abs(np.column_stack([x, x, y, y]) - box.T.ravel()), axis=1) < 4
    seen = off_frame & ~on_outline
    for area, own in zip(areas, ("BB", "BTB"), strict=True):
        of_own = np.abs(pixels[y, x] - area.get_facecolor()[0, :3]).max(axis=1) < 0.01
        assert np.mean(of_own[seen] != (word == own)[seen]) < 2e-3, "but where three sheets meet"


def test_words_outline_the_hull_of_the_states_near_the_diagonals(result, ax):
    panel(words, result, ax)
    (outline,) = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
    box = [[outline.get_x(), outline.get_x() + outline.get_width()], [outline.get_y(), outline.get_y() + outline.get_height()]]
    assert np.allclose(box, result.diagonal.box)


def test_pieces_are_named_where_they_are(result, ax):
    regions(result.composite, ax, GRID, result.orbits, shares=False)
    names = {text.get_text(): text.get_position() for text in ax.texts}
    assert set(names) == {r"$\mathcal{R}_{1}$", r"$\mathcal{R}_{2}$"}  # the reset holds nowhere on this grid
    assert result.composite.piece_of([names[r"$\mathcal{R}_{1}$"]]) == 1
    assert result.composite.piece_of([names[r"$\mathcal{R}_{2}$"]]) == 2
    (only,) = legend_texts(ax)
    assert only.startswith("in no piece: ")


def test_words_and_pieces_stand_side_by_side(result):
    (sheet,) = CATALOGUE["words"].sheets(result)
    assert (len(sheet.panels), sheet.columns) == (2, 2)


def test_regions_of_a_partition_have_the_names_and_colours_of_other_figures(result, ax):
    panel(partition, result, ax)
    names = {text.get_text(): text.get_position() for text in ax.texts}
    assert set(names) == {r"$\mathcal{R}_{1}$", r"$\mathcal{R}_{2}$"}
    assert result.composite.piece_of([names[r"$\mathcal{R}_{1}$"]]) == 1
    assert legend_texts(ax) == ["attracting", "every word is BTB"]
    meshes = [ax, regions_of(result, ax.figure.add_subplot())]
    first, second = (next(each for each in drawn.collections if isinstance(each, QuadMesh)) for drawn in meshes)
    assert np.array_equal(first.get_array().filled(-1), second.get_array().filled(-1))
    assert first.get_cmap().colors == second.get_cmap().colors


def test_the_frame_of_an_attracting_region_is_that_of_its_box(result, ax):
    panel(partition, result, ax)
    every, frame = (np.concatenate(each.get_segments()) for each in ax.collections if isinstance(each, LineCollection))
    sides = np.abs(frame[:, :1] - [0.6, 0.95]).min(axis=1), np.abs(frame[:, 1:] - [0.1, 0.8]).min(axis=1)
    assert np.minimum(*sides) == pytest.approx(0, abs=1e-5)
    assert (frame.min(axis=0), frame.max(axis=0)) == (pytest.approx([0.6, 0.1], abs=1e-5), pytest.approx([0.95, 0.8], abs=1e-5))
    assert len(every) > len(frame)


def test_borders_are_bisected_to_a_slanted_line_and_meet_in_a_corner():
    grid = Grid(axes={"v": Axis(low=0.0, high=1.0, points=12), "w": Axis(low=0.0, high=1.0, points=9)})
    number_of = lambda states: np.where(states[:, 0] > 0.52, 2, states[:, 1] > 0.3 + 0.37 * states[:, 0]).astype(int)  # noqa: E731
    segments = borders(grid, number_of(grid.states()), number_of)
    ends = segments.reshape(-1, 2)
    off = np.minimum(np.abs(ends[:, 0] - 0.52), np.abs(ends[:, 1] - 0.3 - 0.37 * ends[:, 0]))
    assert np.sort(off)[-3:] == pytest.approx(0, abs=0.03), "three lines meet within a cell"
    assert np.sort(off)[:-3] == pytest.approx(0, abs=1e-4)
    assert np.linalg.norm(np.diff(segments, axis=1), axis=2).max() < 0.17
    assert (ends.min(axis=0), ends.max(axis=0)) == (pytest.approx([0, 0], abs=1e-9), pytest.approx([0.52, 1], abs=1e-4))


@pytest.fixture(scope="module")
def edged(result):
    """The result with an accurate map of a box through which one grazing curve runs."""
    box = Grid(axes={"v": Axis(low=0.45, high=0.5, points=5), "phi": Axis(low=0.1, high=0.4, points=5)})
    return result.with_parts({"accurate": accurate(result.study.system_object(), box, 1e-2)})


def test_strips_have_a_shade_a_degree_and_their_edges(edged, ax):
    panel(strips, edged, ax)
    made = edged.accurate.strips
    (image,) = ax.images
    degrees = np.array([*made.tables.leaf[:, DEGREE], np.nan])[made.tables.raster]
    assert np.array_equal(np.ma.filled(image.get_array(), np.nan), degrees.T, equal_nan=True)
    assert len(set(made.report.degrees)) > 1
    s = np.linspace(-1, 1, 200)
    expected = [np.column_stack([slab.speeds(s), phase]) for slab in made.slabs for phase in slab.phases(s)[1:-1]]
    assert len(expected) > 0
    assert all(np.array_equal(line.get_xydata(), way) for line, way in zip(ax.lines, expected, strict=True))
    assert (ax.get_xlim(), ax.get_ylim()) == ((0.45, 0.5), (0.1, 0.4))


def test_angles_have_ticks_in_pi(result, ax):
    panel(words, result, ax)
    ax.figure.canvas.draw()
    shown = [text.get_text() for text in ax.get_yticklabels()]
    assert r"$\pi/2$" in shown
    assert all(re.fullmatch(r"0|\$-?\d*\\pi(/\d+)?\$", text) for text in shown)


@pytest.mark.parametrize(("coordinate", "index"), [("v", 0), ("phi", 1), ("", 0)])
def test_surfaces_have_every_member_at_its_image_and_end_at_the_edge(result, ax3d, coordinate, index):
    panel(surfaces, result, ax3d, coordinate=coordinate)
    (facets,) = ax3d.collections
    drawn = facets.points
    assert np.allclose(drawn[:, 2], result.system.first_return(drawn[:, :2]).image[:, index])
    known = {tuple(row) for row in drawn[np.unique(facets.triangles)].round(9)}
    assert {
        tuple(row) for s in result.surfaces.values() for row in np.column_stack([s.start, s.image[:, index]]).round(9)
    } <= known
    (x, y), (u, v) = (np.moveaxis(drawn[facets.triangles][:, k, :2] - drawn[facets.triangles][:, 0, :2], 1, 0) for k in (1, 2))
    assert np.sum(x * v - y * u) / 2 == pytest.approx(0.9 * np.pi, rel=2e-4), "no hole but where three sheets meet"
    assert ax3d.get_title().startswith(("$v_{k+1}$", r"$\phi_{k+1}$")[index])
    assert legend_texts(ax3d) == ["BB", "BTB"]


def test_surfaces_say_that_they_need_three_dimensions(result, ax):
    with pytest.raises(NsmapsError, match=message("figures.flat-axes")):
        panel(surfaces, result, ax)


@pytest.mark.parametrize(("coordinate", "index"), [("v", 0), ("phi", 1)])
def test_projections_draw_strands_of_the_surface(result, ax, coordinate, index):
    project(result, "BTB", ax, coordinate)
    segments, shade = strands(ax)
    surface = result.surfaces["BTB"]
    x, y = segments[..., 0], segments[..., 1]
    other = (
        (0.95 - 0.2 * x - y) / 0.15 if index == 0 else (np.where(y > 4, y - 2 * np.pi, y) - 0.5 + 0.3 * x) / 0.05
    )  # by the toy's formula
    held = np.unique(other.round(6))
    assert 10 <= len(held) <= 24
    assert np.isin(held, np.unique(surface.start[:, 1 - index]).round(6)).all()
    phase = other if index == 0 else x
    assert np.abs(phase.mean(axis=1) - shade).max() < np.pi / 100
    edge = (0.5 - 0.2 * other if index == 0 else (0.5 - other) / 0.2)[x == x.min()]
    assert x.min() == pytest.approx(max(edge.min(), (0.1, 0)[index]), abs=1e-6), "to the edge of the word"
    name = surface.coordinates[index]
    assert labels(ax) == tuple(
        text.format(r"\phi" if name == "phi" else "v") + unit
        for text, unit in (("${}_{{k}}$", _unit(name)), ("${}_{{k+1}}$", _unit(name)))
    )


def strands(ax):
    """The segments drawn, shape (S, 2, 2), and the number of which each has the colour."""
    (lines,) = [artist for artist in ax.collections if isinstance(artist, PathCollection)]
    parts = [path.vertices.reshape(-1, 2, 2) for path in lines.get_paths()]
    return np.concatenate(parts), np.repeat(lines.get_array(), [len(part) for part in parts])


def _unit(name):
    return " (rad)" if name == "phi" else ""


def test_projections_star_what_is_near_all_diagonals(result, ax):
    project(result, "BTB", ax, "v")
    stars = [line for line in ax.lines if line.get_marker() == "*"]
    assert stars
    for line in stars:
        ratio = line.get_ydata() / line.get_xdata()
        assert ((ratio < 1.2) & (ratio > 1 / 1.2)).all()


def test_projections_show_every_family_in_every_coordinate(result):
    (sheet,) = CATALOGUE["projections"].sheets(result)
    assert (len(sheet.panels), sheet.columns) == (4, 2)


def test_orbits_lie_over_each_other(result, ax):
    drawn(result, ax, 1)
    lines = {line.get_label(): line for line in ax.lines}
    thin = [line.get_xydata() for line in ax.lines if line.get_linewidth() == 0.4]
    for whole, (name, colour, dashes) in zip(thin, (("exact map", ORANGE, "-"), ("composite map", GREEN, "--")), strict=True):
        states = getattr(result.orbits[1], name.split()[0]).states
        kept = [corner for corner in whole if (corner == states).all(axis=1).any()]
        assert np.array_equal(kept, states)
        first = lines[name].get_xydata()
        assert np.array_equal(first, whole[: len(first)], equal_nan=True)
        assert (to_rgba(lines[name].get_color()), lines[name].get_linestyle()) == (to_rgba(colour), dashes)
    assert np.array_equal(lines["start"].get_xydata(), [[0.9, 2.5]])


def test_the_line_of_an_orbit_crosses_the_seam_of_a_phase_at_the_edges(result):
    states = np.array([[0.1, 0.3], [0.2, 6.0], [0.3, 5.0], [0.4, 1.0], [0.5, 4.0]])
    line = around(states, result.composite.coordinates)
    steps = np.diff(line, axis=0)
    drawn = np.isfinite(steps).all(axis=1)
    assert abs(steps[drawn, 1]).max() <= np.pi
    assert drawn.sum() == 6  # four steps, of which two cross the seam in two parts each
    for corner in line[np.isfinite(line).all(axis=1)]:
        turned = (corner - states) / [1, 2 * np.pi]
        assert np.isclose(turned, turned.round() * [0, 1]).all(axis=1).any()


def test_an_orbit_is_drawn_thick_until_it_is_near_its_last_tenth(result, ax):
    states = np.column_stack([np.concatenate([np.linspace(0.2, 0.8, 7), np.full(93, 0.8)]), np.full(100, 1.0)])
    pair = replace(result.orbits[0], exact=replace(result.orbits[0].exact, states=states), composite=None)
    drawn(result.with_parts({"orbits": (pair,)}), ax)
    (first,) = (line for line in ax.lines if line.get_label() == "exact map")
    assert np.array_equal(first.get_xydata(), states[:7])


def test_orbits_have_a_panel_a_start(result):
    assert len(orbit_sheets(result.orbits)[0].panels) == 2


def test_an_orbit_that_runs_away_spoils_no_picture(result, ax):
    wild = np.array([[0.2, 1.0], [1e69, 1.0]])
    pair = replace(result.orbits[0], exact=replace(result.orbits[0].exact, states=wild), composite=None)
    drawn(result.with_parts({"orbits": (pair,)}), ax)
    assert ax.get_xlim() == (0.1, 1.0)


def test_stars_are_filled_on_gentle_slopes_and_hollow_on_steep_ones(result, ax):
    """phi -> 0.2 + 0.8 phi up to 1, three times as steep beyond it; v -> 0.1 + 0.8 v is gentle everywhere."""
    bent = lambda v, phi: (0.1 + 0.8 * v, np.where(phi < 1, 0.2 + 0.8 * phi, 3 * phi - 2))  # noqa: E731
    made = surface_of(bent, (0.3, 0.7, 21), (0.6, 1.4, 41))
    region = diagonal_region(NearDiagonal(delta=1.3, slope=1), [(0.0, made)])
    project(replace(result.with_parts({"surfaces": {"BB": made}, "diagonal": region}), system=Analytic(bent)), "BB", ax, "phi")
    stars = {line.get_label(): line for line in ax.lines if line.get_marker() == "*"}
    gentle, steep = stars["near both diagonals, gentle"], stars["near both diagonals, steep"]
    assert gentle.get_xdata().max() < 1 < steep.get_xdata().max()
    assert to_rgba(gentle.get_markerfacecolor()) == to_rgba(RED)
    assert (to_rgba(steep.get_markerfacecolor()), to_rgba(steep.get_markeredgecolor())) == (to_rgba("white"), to_rgba(BROWN))


def test_a_whole_circle_of_phases_is_drawn_in_halves(result, ax):
    half = lambda v, phi: (0.5 * v, 0.5 * phi)  # noqa: E731
    made = surface_of(half, (0.1, 1.0, 11), (0.0, 2 * np.pi, 41))
    result = replace(
        result.with_parts({"surfaces": {name: replace(made, name=name) for name in ("BB", "B+")}, "diagonal": None}),
        system=Analytic(half),
    )
    first, second = CATALOGUE["projections"].sheets(result)
    assert (first.name, second.name, len(first.panels)) == ("projections-BB", "projections-B+", 4)
    drawn = first.panels[3](ax)
    x = strands(drawn)[0][..., 0]
    assert (x.min(), x.max()) == pytest.approx((np.pi, 2 * np.pi))
    assert drawn.get_xlim() == pytest.approx((np.pi, 2 * np.pi))


def test_no_strand_is_drawn_through_a_jump_and_each_ends_there(result, ax):
    high = lambda v, phi: v >= 0.503  # noqa: E731
    torn = lambda v, phi: (np.where(high(v, phi), 0.6 + 0.2 * v, 0.2 * v), phi)  # noqa: E731
    made = surface_of(torn, (0.0, 1.0, 100), (0.1, 1.0, 5))
    project(replace(result.with_parts({"surfaces": {"BB": made}, "diagonal": None}), system=Analytic(torn, high)), "BB", ax, "v")
    x, y = np.moveaxis(strands(ax)[0], -1, 0)
    below = y < 0.4
    assert np.array_equal(below[:, 0], below[:, 1])
    assert x[below].max() == pytest.approx(0.503, abs=1e-6)
    assert x[~below].min() == pytest.approx(0.503, abs=1e-6)


def test_a_square_root_is_drawn_to_its_end(result, ax):
    missed = lambda v, phi: v > 0.9  # noqa: E731
    root = lambda v, phi: (np.sqrt(np.maximum(0.9 - v, 0)), phi)  # noqa: E731
    made = surface_of(root, (0.0, 1.0, 100), (0.1, 1.0, 5))
    project(
        replace(result.with_parts({"surfaces": {"BB": made}, "diagonal": None}), system=Analytic(root, missed)), "BB", ax, "v"
    )
    x, y = np.moveaxis(strands(ax)[0], -1, 0)
    assert np.abs(y - root(x, 0)[0])[(y > 1e-9).all(axis=1)].max() < 0.03
    on_axis = sorted(set(x[y < 1e-4].round(4)))
    assert on_axis[0] == pytest.approx(0.9, abs=1e-4), "no step before the end"


def test_regions_are_named_with_their_words_and_shares(result, ax):
    regions_of(result, ax)
    names = {text.get_text(): text.get_position() for text in ax.texts}
    assert result.composite.piece_of([names[r"$\mathcal{R}_{1}$"]]) == 1
    assert result.composite.piece_of([names[r"$\mathcal{R}_{2}$"]]) == 2
    box = (0.95 - 0.6) / 0.9 * 0.7 / np.pi  # of R1 in the window; R2 has the rest beyond v = 0.3
    shares = box, 0.7 / 0.9 - box, 0.2 / 0.9
    texts = legend_texts(ax)
    assert [text.rpartition(":")[0] for text in texts] == [r"$\mathcal{R}_{1}$, BTB", r"$\mathcal{R}_{2}$, BTB", "in no piece"]
    assert [float(text.rpartition(":")[2].split()[0]) for text in texts] == pytest.approx([100 * s for s in shares], abs=0.2)


def test_states_of_other_words_are_told(result, ax):
    panel(words, result.with_parts({"surfaces": {"BB": result.surfaces["BB"]}}), ax)
    assert legend_texts(ax) == ["BB", "near both diagonals", "other"]


def test_the_last_tenths_are_in_the_legend_of_the_orbits(result, ax):
    drawn(result, ax)
    assert legend_texts(ax) == ["exact map", "composite map", "exact, last tenth", "composite, last tenth", "start"]
    (line,) = [line for line in ax.lines if line.get_label() == "composite, last tenth"]
    assert np.array_equal(line.get_xydata(), result.orbits[0].composite.states[-5:])


def test_the_last_row_of_a_whole_circle_is_not_phase_zero():
    grid = Grid(axes={"v": Axis(low=0.1, high=1.0, points=3), "phi": Axis(low=0.0, high=2 * np.pi, points=5)})
    names, return_map = ("v", Angle("phi")), PolyMap.reset(("v", Angle("phi")), {"phi": 1.2})
    regions = [ConditionRegion(text=text, coordinates=names) for text in ("phi < 1", "phi >= 1")]
    made = CompositeMap(names, ("B", "T"), tuple(Piece(region.text, region, return_map) for region in regions))
    assert pieces_on(made, grid).reshape(3, 5).tolist() == [[0, 1, 1, 1, 1]] * 3
    assert made.piece_of([[0.5, 2 * np.pi]]).tolist() == [0], "where a state at 2 pi is one at zero"


def test_an_orbit_that_ends_has_a_cross_and_no_last_tenth(result, ax):
    pair = result.orbits[0]
    whole = np.array(pair.composite.states)
    for last, beyond, text in ((7, False, "composite map ends"), (7, True, "composite map, last inside")):
        states = whole.copy()
        states[last + 1 :] = np.nan
        if beyond:
            states[last] = 1e90
        stopped = replace(pair, composite=replace(pair.composite, states=states))
        other = ax.figure.add_subplot()
        drawn(result.with_parts({"orbits": (stopped,)}), other)
        assert legend_texts(other) == ["exact map", "composite map", "exact, last tenth", text, "start"]
        (cross,) = [line for line in other.lines if line.get_label() == text]
        assert cross.get_xydata().tolist() == [whole[last - beyond].tolist()]


def test_a_picture_of_orbits_ends_where_a_circle_of_phases_does(result, ax):
    pair = result.orbits[0]
    states = np.array(pair.exact.states)
    states[3, 1] = 6.28
    far = replace(pair, exact=replace(pair.exact, states=states))
    drawn(result.with_parts({"orbits": (far,)}), ax)
    assert ax.get_ylim() == pytest.approx((0.0, 2 * np.pi))
