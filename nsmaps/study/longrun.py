"""What a study's file may say of the long run: Lyapunov exponents, basins of attraction, noise."""

from typing import Literal, Self

from pydantic import BaseModel, Field, model_validator

from nsmaps.reduced.condition import Number
from nsmaps.study.ranges import SPEC, Name, Range


class LyapunovSection(Range):
    """Lyapunov exponents of the exact map over a parameter."""

    start: dict[str, Number]
    returns: int = Field(10_000, ge=32)  #: that count, after those of the transient
    transient: int = Field(1000, ge=0)
    follow: Literal["up", "down"] | None = None


class BasinsSection(BaseModel):
    """Basins of attraction of the exact map over the study's grid."""

    model_config = SPEC
    returns: int = Field(1000, ge=1)
    tolerance: Number = Field(1e-6, gt=0)
    longest: int = Field(32, ge=1)
    boundary: Number | None = Field(None, gt=0)  #: tolerance of the points between basins; none are looked for if omitted


class ImpactsSection(Range):
    """The impacts of the exact map over a parameter, down and up, without noise and with noise of this size."""

    sigma: Number = Field(gt=0)
    returns: int = Field(40, ge=1)
    transient: int = Field(300, ge=0)


class NoiseSection(BaseModel):
    """Ornstein-Uhlenbeck forcing: residence in motions for each of its sizes, and impacts over a parameter."""

    model_config = SPEC
    sigma: tuple[Number, ...] = Field(min_length=1)
    tau: Number = Field(gt=0)
    start: dict[str, Number]
    returns: int = Field(2000, ge=1)
    realisations: int = Field(16, ge=1)
    seed: int = Field(0, ge=0)
    step: Number | None = Field(None, gt=0)
    modes: dict[Name, tuple[str, ...]] = Field(min_length=1)
    hold: int = Field(12, ge=1)
    impacts: ImpactsSection | None = None

    @model_validator(mode="after")
    def _in_bounds(self) -> Self:
        if min(self.sigma) < 0:
            raise ValueError(f"a noise of size {min(self.sigma):g}; accepted: zero or more")
        if self.step is not None and self.step > self.tau:
            raise ValueError(f"a step of {self.step:g}; accepted: at most tau = {self.tau:g}")
        longest = max(map(len, self.modes.values()))
        if not all(self.modes.values()) or self.hold < longest:
            raise ValueError(f"hold is {self.hold}; accepted: motions of one or more words, held for {longest} returns or more")
        return self
