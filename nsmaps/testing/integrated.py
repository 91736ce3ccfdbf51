"""Flights of a system that is given by its acceleration, by Runge-Kutta steps: without the code that the map uses."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import mpmath as mp
import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

from nsmaps.exact.flows.formulas import in_symbols
from nsmaps.exact.flows.source import acceleration_of
from nsmaps.exact.systems.parameters import choices_of
from nsmaps.exact.systems.system import ImpactSystem

EXACT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}


def integrated_flight(system: ImpactSystem) -> tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]:
    """Place, velocity and acceleration as functions of (t, t0, z, w): time, and time, place, velocity just after the impact."""
    cls = type(system)
    symbolic, symbols = in_symbols(cls, choices_of(system))
    given = sp.symbols("t place velocity", real=True)
    force = sp.lambdify((*given, *symbols.values()), acceleration_of(symbolic, *given))
    values = tuple(system.parameters.values())

    def rates(t: float, y: Any) -> list[float]:
        return [y[1], force(t, *y, *values)]

    @lru_cache(maxsize=1024)
    def state(t: float, t0: float, z: float, w: float) -> Any:
        return solve_ivp(rates, (t0, t), [z, w], **EXACT).y[:, -1] if t != t0 else np.array([z, w])

    def at(t: Any, *hit: Any) -> Any:
        return state(float(t), *map(float, hit))

    return (
        lambda t, *hit: mp.mpf(at(t, *hit)[0]),
        lambda t, *hit: mp.mpf(at(t, *hit)[1]),
        lambda t, *hit: mp.mpf(force(float(t), *at(t, *hit), *values)),
    )
