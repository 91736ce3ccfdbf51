"""The hand-written C loop as a solver, compiled by gcc -O2 and called through ctypes."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Floats, Pair

SOURCE = Path(__file__).with_name("loop.c")
FLAGS = ("-O2",)


@lru_cache(maxsize=8)
def compiled(flags: tuple[str, ...]) -> ctypes.CDLL:
    """The library, built anew in a temporary folder."""
    if shutil.which("gcc") is None:
        raise OSError("gcc is not installed")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        out = str(Path(folder, "loop.so"))
        subprocess.run(["gcc", *flags, "-shared", "-fPIC", "-o", out, str(SOURCE), "-lm"], check=True)
        library = ctypes.CDLL(out)
    doubles = np.ctypeslib.ndpointer(np.float64, flags="C")
    tops = np.ctypeslib.ndpointer(np.int8, flags="C")
    library.first_returns.argtypes = [*[ctypes.c_double] * 3, ctypes.c_long, doubles, doubles, tops]
    library.first_returns.restype = None
    return library


@dataclass(frozen=True)
class CLoop(Solver):
    """Turning points in closed form, then Newton, on one core; plainly written, or tuned."""

    tuned: bool = False
    family = "C loop"

    @property
    def setting(self) -> str:
        """How much trouble was taken over it."""
        return "tuned" if self.tuned else "plain"

    @property
    def flags(self) -> tuple[str, ...]:
        """What the compiler is told."""
        return FLAGS if self.tuned else (*FLAGS, "-DPLAIN")

    def prepare(self) -> str:
        """Compile it."""
        compiled(self.flags)
        version = subprocess.run(["gcc", "-dumpfullversion"], capture_output=True, text=True, check=True).stdout.strip()
        return f"gcc {version} {' '.join(FLAGS)}"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """One call for the whole batch."""
        answer = Answer(np.empty_like(starts), np.empty(len(starts), np.int8))
        compiled(self.flags).first_returns(pair.d, pair.r, pair.g_bar, len(starts), starts, answer.image, answer.tops)
        return lambda: answer
