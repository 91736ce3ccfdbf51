"""The benchmark, `nsmaps bench`: the exact map beside other programs, time against error, on the same first returns.

    result = nsmaps.bench.run()
    print(result.table())
    nsmaps.bench.figure(result, "bench.png")

Programs that are not installed are skipped and named. For one of your own subclass `Solver` and pass it to `run`.
"""

from pathlib import Path

from nsmaps.bench.comparison import programs, run
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.result import BenchResult, Row
from nsmaps.bench.starts import StartResult, start
from nsmaps.bench.task import Answer, Pair

__all__ = ["Answer", "BenchResult", "Pair", "Row", "Solver", "StartResult", "figure", "programs", "run", "start"]


def figure(result: BenchResult, path: str | Path) -> Path:
    """Draw error against time and write it to a file, whose suffix is its format. Returns its path."""
    from nsmaps.bench.plot import save

    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    return save(result, path)
