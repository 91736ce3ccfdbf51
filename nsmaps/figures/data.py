"""What figures need of a study's result, and what a study names to have each part computed."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nsmaps.figures import parts
from nsmaps.figures.row import Need
from nsmaps.plugins import sketch_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nsmaps.arrays import Ints
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.auxiliary.full_map import AuxiliaryOrbit
    from nsmaps.cells.morse import MorseCover
    from nsmaps.cells.times import ExitTimes
    from nsmaps.dynamics.attractors.basins import Basins
    from nsmaps.dynamics.attractors.continued import GlobalContinuation
    from nsmaps.dynamics.attractors.limit_set import OrbitPair
    from nsmaps.dynamics.charts.chart import ParameterPlane
    from nsmaps.dynamics.continuation.branch import Branch
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.dynamics.diagrams.stability import StabilityDiagram
    from nsmaps.dynamics.lyapunov import LyapunovSweep
    from nsmaps.dynamics.manifolds.manifold import Manifold
    from nsmaps.dynamics.noise.residence import NoiseResult
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.exact.events import ModeTrack, Track
    from nsmaps.exact.surfaces.mesh import Mesh
    from nsmaps.exact.surfaces.slice import Slice
    from nsmaps.exact.surfaces.surface import Grid, Surface
    from nsmaps.reduced.adaptive.accurate import AccurateResult
    from nsmaps.reduced.composite.composite import CompositeMap
    from nsmaps.reduced.fit.filter import DiagonalRegion
    from nsmaps.reduced.fit.filter_errors import NearDiagonals
    from nsmaps.reduced.partition.result import PartitionResult
    from nsmaps.reduced.validation.speed import Speed
    from nsmaps.study.sections.maps.composite import PieceSection
    from nsmaps.symbolic.curve_iterates import SecondIterate


SKETCH: "Need[Callable[[Axes], Axes]]" = Need(
    "a drawing of the system",
    (),
    lambda result: sketch_of(result.study.system),
    "a system whose package offers one",
    lambda study: bool(sketch_of(study.system)),
)
SURFACES: "Need[Mapping[str, Surface]]" = Need("return surfaces", ("grid", "families"), parts.surfaces, planar=True)
PLANES: "Need[Mapping[str, Surface]]" = Need("return surfaces over a plane", ("grid", "families"), parts.planes)
MESH: "Need[Callable[..., Mesh]]" = Need("triangles", (), parts.mesh_by_surface)
GRID: "Need[Grid]" = Need("return surfaces", ("grid", "families"), parts.grid, planar=True)
SLICES: "Need[Sequence[Slice]]" = Need("first returns along one coordinate", ("slices",), lambda result: result.slices)
DIAGONAL: "Need[DiagonalRegion]" = Need("the region near the diagonals with its images", ("diagonal",), parts.diagonal)
NEAR_DIAGONALS: "Need[DiagonalRegion]" = Need("states near the diagonals", (), lambda result: result.diagonal, optional=True)
SWEPT: "Need[str]" = Need("a parameter", (), lambda result: parts.swept(result.study), optional=True)
SHOWN: "Need[Sequence[float]]" = Need(
    "values", (), lambda result: parts.section(result.study.diagonal, "diagonal").shown, optional=True
)
NEAR: "Need[NearDiagonals]" = Need(
    "the states near the diagonals", ("diagonal",), lambda result: next(iter(parts.near(result)), None), planar=True
)
NEAR_MESH: "Need[Callable[[Surface], Mesh]]" = Need("triangles by the filter", (), parts.near_mesh)
ORDERS: "Need[Sequence[NearDiagonals]]" = Need(
    "fits near the diagonals",
    ("diagonal",),
    parts.orders,
    "'orders' in 'diagonal'",
    lambda study: not study.diagonal or bool(study.diagonal.orders),
    planar=True,
)
COMPOSITE: "Need[CompositeMap]" = Need(
    "a composite map of pieces in closed form",
    ("composite",),
    lambda result: result.composite,
    "'composite' or a 'partition' of kind closed_form",
    lambda study: not parts.is_accurate(study),
)
REDUCED: "Need[CompositeMap]" = Need("a composite map", (), lambda result: result.composite, optional=True)
SEPARABLE: "Need[Mapping[str, PieceSection]]" = Need(
    "pieces with a separable fit",
    ("composite",),
    lambda result: parts.separable(result.study.composite),
    "a piece of 'composite' with a 'separable' fit",
    lambda study: not (study.composite or study.partition) or bool(parts.separable(study.composite)),
    planar=True,
)
PARTITION: "Need[PartitionResult]" = Need(
    "a partition into pieces in closed form",
    ("grid", "partition"),
    lambda result: result.partition,
    "a 'partition' of kind closed_form",
    lambda study: not parts.is_accurate(study),
)
MADE: "Need[PartitionResult]" = Need("a partition", (), lambda result: result.partition, optional=True)
ACCURATE: "Need[AccurateResult]" = Need(
    "strips between grazing curves",
    ("grid", "partition"),
    lambda result: result.accurate,
    "a 'partition' of kind accurate",
    lambda study: not study.partition or parts.is_accurate(study),
)
ERRORS: "Need[Mapping[str, float]]" = Need("errors", (), parts.errors, optional=True)
TOLERANCE: "Need[float]" = Need("a tolerance", (), lambda result: parts.section(result.study.partition, "partition").tolerance)
TITLE: "Need[str]" = Need("the title of the map", (), lambda result: result.system.map_name)
SPEED: "Need[Speed]" = Need("the speed of a reduced map", ("grid", "partition"), lambda result: result.speed, "a 'partition'")
ORBITS: "Need[Sequence[OrbitPair]]" = Need("orbits", ("orbits",), lambda result: result.orbits)
OVER: "Need[tuple[Grid, CompositeMap | None]]" = Need("pieces over a grid", (), parts.over, optional=True)
PAIRS: "Need[Sequence[OrbitPair]]" = Need("orbits", (), lambda result: result.orbits, optional=True)
TRACKS: "Need[Sequence[Track | ModeTrack]]" = Need(
    "the motion between impacts",
    ("orbits",),
    parts.tracks,
    "'track' in an entry of 'orbits'",
    lambda study: not study.orbits or any(orbit.track for orbit in study.orbits),
)
BIFURCATION: "Need[Mapping[str, BifurcationDiagram]]" = Need("bifurcation diagrams", ("bifurcation",), parts.diagrams)
BRANCHES: "Need[Sequence[Branch]]" = Need(
    "branches of periodic orbits", ("branches",), lambda result: [each for some in result.branches.values() for each in some]
)
STABILITY: "Need[StabilityDiagram]" = Need("a stability diagram", ("stability",), lambda result: result.stability)
CURVES: "Need[Any]" = Need("curves", (), lambda result: result.curves, optional=True)
CHART: "Need[ParameterPlane]" = Need("a chart of two parameters", ("chart",), lambda result: result.chart)
CHART_CURVES: "Need[Any]" = Need("curves", (), lambda result: result.chart_curves, optional=True)
OPTIMUM: "Need[Any]" = Need("an optimum", (), lambda result: result.optimum, optional=True)
LYAPUNOV: "Need[LyapunovSweep]" = Need("Lyapunov exponents", ("lyapunov",), lambda result: result.lyapunov)
BASINS: "Need[Basins | Mapping[str, Basins]]" = Need("basins over a grid", ("basins",), parts.basins)
SAME_ATTRACTOR: "Need[Ints]" = Need("attractors of both maps", (), lambda result: result.same_attractor, optional=True)
GLOBAL_CONTINUATION: "Need[GlobalContinuation]" = Need(
    "attractors along a parameter", ("global_continuation",), lambda result: result.global_continuation
)
MANIFOLDS: "Need[Sequence[Manifold]]" = Need("manifolds of saddles", ("manifolds",), parts.manifolds)
BELOW: "Need[Callable[[Axes], Axes]]" = Need("basins or families", (), parts.below, optional=True)
OBSERVABLES: "Need[Mapping[str, Any]]" = Need(
    "observables along a parameter",
    ("observables",),
    parts.observed,
    "'observables', and a 'bifurcation' of the exact map or 'branches'",
    lambda study: bool(study.bifurcation or study.branches),
)
NOISE: "Need[NoiseResult]" = Need("orbits under noise", ("noise",), lambda result: result.noise)
DOMAINS: "Need[Mapping[str, AttractingDomain]]" = Need("attracting domains", ("domains",), lambda result: result.domains)
ENVELOPED: "Need[Mapping[str, AttractingDomain]]" = Need("auxiliary maps", ("domains",), parts.enveloped)
SECOND_ITERATE: "Need[SecondIterate]" = Need("a second-iterate map", ("second_iterate",), lambda result: result.second_iterate)
BOUNDED: "Need[parts.Bounded]" = Need("an attracting domain", ("domains",), parts.bounded)
AUXILIARY_MAP: "Need[AuxiliaryOrbit]" = Need("the full auxiliary map", ("auxiliary_map",), lambda result: result.auxiliary_map)
MORSE: "Need[MorseCover]" = Need("a cover by Morse sets", ("morse",), lambda result: result.morse, planar=True)
EXACT_ORBITS: "Need[Sequence[Orbit]]" = Need("orbits", (), lambda result: [pair.exact for pair in result.orbits], optional=True)
EXIT_TIMES: "Need[ExitTimes]" = Need("exit times", ("exit_times",), lambda result: result.exit_times, planar=True)
NAMES: "Need[Sequence[str]]" = Need("coordinates", (), lambda result: result.system.coordinates)
PLANE: "Need[Any]" = Need("the plane of states", (), lambda result: result.system, planar=True)
