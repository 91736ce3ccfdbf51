"""What is used of numba beside its public names, in one place.

A numba that lacks any of it compiles all functions by `numba.njit` alone: more slowly, to the same results.
"""

from importlib import import_module
from typing import Any

absent: list[str] = []  #: what this numba does not have


class Absent:
    """Stands for a class or a function that this numba does not have."""


def _name(module: str, name: str) -> Any:
    """A name of a module of numba's core, or `Absent`."""
    try:
        return getattr(import_module(f"numba.core.{module}"), name)
    except (ImportError, AttributeError):
        absent.append(f"numba.core.{module}.{name}")
        return Absent


Cache = _name("caching", "_Cache")
Library = _name("codegen", "JITCodeLibrary")
Compiler, CompileResult = (_name("compiler", name) for name in ("Compiler", "CompileResult"))
FunctionCompiler = _name("dispatcher", "_FunctionCompiler")
lookup_environment = _name("environment", "lookup_environment")
Dispatcher = _name("registry", "CPUDispatcher")
rtsys = _name("runtime", "rtsys")
dumps = _name("serialize", "dumps")
AttributeTemplate = _name("typing.templates", "AttributeTemplate")
typed = [_name("typed_passes", name) for name in ("InlineOverloads", "NopythonRewrites")]
untyped = [_name("untyped_passes", name) for name in ("InlineClosureLikes", "InlineInlinables", "LiteralUnroll", "WithLifting")]
#: passes for what parts do not contain: overloads to be inlined, expressions of arrays, closures, loops over types
UNUSED = (*typed, *untyped)
