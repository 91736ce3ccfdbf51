"""Return surfaces as triangles: the exact map is the judge of where they end."""

from functools import cache

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.exact.surfaces.mesh import grid_mesh, mesh
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface

PAIR = nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113)
OSCILLATOR = nsmaps.load_system("impact_oscillator", zeta=0.05, w=2, A=2, wall=0.3, r=0.7)
BALL = nsmaps.load_system("bouncing_ball", Gamma=1.4, r=0.5)


@cache
def made(system, word, low=(0.0033, 0.0), high=(1.0, 2 * np.pi), points=60, part=None, flat=False):
    """The surface of one word over a plane, and its triangles."""
    axes = {name: Axis(low=a, high=b, points=points) for name, a, b in zip(system.coordinates, low, high, strict=True)}
    family = WordFamily(name=word, words=(word,))
    surface = family.surface(system, Grid(axes=axes))
    return surface, mesh(system, surface, family, part, flat)


def jumps(system, start, end):
    """Whether the map jumps on each segment: what bisection towards the half with the larger difference of images leaves."""
    first, last = system.first_return(start).lifted, system.first_return(end).lifted
    for _ in range(30):
        middle = (start + end) / 2
        image = np.nan_to_num(system.first_return(middle).lifted, nan=1e3)
        left = (np.abs(image - first).max(axis=1) > np.abs(last - image).max(axis=1))[:, None]
        start, end = np.where(left, start, middle), np.where(left, middle, end)
        first, last = np.where(left, first, image), np.where(left, image, last)
    return np.abs(last - first).max(axis=1) > 1e-2


def areas(corners):
    """Of triangles (T, 3, 2), positive if their corners turn left."""
    (x, y), (u, v) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    return (x * v - y * u) / 2


@pytest.mark.parametrize(
    ("system", "word", "low", "high", "share"),
    [
        (PAIR, "BB", (0.0033, 0.0), (1.0, 2 * np.pi), 1e-4),
        (PAIR, "BTB", (0.0033, 0.0), (1.0, 2 * np.pi), 1e-4),
        (OSCILLATOR, "BB", (0.01, 0.0), (8.0, 2 * np.pi), 1e-4),
        (BALL, "BB", (0.01, 0.0), (8.0, 2 * np.pi), 4e-3),  # where bounces accumulate, sheets are narrower than any cell
    ],
)
def test_no_triangle_joins_two_sheets(system, word, low, high, share):
    _, found = made(system, word, low, high)
    assert (found.returns.words == word).all()
    assert (np.ptp(found.returns.turns[found.triangles], axis=1) == 0).all()
    corners = found.returns.start[found.triangles]
    middle = corners.mean(axis=1)
    joins = np.any([jumps(system, corners[:, k] + 1e-6 * (middle - corners[:, k]), middle) for k in range(3)], axis=0)
    size = areas(corners)
    assert (size >= 0).all()
    assert size[joins].sum() < share * size.sum()


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("word", ["BB", "BTB"])
def test_triangles_cover_the_states_of_their_word(word, flat):
    surface, found = made(PAIR, word, flat=flat)
    random = np.random.default_rng(1).uniform((0.0033, 0.0), (1.0, 2 * np.pi), (200_000, 2))
    size = areas(found.returns.start[found.triangles]).sum() / (0.9967 * 2 * np.pi)
    assert size == pytest.approx(np.mean(PAIR.first_return(random).has_word(word)), abs=3e-3)  # that has an error of 1e-3
    assert np.ptp(surface.start, axis=0) == pytest.approx(np.ptp(found.returns.start, axis=0), abs=0.05)


def test_a_surface_ends_at_its_edge_not_at_the_last_state_of_the_grid():
    surface, found = made(PAIR, "BB", high=(0.6, np.pi))
    sides, count = np.unique(np.sort(found.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True)
    rim = found.returns.select(np.unique(sides[count == 1]))
    inside = ((rim.start > (0.0034, 1e-6)) & (rim.start < (0.5999, np.pi - 1e-6))).all(axis=1)
    margin = PAIR.itineraries(rim.start[inside]).margin
    wrapped = np.minimum(rim.image[inside, 1], 2 * np.pi - rim.image[inside, 1])
    assert inside.sum() > 100
    assert np.max(np.minimum(np.minimum(margin.clearance, margin.slowest), wrapped)) < 1e-4
    on_grid = PAIR.itineraries(surface.start).margin
    assert np.median(np.minimum(on_grid.clearance, on_grid.slowest)) > 1e-2


def test_parts_are_parted_and_left_out():
    def part(returns):
        return np.where(returns.start[:, 1] > 3, -1, returns.start[:, 0] > 0.5)

    _, found = made(PAIR, "BTB", part=part)
    ends = [found.returns.start[np.unique(found.triangles[found.part[found.triangles[:, 0]] == k])] for k in (0, 1)]
    assert ends[0][:, 0].max() == pytest.approx(0.5, abs=1e-6)
    assert ends[1][:, 0].min() == pytest.approx(0.5, abs=1e-6)
    assert np.concatenate(ends)[:, 1].max() == pytest.approx(3, abs=1e-6)
    assert (np.ptp(found.part[found.triangles], axis=1) == 0).all()


def test_two_consecutive_returns_are_one_surface():
    surface, found = made(PAIR, "BBTB")
    assert set(found.returns.words.tolist()) == {"BBTB"}
    first = PAIR.first_return(found.returns.start)
    assert np.abs(PAIR.first_return(first.image).image - found.returns.image).max() < 1e-9
    assert len(found.triangles) > len(surface.start)


def test_a_plane_through_four_coordinates():
    system = nsmaps.load_system("two_masses", m1=1, m2=1, k1=1, k2=1, b=0.1, f=1, w=1.8, r=0.8, d=0)
    axes = {
        "v": Axis(low=0.2, high=2, points=25),
        "x2": Axis.at(-0.8),
        "v2": Axis.at(0.04),
        "phi": Axis(low=0, high=6, points=25),
    }
    family = WordFamily(name="II", words=("II",))
    surface = family.surface(system, Grid(axes=axes))
    found = mesh(system, surface, family)
    assert set(found.returns.start[:, 1]) == {-0.8}
    assert len(found.triangles) > len(surface.start)
    corners = found.returns.start[found.triangles][:, :, [0, 3]]
    assert areas(corners).sum() == pytest.approx(np.mean(surface.member) * 1.8 * 6, rel=0.05)


def test_triangles_follow_the_walls_beside_grazes():
    """The image of the middle of a triangle is near the mean of those of its corners, as the surface is not ribbed."""
    _, found = made(PAIR, "BTB", (0.3, 0.0), (1.0, np.pi), 60)
    corners, images = found.returns.start[found.triangles], found.returns.image[found.triangles]
    exact = PAIR.first_return(corners.mean(axis=1)).image
    beside = (np.abs(exact - images.mean(axis=1)) / np.ptp(found.returns.image, axis=0)).max(axis=1)
    assert areas(corners)[beside > 0.02].sum() < 1e-3 * areas(corners).sum()


def test_no_triangle_joins_what_a_graze_parts_beside_the_end_of_its_border():
    """Beside the border one smooth piece of the ball's map lies on both sides of a strip that is narrower than a cell."""
    _, found = made(BALL, "BB", (0.01, 0.3), (0.4, 0.9), 40)
    assert np.ptp(found.returns.image[:, 0]) > 1.4, "both sides are there"
    assert np.ptp(found.returns.image[found.triangles], axis=1)[:, 0].max() < 0.2


def test_a_surface_without_edges_is_its_grid():
    surface, found = made(PAIR, "BTB", (0.7, 0.3), (0.8, 0.5), 80)
    assert np.array_equal(found.returns.start, surface.start)
    assert len(found.triangles) == 2 * 79 * 79


def test_a_grid_along_one_coordinate_has_no_triangles():
    family = WordFamily(name="BB", words=("BB",))
    surface = family.surface(PAIR, Grid(axes={"v": Axis(low=0.1, high=1, points=5), "phi": Axis.at(0.3)}))
    with pytest.raises(NsmapsError, match=message("exact.varies", names="v")):
        mesh(PAIR, surface, family)


@pytest.mark.parametrize(("k", "value"), [(0, 0.4), (1, 0.5), (0, 0.0033), (1, np.pi)])
def test_a_cut_has_the_states_at_a_value_and_their_images(k, value):
    surface, found = made(PAIR, "BTB", high=(1.0, np.pi), points=300)
    ends = found.cut(k, value).reshape(-1, 2, 2)
    assert np.abs(ends[:, 0, k] - value).max() < 1e-9
    exact = PAIR.first_return(ends[:, 0])
    right = exact.has_word("BTB")
    assert right.mean() > 0.95  # the others lie at an edge within rounding
    apart = np.abs(exact.image - ends[:, 1])[right]
    assert np.median(np.minimum(apart, 2 * np.pi - apart)) < 1e-3
    line = ends[:, 0, 1 - k]
    along = np.linspace(surface.start[:, 1 - k].min(), surface.start[:, 1 - k].max(), 1000)
    states = np.column_stack([along, np.full(1000, value)][:: 1 if k else -1])
    inside = along[PAIR.first_return(states).has_word("BTB")]
    assert (line.min(), line.max()) == pytest.approx((inside.min(), inside.max()), abs=5e-3)


def test_a_sampled_surface_ends_at_the_diagonals_of_cells():
    """Members are x + y <= 1 on a grid that has this line through corners: the triangles fill that half of the square."""
    axis = Axis(low=0.0, high=1.0, points=11)
    grid = Grid(axes={"v": axis, "phi": axis})
    member = grid.states().sum(axis=1) <= 1 + 1e-12
    start = grid.states()[member]
    blank = np.zeros(len(start))
    codes, outcome = np.ones(len(start), np.int64), np.zeros(len(start), np.int8)
    returns = Returns(PAIR.coordinates, ("B", "T"), start, start, np.zeros(start.shape, np.int32), codes, outcome, blank)
    facets = grid_mesh(Surface("BB", grid, member, returns))
    a, b, c = np.moveaxis(facets.returns.start[facets.triangles], 1, 0)
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (twice > 0).all(), "all turn the same way"
    assert twice.sum() / 2 == pytest.approx(0.5)
