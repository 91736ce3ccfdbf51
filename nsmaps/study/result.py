"""The result of a study."""

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, field, fields, make_dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from nsmaps.arrays import brief
from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.study.sections import SECTIONS
from nsmaps.study.sections.base import Verdict
from nsmaps.study.sections.maps.named import map_title
from nsmaps.study.sections.maps.surfaces import bind_family

if TYPE_CHECKING:
    from xarray import DataTree

    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.exact.returnmap import ReturnMap
    from nsmaps.exact.surfaces.family import ReturnFamily
    from nsmaps.exact.surfaces.mesh import Mesh, Part
    from nsmaps.exact.systems.parameters import System
    from nsmaps.study.sections import Kept
    from nsmaps.study.study import Study
else:
    Kept = object  #: for type checkers, the fields that sections add to a result


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class _Run(Kept):
    """The fields of every result, and properties that follow from those of its sections."""

    study: "Study"
    system: "System"
    verdicts: tuple[Verdict, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)  #: seconds, by step
    versions: dict[str, str] = field(default_factory=dict)
    finished: bool = False  #: True if all steps of the study were computed
    undrawn: dict[str, str] = field(default_factory=dict)  #: the reason why a figure could not be drawn, by its name

    __repr__ = brief

    @property
    def domain(self) -> "AttractingDomain | None":
        """The first of the domains."""
        return next(iter(self.domains.values()), None)

    @property
    def reduced(self) -> "ReturnMap | None":
        """The reduced map, of pieces or of strips; None without one."""
        return self.accurate.map(self.system) if self.accurate else self.composite

    @property
    def holds(self) -> bool:
        """True if every required verdict is confirmed."""
        return all(verdict.holds for verdict in self.verdicts if verdict.required)

    def map_title(self, of: str) -> str:
        """What a map of the study is called: `exact map`, `composite map`, `parametric map`, `fitted map R1`."""
        return map_title(self.study, self.system, of)

    def family(self, name: str) -> "ReturnFamily":
        """A family of the study, or one of a partition, which is named by its word."""
        families = self.study.families
        return bind_family(name, families[name], self) if name in families else WordFamily(name=name, words=(name,))

    def mesh(self, family: str, part: "Part | None" = None) -> "Mesh":
        """The return surface of a family as triangles up to its edges: computed when first asked for, and remembered.

        Further arguments and errors as `nsmaps.exact.surfaces.mesh.mesh`.
        """
        return _mesh(self.system, self.surfaces[family], self.family(family), part)

    def to_xarray(self) -> "DataTree":
        """Every array as an xarray tree: returns, surfaces/FAMILY, orbits/I/exact, basins, branches/NAME/I and so on.

        A slash in a name is written as a bar. Raises NsmapsError without xarray.
        """
        from nsmaps.datasets import tree

        parts = {name: getattr(self, name) for name in KEPT}
        about = {"study": self.study.name, "title": self.study.title, "system": self.study.system}
        return tree(parts, self.system.coordinates, **about, **self.system.parameters)


@lru_cache(maxsize=8)
def _mesh(*of: Any) -> "Mesh":
    from nsmaps.exact.surfaces.mesh import mesh

    return mesh(*of)


def _fields() -> Iterator[tuple[str, Any, Any]]:
    """The fields that the sections add to a result: name, type, default."""
    for section in SECTIONS:
        for each in fields(section.stored):
            by_factory = each.default_factory is not MISSING
            yield each.name, each.type, field(default_factory=each.default_factory) if by_factory else field(default=each.default)


KEPT = tuple(each.name for section in SECTIONS if section.again is None for each in fields(section.stored))
_TEXT = "The results of all sections of a study; fields of sections that the study does not name are empty or None."
if TYPE_CHECKING:
    StudyResult = _Run
else:
    options = {"frozen": True, "slots": True, "eq": False, "repr": False}
    StudyResult = make_dataclass("StudyResult", _fields(), bases=(_Run,), namespace={"__doc__": _TEXT}, **options)
    StudyResult.__module__ = __name__
