"""What every result of a study has, and for type checkers the fields of all sections."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

from nsmaps.arrays import brief
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
    from nsmaps.study.sections import fields

    class Kept(
        fields.SurfacesFields,
        fields.SlicesFields,
        fields.DiagonalFields,
        fields.CompositeFields,
        fields.PartitionFields,
        fields.ParametricFields,
        fields.OrbitsFields,
        fields.BifurcationFields,
        fields.BranchesFields,
        fields.StabilityFields,
        fields.ChartFields,
        fields.LyapunovFields,
        fields.BasinsFields,
        fields.GlobalContinuationFields,
        fields.ManifoldsFields,
        fields.ObservablesFields,
        fields.OptimumFields,
        fields.NoiseFields,
        fields.DomainsFields,
        fields.AuxiliaryMapFields,
        fields.ExitTimesFields,
        fields.MorseFields,
        fields.SecondIterateFields,
    ):
        """The fields that sections add to a result."""
else:
    Kept = object  #: a result has the fields of the sections that are registered


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
class Run(Kept):
    """The fields of every result, and properties that follow from those of its sections."""

    study: "Study"
    system: "System"
    verdicts: tuple[Verdict, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)  #: seconds, by step
    versions: dict[str, str] = field(default_factory=dict)
    finished: bool = False  #: True if all steps of the study were computed
    undrawn: dict[str, str] = field(default_factory=dict)  #: the reason why a figure could not be drawn, by its name

    kept: ClassVar[tuple[str, ...]] = ()  #: the fields of sections that are stored
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
        named = name in self.study.families
        return Binding(self.study, self.system).family(name) if named else WordFamily(name=name, words=(name,))

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

        parts = {name: getattr(self, name) for name in self.kept}
        about = {"study": self.study.name, "title": self.study.title, "system": self.study.system}
        return tree(parts, self.system.coordinates, **about, **self.system.parameters)


@lru_cache(maxsize=8)
def _mesh(*of: Any) -> "Mesh":
    from nsmaps.exact.surfaces.mesh import mesh

    return mesh(*of)
