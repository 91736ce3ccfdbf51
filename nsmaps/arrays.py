"""What is common to arrays everywhere: names of their types, and how results show theirs and are stored."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike as ArrayLike
else:
    from numpy import typing
    from typing_extensions import TypeAliasType

    ArrayLike = TypeAliasType("ArrayLike", typing.ArrayLike)  # a name that `help` does not unfold

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
FEW = 4  #: numbers of an array that are printed
Random = int | Sequence[int] | np.random.Generator | None  #: of arguments `rng`, as of `numpy.random.default_rng`


class Storable:
    """A class whose objects may be stored in files of runs, by their fields."""

    __slots__ = ()
    from_files: ClassVar[bool] = True  #: False where fields of a file could be evaluated, as texts by sympy


def entropy_of(rng: Random) -> int | Sequence[int]:
    """What seeds a `numpy.random.SeedSequence`: numbers as they are, four drawn from a generator, for None of the machine."""
    if isinstance(rng, np.random.Generator):
        return [int(number) for number in rng.integers(2**32, size=4)]
    return int(np.random.SeedSequence().entropy) if rng is None else rng  # type: ignore[arg-type]


def finite_rows(values: Floats) -> Bools:
    """The rows of an array (N, n), n > 0, that have no NaN or infinity, shape (N,): column by column, as rows are short.

    >>> finite_rows(np.array([[1.0, 2.0], [np.nan, 2.0]]))
    array([ True, False])
    """
    finite, *others = np.isfinite(values).T
    for other in others:
        finite = finite & other
    return finite


def brief(result: Any) -> str:
    """A dataclass by its class and fields, arrays of more than four numbers by their shape and type only: its `__repr__`.

    >>> from dataclasses import make_dataclass
    >>> brief(make_dataclass("Pair", ["states", "mean", "walls"])(np.zeros((3, 2)), np.array([0.1]), ("B", "T")))
    "Pair(states=<array (3, 2) float64>, mean=[0.1], walls=('B', 'T'))"
    """
    listed = ", ".join(f"{field.name}={_brief(getattr(result, field.name))}" for field in fields(result))
    return f"{type(result).__qualname__}({listed})"


def _brief(value: Any) -> str:
    if isinstance(value, np.ndarray):
        few = 0 < value.size <= FEW and value.dtype != object
        return np.array2string(value, precision=6, separator=", ") if few else f"<array {value.shape} {value.dtype}>"
    if is_dataclass(value):
        return repr(tuple(value)) if isinstance(value, Sequence) else f"<{type(value).__qualname__}>"
    if isinstance(value, tuple | list) and any(isinstance(item, np.ndarray) or is_dataclass(item) for item in value):
        return f"<{len(value)} of {type(value[0]).__qualname__}>"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key!r}: {_brief(item)}' for key, item in value.items())}}}"
    return repr(value)
