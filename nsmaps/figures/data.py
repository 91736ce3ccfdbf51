"""What figures read of a study's result: the parts that they show, and what a study names to have each."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from nsmaps.errors import NsmapsError
from nsmaps.figures.need import Need
from nsmaps.plugins import sketch_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nsmaps.arrays import Ints
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.auxiliary.full_map import AuxiliaryOrbit
    from nsmaps.cells.exit_times import ExitTimes
    from nsmaps.cells.morse_sets import MorseCover
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
    from nsmaps.study.reading.head import Head as Study
    from nsmaps.study.result import StudyResult
    from nsmaps.study.sections.maps.composite import PieceSection
    from nsmaps.symbolic.curve_iterates import SecondIterate

T = TypeVar("T")

COLOURED = 8  #: families that have a colour of their own


def plane(grid: "Grid") -> list[int]:
    """The positions of the two coordinates along which a grid varies; NsmapsError unless there are two."""
    varying = [k for k, axis in enumerate(grid.axes.values()) if axis.points > 1]
    if len(varying) != 2:
        raise NsmapsError(
            f"the grid varies along {', '.join(grid.varying) or 'no coordinate'}; "
            "expected: two coordinates, with the others held at a value"
        )
    return varying


def section(found: T | None, name: str) -> T:
    """A section of the study that a result was computed from; NsmapsError where the study lacks it."""
    if found is None:
        raise NsmapsError(f"the study of this result has no section {name!r}; expected: the study from which it was computed")
    return found


def position(coordinates: Sequence[str], coordinate: str) -> int:
    """The index of a coordinate's name among those of the system, or an error that lists them."""
    if coordinate not in coordinates:
        raise NsmapsError(f"there is no coordinate {coordinate!r}; expected: {', '.join(coordinates)}")
    return list(coordinates).index(coordinate)


def _surfaces(result: "StudyResult") -> "Mapping[str, Surface]":
    """The families with states on the grid; the most frequent ones first where they are more than there are colours."""
    surfaces = {name: surface for name, surface in result.surfaces.items() if len(surface.start)}
    if result.surfaces and not surfaces:
        raise NsmapsError(
            f"no state of the grid is in {' or '.join(map(repr, result.surfaces))}; expected: families of words that occur on "
            "the grid"
        )
    if len(surfaces) > COLOURED:
        return dict(sorted(surfaces.items(), key=lambda pair: -len(pair[1].start)))
    return surfaces


def _grid(result: "StudyResult") -> "Grid | None":
    """The grid of the return surfaces."""
    return next((surface.grid for surface in _surfaces(result).values()), None)


def _over(result: "StudyResult") -> "tuple[Grid, CompositeMap | None] | None":
    """The grid of the return surfaces, with the composite map over it."""
    return (next(iter(result.surfaces.values())).grid, result.composite) if result.surfaces else None


def _planes(result: "StudyResult") -> "Mapping[str, Surface]":
    """The same over a plane through the states."""
    surfaces = _surfaces(result)
    if surfaces:
        plane(next(iter(surfaces.values())).grid)
    return surfaces


def _manifolds(result: "StudyResult") -> "Sequence[Manifold]":
    """The manifolds of all saddles; NsmapsError with the reasons where none has any."""
    found = [each for some in result.manifolds.values() for each in some]
    if result.manifolds and not found:
        raise NsmapsError(next(iter(result.no_manifold.values())))
    return found


def _below(result: "StudyResult") -> "Callable[[Axes], Axes] | None":
    """The panel over which manifolds are drawn."""
    if result.basins is not None:
        return partial(import_module("nsmaps.figures.longrun.basins").basins, result.basins)
    if not (surfaces := _planes(result)):
        return None
    words = import_module("nsmaps.figures.returns.words").words
    return partial(words, surfaces, mesh=MESH.of(result, "words"), diagonal=result.diagonal)


def _basins(result: "StudyResult") -> "Basins | Mapping[str, Basins] | None":
    """Basins over a plane through the states, of both maps by title where there are two."""
    found, reduced = result.basins, result.reduced_basins
    if found is None or found.grid is None:
        return None
    plane(found.grid)
    return found if reduced is None else {result.system.map_name: found, "composite map": reduced}


def _diagrams(result: "StudyResult") -> "Mapping[str, BifurcationDiagram]":
    """The bifurcation diagrams by the titles of their maps, the exact one first."""
    found = sorted(result.bifurcation.items(), key=lambda pair: pair[0] != "exact")
    return {result.map_title(of): diagram for of, diagram in found}


def _diagonal(result: "StudyResult") -> "DiagonalRegion | None":
    """The region with the images of its states."""
    region = result.diagonal
    if region is None or not region.images:
        return None
    _check_some(len(region.start))
    return region


def _near(result: "StudyResult") -> "Sequence[NearDiagonals]":
    """The states for each delta."""
    if result.near:
        _check_some(len(result.near[0].surface.start))
    return result.near


def _swept(study: "Study") -> str:
    """The parameter over whose values states are near the diagonals; empty without one."""
    return "" if study.diagonal is None or study.diagonal.sweep is None else study.diagonal.sweep.parameter


def _near_mesh(result: "StudyResult") -> "Callable[[Surface], Mesh]":
    """The surface as triangles, of which part 1 passes the filter of the study at its own parameters."""
    from nsmaps.reduced.conditions.region import ConditionRegion
    from nsmaps.reduced.fit.filter import Attracting, NearDiagonal

    asked = section(result.study.diagonal, "diagonal")
    region = None if asked.region is None else ConditionRegion(coordinates=result.system.coordinates, text=asked.region)
    near = NearDiagonal(delta=_near(result)[0].delta, slope=asked.slope, region=region)
    attracting = Attracting(near, result.system, result.family(asked.family))
    return lambda surface: result.mesh(surface.name, attracting)


def _check_some(states: int) -> None:
    """An error where no state is near the diagonals."""
    if not states:
        raise NsmapsError("no state is near the diagonals; expected: a larger 'delta', or a wider 'region'")


def _orders(result: "StudyResult") -> "Sequence[NearDiagonals]":
    """The states for each delta, if polynomials were fitted to them."""
    near = _near(result)
    return near if near and near[0].maps else ()


def _enveloped(result: "StudyResult") -> "Mapping[str, AttractingDomain]":
    """The domains whose auxiliary maps have values, by name."""
    found = {name: domain for name, domain in result.domains.items() if _has_values(domain)}
    if result.domains and not found:
        why = "; ".join(f"domain {name!r}: {domain.reason}" for name, domain in result.domains.items())
        raise NsmapsError(f"no auxiliary map has a value ({why}); expected: a domain in whose start box the map has images")
    return found


def invariant_or_first(domains: "Mapping[str, AttractingDomain]") -> "dict[str, AttractingDomain]":
    """The domains whose boxes are forward invariant; where none is, the first alone."""
    invariant = {name: domain for name, domain in domains.items() if domain.forward_invariant}
    return invariant or dict([*domains.items()][:1])


class Bounded(NamedTuple):
    """Updates of a domain, between whose bounds a second iterate is taken."""

    name: str  #: of the domain
    domain: "AttractingDomain"
    updates: Sequence[int] = ()  #: numbers of those that are shown, the second and the last if empty


def _bounded(result: "StudyResult") -> "Bounded | None":
    """The domain between whose bounds the study takes the second iterate, with the updates that it names."""
    asked = result.study.second_iterate
    return None if asked is None else Bounded(asked.domain, result.domains[asked.domain], asked.updates)


def _has_values(domain: "AttractingDomain") -> bool:
    """Whether both auxiliary maps of a coordinate are finite somewhere."""
    import numpy as np

    curves = [(each.lower, each.upper) for update in domain.updates for each in update.envelopes]
    return any(bool(np.isfinite(pair).all(axis=0).any()) for pair in curves)


def _separable(pieces: "Sequence[PieceSection]") -> "Mapping[str, PieceSection]":
    """What a study says of each piece with a separable fit, by name."""
    return {piece.name: piece for piece in pieces if piece.separable}


def _errors(result: "StudyResult") -> Mapping[str, float]:
    """The largest errors of a partition by where they were found."""
    if result.accurate is not None:
        return {"over the box": result.accurate.uniform.largest, "beside edges": result.accurate.beside.largest}
    if result.partition is None:
        return {}
    transient = [max(row.max_error) for row in result.partition.table() if row.role == "transient"]
    return {"attracting pieces": result.partition.max_error, "transient pieces": max(transient, default=float("nan"))}


def _is_accurate(study: "Study") -> bool:
    return study.partition is not None and study.partition.kind == "accurate"


def _observed(result: "StudyResult") -> Mapping[str, Any]:
    """The means along parameters: of a bifurcation diagram and of branches, by name."""
    diagram = {name: means for name, means in result.observables.items() if name == "bifurcation"}
    return {**diagram, **{name: parts for name, parts in result.branch_observables.items() if parts}}


def _tracks(result: "StudyResult") -> "Sequence[Track | ModeTrack]":
    return [pair.track for pair in result.orbits if pair.track is not None]


SKETCH: "Need[Callable[[Axes], Axes]]" = Need(
    "a drawing of the system",
    (),
    lambda result: sketch_of(result.study.system),
    "a system whose package offers one",
    lambda study: bool(sketch_of(study.system)),
)
SURFACES: "Need[Mapping[str, Surface]]" = Need("return surfaces", ("grid", "families"), _surfaces, planar=True)
PLANES: "Need[Mapping[str, Surface]]" = Need("return surfaces over a plane", ("grid", "families"), _planes)
MESH: "Need[Callable[..., Mesh]]" = Need(
    "triangles", (), lambda result: lambda surface, part=None: result.mesh(surface.name, part)
)
GRID: "Need[Grid]" = Need("return surfaces", ("grid", "families"), _grid, planar=True)
SLICES: "Need[Sequence[Slice]]" = Need("first returns along one coordinate", ("slices",), lambda result: result.slices)
DIAGONAL: "Need[DiagonalRegion]" = Need("the region near the diagonals with its images", ("diagonal",), _diagonal)
NEAR_DIAGONALS: "Need[DiagonalRegion]" = Need("states near the diagonals", (), lambda result: result.diagonal, optional=True)
SWEPT: "Need[str]" = Need("a parameter", (), lambda result: _swept(result.study), optional=True)
SHOWN: "Need[Sequence[float]]" = Need(
    "values", (), lambda result: section(result.study.diagonal, "diagonal").shown, optional=True
)
NEAR: "Need[NearDiagonals]" = Need(
    "the states near the diagonals", ("diagonal",), lambda result: next(iter(_near(result)), None), planar=True
)
NEAR_MESH: "Need[Callable[[Surface], Mesh]]" = Need("triangles by the filter", (), _near_mesh)
ORDERS: "Need[Sequence[NearDiagonals]]" = Need(
    "fits near the diagonals",
    ("diagonal",),
    _orders,
    "'orders' in 'diagonal'",
    lambda study: not study.diagonal or bool(study.diagonal.orders),
    planar=True,
)
COMPOSITE: "Need[CompositeMap]" = Need(
    "a composite map of pieces in closed form",
    ("composite",),
    lambda result: result.composite,
    "'composite' or a 'partition' of kind closed_form",
    lambda study: not _is_accurate(study),
)
REDUCED: "Need[CompositeMap]" = Need("a composite map", (), lambda result: result.composite, optional=True)
SEPARABLE: "Need[Mapping[str, PieceSection]]" = Need(
    "pieces with a separable fit",
    ("composite",),
    lambda result: _separable(result.study.composite),
    "a piece of 'composite' with a 'separable' fit",
    lambda study: not (study.composite or study.partition) or bool(_separable(study.composite)),
    planar=True,
)
PARTITION: "Need[PartitionResult]" = Need(
    "a partition into pieces in closed form",
    ("grid", "partition"),
    lambda result: result.partition,
    "a 'partition' of kind closed_form",
    lambda study: not _is_accurate(study),
)
MADE: "Need[PartitionResult]" = Need("a partition", (), lambda result: result.partition, optional=True)
ACCURATE: "Need[AccurateResult]" = Need(
    "strips between grazing curves",
    ("grid", "partition"),
    lambda result: result.accurate,
    "a 'partition' of kind accurate",
    lambda study: not study.partition or _is_accurate(study),
)
ERRORS: "Need[Mapping[str, float]]" = Need("errors", (), _errors, optional=True)
TOLERANCE: "Need[float]" = Need("a tolerance", (), lambda result: section(result.study.partition, "partition").tolerance)
TITLE: "Need[str]" = Need("the title of the map", (), lambda result: result.system.map_name)
SPEED: "Need[Speed]" = Need("the speed of a reduced map", ("grid", "partition"), lambda result: result.speed, "a 'partition'")
ORBITS: "Need[Sequence[OrbitPair]]" = Need("orbits", ("orbits",), lambda result: result.orbits)
OVER: "Need[tuple[Grid, CompositeMap | None]]" = Need("pieces over a grid", (), _over, optional=True)
PAIRS: "Need[Sequence[OrbitPair]]" = Need("orbits", (), lambda result: result.orbits, optional=True)
TRACKS: "Need[Sequence[Track | ModeTrack]]" = Need(
    "the motion between impacts",
    ("orbits",),
    _tracks,
    "'track' in an entry of 'orbits'",
    lambda study: not study.orbits or any(orbit.track for orbit in study.orbits),
)
BIFURCATION: "Need[Mapping[str, BifurcationDiagram]]" = Need("bifurcation diagrams", ("bifurcation",), _diagrams)
BRANCHES: "Need[Sequence[Branch]]" = Need(
    "branches of periodic orbits", ("branches",), lambda result: [each for some in result.branches.values() for each in some]
)
STABILITY: "Need[StabilityDiagram]" = Need("a stability diagram", ("stability",), lambda result: result.stability)
CURVES: "Need[Any]" = Need("curves", (), lambda result: result.curves, optional=True)
CHART: "Need[ParameterPlane]" = Need("a chart of two parameters", ("chart",), lambda result: result.chart)
CHART_CURVES: "Need[Any]" = Need("curves", (), lambda result: result.chart_curves, optional=True)
OPTIMUM: "Need[Any]" = Need("an optimum", (), lambda result: result.optimum, optional=True)
LYAPUNOV: "Need[LyapunovSweep]" = Need("Lyapunov exponents", ("lyapunov",), lambda result: result.lyapunov)
BASINS: "Need[Basins | Mapping[str, Basins]]" = Need("basins over a grid", ("basins",), _basins)
SAME_ATTRACTOR: "Need[Ints]" = Need("attractors of both maps", (), lambda result: result.same_attractor, optional=True)
GLOBAL_CONTINUATION: "Need[GlobalContinuation]" = Need(
    "attractors along a parameter", ("global_continuation",), lambda result: result.global_continuation
)
MANIFOLDS: "Need[Sequence[Manifold]]" = Need("manifolds of saddles", ("manifolds",), _manifolds)
BELOW: "Need[Callable[[Axes], Axes]]" = Need("basins or families", (), _below, optional=True)
OBSERVABLES: "Need[Mapping[str, Any]]" = Need(
    "observables along a parameter",
    ("observables",),
    _observed,
    "'observables', and a 'bifurcation' of the exact map or 'branches'",
    lambda study: bool(study.bifurcation or study.branches),
)
NOISE: "Need[NoiseResult]" = Need("orbits under noise", ("noise",), lambda result: result.noise)
DOMAINS: "Need[Mapping[str, AttractingDomain]]" = Need("attracting domains", ("domains",), lambda result: result.domains)
ENVELOPED: "Need[Mapping[str, AttractingDomain]]" = Need("auxiliary maps", ("domains",), _enveloped)
SECOND_ITERATE: "Need[SecondIterate]" = Need("a second-iterate map", ("second_iterate",), lambda result: result.second_iterate)
BOUNDED: "Need[Bounded]" = Need("an attracting domain", ("domains",), _bounded)
AUXILIARY_MAP: "Need[AuxiliaryOrbit]" = Need("the full auxiliary map", ("auxiliary_map",), lambda result: result.auxiliary_map)
MORSE: "Need[MorseCover]" = Need("a cover by Morse sets", ("morse",), lambda result: result.morse, planar=True)
EXACT_ORBITS: "Need[Sequence[Orbit]]" = Need("orbits", (), lambda result: [pair.exact for pair in result.orbits], optional=True)
EXIT_TIMES: "Need[ExitTimes]" = Need("exit times", ("exit_times",), lambda result: result.exit_times, planar=True)
NAMES: "Need[Sequence[str]]" = Need("coordinates", (), lambda result: result.system.coordinates)
PLANE: "Need[Any]" = Need("the plane of states", (), lambda result: result.system, planar=True)
