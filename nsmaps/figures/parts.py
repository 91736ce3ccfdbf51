"""The parts of a study's result that figures show, as they show them, or the reason why there is nothing to show."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.dynamics.attractors.basins import Basins
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.dynamics.manifolds.manifold import Manifold
    from nsmaps.exact.events import ModeTrack, Track
    from nsmaps.exact.surfaces.mesh import Mesh
    from nsmaps.exact.surfaces.surface import Grid, Surface
    from nsmaps.reduced.composite.composite import CompositeMap
    from nsmaps.reduced.fit.filter import DiagonalRegion
    from nsmaps.reduced.fit.filter_errors import NearDiagonals
    from nsmaps.study.reading.head import Head as Study
    from nsmaps.study.result import StudyResult
    from nsmaps.study.sections.maps.composite import PieceSection

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


def surfaces(result: "StudyResult") -> "Mapping[str, Surface]":
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


def grid(result: "StudyResult") -> "Grid | None":
    """The grid of the return surfaces."""
    return next((surface.grid for surface in surfaces(result).values()), None)


def over(result: "StudyResult") -> "tuple[Grid, CompositeMap | None] | None":
    """The grid of the return surfaces, with the composite map over it."""
    return (next(iter(result.surfaces.values())).grid, result.composite) if result.surfaces else None


def planes(result: "StudyResult") -> "Mapping[str, Surface]":
    """The same over a plane through the states."""
    shown = surfaces(result)
    if shown:
        plane(next(iter(shown.values())).grid)
    return shown


def mesh_by_surface(result: "StudyResult") -> "Callable[..., Mesh]":
    """The function that gives the triangles of a surface of the result, up to its edges."""
    return lambda surface, part=None: result.mesh(surface.name, part)


def manifolds(result: "StudyResult") -> "Sequence[Manifold]":
    """The manifolds of all saddles; NsmapsError with the reasons where none has any."""
    found = [each for some in result.manifolds.values() for each in some]
    if result.manifolds and not found:
        raise NsmapsError(next(iter(result.no_manifold.values())))
    return found


def below(result: "StudyResult") -> "Callable[[Axes], Axes] | None":
    """The panel over which manifolds are drawn."""
    if result.basins is not None:
        return partial(import_module("nsmaps.figures.longrun.basins").basins, result.basins)
    if not (shown := planes(result)):
        return None
    words = import_module("nsmaps.figures.returns.words").words
    return partial(words, shown, mesh=mesh_by_surface(result), diagonal=result.diagonal)


def basins(result: "StudyResult") -> "Basins | Mapping[str, Basins] | None":
    """Basins over a plane through the states, of both maps by title where there are two."""
    found, reduced = result.basins, result.reduced_basins
    if found is None or found.grid is None:
        return None
    plane(found.grid)
    return found if reduced is None else {result.system.map_name: found, "composite map": reduced}


def diagrams(result: "StudyResult") -> "Mapping[str, BifurcationDiagram]":
    """The bifurcation diagrams by the titles of their maps, in the order of the study."""
    return {result.map_title(of): diagram for of, diagram in result.bifurcation.items()}


def diagonal(result: "StudyResult") -> "DiagonalRegion | None":
    """The region with the images of its states."""
    region = result.diagonal
    if region is None or not region.images:
        return None
    check_some(len(region.start))
    return region


def near(result: "StudyResult") -> "Sequence[NearDiagonals]":
    """The states for each delta."""
    if result.near:
        check_some(len(result.near[0].surface.start))
    return result.near


def swept(study: "Study") -> str:
    """The parameter over whose values states are near the diagonals; empty without one."""
    return "" if study.diagonal is None or study.diagonal.sweep is None else study.diagonal.sweep.parameter


def near_mesh(result: "StudyResult") -> "Callable[[Surface], Mesh]":
    """The surface as triangles, of which part 1 passes the filter of the study at its own parameters."""
    from nsmaps.reduced.conditions.region import ConditionRegion
    from nsmaps.reduced.fit.filter import Attracting, NearDiagonal

    asked = section(result.study.diagonal, "diagonal")
    region = None if asked.region is None else ConditionRegion(coordinates=result.system.coordinates, text=asked.region)
    criterion = NearDiagonal(delta=near(result)[0].delta, slope=asked.slope, region=region)
    attracting = Attracting(criterion, result.system, result.family(asked.family))
    return lambda surface: result.mesh(surface.name, attracting)


def check_some(states: int) -> None:
    """An error where no state is near the diagonals."""
    if not states:
        raise NsmapsError("no state is near the diagonals; expected: a larger 'delta', or a wider 'region'")


def orders(result: "StudyResult") -> "Sequence[NearDiagonals]":
    """The states for each delta, if polynomials were fitted to them."""
    found = near(result)
    return found if found and found[0].maps else ()


def enveloped(result: "StudyResult") -> "Mapping[str, AttractingDomain]":
    """The domains whose auxiliary maps have values, by name."""
    found = {name: domain for name, domain in result.domains.items() if has_values(domain)}
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


def bounded(result: "StudyResult") -> "Bounded | None":
    """The domain between whose bounds the study takes the second iterate, with the updates that it names."""
    asked = result.study.second_iterate
    return None if asked is None else Bounded(asked.domain, result.domains[asked.domain], asked.updates)


def has_values(domain: "AttractingDomain") -> bool:
    """Whether both auxiliary maps of a coordinate are finite somewhere."""
    import numpy as np

    curves = [(each.lower, each.upper) for update in domain.updates for each in update.envelopes]
    return any(bool(np.isfinite(pair).all(axis=0).any()) for pair in curves)


def separable(pieces: "Sequence[PieceSection]") -> "Mapping[str, PieceSection]":
    """What a study says of each piece with a separable fit, by name."""
    return {piece.name: piece for piece in pieces if piece.separable}


def errors(result: "StudyResult") -> Mapping[str, float]:
    """The largest errors of a partition by where they were found."""
    if result.accurate is not None:
        return {"over the box": result.accurate.uniform.largest, "beside edges": result.accurate.beside.largest}
    if result.partition is None:
        return {}
    transient = [max(row.max_error) for row in result.partition.table() if row.role == "transient"]
    return {"attracting pieces": result.partition.max_error, "transient pieces": max(transient, default=float("nan"))}


def is_accurate(study: "Study") -> bool:
    """Whether the partition of a study is of the kind `accurate`."""
    return study.partition is not None and study.partition.kind == "accurate"


def observed(result: "StudyResult") -> Mapping[str, Any]:
    """The means along parameters: of a bifurcation diagram and of branches, by name."""
    diagram = {name: means for name, means in result.observables.items() if name == "bifurcation"}
    return {**diagram, **{name: parts for name, parts in result.branch_observables.items() if parts}}


def tracks(result: "StudyResult") -> "Sequence[Track | ModeTrack]":
    """The motions between impacts that the study requests."""
    return [pair.track for pair in result.orbits if pair.track is not None]
