"""Derivatives of observables of an impact system over complete chatter and the rest that follows, up to the release."""

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.exact.flows.formulas import PHI, V
from nsmaps.exact.flows.tables import Formulas, formulas_of
from nsmaps.exact.observables.formulas import Plan
from nsmaps.exact.observables.sums import LEAST, MOST_CHATTER, NODES, WEIGHTS

if TYPE_CHECKING:
    from nsmaps.exact.systems.system import ImpactSystem

BASE = 0  #: the row of impacts on the base wall, and of flights from it


class Chatter(NamedTuple):
    """A return with complete chatter or rest on the base wall, and how it changes along a direction of the parameters."""

    speed: float  #: of the impact from which the sum begins
    phase: float
    release: float  #: phase of the release, after that
    moved: Floats  #: shape (3,), the derivatives of these


def rest_slopes(system: "ImpactSystem", plan: Plan, chatter: Chatter, rates: Floats) -> Floats:
    """The derivatives of the totals of such a return, shape (C,), where the parameters change at the rates (P,).

    Impacts are summed at the place and phase where the sum begins, as the totals are; the rest lasts from there to the release.
    """
    impact, law, held = _slopes(formulas_of(system), plan)
    values, k = tuple(system.parameters.values()), plan.rows["impacts"].shape[1]
    slopes, (v, phi, release), (by_v, by_phi, by_release) = np.zeros(len(plan.columns)), chatter[:3], chatter.moved
    for _ in range(MOST_CHATTER):
        if not v > LEAST * chatter.speed:
            break
        slopes[:k] += impact(v, phi, *values) @ np.array([0.0, by_v, by_phi, *rates])
        v, *slope = law(v, *values)[0].tolist()
        by_v = float(np.dot(slope, [by_v, *rates]))
    slopes[k:] += held(release, *values)[:, 0] * by_release - held(phi, *values)[:, 0] * by_phi
    ends = np.linspace(phi, release, 1 + int(np.ceil(release - phi)))
    for low, high in pairwise(ends):
        for x, weight in zip(low + (high - low) * NODES, (high - low) * WEIGHTS, strict=True):
            slopes[k:] += weight * (held(x, *values)[:, 1:] @ rates)
    counted = np.concatenate([plan.rows["impacts"][BASE], plan.rows["flights"][BASE]])
    return np.where(plan.steps, np.nan, np.where(counted, slopes * plan.scales, 0.0))


@lru_cache(maxsize=64)
def _slopes(formulas: Formulas, plan: Plan) -> tuple[Callable[..., Floats], ...]:
    """The formulas of impacts on the base wall by speed and phase, its law, and what is integrated over the phase of a rest.

    Functions of speed, phase, or both, and of the parameters. Their values have shape (formulas, derivatives), each formula
    before its derivatives by these; those of a rest have none by the phase.
    """
    numbers, (lower, upper) = formulas.numbers, formulas.laws
    place, law = (numbers.top, upper) if formulas.sides.base_is_upper else (numbers.bottom, lower)
    symbols, known = formulas.symbols, {"v": V, "v_after": law, "place": place, "velocity": sp.S.Zero}
    given = {
        of: dict(zip(plan.vocabulary.variables(of), (known[name] for name in names), strict=True))
        for of, names in plan.vocabulary.inputs.items()
    }
    impacts, rests = ([one.subs(given[of], simultaneous=True) for one in plan.formulas[of]] for of in ("impacts", "flights"))

    def compiled(exprs: list[sp.Expr], by: tuple[Any, ...], arguments: tuple[Any, ...]) -> Callable[..., Floats]:
        rows = [[one, *(sp.diff(one, x) for x in by)] for one in exprs]
        numbers = sp.lambdify(arguments, rows, "numpy", cse=True)
        return lambda *values: np.array(numbers(*values), float).reshape(len(exprs), 1 + len(by))

    return (
        compiled(impacts, (V, PHI, *symbols), (V, PHI, *symbols)),
        compiled([law], (V, *symbols), (V, *symbols)),
        compiled([one / numbers.phase_rate for one in rests], symbols, (PHI, *symbols)),
    )
