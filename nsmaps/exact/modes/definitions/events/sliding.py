"""Sliding along a surface between two modes, derived from their rates: Filippov's convex combination, and its events.

With the rates f and f' above and below the surface g = 0, and a and b the rates of g in them, the motion slides where a < 0 < b,
at the rates f - a (f - f')/(a - b), for which g stays zero; it leaves upwards where a rises to zero and downwards where b falls
to zero: one of the two fields is then tangential to the surface (A. F. Filippov, Differential Equations with Discontinuous
Righthand Sides, Kluwer 1988).
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, trials
from nsmaps.exact.modes.definitions.definition import Surface, Transition
from nsmaps.exact.modes.definitions.formulas import Reader, check_names, text_of
from nsmaps.exact.modes.definitions.rows import Row, row_of
from nsmaps.exact.systems.guards import SlidingSurface

Rates = tuple[Row, ...]  #: of all states in a mode
OFF = 1e-9  #: of the sizes of its terms: how far from zero a function of the surface may be just after an event


def slide_rates(reader: Reader, name: str, given: SlidingSurface, rates: Mapping[str, Rates]) -> Rates:
    """The rates of the states while they slide.

    Raises:
        SystemDefinitionError: the modes do not differ in the rate of the function.
    """
    what = f"{reader.name}.guards: the sliding {name!r}"
    check_names(f"{what} is between the modes", (given.above, given.below), tuple(rates))
    check_names(f"{what} has a letter for the mode", given.letters, (given.above, given.below, name))
    above, below = rates[given.above], rates[given.below]
    function = reader.row(given.function, f"the function of {what}")
    rise = function.rate(above, reader.phase_rate)
    jump = rise + -function.rate(below, reader.phase_rate)
    across = sp.expand(jump.of(reader.variables))
    if across == 0:
        raise SystemDefinitionError(
            f"{what}: its function {text_of(given.function)} has the same rate in {given.above!r} and in {given.below!r}: no "
            "motion slides; expected: modes whose rates lead to the surface from either side, or a `Guard`"
        )
    rows = []
    for one, other in zip(above, below, strict=True):
        difference = sp.expand((one + -other).of(reader.variables))
        step = sp.cancel(difference / across) if difference.is_polynomial(*reader.variables) else difference / across
        rate = one.of(reader.variables) - rise.of(reader.variables) * step
        rows.append(row_of(rate if one.variables or rise.variables else sp.expand(rate), reader.variables))
    return tuple(rows)


def on_surface(reader: Reader, function: Row, what: str) -> Rates:
    """The states as rows, one of them from the zero of a function, which it then meets but for rounding.

    A function that is linear in none of them leaves them as they are.
    """
    curved = [function.remainder.has(y) if function.variables else False for y in reader.variables]
    given = zip(reader.states, function.coefficients, curved, strict=True)
    sizes = [0 if c == 0 or bent or state in reader.noise else 2 if c.is_number else 1 for state, c, bent in given]
    if not any(sizes):
        if any(curved):
            return tuple(map(reader.same, reader.states))
        raise SystemDefinitionError(f"{what} has a function that depends on no state; expected: a function of the states")
    k = sizes.index(max(sizes))
    share = Row(
        tuple(c if i != k else sp.S.Zero for i, c in enumerate(function.coefficients)), function.remainder, function.variables
    )
    solved = share.times(-1 / function.coefficients[k])
    return tuple(solved if i == k else reader.same(state) for i, state in enumerate(reader.states))


def surface_of(reader: Reader, name: str, given: SlidingSurface, rates: Mapping[str, Rates]) -> Surface:
    """The surface itself, from which the motion is not unique where both modes lead away."""
    what = f"{reader.name}.guards: the sliding {name!r}"
    function = reader.row(given.function, f"the function of {what}")
    states = on_surface(reader, function, what)
    above, below = (function.rate(rates[mode], reader.phase_rate).at(states) for mode in (given.above, given.below))
    rows = tuple(_without_signs(reader, row, states, what) for row in (function, above, -below))
    return Surface(name, (given.above, given.below), rows)


def _without_signs(reader: Reader, row: Row, states: Rates, what: str) -> Row:
    """A row on a surface with the signs of kinks that do not change along it."""
    symbols = set().union(*(expr.free_symbols for expr in (*row.coefficients, row.remainder)))
    values = {}
    for argument, sign in reader.kinks.arguments_in(symbols).items():
        values[sign] = sp.sign(row_of(argument, reader.variables).at(states).of(reader.variables))
        if values[sign].has(PHI, *reader.variables, *reader.kinks.signs.values()):
            raise SystemDefinitionError(
                f"{what} leads through a kink of the rates, where {text_of(argument)} is zero; expected: modes of their own on "
                "either side of it"
            )
    return row.subs(values)


def slide_transitions(reader: Reader, name: str, given: SlidingSurface, rates: Mapping[str, Rates]) -> Iterator[Transition]:
    """The events at a surface: sliding begins or the surface is crossed, from either side, and sliding ends on either side."""
    modes = tuple(rates)
    what = f"{reader.name}.guards: the sliding {name!r}"
    up = reader.row(given.function, f"the function of {what}")
    down = -up
    states = on_surface(reader, up, what)
    rise = up.rate(rates[given.below], reader.phase_rate).at(states)
    fall = -up.rate(rates[given.above], reader.phase_rate).at(states)
    same = tuple(map(reader.same, reader.states))

    def event(before: str, after: str, function: Row, reset: Rates, where: Rates = (), held: Rates = ()) -> Transition:
        name, letter, mode = f"{before} to {after}", given.letters.get(after, after[:1]), modes.index(before)
        return Transition(name, letter, mode, function, modes.index(after), reset, where, held=held, leaves=bool(held))

    for before, after, function, begins in ((given.above, given.below, up, rise), (given.below, given.above, down, fall)):
        yield event(before, name, function, states, (begins,))
        yield event(before, after, function, same, (-begins,))
    yield event(name, given.above, fall, states, held=(up,))
    yield event(name, given.below, rise, states, held=(up,))


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
    """Whether what is affine and zero throughout the mode of an event is not zero just after it, at some trial values."""
    if any(row.variables for row in (*one.held, one.function)):
        return False
    after = [row.of(reader.variables) for row in one.reset]
    for k, formula in one.curved:
        after[k] = formula
    zeros = (*one.held, one.function)
    for values in trials(*(row.of(reader.variables) for row in zeros), *after):
        fixed = {symbol: value for symbol, value in values.items() if symbol not in reader.variables}
        table, n = np.array([_numbers(row, fixed) for row in zeros]), len(reader.variables)
        states = np.random.default_rng(1).normal(size=n)
        states -= np.linalg.pinv(table[:, :n]) @ (table[:, :n] @ states + table[:, n])
        given = fixed | dict(zip(reader.variables, map(sp.Float, states.tolist()), strict=True))
        new = np.array([float(expr.subs(given)) for expr in after] + [1.0])
        for row in one.held:
            terms = _numbers(row, fixed) * new
            if abs(terms.sum()) > OFF * abs(terms).sum():
                return True
    return False


def _numbers(row: Row, values: dict[sp.Symbol, sp.Expr]) -> Floats:
    """The coefficients of a row and its remainder, shape (n + 1,)."""
    return np.array([float(sp.N(sp.sympify(x).subs(values))) for x in (*row.coefficients, row.remainder)])
