"""How smooth a formula of flights is, from its symbols: by which rule it is integrated, and whether the sum has derivatives."""

from collections.abc import Sequence

import sympy as sp

from nsmaps.exact.flows.formulas import PHI

DEGREE = 3  #: of polynomials that one rule for each panel integrates to rounding
SMOOTH, ROUGH, JUMPS = range(3)  #: such polynomials; what may have kinks or be steep; what jumps


def smoothness(formula: sp.Expr, inputs: Sequence[sp.Symbol]) -> int:
    """The kind of a formula. Harmonics of the phase are smooth; the phase itself jumps at the end of a period."""
    plain = formula.replace(lambda part: isinstance(part, sp.sin | sp.cos) and not part.has(*inputs), lambda part: sp.S.One)
    if plain.has(PHI, sp.sign, sp.floor, sp.Heaviside):
        return JUMPS
    return SMOOTH if plain.is_polynomial(*inputs) and sp.Poly(plain, *inputs).total_degree() <= DEGREE else ROUGH
