"""The objects that a study describes, and how its keys become objects; an error names the line that is wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.exact.surfaces.along import Along
from nsmaps.exact.surfaces.family import LONG, ReturnFamily, WordFamily, is_pattern, letters_of
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.exact.words import encode
from nsmaps.parallel import SERIAL, Parallel
from nsmaps.plugins import FAMILY, REGION
from nsmaps.reduced.conditions.region import Box, ConditionRegion, Region
from nsmaps.study.reading.classes import Instance, created
from nsmaps.study.reading.head import Head as Study
from nsmaps.study.reading.locations import Loc
from nsmaps.study.reading.values import Bounds, Range, Span

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """The objects that a study describes, checked against its system; nothing is computed yet."""

    study: Study
    system: "System"
    bound: dict[str, Any]  #: the result of `bind` of each section of the study, by key
    parallel: Parallel = field(
        default=SERIAL, compare=False
    )  #: of the current step: its progress, and its checkpoint in a run with a folder

    @property
    def grid(self) -> Grid | None:
        """The study's grid."""
        return self.bound.get("grid")

    @property
    def families(self) -> dict[str, ReturnFamily]:
        """The study's families by name."""
        return self.bound.get("families", {})

    def portion(self, number: int, count: int, *names: str) -> Parallel:
        """One of `count` equal portions of a step, with its own folder under these names."""
        return self.parallel.share(number / count, (number + 1) / count, *names)


@dataclass(frozen=True, slots=True, eq=False)
class Binding:
    """The conversion of sections to objects for one system; raises StudyError at the place of an entry that is not consistent."""

    study: Study
    system: "System"

    def grid(self, loc: Loc, spans: Mapping[str, Span]) -> Grid:
        """The grid with these spans, one for every coordinate."""
        return Grid(axes={name: self.axis((*loc, name), span) for name, span in self.every_coordinate(loc, spans).items()})

    def axis(self, loc: Loc, span: Span) -> Axis:
        """One axis of a grid."""
        with self.study.source.located(loc, Span, low="from", high="to"):
            return Axis(low=span.low, high=span.high, points=span.points)

    def swept_values(self, loc: Loc, parameter: str, ends: tuple[float, float]) -> None:
        """Raise StudyError unless both ends of a sweep are valid values of the parameter."""
        source = self.study.source
        source.known((*loc, "parameter"), parameter, self.system.parameters, "parameter")
        for key, value in zip(("from", "to"), ends, strict=True):
            self.check_value(loc, parameter, value, key)

    def check_value(self, loc: Loc, parameter: str, value: float, key: str) -> None:
        """Raise StudyError at the key of a section unless its value of the parameter is valid for the system."""
        with self.study.source.located(loc, type(self.system), **{parameter: key}):
            system = type(self.system)(**{**self.system.model_dump(), parameter: value})
        with self.study.source.located((*loc, *[key] * bool(key))):
            system.check_formulas()

    def some_values(self, loc: Loc, sweep: Range) -> None:
        """Raise StudyError unless at least one value of a sweep is valid; its result names those that are not."""
        self.study.source.known((*loc, "parameter"), sweep.parameter, self.system.parameters, "parameter")
        along = Along(self.system, sweep.parameter)
        if all(map_or_reason(along, value)[1] for value in np.linspace(sweep.low, sweep.high, sweep.points).tolist()):
            self.swept_values(loc, sweep.parameter, (sweep.low, sweep.high))

    def start(self, loc: Loc, start: Mapping[str, float]) -> Floats:
        """A state, shape (n,)."""
        return np.array(list(self.every_coordinate(loc, start).values()), float)

    def starts(self, loc: Loc, starts: Sequence[Mapping[str, float]]) -> Floats:
        """States, shape (S, n), or (n,) of one."""
        found = np.array([self.start((*loc, number), start) for number, start in enumerate(starts)])
        return found[0] if len(found) == 1 else found

    def box(self, loc: Loc, bounds: Bounds) -> Box:
        """A box with a side for every coordinate."""
        ordered = self.every_coordinate(loc, bounds)
        with self.study.source.located(loc, Box, bounds=""):
            return Box(coordinates=self.system.coordinates, bounds=ordered)

    def where(self, loc: Loc, text: str, parameters: bool = False) -> ConditionRegion:
        """The states at which a condition holds; with `parameters`, one that may name the system's parameters."""
        names = self.system.coordinates
        others = {name: value for name, value in self.system.parameters.items() if parameters and name not in names}
        with self.study.source.located(loc, ConditionRegion, text=""):
            condition = ConditionRegion(text=text, coordinates=Coordinates([*names, *others]))
            condition.at(others)
            return condition

    def region(self, loc: Loc, given: str | Instance, parameters: bool = False) -> Region:
        """The states at which a condition holds, as `where`, or the region of a class, tried at the states of the grid."""
        if isinstance(given, str):
            return self.where(loc, given, parameters)
        from nsmaps.testing.regions import check_one_set

        names, grid = self.system.coordinates, self.study.grid
        found: Region = created(self.study.source, loc, given, REGION, coordinates=names)
        with self.study.source.located(loc):
            check_one_set(found, names.wrap(self.grid(("grid",), grid).states()) if grid else np.zeros((1, len(names))))
        return found

    def family(self, name: str) -> ReturnFamily:
        """A family of the study; raises StudyError unless its words are returns of the system."""
        first, source = self.system.section_letters, self.study.source
        words: Sequence[str] | Instance = self.study.families[name]
        if isinstance(words, Instance):
            return created(source, ("families", name), words, FAMILY, name=name)
        for number, word in enumerate(words):
            loc = ("families", name, number)
            self.check_return(loc, letters_of(word))
            if not (letters_of(word).startswith(first) and len(word) > len(min(first))):
                raise source.error(loc, f"the word {word!r} is not a return; expected: words that {_ends(self.system, first)}")
        ends = {} if len(first) == 1 and first[0] else {"max_returns": max(_needed(word, first) for word in words)}
        with source.located(("families", name), WordFamily, words=""):
            return WordFamily(name=name, words=tuple(words), **ends)

    def check_return(self, loc: Loc, word: str) -> None:
        """Raise StudyError for a word with unknown letters, or with more than the one of a return of a map in pieces."""
        with self.study.source.located(loc):
            encode(word, self.system.letters)
        if isinstance(self.system, PiecewiseMap) and len(word) > 1:
            letters = ", ".join(self.system.letters)
            raise self.study.source.error(loc, f"the word {word!r} has several letters; expected: that of one piece: {letters}")

    def every_coordinate(self, loc: Loc, values: Mapping[str, Value]) -> dict[str, Value]:
        """The values in the order of the system's coordinates; raises StudyError if one is missing."""
        self.some_coordinates(loc, values)
        missing = [name for name in self.system.coordinates if name not in values]
        if missing:
            expected = ", ".join(self.system.coordinates)
            raise self.study.source.error(loc, f"the coordinate {missing[0]!r} is missing; expected: all of {expected}")
        return {name: values[name] for name in self.system.coordinates}

    def some_coordinates(self, loc: Loc, values: Mapping[str, Value]) -> dict[str, Value]:
        """The values; raises StudyError at a key that is not a coordinate of the system."""
        for name in values:
            self.study.source.known((*loc, name), name, self.system.coordinates, "coordinate", key=True)
        return dict(values)


def _ends(system: "System", first: tuple[str, ...]) -> str:
    """Where returns begin and end."""
    from nsmaps.exact.systems.system import ImpactSystem

    if isinstance(system, ImpactSystem):
        return f"begin on the base wall {first[0]!r} and end on it or in its release"
    return f"begin with a letter of the section, {' or '.join(map(repr, first))}, and end with one or in its release"


def _needed(word: str, first: tuple[str, ...]) -> int:
    """The number of returns that a word may need, of which each begins with one of several letters, or with none."""
    if "" in first:
        return 1
    return LONG if is_pattern(word) else max(sum(word.count(letter) for letter in first) - 1, 1)
