"""CVODE of SUNDIALS by scikit-sundae, with root functions."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from math import cos, floor, log10, pi
from typing import Any

from nsmaps.arrays import Floats
from nsmaps.bench.programs.bounces import absolute, returns_by_flights
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Pair

LONGEST = 50.0  #: flight followed


@dataclass(frozen=True)
class Cvode(Solver):
    """CVODE's Adams methods at one tolerance."""

    rtol: float
    family = "CVODE Adams"
    max_starts = 500

    @property
    def setting(self) -> str:
        """The tolerance."""
        return f"{self.rtol:.0e}"

    def prepare(self) -> str:
        """Import it."""
        import_module("sksundae.cvode")
        return f"scikit-sundae {version('scikit-sundae')} (SUNDIALS {import_module('sksundae').SUNDIALS_VERSION})"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """One flight after another."""
        cvode = import_module("sksundae.cvode")
        phase, places, g = [0.0], [0.0, 0.0], pair.g_bar

        def rates(t: float, y: Any, yp: Any) -> None:
            yp[0], yp[1] = y[1], g + cos(phase[0] + pi * t)

        def walls(t: float, y: Any, events: Any) -> None:
            events[0], events[1] = y[0] - places[0], y[0] - places[1]

        walls.terminal, walls.direction = [True, True], [-1, 1]  # type: ignore[attr-defined]

        @lru_cache
        def solver(decade: int) -> Any:
            """A solver for velocities of this decade."""
            atol = absolute(self.rtol, 10.0**decade)
            return cvode.CVODE(
                rates, eventsfn=walls, num_events=2, method="Adams", rtol=self.rtol, atol=atol, max_num_steps=100_000
            )

        def flight(phi: float, start: float, w: float, low: float, high: float) -> tuple[float, float, bool]:
            phase[0], places[:] = phi, (low, high)
            done = solver(floor(log10(abs(w)))).solve([0.0, LONGEST], [start, w])
            if done.t_events is None or not len(done.t_events):
                return LONGEST, 0.0, False
            return float(done.t_events[-1]), float(done.y_events[-1][1]), True

        answer = returns_by_flights(flight, pair, starts)
        return lambda: answer
