"""SciPy's `solve_ivp` with events."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi
from typing import Any

from nsmaps.arrays import Floats
from nsmaps.bench.programs.bounces import absolute, returns_by_flights
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Pair

LONGEST = 50.0  #: flight followed


class _Wall:
    """An event: the displacement passes a wall in one direction."""

    terminal = True

    def __init__(self, direction: float) -> None:
        self.direction, self.place = direction, 0.0

    def __call__(self, t: float, y: Any) -> float:
        return float(y[0]) - self.place


@dataclass(frozen=True)
class SciPy(Solver):
    """One of SciPy's methods at one tolerance."""

    method: str
    rtol: float
    max_starts = 500

    @property
    def family(self) -> str:
        """The method."""
        return f"scipy {self.method}"

    @property
    def setting(self) -> str:
        """The tolerance."""
        return f"{self.rtol:.0e}"

    def prepare(self) -> str:
        """Import it."""
        import scipy

        return f"scipy {scipy.__version__}"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """One flight after another."""
        from scipy.integrate import solve_ivp

        g, low_wall, high_wall = pair.g_bar, _Wall(-1), _Wall(1)

        def flight(phi: float, start: float, w: float, low: float, high: float) -> tuple[float, float, bool]:
            low_wall.place, high_wall.place = low, high
            done = solve_ivp(
                lambda t, y: (y[1], g + cos(phi + pi * t)),
                (0, LONGEST),
                (start, w),
                method=self.method,
                rtol=self.rtol,
                atol=absolute(self.rtol, w),
                events=(low_wall, high_wall),
            )
            return done.t[-1], done.y[1, -1], done.status == 1

        answer = returns_by_flights(flight, pair, starts)
        return lambda: answer
