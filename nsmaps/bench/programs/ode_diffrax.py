"""diffrax: solvers in JAX, compiled, all starts side by side."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.bench.programs.bounces import INSIDE
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Pair

LONGEST, MOST_IMPACTS = 50.0, 20


@lru_cache(maxsize=8)
def _solver(method: str, rtol: float) -> Callable[..., Any]:
    """From (pair, starts) to speed, phase, impacts on T and whether it ended, compiled for all starts at once."""
    jax, dfx = import_module("jax"), import_module("diffrax")
    jax.config.update("jax_enable_x64", True)
    flight = _flight(method, rtol)

    def first_return(pair: Any, start: Any) -> Any:
        def goes_on(now: Any) -> Any:
            return ~now[3] & (now[2] < MOST_IMPACTS)

        def step(now: Any) -> Any:
            (v, phi, tops, over), (d, r, g) = now, pair
            w = jax.numpy.where(over, -1.0, -r * v)  # one that is back waits for the others: anything but NaN
            done = flight(phi, g, w, jax.numpy.where(w < 0, -d, 0.0), jax.numpy.where(w < 0, 0.0, d))
            hit = done.result == dfx.RESULTS.event_occurred
            speed = jax.numpy.where(hit, done.ys[0, 1], np.nan)
            return speed, (phi + np.pi * done.ts[0]) % (2 * np.pi), tops + 1, ~hit | (speed > 0)

        return jax.lax.while_loop(goes_on, step, (start[0], start[1], -1, False))

    return jax.jit(jax.vmap(first_return, in_axes=(None, 0)))


def _flight(method: str, rtol: float) -> Callable[..., Any]:
    """From (phase, gravity, velocity, lower wall, upper wall) to the solution of a flight until it meets a wall."""
    dfx, optx, jnp = import_module("diffrax"), import_module("optimistix"), import_module("jax").numpy
    event = dfx.Event(
        [lambda t, y, args, **_: y[0] - args[2], lambda t, y, args, **_: y[0] - args[3]],
        optx.Newton(rtol=min(1e-3 * rtol, 1e-12), atol=1e-15),
        direction=[False, True],
    )
    term = dfx.ODETerm(lambda t, y, args: jnp.array([y[1], args[1] + jnp.cos(args[0] + np.pi * t)]))

    def flight(phi: Any, g: Any, w: Any, low: Any, high: Any) -> Any:
        return dfx.diffeqsolve(
            term,
            getattr(dfx, method)(),
            0.0,
            LONGEST,
            None,
            jnp.array([jnp.copysign(INSIDE, w), w]),
            args=(phi, g, low, high),
            stepsize_controller=dfx.PIDController(rtol=rtol, atol=rtol * jnp.minimum(1.0, w * w)),
            event=event,
            max_steps=100_000,
            throw=False,
        )

    return flight


@dataclass(frozen=True)
class Diffrax(Solver):
    """One of diffrax's solvers at one tolerance."""

    method: str
    rtol: float

    @property
    def family(self) -> str:
        """The solver."""
        return f"diffrax {self.method}"

    @property
    def setting(self) -> str:
        """The tolerance."""
        return f"{self.rtol:.0e}"

    def prepare(self) -> str:
        """Import and compile it."""
        _solver(self.method, self.rtol)
        return f"diffrax {import_module('diffrax').__version__} (jax {import_module('jax').__version__})"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """All starts in one compiled call."""
        found = _solver(self.method, self.rtol)((pair.d, pair.r, pair.g_bar), starts)
        v, phi, tops, _ = map(np.asarray, found)
        lost = ~np.isfinite(v)
        return lambda: Answer(np.column_stack([v, phi]), np.where(lost, -1, tops).astype(np.int8))
