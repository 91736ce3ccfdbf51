"""A definition whose rows are affine again: what is nonlinear in them becomes further states, derived from the own ones."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import sympy as sp

from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.modes.definitions.definition import Definition, Start, Transition
from nsmaps.exact.modes.definitions.rows import Row, is_sum_of_waves, same_row, zero_row

Formulas = tuple[tuple[int, sp.Expr], ...]  #: positions of states, and what they are


def with_derived_states(definition: Definition) -> Definition:
    """The definition with affine rows: where one is nonlinear, with derived states and with formulas in place of the rates.

    Resets and starts that are not affine are formulas in any system.
    """
    variables = definition.variables
    transitions = tuple(_reset_with_formulas(one, variables) for one in definition.transitions)
    starts = tuple(_start_with_formulas(one, variables) for one in definition.starts)
    plain = replace(definition, transitions=transitions, starts=starts)
    if not any(row.variables for row in plain.rows):
        return plain
    derived = Derived(variables)
    smooth = tuple(tuple(row.of(variables) for row in mode) for mode in plain.rates)
    plain = _map_rows(replace(plain, rates=()), derived.row)
    n, total = len(variables), len(variables) + len(derived.formulas)
    more = (zero_row(total),) * len(derived.formulas)

    def wide(row: Row) -> Row:
        return Row((*row.coefficients, *[sp.S.Zero] * (total - len(row.coefficients))), row.remainder)

    plain = _map_rows(plain, wide)
    return replace(
        plain,
        rates=((zero_row(total),) * total,) * len(plain.modes),
        transitions=tuple(replace(one, reset=(*map(wide, one.reset), *more)) for one in plain.transitions),
        starts=tuple(replace(one, states=(*map(wide, one.states[:n]), *more)) for one in plain.starts),
        derived=tuple(derived.formulas),
        smooth=smooth,
    )


class Derived:
    """The derived states that have been met."""

    def __init__(self, variables: tuple[sp.Symbol, ...]) -> None:
        self.variables = variables
        self.formulas: list[sp.Expr] = []

    def row(self, row: Row) -> Row:
        """A row as an affine one over the own states and the derived states that are known by then."""
        if not row.variables:
            return row
        terms = sp.Add.make_args(row.remainder)
        waves = [term for term in terms if not term.has(*self.variables) and is_sum_of_waves(term)]
        others = sp.factor_terms(sp.Add(*(term for term in terms if term not in waves)))
        factor, formula = others.as_independent(*self.variables, PHI, as_Add=False)
        if formula.could_extract_minus_sign():
            factor, formula = -factor, -formula
        if formula not in self.formulas:
            self.formulas.append(formula)
        shares = [factor if one == formula else sp.S.Zero for one in self.formulas]
        return Row((*row.coefficients, *shares), sp.Add(*waves))


def _map_rows(definition: Definition, change: Callable[[Row], Row]) -> Definition:
    """The definition with other functions and conditions of events and surfaces."""

    def of(rows: Sequence[Row]) -> tuple[Row, ...]:
        return tuple(map(change, rows))

    return replace(
        definition,
        transitions=tuple(one.with_rows(change) for one in definition.transitions),
        starts=tuple(replace(one, zeros=of(one.zeros), surface=of(one.surface)) for one in definition.starts),
        surfaces=tuple(replace(one, rows=of(one.rows)) for one in definition.surfaces),
    )


def _reset_with_formulas(one: Transition, variables: Sequence[sp.Symbol]) -> Transition:
    """A transition whose reset is affine but for its formulas."""
    formulas = dict(_formulas(one.reset, variables)) | dict(one.curved)
    rows = [same_row(k, len(variables)) if k in formulas else row for k, row in enumerate(one.reset)]
    return replace(one, reset=tuple(rows), curved=tuple(formulas.items())) if formulas else one


def _start_with_formulas(one: Start, variables: Sequence[sp.Symbol]) -> Start:
    """A start whose states are affine in the coordinates but for its formulas."""
    formulas = _formulas(one.states, variables)
    rows = [zero_row(len(variables)) if k in dict(formulas) else row for k, row in enumerate(one.states)]
    affine = tuple(row for row in one.zeros if not row.variables)  # others are at some events of a section alone
    return replace(one, states=tuple(rows), curved=formulas, zeros=affine)


def _formulas(rows: Sequence[Row], variables: Sequence[sp.Symbol]) -> Formulas:
    return tuple((k, row.of(variables)) for k, row in enumerate(rows) if row.variables)
