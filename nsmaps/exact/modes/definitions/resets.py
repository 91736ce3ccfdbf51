"""Resets that are not affine in the states: compiled from their formulas, with their derivatives, and kept in memory."""

import sympy as sp

from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.flows.laws import rows_address, rows_source
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
    return rows_address(rows_source(formulas, places, definition.variables, definition.symbols))
