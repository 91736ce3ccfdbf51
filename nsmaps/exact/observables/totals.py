"""Totals of observables along orbits of exact systems: the formulas compiled, and the loops run on all cores."""

from dataclasses import dataclass, replace
from functools import lru_cache, singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.engine.kernel import SpectralKernel, flow_of
from nsmaps.exact.flows.tables import along
from nsmaps.exact.kernel import MotionKernel, in_chunks
from nsmaps.exact.modes.kernel import ModeKernel
from nsmaps.exact.modes.tables.memory import Moved, memory
from nsmaps.exact.modes.tables.nonlinear import write_variations
from nsmaps.exact.modes.tables.tables import moved_of
from nsmaps.exact.observables.flights import Batches, observe_flights
from nsmaps.exact.observables.formulas import AFTER, Plan, of_modes, plan_in, plan_of
from nsmaps.exact.observables.mode_slopes import SlopeObservation, mode_slopes
from nsmaps.exact.observables.motions import Observation, observed_modes
from nsmaps.exact.observables.slopes import Directions, Slopes, observed_slopes
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.observables.sums import PANEL
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.exact.systems.system import ImpactSystem
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


def totals_of(
    system: "FlowSystem",
    plan: Plan,
    start: Floats,
    length: int,
    batches: int = 1,
    discard: int = 0,
    chatter: float = SUMMED_SPEED,
) -> Totals:
    """The totals over batches of returns, `length` each, of states (M, n), after some that are discarded.

    On all cores.
    """
    kernel = system._kernel()
    states, m = np.array(kernel.starts(start), float), len(start)
    outcome, time = np.zeros(m, np.int8), np.zeros((batches, m))
    totals, own = np.zeros((batches, m, len(plan.columns))), plan_by_kernel(kernel, plan)

    def run(k: slice) -> None:
        add_values(kernel, own, Batches(discard, length, states[k], outcome[k], time[:, k], totals[:, k]), chatter)

    in_chunks(m, run, CHUNK)
    return Totals(totals * plan.scales, time, states, outcome)


@singledispatch
def plan_by_kernel(kernel: MotionKernel, plan: Plan) -> Plan:
    """The formulas by the states that a kernel follows."""
    return plan


@plan_by_kernel.register
def _(kernel: ModeKernel, plan: Plan) -> Plan:
    return plan_by_modes(kernel.system, plan.observables, kernel.definition, kernel.system.parameter_names())


@singledispatch
def plan_by_modes(system: HybridFormulas, observables: tuple[Observable, ...], d: Any, names: tuple[str, ...]) -> Plan:
    """The formulas of observables of a system by the states of its definition with modes, which has parameters of these names."""
    return plan_in(of_modes(d, names), observables)


@plan_by_modes.register
def _(system: ImpactSystem, observables: tuple[Observable, ...], d: Any, names: tuple[str, ...]) -> Plan:
    return _of_motions(plan_of(system, observables), d)


@lru_cache(maxsize=64)
def _of_motions(plan: Plan, d: Any) -> Plan:
    """The formulas of impacts and flights of an impact system by the states of its definition with modes.

    Speeds are the sizes of the velocity v towards the base wall; it is the rate of the place, or less that.
    """
    place, v, after = (sp.Symbol(f"_y_{name}", real=True) for name in (*ImpactSystem.states, f"v{AFTER}"))
    first, *_ = d.transitions
    of_place, *_ = first.function.coefficients
    towards_base = -of_place
    states = {
        "impacts": dict(zip(plan.vocabulary.variables("impacts"), (sp.Abs(v), sp.Abs(after), place), strict=True)),
        "flights": dict(zip(plan.vocabulary.variables("flights"), (place, towards_base * v), strict=True)),
    }
    formulas = {of: tuple(one.subs(states[of], simultaneous=True) for one in plan.formulas[of]) for of in states}
    letters = [d.letters.index(one.letter) if one.letter and not one.begins else -1 for one in d.transitions]
    counts = np.array([plan.rows["impacts"][k] & (k >= 0) for k in letters])
    rows = {"impacts": counts, "flights": plan.rows["flights"]}
    return replace(plan, vocabulary=of_modes(d, plan.vocabulary.parameter_names), formulas=formulas, rows=rows, departed=True)


@singledispatch
def add_values(kernel: Any, plan: Plan, which: Batches, chatter: float) -> None:
    """Add the values of formulas along orbits to their totals, on one core."""
    q, flow = plan.memory([*kernel.system.parameters.values()], panel_of(kernel)), kernel.flow
    at = np.zeros(2, np.int64)
    while not observe_flights(flow, q, float(chatter), at, which):
        check_stop()


@add_values.register
def _(kernel: ModeKernel, plan: Plan, which: Batches, chatter: float) -> None:
    table, at = kernel.table, np.zeros(2, np.int64)
    seen = Observation(plan.memory(kernel.values, np.inf), memory(table, 0), np.zeros(2, np.int64))
    w = memory(table, 0, chatter=chatter)
    while not observed_modes(table, seen, at, which, w):
        check_stop()


def panel_of(kernel: SpectralKernel) -> float:
    """The longest part of a flight that one rule of integration covers; with modes these have longest steps of their own."""
    table = kernel.table
    count, first = int(table[layout.SIMPLE] + table[layout.CHAINED]), int(table[layout.AT_RATES])
    rates = np.hypot(*table[first : first + 2 * count].reshape(-1, 2).T) if count else np.zeros(1)
    return float(PANEL / max(rates.max(), table[layout.PHASE_RATE]))


def slopes_of(system: "FlowSystem", plan: Plan, states: Floats, rates: Floats) -> Floats:
    """The derivatives of the totals of first returns of states (N, n), by these and along parameters, shape (N, C, n + 1).

    NaN where a return rests or chatters, where there is none, of largest values, and of sums over flights of what jumps.

    Args:
        rates: shape (P,), of change of the parameters.
    """
    kernel = system._kernel()
    plan = plan_by_kernel(kernel, plan)
    slopes: Floats = slopes_by(kernel, plan, kernel.starts(states), rates)
    slopes[:, plan.steps] = np.nan
    return slopes * plan.scales[:, None]


@singledispatch
def slopes_by(kernel: Any, plan: Plan, states: Floats, rates: Floats) -> Floats:
    """As `slopes_of`, of totals that are not scaled."""
    values = [*kernel.system.parameters.values()]
    moved = along(kernel.formulas, kernel.system.parameter_names()).table([*values, *rates.tolist()])
    slopes = np.empty((len(states), len(plan.columns), 3))

    def run(k: slice) -> None:
        q, g = plan.memory(values, panel_of(kernel), slopes=True), _directions(plan, rates, 3, True)
        observed_slopes(kernel.flow, Slopes(flow_of(moved), q, g, slopes[k]), states[k], SUMMED_SPEED)

    in_chunks(len(states), run)
    return slopes


@slopes_by.register
def _(kernel: ModeKernel, plan: Plan, states: Floats, rates: Floats) -> Floats:
    moving = moved_of(kernel.definition, kernel.table, kernel.values, rates)
    by_state = _mode_slopes(kernel, plan, states, states.shape[1], None, rates)
    return np.concatenate([by_state, _mode_slopes(kernel, plan, states, 1, moving, rates)], axis=2)


def _mode_slopes(kernel: ModeKernel, plan: Plan, states: Floats, directions: int, moved: Moved | None, rates: Floats) -> Floats:
    """The derivatives along the coordinates, or along the parameters where a table `moved` is given, shape (N, C, directions)."""
    slopes = np.empty((len(states), len(plan.columns), directions))
    write_variations(kernel.definition, kernel.table.variations, moved is not None)

    def run(k: slice) -> None:
        q, g = plan.memory(kernel.values, np.inf, slopes=True), _directions(plan, rates, directions, moved is not None)
        w, x = (memory(kernel.table, directions, moved) for _ in range(2))
        seen, done = SlopeObservation(q, g, slopes[k.start], x, np.zeros(2, np.int64)), 0
        while done < len(states[k]):
            done = mode_slopes(kernel.table, seen, done, states[k], slopes[k], w)
            check_stop()

    in_chunks(len(states), run)
    return slopes


def _directions(plan: Plan, rates: Floats, directions: int, moving: bool) -> Directions:
    """Memory for derivatives along so many directions."""
    inputs = max(len(names) for names in plan.vocabulary.inputs.values())
    rows = np.zeros((inputs, directions))
    return Directions(rates, rows, np.zeros(directions), np.zeros((2, directions)), np.zeros_like(rows), moving)
