"""What a study's run answers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from nsmaps.arrays import brief

if TYPE_CHECKING:
    from xarray import DataTree

    from nsmaps.auxiliary.cover import MorseCover, Trap
    from nsmaps.auxiliary.domain import AttractingDomain
    from nsmaps.auxiliary.iterate import SecondIterate
    from nsmaps.auxiliary.search import CycleSearch
    from nsmaps.auxiliary.transient import Transient
    from nsmaps.dynamics.basins import Basins, Boundary
    from nsmaps.dynamics.bifurcation import Bifurcation
    from nsmaps.dynamics.ending import Ending
    from nsmaps.dynamics.impactdiagram import ImpactDiagram
    from nsmaps.dynamics.lyapunov import LyapunovSweep
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.dynamics.residence import Residence
    from nsmaps.dynamics.returnmap import ReturnMap
    from nsmaps.dynamics.stability import EventCurve, StabilityDiagram
    from nsmaps.dynamics.trail import Branch
    from nsmaps.exact.data import HasDataset
    from nsmaps.exact.impacts import Floats, Returns
    from nsmaps.exact.slices import Slice
    from nsmaps.exact.surface import Surface
    from nsmaps.exact.system import ImpactSystem
    from nsmaps.exact.track import Track
    from nsmaps.reduced.accurate import AccurateResult
    from nsmaps.reduced.composite import CompositeMap, Coverage
    from nsmaps.reduced.deltas import NearDiagonals
    from nsmaps.reduced.diagonal import DiagonalRegion
    from nsmaps.reduced.misleads import Misleads
    from nsmaps.reduced.parametric import ParametricMap
    from nsmaps.reduced.partition import PartitionResult
    from nsmaps.reduced.polyfit import FitReport
    from nsmaps.reduced.speed import Speed
    from nsmaps.study.spec import Study


@dataclass(frozen=True, slots=True)
class Verdict:
    """One claim about one map, whether it holds, and the numbers it rests on."""

    name: str  #: such as "domain fitted: trapped"
    of: str  #: the map it speaks of, such as "fitted map R1" or "exact map"
    holds: bool
    required: bool
    text: str
    shows: str = ""  #: of one that fails as its study expects: what that shows


@dataclass(frozen=True, slots=True, eq=False)
class OrbitPair:
    """The orbits of one start: of the exact map and, if the study has one, of the composite map."""

    start: "Floats"  #: shape (n,)
    exact: "Orbit"
    composite: "Orbit | None"
    track: "Track | None" = None  #: the exact motion at and between its first impacts, if the study asks for it
    ends: "Ending | None" = None  #: what the exact map's orbit ends on; None where it has no image
    composite_ends: "Ending | None" = None


@dataclass(frozen=True, slots=True, eq=False)
class NoiseResult:
    """What noise of each of its sizes does."""

    sigma: tuple[float, ...]
    stays: "tuple[Residence, ...]"  #: one a size
    ended: tuple[dict[str, int], ...]  #: one a size: how many realisations ended, by outcome
    impacts: "tuple[ImpactDiagram, ...]" = ()  #: down without and with noise, up without and with noise


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StudyResult:
    """Everything a study named, as it was computed; what it did not name is None or empty."""

    __repr__ = brief

    study: "Study"
    system: "ImpactSystem"
    returns: "Returns | None" = None  #: the first returns of every state of the grid, of any word and outcome
    surfaces: "dict[str, Surface]" = field(default_factory=dict)
    slices: "tuple[Slice, ...]" = ()  #: first returns along one coordinate
    diagonal: "DiagonalRegion | None" = None
    orders: "tuple[tuple[str, FitReport], ...]" = ()  #: fits compared near the diagonals, table TableDeltaErr
    near: "tuple[NearDiagonals, ...]" = ()  #: at the study's own parameters, for `delta` and each of `deltas`
    composite: "CompositeMap | None" = None
    partition: "PartitionResult | None" = None  #: how the composite map was found, if the study has a partition
    accurate: "AccurateResult | None" = None  #: the same of the kind `accurate`, in place of a composite map
    speed: "Speed | None" = None  #: of the composite map that a partition made, beside the exact one
    coverage: "Coverage | None" = None  #: of the study's grid
    misleads: "Misleads | None" = None  #: where the composite map of pieces parts from the exact one, on the study's grid
    parametric: "ParametricMap | None" = None
    orbits: tuple[OrbitPair, ...] = ()
    bifurcation: "dict[str, Bifurcation]" = field(default_factory=dict)  #: by map: exact, composite
    branches: "dict[str, tuple[Branch, ...]]" = field(default_factory=dict)  #: by name: one a direction, then doubled cycles
    stability: "StabilityDiagram | None" = None
    curves: "dict[str, EventCurve]" = field(default_factory=dict)  #: over it, by branch and event
    lyapunov: "LyapunovSweep | None" = None
    basins: "Basins | None" = None  #: of the study's grid
    boundary: "Boundary | None" = None  #: between them
    noise: NoiseResult | None = None
    domains: "dict[str, AttractingDomain]" = field(default_factory=dict)
    second_iterate: "SecondIterate | None" = None
    morse: "MorseCover | None" = None  #: what stays in a window, by enclosure of the exact map
    trap: "Trap | None" = None  #: the closed set about the first minimal component of it
    cycles: "CycleSearch | None" = None  #: of the window of the transient regions
    transient: "Transient | None" = None
    verdicts: tuple[Verdict, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)  #: seconds, by what was computed
    versions: dict[str, str] = field(default_factory=dict)
    finished: bool = False  #: whether everything the study names was computed
    undrawn: dict[str, str] = field(default_factory=dict)  #: why a figure could not be drawn, by its name

    @property
    def domain(self) -> "AttractingDomain | None":
        """The first of the domains."""
        return next(iter(self.domains.values()), None)

    @property
    def reduced(self) -> "ReturnMap | None":
        """The map in place of the exact one: of pieces, or of strips."""
        return self.accurate.map(self.system) if self.accurate else self.composite

    @property
    def holds(self) -> bool:
        """Whether every required verdict holds."""
        return all(verdict.holds for verdict in self.verdicts if verdict.required)

    def to_xarray(self) -> "DataTree":
        """Everything that has arrays as an xarray tree: returns, surfaces/FAMILY, orbits/I/exact, domains/DOMAIN and so on.

        A slash in a name is written as a bar. Raises NsmapsError without xarray.
        """
        from nsmaps.exact.data import tree

        orbits = {
            f"orbits/{k}/{of}": getattr(pair, of)
            for k, pair in enumerate(self.orbits)
            for of in ("exact", "composite")
            if getattr(pair, of) is not None
        }
        rooms: dict[str, Mapping[str, HasDataset]] = {
            "surfaces": self.surfaces,
            "bifurcation": self.bifurcation,
            "domains": self.domains,
        }
        named = {f"{room}/{name.replace('/', '|')}": part for room, parts in rooms.items() for name, part in parts.items()}
        first: dict[str, HasDataset] = {} if self.returns is None else {"returns": self.returns}
        about = {"study": self.study.name, "title": self.study.title, "system": self.study.system}
        return tree({**first, **named, **orbits}, **about, **self.system.parameters)
