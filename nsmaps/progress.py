"""The progress of a long call, reported to its `progress` or on one line of a terminal, and its time limit."""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from math import inf
from multiprocessing import parent_process
from time import monotonic
from typing import Any, ParamSpec, TextIO, TypeVar

from nsmaps.errors.arguments import with_arguments

Progress = Callable[[float], None]  #: called with the fraction that is done, from 0 to 1; at the end of a call with 1

P = ParamSpec("P")
R = TypeVar("R")
AFTER, EVERY = 2.0, 0.25  #: seconds before a line is shown, and between two of them
UNKNOWN = 80  #: columns of a terminal that states none
CLEAR = "\r\x1b[K"  #: what takes a line from a terminal


def clock(seconds: float) -> str:
    """A time as minutes and seconds, with hours where it has any.

    >>> clock(7.2), clock(3725)
    ('0:08', '1:02:05')
    """
    whole = -int(-seconds // 1)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"


@dataclass(slots=True)
class Work:
    """A long call: its name, the fraction that is done, and its time limit."""

    name: str
    progress: Progress | None = None
    max_seconds: float = inf  #: after which it is `over`
    fraction: float = 0.0
    note: str = ""
    step: str = ""  #: the name of the current step, of a call that has several
    counted: str = ""  #: its number and that of all steps
    share: float = 0.0  #: the fraction of the step that is done
    begun: float = field(default_factory=monotonic)
    since: float = 0.0  #: when the step began

    @property
    def seconds(self) -> float:
        """The time since the call began."""
        return monotonic() - self.begun

    @property
    def over(self) -> bool:
        """Whether the time limit has passed, after which no further step is begun and finished ones are kept."""
        return self.seconds > self.max_seconds

    def line(self) -> str:
        """The line on a terminal: name, percentage, step, elapsed time, the time left of the step, and the note."""
        percent, left = f"{100 * self.fraction:.0f} %" if self.fraction else "", ""
        if self.step and 0 < self.share < 1:
            left = f"{clock((monotonic() - self.since) * (1 - self.share) / self.share)} left of {self.step}"
        texts = percent, self.counted, clock(int(self.seconds)), left, self.note  # what a narrow terminal cuts is last
        return f"{self.name}: {', '.join(filter(None, texts))}"

    def reached(self, fraction: float) -> None:
        """Report the fraction of the call that is done."""
        self.fraction = min(max(fraction, 0.0), 1.0)
        if self.progress is not None:
            self.progress(self.fraction)

    def at(self, step: str, number: int, steps: int, share: float = 0.0) -> None:
        """Report a share of step `number`, from 0, of a call with so many equal steps."""
        if step != self.step:
            self.step, self.note, self.since = step, "", monotonic()
        self.counted, self.share = f"{step} ({number + 1} of {steps})", share
        self.reached((number + share) / steps)


class _Calls(threading.local):
    """The long calls that are under way in each thread, the outermost first."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """No call is under way."""
        self.stack: list[Work] = []
        self.displayed = False


_calls = _Calls()
if hasattr(os, "register_at_fork"):  # a forked process reports nothing of its parent's calls
    os.register_at_fork(after_in_child=_calls.clear)


def outermost() -> Work | None:
    """The outermost long call under way in this thread: within a `progress` its step and note, for instance."""
    return _calls.stack[0] if _calls.stack else None


def beat(fraction: float, note: str = "") -> None:
    """Report how far the innermost long call has come, and a note that stands in its line and in those of calls it reports to."""
    for work in reversed(_calls.stack):
        work.note = note
        if work.progress is None:
            break
    for work in _calls.stack[-1:]:
        work.reached(fraction)


def portion(progress: Progress | None, first: float, last: float) -> Progress | None:
    """The progress of a part of a call, which takes it from one fraction to another.

    >>> portion(print, 0.5, 1.0)(0.5)
    0.75
    """
    return None if progress is None else lambda fraction: progress(first + (last - first) * fraction)


@contextmanager
def silent() -> Iterator[None]:
    """No line is shown of the calls within."""
    before, _calls.displayed = _calls.displayed, True
    try:
        yield
    finally:
        _calls.displayed = before


@contextmanager
def display(after: float | None = None) -> Iterator[None]:
    """Show the outermost long call on one line on standard error, if that is a terminal, from some seconds on; erased at the end.

    Only calls in the main thread of the main process are shown.
    """
    if _calls.displayed or not _on_terminal():
        yield
        return
    done = threading.Event()
    thread = threading.Thread(target=_show, args=(_calls.stack, done, AFTER if after is None else after), daemon=True)
    with silent():
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()


@contextmanager
def working(name: str, progress: Progress | None = None, max_seconds: float = inf) -> Iterator[Work]:
    """A long call of at most so many seconds; shown on one line unless it is given a `progress`, which ends with 1."""
    work = Work(name, progress, max_seconds)
    _calls.stack.append(work)
    try:
        with silent() if progress is not None else display():
            yield work
        if work.progress is not None and work.fraction < 1:
            work.reached(1.0)
    finally:
        _calls.stack.pop()


def shows(call: Callable[P, R]) -> Callable[P, R]:
    """A long call whose `beat` is reported to its keyword `progress`; without one a line shows it by its name."""

    @wraps(call)
    def call_shown(*args: P.args, **kwargs: P.kwargs) -> R:
        progress: Any = kwargs.get("progress")
        with working(call.__name__, progress):
            return with_arguments(call, *args, **kwargs)

    return call_shown


def _on_terminal() -> bool:
    main = threading.current_thread() is threading.main_thread() and parent_process() is None
    return main and sys.stderr is not None and sys.stderr.isatty()


def columns(stream: TextIO) -> int:
    """The width of a terminal: that of the variable COLUMNS, else that which it states, else `UNKNOWN`."""
    try:
        return int(os.environ.get("COLUMNS") or os.get_terminal_size(stream.fileno()).columns) or UNKNOWN
    except (OSError, ValueError):
        return UNKNOWN


def fitting(line: str, width: int) -> str:
    """A line without its last parts, where it is longer than a width, so that it never wraps.

    >>> fitting("fp: 39 %, basins (2 of 3), 1:22 left of basins", 30)
    'fp: 39 %, basins (2 of 3)'
    """
    short = line[:width]
    return line if len(line) <= width else short.rpartition(", ")[0] or short


def _show(stack: list[Work], done: threading.Event, after: float) -> None:
    stream = sys.stderr
    if done.wait(after):
        return
    while True:
        line = fitting("".join(work.line() for work in stack[:1]), columns(stream) - 1)
        stream.write(f"{CLEAR}{line}")
        stream.flush()
        if done.wait(EVERY):
            break
    stream.write(CLEAR)
    stream.flush()
