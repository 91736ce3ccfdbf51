"""What a study's file may say of parameters: branches of periodic orbits, and stability diagrams over two of them."""

from collections.abc import Mapping
from typing import Literal, Self

from pydantic import BaseModel, Field, model_validator

from nsmaps.reduced.condition import Number
from nsmaps.study.ranges import SPEC, Name, Range, in_order

Located = Literal["period doubling", "fold", "branch point", "Neimark-Sacker"]
Way = Literal["up", "down"]


class BranchSection(BaseModel):
    """A branch of periodic orbits of the exact map in one parameter, from the orbit near a state."""

    model_config = SPEC
    name: Name
    parameter: str
    low: Number = Field(alias="from")
    high: Number = Field(alias="to")
    start: dict[str, Number]
    at: Number | None = None  #: where the start is; the study's own value if omitted
    period: int = Field(1, ge=1)  #: in returns
    toward: Literal["up", "down", "both"] = "both"
    doublings: int = Field(0, ge=0, le=12)
    step: Number = Field(0.02, gt=1e-8, le=1)
    events: tuple[Located, ...] = ("period doubling", "fold", "branch point", "Neimark-Sacker")
    _in_order = model_validator(mode="after")(in_order)

    @model_validator(mode="after")
    def _located(self) -> Self:
        if self.doublings and "period doubling" not in self.events:
            raise ValueError("'doublings' follows period doublings; accepted: 'period doubling' among the 'events' beside it")
        return self

    def value(self, parameters: Mapping[str, float]) -> float:
        """Of the parameter at the start, in a system with these."""
        return parameters[self.parameter] if self.at is None else self.at

    @property
    def within(self) -> tuple[float, float]:
        """The range of the parameter."""
        return self.low, self.high

    @property
    def ways(self) -> tuple[Way, ...]:
        """In which it is followed, one branch each."""
        return ("up", "down") if self.toward == "both" else (self.toward,)


class CurveSection(BaseModel):
    """Where the first event of a kind on a branch lies, over the second parameter."""

    model_config = SPEC
    branch: str
    event: Located


class StabilitySection(BaseModel):
    """What attracts over two parameters: attractors are followed along the first, for each value of the second."""

    model_config = SPEC
    along: Range
    across: Range
    start: dict[str, Number]
    transient: int = Field(1000, ge=0)
    longest: int = Field(16, ge=1)
    follow: Way = "down"
    curves: tuple[CurveSection, ...] = ()

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.along.parameter == self.across.parameter:
            raise ValueError(f"'along' and 'across' are both of {self.along.parameter!r}; accepted: two parameters")
        return self
