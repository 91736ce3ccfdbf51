"""Modules that are files: loaded under a name of their own, here and in every process that is sent what they define."""

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from operator import attrgetter
from typing import Any


def run_file(name: str, file: str) -> None:
    """Run a .py file as a module that can be imported again by its name, or leave no trace of it."""
    spec = spec_from_file_location(name, file)
    assert spec is not None, "a .py file always has a spec"
    assert spec.loader is not None, "and a loader"
    module = sys.modules[name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise


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
