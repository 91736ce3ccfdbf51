"""Totals of observables along orbits of exact systems: the formulas compiled, and the loops run on all cores."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.flows.laws import rows_address, rows_source
from nsmaps.exact.kernel import Kernel, flow_of, in_chunks
from nsmaps.exact.modes.kernel import ModeKernel
from nsmaps.exact.modes.tables.memory import Moved, memory
from nsmaps.exact.modes.tables.tables import moved_of
from nsmaps.exact.observables.flights import observed
from nsmaps.exact.observables.formulas import Vocabulary, vocabulary_of
from nsmaps.exact.observables.memory import PANEL, Quantities, rule
from nsmaps.exact.observables.mode_slopes import mode_slopes
from nsmaps.exact.observables.motions import observed_modes
from nsmaps.exact.observables.slopes import Directions, observed_slopes
from nsmaps.exact.observables.spec import Observable
from nsmaps.interrupts import check_stop

if TYPE_CHECKING:
    from nsmaps.exact.systems.flow import FlowSystem


CHUNK = 16  #: orbits that a thread takes at a time


@dataclass(frozen=True, slots=True)
class Totals:
    """Totals of C columns over B batches of returns of M states."""

    totals: Floats  #: shape (B, M, C), of the formulas in the order of `Plan.columns`, scaled; NaN where an orbit has ended
    time: Floats  #: shape (B, M), in the system's time
    final: Floats  #: shape (M, n), the last states
    outcome: NDArray[np.int8]  #: shape (M,), of the last return


@dataclass(frozen=True, eq=False)
class Plan:
    """The formulas of some observables of a class of systems, those of impacts first."""

    vocabulary: Vocabulary
    columns: tuple[tuple[int, int], ...]  #: of each formula the observable, and 0, or 1 where it divides
    formulas: dict[str, tuple[sp.Expr, ...]]  #: of impacts and of flights
    rows: dict[str, Bools]  #: which rows count, shape (R, K) of impacts and (M, F) of flights
    largest: Bools  #: shape (K + F,)
    scales: Floats  #: shape (K + F,)

    def address(self, of: str, slopes: bool) -> int:
        """The address of the compiled formulas, and their derivatives by inputs, phase and parameters; 0 without formulas."""
        return _address(self, of, slopes) if self.formulas[of] else 0

    def width(self, slopes: bool) -> int:
        """Places of a formula in a table: its value, or also its derivatives by the inputs, phase and parameters."""
        return 2 + max(map(len, self.vocabulary.inputs.values())) + len(self.vocabulary.parameters) if slopes else 1

    def memory(self, values: Sequence[float], panel: float, slopes: bool = False) -> Quantities:
        """Memory for the totals of one thread."""
        k, f = (self.rows[of].shape[1] for of in ("impacts", "flights"))
        nodes, weights = rule()
        return Quantities(
            impact=self.address("impacts", slopes),
            flight=self.address("flights", slopes),
            parameters=np.array([*values, 0.0]),
            at=self.rows["impacts"],
            over=self.rows["flights"],
            largest=self.largest,
            panel=panel,
            nodes=nodes,
            weights=weights,
            y=np.zeros(max(map(len, self.vocabulary.inputs.values()))),
            out=np.zeros((max(k, f), self.width(slopes))),
            total=np.zeros(k + f),
            peak=np.zeros(f),
            when=np.zeros(f),
        )


@lru_cache(maxsize=256)
def _address(plan: Plan, of: str, slopes: bool) -> int:
    formulas, inputs, parameters = plan.formulas[of], plan.vocabulary.variables(of), plan.vocabulary.parameters
    by = (*inputs, PHI, *parameters) if slopes else ()
    entries = [entry for formula in formulas for entry in (formula, *(sp.diff(formula, x) for x in by))]
    places = [k * plan.width(slopes) + j for k in range(len(formulas)) for j in range(1 + len(by))]
    return rows_address(rows_source(entries, places, inputs, parameters))


def plan_of(system: "FlowSystem", observables: tuple[Observable, ...]) -> Plan:
    """The formulas of observables, read and in order; those of a class and its choices are remembered."""
    return _plan(vocabulary_of(system), observables)


@lru_cache(maxsize=64)
def _plan(vocabulary: Vocabulary, observables: tuple[Observable, ...]) -> Plan:
    columns, formulas, rows = [], {}, {}
    for of in ("impacts", "flights"):
        own = [(k, part) for k, one in enumerate(observables) if one.of == of for part in range(len(one.formulas))]
        columns += own
        formulas[of] = tuple(vocabulary.read(observables[k].formulas[part], of) for k, part in own)
        counts = [vocabulary.rows(observables[k]) for k, _ in own]
        rows[of] = np.array(counts, bool).reshape(len(own), len(vocabulary.places[of])).T.copy()
    largest = np.array([observables[k].largest for k, _ in columns])
    scales = np.array([1.0 if part else observables[k].scale for k, part in columns])
    return Plan(vocabulary, tuple(columns), formulas, rows, largest, scales)


def totals_of(
    system: "FlowSystem",
    plan: Plan,
    start: Floats,
    length: int,
    batches: int = 1,
    discard: int = 0,
    chatter: float = 1e-12,
) -> Totals:
    """The totals over batches of returns, `length` each, of states (M, n), after some that are discarded.

    On all cores, of integrated flights on one. Raises as `integrated_returns`.
    """
    kernel: Any = system._kernel()
    states, m = np.array(kernel.starts(start) if isinstance(kernel, ModeKernel) else start, float), len(start)
    outcome, time = np.zeros(m, np.int8), np.zeros((batches, m))
    totals = np.zeros((batches, m, len(plan.columns)))
    values = list(system.parameters.values())

    def run(k: slice) -> None:
        at, rows = np.zeros(2, np.int64), (states[k], outcome[k], time[:, k], totals[:, k])
        q = plan.memory(values, panel_of(kernel))
        if isinstance(kernel, ModeKernel):
            table, n = kernel.table, states.shape[1]
            room = np.empty(n), np.empty((n, 0)), memory(table, 0), memory(table, 0)
            while not observed_modes(table, q, discard, length, at, *rows, *room):
                check_stop()
        else:
            flow = flow_of(kernel.table)
            while not observed(flow, q, float(chatter), discard, length, at, *rows):
                check_stop()

    if isinstance(kernel, (Kernel, ModeKernel)):
        in_chunks(m, run, CHUNK)
    else:
        from nsmaps.exact.observables.integrated import integrated_totals

        for k in range(m):
            rows = states[k], outcome[k : k + 1], time[:, k], totals[:, k]
            integrated_totals(kernel, plan, discard, length, float(chatter), *rows)
    return Totals(totals * plan.scales, time, states, outcome)


def panel_of(kernel: Kernel | ModeKernel) -> float:
    """The longest part of a flight that one rule of integration covers; with modes these have longest steps of their own."""
    if isinstance(kernel, ModeKernel):
        return np.inf
    table = kernel.table
    count, first = int(table[layout.SIMPLE] + table[layout.CHAINED]), int(table[layout.AT_RATES])
    rates = np.hypot(*table[first : first + 2 * count].reshape(-1, 2).T) if count else np.zeros(1)
    return float(PANEL / max(rates.max(), table[layout.PHASE_RATE]))


def slopes_of(system: "FlowSystem", plan: Plan, states: Floats, rates: Floats) -> Floats:
    """The derivatives of the totals of first returns of states (N, n), by these and along parameters, shape (N, C, n + 1).

    NaN where a return rests or chatters, where there is none, where flights are integrated, and of largest values.

    Args:
        rates: shape (P,), of change of the parameters.
    """
    kernel: Any = system._kernel()
    values, n = list(system.parameters.values()), states.shape[1]
    if isinstance(kernel, ModeKernel):
        states = kernel.starts(states)
        by_state = _mode_slopes(kernel, plan, states, n, None, rates)
        moving = moved_of(kernel.definition, kernel.table, kernel.values, rates)
        by_parameters = _mode_slopes(kernel, plan, states, 1, moving, rates)
        slopes = np.concatenate([by_state, by_parameters], axis=2)
    elif not isinstance(kernel, Kernel):
        slopes = np.full((len(states), len(plan.columns), n + 1), np.nan)
    else:
        moved = kernel.formulas.along(system.parameter_names()).table([*values, *rates.tolist()])
        slopes = np.empty((len(states), len(plan.columns), 3))

        def run(k: slice) -> None:
            q, g = plan.memory(values, panel_of(kernel), slopes=True), _directions(plan, rates, 3, True)
            observed_slopes(kernel.flow, flow_of(moved), q, g, states[k], 1e-12, slopes[k])

        in_chunks(len(states), run)
    slopes[:, plan.largest] = np.nan
    return slopes * plan.scales[:, None]


def _mode_slopes(kernel: ModeKernel, plan: Plan, states: Floats, directions: int, moved: Moved | None, rates: Floats) -> Floats:
    """The derivatives along the coordinates, or along the parameters where a table `moved` is given, shape (N, C, directions)."""
    slopes = np.empty((len(states), len(plan.columns), directions))
    n = states.shape[1]

    def run(k: slice) -> None:
        q, g = plan.memory(kernel.values, np.inf, slopes=True), _directions(plan, rates, directions, moved is not None)
        w, x = (memory(kernel.table, directions, moved) for _ in range(2))
        room, done = (np.empty(n), np.empty((n, directions)), w, x), 0
        while done < len(states[k]):
            done = mode_slopes(kernel.table, q, g, done, states[k], slopes[k], *room)
            check_stop()

    in_chunks(len(states), run)
    return slopes


def _directions(plan: Plan, rates: Floats, directions: int, moving: bool) -> Directions:
    """Memory for derivatives along so many directions."""
    inputs = max(len(names) for names in plan.vocabulary.inputs.values())
    rows = np.zeros((inputs, directions))
    return Directions(rates, rows, np.zeros(directions), np.zeros((2, directions)), np.zeros_like(rows), moving)
