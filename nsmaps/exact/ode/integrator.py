"""heyoka's Taylor series of an equation of motion, several flights at a time, and its held ball in Chebyshev series.

heyoka is imported when an integrator is first asked for, and the coefficients of its series alone are used: steps, first impacts
and impact laws are those of this room.
"""

from dataclasses import dataclass
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.exact.flows.formulas import S, W, Z
from nsmaps.exact.taylor.expressions import expression, heyoka

TIME, PLACE, PLACE_RATE, VALUES = range(4)  #: parameters of the integrator: of the lane, then those of the system and their rates


@dataclass(frozen=True, slots=True, eq=False)
class Integrator:
    """Taylor series of displacement since the impact and velocity, with their derivatives, for a few flights side by side."""

    program: Any  #: heyoka's `taylor_adaptive_batch`
    pars: Floats  #: shape (P, lanes), its parameters: those up to the last one that is in its equations
    nowhere: list[float]  #: the lengths of its steps, zero: steps are chosen by the engine
    lock: Any  #: it has one state: one thread at a time

    def expand(self, pars: Floats) -> None:
        """Compute the Taylor coefficients `program.tc` of all states, shape (states, order + 1, lanes), where they are now.

        Of `pars`, shape (at least P, lanes), the first rows are the integrator's.
        """
        self.pars[:] = pars[: len(self.pars)]
        self.program.set_time(0.0)  # a flight beyond the range of floats leaves NaN behind
        self.program.step(self.nowhere, True)


@lru_cache(maxsize=64)
def integrator_of(acceleration: sp.Expr, parameters: tuple[sp.Symbol, ...], moved: bool) -> Integrator:
    """The compiled integrator of an acceleration by S (the time), Z, W and the parameters.

    Derivatives are by displacement, velocity and time, and if `moved` along a direction of the parameters, whose rates follow
    their values.

    Raises:
        NsmapsError: heyoka is not installed.
        SystemDefinitionError: the acceleration has a function of which heyoka knows no series.
    """
    hy = heyoka()
    n = len(parameters)
    place, velocity = hy.make_vars("d", "v")
    along = hy.par[VALUES + 2 * n]  # which is zero: derivatives by it are those along the direction

    def changed(value: int, rate: int) -> Any:
        return hy.par[value] + along * hy.par[rate] if moved else hy.par[value]

    known = {S: hy.par[TIME] + hy.time, Z: changed(PLACE, PLACE_RATE) + place, W: velocity}
    known |= {symbol: changed(VALUES + k, VALUES + n + k) for k, symbol in enumerate(parameters)}
    rates = [(place, velocity), (velocity, expression(acceleration, known))]
    by = [place, velocity, hy.par[TIME], *([along] if moved else [])]
    system = hy.var_ode_sys(rates, args=by, order=1)
    start = np.zeros((2 + 2 * len(by), hy.recommended_simd_size()))
    program = hy.taylor_adaptive_batch(system, start, tol=0.0)
    return Integrator(program, program.pars, [0.0] * start.shape[1], Lock())
