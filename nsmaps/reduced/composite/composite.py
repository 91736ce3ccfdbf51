"""The composite map: ordered pieces, of which the first that contains a state applies (eq. compositemapM, the pseudocode)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Protocol, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from nsmaps.arrays import ArrayLike, Floats, Ints, finite_rows
from nsmaps.coordinates import Coordinates, as_states
from nsmaps.errors import FitError, NsmapsError, check_known
from nsmaps.errors.arguments import checked
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Grid, Surface
from nsmaps.reduced.composite.piece import Piece as Piece
from nsmaps.reduced.composite.piece import Pieces
from nsmaps.reduced.composite.piece import piece_named as piece_named
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.conditions.region import Region
from nsmaps.reduced.fit.polyfit import PolyFit
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.results import NONE, Result, array, shares_text

ONCE = 10_000_000  #: regions times states that NumPy evaluates in the time of loading the compiled loop
SAMPLE = 100  #: number of uncovered states that a coverage lists as examples


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Coverage(Result):
    """The part of a set of states that the pieces of a composite map cover."""

    names: tuple[str, ...]
    points: int
    fraction: float  #: share of the states that lie in a piece; NaN without states
    fractions: Floats = field(metadata=array("piece", "share of the states that each piece decides", NONE))
    uncovered: Floats = field(
        metadata=array("state component", "at most a hundred of the states in no piece, spread over all of them")
    )
    boxes: Floats = field(metadata=array("box component end", "the hull of the states in no piece: one box, or none"))

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{100 * self.fraction:.4g} % of {self.points} states in a piece: {shares_text(self.names, self.fractions)}"

    @property
    def covered(self) -> bool:
        """True if every state lies in a piece."""
        return self.fraction == 1.0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CompositeMap(Pieces, ReturnMap, Result):
    """A return map of pieces; a ReturnMap like an exact system. Regions see angles in [0, 2 pi)."""

    picture: ClassVar[str] = "nsmaps.figures.composite.regions"

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{len(self.pieces)} pieces in ({self.coordinates}): {', '.join(each.name for each in self.pieces)}"

    def piece_of(self, states: ArrayLike) -> Ints:
        """The number of the first piece that contains each state (N, n), -1 where there is none; shape (N,)."""
        return np.maximum(self._pieces_of(as_states(states, self.coordinates)), -1)

    def piece_once(self, states: ArrayLike) -> Ints:
        """As `piece_of`, for states that are looked up once: by the regions where that is faster than loading compiled code."""
        x = self.coordinates.wrap(as_states(states, self.coordinates))
        if len(self.pieces) * len(x) > ONCE:
            return self.piece_of(x)
        number, left = np.full(len(x), -1), np.flatnonzero(finite_rows(x))
        for k, piece in enumerate(self.pieces):
            holds = piece.region.contains(x[left])
            number[left[holds]] = k
            left = left[~holds]
        return number

    def piece(self, name: str) -> Piece:
        """The piece of a name."""
        return piece_named(self.pieces, name)

    @property
    def title(self) -> str:
        """What it is called in results, with its pieces of several returns: `composite map (2 returns by R2)`."""
        names = {piece.returns: [each.name for each in self.pieces if each.returns == piece.returns] for piece in self.pieces}
        about = "; ".join(f"{number} returns by {', '.join(names[number])}" for number in sorted(names) if number > 1)
        return f"composite map ({about})" if about else "composite map"

    def returns_of(self, states: ArrayLike) -> Ints:
        """The number of returns of the piece that contains each state (N, n), 1 where there is none; shape (N,)."""
        return np.array([piece.returns for piece in self.pieces] + [1])[self.piece_of(states)]

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The first returns of states (N, n) by the map of their piece.

        The image of a piece of several returns is that after all of them, see `Returns.number`. A state in no piece is
        `uncovered`, one that is NaN or infinite `invalid`. Images are the values of the polynomials,
        even where they are not states, as at a negative speed: no piece contains them unless its region does. Times
        are NaN, and no image is `certified`.
        """
        from nsmaps.reduced.composite.compiled import compiled

        start, fast = as_states(states, self.coordinates), compiled(self)
        number = np.empty(len(start), np.int64)
        returns = fast.first_returns(start, number)
        return replace(returns, derivative=self._derivative(start, number)) if derivative else returns

    def orbits(self, states: ArrayLike, n_returns: int, derivative: bool = False) -> Returns:
        """The first returns of each of M states, shape (M, dim): `n_returns` M rows, the first return of every state first.

        They are computed in one compiled loop. The outcome that ended an orbit is repeated.
        """
        from nsmaps.reduced.composite.compiled import compiled

        returns = compiled(self).orbits(as_states(states, self.coordinates), n_returns)
        return replace(returns, derivative=self._slopes(returns.start)) if derivative else returns

    def _slopes(self, states: Floats) -> Floats:
        """The derivatives at states (N, n), shape (N, n, n)."""
        return self._derivative(states, self._pieces_of(states))

    def coverage(self, states: Grid | ArrayLike) -> Coverage:
        """The part of a grid or of states (N, n) that the pieces cover, and the states outside."""
        x = as_states(states.states() if isinstance(states, Grid) else states, self.coordinates)
        number = self.piece_of(x)
        missed = x[number < 0]
        finite = missed[finite_rows(missed)]
        hull = [np.stack([finite.min(axis=0), finite.max(axis=0)], axis=1)] if len(finite) else []
        counts = np.bincount(number + 1, minlength=len(self.pieces) + 1)
        sample = np.unique(np.linspace(0, max(0, len(missed) - 1), SAMPLE).astype(int))[: len(missed)]
        return Coverage(
            names=tuple(piece.name for piece in self.pieces),
            points=len(x),
            fraction=1.0 - len(missed) / len(x) if len(x) else math.nan,
            fractions=counts[1:] / (len(x) or math.nan),
            uncovered=missed[sample],
            boxes=np.array(hull).reshape(-1, len(self.coordinates), 2),
        )

    def _pieces_of(self, states: Floats) -> Ints:
        """As `piece_of`, -2 for a state that is not finite."""
        from nsmaps.reduced.composite.compiled import compiled

        return compiled(self).pieces_of(states)

    def _derivative(self, states: Floats, number: Ints) -> Floats:
        """The derivatives of the pieces' maps at states (N, n), shape (N, n, n); NaN in no piece."""
        slopes = np.full((*states.shape, states.shape[1]), np.nan)
        for k, piece in enumerate(self.pieces):
            rows = np.flatnonzero(number == k)
            if len(rows):
                slopes[rows] = piece.map.derivative(self._near(piece.map, states[rows]))
        return slopes

    def _near(self, polymap: PolyMap, states: Floats) -> Floats:
        """The states with angles on the turn nearest to the fitted box."""
        return self.coordinates.lift(states, polymap.middle)


class PieceLike(Protocol):
    """The protocol of a piece's construction: its region, and either a family and a fit or a reset."""

    @property
    def name(self) -> str: ...
    @property
    def region(self) -> Region: ...
    @property
    def family(self) -> str | None: ...
    @property
    def fit(self) -> PolyFit | None: ...
    @property
    def data(self) -> Region | None: ...
    @property
    def reset(self) -> Mapping[str, float] | None: ...


class PieceSpec(BaseModel):
    """The construction of a piece: fitted to a family's surface, or a reset of some coordinates to constants.

    The data of a fit are the states of `data`, those of the region if it is omitted.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    region: Region
    family: str | None = None
    fit: PolyFit | None = None
    data: Region | None = None
    reset: dict[str, Number] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        _one_way(self)
        return self


@checked
def build_composite(
    coordinates: Sequence[str], walls: Sequence[str], surfaces: Mapping[str, Surface], pieces: Sequence[PieceLike]
) -> CompositeMap:
    """The composite map of pieces, each fitted to the part of its family's surface in its region, or in that of its data.

    A piece is fitted on its whole region, including states that earlier pieces decide: the paper's representative curves of R2
    run through R1 (remark R1R2overlap).

    Raises:
        FitError: names the piece, and states the error in its family, its data, its region or its fit.
    """
    built, names = list[Piece](), Coordinates(coordinates)
    for piece in pieces:
        if piece.name in {other.name for other in built}:
            raise FitError(f"piece {piece.name!r}: two pieces have this name; expected: distinct names")
        try:
            built.append(_piece(names, surfaces, piece))
        except ValidationError as error:
            raise FitError(f"piece {piece.name!r}: {error.errors()[0]['msg']}") from error
        except NsmapsError as error:
            raise FitError(f"piece {piece.name!r}: {error}") from error
    units = next((surface.units for surface in surfaces.values()), {})
    return CompositeMap(names, tuple(walls), tuple(built), units)


def _piece(coordinates: Coordinates, surfaces: Mapping[str, Surface], piece: PieceLike) -> Piece:
    _one_way(piece)
    region = piece.region.over(coordinates)
    if piece.reset is not None:
        return Piece(piece.name, region, PolyMap.reset(coordinates, piece.reset))
    assert piece.fit is not None
    data = data_of(coordinates, surfaces, piece)
    values, counts = np.unique(data.returns.words, return_counts=True)
    return Piece(piece.name, region, piece.fit.fit(data), str(values[np.argmax(counts)]), _returns_of(data))


def _returns_of(data: Surface) -> int:
    """The number of returns of all members among the data of a piece."""
    numbers, counts = np.unique(data.returns.numbers, return_counts=True)
    if len(numbers) > 1:
        many = ", ".join(f"{count} of {number}" for number, count in zip(numbers.tolist(), counts.tolist(), strict=True))
        raise FitError(
            f"members of the family {data.name!r} among its data are of different numbers of returns ({many}); expected: one "
            "number, by which its images count: a family of words of so many returns, or a region or `data` with these alone"
        )
    return int(numbers[0])


def data_of(coordinates: Coordinates, surfaces: Mapping[str, Surface], piece: PieceLike) -> Surface:
    """The data of a piece: its family's surface within the region of its data. FitError where there is none."""
    family, region = piece.family or "", (piece.data or piece.region).over(coordinates)
    check_known("no surface of a family", family, surfaces, FitError)
    surface = surfaces[family]
    if surface.coordinates != coordinates:
        raise FitError(f"the surface has the coordinates {surface.coordinates}; expected: {coordinates}")
    inside = surface.restrict(region.contains(coordinates.wrap(surface.start)))
    if not len(inside.start):
        raise FitError(f"no data of family {family!r} where {region.condition()}; {_whereabouts(surface)}")
    return inside


def _one_way(piece: PieceLike) -> None:
    """Raise a FitError unless a piece is either fitted or a reset."""
    if (piece.fit is None) == (piece.reset is None) or (piece.fit is None) != (piece.family is None):
        given = [key for key in ("family", "fit", "reset") if getattr(piece, key) is not None]
        raise FitError(f"it has {' and '.join(given) or 'no map'}; expected: a family and a fit, or a reset alone")


def _whereabouts(surface: Surface) -> str:
    if not len(surface.start):
        return "the family has no data; expected: a family whose words occur on the grid, or another grid"
    ends = zip(surface.coordinates, surface.start.min(axis=0), surface.start.max(axis=0), strict=True)
    hull = ", ".join(f"{name} in [{low:.6g}, {high:.6g}]" for name, low, high in ends)
    angles = ", and regions see angles in [0, 2 pi)" if surface.coordinates.angles.any() else ""
    return f"the family's {len(surface.start)} states lie within {hull}{angles}"
