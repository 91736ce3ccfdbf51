"""The powers of an equation of motion, in symbols."""

from functools import lru_cache
from typing import Any

import sympy as sp

from nsmaps.exact.flows.formulas import PHI, W, Z


@lru_cache(maxsize=64)
def powers(formulas: Any) -> tuple[sp.Expr, sp.Expr]:
    """The power of the forcing and that lost to damping, a unit of mass.

    The forcing is the acceleration less its mean over the phase. Of the mean, what vanishes with the velocity is damping.
    """
    place, velocity = (sp.Symbol(f"_y_{name}", real=True) for name in ("place", "velocity"))
    force = sp.expand(sp.simplify(formulas.force.subs({Z: place, W: velocity})))
    mean = sp.simplify(sp.integrate(force, (PHI, 0, 2 * sp.pi)) / (2 * sp.pi))
    return sp.simplify(force - mean) * velocity, sp.simplify(mean.subs(velocity, 0) - mean) * velocity
