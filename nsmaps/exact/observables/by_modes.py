"""Formulas of observables by the states of a definition with modes, whatever the class of the system."""

from dataclasses import replace
from functools import lru_cache, singledispatch
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.exact.observables.formulas import AFTER, Plan, of_modes, plan_in, plan_of
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.exact.systems.system import ImpactSystem


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
