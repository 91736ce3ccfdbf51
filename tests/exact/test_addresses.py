"""Named tuples that compiled code reads by their address have the fields that Python sees."""

from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from messages import message
from numba.core.errors import NumbaError

from nsmaps.exact.compiling.addresses import Address, by_address


@by_address
class Inside(NamedTuple):
    """A table within another."""

    rows: Any
    count: int


@by_address
class Table(NamedTuple):
    """All that a table may have."""

    rate: float
    here: bool
    matrices: Any
    pair: Any  #: of arrays
    empty: Any
    inside: Inside
    kinds: Any  #: of other sizes than a word
    flags: Any
    letters: Any


def table(rows: int = 3) -> Table:
    """One with rows of numbers that all differ."""
    numbers = np.arange(rows * 20.0).reshape(rows, 4, 5)
    kinds = np.arange(rows, dtype=np.int32)
    return Table(
        0.25,
        True,
        numbers,
        (numbers[0] + 100, kinds.astype(np.int64) + 7),
        (),
        Inside(numbers[1] + 200, 12),
        kinds,
        kinds > 1,
        (5, 6),
    )


@numba.njit
def first_of(t):
    return t.rate, t.here, t.pair[1][0], t.pair[0][1, 2], len(t.empty), t.inside.count, t.letters[1]


@numba.njit
def whole(t):
    total = 0.0
    for i in range(t.matrices.shape[0]):
        total += t.matrices[i].sum() + t.inside.rows[i, -1] + t.kinds[i] + t.flags[i] + t.pair[1][i]
    return total, t.matrices.size, t.matrices.strides, t.matrices[1:, 2].shape


def test_fields_are_those_of_the_tuple():
    t = table()
    assert isinstance(numba.typeof(t), Address)
    assert first_of(t) == (0.25, True, 7, 107.0, 0, 12, 6)
    total = t.matrices.sum() + t.inside.rows[:3, -1].sum() + t.kinds.sum() + t.flags.sum() + t.pair[1].sum()
    assert whole(t) == (total, 60, (160, 40, 8), (2, 5))
    assert whole(table(2))[1] == 40, "shapes are read at each call"


@numba.njit
def written(t, value):
    t.matrices[1, 2, 3] = value
    t.inside.rows[0, 0] += t.matrices[1, 2, 3]
    return t.inside.rows[0, 0]


def test_arrays_are_written_in_place():
    t = table()
    before = t.inside.rows[0, 0]
    assert written(t, -5.0) == t.inside.rows[0, 0] == before - 5.0
    assert t.matrices[1, 2, 3] == -5.0


def test_fields_of_another_kind_are_refused():
    t = table()
    with pytest.raises((TypeError, NumbaError), match=message("exact.field")):
        first_of(t._replace(matrices=t.matrices.T))
