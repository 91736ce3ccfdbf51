"""The auxiliary maps of one coordinate: the largest and smallest image over the others, eq. auxv and auxphi."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol, Self

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import Coordinates
from nsmaps.enclosures.branch_and_bound import Ranges
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.results import Result, array


class PlainMap(Protocol):
    """A map given by a formula, such as a PolyMap: states (N, n) to images (N, n), angles not wrapped."""

    @property
    def coordinates(self) -> Sequence[str]:
        """The names of the n coordinates."""

    def __call__(self, states: Floats) -> Floats:
        """Images of states of shape (N, n)."""


AnyMap = ReturnMap | PlainMap

CURVES = 9  #: of a family that are kept


def image_function(return_map: AnyMap, box: Floats) -> Callable[[Floats], Floats]:
    """The map as a function of states (N, n) whose angles come out on the turn nearest to the box's centre, shape (n, 2)."""
    coordinates = Coordinates(return_map.coordinates)
    centre = box.mean(axis=1)
    if isinstance(return_map, ReturnMap) or not callable(return_map):
        exact = ReturnMap.require(return_map, "a domain")

        def of_returns(states: Floats) -> Floats:
            return coordinates.lift(exact.first_return(states).image, centre)

        return of_returns
    plain = return_map
    image = plain(centre[None, :])[0]
    turns = image - coordinates.lift(image, centre)  # one for all, so that the formula stays continuous
    return lambda states: plain(states) - turns


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Envelope(Result):
    """The auxiliary maps of one coordinate: for each of its values the extreme images over all others in the box.

    Where the family of curves does not cross, which the sign of the derivatives proves, they are two of its curves, in closed
    form (as xi_U and xi_L of the paper); where it does, they are numbers (as eta_U and eta_L).
    """

    coordinate: str
    x: Floats = field(metadata=array("sample", "values of the coordinate, both ends of its interval included"))
    lower: Floats = field(metadata=array("sample", "xi_L or eta_L"))
    upper: Floats = field(metadata=array("sample", "xi_U or eta_U"))
    family: Floats = field(metadata=array("curve sample", "some of the curves between: the images with the others held"))
    others: Floats = field(
        metadata=array("curve component", "the states at which they are held, along the box's diagonal; NaN the coordinate's own")
    )
    kind: Literal["closed form", "numeric"] = "numeric"
    status: str = "sampled"  #: how the numbers bound: see `auxiliary_maps`
    held: Floats | None = field(
        default=None,
        metadata=array("component end", "of a closed form the others' values on the lower and the upper curve; NaN its own"),
    )
    slopes: Floats | None = field(
        default=None,
        metadata=array("component end", "outer bounds of the derivative by each coordinate over the box, of polynomials"),
    )

    def summary(self) -> str:
        """The numbers that matter."""
        ends = f"{np.nanmin(self.lower):.6g} to {np.nanmax(self.upper):.6g}"
        return f"{self.coordinate} over [{self.x[0]:.6g}, {self.x[-1]:.6g}]: images from {ends}, {self.status}, {self.kind}"


@dataclass(frozen=True, slots=True, eq=False)
class Extremes:
    """The worst case of every coordinate over an interval of its own values, eq. WCScobweb."""

    bounds: Floats  #: shape (n, 2), the least of the lower and the largest of the upper map
    at: Floats  #: shape (n, 2, 2), an interval of the coordinate's values that holds the place of each
    ranges: Ranges | None = None  #: where they come from, for intervals within these


class AuxiliaryMaps(Protocol):
    """The lower and upper maps of every coordinate on one box, eq. auxv and auxphi."""

    @property
    def status(self) -> str:
        """How they bound: outer, enclosed, inflated by an error, sampled."""

    @property
    def same(self) -> float:
        """A change of an interval, relative to its size, that counts as none."""

    def curves(self, index: int, x: ArrayLike) -> tuple[Floats, Floats]:
        """The lower and upper map of a coordinate at its values x, shape (m,)."""

    @classmethod
    def at(cls, maps: Sequence[Self], states: Floats, side: int) -> Floats:
        """The lower (side 0) or upper (1) maps of one map on several boxes, each at a state of its own: (U, n) to (U, n)."""

    def worst(self, intervals: Floats, known: Extremes | None = None) -> Extremes:
        """The worst case over an interval of each coordinate, shape (n, 2), with that known over some that hold these."""

    def places(self, intervals: Floats, known: Floats) -> Floats:
        """Where over K intervals, shape (K, n, 2), each is extreme, with what `worst` gave as `at`: both (K, n, 2, 2)."""

    def envelopes(self) -> tuple[Envelope, ...]:
        """The curves of every coordinate at equidistant values."""


def family(function: Callable[[Floats], Floats], index: int, x: Floats, box: Floats) -> tuple[Floats, Floats]:
    """Curves of one coordinate over its values x, shape (m,), with the others held: `Envelope.family` and `others`."""
    share = np.linspace(0, 1, CURVES)[:, None]
    others = box[:, 0] * (1 - share) + box[:, 1] * share
    states = np.repeat(others[:, None], len(x), axis=1)
    states[..., index] = x
    others[:, index] = np.nan
    return function(states.reshape(-1, len(box)))[:, index].reshape(CURVES, len(x)), others
