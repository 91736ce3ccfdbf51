"""What can be written in place of a formula that is refused: sentences that end its message."""

from collections.abc import Sequence

import sympy as sp
from sympy.core.function import AppliedUndef

OWN_MAP = "any map is a class with `coordinates` and `first_return`"
DELAY = "a delay is out of scope: the state of such a system is a function, which finitely many coordinates do not give"
FORCING = (
    "a second forcing of frequency w is two states p, q of a `HybridSystem` with the rates p' = -w*q and q' = w*p, and a decay a "
    "state with e' = -k*e"
)
KINK = "a force that is linear on either side of a kink is two modes of a `HybridSystem`"
SMOOTH = (
    f"{KINK}, and another one is smoothed, as v*sqrt(v**2 + eps**2) for v*abs(v), tanh(v/eps) for sign(v), with eps from 1e-12 "
    "of the range of v on"
)
CURVED = (
    "nonlinear flights of one degree of freedom are those of an `ImpactSystem` with its `acceleration`; of others, linear pieces "
    f"are modes, and {OWN_MAP}"
)
PHASE_LAW = "a restitution that depends on the phase is the `reset` of a `Guard` in a `HybridSystem`"
FRICTION = (
    "friction in contact is a `Sliding` between two modes of `rests`, one for each direction, and an impact that leads to "
    "another mode a `Guard` of its own with `where`"
)
KINKS = sp.Abs, sp.Max, sp.Min, sp.Piecewise, sp.sign, sp.Heaviside


def other_rate(rate: sp.Expr, states: Sequence[sp.Symbol]) -> str:
    """What to write in place of a rate that is not affine in the states."""
    if rate.has(AppliedUndef):
        return DELAY
    sides = rate.replace(lambda part: isinstance(part, KINKS), lambda part: _side(part, states))
    linear = rate.has(*KINKS) and all(sp.diff(sides, one, other) == 0 for one in states for other in states)
    return KINK if linear else CURVED


def _side(kink: sp.Expr, states: Sequence[sp.Symbol]) -> sp.Expr:
    """A function with a kink on one side of it."""
    if isinstance(kink, (sp.sign, sp.Heaviside)):
        return sp.S.One
    return (
        kink.args[0][0]
        if isinstance(kink, sp.Piecewise)
        else max(kink.args, key=lambda part: len(part.free_symbols & set(states)))
    )
