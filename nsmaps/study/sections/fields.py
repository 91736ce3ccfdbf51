"""The fields of a study's result, by the sections that compute them."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from nsmaps.arrays import Floats

if TYPE_CHECKING:
    from nsmaps.arrays import Ints
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.auxiliary.full_map import AuxiliaryOrbit
    from nsmaps.cells.exit_times import ExitTimes
    from nsmaps.cells.morse_sets import MorseCover, Trap
    from nsmaps.cells.periodic_points import CycleSearch
    from nsmaps.dynamics.attractors.basins import BasinBoundary, Basins
    from nsmaps.dynamics.attractors.continued import GlobalContinuation
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.charts.chart import ParameterPlane
    from nsmaps.dynamics.continuation.branch import Branch
    from nsmaps.dynamics.curves.curve import BifurcationCurve
    from nsmaps.dynamics.design.optimum import Optimum
    from nsmaps.dynamics.diagrams.agreement import Agreement
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.dynamics.diagrams.stability import StabilityDiagram
    from nsmaps.dynamics.lyapunov import LyapunovSweep
    from nsmaps.dynamics.manifolds.manifold import Manifold
    from nsmaps.dynamics.noise.impacts import ImpactDiagram
    from nsmaps.dynamics.noise.residence import Residence
    from nsmaps.dynamics.observables.attractors import AttractorMeans
    from nsmaps.dynamics.observables.cycles import CycleMeans
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.exact.events import ModeTrack, Track
    from nsmaps.exact.returns import Returns
    from nsmaps.exact.surfaces.slice import Slice
    from nsmaps.exact.surfaces.surface import Surface
    from nsmaps.reduced.adaptive.accurate import AccurateResult
    from nsmaps.reduced.composite.composite import CompositeMap, Coverage
    from nsmaps.reduced.composite.parametric import ParametricMap
    from nsmaps.reduced.fit.filter import DiagonalRegion
    from nsmaps.reduced.fit.filter_errors import NearDiagonals
    from nsmaps.reduced.fit.polymap import FitReport
    from nsmaps.reduced.partition.result import PartitionResult
    from nsmaps.reduced.validation.speed import Speed
    from nsmaps.reduced.validation.words import Misleads
    from nsmaps.symbolic.curve_iterates import SecondIterate


@dataclass(frozen=True, eq=False, kw_only=True)
class SurfacesFields:
    """The fields of a result for grid."""

    returns: "Returns | None" = None  #: the first returns of every state of the grid, of any word and outcome
    surfaces: "dict[str, Surface]" = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class SlicesFields:
    """The fields of a result for slices."""

    slices: "tuple[Slice, ...]" = ()  #: first returns along one coordinate


@dataclass(frozen=True, eq=False, kw_only=True)
class DiagonalFields:
    """The fields of a result for states near the diagonals."""

    diagonal: "DiagonalRegion | None" = None
    orders: "tuple[tuple[str, FitReport], ...]" = ()  #: fits compared near the diagonals, table TableDeltaErr
    near: "tuple[NearDiagonals, ...]" = ()  #: at the study's own parameters, for `delta` and each of `deltas`


@dataclass(frozen=True, eq=False, kw_only=True)
class CompositeFields:
    """The fields of a result for composite map."""

    composite: "CompositeMap | None" = None
    coverage: "Coverage | None" = None  #: of the study's grid
    misleads: "Misleads | None" = None  #: words and images on the study's grid that differ from those of the exact map


@dataclass(frozen=True, eq=False, kw_only=True)
class PartitionFields:
    """The fields of a result for the partition, besides its composite map."""

    partition: "PartitionResult | None" = None  #: the result of the general algorithm
    accurate: "AccurateResult | None" = None  #: the result of the kind `accurate`, without a composite map
    speed: "Speed | None" = None  #: of the reduced map, compared with the exact one


@dataclass(frozen=True, eq=False, kw_only=True)
class ParametricFields:
    """The fields of a result for parametric map."""

    parametric: "ParametricMap | None" = None
    agreement: "Agreement | None" = None  #: of the attractors of the parametric map with those of the exact map


@dataclass(frozen=True, slots=True, eq=False)
class OrbitPair:
    """The orbits of one start: of the exact map and, if the study has one, of the composite map."""

    start: Floats  #: shape (n,)
    exact: "Orbit"
    composite: "Orbit | None"
    track: "Track | ModeTrack | None" = (
        None  #: the exact motion at and between its first impacts or events, if the study requests it
    )
    ends: "LimitSet | None" = None  #: the limit set of the exact orbit; None if the orbit ended
    composite_ends: "LimitSet | None" = None
    counterpart_ends: "LimitSet | None" = None  #: as `ends`, but only of the states after as many returns as the pieces have


@dataclass(frozen=True, eq=False, kw_only=True)
class OrbitsFields:
    """The fields of a result for orbits."""

    orbits: tuple[OrbitPair, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class BifurcationFields:
    """The fields of a result for bifurcation diagrams."""

    bifurcation: "dict[str, BifurcationDiagram]" = field(default_factory=dict)  #: by map: exact, composite, parametric, a piece


@dataclass(frozen=True, eq=False, kw_only=True)
class BranchesFields:
    """The fields of a result for branches."""

    branches: "dict[str, tuple[Branch, ...]]" = field(default_factory=dict)  #: by name: one per direction, then doubled cycles


@dataclass(frozen=True, eq=False, kw_only=True)
class StabilityFields:
    """The fields of a result for stability diagram."""

    stability: "StabilityDiagram | None" = None
    curves: "dict[str, BifurcationCurve]" = field(default_factory=dict)  #: by event and branch


@dataclass(frozen=True, eq=False, kw_only=True)
class ChartFields:
    """The fields of a result for a chart."""

    chart: "ParameterPlane | None" = None
    chart_curves: "dict[str, BifurcationCurve]" = field(default_factory=dict)  #: by event and branch


@dataclass(frozen=True, eq=False, kw_only=True)
class LyapunovFields:
    """The fields of a result for Lyapunov exponents."""

    lyapunov: "LyapunovSweep | None" = None


@dataclass(frozen=True, eq=False, kw_only=True)
class BasinsFields:
    """The fields of a result for basins."""

    basins: "Basins | None" = None  #: of the grid
    boundary: "BasinBoundary | None" = None  #: between them
    reduced_basins: "Basins | None" = None  #: those of the composite map, if the study requests them
    same_attractor: "Ints | None" = None  #: for each attractor of the composite map, the index of that of the exact map it is on


@dataclass(frozen=True, eq=False, kw_only=True)
class GlobalContinuationFields:
    """The fields of a result for attractors over a parameter."""

    global_continuation: "GlobalContinuation | None" = None


@dataclass(frozen=True, eq=False, kw_only=True)
class ManifoldsFields:
    """The fields of a result for manifolds."""

    manifolds: "dict[str, tuple[Manifold, ...]]" = field(default_factory=dict)  #: by name: the unstable one, then the stable one
    no_manifold: dict[str, str] = field(default_factory=dict)  #: by name, the reason why one of them is not there


@dataclass(frozen=True, eq=False, kw_only=True)
class ObservablesFields:
    """The fields of a result for observables."""

    observables: "dict[str, AttractorMeans]" = field(default_factory=dict)  #: by section: of orbits, the diagram, the basins
    branch_observables: "dict[str, tuple[CycleMeans, ...]]" = field(default_factory=dict)  #: by branch, of parts with orbits


@dataclass(frozen=True, slots=True, eq=False)
class NoisyOptimum:
    """The observable at an optimum under noise, for each of K amplitudes."""

    sigma: tuple[float, ...]
    value: Floats  #: shape (K,), mean over all realisations that did not end
    error: Floats  #: shape (K,), standard error


@dataclass(frozen=True, eq=False, kw_only=True)
class OptimumFields:
    """The fields of a result for an optimum."""

    optimum: "Optimum | None" = None
    noisy_optimum: NoisyOptimum | None = None


@dataclass(frozen=True, slots=True, eq=False)
class NoiseResult:
    """Residence and impacts under noise of each amplitude."""

    sigma: tuple[float, ...]
    stays: "tuple[Residence, ...]"  #: one per amplitude
    ended: tuple[dict[str, int], ...]  #: per amplitude: number of realisations that ended, by outcome
    impacts: "tuple[ImpactDiagram, ...]" = ()  #: descending without and with noise, ascending without and with noise
    counted: "tuple[Residence, ...]" = ()  #: as `stays`, with the return as the unit of time, where it is compared with
    reduced: "tuple[Residence, ...]" = ()  #: that of the composite map under kicks, see `KickedMap`; none if not in the study


@dataclass(frozen=True, eq=False, kw_only=True)
class NoiseFields:
    """The fields of a result for noise."""

    noise: NoiseResult | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class DomainsFields:
    """The fields of a result for domains."""

    domains: "dict[str, AttractingDomain]" = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class AuxiliaryMapFields:
    """The fields of a result for the full auxiliary map."""

    auxiliary_map: "AuxiliaryOrbit | None" = None
    auxiliary_exits: "ExitTimes | None" = None  #: of its regions, and arrival in A_1


@dataclass(frozen=True, eq=False, kw_only=True)
class ExitTimesFields:
    """The fields of a result for exit times."""

    cycles: "CycleSearch | None" = None  #: of the window of the transient regions
    exit_times: "ExitTimes | None" = None


@dataclass(frozen=True, eq=False, kw_only=True)
class MorseFields:
    """The fields of a result for cover."""

    morse: "MorseCover | None" = None  #: of the invariant sets in the window, by enclosure of the exact map
    trap: "Trap | None" = None  #: the closed set around its first minimal component


@dataclass(frozen=True, eq=False, kw_only=True)
class SecondIterateFields:
    """The fields of a result, recomputed from the coefficients of the piece when a run is read."""

    second_iterate: "SecondIterate | None" = None
