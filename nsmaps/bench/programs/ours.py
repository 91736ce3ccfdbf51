"""nsmaps itself, through its public call, on as many cores as are asked for."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, cast

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Pair

if TYPE_CHECKING:
    from nsmaps.exact.returns import Returns
    from nsmaps.exact.systems.system import ImpactSystem


@lru_cache(maxsize=16)
def pair_system(pair: Pair) -> "ImpactSystem":
    """The installed system `vi_pair` with these parameters."""
    from nsmaps.plugins import load_system

    return cast("ImpactSystem", load_system("vi_pair", d=pair.d, r=pair.r, g_bar=pair.g_bar))


@contextmanager
def cores(n: int) -> Iterator[None]:
    """Keep this thread, and those that it starts, on n of the processor's cores, where the operating system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, set(sorted(allowed)[:n]))
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def read(returns: "Returns") -> Answer:
    """The answer in the benchmark's terms; a word of other than plain impacts counts as none."""
    values, which = np.unique(returns.words, return_inverse=True)
    tops = [word.count("T") if word == f"B{'T' * word.count('T')}B" else -1 for word in values]
    return Answer(returns.image, np.array(tops, np.int8)[which])


@dataclass(frozen=True)
class OneCore(Solver):
    """One call of `first_return` for all starts, on one core."""

    derivative: bool = False
    family = "nsmaps"

    @property
    def setting(self) -> str:
        """Cores, and whether the derivative is asked for as well."""
        return "one core with derivative" if self.derivative else "one core"

    def prepare(self) -> str:
        """Generate, compile and load the kernel."""
        from nsmaps.study.store.archive import versions

        self.solve(Pair(0.3, 0.5, 0.2), np.ones((2, 2)))
        return f"nsmaps {versions().get('nsmaps', '')}"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """One call for the whole batch."""
        with cores(1):
            returns = pair_system(pair).first_return(starts, derivative=self.derivative)
        return lambda: read(returns)


@dataclass(frozen=True)
class TwoCores(Solver):
    """One call of `first_return` for a batch that is large enough to be shared by two cores."""

    family = "nsmaps"
    setting = "two cores"
    repeat = 20

    def prepare(self) -> str:
        """Refused where there is one core only."""
        if (os.cpu_count() or 1) < 2:
            raise OSError("this machine has one core")
        return OneCore().prepare()

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """One call for the whole batch."""
        with cores(2):
            returns = pair_system(pair).first_return(starts)
        return lambda: read(returns)
