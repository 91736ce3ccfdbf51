"""Totals of observables where flights are integrated: impact by impact, with integrals over the steps of the flights."""

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.exact.engine.flight import layout as at
from nsmaps.exact.flows.formulas import PHI, S, W, Z
from nsmaps.exact.flows.tables import Formulas
from nsmaps.exact.observables.formulas import Plan
from nsmaps.exact.observables.memory import rule
from nsmaps.exact.observables.sums import LEAST
from nsmaps.exact.ode.kernel import IntegratedKernel
from nsmaps.exact.ode.steps.pieces import Step
from nsmaps.exact.returns import Impacts
from nsmaps.exact.words import CHATTER

MOST_CHATTER = 100_000  #: impacts of chatter that are added: after more the totals are not known
AGREE = 1e-14  #: of the integral of a size over a flight: two rules of quadrature that differ by less agree
MOST_HALVINGS = 40  #: of a step, beside a kink of a formula


def integrated_totals(kernel: IntegratedKernel, plan: Plan, discard: int, length: int, chatter: float, *rows: Any) -> None:
    """As `observed` of closed forms, for one state (2,): it, its outcome (1,), times (B,) and totals (B, C) are written.

    Raises:
        NsmapsError: the largest value of a formula of flights is asked for.
    """
    state, outcome, time, totals = rows
    time[:], totals[:] = np.nan, np.nan
    for b in range(-1 if discard else 0, len(time)):
        wanted = discard if b < 0 else length
        run = kernel.orbits(state[None], wanted, False, chatter)
        count = int(run.valid.sum())
        outcome[:] = run.outcome[min(count, wanted - 1)]
        if count < wanted:
            state[:] = np.nan
            return
        if b >= 0:
            sums = _returns(kernel, plan, state.copy(), wanted, chatter)
            time[b], totals[b] = run.time.sum(), np.where(plan.largest, sums.max(axis=0), sums.sum(axis=0))
        state[:] = run.image[-1]


def _returns(kernel: IntegratedKernel, plan: Plan, state: Floats, returns: int, chatter: float) -> Floats:
    """The totals of the first returns of a state, all of which have images, shape (R, C)."""
    if plan.largest[plan.rows["impacts"].shape[1] :].any():
        raise NsmapsError("the largest value of a formula of integrated flights is not known; expected: one of impacts, or a sum")
    totals, n = [np.empty((0, len(plan.columns)))], 2 * returns + 2
    while returns > 0:
        found, flights = kernel.flights(state, n, chatter)
        base = np.flatnonzero(found.wall == 0)[: returns + 1]
        if len(base) > 1:
            totals.append(np.array([_total(kernel, plan, found, flights, slice(*ends)) for ends in pairwise(base)]))
            state = np.array([found.speed[base[-1]], found.phase[base[-1]]])
            returns -= len(base) - 1
        n *= 2  # a return may have more impacts
    return np.concatenate(totals)


def _total(kernel: IntegratedKernel, plan: Plan, found: Impacts, flights: list[list[Step]], which: slice) -> Floats:
    """The totals of some impacts and of the flights that follow them, shape (C,)."""
    numbers = range(which.start, which.stop)
    hits = np.concatenate([_hits(kernel, plan, found, i) for i in numbers])
    sums = np.where(plan.largest[: hits.shape[1]], hits.max(axis=0, initial=-np.inf), hits.sum(axis=0))
    return np.append(sums, sum(_flown(kernel, plan, found, flights[i], i) for i in numbers))


def _hits(kernel: IntegratedKernel, plan: Plan, found: Impacts, i: int) -> Floats:
    """The values of an impact, and of those after it if they accumulate, shape (impacts, K)."""
    formulas, _ = _compiled(kernel.formulas, plan)
    row, speed, largest = int(found.wall[i]), float(found.speed[i]), plan.largest[: plan.rows["impacts"].shape[1]]
    place, letter, phi = _place(kernel, row)[0], kernel.system.letters[row], float(found.phase[i])
    speeds, endless = [speed], bool(found.mark[i + 1] == CHATTER)
    after = [float(kernel.system.rebound(speed, letter))]
    while endless and after[-1] > LEAST * after[0] and len(speeds) < MOST_CHATTER:
        speeds.append(after[-1])
        after.append(float(kernel.system.rebound(after[-1], letter)))
    hits = np.column_stack([speeds, after])[: None if speed > 0 else 0]
    ends = np.zeros((1 if endless else 0, 2))  # a formula that is not zero at speed zero has no finite sum
    phases = [phi, *(phi + _accumulation(kernel, row, phi, speed, after[0]) * (1 - u / after[0]) for u in after[1:]), phi]
    parameters = kernel.system.parameters.values()
    found_at = [formulas(v, u, place, at, *parameters) for (v, u), at in zip((*hits, *ends), phases, strict=False)]
    values = np.reshape(found_at, (len(hits) + len(ends), len(largest)))
    if endless:
        values[-1] = np.where(largest | (values[-1] == 0), values[-1], np.copysign(np.inf, values[-1]))
        values[0] = np.where(len(speeds) < MOST_CHATTER, values[0], np.nan)
    return np.where(plan.rows["impacts"][row], values, np.where(largest, -np.inf, 0.0))


def _accumulation(kernel: IntegratedKernel, row: int, phi: float, v: float, u: float) -> float:
    """The phase in which impacts of speeds v, u, ... accumulate, to first order."""
    (place, into), rate = _place(kernel, row), float(kernel.table[at.PHASE_RATE])
    press = into * float(_acceleration(kernel.formulas)(phi / rate, place, -into * u, *kernel.system.parameters.values()))
    return rate * 2 * u / (press * (1 - u / v))


def _flown(kernel: IntegratedKernel, plan: Plan, found: Impacts, steps: list[Step], i: int) -> Floats:
    """The integrals over the flight, or the rest, after an impact, shape (F,)."""
    row, start = int(found.wall[i]), float(found.phase[i]) / float(kernel.table[at.PHASE_RATE])
    if not plan.formulas["flights"]:
        return np.empty(0)
    if found.mark[i + 1]:
        steps = [Step(0.0, float(found.time[i + 1] - found.time[i]), np.zeros(1), np.zeros(1))]
    formulas, place = _compiled(kernel.formulas, plan)[1], _place(kernel, row)[0]
    parameters = tuple(kernel.system.parameters.values())

    def values(step: Step, since: Floats) -> Floats:
        displacement, velocity = step.at(since)
        found = formulas(start + since, place + displacement, velocity, *parameters)
        return np.array([np.broadcast_to(one, since.shape) for one in found], float)

    size = np.sum([np.abs(_rule_over(values, step, step.begin, step.length, np.abs)) for step in steps], axis=0)
    over = np.sum([_integral(values, step, step.begin, step.length, size) for step in steps], axis=0)
    return np.where(plan.rows["flights"][row], over, 0.0)


def _rule_over(values: Callable[..., Floats], step: Step, begin: float, length: float, of: Callable[..., Floats]) -> Floats:
    """The integrals of functions of the values over a part of a step, by one rule, shape (F,)."""
    nodes, weights = rule()
    return np.asarray(of(values(step, begin + length * nodes)) @ (length * weights), float)


def _integral(values: Callable[..., Floats], step: Step, begin: float, length: float, size: Floats, depth: int = 0) -> Floats:
    """The integrals over a part of a step, shape (F,), halved until one rule and two agree beside the `size` of the whole."""
    whole = _rule_over(values, step, begin, length, np.asarray)
    half = length / 2
    parts = [_rule_over(values, step, x, half, np.asarray) for x in (begin, begin + half)]
    if depth == MOST_HALVINGS or (np.abs(whole - parts[0] - parts[1]) <= AGREE * size).all():
        return parts[0] + parts[1]
    return _integral(values, step, begin, half, size, depth + 1) + _integral(values, step, begin + half, half, size, depth + 1)


def _place(kernel: IntegratedKernel, row: int) -> tuple[float, float]:
    """The place of a wall, 0 the base, and the sign of velocities towards it."""
    up = bool(kernel.table[at.BASE_UP]) == (row == 0)
    return (float(kernel.table[at.TOP]), 1.0) if up else (float(kernel.table[at.BOTTOM]), -1.0)


@lru_cache(maxsize=64)
def _integrands(formulas: Formulas, plan: Plan) -> tuple[sp.Expr, ...]:
    """The formulas of flights by time, place and velocity, the symbols of an equation of motion."""
    place, velocity = plan.vocabulary.variables("flights")
    return tuple(one.subs({place: Z, velocity: W, PHI: S * formulas.numbers[2]}) for one in plan.formulas["flights"])


@lru_cache(maxsize=64)
def _acceleration(formulas: Formulas) -> Callable[..., Any]:
    return sp.lambdify((S, Z, W, *formulas.symbols), formulas.acceleration)


@lru_cache(maxsize=64)
def _compiled(formulas: Formulas, plan: Plan) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """The formulas of impacts by speed before and after, place, phase and parameters; of flights by time, place, velocity and
    parameters.
    """
    impacts = sp.lambdify((*plan.vocabulary.variables("impacts"), PHI, *formulas.symbols), plan.formulas["impacts"])
    flights = sp.lambdify((S, Z, W, *formulas.symbols), _integrands(formulas, plan))
    return impacts, flights
