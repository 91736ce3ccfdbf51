"""A file of YAML as ruamel's tree; its size with all aliases expanded is checked before the tree is built."""

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, NodeEvent, ScalarEvent
from ruamel.yaml.parser import RoundTripParser
from ruamel.yaml.scanner import Scanner

from nsmaps.errors import NsmapsError, StudyError
from nsmaps.files.reading import odd_character, text_of

LARGEST, MAX_VALUES, DEEPEST = 500_000, 100_000, 40  #: bytes of a file, values with aliases expanded, levels of nesting
LONG = re.compile(r"[-+]?([0-9_]{100,}|0[xob][0-9a-fA-F_]{100,})")  #: a number with too many digits


def parsed(path: Path) -> Any:
    """The content of a file as ruamel's tree, with line and column of every key; raises StudyError unless it is YAML.

    The trees of the texts read last are kept, and are not to be changed.
    """
    try:
        return _tree(text_of(path, LARGEST))
    except _LimitExceededError as excess:
        raise StudyError(f"{os.fspath(path)}:{excess}") from None
    except NsmapsError as error:
        raise StudyError(f"{path}:1:1: {error}") from error
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        problem = str(error.problem or error.context).splitlines()[0]
        raise StudyError(f"{path}:{line}:{column}: {_in_words(problem)}") from error
    except (YAMLError, ValueError, TypeError, AttributeError, LookupError) as error:  # ruamel raises all of these
        raise StudyError(f"{path}:1:1: not readable as YAML: {(str(error).splitlines() or [type(error).__name__])[0]}") from error


def _in_words(problem: str) -> str:
    """The message of ruamel; that on a key given twice without the quoted values."""
    if problem.startswith("found duplicate key"):
        key = problem.removeprefix("found duplicate key").split(" with value")[0].strip().strip("\"'")
        return f"the key {key!r} is given twice; expected: each key once"
    return f"not readable as YAML: {problem}{'; expected: spaces' if chr(92) + 't' in problem else ''}"


def plain(node: Any) -> Any:
    """Ruamel's tree as plain dicts, lists and scalars."""
    if isinstance(node, CommentedMap):
        return {key: plain(value) for key, value in node.items()}
    if isinstance(node, CommentedSeq):
        return [plain(value) for value in node]
    for kind in (bool, int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node


@dataclass(slots=True)
class _Scales:
    """The state of the check: the size of each anchor, and the open collections."""

    anchored: dict[str, int] = field(default_factory=dict)  #: number of values, with aliases expanded
    open: list[tuple[str | None, int]] = field(default_factory=list)  #: anchors, and the total at their begin
    total: int = 0

    def add(self, event: Any) -> None:
        """Count one event of the parser."""
        if isinstance(event, CollectionEndEvent):
            anchor, before = self.open.pop()
            self.anchored[anchor or ""] = self.total - before
        elif isinstance(event, AliasEvent):
            self.total += self.anchored.get(event.anchor, 0)
        elif isinstance(event, NodeEvent):
            self.total += 1
            if isinstance(event, CollectionStartEvent):
                self.open.append((event.anchor, self.total - 1))
            else:
                self.anchored[event.anchor or ""] = 1

    def complaints(self, event: Any) -> Iterator[str]:
        """The error of the text after an event, if there is one."""
        if len(self.open) > DEEPEST:
            yield f"nested deeper than {DEEPEST} levels"
        if self.total > MAX_VALUES:
            yield f"more than {MAX_VALUES:,} values, with aliases expanded"
        if isinstance(event, AliasEvent) and event.anchor in [anchor for anchor, _ in self.open]:
            yield f"the alias *{event.anchor} is inside its own anchor"
        if getattr(event, "tag", None) is not None:
            yield f"the tag {event.tag!r}; expected: plain values"
        if isinstance(event, ScalarEvent):
            if found := odd_character(event.value):
                yield f"the character {found} in a text; expected: text without control characters"
            if LONG.fullmatch(event.value) and not event.style:
                yield f"a number of {len(event.value)} digits; expected: fewer than 100"


class _LimitExceededError(Exception):
    """A text exceeds a limit: the place, as `line:column: which`."""


class _Checked(RoundTripParser):
    """A parser that stops at the first place at which the text exceeds a limit."""

    def __init__(self, loader: Any) -> None:
        RoundTripParser.__init__(self, loader)
        self.scales = _Scales()

    def get_event(self) -> Any:
        """The next event, counted."""
        event = RoundTripParser.get_event(self)
        self.scales.add(event)
        for complaint in self.scales.complaints(event):
            raise _LimitExceededError(f"{event.start_mark.line + 1}:{event.start_mark.column + 1}: {complaint}")
        return event


@lru_cache(maxsize=64)
def _tree(text: str) -> Any:
    yaml = YAML()
    yaml.Parser, yaml.Scanner, yaml.preserve_quotes = _Checked, Scanner, True  # a scanner that keeps no comments
    return yaml.load(text)
