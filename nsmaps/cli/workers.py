"""The processes in which the parts of a run are computed, and how a run ends that is stopped."""

from collections.abc import Iterable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context
from pathlib import Path
from signal import SIG_IGN, SIGINT, signal

import typer

from nsmaps.cli.terminal import STOPPED, say
from nsmaps.interrupts import Interrupted
from nsmaps.study.store.run_folder import PARTS


@contextmanager
def processes(count: int) -> Iterator[Executor | None]:
    """An executor of so many processes, ended at the end; None for one, which is this process. Ctrl-C is heard here alone."""
    if count == 1:
        yield None
        return
    context = get_context("spawn")  # a fork would have the locks of threads that it does not have
    with ProcessPoolExecutor(count, context, initializer=signal, initargs=(SIGINT, SIG_IGN)) as pool:
        try:
            yield pool
        except BaseException:  # their parts are of no use, and a second Ctrl-C while they end would not end the program
            for worker in active_children():
                worker.terminate()
            raise


@contextmanager
def resumable(again: str, folder: Path, done: Iterable[str] = ()) -> Iterator[None]:
    """Ctrl-C ends the program with the finished steps that the folder keeps, if any, and the command that resumes the run.

    Args:
        again: the command.
        folder: of the run.
        done: the steps that are finished before.
    """
    try:
        yield
    except KeyboardInterrupt as stopped:
        if isinstance(stopped, Interrupted):
            done = stopped.result.timings
        elif not done and not any(folder.glob(f"{PARTS}/*")):
            raise
        steps = ", ".join(done or sorted(path.stem for path in folder.glob(f"{PARTS}/*.npz"))) or "nothing"
        say(f"stopped; {folder} keeps the finished steps: {steps}\nto resume: {again}", err=True)
        raise typer.Exit(STOPPED) from None
