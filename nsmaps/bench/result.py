"""What a benchmark found: a row a program, as a Markdown table."""

import os
import platform
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from nsmaps.errors import NsmapsError, near_match

HEAD = "program | returns | µs per return | ratio | worst error | 99 % error | wrong words | wrong hard cases"


@dataclass(frozen=True, slots=True)
class Row:
    """The errors and times of one solver."""

    family: str  #: the program and its method
    setting: str  #: such as its tolerance
    package: str  #: with its version
    asked: int  #: starts of the grid that it was asked for
    times: tuple[float, ...]  #: seconds a return, a timing each
    worst: float  #: error of speed or phase (radians), the larger, over returns with the right word; NaN if none
    quantile: float  #: the error that 99 % of them stay below
    wrong: int  #: of the starts asked: wrong word, or no answer
    wrong_hard: int  #: of the hard cases: wrong word, or impact speed off by more than 1 %

    @property
    def name(self) -> str:
        """Family and setting."""
        return f"{self.family} {self.setting}".strip()

    @property
    def microseconds(self) -> float:
        """The shortest time, microseconds a return."""
        return 1e6 * min(self.times)


@dataclass(frozen=True, slots=True)
class BenchResult:
    """Programs side by side on the same first returns."""

    rows: tuple[Row, ...]
    against: str  #: the program that ratios of time refer to
    skipped: dict[str, str]  #: programs that did not take part, and why
    hard: int  #: how many hard cases there are
    work: dict[str, float] = field(default_factory=dict)  #: calls a return of nsmaps
    machine: dict[str, str] = field(default_factory=dict)

    def row(self, name: str) -> Row:
        """The row of a program. Raises NsmapsError if it did not take part."""
        for row in self.rows:
            if row.name == name:
                return row
        names = [row.name for row in self.rows]
        raise NsmapsError(f"{name!r} did not take part{near_match(name, names)}; there are: {', '.join(names)}")

    def ratio(self, name: str, to: str | None = None) -> float:
        """The time of a program over that of another, `against` unless named; both the shortest of this run."""
        return self.row(name).microseconds / self.row(to or self.against).microseconds

    def table(self) -> str:
        """Everything as Markdown."""
        head = HEAD.replace("ratio", f"time / {self.against}").replace("hard cases", f"of {self.hard} hard")
        lines = [f"| {head} |", "|---" + "|---:" * head.count("|") + "|"]
        for row in self.rows:
            wrong = f"{row.wrong} of {row.asked}" if row.asked < max(r.asked for r in self.rows) else str(row.wrong)
            time = [_short(row.microseconds), _short(self.ratio(row.name))]
            cells = [row.name, f"{row.asked}", *time, f"{row.worst:.1e}", f"{row.quantile:.1e}", wrong, str(row.wrong_hard)]
            lines.append(f"| {' | '.join(cells)} |")
        return "\n".join([*lines, "", *self._notes()]) + "\n"

    def _notes(self) -> list[str]:
        counted = " and ".join(f"{value:.2f} {name}" for name, value in self.work.items())
        missing = "; ".join(f"{name} ({why})" for name, why in self.skipped.items())
        packages = dict.fromkeys(row.package for row in self.rows)
        return [
            "First returns of the vibro-impact pair (d = 0.30, r = 0.5, beta = pi/3) from a grid of speeds in [0.01, 1.2] by "
            "phases in [0, 2 pi). Time is the shortest of several turns that the programs took in rotation, on one core but for "
            "nsmaps where it says two and for JAX; compare times within one table only. Programs that take long were asked for "
            "fewer returns. Errors are of impact speed or phase (radians), the larger, against 50-digit references, over the "
            "returns with the right word. A hard case lies next to a graze, or impacts at a speed down to 1e-10; it is wrong if "
            "the word is, or the impact speed by more than 1 %. Every peer was set up with care; its own expert may do better.",
            *(["", f"Beside the time, which depends on the machine: nsmaps makes {counted} a return."] if counted else []),
            *(["", f"Not taking part: {missing}."] if missing else []),
            "",
            f"{', '.join(self.machine.values())}. {'; '.join(packages)}.",
        ]


def this_machine() -> dict[str, str]:
    """Processor, cores, operating system and Python."""
    name = platform.processor() or platform.machine()
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), name)
    return {
        "processor": f"{name} ({platform.machine()})",
        "cores": f"{os.cpu_count()} cores",
        "system": platform.system(),
        "python": f"Python {platform.python_version()}",
    }


def _short(value: float) -> str:
    """Three digits, without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"
