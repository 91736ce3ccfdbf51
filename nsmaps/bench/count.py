"""How much work a return is, whatever the machine: calls of the flow's functions, counted in the kernel as plain Python.

Counting is done by a Python of its own, for numba compiles, or does not, once and for all when it is imported.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

COUNTED = {"evaluate": "evaluations of a flight", "wave": "of sine and cosine"}  #: function -> its calls


def work_per_return(returns: int = 500) -> dict[str, float]:
    """Evaluations of the flight a return, and the sine-cosine pairs that they take."""
    command = [sys.executable, "-c", f"from nsmaps.bench import count; count.print_counts({returns})"]
    done = subprocess.run(command, env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def print_counts(returns: int) -> None:
    """Print the counts for so many returns; where numba does not compile."""
    from nsmaps.bench.programs.ours import pair_system
    from nsmaps.bench.task import grid_task
    from nsmaps.exact.engine import march
    from nsmaps.exact.engine.blocks import batch
    from nsmaps.exact.engine.flight import flow, remainders

    task = grid_task().first(returns)
    system = pair_system(task.pair)
    counts = dict.fromkeys(COUNTED.values(), 0)

    def counted(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any) -> Any:
            counts[COUNTED[name]] += 1
            return function(*args)

        return call

    for module, name in ((march, "evaluate"), (flow, "wave"), (remainders, "wave")):
        setattr(module, name, counted(name, getattr(module, name)))
    batch.FEW = sys.maxsize  # one by one: side by side, calls are of whole blocks
    system.first_return(task.starts)
    print(json.dumps({name: count / len(task.starts) for name, count in counts.items()}))
