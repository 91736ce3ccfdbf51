"""Digests of functions: of their code, of all that they call, and of the constants to which it refers."""

import sys
from collections.abc import Iterator
from enum import EnumType
from functools import lru_cache
from hashlib import sha256
from inspect import get_annotations
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np

from nsmaps.exact.compiling import internals

Dispatcher = type(numba.njit(lambda: None)) if internals.absent else internals.Dispatcher  #: of compiled functions
FOREIGN = ("numpy", "numba", "llvmlite", "sympy", "mpmath", "scipy", "pydantic")  #: packages that their versions identify


def code_of(*functions: Any) -> str:
    """A digest of functions and of all functions that they call, with the values of the constants to which their code refers."""
    texts: dict[int, str] = {}
    waiting = list(functions)
    while waiting:
        function = waiting.pop()
        if id(function) not in texts:
            texts[id(function)], called = _description(function)
            waiting += called
    return sha256("\0".join(texts.values()).encode()).hexdigest()


@lru_cache(maxsize=4)
def code_of_module(module: ModuleType) -> str:
    """A digest of all code in the file of a module: functions, classes and constants, but no comments."""
    code = module.__spec__.loader.get_code(module.__name__)  # type: ignore[union-attr]
    return sha256("\0".join(_texts(code)).encode()).hexdigest()


@lru_cache(maxsize=4096)
def _description(function: Any) -> tuple[str, tuple[Any, ...]]:
    """The text of one function's code, options and constants, and the functions to which it refers."""
    plain, options = (function.py_func, function.targetoptions) if isinstance(function, Dispatcher) else (function, {})
    cells = [cell.cell_contents for cell in plain.__closure__ or ()]
    names = [*_names(plain.__code__)]
    referred = {name: plain.__globals__[name] for name in names if name in plain.__globals__}
    for module in [value for value in referred.values() if isinstance(value, ModuleType) and _is_own_package(value.__name__)]:
        referred |= {f"{module.__name__}.{name}": getattr(module, name) for name in names if hasattr(module, name)}
    values = [*referred.values(), *cells, *(plain.__defaults__ or ())]
    kind = "" if internals.absent or not isinstance(function, Dispatcher) else function._compiler.pipeline_class.__name__
    options = [kind, *sorted(options.items())]
    texts = [plain.__qualname__, repr(options), *_texts(plain.__code__), *referred, *map(_text_of, values)]
    return "\1".join(texts), tuple(value for value in values if _is_ours(value))


def _names(code: CodeType) -> Iterator[str]:
    """The names that code and the code nested in it look up, in order."""
    yield from code.co_names
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield from _names(value)


def _texts(code: CodeType) -> Iterator[str]:
    """The texts that identify code: instructions, names and constants."""
    yield repr((code.co_code, code.co_names, code.co_varnames, code.co_freevars))
    for value in code.co_consts:
        yield from _texts(value) if isinstance(value, CodeType) else (_text_of(value),)


def _is_ours(value: Any) -> bool:
    """True if a value is a function whose code enters the digest too."""
    return isinstance(value, Dispatcher) or (isinstance(value, FunctionType) and _is_own_package(value.__module__ or ""))


def _is_own_package(module: str) -> bool:
    """True if a module is of nsmaps or of its user, whose code may change while versions stay the same."""
    package, *_ = module.split(".")
    return package not in {*FOREIGN, *sys.stdlib_module_names} - {"__main__"}


def _text_of(value: Any) -> str:
    """A text of a value that is the same in every process and differs between constants."""
    match value:
        case None | bool() | int() | float() | complex() | str() | bytes():
            return repr(value)
        case tuple() | list():
            return f"{type(value).__name__}{getattr(value, '_fields', '')}({', '.join(map(_text_of, value))})"
        case frozenset() | set():
            return f"set({', '.join(sorted(map(_text_of, value)))})"
        case np.ndarray():
            return f"array({value.dtype}, {value.shape}, {sha256(np.ascontiguousarray(value).tobytes()).hexdigest()})"
        case np.generic():
            return f"{value.dtype}({value.item()!r})"
        case ModuleType():
            return value.__name__
        case EnumType():
            members: Any = value.__members__
            return f"{value.__name__}({', '.join(f'{name}={member.value!r}' for name, member in members.items())})"
        case type():
            return f"{value.__module__}.{value.__qualname__}({list(get_annotations(value))})"
    return f"{type(value).__module__}.{type(value).__qualname__}"
