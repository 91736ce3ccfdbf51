"""The plugin circle_map: reference values M5."""

from fractions import Fraction

import numpy as np
import pytest
from nsmaps_circle_map import GapCircleMap, PlateauCircleMap
from piecewise_references import number, rows

import nsmaps

TABLE = rows("M5")
KINDS = [
    *((PlateauCircleMap(Omega=0.0, w=number(case["w"])), "Omega", case["windows"]) for case in TABLE["plateau"]),
    *((GapCircleMap(b=0.0, a=number(case["a"])), "b", case["windows"]) for case in TABLE["gap"]),
]
RETURNS = 2520  #: a multiple of all numbers up to 10


@pytest.mark.parametrize(
    ("system", "name", "windows"), KINDS, ids=[f"{type(kind[0]).__name__}-{n}" for n, kind in enumerate(KINDS)]
)
def test_all_windows(system, name, windows):
    """Orbits have the rotation number p/q 1e-12 from either end of its window, and 1e-12 beyond them not."""
    ends = np.array([[number(low), number(high)] for _, low, high in windows])
    inside = np.column_stack([ends[:, 0] + 1e-12, ends.mean(axis=1), ends[:, 1] - 1e-12])
    for (rotation, _, _), values in zip(windows, np.concatenate([inside, ends + np.array([-1e-12, 1e-12])], axis=1), strict=True):
        for k, value in enumerate(values):
            start = nsmaps.orbit(system.at(**{name: value % 1}), [0.1], 500).final
            turns = system.at(**{name: value % 1}).orbits([start], RETURNS).turns.sum() + RETURNS * np.floor(value)
            assert (turns == RETURNS * Fraction(rotation)) == (k < 3), (rotation, value)
