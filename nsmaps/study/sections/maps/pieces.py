"""A piece of the section `composite`: its region and its map."""

from collections.abc import Iterable
from typing import Self

from pydantic import BaseModel, model_validator

from nsmaps.figures.parts import SeparablePiece
from nsmaps.reduced.composite.printed import TabulatedMap
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.reading.classes import Condition, Instance
from nsmaps.study.reading.values import DIAGONAL, SPEC, Bounds, Name, Side, one_of
from nsmaps.study.sections.maps.fits import Fit, FitSection


class PieceSection(BaseModel):
    """One piece of the composite map: its region and its map."""

    model_config = SPEC
    name: Name
    box: Bounds | None = None
    where: str | None = None
    region: Instance | None = None
    family: str | None = None
    fit: Fit | None = None
    grid: dict[str, Side] | None = None  #: of the states of the data of the fit; that of the study if omitted
    data: Condition | None = None  #: of the fit: a condition, which may name parameters, a region, or `diagonal`; else the region
    reset: dict[str, Number] | None = None
    polynomial: TabulatedMap | None = None  #: in a file also as `file#key`, which the reader replaces

    @model_validator(mode="after")
    def _one_region_one_map(self) -> Self:
        one_of({"box": self.box, "where": self.where, "region": self.region}, f"the piece {self.name!r}")
        one_of({"fit": self.fit, "reset": self.reset, "polynomial": self.polynomial}, f"the piece {self.name!r}")
        if (self.family is None and self.fit is not None) or (self.family is not None and self.reset is not None):
            raise ValueError(f"the piece {self.name!r}: a fit needs the 'family' whose data it fits, a reset has none")
        if self.data is not None and self.fit is None:
            raise ValueError(f"the piece {self.name!r}: 'data' defines the data of a fit; expected: beside 'fit' only")
        if self.grid is not None and (self.fit is None or self.data == DIAGONAL):
            text = f"the piece {self.name!r}: 'grid' has the states of the data of a fit"
            raise ValueError(f"{text}; expected: beside 'fit' only, and without 'data: diagonal'")
        return self

    @property
    def separable(self) -> FitSection | None:
        """Its fit, if that is separable."""
        return self.fit if isinstance(self.fit, FitSection) and self.fit.separable is not None else None


def separable_pieces(pieces: Iterable[PieceSection]) -> dict[str, SeparablePiece]:
    """What a study says of each piece with a separable fit, by name."""
    return {
        piece.name: SeparablePiece(piece.name, piece.family, fit.separable, fit.lines)
        for piece in pieces
        if (fit := piece.separable) and fit.separable and piece.family
    }
