"""nsmaps in other ways than `nsmaps bench` has it: returns one by one, a large batch on one core, and two batches apart."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.bench.programs.ours import OneCore, TwoCores, cores, pair_system, read
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Pair
from nsmaps.exact.engine.flight.layout import WIDE
from nsmaps.exact.engine.kernel import SpectralKernel
from nsmaps.exact.returns import Returns

BATCH = 10_000


def scalar(kernel: SpectralKernel) -> SpectralKernel:
    """The same kernel with a table that no batch is taken side by side of: every return by itself, as a single state is."""
    table = kernel.table.copy()
    table[WIDE] = 0.0
    return replace(kernel, table=table)


@dataclass(frozen=True)
class Single(Solver):
    """Every start by itself on one core, in one compiled loop."""

    family = "nsmaps"
    setting = "single states"

    def prepare(self) -> str:
        """Compile or load the kernel."""
        return OneCore().prepare()

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """One call for all starts, none side by side with another."""
        with cores(1):
            returns = scalar(pair_system(pair)._kernel()).first_returns(starts, False, 1e-12)
        return lambda: read(returns)


@dataclass(frozen=True)
class Large(OneCore):
    """The batch that `nsmaps two cores` has, on one core."""

    setting = "one core, large batch"  # type: ignore[assignment]
    repeat = TwoCores.repeat


@dataclass(frozen=True)
class TwoBatches(Solver):
    """Two threads with half of the starts each, a batch after another: what two cores of this machine give at best."""

    family = "nsmaps"
    setting = "two batches apart"
    repeat = TwoCores.repeat

    def prepare(self) -> str:
        """Compile or load the kernel."""
        return OneCore().prepare()

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """Each thread takes its half, a batch after another."""
        system = pair_system(pair)

        def half(part: Floats) -> list[Returns]:
            return [system.first_return(part[k : k + BATCH]) for k in range(0, len(part), BATCH)]

        with ThreadPoolExecutor(2) as pool:
            returns = [one for made in pool.map(half, np.array_split(starts, 2)) for one in made]

        def told() -> Answer:
            answers = [read(one) for one in returns]
            return Answer(*(np.concatenate([getattr(one, name) for one in answers]) for name in ("image", "tops")))

        return told
