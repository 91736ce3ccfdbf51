"""Resets and starts that are not affine: compiled from their formulas, with their derivatives, and kept in memory."""

import sympy as sp

from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.flows.laws import rows_address, rows_source
from nsmaps.exact.modes.definitions.definition import Definition, Start, Transition


def law_address(definition: Definition, one: Transition | Start) -> int:
    """The address of the compiled function that writes the states of `curved`, and their derivatives; zero if there are none.

    It takes the phase, and the addresses of the n own states, of the parameters and of a table of n rows, to which it writes for
    each state that it gives the value, and the derivatives by every own state, by the phase and by every parameter at a fixed
    phase. States are those before a reset, or for a start the coordinates among them.
    """
    if not one.curved:
        return 0
    by = (*definition.variables, PHI, *definition.symbols)
    width = 1 + len(by)
    places = [k * width + j for k, _ in one.curved for j in range(width)]
    formulas = [entry for _, formula in one.curved for entry in (formula, *(sp.diff(formula, x) for x in by))]
    return rows_address(rows_source(formulas, places, definition.variables, definition.symbols))
