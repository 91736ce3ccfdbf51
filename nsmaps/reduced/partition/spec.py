"""The specification of a partition, the map that replaces an exact one in a box."""

from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from nsmaps.reduced.conditions.condition import Number

Role = Literal["attracting", "transient"]


class Partition(BaseModel):
    """The specification of the reduced map of a system; the tolerance is the only choice that must be made."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    tolerance: Number = Field(gt=0, description="largest error of an image where the map attracts, in each coordinate")
    kind: Literal["closed_form", "accurate"] = Field(
        default="closed_form", description="few pieces in closed form, or the tolerance everywhere"
    )
    max_pieces: int = Field(default=40, ge=2, description="at which refinement ends")
    max_order: int = Field(default=5, ge=0, le=20, description="highest degree in each coordinate")
    separable: bool = Field(default=True, description="true if transient pieces may be separable (remark separable)")
    everywhere: bool = Field(default=False, description="true if the tolerance applies to transient pieces too")
    delta: Number = Field(default=1.2, gt=1, description="nearness to the diagonals, eq. r1uniond")
    slope: Number = Field(default=2.0, gt=0, description="upper bound on abs(dx'_i/dx_i) near the diagonals")
    attracting: tuple[dict[str, tuple[Number, Number]], ...] = Field(
        default=(), description="attracting boxes in place of those of step iii"
    )

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        others = sorted(self.model_fields_set - {"tolerance", "kind"})
        if self.kind == "accurate" and others:
            raise ValueError(f"{', '.join(map(repr, others))}: of closed forms only; expected beside kind accurate: 'tolerance'")
        return self
