"""Ctrl-C that is heard wherever it falls."""

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Self

_THREAD = threading.local()  #: `stop` in it is the event that ends the work of this thread, if there is one


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a long call.

    Attributes:
        result: what was finished: the result of the call, in which the rest is missing, or None if nothing was finished.
        folder: where that was written, if anywhere.
        finished: how much that is, such as "3 of 8 parts"; "" if that is not known.
    """

    def __init__(self, result: Any, folder: Path | None = None, finished: str = "") -> None:
        super().__init__(f"stopped{f' with {finished}' if finished else ''}; {_advice(result, folder)}")
        self.result = result
        self.folder = folder
        self.finished = finished

    @classmethod
    def of(cls, stopped: KeyboardInterrupt, result: Any) -> Self:
        """The same with another result, of the call that was stopped in a part of it."""
        return cls(result, getattr(stopped, "folder", None), getattr(stopped, "finished", ""))


def _advice(result: Any, folder: Path | None) -> str:
    """How the work is resumed after Ctrl-C."""
    kept = "`result` of this exception holds what was finished" if result is not None else "nothing was finished"
    return f"{kept}; {folder} keeps it, and the same call resumes there" if folder else kept


@contextmanager
def heard() -> Iterator[Callable[[], None]]:
    """Ctrl-C is not lost in code that drops every exception, as C code may; NumPy does where it looks up attributes (gh-14801).

    What is yielded raises KeyboardInterrupt if Ctrl-C was pressed before: long work calls it now and then. Only Python's own
    handler is stood in for, in the main thread; where there is another, or none can be set, nothing changes.
    """
    pressed = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        signal.default_int_handler(number, frame)

    def ask() -> None:
        if pressed:
            raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield ask
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield ask
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def threads(count: int) -> Iterator[ThreadPoolExecutor]:
    """Threads of long work, which `check_stop` ends as soon as this block is left by an error or by Ctrl-C."""
    stop = threading.Event()
    with ThreadPoolExecutor(count, initializer=setattr, initargs=(_THREAD, "stop", stop)) as pool:
        try:
            yield pool
        except BaseException:
            stop.set()
            raise


def check_stop() -> None:
    """Raise KeyboardInterrupt in one of `threads` that is to end; called between two calls of compiled code."""
    stop = getattr(_THREAD, "stop", None)
    if stop is not None and stop.is_set():
        raise KeyboardInterrupt
