"""What a study's file may say: frozen models, one a section, in which an unknown key is an error."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, Discriminator, Field, PrivateAttr, Tag, model_validator

from nsmaps.errors import NsmapsError
from nsmaps.names import FigureName
from nsmaps.plugins import system_class
from nsmaps.reduced.condition import Number, read_number
from nsmaps.reduced.partition import Partition
from nsmaps.reduced.polyfit import Degree
from nsmaps.reduced.printed import PrintedMap
from nsmaps.study.branchspec import BranchSection, StabilitySection
from nsmaps.study.longrun import BasinsSection, LyapunovSection, NoiseSection
from nsmaps.study.ranges import SPEC, Name, Range, Span, Sweep, in_order
from nsmaps.study.source import Source

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

Bounds = dict[str, tuple[Number, Number]]


def scalar(value: object) -> object:
    """A number, a text that reads as one (`pi/3`), a switch, or a word; which of them fits is for the system to say."""
    if isinstance(value, bool | int | float):
        return value
    if not isinstance(value, str):
        raise ValueError("a parameter is one number, switch or word")
    try:
        return read_number(value)
    except NsmapsError:
        return value


Parameter = Annotated[Any, AfterValidator(scalar)]


def _kind_of_degrees(value: object) -> str:
    by_output = isinstance(value, dict) and any(isinstance(degree, dict) for degree in value.values())
    return "[by output]" if by_output else "[same]"


Degrees = Annotated[
    Annotated[dict[str, Degree], Tag("[same]")] | Annotated[dict[str, dict[str, Degree]], Tag("[by output]")],
    Discriminator(_kind_of_degrees),
]  #: degree by coordinate, or that for each output; one reading is chosen, so that errors are those of what was meant


def _one_of(given: dict[str, object], where: str) -> None:
    """A ValueError unless exactly one of the given keys has a value."""
    named = [name for name, value in given.items() if value is not None]
    if len(named) != 1:
        keys = " or ".join(repr(name) for name in given)
        raise ValueError(f"{where} has {' and '.join(map(repr, named)) or 'neither'}; accepted: exactly one of {keys}")


class FitSection(BaseModel):
    """The polynomial of a piece: `full` (eq. cubic2dv) or `separable` (remark separable), degrees by coordinate."""

    model_config = SPEC
    full: Degrees | None = None
    separable: dict[str, Degree] | None = None
    along: dict[str, Number] | None = None
    absolute: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        _one_of({"full": self.full, "separable": self.separable}, "a fit")
        if self.along is not None and self.separable is None:
            raise ValueError("'along' chooses the curves of a separable fit; accepted: beside 'separable' only")
        return self


class DiagonalSection(BaseModel):
    """The states whose image is near to them, united over a parameter (eq. r1uniond)."""

    model_config = SPEC
    family: str
    delta: Number = Field(gt=1)
    slope: Number | None = Field(None, gt=0)
    within: str | None = None
    sweep: Sweep | None = None
    orders: dict[Name, FitSection] = {}
    deltas: tuple[Annotated[Number, Field(gt=1)], ...] = ()
    grid: dict[str, Span] | None = None

    @model_validator(mode="after")
    def _orders_at_deltas(self) -> Self:
        if self.deltas and not self.orders:
            raise ValueError("'deltas' says where 'orders' are compared, and there are none; accepted: beside 'orders' only")
        return self


class PieceSection(BaseModel):
    """One piece of the composite map: where it holds, and what it says there."""

    model_config = SPEC
    name: Name
    box: Bounds | None = None
    where: str | None = None
    family: str | None = None
    fit: FitSection | None = None
    data: str | None = None  #: a condition, or `diagonal`: what the fit is made from instead of the piece's region
    reset: dict[str, Number] | None = None
    polynomial: PrintedMap | None = None  #: in a file also as `file#key`, which the reader puts in its place

    @model_validator(mode="after")
    def _one_region_one_map(self) -> Self:
        _one_of({"box": self.box, "where": self.where}, f"the piece {self.name!r}")
        _one_of({"fit": self.fit, "reset": self.reset, "polynomial": self.polynomial}, f"the piece {self.name!r}")
        if (self.family is None and self.fit is not None) or (self.family is not None and self.reset is not None):
            raise ValueError(f"the piece {self.name!r}: a fit needs the 'family' whose data it fits, a reset has none")
        if self.data is not None and self.fit is None:
            raise ValueError(f"the piece {self.name!r}: 'data' says what a fit is made from, and it has none")
        return self


class ParametricSection(BaseModel):
    """The composite map with coefficients that are polynomials of a parameter, from its values at Chebyshev nodes."""

    model_config = SPEC
    parameter: str
    low: Number = Field(alias="from")
    high: Number = Field(alias="to")
    order: int = Field(4, ge=0, le=20)
    nodes: int | None = Field(None, ge=1, le=100)  #: twice the order and one if omitted
    require: tuple[Literal["follows"], ...] = ()
    _in_order = model_validator(mode="after")(in_order)

    @model_validator(mode="after")
    def _enough(self) -> Self:
        if self.nodes is not None and self.nodes <= self.order:
            raise ValueError(f"{self.nodes} nodes for order {self.order}; accepted: more nodes than the order")
        return self


class OrbitSection(BaseModel):
    """A start and how many returns to follow it, under the exact map and the composite map."""

    model_config = SPEC
    start: dict[str, Number]
    returns: int = Field(ge=1)
    track: int | None = Field(None, ge=2, le=10_000)  #: impacts on all walls that are kept, with the motion between them


class SliceSection(BaseModel):
    """First returns along one coordinate, the others held."""

    model_config = SPEC
    at: dict[str, Number]
    along: dict[str, Span] = Field(min_length=1, max_length=1)


class BifurcationSection(Range):
    """What maps do in the long run over a parameter: of the `exact` map, of the `composite` map refitted at each value."""

    start: dict[str, Number]
    transient: int = Field(2000, ge=0)
    returns: int = Field(60, ge=1)  #: kept, after those of the transient
    follow: Literal["up", "down", "both"] | None = None
    of: tuple[Literal["exact", "composite"], ...] = ("exact",)

    @model_validator(mode="after")
    def _of_some(self) -> Self:
        if not self.of:
            raise ValueError("'of' names no map; accepted: 'exact', 'composite' or both")
        return self


class DomainSection(BaseModel):
    """The attracting domain of one map from one box: of a piece, of the `exact` map, or of the `composite` map."""

    model_config = SPEC
    name: Name
    map: str
    box: Bounds | Literal["diagonal"]  #: `diagonal`: the hull of the states near the diagonals at the study's own parameters
    bounds: Literal["outer", "inflated", "enclosed", "sampled"] | None = None  #: the best that the map allows, if omitted
    updates: int = Field(11, ge=1)
    grow: bool = False  #: start from the smallest box around this one that the map carries into itself
    require: tuple[Literal["trapped", "settled"], ...] = ()


class SecondIterateSection(BaseModel):
    """The second iterate of the piece of one domain, between the bounds of its last auxiliary maps (eq. seconditerativev)."""

    model_config = SPEC
    domain: str


class MorseSection(BaseModel):
    """What the exact map does for ever within a window: a cover by cells, halved `depth` times."""

    model_config = SPEC
    box: Bounds
    depth: int = Field(4, ge=0, le=12)
    cells: int = Field(8, ge=1)  #: an axis, of the first level
    require: tuple[Literal["trapped"], ...] = ()


class TransientSection(BaseModel):
    """Which part of each piece's region the exact map leaves, and takes to the closed set of `morse`, within how many returns."""

    model_config = SPEC
    box: Bounds
    depth: int = Field(3, ge=0, le=12)
    cells: int = Field(32, ge=1)
    period: int | None = Field(None, ge=1, le=12)  #: cycles up to it are looked for in the window


class Study(BaseModel):
    """One study: a system by name, its parameters, and what is to be computed of it.

    It holds the system's name, not the system, so that it can be written to a file and read again.
    """

    model_config = SPEC
    name: str = Field("study", max_length=500, pattern=r"^\w[\w .+=-]*(/\w[\w .+=-]*)*$")
    title: str = Field("", max_length=2000)
    system: str = Field(max_length=1000)
    parameters: dict[str, Parameter] = {}
    grid: dict[str, Span] | None = None
    families: dict[Name, tuple[str, ...]] = {}
    slices: tuple[SliceSection, ...] = ()
    diagonal: DiagonalSection | None = None
    composite: tuple[PieceSection, ...] = ()
    partition: Partition | None = None  #: instead of `composite`: the pieces are found by the general algorithm
    parametric: ParametricSection | None = None
    orbits: tuple[OrbitSection, ...] = ()
    bifurcation: BifurcationSection | None = None
    branches: tuple[BranchSection, ...] = ()
    stability: StabilitySection | None = None
    lyapunov: LyapunovSection | None = None
    basins: BasinsSection | None = None
    noise: NoiseSection | None = None
    domains: tuple[DomainSection, ...] = ()
    second_iterate: SecondIterateSection | None = None
    morse: MorseSection | None = None
    transient: TransientSection | None = None
    figures: tuple[FigureName, ...] = ()
    require: tuple[Literal["covered", "tolerance"], ...] = ()
    expected_failures: dict[str, str] = {}  #: what the failure of a verdict that is not required shows, by its name
    _source: Source = PrivateAttr(default=Source())

    def model_post_init(self, context: Any) -> None:
        """Keep where the study was read from, for the errors found later."""
        self._source = context if isinstance(context, Source) else Source(self.name)

    @property
    def source(self) -> Source:
        """Where the study was read from."""
        return self._source

    def system_object(self) -> "ImpactSystem":
        """The system with the study's parameters; errors as `system_class`, and pydantic's ValidationError, for its places."""
        return system_class(self.system)(**self.parameters)

    def names(self, section: str) -> bool:
        """Whether the study names a section."""
        return bool(dict(self)[section])


def name_of(path: Path) -> str:
    """The name of a study that gives none: its file's stem, without characters that a folder cannot bear."""
    return re.sub(r"[^\w.+-]+", "_", path.stem).lstrip(".+-") or "study"
