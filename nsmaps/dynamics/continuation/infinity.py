"""Cycles of affine pieces that grow without bound, as a multiplier tends to 1: zeros of det(M - 1) by the formulas of pieces."""

from collections.abc import Callable, Sequence

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.pieces import AtBorder, pieces_of
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit

LARGE = 4.0  #: states, in the curve's units, from which on a cycle may go to infinity
ROUNDING = 8 * float(np.finfo(float).eps)  #: of det(M - 1)
STEP, FARTHER, NEXT = 1e-6, 2.0, 1e-3  #: of the search for it, in the parameter's range and as shares of the distance


def infinity_met(
    curve: OrbitCurve, last: OrbitPoint, way: float, tests: Sequence[Callable[[OrbitPoint, Floats], float]]
) -> tuple[float, float] | None:
    """The value of the parameter, and its precision, at which the states of a cycle of affine pieces grow without bound, or None.

    There a multiplier is 1. It is sought ahead of a point whose states are large, in a direction of the parameter, and taken if
    the cycle is there up to near it and no test of an event changes its sign.
    """
    return_map = curve.map_of(last.value)
    if not (np.abs(last.y[:-1]).max() > LARGE and return_map.is_affine):
        return None
    states = last.orbit.states
    at = AtBorder((), (), (), pieces_of(return_map, last), (), np.zeros((2, *states.shape)), ())

    def singular(value: float) -> float:
        returns = at.prolonged(curve.map_of(value), 0).first_return(states, derivative=True)
        return float(np.linalg.det(PeriodicOrbit(returns, curve.tolerance, curve.scale).derivative - np.eye(states.shape[1])))

    from scipy.optimize import brentq

    value, step = last.value, STEP * curve.unit
    slope = (singular(value) - singular(value - way * step)) / (way * step)
    far = float(np.clip(value - FARTHER * singular(value) / slope, curve.low, curve.high)) if slope else value
    if not ((far - value) * way > 0 > singular(value) * singular(far)):
        return None
    at_infinity = float(brentq(singular, value, far, xtol=1e-15 * curve.unit))
    near = at_infinity + NEXT * (value - at_infinity)
    cycle = periodic_orbit(curve.map_of(near), states / NEXT, len(states), scale=curve.scale / NEXT)
    there = curve.evaluate(curve.y(cycle.states, near)) if cycle.converged and cycle.words == last.orbit.words else None
    passed = there is None or any(test(last, last.y) * test(there, last.y) < 0 for test in tests)
    return None if passed else (at_infinity, ROUNDING / abs(slope) + 4 * float(np.spacing(abs(at_infinity))))
