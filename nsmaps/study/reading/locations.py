"""Locations in the file of a study: every error about a study begins with file, line and column."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel, ValidationError
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.scalarstring import DoubleQuotedScalarString, ScalarString, SingleQuotedScalarString

from nsmaps.errors import ConditionError, NsmapsError, StudyError, near_match
from nsmaps.files.complaints import MOST, explained

Loc = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Source:
    """The text a study was read from. Studies with the same content are equal: the source is not compared."""

    name: str = field(default="study", compare=False)  #: the given name of the file, or "study" for one created in Python
    root: Any = field(default=None, compare=False, repr=False)  #: the tree of ruamel, with a line and column per key
    renamed: Mapping[str, str] = field(default_factory=dict, compare=False)  #: keys of sections by those that code names
    changed: Mapping[str, tuple[Any, Any]] = field(default_factory=dict, compare=False)  #: changed parameters: before, now

    def real(self, loc: Loc) -> Loc:
        """A place with the key that its section has in the file."""
        return (self.renamed.get(str(loc[0]), loc[0]), *loc[1:]) if loc else loc

    def position(self, loc: Loc, key: bool = False) -> tuple[int, int]:
        """Line and column, from one, of the value at `loc` or of its key; of its parent if there is none."""
        node, place = self.root, (0, 0)
        for depth, step in enumerate(self.real(loc), 1):
            if not isinstance(node, CommentedMap | CommentedSeq) or step not in (node.lc.data or {}):
                break
            line, column, *value = node.lc.data[step]
            place = (line, column) if key and depth == len(loc) else (value[0], value[1]) if value else (line, column)
            node = node[step]
        return place[0] + 1, place[1] + 1

    def error(self, loc: Loc, text: str, key: bool = False, offset: int = 0) -> StudyError:
        """A StudyError at `loc`, `offset` characters into its text."""
        if self.root is None:
            return StudyError(f"{self.name}: {'.'.join(map(str, self.real(loc)))}: {text}")
        line, column = self.position(loc, key)
        return StudyError(f"{self.name}:{line}:{column + offset}: {text}")

    def known(self, loc: Loc, name: str, expected: Iterable[str], what: str, key: bool = False) -> str:
        """The name; raises StudyError with a near match if it is not among the expected names."""
        expected = list(expected)
        if name in expected:
            return name
        listed = ", ".join(expected) or "none"
        raise self.error(loc, f"unknown {what} {name!r}{near_match(name, expected)}; expected: {listed}", key)

    @contextmanager
    def located(self, loc: Loc, model: type[BaseModel] | None = None, **renamed: str) -> Iterator[None]:
        """Errors raised inside become StudyErrors at `loc`, one line each.

        `model` is the class whose fields are the expected keys there; `renamed` maps a field to its key in the study, or
        to "" if the study has the value of the field in its place.
        """
        try:
            yield
        except ValidationError as error:
            raise self.translate(error, loc, model, renamed) from error
        except StudyError:
            raise
        except NsmapsError as error:
            raise self.error(loc, str(error), offset=self.offset(loc, error)) from error

    def translate(self, error: ValidationError, base: Loc, model: type[BaseModel] | None, renamed: dict[str, str]) -> StudyError:
        """Every complaint of pydantic as one line at its place, one per place."""
        lines: dict[tuple[int, int] | str, str] = {}
        for complaint in explained(error, model):
            field = tuple(renamed.get(str(step), step) for step in complaint.loc[:1])
            loc = base + tuple(step for step in field if step != "") + complaint.loc[1:]
            offset = self.offset(loc, complaint.cause)
            place = str(loc) if self.root is None else self.position(loc, complaint.at_key)
            lines.setdefault(place, str(self.error(loc, complaint.text, complaint.at_key, offset)))
        more = [f"{self.name}: and {error.error_count() - MOST} more"] if error.error_count() > MOST else []
        return StudyError("\n".join([*lines.values(), *more]))

    def offset(self, loc: Loc, error: object) -> int:
        """The position of an error in the condition at `loc`, including an opening quote."""
        column = error.column if isinstance(error, ConditionError) else None
        node = self.root
        with suppress(KeyError, IndexError, TypeError):  # a list has no keys
            for step in self.real(loc):
                node = node[step] if isinstance(node, CommentedMap | CommentedSeq) else None
        if column is None or not isinstance(node, str):
            return 0
        if isinstance(node, DoubleQuotedScalarString | SingleQuotedScalarString):
            return column + 1
        return 0 if isinstance(node, ScalarString) else column
