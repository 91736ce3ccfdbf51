"""heyoka: Taylor's method to the precision of the machine, whose events are roots of the Taylor polynomial."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from typing import Any

from nsmaps.arrays import Floats
from nsmaps.bench.programs.bounces import returns_by_flights
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Pair

LONGEST = 50.0  #: flight followed


@lru_cache(maxsize=4)
def _integrator(tol: float) -> Any:
    """The flight in displacement y since the impact; parameters: phase, gravity, lower and upper wall."""
    hy = import_module("heyoka")
    y, v = hy.make_vars("y", "v")
    phase, g, low, high = (hy.par[i] for i in range(4))
    walls = [
        hy.t_event(y - low, direction=hy.event_direction.negative),
        hy.t_event(y - high, direction=hy.event_direction.positive),
    ]
    rates = [(y, v), (v, g + hy.cos(hy.pi * hy.time + phase))]
    return hy.taylor_adaptive(rates, [0.0, 0.0], pars=[0.0] * 4, t_events=walls, tol=tol)


@dataclass(frozen=True)
class Heyoka(Solver):
    """heyoka's adaptive Taylor integrator, one flight a call, started just inside the wall."""

    tol: float = 0.0  #: 0: the precision of double
    family = "heyoka"

    @property
    def setting(self) -> str:
        """The tolerance."""
        return f"{self.tol:.0e}" if self.tol else "2e-16"

    def prepare(self) -> str:
        """Import it and compile the integrator."""
        _integrator(self.tol)
        return f"heyoka {import_module('heyoka').__version__}"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """One flight after another."""
        ta, g = _integrator(self.tol), pair.g_bar
        pars, state, reset, run = ta.pars, ta.state, ta.reset_cooldowns, ta.propagate_until

        def flight(phi: float, start: float, w: float, low: float, high: float) -> tuple[float, float, bool]:
            ta.time = 0.0
            pars[:] = phi, g, low, high
            state[:] = start, w
            reset()
            outcome = run(LONGEST)[0]
            return ta.time, float(state[1]), int(outcome.value) in (-1, -2)

        answer = returns_by_flights(flight, pair, starts)
        return lambda: answer
