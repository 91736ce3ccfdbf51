"""What a figure asks of a result, and the errors that say what a study must name to have it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from nsmaps.auxiliary.cover import MorseCover
    from nsmaps.auxiliary.domain import AttractingDomain
    from nsmaps.auxiliary.iterate import SecondIterate
    from nsmaps.auxiliary.transient import Transient
    from nsmaps.dynamics.basins import Basins, Boundary
    from nsmaps.dynamics.bifurcation import Bifurcation
    from nsmaps.dynamics.lyapunov import LyapunovSweep
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.dynamics.stability import EventCurve, StabilityDiagram
    from nsmaps.dynamics.trail import Branch
    from nsmaps.exact.slices import Slice
    from nsmaps.exact.surface import Surface
    from nsmaps.exact.system import ImpactSystem
    from nsmaps.exact.track import Track
    from nsmaps.reduced.accurate import AccurateResult
    from nsmaps.reduced.composite import CompositeMap
    from nsmaps.reduced.deltas import NearDiagonals
    from nsmaps.reduced.diagonal import DiagonalRegion
    from nsmaps.reduced.partition import PartitionResult
    from nsmaps.reduced.speed import Speed
    from nsmaps.reduced.strips import Strips

T = TypeVar("T")

COLOURED = 8  #: families that have a colour of their own


class Pair(Protocol):
    """One start's orbits: under the exact map and, if the study has one, under the composite map."""

    @property
    def exact(self) -> "Orbit": ...
    @property
    def composite(self) -> "Orbit | None": ...
    @property
    def track(self) -> "Track | None": ...


class Drawable(Protocol):
    """The part of a study's result that figures read; any object with these will do."""

    @property
    def study(self) -> Any: ...
    @property
    def surfaces(self) -> Mapping[str, "Surface"]: ...
    @property
    def slices(self) -> Sequence["Slice"]: ...
    @property
    def diagonal(self) -> "DiagonalRegion | None": ...
    @property
    def near(self) -> Sequence["NearDiagonals"]: ...
    @property
    def composite(self) -> "CompositeMap | None": ...
    @property
    def partition(self) -> "PartitionResult | None": ...
    @property
    def accurate(self) -> "AccurateResult | None": ...
    @property
    def speed(self) -> "Speed | None": ...
    @property
    def system(self) -> "ImpactSystem": ...
    @property
    def orbits(self) -> Sequence[Pair]: ...
    @property
    def bifurcation(self) -> Mapping[str, "Bifurcation"]: ...
    @property
    def branches(self) -> Mapping[str, "Sequence[Branch]"]: ...
    @property
    def stability(self) -> "StabilityDiagram | None": ...
    @property
    def curves(self) -> Mapping[str, "EventCurve"]: ...
    @property
    def lyapunov(self) -> "LyapunovSweep | None": ...
    @property
    def basins(self) -> "Basins | None": ...
    @property
    def boundary(self) -> "Boundary | None": ...
    @property
    def noise(self) -> Any: ...
    @property
    def domains(self) -> Mapping[str, "AttractingDomain"]: ...
    @property
    def second_iterate(self) -> "SecondIterate | None": ...
    @property
    def morse(self) -> "MorseCover | None": ...
    @property
    def transient(self) -> "Transient | None": ...


def _there(part: T | None, figure: str, what: str, sections: str) -> T:
    """A part of a result, or the error that says what to name."""
    if not part:
        raise NsmapsError(
            f"the figure {figure!r} shows {what}, and the result has none; name {sections} in the study, "
            f"go on with a run that was stopped (--resume), or leave {figure!r} out of its figures"
        )
    return part


def surfaces_of(result: Drawable, figure: str) -> Mapping[str, "Surface"]:
    """The surfaces by family, of two coordinates, of families with states on the grid, or the error that says what to name."""
    named = _there(result.surfaces, figure, "return surfaces", "'grid' and 'families'")
    two(next(iter(named.values())).coordinates, figure)
    surfaces = {name: surface for name, surface in named.items() if len(surface.start)}
    if not surfaces:
        raise NsmapsError(
            f"{figure!r} has nothing to show: no state of the grid is in {' or '.join(map(repr, named))}; accepted: "
            "families of words that occur on the grid"
        )
    if len(surfaces) > COLOURED:  # those that are told apart are the commonest
        surfaces = dict(sorted(surfaces.items(), key=lambda pair: -len(pair[1].start)))
    return surfaces


def two(coordinates: Sequence[str], figure: str) -> None:
    """An error unless there are two coordinates, for a picture of the plane of states."""
    if len(coordinates) != 2:
        raise NsmapsError(
            f"the figure {figure!r} is a picture of a plane and needs a system of 2 coordinates; this one has "
            f"{len(coordinates)} ({', '.join(coordinates)}); envelopes and domain_size take any number"
        )


def diagonal_of(result: Drawable, figure: str) -> "DiagonalRegion":
    """The region near the diagonals with its images, or the error that says what to name."""
    made = _there(result.diagonal, figure, "the region near the diagonals", "'diagonal'")
    _there(made.images, figure, "the images of the states near the diagonals", "'diagonal'")
    _some(len(made.start), figure)
    return made


def near_of(result: Drawable, figure: str) -> Sequence["NearDiagonals"]:
    """The states near the diagonals for each delta, of two coordinates, or the error that says what to name."""
    near = _there(result.near, figure, "the states near the diagonals", "'diagonal'")
    two(near[0].surface.coordinates, figure)
    _some(len(near[0].surface.start), figure)
    return near


def _some(states: int, figure: str) -> None:
    """An error where no state is near the diagonals."""
    if not states:
        accepted = "a larger 'delta', or a wider 'within'"
        raise NsmapsError(f"the figure {figure!r} shows states near the diagonals, and there are none; accepted: {accepted}")


def orders_of(result: Drawable, figure: str) -> Sequence["NearDiagonals"]:
    """The same with the fits of each order, or the error that says what to name."""
    near = near_of(result, figure)
    _there(near[0].maps, figure, "fits near the diagonals", "'orders' in 'diagonal'")
    return near


def separable_of(result: Drawable, figure: str) -> Mapping[str, Any]:
    """What the study says of each piece with a separable fit, by name, or the error that says what to name."""
    two(composite_of(result, figure).coordinates, figure)
    found = {piece.name: piece for piece in result.study.composite if piece.fit and piece.fit.separable}
    return _there(found, figure, "pieces with a separable fit", "a 'separable' fit in 'composite'")


def composite_of(result: Drawable, figure: str) -> "CompositeMap":
    """The composite map, or the error that says what to name."""
    return _there(result.composite, figure, "a composite map", "'composite'")


def partition_of(result: Drawable, figure: str) -> "PartitionResult":
    """The partition, or the error that says what to name."""
    return _there(result.partition, figure, "a partition", "'partition'")


def strips_of(result: Drawable, figure: str) -> "Strips":
    """The strips, or the error that says what to name."""
    return _there(result.accurate, figure, "strips", "a 'partition' of kind accurate").strips


def speed_of(result: Drawable, figure: str) -> "Speed":
    """The speeds of both maps, or the error that says what to name."""
    return _there(result.speed, figure, "the speed of a map beside the exact one", "'partition'")


def orbits_of(result: Drawable, figure: str) -> Sequence[Pair]:
    """The pairs of orbits, or the error that says what to name."""
    return _there(result.orbits, figure, "orbits", "'orbits'")


def tracks_of(result: Drawable, figure: str) -> "Sequence[Track]":
    """The tracks of the orbits that have one, or the error that says what to name."""
    tracks = [pair.track for pair in result.orbits if pair.track is not None]
    return _there(tracks, figure, "the motion between impacts", "'track' in an entry of 'orbits'")


def slices_of(result: Drawable, figure: str) -> "Sequence[Slice]":
    """The slices, or the error that says what to name."""
    return _there(result.slices, figure, "first returns along one coordinate", "'slices'")


def bifurcation_of(result: Drawable, figure: str) -> Mapping[str, "Bifurcation"]:
    """The bifurcation diagrams by map, or the error that says what to name."""
    return _there(result.bifurcation, figure, "bifurcation diagrams", "'bifurcation'")


def branches_of(result: Drawable, figure: str) -> Mapping[str, "Sequence[Branch]"]:
    """The branches by name, or the error that says what to name."""
    return _there(result.branches, figure, "branches of periodic orbits", "'branches'")


def stability_of(result: Drawable, figure: str) -> "StabilityDiagram":
    """The stability diagram, or the error that says what to name."""
    return _there(result.stability, figure, "a stability diagram", "'stability'")


def lyapunov_of(result: Drawable, figure: str) -> "LyapunovSweep":
    """The Lyapunov exponents, or the error that says what to name."""
    return _there(result.lyapunov, figure, "Lyapunov exponents", "'lyapunov'")


def basins_of(result: Drawable, figure: str) -> "Basins":
    """The basins over a grid, or the error that says what to name."""
    made = _there(result.basins, figure, "basins over a grid", "'basins'")
    _there(made.grid, figure, "basins over a grid", "'basins'")
    two(made.coordinates, figure)
    return made


def noise_of(result: Drawable, figure: str) -> Any:
    """What noise does, or the error that says what to name."""
    return _there(result.noise, figure, "orbits under noise", "'noise'")


def domains_of(result: Drawable, figure: str) -> Mapping[str, "AttractingDomain"]:
    """The attracting domains by name, or the error that says what to name."""
    return _there(result.domains, figure, "attracting domains", "'domains'")


def enveloped_of(result: Drawable, figure: str) -> Mapping[str, "AttractingDomain"]:
    """The domains whose auxiliary maps have values, by name, or the error that says why none has."""
    named = domains_of(result, figure)
    found = {name: domain for name, domain in named.items() if _has_values(domain)}
    if not found:
        why = "; ".join(f"domain {name!r}: {domain.reason}" for name, domain in named.items())
        raise NsmapsError(
            f"the figure {figure!r} shows auxiliary maps, and none has a value ({why}); expected: a domain in whose start box "
            "the map has images"
        )
    return found


def _has_values(domain: "AttractingDomain") -> bool:
    """Whether both auxiliary maps of a coordinate are finite somewhere."""
    curves = [(each.lower, each.upper) for update in domain.updates for each in update.envelopes]
    return any(bool(np.isfinite(pair).all(axis=0).any()) for pair in curves)


def second_iterate_of(result: Drawable, figure: str) -> "SecondIterate":
    """The second iterate, or the error that says what to name."""
    return _there(result.second_iterate, figure, "a second-iterate map", "'second_iterate'")


def morse_of(result: Drawable, figure: str) -> "MorseCover":
    """The cover, or the error that says what to name."""
    return _there(result.morse, figure, "a cover of what stays in a window", "'morse'")


def transient_of(result: Drawable, figure: str) -> "Transient":
    """The transient regions, or the error that says what to name."""
    return _there(result.transient, figure, "transient regions", "'transient'")


def position(coordinates: Sequence[str], coordinate: str) -> int:
    """The place of a coordinate's name among the system's, or an error that lists them."""
    if coordinate not in coordinates:
        raise NsmapsError(f"there is no coordinate {coordinate!r}; accepted: {', '.join(coordinates)}")
    return list(coordinates).index(coordinate)
