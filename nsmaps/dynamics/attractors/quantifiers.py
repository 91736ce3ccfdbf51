"""Quantifiers of attractors: numbers that functions of a user take from the states of each attractor."""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from operator import attrgetter
from pickle import PicklingError
from types import CodeType, FunctionType
from typing import Any

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.files import module_of
from nsmaps.results import ARRAY, Declaration, Result, array

Place = tuple[int, ...]
Function = Callable[[Floats, Any], ArrayLike]  #: of states (K, n) and their map
EXPECTED = "a function of states (K, n) and their map that returns a number, or an array of one shape for all attractors"


def quantifier_array(axes: str) -> Mapping[str, Declaration]:
    """The declaration of the quantifiers of a result by the axes of its attractors."""
    return array(f"{axes} ...", "quantifier of the attractor; NaN where there is none")


@dataclass(frozen=True, slots=True)
class Quantifier:
    """A function of the states of an attractor, under a name, which other processes receive as the name of the function."""

    name: str
    function: Function = field(compare=False)
    source: str  #: where the function is from, and its code, by which finished parts of a computation are recognised

    def __reduce__(self) -> tuple[Any, ...]:
        function = self.function
        if not isinstance(function, FunctionType):
            return Quantifier, (self.name, function, self.source)
        if "<" in function.__qualname__:
            raise PicklingError(f"the quantifier {self.name!r} is {function.__qualname__}, which is not a function of a module")
        file = getattr(sys.modules.get(function.__module__), "__file__", None)
        return _received, (self.name, function.__module__, file, function.__qualname__, self.source)

    def value(self, states: Floats, return_map: ReturnMap) -> Floats:
        """What the function returns; NsmapsError for what is not a number or an array of numbers, and for any error of it."""
        try:
            given = self.function(states, return_map)
            found = np.asarray(given)
        except Exception as error:
            text = f"the quantifier {self.name!r} raises {type(error).__name__}: {error}, at states of shape {states.shape}"
            raise NsmapsError(f"{text}; expected: {EXPECTED}") from error
        if found.dtype.kind not in "biuf":
            raise NsmapsError(f"the quantifier {self.name!r} returns {given!r:.80}; expected: {EXPECTED}")
        return found.astype(float)


def _received(name: str, module: str, file: str | None, qualname: str, source: str) -> Quantifier:
    return Quantifier(name, attrgetter(qualname)(module_of(module, file)), source)


def quantifiers_of(given: Mapping[str, Function] | None, result: type[Result], *parameters: str) -> tuple[Quantifier, ...]:
    """The quantifiers of a call by their names; NsmapsError for a name that the result has already, or what is not callable."""
    declared: Any = fields(result)  # type: ignore[arg-type]
    axes = {axis for each in declared if ARRAY in each.metadata for axis in each.metadata[ARRAY].axes}
    found = []
    for name, function in (given or {}).items():
        if not (isinstance(name, str) and name.isidentifier()):
            raise NsmapsError(f"a quantifier has the name {name!r}; expected: an identifier, such as 'energy'")
        if hasattr(result, name) or name in (*axes, *parameters, "unit"):
            raise NsmapsError(f"a quantifier has the name {name!r}, which {result.__name__} has already; expected: another name")
        if not callable(function):
            raise NsmapsError(f"the quantifier {name!r} is {function!r:.80}; expected: {EXPECTED}")
        found.append(Quantifier(name, function, _source(function)))
    return tuple(found)


def _source(function: Function) -> str:
    """The name of a function with its code, the same in every process; of another callable its text."""
    if not isinstance(function, FunctionType):
        return repr(function)
    code = function.__code__
    constants = [each for each in code.co_consts if not isinstance(each, CodeType)]
    return f"{function.__module__}.{function.__qualname__} {code.co_code.hex()} {code.co_names} {constants}"


def quantified(
    quantifiers: Sequence[Quantifier], shape: Place, sets: Iterable[tuple[Place, Floats, ReturnMap]]
) -> dict[str, Floats]:
    """The value of each quantifier at each place with an attractor, by name, shape (*shape, ...); NaN at other places.

    Args:
        quantifiers: from `quantifiers_of`.
        shape: of the places.
        sets: place, states (K, n) and map of every attractor.

    Raises:
        NsmapsError: a quantifier raises, or its values are not numbers of one shape.
    """
    attractors = list(sets) if quantifiers else []
    found = {}
    for each in quantifiers:
        values = {place: each.value(states, formulas) for place, states, formulas in attractors}
        shapes = list(dict.fromkeys(value.shape for value in values.values()))
        check_shapes(each.name, shapes)
        found[each.name] = np.full((*shape, *(shapes[0] if shapes else ())), np.nan)
        for place, value in values.items():
            found[each.name][place] = value
    return found


def check_shapes(name: str, shapes: list[Place]) -> None:
    """Refuse a quantifier whose values at different attractors have different shapes."""
    if len(shapes) > 1:
        text = f"the quantifier {name!r} returns arrays of the shapes {' and '.join(map(str, shapes))}"
        raise NsmapsError(f"{text}; expected: {EXPECTED}, filled up with NaN where there is less")
