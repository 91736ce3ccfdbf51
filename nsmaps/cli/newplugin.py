"""A project for a new system: class, study, test and pyproject, from the templates in `nsmaps/templates`."""

from importlib.resources import files
from keyword import iskeyword
from pathlib import Path
from re import fullmatch
from string import Template
from typing import Literal

from nsmaps.errors import NsmapsError
from nsmaps.plugins import system_names

#: Where each template goes, under the folder of the project.
FILES = {
    "pyproject.toml.txt": "pyproject.toml",
    "README.md.txt": "README.md",
    "package/__init__.py.txt": "nsmaps_$name/__init__.py",
    "package/system.py.txt": "nsmaps_$name/system.py",
    "package/studies/first.yaml.txt": "nsmaps_$name/studies/first.yaml",
    "tests/test_name.py.txt": "tests/test_$name.py",
}
#: The templates of other kinds that differ from those of impact systems are in a folder of their own.
OWN = ("package/system.py.txt", "package/studies/first.yaml.txt", "tests/test_name.py.txt")
Kind = Literal["impacts", "hybrid", "map"]
KINDS: dict[Kind, tuple[str, str]] = {
    "impacts": ("An impact system", "a ball on a shaken table"),
    "hybrid": ("A system with modes", "an oscillator with an elastic stop"),
    "map": ("A map in pieces", "the normal form of a border collision"),
}


def new_plugin(name: str, into: Path | str = ".", kind: Kind = "impacts") -> Path:
    """Write a project for a system of this name to the folder `into`/`name`, which is returned.

    It can be installed without changes, and its tests pass. Its class is an `ImpactSystem`, of the kind `hybrid` a
    `HybridSystem`, of the kind `map` a `PiecewiseMap`.

    Raises:
        NsmapsError: the name is not a valid system name or is in use, the folder exists, or there is no such kind.
    """
    if kind not in KINDS:
        raise NsmapsError(f"the kind is {kind!r}; expected: {', '.join(KINDS)}")
    if not fullmatch("[a-z][a-z0-9_]*", name) or iskeyword(name):
        raise NsmapsError(
            f"the name {name!r} is not a valid system name; expected: small letters, digits and _, as in bouncing_ball"
        )
    if name in system_names():
        raise NsmapsError(f"a system {name!r} is installed already; expected: another name")
    folder = Path(into, name)
    if folder.exists():
        raise NsmapsError(f"{folder} is there already and is not overwritten; expected: another name, or another folder")
    what, example = KINDS[kind]
    values = {"name": name, "cls": "".join(part.capitalize() for part in name.split("_")), "kind": what, "example": example}
    for source, target in FILES.items():
        file = folder / Template(target).substitute(values)
        file.parent.mkdir(parents=True, exist_ok=True)
        folder_of = f"templates/{kind}" if kind != "impacts" and source in OWN else "templates"
        text = (files("nsmaps") / folder_of / source).read_text(encoding="utf-8")
        file.write_text(Template(text).substitute(values), encoding="utf-8")
    return folder
