"""The time to a first result, `nsmaps bench --start`: user time of whole programs, as multiples of what their imports take."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from nsmaps.errors import NsmapsError
from nsmaps.progress import Progress, beat, shows

IMPORTS = "import numba, sympy, scipy.optimize, matplotlib.pyplot, pydantic, rich, typer"  #: the unit I
STUDIES = ("fp", "pd", "cd", "auto")  #: of vi_pair
TURNS = 3  #: of which the median counts; of an empty cache one
FORMULA = '''
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class Ball(ImpactSystem):
    """A ball on a table that moves as Gamma sin t."""

    Gamma: float
    r: float = 0.5

    def walls(self):
        return {{"B": Wall(at=0, side=-1)}}

    def period(self):
        from sympy import pi

        return 2 * pi

    def displacement(self, t, hit):
        from sympy import cos, sin

        s = t - hit.t
        return hit.z + (hit.w + self.Gamma * cos(hit.t)) * s - s**2 / {divisor} - self.Gamma * (sin(t) - sin(hit.t))
'''
FIRST_RETURN = "import nsmaps; print(nsmaps.load_system('ball.py:Ball', Gamma=2.0).first_return([[3.0, 1.0]]).image)"


@dataclass(frozen=True, slots=True)
class Start:
    """What one program took."""

    name: str
    shares: tuple[float, ...]  #: user time over I, a turn each, I measured before and after it
    seconds: tuple[float, ...]  #: user time, s
    steps: Mapping[str, float] = field(default_factory=dict)  #: of a study, seconds on the clock by step, of the last turn

    @property
    def share(self) -> float:
        """The median multiple of I."""
        return median(self.shares)


@dataclass(frozen=True, slots=True)
class StartResult:
    """The programs one after another."""

    rows: tuple[Start, ...]
    unit: float  #: I, s

    def table(self) -> str:
        """Everything as Markdown."""
        lines = ["| what | user time / I | s | seconds on the clock by step |", "|---|---:|---:|---|"]
        for row in self.rows:
            steps = ", ".join(f"{name} {time:.1f}" for name, time in row.steps.items())
            lines.append(f"| {row.name} | {row.share:.1f} | {median(row.seconds):.1f} | {steps} |")
        turns = max(len(row.shares) for row in self.rows)
        note = (
            f"I is the user time of `{IMPORTS}`, {self.unit:.2f} s here, taken before and after each program. "
            f"Medians of {turns} turns, of an empty cache and an edited formula of one."
        )
        return "\n".join([*lines, "", note]) + "\n"


@dataclass(slots=True)
class Clock:
    """Takes the user time of programs beside that of their imports."""

    folder: Path  #: in which they run
    environment: Mapping[str, str]  #: of theirs
    units: list[float] = field(default_factory=list)  #: I, s, as often as it was taken

    def user(self, *arguments: str, **environment: str) -> float:
        """The user time of Python with these arguments, s. NsmapsError if it fails."""
        before = os.times().children_user
        command, variables = [sys.executable, *arguments], {**self.environment, **environment}
        variables.pop("PYTHONDONTWRITEBYTECODE", None)  # modules are translated once, as they are when a package is installed
        done = subprocess.run(command, cwd=self.folder, env=variables, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):
            raise NsmapsError(
                f"{' '.join(arguments)} ended with {done.returncode}; expected: 0 or 1. It said: {done.stderr[-500:]}"
            )
        return os.times().children_user - before

    def imports(self) -> float:
        """I, s, taken now."""
        self.units.append(self.user("-c", IMPORTS))
        return self.units[-1]

    def take(self, name: str, *arguments: str, turns: int = 1, **environment: str) -> Start:
        """A program as often as there are turns, between two of I each."""
        shares, seconds, unit = list[float](), list[float](), self.imports()
        for _ in range(turns):
            seconds.append(self.user(*arguments, **environment))
            before, unit = unit, self.imports()
            shares.append(2 * seconds[-1] / (before + unit))
        return Start(name, tuple(shares), tuple(seconds))

    def study(self, name: str, *options: str, turns: int = 1, **environment: str) -> Start:
        """A run of a study of vi_pair, with its seconds by step."""
        out = f"{name}{len(self.units)}"
        title = f"run vi_pair/{' '.join([name, *options])}{', empty kernel cache' if environment else ''}"
        arguments = ("-m", "nsmaps", "run", f"vi_pair/{name}", "--quiet", "--out", out, *options)
        taken = self.take(title, *arguments, turns=turns, **environment)
        steps = json.loads((self.folder / out / "result.json").read_text(encoding="utf-8"))["timings"]
        return Start(taken.name, taken.shares, taken.seconds, steps)


@shows
def start(n_turns: int = TURNS, *, environment: Mapping[str, str] | None = None, progress: Progress | None = None) -> StartResult:
    """Take the user time of programs from their start to their result, each beside I: some minutes.

    Programs have the given environment, that of this process if omitted. `nsmaps bench` gives that of its shell, without its own
    limit of NumPy to one core.

    Raises NsmapsError where a program fails, and on systems that do not report the user time of programs (Windows).
    """
    if os.name == "nt" or n_turns < 1:
        raise NsmapsError(
            f"n_turns is {n_turns}, on {os.name}; expected: at least 1, on a system that reports the user time of programs"
        )
    rows: list[Start] = []
    with TemporaryDirectory() as folder:
        clock, empty = Clock(Path(folder), os.environ if environment is None else environment), str(Path(folder, "cache"))
        total = len(STUDIES) + 3
        beat(0.0, "an empty kernel cache")
        rows.append(clock.study("fp", NSMAPS_CACHE_DIR=empty))
        beat(1 / total, "vi_pair/fp")
        clock.user("-m", "nsmaps", "run", "vi_pair/fp", "--quiet")  # fills the cache, if it is not
        rows.append(clock.study("fp", turns=n_turns))
        for k, name in enumerate(STUDIES):
            beat((2 + k) / total, f"vi_pair/{name}")
            clock.user("-m", "nsmaps", "run", f"vi_pair/{name}", "--quiet", "--no-figures")
            rows.append(clock.study(name, "--no-figures", turns=n_turns))
        beat(1 - 1 / total, "a first return")
        rows.extend(_first_returns(clock, n_turns, empty))
    return StartResult(tuple(rows), median(clock.units))


def _first_returns(clock: Clock, turns: int, cache: str) -> list[Start]:
    """The first return of a formula that is known to the cache, and of one that was edited since."""
    file = clock.folder / "ball.py"
    file.write_text(FORMULA.format(divisor=2), encoding="utf-8")
    clock.user("-c", FIRST_RETURN, NSMAPS_CACHE_DIR=cache)
    known = clock.take("first return, formula known", "-c", FIRST_RETURN, turns=turns, NSMAPS_CACHE_DIR=cache)
    file.write_text(FORMULA.format(divisor=3), encoding="utf-8")
    return [known, clock.take("first return, formula edited", "-c", FIRST_RETURN, NSMAPS_CACHE_DIR=cache)]
