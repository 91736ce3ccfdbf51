"""Arguments of public functions compared with their annotations: a wrong kind is an error of nsmaps, not one of Python inside.

Numbers, names, choices and ranges are compared before a call. Systems, arrays and objects are looked at where the call fails
with an error of Python, since functions have more to say of them: a `ReturnMap.require` or `as_starts` comes first.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cache, wraps
from inspect import Parameter, signature
from numbers import Integral
from types import NoneType, UnionType
from typing import Any, Literal, NamedTuple, ParamSpec, TypeVar, Union, get_args, get_origin

from nsmaps.errors import NsmapsError

P = ParamSpec("P")
R = TypeVar("R")
COUNTS = ("n_", "max_", "tolerance", "transient")  #: how names begin of what is not negative
SEED = "rng"  #: whose numbers are not negative either
WORDS = {int: "a whole number", float: "a number", str: "text", bool: "True or False", NoneType: "None"}


class Argument(NamedTuple):
    """An argument of a function."""

    name: str
    kind: Any  #: its annotation
    first: bool  #: whether it is compared before the call


def checked(call: Callable[P, R]) -> Callable[P, R]:
    """A function whose arguments are compared with their annotations; NsmapsError for one of another kind."""

    @wraps(call)
    def call_checked(*args: P.args, **kwargs: P.kwargs) -> R:
        return with_arguments(call, *args, **kwargs)

    return call_checked


def with_arguments(call: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
    """What a function returns, or NsmapsError for an argument of another kind than its annotation."""
    for each, value in _given(call, args, kwargs):
        if (each.first and not fits(value, each.kind)) or _is_below(each, value):
            raise NsmapsError(_fault(call, each, value))
    try:
        return call(*args, **kwargs)
    except NsmapsError:
        raise
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        for each, value in _given(call, args, kwargs):
            if not fits(value, each.kind):
                raise NsmapsError(_fault(call, each, value)) from None
        raise


def _is_below(argument: Argument, value: Any) -> bool:
    """Whether a count, a tolerance or a number that seeds is negative."""
    if argument.name == SEED:
        return any(isinstance(number, Integral) and number < 0 for number in (value if isinstance(value, Sequence) else (value,)))
    return argument.kind in (int, float) and argument.name.startswith(COUNTS) and value < 0


def fits(value: Any, kind: Any) -> bool:
    """Whether a value is of the kind of an annotation; True of annotations that are not looked at.

    >>> fits(3, int), fits(3.0, int), fits(float("nan"), float), fits([0, 1], tuple[float, float]), fits("up", Literal["down"])
    (True, False, False, True, False)
    """
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return any(fits(value, part) for part in parts)
    if origin is Literal:
        return any(value is part or (type(value) is type(part) and value == part) for part in parts)
    if origin is tuple:
        return _is_row(value, parts)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(each is None or fits(each, parts[1]) for each in value.values())
    if origin is Callable:
        return callable(value)
    if isinstance(origin, type) and issubclass(origin, Collection):
        return _is_list(value, origin, parts[0])
    return isinstance(value, origin) if isinstance(origin, type) else _is_plain(value, kind)


def _is_list(value: Any, origin: type[Collection[Any]], part: Any) -> bool:
    """Whether a value has parts of a kind; a text is one of texts."""
    if isinstance(value, str) or not isinstance(value, origin):
        return hasattr(value, "__array__") or (isinstance(value, str) and part is str)
    return all(fits(each, part) for each in value)


def _is_row(value: Any, parts: tuple[Any, ...]) -> bool:
    """Whether a value is a list of parts of these kinds."""
    if isinstance(value, str) or not (isinstance(value, Sequence) or bool(getattr(value, "ndim", 0))):
        return False
    several = parts[1:] == (...,)
    return (several or len(value) == len(parts)) and all(
        fits(each, kind) for each, kind in zip(value, parts[:1] * len(value) if several else parts, strict=True)
    )


def _is_plain(value: Any, kind: Any) -> bool:
    """Whether a value is of a class, a number, or what an array of numbers is made of."""
    if getattr(kind, "__name__", "") == "ArrayLike":
        return _is_array(value)
    if kind is int:
        return isinstance(value, Integral) and not isinstance(value, bool)
    if kind is float:
        return hasattr(value, "__float__") and not getattr(value, "ndim", 0) and float(value) == float(value)
    if kind is bool:
        return type(value).__name__ in ("bool", "bool_")
    if getattr(kind, "_is_protocol", False):
        return all(hasattr(value, name) for name in vars(kind) if name[0] != "_" or name == "__call__")
    return kind is Any or not isinstance(kind, type) or isinstance(value, kind)


def _is_array(value: Any) -> bool:
    """Whether a value is an array of one axis or more of numbers."""
    import numpy as np  # which programs load after they have set its threads

    try:
        return not isinstance(value, str) and None is not value and np.asarray(value, float).ndim > 0
    except (TypeError, ValueError):
        return False


@cache
def _arguments(call: Callable[..., Any]) -> dict[str, Argument]:
    """The arguments of a function that have an annotation, by name."""
    found = {}
    for each in signature(call).parameters.values():
        if each.kind not in (Parameter.VAR_KEYWORD, Parameter.VAR_POSITIONAL):
            found[each.name] = Argument(each.name, _resolved(each.annotation, call), _is_first(_resolved(each.annotation, call)))
    return found


def _resolved(annotation: Any, call: Callable[..., Any]) -> Any:
    """An annotation, of a text that it stands for where its names are known when the program runs, else Any."""
    try:
        return eval(annotation, call.__globals__) if isinstance(annotation, str) else annotation
    except NameError:
        return Any


def _is_first(kind: Any) -> bool:
    """Whether an annotation is made of numbers, texts and choices only."""
    if get_origin(kind) in (Union, UnionType, tuple):
        return all(_is_first(part) for part in get_args(kind))
    return kind in WORDS or kind is ... or get_origin(kind) is Literal


def _given(call: Callable[..., Any], args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> Iterator[tuple[Argument, Any]]:
    """The arguments of a call with their values; those that the function does not have are left to Python."""
    known = _arguments(call)
    yield from zip(known.values(), args, strict=False)
    yield from ((known[name], value) for name, value in kwargs.items() if name in known)


def _fault(call: Callable[..., Any], wrong: Argument, value: Any) -> str:
    """What is wrong with an argument, what is expected, and how the function is called."""
    order = [name for name, each in signature(call).parameters.items() if each.kind is Parameter.POSITIONAL_OR_KEYWORD]
    least = " of at least 0" if wrong.name.startswith(COUNTS) else ", numbers of at least 0" if wrong.name == SEED else ""
    return f"{wrong.name} is {value!r:.80}; expected: {described(wrong.kind)}{least}, as in {call.__name__}({', '.join(order)})"


def described(kind: Any) -> str:
    """What is expected, in words.

    >>> described(int | None), described(Mapping[str, tuple[float, float]]), described(Literal["up", "down"])
    ('a whole number or None', 'by name: a pair of numbers', "'up' or 'down'")
    """
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(described(part) for part in parts))
    if origin is Literal:
        return " or ".join(map(repr, parts))
    if origin is tuple:
        return "a pair of numbers" if parts == (float, float) else "a row of values"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"by name: {described(parts[1])}"
    if isinstance(origin, type) and issubclass(origin, Collection):
        return "a list"
    if origin is Callable:
        return "a function"
    name = getattr(kind, "__name__", "")
    return WORDS.get(kind) or ("an array of numbers" if name == "ArrayLike" else f"a {name or 'value'}")
