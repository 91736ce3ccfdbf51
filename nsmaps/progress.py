"""What a long call says while it works, and when it is to stop: a line on a terminal, nothing elsewhere."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from math import inf
from multiprocessing import parent_process
from time import monotonic
from typing import ParamSpec, TypeVar

Progress = Callable[[float], None]  #: called with the fraction that is done, from 0 to 1

P = ParamSpec("P")
R = TypeVar("R")
AFTER, EVERY = 2.0, 0.5  #: seconds before a line is shown, and between two of them
CLEAR = "\r\x1b[K"  #: what takes a line from a terminal


@dataclass(slots=True)
class Work:
    """A long call: what it is, how far it has come, and how long it may take."""

    name: str
    max_seconds: float = inf  #: after which it is `over`
    fraction: float = 0.0
    note: str = ""
    step: str = ""  #: of a call that has several; of these only the call itself knows the fraction
    begun: float = field(default_factory=monotonic)

    @property
    def seconds(self) -> float:
        """Since it began."""
        return monotonic() - self.begun

    @property
    def over(self) -> bool:
        """Whether it has had its time, so that nothing more is begun: what is finished is kept."""
        return self.seconds > self.max_seconds

    def line(self) -> str:
        """What is shown: name, share, note and time."""
        said = "".join(f" {text}," for text in (self.fraction and f"{100 * self.fraction:.0f} %", self.step, self.note) if text)
        minutes, seconds = divmod(int(self.seconds), 60)
        return f"{self.name}:{said} {minutes}:{seconds:02d}"

    def step_to(self, step: str, fraction: float) -> None:
        """Say which step the call is at, and how far all of it has come."""
        if step != self.step:
            self.step, self.note = step, ""
        self.fraction = fraction


_shown: list[Work] = []  #: the outermost long call, if one is shown; calls within it have no line of their own
_lock = threading.Lock()


def beat(fraction: float, note: str = "") -> None:
    """Say how far the call has come that is shown, if any."""
    for work in _shown:
        work.note = note
        if not work.step:
            work.fraction = min(max(fraction, 0.0), 1.0)


@contextmanager
def silent() -> Iterator[None]:
    """Nothing is shown of calls within, as where somebody else shows a progress of theirs."""
    if not _taken(Work("")):
        yield
        return
    try:
        yield
    finally:
        _shown.clear()


@contextmanager
def shown(work: Work) -> Iterator[Work]:
    """Show a call on standard error while it works, if that is a terminal, from two seconds on; the line is gone after it.

    Only the outermost call of the main process and thread is shown.
    """
    if not _on_terminal() or not _taken(work):
        yield work
        return
    done = threading.Event()
    thread = threading.Thread(target=_show, args=(work, done), daemon=True)
    thread.start()
    try:
        yield work
    finally:
        done.set()
        thread.join()
        _shown.clear()


@contextmanager
def working(name: str, progress: object, max_seconds: float = inf) -> Iterator[Work]:
    """A long call of at most so many seconds, shown unless it is given a `progress`."""
    work = Work(name, max_seconds)
    with silent() if progress is not None else shown(work):
        yield work


def shows(call: Callable[P, R]) -> Callable[P, R]:
    """A long call that is shown by its name; one that is given a `progress` is silent."""

    @wraps(call)
    def call_shown(*args: P.args, **kwargs: P.kwargs) -> R:
        with working(call.__name__, kwargs.get("progress")):
            return call(*args, **kwargs)

    return call_shown


def _on_terminal() -> bool:
    main = threading.current_thread() is threading.main_thread() and parent_process() is None
    return main and sys.stderr is not None and sys.stderr.isatty()


def _taken(work: Work) -> bool:
    with _lock:
        if not _shown:
            _shown.append(work)
    return _shown[0] is work


def _show(work: Work, done: threading.Event) -> None:
    stream = sys.stderr
    if done.wait(AFTER):
        return
    while True:
        stream.write(f"{CLEAR}{work.line()}")
        stream.flush()
        if done.wait(EVERY):
            break
    stream.write(CLEAR)
    stream.flush()
