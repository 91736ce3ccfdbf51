"""A solver: one program that computes first returns of a vibro-impact pair, timed and compared with the references."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from nsmaps.arrays import Floats
from nsmaps.bench.task import Answer, Pair


@dataclass(frozen=True)
class Solver(ABC):
    """One program with its settings. Subclass it, and hand an instance to `nsmaps.bench.run`."""

    max_starts: ClassVar[int] = 10_000  #: largest number of starts; fewer for a slow program
    repeat: ClassVar[int] = 1  #: how often these starts are repeated in the call that is timed

    @property
    @abstractmethod
    def family(self) -> str:
        """The program and its method, one line of the figure."""

    @property
    @abstractmethod
    def setting(self) -> str:
        """What distinguishes it from others of its family, such as a tolerance; empty if nothing does."""

    @property
    def name(self) -> str:
        """How it is called in the table."""
        return f"{self.family} {self.setting}".strip()

    @abstractmethod
    def prepare(self) -> str:
        """Import and compile what is needed before the clock runs; the package and its version.

        Raises ImportError or OSError, whose text says why it cannot take part here.
        """

    @abstractmethod
    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """Find the first returns of the starts, shape (N, 2): timed. What it returns reads the answer: not timed."""
