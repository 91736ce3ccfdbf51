"""The processes in which the parts of a run are computed."""

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from signal import SIG_IGN, SIGINT, signal


@contextmanager
def processes(count: int) -> Iterator[Executor | None]:
    """An executor of so many processes, ended at the end; None for one, which is this process. Ctrl-C is heard here alone."""
    if count == 1:
        yield None
        return
    context = get_context("spawn")  # a fork would have the locks of threads that it does not have
    with ProcessPoolExecutor(count, context, initializer=signal, initargs=(SIGINT, SIG_IGN)) as pool:
        yield pool
