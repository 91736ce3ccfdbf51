"""Classes by name: systems, regions, fits, families of returns and analyses, and quantifiers, installed or in a file.

A package registers a system in the entry-point group `nsmaps.systems`, other classes in the group of their `Kind`. A name is
found without importing anything; a class is imported when it is asked for. A package ships studies as YAML files in its folder
`studies/`; the study `studies/fp.yaml`, if its line `system:` names `vi_pair`, is called `vi_pair/fp`. It may offer a drawing of
its system, under the same name in the group `nsmaps.sketches`.
"""

import hashlib
import os
import re
import sys
import warnings
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from inspect import isabstract
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from nsmaps.errors import NsmapsError, SystemDefinitionError, UnknownSystemError, near_match
from nsmaps.errors.arguments import checked
from nsmaps.exact.systems.files import REFUSED, run_file

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes

    from nsmaps.exact.systems.parameters import System

SKETCHES = "nsmaps.sketches"


@dataclass(frozen=True, slots=True)
class Kind:
    """What is named: a class of systems, regions, fits, families of returns or analyses, or the function of a quantifier."""

    name: str  #: in messages
    base: str  #: the module below `nsmaps` and the class from which it inherits; "" of a function
    examples: str  #: what of nsmaps it may inherit from instead

    @property
    def form(self) -> str:
        """What code of this kind is: a function or a class."""
        return "class" if self.base else "function"

    @property
    def in_a_file(self) -> str:
        """How one in a file is named."""
        return f"path/to/mine.py:{'Class' if self.base else 'function'}"

    @property
    def group(self) -> str:
        """The group of its entry points."""
        return {"family": "nsmaps.families", "analysis": "nsmaps.analyses"}.get(self.name, f"nsmaps.{self.name}s")

    def checked(self, found: object, where: str) -> type[Any]:
        """The class; raises SystemDefinitionError unless it is of this kind and defines all that its base leaves open."""
        if self == QUANTIFIER:
            if not callable(found):
                raise SystemDefinitionError(f"{where} is not a {self.name}; expected: {self.examples}")
            return found  # type: ignore[return-value]
        module, base = self.base.split(":")
        wanted: type[Any] = getattr(import_module(f"nsmaps.{module}"), base)
        if not (isinstance(found, type) and issubclass(found, wanted)):
            raise SystemDefinitionError(f"{where} is not a {self.name}; expected: a class that inherits from {self.examples}")
        if self != SYSTEM and isabstract(found):
            missing = ", ".join(sorted(found.__abstractmethods__))  # type: ignore[attr-defined]
            raise SystemDefinitionError(f"{where} does not define {missing}; expected: all that nsmaps.{base} leaves open")
        return found


SYSTEM = Kind("system", "exact.systems.parameters:System", "nsmaps.ImpactSystem, nsmaps.HybridSystem or nsmaps.System")
REGION = Kind("region", "reduced.conditions.region:Region", "nsmaps.Region")
FIT = Kind("fit", "reduced.fit.polyfit:PolyFit", "nsmaps.PolyFit")
FAMILY = Kind("family", "exact.surfaces.family:ReturnFamily", "nsmaps.ReturnFamily")
ANALYSIS = Kind("analysis", "study.sections.base:Analysis", "nsmaps.Analysis")
QUANTIFIER = Kind("quantifier", "", "a function of the states of an attractor, shape (K, n), and of their map")


def system_names() -> list[str]:
    """The names of the installed systems in order, without importing any."""
    return class_names(SYSTEM)


def class_names(kind: Kind) -> list[str]:
    """The names of the installed classes of a kind in order, without importing any."""
    return sorted({entry.name for entry in _entries(kind.group)})


def systems() -> "dict[str, type[System]]":
    """Every installed system, name -> class.

    A package that fails to import is named in a warning and left out. Raises SystemDefinitionError when two packages
    give one name.
    """
    found = {}
    for name in system_names():
        entry = entry_of(name)
        try:
            found[name] = _imported(entry, SYSTEM)
        except SystemDefinitionError as error:
            warnings.warn(str(error), stacklevel=2)
    return found


def system_class(name: str) -> "type[System]":
    """The class of a system by its name, as `class_of`."""
    return class_of(SYSTEM, name)


def class_of(kind: Kind, name: str) -> type[Any]:
    """A class of a kind: an installed one by its name, that of a module, `package.module:Class`, or of a file, `mine.py:Class`.

    Raises UnknownSystemError for a name that is not there, SystemDefinitionError when its package fails to import, when two
    packages give this name, or for a class of another kind.
    """
    place, _, attribute = name.rpartition(":")
    if is_file(name):
        return _from_file(place, attribute, kind)
    return _from_module(place, attribute, kind) if place else _imported(entry_of(name, kind), kind)


@checked
def load_system(name: str, **parameters: Any) -> "System":
    """The system of this name with these parameters, validated.

    Errors as `system_class`, and ParameterError for a parameter that is unknown, missing or not accepted.

    Args:
        name: of an installed system, or `mine.py:Class` for a class in a file, which is executed.
        parameters: its fields by name; those with a default may be left out.

    Examples:
        >>> load_system("bouncing_ball", Gamma=1.2)
        BouncingBall(Gamma=1.2, r=0.5)
    """
    from nsmaps.exact.systems.parameters import with_parameters

    return with_parameters(system_class(name), parameters)


def sketch_of(name: str) -> "Callable[[Axes], Axes]":
    """What draws an installed system on axes: the function that a package offers under its name in the group `nsmaps.sketches`.

    Raises NsmapsError for a system of which there is no sketch, SystemDefinitionError when its package fails to import or two
    packages offer one.
    """
    found = [entry for entry in _entries(SKETCHES) if entry.name == name]
    if not found:
        known = ", ".join(sorted({entry.name for entry in _entries(SKETCHES)})) or "none"
        raise NsmapsError(f"no package offers a sketch of the system {name!r}; of these there is one: {known}")
    if len(found) > 1:
        owners = " and ".join(sorted(owner_of(entry) for entry in found))
        raise SystemDefinitionError(f"the sketch of {name!r} is given by {owners}; uninstall one of them")
    return _loaded(found[0])


def study_files(name: str) -> dict[str, Path]:
    """The studies of an installed system that its package ships, stem -> path, without importing the package."""
    return _study_files(entry_of(name))


def _study_files(entry: EntryPoint) -> dict[str, Path]:
    spec = find_spec(entry.module.partition(".")[0])
    places = (spec.submodule_search_locations or []) if spec else []
    named = re.compile(rf"^system:\s*['\"]?{re.escape(entry.name)}(?![\w-])", re.MULTILINE)
    files = [path for place in places for path in Path(place, "studies").glob("*.yaml")]
    files = [path for path in files if named.search(path.read_text(encoding="utf-8", errors="replace"))]
    return {path.stem: path for path in sorted(files)}


def study_names() -> list[str]:
    """Every study of every installed system, as `system/stem`, without importing any."""
    by_name: dict[str, list[EntryPoint]] = {}
    for entry in _entries():
        by_name.setdefault(entry.name, []).append(entry)
    clear = [entries[0] for _, entries in sorted(by_name.items()) if len(entries) == 1]
    return [f"{entry.name}/{stem}" for entry in clear for stem in _study_files(entry)]


def entry_of(name: str, kind: Kind = SYSTEM) -> EntryPoint:
    """The one entry point of this name; errors as `class_of`."""
    found = [entry for entry in _entries(kind.group) if entry.name == name]
    if not found:
        known = class_names(kind)
        raise UnknownSystemError(
            f"no {kind.name} {name!r} is installed{near_match(name, known)}; installed: {', '.join(known) or 'none'}; "
            f"or a {kind.form} in a file, as {kind.in_a_file}"
        )
    if len(found) > 1:
        owners = " and ".join(sorted(owner_of(entry) for entry in found))
        raise SystemDefinitionError(f"the {kind.name} {name!r} is given by {owners}; uninstall one of them")
    return found[0]


def owner_of(entry: EntryPoint) -> str:
    """The package that registered an entry point, with its version."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unnamed package"


def owners_of(name: str) -> str:
    """The packages that registered classes of any kind under a name, with their versions."""
    found = [
        owner_of(entry)
        for kind in (SYSTEM, REGION, FIT, FAMILY, ANALYSIS, QUANTIFIER)
        for entry in _entries(kind.group)
        if entry.name == name
    ]
    return ", ".join(dict.fromkeys(found))


def is_file(name: str) -> bool:
    """Whether the name means a class in a file: `path/to/mine.py:Class`."""
    return name.rpartition(":")[0].endswith(".py")


def is_installed(name: str) -> bool:
    """Whether the name can only mean a class that a package registered, or one of nsmaps, and nothing that anyone may write."""
    return ":" not in name or name.startswith("nsmaps:")


def _entries(group: str = SYSTEM.group) -> tuple[EntryPoint, ...]:
    """All entry points of a group; they are read anew when a folder of the path has changed."""
    return _registered(group, tuple((place, _changed(place)) for place in sys.path))


@lru_cache(maxsize=8)
def _registered(group: str, path: tuple[tuple[str, int], ...]) -> tuple[EntryPoint, ...]:
    return tuple(entry_points(group=group))


def _changed(place: str) -> int:
    """When the content of a folder of the path changed last, in nanoseconds; 0 for none."""
    try:
        return os.stat(place or ".").st_mtime_ns
    except OSError:
        return 0


def _imported(entry: EntryPoint, kind: Kind) -> type[Any]:
    """The entry point's class."""
    return _loaded(entry, lambda found: kind.checked(found, entry.value))


def _loaded(entry: EntryPoint, checked: "Callable[[Any], Any]" = lambda found: found) -> Any:
    """What an entry point leads to. An error of a third-party module at import is reported on one line."""
    try:
        return checked(entry.load())
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise SystemDefinitionError(f"plugin {entry.name!r} of {owner_of(entry)} failed to import: {reason}") from error


def _from_module(module: str, attribute: str, kind: Kind) -> type[Any]:
    """The class of a module that can be imported."""
    try:
        found = import_module(module)
    except Exception as error:
        raise SystemDefinitionError(f"{module} failed to import: {type(error).__name__}: {error}") from error
    return kind.checked(_member(found, attribute, module, kind.form), f"{module}:{attribute}")


def _from_file(path: str, attribute: str, kind: Kind) -> type[Any]:
    """The class of a file. Its module's name holds a hash of the file, so an edited file is a new module."""
    file = Path(os.path.expanduser(path)).resolve()
    if not os.path.isfile(file):
        raise UnknownSystemError(f"no file {path!r} to load {attribute!r} from; expected: {kind.in_a_file}")
    name = f"{file.stem}_{hashlib.sha256(str(file).encode() + file.read_bytes()).hexdigest()[:12]}"
    if name not in sys.modules:
        try:
            run_file(name, str(file))
        except Exception as error:
            raise SystemDefinitionError(f"{path} failed to import: {type(error).__name__}: {error}") from error
    found = kind.checked(_member(sys.modules[name], attribute, path, kind.form), f"{path}:{attribute}")
    if found in REFUSED[name]:
        raise SystemDefinitionError(f"{path}:{attribute} is not a system: {REFUSED[name][found]}")
    return found


def _member(module: ModuleType, attribute: str, place: str, form: str) -> object:
    """What a module has under a name."""
    if not hasattr(module, attribute):
        raise UnknownSystemError(f"{place} has no {form} {attribute!r}{near_match(attribute, dir(module))}")
    return getattr(module, attribute)
