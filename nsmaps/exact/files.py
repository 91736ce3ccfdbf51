"""Modules that are files: loaded under a name of their own, here and in every process that is sent what they define."""

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from inspect import getsourcefile, getsourcelines
from operator import attrgetter
from traceback import walk_stack
from typing import Any

from nsmaps.errors import SystemDefinitionError

REFUSED: dict[str, dict[type, SystemDefinitionError]] = {}  #: of each module that is a file, its classes that are no systems


def run_file(name: str, file: str) -> None:
    """Run a .py file as a module that can be imported again by its name, or leave no trace of it.

    A class of it that is refused is kept in `REFUSED`, so that its other classes can be used.
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
    """The file and line that a module is at, while it defines a class."""
    lines = (f"{frame.f_code.co_filename}:{line}" for frame, line in walk_stack(None) if frame.f_globals["__name__"] == module)
    return next(lines, module)


def place_of(cls: type, formula: str) -> str:
    """` (FILE:LINE)` of where a formula of a class is written, with the base that it is inherited from, as far as can be told."""
    owner = next(base for base in cls.__mro__ if formula in vars(base))
    told = [] if owner is cls else [f"inherited from {owner.__name__}"]
    try:
        function = vars(owner)[formula]
        told.append(f"{getsourcefile(function)}:{getsourcelines(function)[1]}")
    except (OSError, TypeError):
        pass
    return f" ({', '.join(told)})" if told else ""


def received(module: str, file: str | None, qualname: str, values: dict[str, Any]) -> Any:
    """An object of a class by its module, in a process where that may not be imported yet, nor be found without its file."""
    if module not in sys.modules:
        try:
            import_module(module)
        except ModuleNotFoundError:
            if file is None:
                raise
            run_file(module, file)
    return attrgetter(qualname)(sys.modules[module])(**values)
