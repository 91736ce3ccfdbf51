"""Resets that are not affine in the states: compiled from their formulas, with their derivatives, and kept in memory."""

from functools import lru_cache
from typing import Any

import sympy as sp

from nsmaps.exact.engine.jit import reset_law_of
from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.flows.laws import code
from nsmaps.exact.modes.definitions.definition import Definition, Transition


def reset_address(definition: Definition, one: Transition) -> int:
    """The address of the compiled function that writes the states of `Transition.curved`, and their derivatives.

    It takes the phase, and the addresses of the states, of the parameters and of a table of n rows, to which it writes for each
    state that it gives the value, and the derivatives by every state, by the phase and by every parameter at a fixed phase. The
    address is zero for an affine reset.
    """
    if not one.curved:
        return 0
    by = (*definition.variables, PHI, *definition.symbols)
    width = 1 + len(by)
    places = [k * width + j for k, _ in one.curved for j in range(width)]
    formulas = [entry for _, formula in one.curved for entry in (formula, *(sp.diff(formula, x) for x in by))]
    shared, formulas = sp.cse(map(plain, formulas), symbols=sp.numbered_symbols("_c"))
    lines = [f"{symbol} = y[{k}]" for k, symbol in enumerate(definition.variables)]
    lines += [f"{symbol} = p[{k}]" for k, symbol in enumerate(definition.symbols)]
    lines += [f"{symbol} = {code(formula)}" for symbol, formula in shared]
    lines += [f"out[{place}] = {code(formula)}" for place, formula in zip(places, formulas, strict=True)]
    return int(_compiled("\n    ".join([f"def law({PHI}, y, p, out):", *lines])).address)


def plain(formula: sp.Expr) -> sp.Expr:
    """A formula whose step functions, as the derivative of the larger of two numbers has them, are cases."""
    formula = formula.replace(sp.Heaviside, lambda x, *_: sp.Piecewise((1, x >= 0), (0, True)))
    return formula.replace(sp.DiracDelta, lambda *_: sp.S.Zero)


@lru_cache(maxsize=256)
def _compiled(text: str) -> Any:
    return reset_law_of(text)
