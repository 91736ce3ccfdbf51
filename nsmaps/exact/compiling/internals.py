"""What is used of numba beside its public names, in one place.

A numba that lacks any of it compiles all functions by `numba.njit` alone: more slowly, to the same results.
"""

from importlib import import_module
from typing import Any

absent: list[str] = []  #: what this numba does not have


class Absent:
    """Stands for a class or a function that this numba does not have."""


def _found(module: str, name: str) -> Any:
    """A name of a module of numba's core, or `Absent`."""
    try:
        return getattr(import_module(f"numba.core.{module}"), name)
    except (ImportError, AttributeError):
        absent.append(f"numba.core.{module}.{name}")
        return Absent


Cache = _found("caching", "_Cache")
Library = _found("codegen", "JITCodeLibrary")
Compiler, CompileResult, Flags = (_found("compiler", name) for name in ("Compiler", "CompileResult", "Flags"))
FunctionCompiler = _found("dispatcher", "_FunctionCompiler")
lookup_environment = _found("environment", "lookup_environment")
Dispatcher = _found("registry", "CPUDispatcher")
rtsys = _found("runtime", "rtsys")
dumps = _found("serialize", "dumps")
AttributeTemplate = _found("typing.templates", "AttributeTemplate")
typed = [_found("typed_passes", name) for name in ("InlineOverloads", "NopythonRewrites")]
untyped = [_found("untyped_passes", name) for name in ("InlineClosureLikes", "InlineInlinables", "LiteralUnroll", "WithLifting")]
#: passes for what parts do not contain: overloads to be inlined, expressions of arrays, closures, loops over types
UNUSED = (*typed, *untyped)
