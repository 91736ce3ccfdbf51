"""Observables of maps without motions between their returns: formulas of each return, their sums and derivatives."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.dynamics.continuation.problem import derivative_of
from nsmaps.dynamics.noise.orbits import NoisyOrbits
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.returnmap import ExactMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.words import decode

if TYPE_CHECKING:
    from nsmaps.exact.observables.formulas import Plan
    from nsmaps.exact.observables.totals import Totals

BLOCK = 50_000  #: returns whose values are held at once


def values_of(system: System, plan: "Plan", returns: Returns) -> Floats:
    """The values of the formulas on N returns, shape (N, C); zero, or for largest values -inf, where a return does not count.

    NaN of returns without an image.
    """
    before, after = _inputs(returns)
    with np.errstate(all="ignore"):
        found = _functions(plan, False)(*before.T, *after.T, *system.parameters.values())
    values = np.stack([np.broadcast_to(np.asarray(each, float), len(returns)) for each in found], axis=-1) * plan.scales
    values = np.where(_counts(plan, returns), values, np.where(plan.largest, -np.inf, 0.0))
    return np.where(returns.valid[:, None], values, np.nan)


def _inputs(returns: Returns) -> tuple[Floats, Floats]:
    """States with angles in [0, 2 pi), and images with angles continued from them."""
    before = returns.coordinates.wrap(returns.start)
    return before, returns.lifted - (returns.start - before)


def _counts(plan: "Plan", returns: Returns) -> Bools:
    """Which formulas a return counts for, shape (N, C), by its letter."""
    known, inverse = np.unique(returns.codes, return_inverse=True)
    places = {letter: k for k, letter in enumerate(plan.vocabulary.places["returns"])}
    row = np.array([places.get(decode(code, returns.walls), len(places) - 1) for code in known.tolist()], int)
    return plan.rows["returns"][row[inverse.reshape(-1)]]


@lru_cache(maxsize=64)
def _functions(plan: "Plan", slopes: bool) -> Callable[..., list[Floats]]:
    """The formulas in NumPy, of states, images and parameters, or their derivatives by all of these, formula by formula."""
    import sympy as sp

    names = (*plan.vocabulary.variables("returns"), *plan.vocabulary.parameters)
    formulas = plan.formulas["returns"]
    rows = [sp.diff(formula, name) for formula in formulas for name in names] if slopes else formulas
    return sp.lambdify(names, list(rows), modules=["scipy", "numpy"], cse=True)


def map_totals(system: System, plan: "Plan", start: Floats, length: int, batches: int = 1, discard: int = 0) -> "Totals":
    """The totals over batches of returns, `length` each, of states (M, n), after some that are discarded."""
    from nsmaps.exact.observables.totals import Totals

    m = len(start)
    totals = np.tile(np.where(plan.largest, -np.inf, 0.0), (batches, m, 1))
    time, outcome, states, done = np.zeros((batches, m)), np.zeros(m, np.int8), start, -discard
    while done < batches * length:
        count = min(max(1, BLOCK // max(m, 1)), -done if done < 0 else batches * length - done)
        returns = system.orbits(states, count)
        states, outcome = returns.image[len(returns) - m :], returns.outcome[len(returns) - m :]
        if done >= 0:
            batch = np.arange(done, done + count) // length
            edges, rows = np.flatnonzero(np.diff(batch, prepend=-1)), slice(batch[0], batch[-1] + 1)
            values = values_of(system, plan, returns).reshape(count, m, -1)
            largest, sums = np.maximum.reduceat(values, edges), np.add.reduceat(values, edges)
            totals[rows] = np.where(plan.largest, np.maximum(totals[rows], largest), totals[rows] + sums)
            time[rows] += np.add.reduceat(returns.time.reshape(count, m), edges)
        done += count
    return Totals(totals, time, states, outcome)


def noisy_totals(system: System, orbits: NoisyOrbits, observables: tuple[Observable, ...]) -> tuple[Floats, Floats]:
    """Totals and weights of K observables over each realisation that did not end, shape (R, K)."""
    from nsmaps.exact.observables.formulas import plan_of

    plan, held = plan_of(system, observables), orbits.held
    n, r = len(orbits.codes), int(held.sum())
    rows: list[Any] = [part[:, held].reshape(n * r, -1) for part in (orbits.states[:-1], orbits.states[1:], orbits.turns)]
    rows += [part[:, held].reshape(-1) for part in (orbits.codes, orbits.outcome, orbits.time)]
    values = values_of(system, plan, Returns(orbits.coordinates, orbits.walls, *rows)).reshape(n, r, -1)
    return parted(np.where(plan.largest, values.max(axis=0), values.sum(axis=0)), plan.columns)


def parted(totals: Floats, columns: Sequence[tuple[int, int]]) -> tuple[Floats, Floats]:
    """Totals of formulas, shape (R, C), as totals and weights of K observables, shape (R, K); NaN where one has no weight."""
    parts = np.full((2, len(totals), 1 + max(k for k, _ in columns)), np.nan)
    for column, (k, part) in enumerate(columns):
        parts[part, :, k] = totals[:, column]
    return parts[0], parts[1]


def map_slopes(system: System, plan: "Plan", states: Floats, rates: Floats) -> Floats:
    """The derivatives of the values of returns of states (N, n), by these and along parameters, shape (N, C, n + 1).

    NaN of largest values, and where a map has no derivative.
    """
    returns, n = system.first_return(states, derivative=True), states.shape[1]
    before, after = _inputs(returns)
    found = _functions(plan, True)(*before.T, *after.T, *system.parameters.values())
    each = np.stack([np.broadcast_to(np.asarray(one, float), len(states)) for one in found], axis=-1)
    each = each.reshape(len(states), len(plan.columns), -1)
    by_state = each[..., :n] + each[..., n : 2 * n] @ returns.slopes
    moved = by_parameters(system, states, dict(zip(system.parameter_names(), rates.tolist(), strict=True)))
    along = np.einsum("kcj,kj->kc", each[..., n : 2 * n], moved) + each[..., 2 * n :] @ rates
    slopes = np.concatenate([by_state, along[..., None]], axis=2) * plan.scales[:, None]
    slopes = np.where(_counts(plan, returns)[..., None], slopes, 0.0)
    return np.where(plan.largest[:, None], np.nan, slopes)


def by_parameters(system: System | ExactMap, states: Floats, rates: Mapping[str, float]) -> Floats:
    """The derivatives of images of states (N, n) by the parameters, which change at some rates; of maps in Python by differences.

    NaN where there is none.
    """
    if isinstance(system, ExactMap):
        return system.sensitivity(states, rates)
    here, known = system.first_return(states), system.parameters
    unit = min((max(abs(known[name]), 1e-3) / abs(rate) for name, rate in rates.items() if rate), default=1.0)

    def images(share: float) -> Floats | None:
        there = system.at(**{name: known[name] + share * rate for name, rate in rates.items()}).first_return(states)
        same = there.valid.all() and np.array_equal(there.codes, here.codes)
        return here.coordinates.difference(there.image, here.image) if same else None

    return np.broadcast_to(derivative_of(images, 0.0, unit, here.coordinates.magnitudes(here.image)), states.shape)
