"""What follows from formulas in symbols: the powers of an equation of motion, and how smooth a formula of flights is."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import sympy as sp

from nsmaps.exact.flows.formulas import PHI, W, Z

DEGREE = 3  #: of polynomials that one rule for each panel integrates to rounding
SMOOTH, ROUGH, JUMPS = range(3)  #: such polynomials; what may have kinks or be steep; what jumps


def smoothness(formula: sp.Expr, inputs: Sequence[sp.Symbol]) -> int:
    """The kind of a formula. Harmonics of the phase are smooth; the phase itself jumps at the end of a period."""
    plain = formula.replace(lambda part: isinstance(part, sp.sin | sp.cos) and not part.has(*inputs), lambda part: sp.S.One)
    if plain.has(PHI, sp.sign, sp.floor, sp.Heaviside):
        return JUMPS
    return SMOOTH if plain.is_polynomial(*inputs) and sp.Poly(plain, *inputs).total_degree() <= DEGREE else ROUGH


@lru_cache(maxsize=64)
def powers(formulas: Any) -> tuple[sp.Expr, sp.Expr]:
    """The power of the forcing and that lost to damping, a unit of mass.

    The forcing is the acceleration less its mean over the phase. Of the mean, what vanishes with the velocity is damping.
    """
    place, velocity = (sp.Symbol(f"_y_{name}", real=True) for name in ("place", "velocity"))
    force = sp.expand(sp.simplify(formulas.force.subs({Z: place, W: velocity})))
    mean = sp.simplify(sp.integrate(force, (PHI, 0, 2 * sp.pi)) / (2 * sp.pi))
    return sp.simplify(force - mean) * velocity, sp.simplify(mean.subs(velocity, 0) - mean) * velocity
