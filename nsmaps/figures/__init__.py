"""Figures of results: one function, one figure, one Axes; nothing is shown or kept.

Each figure has a function of its name, `nsmaps.figures.cobweb(result, ax, ...) -> Axes`, for a page of your own. Importing this
package does not load matplotlib; drawing does.
"""

from importlib import import_module
from pkgutil import walk_packages
from typing import Any

from nsmaps.errors import near_match


def __getattr__(name: str) -> Any:
    """The function of a figure, imported when it is first used."""
    modules = {each.name.rpartition(".")[2]: each.name for each in walk_packages(__path__, "nsmaps.figures.") if not each.ispkg}
    found = getattr(import_module(modules[name]), name, None) if name in modules else None
    if found is None:
        raise AttributeError(f"module 'nsmaps.figures' has no attribute {name!r}{near_match(name, modules)}")
    return found
