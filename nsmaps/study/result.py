"""The result of a study: the parts that its analyses computed, by name, and the verdicts on them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

from nsmaps.errors import near_match
from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.study.binding import Binding
from nsmaps.study.conclusions.titles import map_title

if TYPE_CHECKING:
    from xarray import DataTree

    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.exact.returnmap import ReturnMap
    from nsmaps.exact.surfaces.family import ReturnFamily
    from nsmaps.exact.surfaces.mesh import Mesh, Part
    from nsmaps.exact.systems.parameters import System
    from nsmaps.study.reading.head import Head as Study


@dataclass(frozen=True, slots=True)
class Verdict:
    """One claim about one map, whether it is confirmed, and the numbers on which this is based."""

    name: str  #: such as "partition: tolerance met"
    of: str  #: the map to which it applies, such as "fitted map R1" or "exact map"
    holds: bool
    required: bool
    text: str
    shows: str = ""  #: the meaning of a failure that the study expects


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StudyResult(Mapping[str, Any]):
    """The results of a study by name: of each analysis that was computed, `result["basins"]`.

    As an attribute, `result.basins`, a part that the study does not name is empty.
    """

    study: "Study"
    system: "System"
    parts: Mapping[str, Any] = field(default_factory=dict)  #: what the analyses computed, by name
    verdicts: tuple[Verdict, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)  #: seconds, by step
    versions: dict[str, str] = field(default_factory=dict)
    finished: bool = False  #: True if all steps of the study were computed
    undrawn: dict[str, str] = field(default_factory=dict)  #: the reason why a figure could not be drawn, by its name

    __eq__, __hash__ = object.__eq__, object.__hash__

    def __repr__(self) -> str:
        """The study and the names of the results."""
        return f"{type(self).__name__}({self.study.name}: {', '.join(self.parts)})"

    def __str__(self) -> str:
        """The result in words, and what the verdicts come to, as at the end of a run."""
        words = import_module("nsmaps.study.conclusions.headline"), import_module("nsmaps.study.conclusions.verdict")
        return " ".join(filter(None, (words[0].headline(self), words[1].conclusion(self)))) or repr(self)

    def _repr_html_(self) -> str:
        """The same in a notebook, with the names of the results."""
        title = escape(self.study.title or self.study.name)
        return f"<p><b>{title}</b></p><p>{escape(str(self))}</p><p>{', '.join(self.parts)}</p>"

    def __getitem__(self, name: str) -> Any:
        return self.parts[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.parts)

    def __len__(self) -> int:
        return len(self.parts)

    def __bool__(self) -> bool:
        """True also where nothing is computed yet."""
        return True

    def __getattr__(self, name: str) -> Any:
        """A part by its name; its value without the analysis where it was not computed."""
        if name.startswith("_"):
            raise AttributeError(name)
        if name in self.parts:
            return self.parts[name]
        known = self.study.parts_of_result()
        if name in known:
            return known[name]
        raise AttributeError(f"a study's result has no part {name!r}{near_match(name, known)}")

    def with_parts(self, parts: Mapping[str, Any]) -> "StudyResult":
        """The result with further parts."""
        return replace(self, parts={**self.parts, **parts})

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
        named = name in self.study.families
        return Binding(self.study, self.system).family(name) if named else WordFamily(name=name, words=(name,))

    def mesh(self, family: str, part: "Part | None" = None, flat: bool = False) -> "Mesh":
        """The return surface of a family as triangles up to its edges: computed when first asked for, and remembered.

        Further arguments and errors as `nsmaps.exact.surfaces.mesh.mesh`.
        """
        return _mesh(self.system, self.surfaces[family], self.family(family), part, flat)

    def to_xarray(self) -> "DataTree":
        """Every array as an xarray tree: returns, surfaces/FAMILY, orbits/I/exact, basins, branches/NAME/I and so on.

        A slash in a name is written as a bar. Raises NsmapsError without xarray.
        """
        from nsmaps.results import tree

        about = {"study": self.study.name, "title": self.study.title, "system": self.study.system}
        return tree(self.parts, **about, **self.system.parameters)


@lru_cache(maxsize=8)
def _mesh(*of: Any) -> "Mesh":
    from nsmaps.exact.surfaces.mesh import mesh

    return mesh(*of)
