"""What figures take of results: planes, positions of coordinates, and the domains that bound something."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.exact.surfaces.surface import Grid

T = TypeVar("T")


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


def invariant_or_first(domains: "Mapping[str, AttractingDomain]") -> "dict[str, AttractingDomain]":
    """The domains whose boxes are forward invariant; where none is, the first alone."""
    invariant = {name: domain for name, domain in domains.items() if domain.forward_invariant}
    return invariant or dict([*domains.items()][:1])


class Bounded(NamedTuple):
    """Updates of a domain, between whose bounds a second iterate is taken."""

    name: str  #: of the domain
    domain: "AttractingDomain"
    updates: Sequence[int] = ()  #: numbers of those that are shown, the second and the last if empty


class SeparablePiece(NamedTuple):
    """A piece with a separable fit, as it was asked for."""

    name: str
    family: str  #: whose states are fitted
    degrees: dict[str, int]  #: by coordinate
    lines: dict[str, float] | None  #: values at which the other coordinates are held, medians if None
