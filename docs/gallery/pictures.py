"""The list of all pictures of the project, and whether one is stale.

Every PNG and GIF holds a digest of what it was drawn from: the study, the code of the figure and of all modules of
`nsmaps.figures` that this imports, the code of the system, the options. A picture whose digest is another is
stale. The digest does not cover the code by which results are computed: for that the studies are run again.
"""

import ast
import inspect
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from PIL import Image
from ruamel.yaml import YAML

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FORMATS = ("png", "svg", "pdf")  #: of a figure of the gallery; others are PNG alone
DPI = 220
KEY = "nsmaps"  #: of the digest in a PNG
UNSEEN = ("figures", "expected_failures", "require", "title", "name")  #: of a study, in no picture
SHOWING = ("figures", "report", "cli", "bench", "exports", "explore", "live", "testing", "__main__.py")
COMPUTED = "exit_times"  #: the run that is no study's


@dataclass(frozen=True)
class Picture:
    """One file of the list."""

    file: Path  #: within the project, with its suffix
    study: str = ""  #: shipped, or a file of the folder `studies`, or `exit_times`
    figure: str = ""  #: or animation
    sheet: str = ""  #: the file that `nsmaps figures` writes, if not called as the figure
    letters: str = ""  #: of its panels, those that the figure has in the paper; a, b, c, ... if empty
    table: str = ""  #: of a page, from which a picture of measured times is drawn
    page: str = ""  #: whose Python blocks save it under its name
    formats: tuple[str, ...] = ("png",)
    options: tuple[tuple[str, Any], ...] = ()  #: of an animation

    @property
    def path(self) -> Path:
        """The file."""
        return ROOT / self.file

    @property
    def is_animated(self) -> bool:
        """Whether it moves."""
        return self.file.suffix == ".gif"

    @property
    def is_stale(self) -> bool:
        """Whether it is missing, or drawn from something else than what is there now."""
        return not self.path.exists() or stamp(self.path) != digest(self)


@cache
def listed() -> dict[str, list[dict[str, Any]]]:
    """The list as it is written."""
    return YAML(typ="safe").load((HERE / "figures.yaml").read_text(encoding="utf-8"))


def pictures() -> list[Picture]:
    """Every picture of the list."""
    every, here = listed(), HERE.relative_to(ROOT)
    drawn = [_figure(here / f"{one['file']}.png", one, FORMATS) for one in every["figures"]]
    films = [
        Picture(here / f"{one['file']}.gif", one["study"], one["name"], formats=("gif",), options=tuple(one["options"].items()))
        for one in every["animations"]
    ]
    pages = [_figure(Path(one["file"]), one) for one in every["pages"]]
    saved = [Picture(Path(one["file"]), figure=one["figure"], page=one["page"]) for one in every["saved"]]
    return [*drawn, *films, *pages, *saved, *(Picture(Path(one["file"]), table=one["table"]) for one in every["tables"])]


def _figure(file: Path, one: dict[str, Any], formats: tuple[str, ...] = ("png",)) -> Picture:
    """The picture of an entry that is a figure of a study."""
    return Picture(file, one["study"], one["figure"], one.get("sheet", one["figure"]), one.get("letters", ""), formats=formats)


def study_of(name: str) -> Path | str:
    """A study of the list as `nsmaps run` takes it."""
    own = HERE / "studies" / f"{name}.yaml"
    return own if own.is_file() else name


@cache
def loaded(name: str) -> Any:
    """A study of the list, read."""
    from nsmaps import load_study

    return load_study("vi_pair/fp" if name == COMPUTED else study_of(name))


def asked(study: Any) -> str:
    """What a study asks for, as far as a picture may show it."""
    content = study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    return json.dumps({key: value for key, value in content.items() if key not in UNSEEN}, sort_keys=True)


def digest(picture: Picture) -> str:
    """A hash of all that a picture is drawn from but for the results."""
    options = asdict(picture) | {"file": picture.file.as_posix(), "dpi": DPI}
    parts = [json.dumps(options, sort_keys=True, default=str), *(path.read_text(encoding="utf-8") for path in sources(picture))]
    if picture.table:
        from tables import text_of

        parts.append(text_of(picture.table))
    elif picture.page:
        from blocks import python_of

        parts.append("".join(python_of(ROOT / picture.page)))
    else:
        parts.append(asked(loaded(picture.study)))
    return sha256("\0".join(parts).encode()).hexdigest()[:32]


def sources(picture: Picture) -> list[Path]:
    """The files of code that draw a picture, in an order of their own."""
    if picture.table:
        drawn = {"bench": ["nsmaps.bench.plot"], "proved": ["nsmaps.figures.cells.proved"]}.get(picture.table, [])
        return [HERE / "tables.py", *imported(["nsmaps.figures.page", *drawn])]
    from nsmaps.plugins import sketch_of, system_class
    from nsmaps.study.study import CATALOGUE

    first = ["nsmaps.study.pictures.animate"] if picture.is_animated else [f"nsmaps.figures.{CATALOGUE[picture.figure].module}"]
    if picture.page:
        return imported([*first, "nsmaps.figures.page"])
    system = loaded(picture.study).system
    own = [Path(inspect.getsourcefile(system_class(system)))]
    if picture.figure == "sketch":
        own.append(Path(inspect.getsourcefile(sketch_of(system))))
    return [*imported([*first, "nsmaps.figures.page"]), *own, *([HERE / "computed.py"] if picture.study == COMPUTED else [])]


@cache
def computing(name: str) -> str:
    """A hash of the code by which a study is computed: of the package, apart from rooms that show, and of the system."""
    from nsmaps.plugins import system_class

    package, system = Path(find_spec("nsmaps").origin).parent, Path(inspect.getsourcefile(system_class(loaded(name).system)))
    files = [path for path in sorted(package.rglob("*.py")) if path.relative_to(package).parts[0] not in SHOWING]
    return sha256(b"\0".join(path.read_bytes() for path in [*files, system, HERE / "computed.py"])).hexdigest()


def imported(modules: Iterable[str]) -> list[Path]:
    """The files of modules of `nsmaps.figures` and of all modules there that they import."""
    found: dict[str, Path] = {}
    left = list(modules)
    while left:
        name = left.pop()
        if name not in found and (spec := find_spec(name)) and spec.origin:
            found[name] = Path(spec.origin)
            left += _imports(found[name])
    return [found[name] for name in sorted(found)]


@cache
def _imports(path: Path) -> tuple[str, ...]:
    """The modules of `nsmaps.figures` that a file imports anywhere."""
    found = list[str]()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            found.append(node.module or "")
        elif isinstance(node, ast.Import):
            found += [each.name for each in node.names]
    return tuple(name for name in found if name.startswith("nsmaps.figures."))


def stamp(path: Path) -> str:
    """The digest that a picture holds, empty without one."""
    with Image.open(path) as picture:
        found = picture.info.get(KEY) or picture.info.get("comment") or ""
    return found.decode() if isinstance(found, bytes) else str(found)
