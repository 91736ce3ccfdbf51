"""The pieces of a composite map, in their order."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.errors import check_known
from nsmaps.reduced.conditions.region import Region
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.results import Result


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Piece(Result):
    """One piece of a composite map: its region and its map."""

    name: str
    region: Region
    map: PolyMap
    word: str = ""  #: the most frequent word of its data; "" for a reset or where none is known
    returns: int = 1  #: successive returns after which the image is reached, as 2 for the word BBTB

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{self.name}: {self.word or 'reset'}, {self.map}"

    @property
    def title(self) -> str:
        """Its name on one line, with its word and its number of returns where it is several."""
        about = ", ".join([self.word] * bool(self.word) + [f"{self.returns} returns"] * (self.returns > 1))
        return " ".join(self.name.split()) + (f" ({about})" if about else "")


def piece_named(pieces: Sequence[Piece], name: str) -> Piece:
    """The piece of a name among some."""
    named = {piece.name: piece for piece in reversed(pieces)}
    check_known("no piece", name, [piece.name for piece in pieces])
    return named[name]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Pieces(WithCoordinates):
    """Pieces over the same coordinates, of which the first that contains a state applies."""

    coordinates: Coordinates
    walls: tuple[str, ...]
    pieces: tuple[Piece, ...]
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def several(self) -> bool:
        """True if the image of a piece is that of several returns."""
        return any(piece.returns > 1 for piece in self.pieces)
