"""Boxes of states are taken in one way: by name, as a `Box`, or as an array; anything else is refused with a reason."""

import numpy as np
import pytest

import nsmaps
from nsmaps.coordinates import as_box

NAMES = ("v", nsmaps.Angle("phi"))
ROWS = [[0.7, 1.0], [0.2, 1.14]]


@pytest.mark.parametrize(
    "box",
    [
        {"v": (0.7, 1.0), "phi": (0.2, 1.14)},
        {"phi": (0.2, 1.14), "v": (0.7, 1.0)},
        nsmaps.Box(coordinates=NAMES, bounds={"v": (0.7, 1.0), "phi": (0.2, 1.14)}),
        np.array(ROWS),
        ROWS,
    ],
    ids=["mapping", "mapping in another order", "Box", "array", "lists"],
)
def test_one_box_in_every_form_is_one_array(box: object) -> None:
    array = as_box(box, NAMES)  # type: ignore[arg-type]
    assert array.dtype == float
    assert array.tolist() == ROWS


def test_the_array_of_a_box_is_a_copy() -> None:
    given = np.array(ROWS)
    as_box(given, NAMES)[0, 0] = 9.0
    assert given.tolist() == ROWS


@pytest.mark.parametrize(
    ("box", "why"),
    [
        ({"v": (0.7, 1.0)}, "'phi' is missing; expected: bounds of each of v, phi"),
        ({"v": (0.7, 1.0), "phj": (0, 1)}, "'phj' is not a coordinate, did you mean 'phi'?"),
        ({"v": (0.7, 1.0), "phi": (1, 1)}, r"the box is \[\[0.7, 1.0\], \[1.0, 1.0\]\]; expected: finite ends"),
        ([[0.7, 1.0], [0.2, np.nan]], "expected: finite ends"),
        ([[0.7, 1.0], [0.2, np.inf]], "expected: finite ends"),
        ([[1.0, 0.7], [0.2, 1.14]], "low < high, for each of v, phi"),
        ([0.7, 1.0], "expected: finite ends"),
        ("v", "the box is 'v'; expected: finite ends"),
        (None, "expected: finite ends"),
    ],
)
def test_other_boxes_are_refused(box: object, why: str) -> None:
    with pytest.raises(nsmaps.NsmapsError, match=why):
        as_box(box, NAMES)  # type: ignore[arg-type]


def test_domains_and_covers_take_a_box_by_name() -> None:
    map = nsmaps.PolyMap.of_monomials(("x", "y"), {"x": {(1, 0): 0.5}, "y": {(0, 1): 0.25}}, [[-2, 2], [-2, 2]])
    by_name, rows = {"y": (-1, 1), "x": (-1.5, 1.5)}, [[-1.5, 1.5], [-1, 1]]
    first, second = (nsmaps.attracting_domain(map, box, updates=1).boxes for box in (by_name, rows))
    assert np.array_equal(first, second)
    first_cover, second_cover = (nsmaps.morse_sets(map, box, depth=2) for box in (by_name, rows))
    assert np.array_equal(first_cover.boxes, second_cover.boxes)
