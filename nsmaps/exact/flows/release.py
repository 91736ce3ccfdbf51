"""The phase at which the base wall releases a ball, as a function of the parameters."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.exact.flows.formulas import PHI, W, Z
from nsmaps.exact.flows.tables import Formulas, formulas_of
from nsmaps.exact.systems.walls import ImpactFormulas


def release_rates(system: ImpactFormulas, phases: Floats, rates: Mapping[str, float]) -> Floats:
    """The derivatives of release phases, shape (N,), by the parameters, which change at these rates.

    The acceleration of a ball that is held at the wall is zero there, whence they follow by the implicit function theorem.
    """
    by_phase, *by_each = _slopes(formulas_of(system))(phases, *system.parameters.values())
    along = sum(rate * each for rate, each in zip(system.direction(rates), by_each, strict=True))
    return np.asarray(-along / by_phase * np.ones(len(phases)))


@lru_cache(maxsize=64)
def _slopes(formulas: Formulas) -> Callable[..., Any]:
    """The derivatives of that acceleration by the phase and by each parameter, at a phase and the parameters."""
    numbers = formulas.numbers
    at = numbers.top if formulas.sides.base_is_upper else numbers.bottom
    held = formulas.force.subs({Z: at, W: 0})
    arguments = (PHI, *formulas.symbols)
    return sp.lambdify(arguments, [sp.diff(held, x) for x in arguments], "numpy", cse=True)
