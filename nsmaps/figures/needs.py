"""What a figure asks of a result, and the errors that say what a study must name to have it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

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
    from nsmaps.exact.surface import Surface
    from nsmaps.exact.system import ImpactSystem
    from nsmaps.reduced.accurate import AccurateResult
    from nsmaps.reduced.composite import CompositeMap
    from nsmaps.reduced.diagonal import DiagonalRegion
    from nsmaps.reduced.partition import PartitionResult
    from nsmaps.reduced.speed import Speed
    from nsmaps.reduced.strips import Strips


class Pair(Protocol):
    """One start's orbits: under the exact map and, if the study has one, under the composite map."""

    @property
    def exact(self) -> "Orbit": ...
    @property
    def composite(self) -> "Orbit | None": ...


class Drawable(Protocol):
    """The part of a study's result that figures read; any object with these will do."""

    @property
    def study(self) -> Any: ...
    @property
    def surfaces(self) -> Mapping[str, "Surface"]: ...
    @property
    def diagonal(self) -> "DiagonalRegion | None": ...
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


def _missing(figure: str, what: str, sections: str) -> NsmapsError:
    return NsmapsError(
        f"the figure {figure!r} shows {what}, and the result has none; name {sections} in the study, "
        f"or leave {figure!r} out of its figures"
    )


def surfaces_of(result: Drawable, figure: str) -> Mapping[str, "Surface"]:
    """The surfaces by family, of two coordinates, or the error that says what to name."""
    if not result.surfaces:
        raise _missing(figure, "return surfaces", "'grid' and 'families'")
    two(next(iter(result.surfaces.values())).coordinates, figure)
    return result.surfaces


def two(coordinates: Sequence[str], figure: str) -> None:
    """An error unless there are two coordinates, for a picture of the plane of states."""
    if len(coordinates) != 2:
        raise NsmapsError(
            f"the figure {figure!r} is a picture of a plane and needs a system of 2 coordinates; this one has "
            f"{len(coordinates)} ({', '.join(coordinates)}); envelopes and domain_size take any number"
        )


def composite_of(result: Drawable, figure: str) -> "CompositeMap":
    """The composite map, or the error that says what to name."""
    if result.composite is None:
        raise _missing(figure, "a composite map", "'composite'")
    return result.composite


def partition_of(result: Drawable, figure: str) -> "PartitionResult":
    """The partition, or the error that says what to name."""
    if result.partition is None:
        raise _missing(figure, "a partition", "'partition'")
    return result.partition


def strips_of(result: Drawable, figure: str) -> "Strips":
    """The strips, or the error that says what to name."""
    if result.accurate is None:
        raise _missing(figure, "strips", "a 'partition' of kind accurate")
    return result.accurate.strips


def speed_of(result: Drawable, figure: str) -> "Speed":
    """The speeds of both maps, or the error that says what to name."""
    if result.speed is None:
        raise _missing(figure, "the speed of a map beside the exact one", "'partition'")
    return result.speed


def orbits_of(result: Drawable, figure: str) -> Sequence[Pair]:
    """The pairs of orbits, or the error that says what to name."""
    if not result.orbits:
        raise _missing(figure, "orbits", "'orbits'")
    return result.orbits


def bifurcation_of(result: Drawable, figure: str) -> Mapping[str, "Bifurcation"]:
    """The bifurcation diagrams by map, or the error that says what to name."""
    if not result.bifurcation:
        raise _missing(figure, "bifurcation diagrams", "'bifurcation'")
    return result.bifurcation


def lyapunov_of(result: Drawable, figure: str) -> "LyapunovSweep":
    """The Lyapunov exponents, or the error that says what to name."""
    if result.lyapunov is None:
        raise _missing(figure, "Lyapunov exponents", "'lyapunov'")
    return result.lyapunov


def basins_of(result: Drawable, figure: str) -> "Basins":
    """The basins over a grid, or the error that says what to name."""
    if result.basins is None or result.basins.grid is None:
        raise _missing(figure, "basins over a grid", "'basins'")
    two(result.basins.coordinates, figure)
    return result.basins


def noise_of(result: Drawable, figure: str) -> Any:
    """What noise does, or the error that says what to name."""
    if result.noise is None:
        raise _missing(figure, "orbits under noise", "'noise'")
    return result.noise


def domains_of(result: Drawable, figure: str) -> Mapping[str, "AttractingDomain"]:
    """The attracting domains by name, or the error that says what to name."""
    if not result.domains:
        raise _missing(figure, "attracting domains", "'domains'")
    return result.domains


def second_iterate_of(result: Drawable, figure: str) -> "SecondIterate":
    """The second iterate, or the error that says what to name."""
    if result.second_iterate is None:
        raise _missing(figure, "a second-iterate map", "'second_iterate'")
    return result.second_iterate


def morse_of(result: Drawable, figure: str) -> "MorseCover":
    """The cover, or the error that says what to name."""
    if result.morse is None:
        raise _missing(figure, "a cover of what stays in a window", "'morse'")
    return result.morse


def transient_of(result: Drawable, figure: str) -> "Transient":
    """The transient regions, or the error that says what to name."""
    if result.transient is None:
        raise _missing(figure, "transient regions", "'transient'")
    return result.transient


def position(coordinates: Sequence[str], coordinate: str) -> int:
    """The place of a coordinate's name among the system's, or an error that lists them."""
    if coordinate not in coordinates:
        raise NsmapsError(f"there is no coordinate {coordinate!r}; accepted: {', '.join(coordinates)}")
    return list(coordinates).index(coordinate)
