"""Kinds of values in a study's file: names, boxes, spans from, to, points."""

from collections.abc import Mapping
from typing import Annotated, Literal, Protocol, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from nsmaps.files.reading import odd_character
from nsmaps.reduced.conditions.condition import Number

DIAGONAL = "diagonal"  #: the states near the diagonals as data of a fit, or their hull as a box
ATTRACTING = "attracting"  #: the map of the attracting pieces of a partition


def _in_a_line(name: str) -> str:
    if len(name.splitlines()) != 1 or odd_character(name):
        raise ValueError(f"{name!r} is not a name; expected: one line of text")
    return name


MAPS = ("exact", "composite", "parametric")  #: names of maps, which no piece may have
Name = Annotated[str, Field(min_length=1, max_length=100), AfterValidator(_in_a_line)]  #: of a part of a study
Bounds = dict[str, tuple[Number, Number]]  #: a box: low and high by coordinate


def _in_order(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] < ends[1]:
        raise ValueError(f"[{ends[0]:g}, {ends[1]:g}] is empty; expected: the lower end first")
    return ends


Ends = Annotated[tuple[Number, Number], AfterValidator(_in_order)]  #: of a range of a parameter
Starts = Annotated[tuple[dict[str, Number], ...], Field(min_length=1)]  #: states by coordinate
Points = Annotated[int, Field(ge=2, le=100_000, description="number of equally spaced values, both ends included")]

# Keys that several analyses have.
ParameterName = Annotated[str, Field(description="a parameter of the system")]
Period = Annotated[int, Field(ge=1, description="period of the orbit, in returns")]
MaxPeriod = Annotated[
    int, Field(ge=1, description="largest period sought in the last returns alone; orbits without one are continued")
]
MaxReturns = Annotated[int, Field(ge=1, description="returns after which a start that has not arrived is given up")]
Transient = Annotated[int, Field(ge=0, description="returns that are made first and discarded")]
Tolerance = Annotated[
    Number, Field(gt=0, description="distance at which states repeat, in each coordinate, in units of the motion")
]
Seed = Annotated[int, Field(ge=0, description="seed of the random numbers")]
Depth = Annotated[int, Field(ge=0, le=12, description="how often cells are halved along each axis")]
CellsPerAxis = Annotated[int, Field(ge=1, description="cells per axis before they are halved")]


class _Ends(Protocol):
    low: float
    high: float


E = TypeVar("E", bound=_Ends)


def in_order(span: E) -> E:
    """The span; raises ValueError if it is empty."""
    if not span.low < span.high:
        raise ValueError(f"from {span.low:g} to {span.high:g} is empty; expected: 'from' below 'to'")
    return span


class Section(BaseModel):
    """A part of a study's file: a frozen model whose fields are its only keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


class Span(Section):
    """Equally spaced values of one coordinate or parameter, both ends included."""

    low: Number = Field(alias="from", description="first value")
    high: Number = Field(alias="to", description="last value")
    points: Points
    _in_order = model_validator(mode="after")(in_order)


class Side(Span):
    """Equally spaced values of one coordinate of a grid, both ends included, or one number at which it is held."""

    points: int = Field(ge=1, le=100_000, description="number of equally spaced values, both ends included")

    @model_validator(mode="before")
    @classmethod
    def _held(cls, given: object) -> object:
        return given if isinstance(given, Mapping | Span) else {"from": given, "to": given, "points": 1}

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        return self if self.points == 1 and self.low == self.high else in_order(self)


class Sweep(Section):
    """Equally spaced values of a parameter, both ends included, up or down."""

    parameter: ParameterName
    low: Number = Field(alias="from", description="first value")
    high: Number = Field(alias="to", description="last value")
    points: Points


class Range(Sweep):
    """Equally spaced values of a parameter, both ends included, in order."""

    _in_order = model_validator(mode="after")(in_order)


def one_of(given: dict[str, object], where: str) -> None:
    """Raise ValueError unless exactly one of the given keys has a value."""
    named = [name for name, value in given.items() if value is not None]
    if len(named) != 1:
        keys = " or ".join(repr(name) for name in given)
        raise ValueError(f"{where} has {' and '.join(map(repr, named)) or 'neither'}; expected: exactly one of {keys}")


def _with_exact(maps: tuple[str, ...]) -> tuple[str, ...]:
    if "exact" not in maps:
        expected = "[exact] or [exact, composite], as the latter is compared with it"
        raise ValueError(f"[{', '.join(maps)}] lacks the exact map; expected: {expected}")
    return maps


#: the exact map, beside which the composite map may be shown
Compared = Annotated[tuple[Literal["exact", "composite"], ...], AfterValidator(_with_exact)]
