"""The composite map: the first piece wins, resets, the circle, coverage, and pieces that cannot be made."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from messages import message
from pydantic import ValidationError

from nsmaps.coordinates import Angle, Coordinates, wrap
from nsmaps.errors import FitError, NsmapsError, StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface
from nsmaps.exact.words import encode
from nsmaps.reduced.composite.composite import CompositeMap, Piece, PieceSpec, build_composite
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.polyfit import PolyMap, PolynomialFit, SeparableFit
from nsmaps.reduced.validation.words import misleads

NAMES = ("v", Angle("phi"))
WALLS = ("B", "T")
TWO_PI = 2 * math.pi
LINEAR = PolynomialFit(degrees={"v": 1, "phi": 1})


def surface_of(f, words, v=(0.0, 1.0, 41), phi=(0.0, 3.0, 61), member=None):
    """The surface of an analytic map f(v, phi) -> (v', phi' not wrapped), with words by state."""
    grid = Grid(axes={"v": Axis(low=v[0], high=v[1], points=v[2]), "phi": Axis(low=phi[0], high=phi[1], points=phi[2])})
    start = grid.states()
    mask = np.ones(grid.size, bool) if member is None else member(*start.T)
    start = start[mask]
    lifted = np.column_stack(f(*start.T))
    image = np.column_stack([lifted[:, 0], wrap(lifted[:, 1])])
    turns = np.round((lifted - image) / TWO_PI).astype(np.int32)
    codes = np.array([encode(word, WALLS) for word in np.broadcast_to(words(*start.T), len(start))])
    zeros = np.zeros(len(start))
    return Surface("F", grid, mask, Returns(NAMES, WALLS, start, image, turns, codes, zeros.astype(np.int8), zeros))


def high(v, phi):
    return 0.9 - 0.5 * v + 0.1 * phi, 0.2 + 0.3 * v + 0.4 * phi


def low(v, phi):
    return 0.1 + v, 2.0 - 0.5 * phi


SURFACES = {
    "BTB": surface_of(high, lambda v, phi: "BTB", member=lambda v, phi: v > 0.4),
    "BB": surface_of(low, lambda v, phi: "BB", member=lambda v, phi: v <= 0.4),
}


def where(name, text, **made):
    return PieceSpec(name=name, region=ConditionRegion(text=text, coordinates=("v", "phi")), **made)


def fitted(name, text, family, fit=LINEAR):
    return where(name, text, family=family, fit=fit)


def composite(*pieces):
    return build_composite(NAMES, WALLS, SURFACES, pieces)


def test_where_a_composite_map_misleads():
    """The exact edge lies at v = 0.4, the pieces' at v = 0.5: the wrong words are the strip between, a tenth of the box wide."""
    whole = surface_of(high, lambda v, phi: np.where(v > 0.41, "BTB", "BB"))
    made = composite(fitted("up", "v > 0.51", "BTB"), fitted("down", "v <= 0.51", "BB"))
    made = replace(made, pieces=tuple(replace(piece, word=word) for piece, word in zip(made.pieces, ("BTB", "BB"), strict=True)))
    found = misleads(made, whole.grid, made, whole.returns)
    assert found.states == whole.grid.size
    assert found.wrong_words == pytest.approx(4 / 41)  # v = 0.425, ..., 0.5
    assert found.farthest == pytest.approx(4 / 40)
    assert 1 / 40 < found.typical < 4 / 40
    assert misleads(made, whole.grid, made, made.first_return(whole.start)).wrong_words == 0


RESET = where("reset", "phi > pi or phi < 0", reset={"phi": 1.2})
R1 = PieceSpec(name="R1", region=Box(coordinates=NAMES, bounds={"v": (0.6, 0.9), "phi": (0.1, 0.5)}), family="BTB", fit=LINEAR)
R2 = fitted("R2", "v > 0.5", "BTB", SeparableFit(degrees={"v": 1, "phi": 1}))
R3 = fitted("R3", "v < 0.3", "BB")
MAP = composite(RESET, R1, R2, R3)


def test_the_first_piece_that_holds_a_state_wins():
    states = [[0.7, 0.3], [0.95, 0.3], [0.7, 4.0], [0.1, 4.0], [0.1, 1.0], [0.4, 1.0], [0.6, 0.1], [np.nan, 1], [1, np.inf]]
    assert MAP.piece_of(states).tolist() == [1, 2, 0, 0, 3, -1, 1, -1, -1]
    assert MAP.piece_once(states).tolist() == [1, 2, 0, 0, 3, -1, 1, -1, -1]
    swapped = composite(R2, R1)
    assert swapped.piece_of([[0.7, 0.3]]).tolist() == [0]


def test_returns_are_those_of_the_piece():
    states = np.array([[0.7, 0.3], [0.1, 1.0], [0.2, 4.0], [0.4, 1.0], [np.nan, 1.0]])
    returns = MAP.first_return(states)
    np.testing.assert_allclose(returns.image[0], high(0.7, 0.3), atol=1e-13)
    np.testing.assert_allclose(returns.image[1], low(0.1, 1.0), atol=1e-13)
    np.testing.assert_array_equal(returns.image[2], [0.2, 1.2])
    assert np.isnan(returns.image[3:]).all()
    outcomes = [Outcome.returned] * 3 + [Outcome.uncovered, Outcome.invalid]
    assert returns.outcome.tolist() == outcomes
    assert returns.outcome.dtype == np.int8
    assert returns.words.tolist() == ["BTB", "BB", "", "", ""]
    assert np.isnan(returns.time).all()
    assert returns.derivative is None
    assert returns.coordinates == Coordinates(NAMES)
    np.testing.assert_array_equal(returns.start, states)
    assert len(MAP.first_return(np.empty((0, 2)))) == 0


def test_no_image_is_certified(pair):
    """A polynomial stands for one word, whatever the flight does; the exact map's images of the same states are certified."""
    states = np.array([[0.7, 0.3], [0.1, 1.0], [0.2, 4.0], [0.4, 1.0]])
    returns = MAP.first_return(states)
    assert returns.valid.tolist() == [True, True, True, False]
    assert not returns.certified.any()
    assert not returns.select([0, 1]).certified.any()
    assert returns.margin is None
    assert pair(0.3).first_return(states).certified.all()


def test_the_derivative():
    slopes = MAP.first_return([[0.7, 0.3], [0.1, 1.0], [0.2, 4.0], [0.4, 1.0]], derivative=True).derivative
    np.testing.assert_allclose(slopes[0], [[-0.5, 0.1], [0.3, 0.4]], atol=1e-12)
    np.testing.assert_allclose(slopes[1], [[1, 0], [0, -0.5]], atol=1e-12)
    np.testing.assert_array_equal(slopes[2], [[1, 0], [0, 0]])
    assert np.isnan(slopes[3]).all()


def test_a_state_is_the_same_on_every_turn():
    states = np.array([[0.7, 0.3], [0.1, 1.0], [0.2, 4.0]])
    once = MAP.first_return(states)
    for turns in (-3, 1, 2):
        again = MAP.first_return(states + np.array([0, TWO_PI * turns]))
        np.testing.assert_allclose(again.image, once.image, atol=1e-12)
        np.testing.assert_array_equal(again.outcome, once.outcome)
        np.testing.assert_allclose(again.lifted[:2, 1], once.lifted[:2, 1] + TWO_PI * turns, atol=1e-12)


def test_images_are_wrapped_and_their_turns_kept():
    surfaces = {"F": surface_of(lambda v, phi: (v, 5.4 + v), lambda v, phi: "BB")}
    returns = build_composite(NAMES, WALLS, surfaces, [fitted("F", "v >= 0", "F")]).first_return([[0.1, 1.0], [1.0, 1.0]])
    np.testing.assert_allclose(returns.image[:, 1], [5.5, 6.4 - TWO_PI], atol=1e-13)
    assert returns.turns.tolist() == [[0, 0], [0, 1]]
    np.testing.assert_allclose(returns.lifted[:, 1], [5.5, 6.4], atol=1e-13)


def test_a_piece_over_the_seam_of_the_circle():
    def f(v, phi):
        return v, 1 + 0.5 * np.where(phi > math.pi, phi - TWO_PI, phi) + TWO_PI * (phi > math.pi)

    surfaces = {"F": surface_of(f, lambda v, phi: "BB", phi=(0, TWO_PI, 201))}
    piece = PieceSpec(name="F", region=Box(coordinates=NAMES, bounds={"v": (0, 1), "phi": (-0.4, 0.4)}), family="F", fit=LINEAR)
    return_map = build_composite(NAMES, WALLS, surfaces, [piece])
    assert return_map.pieces[0].map.report.max_error.max() < 1e-12
    np.testing.assert_allclose(
        return_map.first_return([[0.5, 0.3], [0.5, TWO_PI - 0.3], [0.5, -0.3]]).image[:, 1], [1.15, 0.85, 0.85]
    )
    assert return_map.piece_of([[0.5, 1.0], [0.5, -0.41]]).tolist() == [-1, -1]


def test_a_negative_image_is_data_and_then_lies_in_no_piece():
    surfaces = {"F": surface_of(lambda v, phi: (v - 0.5, phi), lambda v, phi: "BB")}
    return_map = build_composite(NAMES, WALLS, surfaces, [fitted("F", "0 <= v <= 1", "F")])
    first = return_map.first_return([[0.2, 1.0]])
    assert first.image[0, 0] == pytest.approx(-0.3)
    assert first.outcome.tolist() == [Outcome.returned]
    second = return_map.first_return(first.image)
    assert second.outcome.tolist() == [Outcome.uncovered]


def test_a_polynomial_that_overflows_escapes():
    surfaces = {"F": surface_of(lambda v, phi: (v**3, phi), lambda v, phi: "BB")}
    return_map = build_composite(NAMES, WALLS, surfaces, [fitted("F", "v >= 0", "F", SeparableFit(degrees={"v": 3, "phi": 1}))])
    returns = return_map.first_return([[1e200, 1.0], [1.0, 1.0]])
    assert returns.outcome.tolist() == [Outcome.escaped, Outcome.returned]
    assert returns.valid.tolist() == [False, True]
    assert np.isnan(returns.image[0]).all()


def test_a_piece_is_fitted_to_all_its_region_and_nothing_else():
    def f(v, phi):
        return np.where(v > 0.5, 2 * v, 77.0), phi

    surfaces = {"F": surface_of(f, lambda v, phi: "BB")}
    first = PieceSpec(
        name="inner", region=Box(coordinates=NAMES, bounds={"v": (0.6, 0.9), "phi": (0.1, 0.5)}), family="F", fit=LINEAR
    )
    return_map = build_composite(NAMES, WALLS, surfaces, [first, fitted("outer", "v > 0.5", "F")])
    inside = surfaces["F"].start[:, 0] > 0.5
    assert return_map.pieces[1].map.report.points.tolist() == [inside.sum()] * 2
    assert return_map.pieces[1].map.report.max_error.max() < 1e-12


def test_the_word_of_a_piece_is_the_commonest_of_its_data():
    surfaces = {"F": surface_of(low, lambda v, phi: np.where(phi > 2, "BTTB", "BTB"))}
    return_map = build_composite(NAMES, WALLS, surfaces, [fitted("all", "v >= 0", "F"), fitted("late", "phi > 1.9", "F")])
    assert [piece.word for piece in return_map.pieces] == ["BTB", "BTTB"]
    assert [piece.word for piece in MAP.pieces] == ["", "BTB", "BTB", "BB"]


def test_pieces_by_name():
    assert MAP.piece("R2") is MAP.pieces[2]
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="piece", name="resett", near="reset")):
        MAP.piece("resett")


# ------------------------------------------------------------------------------------------------------- coverage
def test_coverage_of_a_grid():
    grid = Grid(axes={"v": Axis(low=0.05, high=0.95, points=10), "phi": Axis(low=0.25, high=3.25, points=4)})
    cover = MAP.coverage(grid)
    # v = 0.35, 0.45 are in no piece but for the reset at phi = 3.25
    assert cover.names == ("reset", "R1", "R2", "R3")
    assert cover.points == 40
    assert cover.fraction == pytest.approx(1 - 2 * 3 / 40)
    np.testing.assert_allclose(cover.fractions, np.array([10, 3, 5 * 3 - 3, 3 * 3]) / 40)
    assert not cover.covered
    np.testing.assert_allclose(cover.boxes, [[[0.35, 0.45], [0.25, 2.25]]])
    assert len(cover.uncovered) == 6
    assert (MAP.piece_of(cover.uncovered) == -1).all()
    again = MAP.coverage(grid.states())
    assert again.fraction == cover.fraction


def test_full_coverage_and_none():
    inside = MAP.coverage([[0.7, 0.3], [0.1, 1.0]])
    assert inside.covered
    assert inside.fraction == 1.0
    assert inside.boxes.shape == (0, 2, 2)
    assert inside.uncovered.shape == (0, 2)
    nothing = MAP.coverage(np.empty((0, 2)))
    assert math.isnan(nothing.fraction)
    assert not nothing.covered
    many = MAP.coverage(np.tile([0.4, 1.0], (1000, 1)) + np.arange(1000)[:, None] * 1e-6)
    assert many.fraction == 0
    assert len(many.uncovered) == 100
    lost = MAP.coverage([[np.nan, 1.0], [0.4, 1.0]])
    np.testing.assert_array_equal(lost.boxes, [[[0.4, 0.4], [1.0, 1.0]]])


# -------------------------------------------------------------------------------------------------------- refused
def test_an_empty_region_is_named_with_where_the_data_are():
    with pytest.raises(FitError) as error:
        composite(RESET, fitted("R9", "v < 0.3 and phi > 1", "BTB"))
    text = str(error.value)
    assert text.startswith("piece 'R9': no data of family 'BTB' where ")
    assert "v < 0.3" in text
    assert "v in [0.425, 1], phi in [0, 3]" in text


def test_a_family_without_data_is_named():
    surfaces = {"BTTB": surface_of(low, lambda v, phi: "BTTB", member=lambda v, phi: v > 5)}
    with pytest.raises(FitError, match=message("reduced.no-data-of-family", name="R", family="BTTB")):
        build_composite(NAMES, WALLS, surfaces, [fitted("R", "v > 0", "BTTB")])


@pytest.mark.parametrize(
    ("pieces", "said"),
    [
        ([fitted("R", "v > 0", "BTTB")], message("reduced.no-surface", name="R", family="BTTB", near="BTB")),
        ([R1, R1], message("reduced.two-pieces", name="R1")),
        ([fitted("R", "v > 0.99", "BTB")], message("reduced.all-at", value=1.0, name="v", at="piece 'R': v'")),
        (
            [where("R", "v > 0", reset={"w": 1})],
            message("errors.no-such", kind="coordinate", name="w", known="v, phi", at="piece 'R': reset"),
        ),
    ],
)
def test_what_cannot_be_made_names_its_piece(pieces, said):
    with pytest.raises(FitError, match=said):
        composite(*pieces)


def test_a_region_of_other_coordinates_names_its_piece():
    region = ConditionRegion(text="x > 0", coordinates=("x", "y"))
    with pytest.raises(FitError, match=message("errors.unknown", kind="name", name="x", at=re.compile("piece 'R'.*"))):
        composite(PieceSpec(name="R", region=region, reset={"v": 1}))


@pytest.mark.parametrize(
    ("made", "given"),
    [
        ({}, "no map"),
        ({"family": "BB"}, "family"),
        ({"fit": LINEAR}, "fit"),
        ({"reset": {"v": 1}, "fit": LINEAR, "family": "BB"}, "family and fit and reset"),
        ({"reset": {"v": 1}, "family": "BB"}, "family and reset"),
    ],
)
def test_a_piece_is_either_fitted_or_a_reset(made, given):
    with pytest.raises(ValidationError, match=message("reduced.piece-without-map", given=given)):
        where("R", "v > 0", **made)


def test_states_of_a_wrong_shape_are_refused():
    for call in (MAP.first_return, MAP.piece_of, MAP.coverage):
        with pytest.raises(StateError):
            call([0.5, 0.5])


def test_a_composite_may_be_made_by_hand():
    pieces = (Piece("all", ConditionRegion(text="v > 0", coordinates=NAMES), PolyMap.reset(NAMES, {"v": 0.5})),)
    returns = CompositeMap(NAMES, WALLS, pieces).first_return([[0.1, 2.0], [0.0, 2.0]])
    np.testing.assert_array_equal(returns.image, [[0.5, 2.0], [np.nan, np.nan]])
