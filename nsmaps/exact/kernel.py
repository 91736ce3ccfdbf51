"""The compiled return map of a system at its parameters, in one form for every flight, and its work on all cores."""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Impacts, Itineraries, Returns
from nsmaps.exact.words import PLAIN, Alphabet
from nsmaps.interrupts import threads

STEPS = 2000  # of a realisation under noise, whose random numbers are drawn together
START = 0  #: the row of the starts
CHUNK = 10_000  # returns that a thread takes at a time: enough to hide its cost, few enough for Ctrl-C


class ReturnRows(NamedTuple):
    """The first n returns of M states with m coordinates, and their derivatives along D directions."""

    states: Floats  #: shape (n + 1, M, m), the starts first
    turns: Any  #: shape (n, M, m)
    codes: Any  #: shape (n, M), words as numbers
    outcome: Any  #: shape (n, M)
    time: Floats  #: shape (n, M)
    tangents: Floats  #: shape (n, M, m, D)

    @property
    def start(self) -> Floats:
        """The starts, shape (M, m)."""
        return self.states[START]

    @property
    def images(self) -> Floats:
        """The states after them, shape (n, M, m)."""
        return self.states[START + 1 :]

    def part(self, k: slice) -> "ReturnRows":
        """The rows of some of the M states."""
        return ReturnRows(*(array[:, k] for array in self))


def return_rows(start: Floats, n: int, directions: int) -> ReturnRows:
    """Memory for the first n returns of states (M, m), which stand in it."""
    count, m = start.shape
    states = np.empty((n + 1, count, m))
    states[START] = start
    codes, outcome, time = np.zeros((n, count), np.int64), np.zeros((n, count), np.int8), np.zeros((n, count))
    return ReturnRows(states, np.zeros((n, count, m), np.int32), codes, outcome, time, np.empty((n, count, m, directions)))


class Kernel(ABC):
    """A compiled return map. Starts are checked states, shape (N, m); `chatter` is as of `FlowSystem.first_return`."""

    coordinates: Coordinates
    letters: tuple[str, ...]  #: of which words consist
    alphabet: Alphabet = PLAIN  #: what the letters stand for
    integrated: bool = False  #: whether flights are integrated numerically
    chunk: ClassVar[int] = CHUNK  #: starts that a thread takes at a time

    @property
    @abstractmethod
    def name(self) -> str:
        """A digest of the formulas and of the engine: equal names mean equal returns."""

    @abstractmethod
    def compute(self, rows: ReturnRows, chatter: float) -> None:
        """Compute returns from the starts in `rows`, on one core; Ctrl-C is heard within about a second."""

    @abstractmethod
    def sensitivities(self, start: Floats, rates: Floats, chatter: float) -> Floats:
        """The derivatives of first images by the parameters, which change at the rates (P,), shape (N, m)."""

    def first_returns(self, start: Floats, derivative: bool, chatter: float) -> Returns:
        """First returns, on all cores."""
        rows, count = return_rows(start, 1, start.shape[-1] if derivative else 0), len(start)
        if 0 < count <= self.chunk:
            self.compute(rows, chatter)
        else:
            in_chunks(count, lambda k: self.compute(rows.part(k), chatter), self.chunk)
        return self.returns(rows, derivative)

    def orbits(self, start: Floats, n: int, derivative: bool, chatter: float) -> Returns:
        """The first n returns of each start, on one core: n N rows, the first return of every start first."""
        rows = return_rows(start, n, start.shape[-1] if derivative else 0)
        self.compute(rows, chatter)
        return self.returns(rows, derivative)

    def returns(self, rows: ReturnRows, derivative: bool) -> Returns:
        """Rows as a result, one after another."""
        states, turns, codes, outcome, time, tangents = rows
        m = states.shape[-1]
        return Returns(
            self.coordinates,
            self.letters,
            states[:-1].reshape(-1, m),
            states[1:].reshape(-1, m),
            turns.reshape(-1, m),
            codes.ravel(),
            outcome.ravel(),
            time.ravel(),
            tangents.reshape(-1, m, m) if derivative else None,
            integrated=self.integrated,
            alphabet=self.alphabet,
        )


class MotionKernel(Kernel):
    """A compiled return map whose returns are those of motions in time."""

    @property
    @abstractmethod
    def modes(self) -> Any:
        """The kernel of the definition with modes, in which motions start anywhere."""

    def starts(self, start: Floats) -> Floats:
        """A batch, shape (N, n), with NaN for rows that do not lie on the section; here all do."""
        return start

    @abstractmethod
    def closed_form(self, what: str, refusal: type[NsmapsError] = NsmapsError) -> Any:
        """This kernel, if its flights are in closed form.

        Raises:
            NsmapsError: of the class `refusal`: they are not, and `what`, in the plural, needs it; says why.
        """

    @abstractmethod
    def itineraries(self, start: Floats, chatter: float, speeds: Floats | None = None) -> Itineraries:
        """Itineraries and margins of first returns, these as shares of speeds by transition, shape (T,), if they are given."""

    @abstractmethod
    def reasons(self, start: Floats, chatter: float) -> tuple[str, ...]:
        """Why each first return ended, a sentence each."""

    @abstractmethod
    def impacts(self, start: Floats, n: int, chatter: float) -> Impacts:
        """The first n impacts on all walls of an impact system from one state, shape (2,)."""

    @abstractmethod
    def trajectory(self, impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
        """Times, displacements and velocities along the M - 1 flights between impacts, each of shape (M - 1, samples)."""


def in_chunks(n: int, run: Callable[[slice], None], size: int = CHUNK) -> None:
    """Run a task over n states on all cores, in chunks of at most `size`, if that is less than all.

    Every core, this thread on one of them, takes the next chunk when it has finished one; the last chunks are small, so that no
    core waits long for another.
    """
    if n <= size:
        if n:
            run(slice(0, n))
        return
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    chunks = list(chunks_of(n, size, cores))
    waiting = iter(chunks)

    def work() -> None:
        try:
            for k in waiting:
                run(k)
        except BaseException:
            chunks.clear()  # after an error or an interrupt, the threads stop after their chunk
            raise

    with threads(max(cores - 1, 1)) as pool:
        workers = [pool.submit(work) for _ in range(cores - 1)]
        work()
    for worker in workers:
        worker.result()


def chunks_of(n: int, size: int, cores: int) -> Iterator[slice]:
    """Slices of n states: of at most `size` each, at least an eighth of that, and otherwise a share of the remaining states."""
    begin = 0
    while begin < n:
        end = begin + min(size, max(size // 8, (n - begin) // (2 * cores), 1), n - begin)
        yield slice(begin, end)
        begin = end
