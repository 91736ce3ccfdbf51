"""Modules that are files, loaded under a name of their own, here and in every process to which their objects are sent."""

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from inspect import getsourcefile, getsourcelines
from numbers import Real
from operator import attrgetter
from pickle import PicklingError
from traceback import walk_stack
from types import ModuleType
from typing import Any

from nsmaps.errors import ParameterError, SystemDefinitionError

REFUSED: dict[str, dict[type, SystemDefinitionError]] = {}  #: by module that is a file: its classes that cannot be systems


def run_file(name: str, file: str) -> None:
    """Run a .py file as a module that can be imported again by its name; if it fails, the module is removed.

    A class of it that is refused is recorded in `REFUSED`, so that its other classes can be used.
    """
    spec = spec_from_file_location(name, file)
    assert spec is not None, "a .py file always has a spec"
    assert spec.loader is not None, "and a loader"
    module = sys.modules[name] = module_from_spec(spec)
    REFUSED[name] = {}
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name], REFUSED[name]
        raise


def defined_at(module: str) -> str:
    """The file and line in a module at which a class is being defined."""
    lines = (f"{frame.f_code.co_filename}:{line}" for frame, line in walk_stack(None) if frame.f_globals["__name__"] == module)
    return next(lines, module)


def check_period(cls: type, period: Any, at: str = "") -> None:
    """Refuse a period that is a number and not positive: by SystemDefinitionError, or by ParameterError `at` parameters."""
    if getattr(period, "is_nonpositive", False) or (isinstance(period, Real) and not float(period) > 0):
        place = place_of(cls, "period")
        kind = ParameterError if at else SystemDefinitionError
        raise kind(f"{cls.__name__}.period is {float(period):g}{at}; expected: a positive number{place}")


def place_of(cls: type, formula: str) -> str:
    """` (FILE:LINE)` where a formula of a class is written, and the base from which it is inherited, if known."""
    owner = next(base for base in cls.__mro__ if formula in vars(base))
    parts = [] if owner is cls else [f"inherited from {owner.__name__}"]
    try:
        function = vars(owner)[formula]
        _, line = getsourcelines(function)
        parts.append(f"{getsourcefile(function)}:{line}")
    except (OSError, TypeError):
        pass
    return f" ({', '.join(parts)})" if parts else ""


class Transferable:
    """A model that other processes receive as its class, with the class's file, and its values."""

    def __reduce__(self) -> tuple[Any, ...]:
        cls = type(self)
        if "<locals>" in cls.__qualname__:
            raise PicklingError(f"{cls.__qualname__} is defined in a function; only classes of modules reach other processes")
        file = getattr(sys.modules.get(cls.__module__), "__file__", None)
        return receive, (cls.__module__, file, cls.__qualname__, dict(self))  # type: ignore[call-overload]


def receive(module: str, file: str | None, qualname: str, values: dict[str, Any]) -> Any:
    """An object of a class by its module, in a process that may not have imported the module and needs its file."""
    return attrgetter(qualname)(module_of(module, file))(**values)


def module_of(module: str, file: str | None) -> ModuleType:
    """A module by its name, in a process that may not have imported it and needs its file."""
    if module not in sys.modules:
        try:
            import_module(module)
        except ModuleNotFoundError:
            if file is None:
                raise
            run_file(module, file)
    return sys.modules[module]
