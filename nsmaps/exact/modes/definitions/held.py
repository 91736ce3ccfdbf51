"""Events within a mode of sliding or of lasting contact: they must leave the motion on its surface."""

from collections.abc import Sequence

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import trials
from nsmaps.exact.modes.definitions.definition import Row, Transition
from nsmaps.exact.modes.definitions.formulas import Reader

OFF = 1e-9  #: of the sizes of its terms: how far from zero a function of the surface may be just after an event


def check_held(reader: Reader, modes: Sequence[str], events: Sequence[Transition]) -> None:
    """Refuse a guard that stays in a mode of sliding or of contact, and whose reset leads away from its surface."""
    for one in events:
        if one.held and one.target == one.mode and not one.begins and _leaves(reader, one):
            raise SystemDefinitionError(
                f"{reader.name}.guards: the reset of {one.name!r} takes the motion off the surface of the mode "
                f"{modes[one.mode]!r}, in which it slides or is in contact, and there is no `to`; expected: `to` a mode beside "
                "the surface, where an impact follows at once if the reset leads into it"
            )


def _leaves(reader: Reader, one: Transition) -> bool:
    """Whether what is zero throughout the mode of an event is not zero just after it, at some trial values."""
    symbols = tuple(reader.states.values())
    after = [row.of(symbols) for row in one.reset]
    for k, formula in one.curved:
        after[k] = formula
    zeros = (*one.held, one.function)
    for values in trials(*(row.of(symbols) for row in zeros), *after):
        fixed = {symbol: value for symbol, value in values.items() if symbol not in symbols}
        states = _on_surface([_numbers(row, fixed) for row in zeros], len(symbols))
        given = fixed | dict(zip(symbols, map(sp.Float, states.tolist()), strict=True))
        new = np.array([float(expr.subs(given)) for expr in after] + [1.0])
        for row in one.held:
            terms = _numbers(row, fixed) * new
            if abs(terms.sum()) > OFF * abs(terms).sum():
                return True
    return False


def _numbers(row: Row, values: dict[sp.Symbol, sp.Expr]) -> Floats:
    """The coefficients of a row and its remainder, shape (n + 1,)."""
    return np.array([float(sp.N(sp.sympify(x).subs(values))) for x in (*row.coefficients, row.remainder)])


def _on_surface(rows: list[Floats], n: int) -> Floats:
    """Random states at which rows are zero, shape (n,)."""
    table, states = np.array(rows), np.random.default_rng(1).normal(size=n)
    return states - np.linalg.pinv(table[:, :n]) @ (table[:, :n] @ states + table[:, n])
