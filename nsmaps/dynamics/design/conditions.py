"""Conditions on a periodic motion: smooth functions of the parameters, at least zero where they are met, and how they bind."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats, Storable
from nsmaps.dynamics.margins import margins_of
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem

STABILITY = 3  #: functions of `stability`
FAR = 1.0  #: beyond which margins from a graze are not distinguished
BINDING = 1e-6  #: margin of an active condition, of a parameter as a share of its range


@dataclass(frozen=True, slots=True)
class Condition(Storable):
    """A condition at an optimum."""

    name: str  #: multiplier, clearance, impact speed, share or existence; of a parameter its name
    value: float
    low: float  #: least value allowed; -inf without one
    high: float  #: greatest value allowed; inf without one
    active: bool  #: whether the optimum lies on it
    gain: float  #: Lagrange multiplier: what the observable gains for each unit by which the bound is relaxed; NaN: unknown

    @property
    def margin(self) -> float:
        """The distance of the value from the nearer bound, below zero if it is not met."""
        return min(self.value - self.low, self.high - self.value)


def stability(derivative: Floats, bound: float) -> Floats:
    """Three numbers above zero while no multiplier of a derivative (n, n) has passed the circle of radius `bound`.

    They are the products of 1 - m, of 1 + m and of 1 - m m' over all multipliers m and all pairs m, m', in units of the bound:
    zero where a real multiplier is the bound or its negative, or where a complex pair lies on the circle. They are smooth in the
    derivative, which the largest magnitude is not where multipliers meet.
    """
    m = np.linalg.eigvals(derivative / bound)
    first, second = np.triu_indices(len(m), 1)
    return np.array([np.prod(1 - m).real, np.prod(1 + m).real, np.prod(1 - m[first] * m[second]).real])


def margins(system: System, orbit: PeriodicOrbit) -> Floats:
    """The margins of the q returns of an orbit from a graze, shape (2, q): least gap to a wall not met, least impact speed.

    Speeds are shares of the orbit's largest impact speed, with modes of the largest rate of the guard's function just before
    events, gaps shares of the distance moved at it in a radian of phase. A map without motions has none: infinity.
    """
    if not isinstance(system, FlowSystem):
        return np.full((2, len(orbit.states)), np.inf)
    if isinstance(system, HybridSystem):
        return margins_of(system, orbit.states, system.guard_speeds(orbit.states))
    assert isinstance(system, ImpactSystem)
    hits = [system.impacts(state, len(word)).speed for state, word in zip(orbit.states, orbit.words, strict=True)]
    return margins_of(system, orbit.states, np.array([np.max(np.concatenate(hits))]))


def gains(gradient: Floats, slopes: Floats) -> tuple[Floats, Floats]:
    """Lagrange multipliers (c,), at least zero, of active conditions with slopes (c, k), and what they leave of a gradient (k,).

    That is the part of the gradient (k,) of what is maximised which they do not balance: zero at a local optimum, by the
    conditions of Karush, Kuhn and Tucker.
    """
    from scipy.optimize import nnls

    if not len(slopes):
        return np.zeros(0), gradient
    found, _ = nnls(-slopes.T, gradient)
    return np.asarray(found), np.asarray(gradient + found @ slopes)
