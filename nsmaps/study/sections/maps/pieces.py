"""A piece of the section `composite`: its region and its map."""

from collections.abc import Iterable
from typing import Self

from pydantic import Field, model_validator

from nsmaps.figures.parts import SeparablePiece
from nsmaps.reduced.composite.printed import TabulatedMap
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.reading.classes import Condition, Instance
from nsmaps.study.reading.values import DIAGONAL, Bounds, Name, Section, Side, one_of
from nsmaps.study.sections.maps.fits import Fit, FitSection


class PieceSection(Section):
    """A piece of the composite map: exactly one of `box`, `where`, `region`, and one of `fit`, `reset`, `polynomial`.

    A family may have words of several returns, such as BBTB; its image, after all of them, is one step of orbits and several
    returns of periods, exponents, basins and noise. A domain of such a map contains these images, not the states between.
    """

    name: Name = Field(description="not the name of a map")
    box: Bounds | None = Field(None, description="where the piece holds: this, `where` or `region`")
    where: str | None = Field(None, description="a condition: where the piece holds")
    region: Instance | None = Field(None, description="a region of a class: where the piece holds")
    family: str | None = Field(
        None, description="whose surface is fitted; with `polynomial` its first word is that of the returns"
    )
    fit: Fit | None = Field(None, description="the map: this, `reset` or `polynomial`")
    grid: dict[str, Side] | None = Field(
        None, description="states at which the family is computed for this fit; the study's by default"
    )
    data: Condition | None = Field(
        None,
        description="data of the fit: a region, in whose condition parameters may stand, or `diagonal`; else the piece's",
    )
    reset: dict[str, Number] | None = Field(None, description="the map: coordinates set to constants while the others stay")
    polynomial: TabulatedMap | None = Field(
        None, description="the map by given coefficients, also as `file#key` of a YAML or JSON file"
    )

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
