"""Regions: what they contain against what they state, boxes over the seam of the circle, and what is refused."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message
from pydantic import ValidationError

from nsmaps.coordinates import Angle, Coordinates
from nsmaps.errors import StateError
from nsmaps.reduced.conditions.region import Box, ConditionRegion, Region

NAMES = ("v", Angle("phi"))
TWO_PI = 2 * math.pi


def states(boolean, point):
    """The truth of a sympy condition at a point (v, phi), with 50 digits."""
    v, phi = sp.symbols("v phi", real=True)
    truth = sp.sympify(boolean).subs({v: sp.Float(point[0], 50), phi: sp.Float(point[1], 50)})
    assert truth in (sp.true, sp.false)
    return bool(truth)


@settings(max_examples=150, deadline=None)
@given(
    low=st.floats(-7, 7),
    width=st.floats(1e-3, 7),
    points=st.lists(st.tuples(st.floats(0, 2), st.floats(0, TWO_PI, exclude_max=True)), min_size=1, max_size=5),
)
def test_a_box_states_what_it_contains(low, width, points):
    box = Box(coordinates=NAMES, bounds={"v": (0.5, 1.5), "phi": (low, low + width)})
    condition = box.condition()
    for point, found in zip(points, box.contains(points), strict=True):
        ends = (np.array([low, low + width]) - point[1]) / TWO_PI
        if np.abs(ends - np.round(ends)).min() > 1e-12:
            assert found == states(condition, point), (box, point)


@settings(max_examples=100, deadline=None)
@given(low=st.floats(-4, 4), width=st.floats(0.01, 6), phi=st.floats(-20, 20))
def test_an_angle_lies_in_a_box_on_whatever_turn_it_is_given(low, width, phi):
    ends = (np.array([low, low + width]) - phi) / TWO_PI
    if np.abs(ends - np.round(ends)).min() < 1e-9:
        return
    box = Box(coordinates=NAMES, bounds={"v": (0, 1), "phi": (low, low + width)})
    on_circle = math.fmod(math.fmod(phi - low, TWO_PI) + TWO_PI, TWO_PI) < width
    assert box.contains([[0.5, phi]]).tolist() == [on_circle]


@pytest.mark.parametrize(
    "text",
    [
        "v > 0.63 - 0.53*phi and v > 0.55",
        "v > 0.63 - 0.53*phi and 1.1 < phi < 2.5 and v < 0.55",
        "phi > pi or phi < 0",
        "not (sin(phi) > v**2 or phi/3 >= exp(-v))",
    ],
)
def test_where_states_what_it_contains(text):
    region = ConditionRegion(text=text, coordinates=NAMES)
    points = np.random.default_rng(1).uniform([-0.5, -1], [1.5, 7], (60, 2))
    condition = region.condition()
    found = region.contains(points)
    assert found.tolist() == [states(condition, point) for point in points.tolist()]
    assert 0 < found.sum() < len(points)


def test_a_box_is_closed_and_a_plain_coordinate_does_not_wrap():
    box = Box(coordinates=("v", "x"), bounds={"v": (0.63, 0.94), "x": (-0.2, 0.2)})
    corners = [[0.63, -0.2], [0.94, 0.2], [0.7, 0.2 + TWO_PI], [math.nextafter(0.63, 0), 0]]
    assert box.contains(corners).tolist() == [True, True, False, False]
    assert box.condition() == sp.And(
        *(
            sp.And(sp.Float(low) <= x, x <= sp.Float(high))
            for x, low, high in zip(sp.symbols("v x", real=True), box.lower, box.upper, strict=True)
        )
    )


def test_a_box_over_the_seam_holds_both_sides():
    box = Box(coordinates=NAMES, bounds={"v": (0, 1), "phi": (-0.2, 0.2)})
    assert box.contains([[0.5, phi] for phi in (0.1, 6.2, -0.1, 6.2 - 2 * TWO_PI)]).all()
    assert not box.contains([[0.5, phi] for phi in (0.3, 3.0, 6.0)]).any()


def test_the_whole_circle_holds_every_angle():
    box = Box(coordinates=NAMES, bounds={"v": (0, 1), "phi": (0, "2*pi")})
    assert box.contains([[0.5, x] for x in (0.0, TWO_PI, 3.0, -50.0, 1e6)]).all()
    assert not box.condition().has(sp.Symbol("phi", real=True))


EVERYWHERE = (Box(coordinates=NAMES, bounds={"v": (-9, 9), "phi": (-9, 9)}), ConditionRegion(text="v < 9", coordinates=NAMES))


@pytest.mark.parametrize("region", EVERYWHERE)
def test_what_is_no_state_lies_nowhere(region):
    assert region.contains([[0, 0], [np.nan, 0], [0, np.nan], [0, np.inf], [-np.inf, 0]]).tolist() == [True] + [False] * 4
    assert region.contains(np.empty((0, 2))).shape == (0,)
    with pytest.raises(StateError):
        region.contains([0.5, 0.5])


def test_a_box_and_its_array():
    box = Box(coordinates=NAMES, bounds={"v": (0.7, 1), "phi": (0.2, "pi/3")})
    assert box.coordinates == Coordinates(("v", "phi"), angles=("phi",))
    np.testing.assert_array_equal(box.array, [[0.7, 1], [0.2, math.pi / 3]])
    np.testing.assert_array_equal(box.lower, [0.7, 0.2])
    np.testing.assert_array_equal(box.upper, [1, math.pi / 3])
    assert Box.of(NAMES, box.array) == box
    assert Box.model_validate_json(box.model_dump_json()) == box == Box.model_validate(box.model_dump())


def test_angles_stay_angles_and_the_coordinates_give_the_order():
    box = Box(coordinates=("phi", "v"), bounds={"phi": (-0.2, 0.2), "v": (0, 1)}).over(NAMES)
    assert list(box.bounds) == ["v", "phi"]
    assert isinstance(box.coordinates[1], Angle)
    assert box.contains([[0.5, 6.2]]).all()
    where = ConditionRegion(text="v < phi", coordinates=("phi", "v")).over(NAMES)
    assert where.contains([[1, 2], [2, 1]]).tolist() == [True, False]


@pytest.mark.parametrize(
    ("bounds", "said"),
    [
        ({"v": (1, 1)}, message("coordinates.box", box="v from 1.0 to 1.0")),
        ({"v": (2, 1)}, message("coordinates.box", box="v from 2.0 to 1.0", names="v")),
        ({"v": (0, math.nan)}, message("reduced.not-finite")),
        ({"v": (0, "x")}, message("errors.unknown", kind="name", name="x")),
        ({"v": (0, 1, 2)}, message("others.too-many", number=2)),
        ({}, message("coordinates.box-lacks", given="", name="v")),
    ],
)
def test_bad_bounds_are_refused(bounds, said):
    with pytest.raises(ValidationError, match=said):
        Box(coordinates=("v",), bounds=bounds)


def test_a_box_must_bound_every_coordinate_and_no_other():
    with pytest.raises(ValidationError, match=message("coordinates.box-lacks", name="phi")):
        Box(coordinates=NAMES, bounds={"v": (0, 1)})
    with pytest.raises(ValidationError, match=message("coordinates.foreign-near", name="ph", near="phi")):
        Box(coordinates=NAMES, bounds={"v": (0, 1), "ph": (0, 1), "phi": (0, 1)})
    with pytest.raises(StateError, match=message("coordinates.box", box="[0.0, 1.0]")):
        Box.of(NAMES, [0, 1])


def test_a_box_needs_coordinates_which_state_the_angles_among_them():
    with pytest.raises(ValidationError, match=message("others.required", field="coordinates")):
        Box(bounds={"v": (0, 1), "phi": (-0.2, 0.2)})
    for names in ((), "phi", 5, ("v", "v"), ("v", 1)):
        with pytest.raises(ValidationError, match=message("coordinates.names")):
            Box(coordinates=names, bounds={"v": (0, 1)})


def test_a_bad_condition_is_refused_when_the_region_is_made():
    with pytest.raises(ValidationError, match=message("errors.unknown", kind="name", name="w")) as error:
        ConditionRegion(text="v > w", coordinates=NAMES)
    assert error.value.errors()[0]["loc"] == ("text",)
    with pytest.raises(ValidationError, match=message("errors.unknown", kind="name", name="v")):
        ConditionRegion(text="v > 1", coordinates=NAMES).over(("x", "y"))


def test_regions_are_frozen_values():
    region = ConditionRegion(text="v > 1", coordinates=NAMES)
    region.contains([[0, 0]])
    assert region == ConditionRegion(text="v > 1", coordinates=NAMES)
    with pytest.raises(ValidationError):
        region.text = "v > 2"
    with pytest.raises(TypeError, match=message("others.abstract")):
        Region(coordinates=NAMES)


def test_a_condition_at_values_of_parameters_is_one_on_the_other_names():
    """Powers, products and signs of negative numbers stay what they are, and angles stay angles."""
    names = ("v", Angle("phi"), "d", "k")
    condition = ConditionRegion(text="0.65 + (d - 0.26)/3 <= v - d**2*k and not phi > 2*-d", coordinates=names)
    states = np.random.default_rng(0).uniform([0, 0], [2, 6.2], (500, 2))
    for d, k in ((0.3, 2.0), (-0.7, -1.0), (-1e-30, 3e5)):
        there = condition.at({"d": d, "k": k, "r": 0.5})
        assert (there.coordinates.names, there.coordinates.angles.tolist()) == (("v", "phi"), [False, True])
        v, phi = states.T
        assert np.array_equal(there.contains(states), (0.65 + (d - 0.26) / 3 <= v - d**2 * k) & ~(phi > 2 * -d))
    assert there.at({"r": 0.5}) is there
    with pytest.raises(ValueError, match=message("reduced.no-finite-value", text="1 / 0.0")):
        ConditionRegion(text="v > 1/d", coordinates=("v", "d")).at({"d": 0.0})


@pytest.mark.parametrize("word", ["lambda", "in", "is", "if", "None", "async"])
def test_words_of_python_may_be_names(word):
    """The region of a condition with a word is that of the same condition with a plain name, also in symbols and at values."""
    text = "2*{0}**2 - x/3 < 0.2 and not ({0} > 0.3 or x <= -{0})"
    states = np.random.default_rng(7).uniform(-1, 1, (500, 2))
    region, plain = (ConditionRegion(text=text.format(name), coordinates=(name, "x")) for name in (word, "a"))
    expected = [2 * a * a - x / 3 < 0.2 and not (a > 0.3 or x <= -a) for a, x in states]
    assert region.contains(states).tolist() == plain.contains(states).tolist() == expected
    assert ConditionRegion(**region.model_dump(mode="json")) == region
    assert region.condition().subs(sp.Symbol(word, real=True), sp.Symbol("a", real=True)) == plain.condition()
    assert region.at({"x": 0.25}).contains(states[:, :1]).tolist() == plain.at({"x": 0.25}).contains(states[:, :1]).tolist()
    assert region.at({word: 0.25}).contains(states[:, 1:]).tolist() == [x > -0.225 and x > -0.25 for x in states[:, 1]]


def test_errors_count_columns_of_the_text_with_words_of_python():
    with pytest.raises(ValidationError, match=message("errors.unknown", kind="name", name="w", at="column 17")):
        ConditionRegion(text="lambda > 0 and (w > lambda)", coordinates=("lambda", "x"))
    with pytest.raises(ValidationError, match=message("reduced.not-a-condition", text="lambda + x")):
        ConditionRegion(text="lambda + x", coordinates=("lambda", "x"))
    with pytest.raises(ValidationError, match=message("reduced.operator-name", name="or")):
        ConditionRegion(text="or > 0", coordinates=("or", "x"))
