"""Totals of observables where flights are integrated: impact by impact, with integrals as further states of the integrator."""

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.exact.engine.flight import layout as at
from nsmaps.exact.flows.formulas import PHI, S, W, Z
from nsmaps.exact.flows.tables import Formulas
from nsmaps.exact.observables.flights import LEAST, MOST_CHATTER
from nsmaps.exact.observables.memory import rule
from nsmaps.exact.ode.integrator import sampler_of
from nsmaps.exact.ode.kernel import IntegratedKernel
from nsmaps.exact.returns import Impacts
from nsmaps.exact.words import CHATTER

if TYPE_CHECKING:
    from nsmaps.exact.observables.totals import Plan


def integrated_totals(kernel: IntegratedKernel, plan: "Plan", discard: int, length: int, chatter: float, *rows: Any) -> None:
    """As `observed` of closed forms, for one state (2,): it, its outcome (1,), times (B,) and totals (B, C) are written.

    Raises:
        NsmapsError: the largest value of a formula of flights is asked for.
    """
    state, outcome, time, totals = rows
    time[:], totals[:] = np.nan, np.nan
    for b in range(-1 if discard else 0, len(time)):
        wanted = discard if b < 0 else length
        s, sums, passed = _returns(kernel, plan, state.copy(), wanted, chatter)
        outcome[:] = kernel.first_returns(passed[min(len(s), wanted - 1)][None], False, chatter).outcome
        if len(s) < wanted:
            state[:] = np.nan
            return
        state[:] = passed[-1]
        if b >= 0:
            time[b], totals[b] = s.sum(), np.where(plan.largest, sums.max(axis=0), sums.sum(axis=0))


def _returns(
    kernel: IntegratedKernel, plan: "Plan", state: Floats, returns: int, chatter: float
) -> tuple[Floats, Floats, Floats]:
    """The times (R,) and totals (R, C) of the first returns of a state, R of them or fewer, and all states, shape (R + 1, 2)."""
    if plan.largest[plan.rows["impacts"].shape[1] :].any():
        raise NsmapsError("the largest value of a formula of integrated flights is not known; expected: one of impacts, or a sum")
    times, totals, states, n = [np.empty(0)], [np.empty((0, len(plan.columns)))], [state[None]], 2 * returns + 2
    while returns > 0:
        found = kernel.impacts(states[-1][-1], n, chatter)
        base = np.flatnonzero(found.wall == 0)[: returns + 1]
        if len(base) > 1:
            times.append(np.diff(found.time[base]))
            totals.append(np.array([_total(kernel, plan, found, slice(*ends)) for ends in pairwise(base)]))
            states.append(np.column_stack([found.speed, found.phase])[base[1:]])
            returns -= len(base) - 1
        if len(found.wall) < n:
            break
        n *= 2  # a return may have more impacts
    return np.concatenate(times), np.concatenate(totals), np.concatenate(states)


def _total(kernel: IntegratedKernel, plan: "Plan", found: Impacts, which: slice) -> Floats:
    """The totals of some impacts and of the flights that follow them, shape (C,)."""
    numbers = range(which.start, which.stop)
    hits = np.concatenate([_hits(kernel, plan, found, i) for i in numbers])
    sums = np.where(plan.largest[: hits.shape[1]], hits.max(axis=0, initial=-np.inf), hits.sum(axis=0))
    return np.append(sums, sum(_flown(kernel, plan, found, i) for i in numbers))


def _hits(kernel: IntegratedKernel, plan: "Plan", found: Impacts, i: int) -> Floats:
    """The values of an impact, and of those after it if they accumulate, shape (impacts, K)."""
    formulas, _ = _compiled(kernel.formulas, plan)
    row, speed, largest = int(found.wall[i]), float(found.speed[i]), plan.largest[: plan.rows["impacts"].shape[1]]
    place, letter = _place(kernel, row)[0], kernel.system.letters[row]
    speeds, endless = [speed], bool(found.mark[i + 1] == CHATTER)
    after = [float(kernel.system.rebound(speed, letter))]
    while endless and after[-1] > LEAST * after[0] and len(speeds) < MOST_CHATTER:
        speeds.append(after[-1])
        after.append(float(kernel.system.rebound(after[-1], letter)))
    hits = np.column_stack([speeds, after])[: None if speed > 0 else 0]
    ends = np.zeros((1 if endless else 0, 2))  # a formula that is not zero at speed zero has no finite sum
    found_at = [formulas(v, u, place, float(found.phase[i]), *kernel.system.parameters.values()) for v, u in (*hits, *ends)]
    values = np.reshape(found_at, (len(hits) + len(ends), len(largest)))
    if endless:
        values[-1] = np.where(largest | (values[-1] == 0), values[-1], np.copysign(np.inf, values[-1]))
    return np.where(plan.rows["impacts"][row], values, np.where(largest, -np.inf, 0.0))


def _flown(kernel: IntegratedKernel, plan: "Plan", found: Impacts, i: int) -> Floats:
    """The integrals over the flight, or the rest, after an impact, shape (F,)."""
    integrands, resting = _integrands(kernel.formulas, plan), _compiled(kernel.formulas, plan)[1]
    row, rate, parameters = int(found.wall[i]), float(kernel.table[at.PHASE_RATE]), tuple(kernel.system.parameters.values())
    (place, into), s = _place(kernel, row), float(found.time[i + 1] - found.time[i])
    start = float(found.phase[i]) / rate
    if not integrands:
        return np.empty(0)
    if found.mark[i + 1]:
        nodes, weights = rule()
        ends = np.linspace(0, s, 1 + int(np.ceil(s * rate)))
        parts = [(start + low + (high - low) * nodes, (high - low) * weights) for low, high in pairwise(ends)]
        over = sum(weight * np.array(resting(t, place, *parameters)) for x, w in parts for t, weight in zip(x, w, strict=True))
    else:
        velocity = -into * float(kernel.system.rebound(float(found.speed[i]), kernel.system.letters[row]))
        sampled = sampler_of(kernel.formulas.acceleration, kernel.formulas.symbols, integrands)
        over = sampled(np.array([start, place, velocity, *parameters]), np.array([0.0, s]))[2:, -1]
    return np.where(plan.rows["flights"][row], over, 0.0)


def _place(kernel: IntegratedKernel, row: int) -> tuple[float, float]:
    """The place of a wall, 0 the base, and the sign of velocities towards it."""
    up = bool(kernel.table[at.BASE_UP]) == (row == 0)
    return (float(kernel.table[at.TOP]), 1.0) if up else (float(kernel.table[at.BOTTOM]), -1.0)


@lru_cache(maxsize=64)
def _integrands(formulas: Formulas, plan: "Plan") -> tuple[sp.Expr, ...]:
    """The formulas of flights by time, place and velocity, the symbols of an equation of motion."""
    place, velocity = plan.vocabulary.variables("flights")
    return tuple(one.subs({place: Z, velocity: W, PHI: S * formulas.numbers[2]}) for one in plan.formulas["flights"])


@lru_cache(maxsize=64)
def _compiled(formulas: Formulas, plan: "Plan") -> tuple[Callable[..., Any], Callable[..., Any]]:
    """The formulas of impacts by speed before and after, place, phase and parameters; of rests by time, place and parameters."""
    impacts = sp.lambdify((*plan.vocabulary.variables("impacts"), PHI, *formulas.symbols), plan.formulas["impacts"])
    rests = sp.lambdify((S, Z, *formulas.symbols), [one.subs(W, 0) for one in _integrands(formulas, plan)])
    return impacts, rests
