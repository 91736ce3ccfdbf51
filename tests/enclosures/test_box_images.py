"""Images of boxes under polynomials and composite maps hold those of random states and corners: no state is missed."""

from itertools import product

import numpy as np
import pytest
from exported import Disc
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message

from nsmaps import load_study, run_study
from nsmaps.auxiliary.attracting_domain import attracting_domain
from nsmaps.auxiliary.full_map import FullAuxiliaryMap
from nsmaps.cells.morse import forward_invariant_box, forward_invariant_set, morse_sets
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.cells.times import exit_times
from nsmaps.coordinates import Angle, nearest_turn
from nsmaps.enclosures.box_images import FittedBoxes, box_map
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.composite.formulas import composite_of
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.polymap import PolyMap

NAMES = ("v", Angle("phi"))


def polymap(names, degree, seed, centre=0.5, scale=1.0, absolute=()):
    """A map of random coefficients, fitted about one centre."""
    rng, n = np.random.default_rng(seed), len(names)
    exponents = np.array(list(product(range(degree + 1), repeat=n)))
    sizes = 0.8 ** exponents.sum(axis=1)
    coefficients = tuple(rng.normal(size=len(exponents)) * sizes for _ in names)
    middle = np.full(n, float(centre))
    domain = np.stack([middle - scale, middle + scale], axis=1)
    return PolyMap(tuple(names), (exponents,) * n, coefficients, middle, np.full(n, float(scale)), domain, absolute)


class Parabola(PiecewiseMap):
    """Henon's map in units of its own of both coordinates."""

    s: float
    u: float
    coordinates = ("x", "y")

    def pieces(self, x):
        return {"H": (True, {"x": self.s * (1 - 1.4 * (x.x / self.s) ** 2 + x.y / self.u), "y": 0.3 * self.u * x.x / self.s})}


@pytest.mark.parametrize("units", [[1e6, 1e6], [1e-6, 1e-6], [1e-9, 1e5], [1e-4, 1e12]])
def test_a_map_by_formula_loses_no_digits_in_other_units(units):
    """Its polynomials, and the image of a box, whose ends are known: of x in [0, 1/2], y in [-1/4, 1/4]."""
    return_map = Parabola(s=units[0], u=units[1])
    x, y = np.random.default_rng(0).uniform(-1, 1, (2, 500))
    exact = np.column_stack([1 - 1.4 * x**2 + y, 0.3 * x])
    fitted = composite_of(return_map).first_return(np.column_stack([x, y]) * units).image
    np.testing.assert_allclose(fitted / units, exact, atol=4e-15)
    (box,) = box_map(return_map).image_boxes([[[0, units[0] / 2], [-units[1] / 4, units[1] / 4]]]).images
    np.testing.assert_allclose(box / np.array(units)[:, None], [[0.4, 1.25], [0, 0.15]], atol=1e-11)


def where(text):
    return ConditionRegion(coordinates=NAMES, text=text)


def box(v, phi):
    return Box.of(NAMES, [v, phi])


def random_boxes(window, count, seed):
    """Boxes of all sizes about random states."""
    rng, window = np.random.default_rng(seed), np.array(window, float)
    middle = rng.uniform(*window.T, (count, len(window)))
    half = np.ptp(window, axis=1) * 10 ** rng.uniform(-5, -0.6, (count, 1)) * rng.uniform(0.1, 1, (count, len(window)))
    return np.stack([middle - half, middle + half], axis=2)


def assert_held(return_map, boxes, seed=0):
    """Images of 200 random states and the corners of each box lie in its image boxes, or in none and it is called empty."""
    made = box_map(return_map).image_boxes(boxes)
    assert (np.diff(made.source) >= 0).all()
    assert made.bounded.all()
    rng, (count, n) = np.random.default_rng(seed), boxes.shape[:2]
    corners = np.array([[box[k, side[k]] for k in range(n)] for box in boxes for side in product((0, 1), repeat=n)])
    inside = boxes[:, None, :, 0] + rng.random((count, 200, n)) * np.ptp(boxes, axis=2)[:, None]
    inside = np.clip(inside, boxes[:, None, :, 0], boxes[:, None, :, 1])
    states = np.concatenate([inside, corners.reshape(count, -1, n)], axis=1)
    returns = return_map.first_return(states.reshape(-1, n))
    image, gone = returns.image.reshape(states.shape), (returns.outcome != Outcome.returned).reshape(count, -1)
    words = returns.words.reshape(count, -1)
    assert not (gone.any(axis=1) & ~made.empty).any()
    angles = np.array([isinstance(name, Angle) for name in return_map.coordinates])
    for k in range(count):
        rows = made.source == k
        images, x = made.images[rows][:, None], image[k][~gone[k]]
        x = np.where(angles, nearest_turn(x, images.mean(axis=3)), x)
        slack = np.where(angles, 1e-14, 0.0)  # of moving an image by whole turns, in this test
        wide = angles & (np.ptp(images, axis=3) >= 2 * np.pi)
        held = ((images[..., 0] - slack <= x) & (x <= images[..., 1] + slack) | wide).all(axis=2)
        assert held.any(axis=0).all(), (boxes[k], x[~held.any(axis=0)])
        assert set(words[k][~gone[k]]) <= set(made.words[rows])
    return made


@pytest.mark.parametrize("names", [("x",), NAMES, ("x", "y", Angle("t"))], ids="123")
def test_polynomials_in_one_to_three_coordinates(names):
    return_map, window = polymap(names, 4, 1), [[-0.5, 1.5]] * len(names)
    made = assert_held(FittedBoxes.of(return_map), random_boxes(window, 150, 2))
    assert not made.empty.any()
    thin = random_boxes(window, 150, 3) * 0 + 0.3
    thin = thin + np.array([0.0, 1e-9])
    sides = np.ptp(box_map(return_map).image_boxes(thin).images, axis=2)
    slopes = np.abs(return_map.derivative(thin[:1].mean(axis=2))[0]).sum(axis=1)
    assert (sides <= 1e-9 * slopes * 1.01 + 1e-12).all()  # tight: the image of a thin box is as wide as the slopes say


def test_a_polynomial_by_its_own_formula():
    """x -> |x^2 - 1/4| over [0, 1] is [0, 3/4]."""
    return_map = PolyMap.of_monomials(("x",), {"x": {(2,): 1, (0,): -0.25}}, [[0, 1]], ("x",))
    (image,) = box_map(return_map).image_boxes(np.array([[[0.0, 1.0]]])).images
    assert image[0, 0] == 0
    assert image[0, 1] == pytest.approx(0.75, abs=1e-12)


SEAMS = {
    "where": [
        ("high", where("v > 0.6 - 0.5*phi and v > 0.55"), "BTB"),
        ("low", where("v <= 0.6 - 0.5*phi"), "BB"),
        ("rest", where("v > 0.6 - 0.5*phi and v <= 0.55"), "BTBB"),
    ],
    "boxes": [("a", box((0, 0.5), (-0.2, 3)), "BB"), ("b", box((0.5, 1), (-0.2, 3)), "BTB"), ("c", box((0, 1), (3, 6.5)), "B")],
    "turns": [("a", box((0, 1), (5.5, 7)), "BB"), ("b", box((0.2, 0.7), (-9, -7)), "BTB"), ("c", where("sin(phi) > v"), "")],
    "waves": [("a", where("cos(3*phi)**2 < v and not v**0.5 > exp(-phi)"), "BB"), ("b", where("log(v) < 1/(phi - 3)"), "BTB")],
    "gaps": [("a", where("0.3 < v < 0.4 or phi == 1"), "BB"), ("b", box((0.4, 0.8), (1, 2)), "BTB")],
}


def composite(pieces):
    """Random maps, each fitted on a turn of its own; of the first piece with an absolute value."""
    absolute = [("v",), (), ()]
    maps = [polymap(NAMES, 3, k, centre, 1.5, absolute[k]) for k, centre in zip(range(3), (0.5, 7.0, -4.0), strict=True)]
    return CompositeMap(NAMES, ("B", "T"), tuple(Piece(n, r, m, w) for (n, r, w), m in zip(pieces, maps, strict=False)))


@pytest.mark.parametrize("name", SEAMS)
def test_pieces_with_seams(name):
    return_map = composite(SEAMS[name])
    boxes = random_boxes([[0, 1], [-3, 9]], 400, 5)
    made = assert_held(return_map, boxes)
    assert (np.bincount(made.source, minlength=len(boxes)) > 1).any()
    if name == "where":  # the three cover the plane, also along the lines that they share
        assert not made.empty.any()


def test_regions_that_share_a_border_leave_no_gap():
    return_map = composite(SEAMS["boxes"])
    made = box_map(return_map).image_boxes(np.array([[[0.4, 0.6], [1, 2]], [[0.4, 0.6], [2.9, 3.1]], [[0.9, 1.1], [1, 2]]]))
    assert made.empty.tolist() == [False, False, True]
    assert [made.words[made.source == k].tolist() for k in range(2)] == [["BB", "BTB"], ["BB", "BTB", "B"]]


def test_the_first_piece_that_surely_holds_a_box_is_the_last_asked():
    pieces = [("a", box((0, 1), (0, 1)), "BB"), ("b", where("v >= 0"), "BTB")]
    made = box_map(composite(pieces)).image_boxes(np.array([[[0.2, 0.3], [0.2, 0.3]], [[0.2, 0.3], [0.9, 1.2]]]))
    assert made.words.tolist() == ["BB", "BB", "BTB"]


def test_resets_keep_the_turn_and_restrict_to_the_region():
    return_map = CompositeMap(NAMES, (), (Piece("reset", box((0, 1), (-1, 1)), PolyMap.reset(NAMES, {"v": 0.25})),))
    made = assert_held(return_map, np.array([[[0.2, 0.3], [12.4, 12.8]], [[0.2, 0.3], [-1.5, -0.5]]]))
    assert made.source.tolist() == [0, 0, 1]  # the first on both sides of a whole turn
    assert made.hulls() == pytest.approx(np.array([[[0.25, 0.25], [12.4, 12.8]], [[0.25, 0.25], [-1.0, -0.5]]]))
    assert made.empty.tolist() == [False, True]


def test_overflow_is_not_bounded():
    return_map = PolyMap.of_monomials(("x",), {"x": {(3,): 1}}, [[0, 1]])
    made = box_map(return_map).image_boxes(np.array([[[1e200, 1e201]], [[0.0, 1.0]]]))
    assert made.bounded.tolist() == [False, True]
    assert made.empty.tolist() == [True, False]
    assert np.isinf(made.images[0]).all()


def test_a_region_of_a_class_is_enclosed_by_its_condition():
    """A disc about a state on the circle; inside of it boxes have the images of its piece alone, outside only the others."""
    disc = Disc(coordinates=NAMES, centre=(0.3, 1.0), radius=0.25)
    return_map = composite([("disc", disc, "BB"), ("b", where("v <= 0.7"), "BTB")])
    made = assert_held(return_map, random_boxes([[0, 0.69], [0, 3]], 100, 1))
    assert set(made.words) == {"BB", "BTB"}
    side = 0.02 * np.array([[-1, 1], [-1, 1]])
    boxes = np.array([[0.3, 1.1], [0.5, 0.9], [0.6, 2.0]])[:, :, None] + side
    made = box_map(return_map).image_boxes(boxes)
    assert [made.words[made.source == k].tolist() for k in range(3)] == [["BB"], ["BB", "BTB"], ["BTB"]]
    assert not made.empty.any()


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.sampled_from(["v < 0.5", "phi >= v + 1", "v == 0.25", "2*v != phi", "0.2 < v <= phi/4"]), min_size=1, max_size=3),
    st.lists(st.sampled_from(["and", "or", "and not", "or not"]), min_size=2, max_size=2),
    st.tuples(*[st.sampled_from([0.0, 0.2, 0.25, 0.5, 1.0])] * 2, *[st.sampled_from([0.0, 0.5, 1.0, 1.25])] * 2),
)
def test_whatever_the_condition(parts, joints, ends):
    text = parts[0] + "".join(f" {joint} ({part})" for joint, part in zip(joints, parts[1:], strict=False))
    v, phi = sorted(ends[:2]), sorted(ends[2:])
    return_map = composite([("a", where(text), "BB"), ("b", where("v > 0.5"), "BTB")])
    assert_held(return_map, np.array([[v, phi]]))


SETTING = "vi_pair/fp vi_pair/paper vi_pair/auto"


@pytest.fixture(scope="module")
def studied():
    """The composite maps of three studies, from coarser grids."""
    made = {}
    for name in SETTING.split():
        study = load_study(name)
        grid = {axis: ends.model_copy(update={"points": 100}) for axis, ends in study.grid.items()}
        bare = {
            "grid": type(study.grid)(grid),
            "orbits": type(study.orbits)(),
            "domains": type(study.domains)(),
            "diagonal": study.diagonal,
            "second_iterate": None,
            "auxiliary_map": None,
            "figures": (),
        }
        made[name] = run_study(study.model_copy(update=bare)).composite
    return made


@pytest.mark.parametrize("name", SETTING.split())
def test_composite_maps_of_studies(studied, name):
    made = assert_held(studied[name], random_boxes([[0.02, 1.05], [0, 2 * np.pi]], 300, 4))
    if name == "vi_pair/fp":  # its pieces cover all states
        assert not made.empty.any()


CONTRACTION = {"v": {(1, 0): 0.4, (0, 1): 0.1, (0, 0): 0.5}, "phi": {(0, 1): -0.5, (1, 0): 0.1, (0, 0): 0.3}}


def test_what_takes_box_maps_takes_fitted_maps():
    """v' = 0.4 v + 0.1 phi + 0.5, phi' = 0.1 v - 0.5 phi + 0.3: one fixed point, v = 0.48/0.89, phi = ..., solved here."""
    return_map = PolyMap.of_monomials(NAMES, CONTRACTION, [[0, 1.5], [-0.5, 1]])
    fixed = np.linalg.solve(np.eye(2) - [[0.4, 0.1], [0.1, -0.5]], [0.5, 0.3])
    window = [[0.2, 1.3], [-0.3, 0.8]]
    cover = morse_sets(return_map, window, depth=3)
    assert cover.of == "fitted map"
    assert cover.contains(fixed[None]).all()
    held = forward_invariant_set(return_map, cover)
    assert held.forward_invariant
    assert forward_invariant_box(return_map, window).forward_invariant
    found = find_cycles(return_map, window, max_period=1, depth=3)
    assert found.cycles[0].states[0] == pytest.approx(fixed, abs=1e-12)
    regions = {"far": Box.of(NAMES, [[0.2, 0.4], [-0.3, 0.8]])}
    made = exit_times(return_map, regions, window, depth=2, n_cells=16, target=held, cycles=found.cycles)
    assert made.rows[0].left == 1.0
    boxes = np.array([[[0.6, 1.0], [0.1, 0.4]]])
    full = FullAuxiliaryMap(return_map, boxes)
    assert morse_sets(full, window, depth=3).contains(fixed[None]).all()


def test_a_map_without_boxes_is_refused():
    with pytest.raises(NsmapsError, match=message("enclosures.no-images-of-boxes")):
        box_map(object())


def test_a_map_is_called_what_it_is():
    """One polynomial is a fitted map, what is composed of them a composite map; stored results keep the name they were given."""
    fitted = PolyMap.of_monomials(NAMES, CONTRACTION, [[0, 1.5], [-0.5, 1]])
    composite = CompositeMap(NAMES, ("B",), (Piece("all", where("v < 2"), fitted),))
    window = [[0.2, 1.3], [0.1, 0.4]]
    for return_map, name in ((fitted, "fitted map"), (composite, "composite map")):
        assert attracting_domain(return_map, window, max_updates=1).of == name
        assert find_cycles(return_map, window, max_period=1, depth=1).of == name
        assert morse_sets(return_map, window, depth=1).of == name
