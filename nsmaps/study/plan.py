"""A study made ready: its system, grid, regions and fits as objects, or an error at the line that is wrong."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.errors import SystemDefinitionError, UnknownSystemError
from nsmaps.exact.family import WordFamily, letters_of
from nsmaps.exact.impacts import Floats, encode
from nsmaps.exact.parts import Along
from nsmaps.exact.surface import Axis, Grid
from nsmaps.plugins import system_class
from nsmaps.reduced.condition import as_number
from nsmaps.reduced.diagonal import Diagonal
from nsmaps.reduced.polyfit import Full, PolyFit, Separable
from nsmaps.reduced.printed import PrintedMap
from nsmaps.reduced.region import Box, Region, Where
from nsmaps.study.branchspec import BranchSection
from nsmaps.study.needs import DIAGONAL, check_names, check_needs
from nsmaps.study.ranges import Range, Span
from nsmaps.study.source import Loc
from nsmaps.study.spec import Bounds, FitSection, PieceSection, SliceSection, Study

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True, eq=False)
class PiecePlan:
    """One piece of the composite map to be: its region, and the family and fit of its map, or its reset."""

    name: str
    region: Region
    family: str | None
    fit: PolyFit | None
    data: Where | None  #: what the fit is made from; None is the region, or the states near the diagonals
    near_diagonals: bool  #: whether the fit is made from the states near the diagonals
    reset: dict[str, float] | None
    polynomial: PrintedMap | None


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """The objects that a study describes, checked against its system; nothing is computed yet."""

    study: Study
    system: "ImpactSystem"
    grid: Grid | None
    families: dict[str, WordFamily]
    diagonal: Diagonal | None
    diagonal_grid: Grid | None
    orders: dict[str, PolyFit]
    pieces: tuple[PiecePlan, ...]
    slices: tuple[tuple[str, Axis, dict[str, float]], ...]  #: which coordinate runs, its values, what the others are held at
    starts: tuple[Floats, ...]  #: each of shape (n,)
    long_start: Floats | None  #: of the bifurcation diagram, shape (n,)
    cycles: tuple[Floats, ...]  #: the starts of the branches, each of shape (n,)
    begin: dict[str, Floats]  #: the starts of the sections `stability`, `lyapunov` and `noise`, each of shape (n,)
    boxes: dict[str, Box]  #: the start boxes of the domains that give one, by name
    windows: dict[str, Box]  #: of the sections `morse` and `transient`
    told: Callable[[float], None] = field(default=lambda share: None, compare=False)  #: called with the share of a step done
    keep: Path | None = field(default=None, compare=False)  #: a folder for finished parts of a step; None without a run folder

    def kept(self, *names: str) -> Path | None:
        """The folder for the parts of one of some computations of a step."""
        return self.keep and self.keep.joinpath(*names)

    def part(self, number: int, of: int, units: int) -> Callable[[int], None]:
        """A `progress` for one of some equal parts of a step, to be called with how many of its units are done."""
        return lambda done: self.told((number + done / units) / of)

    def levels(self, number: int, of: int, depth: int) -> Callable[..., None]:
        """As `part`, for cells that are divided `depth` times, to be called with the level; each takes about twice the last."""
        return lambda level, *_: self.told((number + 2.0 ** (level - depth)) / of)


def prepare(study: Study) -> Plan:
    """The study's objects, or a StudyError at the first line that does not fit the system or the rest of the study."""
    return _Maker(study, _system(study)).plan()


def _system(study: Study) -> "ImpactSystem":
    source = study.source
    try:
        cls = system_class(study.system)
    except (UnknownSystemError, SystemDefinitionError) as error:
        raise source.error(("system",), str(error)) from error
    texts = set(cls.model_fields) - set(cls.parameter_names())  # fields that are no numbers: a choice, a switch
    for name in [name for name in study.parameters if name not in texts]:
        with source.located(("parameters", name)):
            as_number(study.parameters[name])
    with source.located(("parameters",) if study.parameters else ("system",), cls):
        return study.system_object()


@dataclass(frozen=True, slots=True, eq=False)
class _Maker:
    """What turns sections into objects for one system."""

    study: Study
    system: "ImpactSystem"

    def plan(self) -> Plan:
        study = self.study
        check_names(study)
        check_needs(study)
        if (section := study.parametric) is not None:
            self.swept_values(("parametric",), section.parameter, (section.low, section.high))
        for name, long in (("bifurcation", study.bifurcation), ("lyapunov", study.lyapunov)):
            if long is not None:
                self.some_values((name,), long)
        return Plan(
            study=study,
            system=self.system,
            grid=self.grid(("grid",), study.grid),
            families={name: self.family(name, words) for name, words in study.families.items()},
            diagonal=self.diagonal(),
            diagonal_grid=self.grid(("diagonal", "grid"), study.diagonal.grid) if study.diagonal else None,
            orders=self.orders(),
            pieces=tuple(self.piece(number, piece) for number, piece in enumerate(study.composite)),
            slices=tuple(self.slice(("slices", number), section) for number, section in enumerate(study.slices)),
            starts=tuple(self.start(("orbits", number, "start"), orbit.start) for number, orbit in enumerate(study.orbits)),
            long_start=self.start(("bifurcation", "start"), study.bifurcation.start) if study.bifurcation else None,
            cycles=tuple(self.cycle(number, branch) for number, branch in enumerate(study.branches)),
            begin=self.begin(),
            boxes={d.name: self.box(("domains", k, "box"), d.box) for k, d in enumerate(study.domains) if d.box != DIAGONAL},
            windows={
                name: self.box((name, "box"), section.box)
                for name, section in (("morse", study.morse), ("transient", study.transient))
                if section is not None
            },
        )

    def begin(self) -> dict[str, Floats]:
        """The starts of the long run; noise must have motions of words that there are, and a parameter that there is."""
        study, noise = self.study, self.study.noise
        for name, words in noise.modes.items() if noise else ():
            with study.source.located(("noise", "modes", name)):
                for word in words:
                    encode(word, self.system.wall_names)
        if noise and (along := noise.impacts):
            self.swept_values(("noise", "impacts"), along.parameter, (along.low, along.high))
        if two := study.stability:
            self.some_values(("stability", "along"), two.along)
            self.some_values(("stability", "across"), two.across)
        sections = {"stability": study.stability, "lyapunov": study.lyapunov, "noise": noise}
        return {name: self.start((name, "start"), section.start) for name, section in sections.items() if section}

    def grid(self, loc: Loc, spans: Mapping[str, Span] | None) -> Grid | None:
        if spans is None:
            return None
        return Grid(axes={name: self.axis((*loc, name), span) for name, span in self.every_coordinate(loc, spans).items()})

    def axis(self, loc: Loc, span: Span) -> Axis:
        with self.study.source.located(loc, Span, low="from", high="to"):
            return Axis(low=span.low, high=span.high, points=span.points)

    def slice(self, loc: Loc, section: SliceSection) -> tuple[str, Axis, dict[str, float]]:
        """Every coordinate must run or be held, and none both."""
        ((along, span),) = self.some_coordinates((*loc, "along"), section.along).items()
        self.some_coordinates((*loc, "at"), section.at)
        if {along, *section.at} != set(self.system.coordinates) or along in section.at:
            others = ", ".join(name for name in self.system.coordinates if name != along)
            raise self.study.source.error((*loc, "at"), f"{along!r} runs along the slice; accepted in 'at': all of {others}")
        return along, self.axis((*loc, "along", along), span), dict(section.at)

    def family(self, name: str, words: Sequence[str]) -> WordFamily:
        walls = self.system.wall_names
        for number, word in enumerate(words):
            loc = ("families", name, number)
            with self.study.source.located(loc):
                encode(letters_of(word), walls)
            if not (letters_of(word).startswith(walls[0]) and len(word) > 1):
                accepted = f"accepted: words that begin on the base wall {walls[0]!r} and end on it or in its release"
                raise self.study.source.error(loc, f"the word {word!r} is no return; {accepted}")
        with self.study.source.located(("families", name), WordFamily, words=""):
            return WordFamily(name=name, words=tuple(words))

    def diagonal(self) -> Diagonal | None:
        section, source = self.study.diagonal, self.study.source
        if section is None:
            return None
        if section.grid is None and self.study.grid is None:
            text = "'diagonal' needs a grid: its own, or the section 'grid', which is missing"
            raise source.error(("diagonal",), text)
        if section.sweep:
            self.swept_values(("diagonal", "sweep"), section.sweep.parameter, (section.sweep.low, section.sweep.high))
        within = None if section.within is None else self.where(("diagonal", "within"), section.within)
        with source.located(("diagonal",), Diagonal):
            return Diagonal(delta=section.delta, slope=section.slope, within=within)

    def swept_values(self, loc: Loc, parameter: str, ends: tuple[float, float]) -> None:
        """Both ends of a sweep must be values that the system accepts."""
        source = self.study.source
        source.known((*loc, "parameter"), parameter, self.system.parameters, "parameter")
        for key, value in zip(("from", "to"), ends, strict=True):
            self.accepted(loc, parameter, value, key)

    def accepted(self, loc: Loc, parameter: str, value: float, key: str) -> None:
        """A StudyError at the key of a section unless the system accepts the value of the parameter that it says."""
        with self.study.source.located(loc, type(self.system), **{parameter: key}):
            type(self.system)(**{**self.system.model_dump(), parameter: value})

    def some_values(self, loc: Loc, range: Range) -> None:
        """One value of a sweep at least must be one that the system accepts; its result says which are not."""
        self.study.source.known((*loc, "parameter"), range.parameter, self.system.parameters, "parameter")
        along = Along(self.system, range.parameter)
        if all(map_or_reason(along, value)[1] for value in np.linspace(range.low, range.high, range.points).tolist()):
            self.swept_values(loc, range.parameter, (range.low, range.high))

    def cycle(self, number: int, section: BranchSection) -> Floats:
        """The start of a branch, whose parameter there must be in its range and one that the system accepts."""
        source, loc, name = self.study.source, ("branches", number), section.parameter
        source.known((*loc, "parameter"), name, self.system.parameters, "parameter")
        value = section.value(self.system.parameters)
        if not section.low <= value <= section.high:
            text = f"{name} = {value:g} is not from {section.low:g} to {section.high:g}; accepted: 'at' within the range"
            raise source.error(loc if section.at is None else (*loc, "at"), text)
        self.accepted(loc, name, value, "at")
        return self.start((*loc, "start"), section.start)

    def orders(self) -> dict[str, PolyFit]:
        section = self.study.diagonal
        orders = section.orders if section else {}
        return {name: self.fit(("diagonal", "orders", name), order) for name, order in orders.items()}

    def piece(self, number: int, piece: PieceSection) -> PiecePlan:
        loc: Loc = ("composite", number)
        if piece.family is not None and piece.family in self.study.families:
            self.single(loc, piece.family)
        region = self.region(loc, piece)
        fit = self.fit((*loc, "fit"), piece.fit) if piece.fit else None
        reset = None if piece.reset is None else self.some_coordinates((*loc, "reset"), piece.reset)
        near = piece.data == DIAGONAL
        data = None if piece.data is None or near else self.where((*loc, "data"), piece.data)
        if piece.polynomial is not None:
            with self.study.source.located((*loc, "polynomial"), PrintedMap, bounds="over"):
                piece.polynomial.of(self.system)
        return PiecePlan(piece.name, region, piece.family, fit, data, near, reset, piece.polynomial)

    def single(self, loc: Loc, family: str) -> None:
        if self.family(family, self.study.families[family]).most > 1:
            text = f"a piece of the composite map is one return, and {family!r} makes several in a row; accepted: words of one"
            raise self.study.source.error((*loc, "family"), text)

    def region(self, loc: Loc, piece: PieceSection) -> Region:
        if piece.box is not None:
            return self.box((*loc, "box"), piece.box)
        return self.where((*loc, "where"), piece.where or "")

    def fit(self, loc: Loc, section: FitSection) -> PolyFit:
        for key in ("separable", "along"):
            if getattr(section, key) is not None:
                self.every_coordinate((*loc, key), getattr(section, key))
        for number, name in enumerate(section.absolute):
            self.study.source.known((*loc, "absolute", number), name, self.system.coordinates, "coordinate")
        if section.full is not None:
            by_output = any(isinstance(degree, dict) for degree in section.full.values())
            (self.every_coordinate if by_output else self.some_coordinates)((*loc, "full"), section.full)
            with self.study.source.located(loc, FitSection, degrees="full"):
                return Full(degrees=section.full, absolute=section.absolute)
        with self.study.source.located(loc, FitSection, degrees="separable"):
            return Separable(degrees=section.separable or {}, along=section.along, absolute=section.absolute)

    def start(self, loc: Loc, start: Mapping[str, float]) -> Floats:
        return np.array(list(self.every_coordinate(loc, start).values()), float)

    def box(self, loc: Loc, bounds: Bounds | str) -> Box:
        assert isinstance(bounds, dict)
        ordered = self.every_coordinate(loc, bounds)
        with self.study.source.located(loc, Box, bounds=""):
            return Box(coordinates=self.system.coordinates, bounds=ordered)

    def where(self, loc: Loc, text: str) -> Where:
        with self.study.source.located(loc, Where, text=""):
            return Where(text=text, coordinates=self.system.coordinates)

    def every_coordinate(self, loc: Loc, values: Mapping[str, Value]) -> dict[str, Value]:
        """The values in the order of the system's coordinates, each of which must be there."""
        self.some_coordinates(loc, values)
        missing = [name for name in self.system.coordinates if name not in values]
        if missing:
            accepted = ", ".join(self.system.coordinates)
            raise self.study.source.error(loc, f"the coordinate {missing[0]!r} is missing; accepted: all of {accepted}")
        return {name: values[name] for name in self.system.coordinates}

    def some_coordinates(self, loc: Loc, values: Mapping[str, Value]) -> dict[str, Value]:
        """The values, if every key is a coordinate of the system."""
        for name in values:
            self.study.source.known((*loc, name), name, self.system.coordinates, "coordinate", key=True)
        return dict(values)
