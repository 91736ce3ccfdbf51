"""The specification of a partition, the map that replaces an exact one in a box."""

from typing import ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, InstanceOf, model_validator

from nsmaps.arrays import Storable
from nsmaps.exact.surfaces.family import ReturnFamily
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.conditions.region import Region
from nsmaps.reduced.fit.polyfit import PolyFit

Role = Literal["attracting", "transient"]


class PartitionChoices(BaseModel):
    """The choices of a partition that are numbers and words."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    tolerance: Number = Field(gt=0, description="largest error of an image, in each coordinate, where the map attracts")
    kind: Literal["closed_form", "accurate"] = Field(
        "closed_form",
        description="few pieces of low order, or strips that meet the tolerance everywhere, with no key but `tolerance`",
    )
    max_pieces: int = Field(
        40, ge=2, description="at which refinement ends, resets not counted; attracting pieces take at most two thirds"
    )
    max_order: int = Field(5, ge=0, le=20, description="highest degree in each coordinate")
    separable: bool = Field(True, description="transient pieces may be separable")
    everywhere: bool = Field(False, description="the tolerance holds for transient pieces too, but for 1 % of their states")
    delta: Number = Field(1.2, gt=1, description="nearness to the diagonals, as in `diagonal`")
    slope: Number = Field(2.0, gt=0, description="largest slope near the diagonals, as in `diagonal`")

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        others = sorted(self.model_fields_set - {"tolerance", "kind"})
        if self.kind == "accurate" and others:
            raise ValueError(f"{', '.join(map(repr, others))}: of closed forms only; expected beside kind accurate: 'tolerance'")
        return self


class Partition(PartitionChoices, Storable):
    """The specification of the reduced map of a system; the tolerance is the only choice that must be made.

    Results of runs hold it without the objects of classes.
    """

    unstored: ClassVar = ("attracting", "regions", "orders", "families")

    attracting: tuple[InstanceOf[Region] | dict[str, tuple[Number, Number]], ...] = Field(
        default=(), description="attracting boxes or other regions in place of those of step iii"
    )
    regions: tuple[InstanceOf[Region], ...] = Field(
        default=(), description="first cells: no piece lies in one of them and beside it; the first that holds a state counts"
    )
    orders: dict[str, InstanceOf[PolyFit]] = Field(
        default={}, description="fits that are tried in turn, in place of polynomials up to max_order"
    )
    families: tuple[InstanceOf[ReturnFamily], ...] = Field(
        default=(), description="by which returns are sorted before their words; the first that contains a return counts"
    )

    @model_validator(mode="after")
    def _of_first_returns(self) -> Self:
        for family in self.families:
            if family.max_returns > 1:
                several = f"the family {family.name!r} has max_returns = {family.max_returns}"
                raise ValueError(f"{several}, and a partition is of first returns; expected: 1")
        return self
