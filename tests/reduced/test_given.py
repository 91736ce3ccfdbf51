"""Maps given by formulas as composite maps: the same images, pieces, derivatives and orbits, and boxes that hold all images."""

from fractions import Fraction

import given
import numpy as np
import pytest
import sympy as sp
from messages import message

from nsmaps.auxiliary.attracting_domain import attracting_domain
from nsmaps.cells.morse import forward_invariant_box, forward_invariant_set, morse_sets
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.cells.times import exit_times
from nsmaps.enclosures.box_images import box_map
from nsmaps.enclosures.sides import sides_of
from nsmaps.errors import ConditionError
from nsmaps.reduced.composite.formulas import composite_of
from nsmaps.reduced.conditions.region import Box

of_each = pytest.mark.parametrize("return_map", given.MAPS, ids=lambda return_map: type(return_map).__name__)


def states_of(return_map, count=3000):
    """Random states, borders, and angles next to whole turns among them."""
    box = np.array(given.MAPS[return_map], float)
    states = np.random.default_rng(3).uniform(*box.T, (count, len(box)))
    for j in range(len(box)):
        edges = [0.0, 2 * np.pi, np.nextafter(2 * np.pi, 0), np.nextafter(0, -1), 2.5, 3.2, -0.9, -0.8]
        states[10 * j : 10 * j + len(edges), j] = edges
    return states


@of_each
def test_images_are_those_of_the_compiled_map(return_map):
    states = states_of(return_map)
    expected, found = (
        return_map.first_return(states, derivative=True),
        composite_of(return_map).first_return(states, derivative=True),
    )
    assert found.words.tolist() == expected.words.tolist()
    assert found.outcome.tolist() == expected.outcome.tolist()
    assert len(set(found.words.tolist()) - {""}) == len(return_map.letters)
    away = np.abs(return_map.coordinates.difference(found.image, expected.image))
    assert np.nanmax(away / (1 + np.abs(expected.image))) <= 4e-15
    assert found.derivative == pytest.approx(expected.derivative, rel=1e-13, abs=1e-13, nan_ok=True)


@of_each
def test_boxes_hold_the_images_of_their_states(return_map):
    """By the states of the compiled map, of boxes of all sizes."""
    rng, box = np.random.default_rng(5), np.array(given.MAPS[return_map], float)
    middle = rng.uniform(*box.T, (150, len(box)))
    half = np.ptp(box, axis=1) * 10 ** rng.uniform(-6, -0.7, (150, 1))
    boxes = np.stack([middle - half, middle + half], axis=2)
    found = box_map(return_map).image_boxes(boxes)
    assert found.bounded.all()
    states = boxes[:, None, :, 0] + rng.random((150, 60, len(box))) * np.ptp(boxes, axis=2)[:, None]
    returns = return_map.first_return(states.reshape(-1, len(box)))
    images = returns.image.reshape(states.shape)
    lost = np.isnan(images).any(axis=2)
    assert not (lost.any(axis=1) & ~found.empty).any()
    checked = 0
    for k in range(150):
        hulls = found.images[found.source == k]
        away = return_map.coordinates.difference(images[k][~lost[k], None], hulls.mean(axis=2)[None])
        held = np.abs(away) <= np.ptp(hulls, axis=2) / 2 * (1 + 1e-9) + 1e-15
        assert held.all(axis=2).any(axis=1).all()
        checked += len(held)
    assert checked > 3000


def test_hulls_of_affine_pieces_are_exact_but_for_rounding():
    """Corners in fractions, of boxes in one piece and of one over the border, of which each side has its own image."""
    a, b = Fraction(1.7), Fraction(0.5)
    image = box_map(given.Lozi()).image_boxes(np.array([[[0.25, 0.5], [-0.125, 0.5]], [[-0.25, 0.5], [0.0, 0.5]]]))
    boxes = [("R", (0.25, 0.5), (-0.125, 0.5)), ("L", (-0.25, 0), (0.0, 0.5)), ("R", (0, 0.5), (0.0, 0.5))]
    assert image.source.tolist() == [0, 1, 1]
    assert image.words.tolist() == [word for word, _, _ in boxes]
    for found, (word, x, y) in zip(image.images, boxes, strict=True):
        sign = -1 if word == "R" else 1
        corners = [(1 + sign * a * Fraction(s) + Fraction(t), b * Fraction(s)) for s in x for t in y]
        exact = [[float(end(side)) for end in (min, max)] for side in zip(*corners, strict=True)]
        assert found == pytest.approx(np.array(exact), abs=1e-12)
        assert (found[:, 0] <= np.array(exact)[:, 0]).all()
        assert (found[:, 1] >= np.array(exact)[:, 1]).all()


def test_cells_cycles_and_domains_of_the_lozi_map():
    """A trapping region, the cycles of one and two returns in fractions, times until states arrive, a contraction's domain."""
    return_map, window, names = given.Lozi(), [[-1.6, 1.6], [-0.8, 0.8]], ("x", "y")
    cover = morse_sets(return_map, window, depth=5)
    assert cover.of == "map Lozi"
    assert cover.contains(return_map.orbits([[0.1, 0.1]], 300).image[50:]).all()
    held = forward_invariant_set(return_map, cover)
    assert held.forward_invariant
    a, b = Fraction(1.7), Fraction(0.5)
    fixed = [(1 / (1 - a - b), b / (1 - a - b)), (1 / (1 + a - b), b / (1 + a - b))]
    found = find_cycles(return_map, window, max_period=2, depth=5)
    assert found.of == "map Lozi"
    states = [cycle.states[0].tolist() for cycle in found.cycles if len(cycle.states) == 1]
    assert states == pytest.approx(np.array(fixed, float), abs=1e-14)
    x = (1 - a - b) / ((1 - b) ** 2 + a**2), (1 + a - b) / ((1 - b) ** 2 + a**2)  # x1 = 1 + b x1 - a x2, x2 = 1 + b x2 + a x1
    (two,) = (cycle.states for cycle in found.cycles if len(cycle.states) == 2)
    assert two == pytest.approx(np.array([[x[0], b * x[1]], [x[1], b * x[0]]], float), abs=1e-14)
    regions = {"far": Box.of(names, [[1.4, 1.6], [-0.8, 0.8]])}
    assert exit_times(return_map, regions, window, depth=1, n_cells=4, target=held, cycles=found.cycles).of == "map Lozi"
    domain = attracting_domain(given.Lozi(a=0.3, b=0.2), [[-2, 3], [-1, 1]], max_updates=4)
    assert (domain.of, domain.forward_invariant) == ("map Lozi", True)


def test_a_root_has_bounded_images_up_to_its_border():
    """0.01 - sqrt(x) over [0, 0.25], of which the box has states on both sides; then a window that is sent into itself."""
    return_map = given.Root()
    found = box_map(return_map).image_boxes(np.array([[[-0.1, 0.25]]]))
    assert found.words.tolist() == ["L", "R"]
    assert found.images == pytest.approx(np.array([[[-0.02, 0.01]], [[-0.49, 0.01]]]), abs=1e-12)
    assert not found.empty.any()
    assert forward_invariant_box(return_map, [[-0.2, 0.02]]).forward_invariant


def test_a_root_beyond_a_slanted_border_is_not_bounded_across_it():
    class Slanted(given.Lozi):
        """The root of x + y where that is positive."""

        def pieces(self, x):
            return {"L": (x.x + x.y < 0, {"x": x.x, "y": x.y}), "R": (True, {"x": sp.sqrt(x.x + x.y), "y": x.y})}

    found = box_map(Slanted()).image_boxes(
        np.array([[[-0.1, 0.2], [0.0, 0.1]], [[0.1, 0.2], [0.0, 0.1]], [[-0.3, -0.2], [0, 0.1]]])
    )
    assert (found.bounded.tolist(), found.empty.tolist()) == ([False, True, True], [True, False, False])
    assert found.images[found.source == 1][0, 0] == pytest.approx(np.sqrt([0.1, 0.3]), abs=1e-12)


SIDES = [
    ("x > 1 and y < 2*x", [[1, np.inf], [-np.inf, np.inf]], [[-np.inf, np.inf]] * 2),
    ("not (x > 1 or 0.5 >= y)", [[-np.inf, 1], [0.5, np.inf]], [[-np.inf, np.inf]] * 2),
    ("x == 0.25 or 2 > x > 1", [[0.25, 2], [-np.inf, np.inf]], [[-np.inf, np.inf]] * 2),
    ("x <= -3", [[-np.inf, -3], [-np.inf, np.inf]], [[-3, np.inf], [-np.inf, np.inf]]),
    ("x < 0 and x > 1", [[np.inf, -np.inf]] * 2, [[-np.inf, np.inf]] * 2),
]


@pytest.mark.parametrize(("text", "true", "false"), SIDES, ids=[text for text, _, _ in SIDES])
def test_boxes_of_conditions(text, true, false):
    assert sides_of(text, ("x", "y")).tolist() == [true, false]


def test_a_piece_without_text_is_named():
    class Gamma(given.Logistic):
        """A function that conditions and formulas do not have."""

        def pieces(self, x):
            return {"A": (x.x < 0, {"x": x.x}), "B": (True, {"x": sp.gamma(x.x)})}

    with pytest.raises(ConditionError, match=message("reduced.function", function="gamma", at="the piece 'B' of Gamma")):
        composite_of(Gamma())
