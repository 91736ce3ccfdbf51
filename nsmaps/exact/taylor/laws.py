"""Laws compiled beside heyoka's programs: derived states with derivatives, and rates, with which series are compared.

Each is a function of the phase and of the addresses of the own states, of the parameters and of a table to write to.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

import sympy as sp

from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.flows.laws import rows_address, rows_source
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.taylor.kinds import ARCS, EDGE, EDGES, ERF, EXP, ORIGIN, TANH

KINDS = {
    sp.exp: EXP,
    sp.tanh: TANH,
    sp.erf: ERF,
    sp.log: ORIGIN,
    **dict.fromkeys((sp.atan, sp.asinh), ARCS),
    **dict.fromkeys((sp.asin, sp.acos, sp.atanh), EDGES),
    sp.acosh: EDGE,
}


LEAST = sp.Float("1e-300")  #: a size that is not zero


class FlatPart(NamedTuple):
    """A function that may be flat where it is expanded, so that its series does not show all of it."""

    formula: sp.Expr
    argument: sp.Expr
    kind: int


@cache
def rate_law(definition: Definition) -> tuple[int, ...]:
    """The addresses of the compiled rates of the n own states in each mode of a nonlinear system.

    It writes n rows of n + 3 numbers: a rate, the sum of the sizes of its terms, its derivatives by the own states and by the
    phase; behind these for each function of `flat_kinds` its argument, the derivatives of the n rates by its value, and those of
    the functions that are watched, as shares of the sizes of their terms, in sum.
    """
    return tuple(_rate_law(definition, mode) for mode in range(len(definition.smooth)))


def _rate_law(definition: Definition, mode: int) -> int:
    by, rates, guards = (*definition.variables, PHI), definition.smooth[mode], watched_formulas(definition, mode)
    formulas = [entry for rate in rates for entry in (rate, size_of(rate), *(sp.diff(rate, x) for x in by))]
    for part in flat_parts((*rates, *guards), by):
        shares = [sp.Abs(_by_part(guard, part.formula)) / (size_of(guard) + LEAST) for guard in guards]
        formulas += [part.argument, *(_by_part(rate, part.formula) for rate in rates), sp.Add(*shares)]
    return _address(definition, formulas)


@cache
def flat_kinds(definition: Definition) -> tuple[tuple[int, ...], ...]:
    """The kinds of the functions with flat parts in the rates and guards of each mode, in the order of `rate_law`."""
    by = (*definition.variables, PHI)
    given = [(*rates, *watched_formulas(definition, mode)) for mode, rates in enumerate(definition.smooth)]
    return tuple(tuple(part.kind for part in flat_parts(formulas, by)) for formulas in given)


def watched_formulas(definition: Definition, mode: int) -> tuple[sp.Expr, ...]:
    """The functions that are watched in a mode and depend on derived states, by own states and the phase."""
    own, functions = len(definition.states), [one.function for one in definition.transitions if one.mode == mode]
    curved = [row for row in functions if any(c != 0 for c in row.coefficients[own:])]
    return tuple(row.of(definition.columns) for row in curved)


@cache
def derived_law(definition: Definition) -> int:
    """The address of the compiled derived states, zero if there are none.

    It writes for each a row: its value, its derivatives by the own states, by the phase and by every parameter at a fixed phase,
    and the sum of the sizes of its terms.
    """
    by, formulas = (*definition.variables, PHI, *definition.symbols), list[sp.Expr]()
    for formula in definition.derived:
        formulas += [formula, *(sp.diff(formula, x) for x in by), size_of(formula)]
    return _address(definition, formulas) if formulas else 0


def size_of(formula: sp.Expr) -> sp.Expr:
    """The sum of the sizes of the terms of a formula."""
    return sp.Add(*map(sp.Abs, sp.Add.make_args(formula)))


def _address(definition: Definition, formulas: Sequence[sp.Expr]) -> int:
    return rows_address(rows_source(formulas, range(len(formulas)), definition.variables, definition.symbols))


def _by_part(formula: sp.Expr, part: sp.Expr) -> sp.Expr:
    """The derivative of a formula by the value of a part of it."""
    stand = sp.Dummy(real=True)
    return sp.diff(formula.xreplace({part: stand}), stand).xreplace({stand: part})


def flat_parts(formulas: Sequence[sp.Expr], moving: Sequence[sp.Symbol]) -> Iterator[FlatPart]:
    """The functions with flat parts in formulas that change with some symbols, each once."""
    found, of = set(), set(moving)
    for part in (part for formula in formulas for part in sp.preorder_traversal(formula)):
        if part in found or not part.free_symbols & of:
            continue
        found.add(part)
        if part.is_Pow and part.exp.free_symbols & of:
            yield FlatPart(part, part.exp * sp.log(part.base), EXP)
        elif part.is_Pow and not (part.exp.is_Integer and part.exp > 0):
            yield FlatPart(part, part.base, ORIGIN)
        elif part.func in KINDS:
            (argument,) = part.args
            yield FlatPart(part, argument, KINDS[part.func])
