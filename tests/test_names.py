"""Arguments of public functions and methods: one name for one meaning, of one kind, in one order."""

import inspect
from collections import defaultdict
from collections.abc import Iterator
from types import FunctionType
from typing import Any, get_args

from pydantic import BaseModel

import nsmaps
from nsmaps.study.study import Study

ROOMS = ("auxiliary", "bench", "cells", "dynamics", "estimation", "exact", "proof", "reduced", "symbolic", "testing")
#: the order of arguments that functions share, with others of their own between them
ORDER = (
    *("system", "parameter", "axes", "orbit", "point", "value", "values", "bounds", "box", "starts", "start", "period"),
    *("n_returns", "transient", "max_returns", "direction", "tolerance", "rng", "parallel", "progress"),
)
LAST = ("rng", "parallel", "progress")  #: after all other arguments
#: a name that no argument has -> the one for its meaning
OTHERS = {
    **dict.fromkeys(("map", "return_map", "model"), "system"),
    **dict.fromkeys(("plane", "grids"), "axes"),
    **dict.fromkeys(("state", "initial"), "start"),
    **dict.fromkeys(("x0", "first_guess"), "guess"),
    **dict.fromkeys(("window", "domain"), "box"),
    **dict.fromkeys(("limits", "low", "high"), "bounds"),
    **dict.fromkeys(("seed", "random"), "rng"),
    **dict.fromkeys(("tol", "near", "eps"), "tolerance"),
    **dict.fromkeys(("callback", "report"), "progress"),
}
#: names of whole numbers that are no counts
NUMBERS = {"transient", "period", "depth", "degree", "record", "component", "attractor", "first", "stop", "refine", "rng"}
#: keys of studies that are whole numbers: of an axis, of what is kept of an orbit, of an update, of a grid of cells
KEYS = NUMBERS | {"points", "track", "update", "side", "min_returns"}
#: names of two kinds in different functions, and why
KINDS = {
    "n_returns": "a count; of a segment of a record the mean",
    "transient": "a number of returns; of a record a time",
}


def functions() -> dict[str, FunctionType]:
    """The public functions by their names, and the public methods of public classes."""
    found = {}
    for room in (nsmaps, *(getattr(nsmaps, room) for room in ROOMS)):
        public = {name: getattr(room, name) for name in dir(room) if not name.startswith("_")}
        found |= {name: each for name, each in public.items() if isinstance(each, FunctionType)}
        for name, each in public.items():
            methods = vars(each).items() if isinstance(each, type) else ()
            found |= {f"{name}.{key}": one for key, one in methods if isinstance(one, FunctionType) and key[0] != "_"}
    return found


FUNCTIONS = functions()


def arguments(function: FunctionType) -> Iterator[tuple[str, str]]:
    """The names of arguments, each with its kind: array, choice, count, float, text, flag, or another."""
    for each in inspect.signature(function).parameters.values():
        if each.name != "self":
            yield each.name, kind_of(str(each.annotation).replace("typing.", ""))


def kind_of(annotation: str) -> str:
    """The kind of an argument of some type, without regard to None."""
    plain = annotation.removeprefix("<class '").removesuffix("'>").removesuffix(" | None")
    known = {"int": "count", "float": "number", "str": "text", "bool": "flag"}
    if "ArrayLike" in plain:
        return "array"
    return "choice" if "Literal" in plain else known.get(plain, "other")


def in_order(names: list[str]) -> bool:
    """Whether names that are shared are in their order, and the last ones at the end."""
    shared = [name for name in names if name in ORDER]
    ends = [name for name in names if name in LAST]
    return shared == sorted(shared, key=ORDER.index) and names[len(names) - len(ends) :] == ends


def test_all_public_functions_are_looked_at() -> None:
    assert len(FUNCTIONS) > 150
    assert {"orbit", "estimate", "ImpactSystem.trajectory", "ReturnMap.orbits", "morse_sets"} <= set(FUNCTIONS)


def test_a_meaning_has_one_name() -> None:
    given = {function: [name for name, _ in arguments(each)] for function, each in FUNCTIONS.items()}
    assert {
        f"{function}: {name}, not {OTHERS[name]}" for function, names in given.items() for name in names if name in OTHERS
    } == set()


def test_a_count_begins_with_n_or_max() -> None:
    """`starts` are states, and never their number."""
    counts = {f"{function}: {name}" for function, each in FUNCTIONS.items() for name, kind in arguments(each) if kind == "count"}
    wrong = {each for each in counts if not each.split(": ")[1].startswith(("n_", "max_")) and each.split(": ")[1] not in NUMBERS}
    assert len(counts) > 50
    assert wrong == set()


def keys(model: type[BaseModel]) -> Iterator[tuple[str, Any]]:
    """The keys of a section of a study and of its parts, with their types."""
    for name, field in model.model_fields.items():
        yield name, field.annotation
        inner = [field.annotation]
        while inner:
            each = inner.pop()
            inner += get_args(each)
            if isinstance(each, type) and issubclass(each, BaseModel):
                yield from keys(each)


def test_counts_of_studies_begin_with_n_or_max() -> None:
    found = [(section, name, kind) for section, model in Study.kinds().items() for name, kind in keys(model)]
    counts = {f"{section}: {name}" for section, name, kind in found if int in (kind, *get_args(kind))}
    assert len(counts) > 40
    assert {
        each for each in counts if not each.split(": ")[1].startswith(("n_", "max_")) and each.split(": ")[1] not in KEYS
    } == set()


def test_a_name_has_one_kind() -> None:
    kinds: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for function, each in FUNCTIONS.items():
        for name, kind in arguments(each) if "." not in function else ():
            kinds[name][kind].append(function)
    several: dict[str, Any] = {name: dict(found) for name, found in kinds.items() if len(set(found) - {"other"}) > 1}
    assert {name: found for name, found in several.items() if name not in KINDS} == {}
    assert set(several) == set(KINDS)


def test_arguments_have_one_order() -> None:
    assert in_order(["system", "starts", "own", "n_returns", "rng", "progress"])
    assert not in_order(["system", "n_returns", "starts"])
    assert not in_order(["system", "rng", "own"])
    given = {function: [name for name, _ in arguments(each)] for function, each in FUNCTIONS.items() if "." not in function}
    given = {function: [name for name in names if name != "how"] for function, names in given.items()}
    assert {function: names for function, names in given.items() if not in_order(names)} == {}
