"""The benchmark: every solver is compared with the references, then all are timed in rotation."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.bench.count import work_per_return
from nsmaps.bench.programs.numpy_solver import Masks
from nsmaps.bench.programs.ode_cvode import Cvode
from nsmaps.bench.programs.ode_diffrax import Diffrax
from nsmaps.bench.programs.ode_scipy import SciPy
from nsmaps.bench.programs.ours import OneCore, TwoCores
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.programs.taylor import Heyoka
from nsmaps.bench.result import BenchResult, Row, this_machine
from nsmaps.bench.task import Answer, Task, grid_task, hard_tasks
from nsmaps.errors import NsmapsError, near_match
from nsmaps.progress import Progress, beat, shows

TURN = 0.1  #: seconds for which a solver repeats its returns in one turn, at least once
PATIENCE = 10.0  #: seconds after which a solver takes no more turns; at least two
OPPONENTS = ("C loop plain", "heyoka 2e-16", "NumPy masks")


def programs() -> list[Solver]:
    """Every program that the benchmark knows, installed or not."""
    tolerances = (1e-6, 1e-9, 1e-12)
    ours: list[Solver] = [OneCore(), TwoCores(), OneCore(derivative=True)]
    peers: list[Solver] = [Masks(), Heyoka(), Heyoka(1e-9), *(Diffrax("Dopri8", tol) for tol in tolerances)]
    peers += [SciPy(method, tol) for method in ("DOP853", "LSODA") for tol in tolerances]
    return [*ours, *peers, *(Cvode(tol) for tol in tolerances)]


@shows
def run(
    solvers: Sequence[Solver] | None = None,
    n_returns: int = 10_000,
    n_rounds: int = 20,
    against: str | None = None,
    *,
    progress: Progress | None = None,
) -> BenchResult:
    """Compare programs on the same first returns of the vibro-impact pair: time, error, wrong words.

    Args:
        solvers: the solvers; all of `programs()` unless given. Those that are not available are skipped.
        n_returns: how many of the 10,000 starts; slow programs take fewer.
        n_rounds: how many turns each program takes, in rotation.
        against: the name of the program that ratios of time refer to.
        progress: called with the fraction that is done, from 0 to 1.

    Raises:
        NsmapsError: the number of starts or rounds is out of range; no solver is available, or not the one named in `against`.
    """
    if not (1 <= n_returns <= 10_000 and n_rounds >= 1):
        raise NsmapsError(f"{n_returns} returns, {n_rounds} rounds; expected: 1 to 10000 returns and at least 1 round")
    asked = programs() if solvers is None else solvers
    entries, skipped = _prepared(asked, n_returns)
    names = [entry.solver.name for entry in entries]
    if not names or (against and against not in names):
        why = "; ".join(f"{name}: {text}" for name, text in skipped.items())
        who = f"{against!r} is not available{near_match(against, names)}" if against else "no solver is available"
        raise NsmapsError(f"{who}; expected: one of {', '.join(names) or 'none'}; not available are {why or 'none'}")
    for k in range(n_rounds):
        beat(0.5 + 0.5 * k / n_rounds, "timing")
        for entry in entries[k % len(entries) :] + entries[: k % len(entries)]:
            entry.take_turn()
    ours = any(isinstance(entry.solver, OneCore) for entry in entries)
    return BenchResult(
        rows=tuple(entry.row() for entry in entries),
        against=against or next((name for name in OPPONENTS if name in names), names[0]),
        skipped=skipped,
        hard=sum(len(task.starts) for task in hard_tasks()),
        work=work_per_return() if ours else {},
        machine=this_machine(),
    )


@dataclass(slots=True)
class _Entry:
    """A solver in the benchmark: its starts, its errors, and its times so far."""

    solver: Solver
    package: str
    task: Task
    batch: Floats = field(init=False)
    errors: Floats = field(init=False)
    wrong_hard: int = 0
    times: list[float] = field(default_factory=list)
    spent: float = 0.0

    def __post_init__(self) -> None:
        self.batch = np.tile(self.task.starts, (self.solver.repeat, 1))

    def compare(self) -> None:
        """Solve everything once and compare with the references; whatever compiles at first use does so here."""
        self.errors = errors(self._solved(self.task), self.task.truth)
        for task in hard_tasks():
            answer, truth = self._solved(task), task.truth
            speed = np.abs(answer.image[:, 0] / truth.image[:, 0] - 1)
            self.wrong_hard += int(np.sum(~((answer.tops == truth.tops) & (speed < 0.01))))

    def _solved(self, task: Task) -> Answer:
        return self.solver.solve(task.pair, task.starts)()

    def take_turn(self) -> None:
        """Time it for as long as a turn is, unless it has had its time."""
        if self.spent > PATIENCE and len(self.times) >= 2:
            return
        end = self.spent + TURN
        while True:
            begun = perf_counter()
            self.solver.solve(self.task.pair, self.batch)
            seconds = perf_counter() - begun
            self.spent += seconds
            self.times.append(seconds / len(self.batch))
            if self.spent >= end:
                return

    def row(self) -> Row:
        """What it comes to."""
        right = self.errors[np.isfinite(self.errors)]
        worst, quantile = (float(np.max(right)), float(np.quantile(right, 0.99))) if len(right) else (np.nan, np.nan)
        who, n = self.solver, len(self.errors)
        return Row(who.family, who.setting, self.package, n, tuple(self.times), worst, quantile, n - len(right), self.wrong_hard)


def errors(answer: Answer, truth: Answer) -> Floats:
    """The error of each return in speed or phase (radians, on the circle), the larger; infinite if the word is wrong."""
    off = np.abs(answer.image - truth.image)
    off[:, 1] = np.abs((off[:, 1] + np.pi) % (2 * np.pi) - np.pi)
    largest = off.max(axis=1)
    return np.where((answer.tops == truth.tops) & np.isfinite(largest), largest, np.inf)


def _prepared(asked: Sequence[Solver], returns: int) -> tuple[list[_Entry], dict[str, str]]:
    """Those that can take part, compared with the references, and why the others cannot."""
    entries, skipped = [], {}
    for k, solver in enumerate(asked):
        beat(0.5 * k / len(asked), solver.name)
        try:
            package = solver.prepare()
        except (ImportError, OSError) as why:
            skipped[solver.name] = str(why)
            continue
        entries.append(_Entry(solver, package, grid_task().first(min(returns, solver.max_starts))))
        entries[-1].compare()
    return entries, skipped
