"""Public names of a package, imported from their modules when they are first used."""

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from nsmaps.errors import near_match

Face = tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]


def public_names(package: str, file: str) -> Face:
    """`__getattr__`, `__dir__` and `__all__` of a package, from the stub beside its `__init__.py`, which type checkers read too.

    The stub has lines `from module import name as name`. A name from `nsmaps` itself is a room, and not in `__all__`.
    """
    homes = stated_names(Path(file).with_suffix(".pyi"))
    names = sorted(name for name, module in homes.items() if module != "nsmaps")

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}{near_match(name, list(homes))}")
        module = homes[name]
        return import_module(f"{module}.{name}") if module == "nsmaps" else getattr(import_module(module), name)

    return get, lambda: sorted(homes), names


def stated_names(stub: Path) -> dict[str, str]:
    """The module of each name that a stub imports."""
    imports = (node for node in ast.parse(stub.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom))
    return {alias.name: str(node.module) for node in imports for alias in node.names}


def __getattr__(name: str) -> str:
    """`__version__`, the version that is installed."""
    if name != "__version__":
        raise AttributeError(f"module 'nsmaps.lazy' has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("nsmaps")
    except PackageNotFoundError:  # a source tree on the path that is not installed
        return "0+unknown"
