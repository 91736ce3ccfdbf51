"""Modes with kinks in their formulas: parts of them by the signs of the kinks' arguments, with crossings from part to part.

At a crossing nothing changes but the part, and it has neither name nor letter: results do not show it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import trials
from nsmaps.exact.modes.definitions.definition import Transition
from nsmaps.exact.modes.definitions.events.crossings import Flags, crosses
from nsmaps.exact.modes.definitions.events.sliding import Rates
from nsmaps.exact.modes.definitions.formulas import Reader, text_of
from nsmaps.exact.modes.definitions.rows import Row, factor_of, row_of

Signs = Mapping[sp.Symbol, int]  #: of the arguments of kinks in a part of a mode
NEWTON = 40  #: steps to a state at which an argument is zero
JUMP = 1e-9  #: of the sizes of two rates: they differ by more where the rate jumps


def with_kink_crossings(reader: Reader, events: tuple[Transition, ...], rates: Sequence[Rates]) -> tuple[Transition, ...]:
    """Events, with the crossings at which the arguments of kinks are zero, and resets as rows where these decide on a part.

    Raises:
        SystemDefinitionError: the rate of an argument jumps where it is zero, so that the motion may slide there, or a reset that
            decides on a part has no Taylor series.
    """
    more = tuple(_crossings(reader, events, rates))
    whole = tuple(_deciding(reader, one, (*events, *more)) for one in (*events, *more))
    return whole if whole == events else with_kink_crossings(reader, whole, rates)


def _deciding(reader: Reader, one: Transition, events: Sequence[Transition]) -> Transition:
    """An event whose reset is not affine, with this as rows where it changes a function that is crossed in the next mode."""
    crossed = [other.function for other in events if other.mode == one.target and crosses(other)]
    names = {name for function in crossed for name in reader.states_in(function)}
    rows = list(one.reset)
    for k, formula in one.curved:
        state = list(reader.states)[k]
        if state in names:
            rows[k] = reader.row(formula, f"the reset of {state} by {reader.name}.guards: {one.name!r}")
    return replace(one, reset=tuple(rows))


def _crossings(reader: Reader, events: Sequence[Transition], rates: Sequence[Rates]) -> Iterator[Transition]:
    """The crossings at which the arguments of kinks are zero, in the modes whose formulas hold these."""
    same = tuple(map(reader.same, reader.states))
    for mode, rows in enumerate(rates):
        own = [one for one in events if one.mode == mode]
        for argument, sign in reader.kinks.arguments_in(_symbols(rows, own)).items():
            function = row_of(argument, reader.variables)
            if _ratio(function, [one.function for one in own if not one.begins and not one.releases]):
                continue
            _check_jump(reader, function, sign, rows)
            _check_power(reader, function, sign, rows)
            held = next((one.held for one in own), ())
            yield Transition("", "", mode, function, mode, same, held=held, crossing=True)


def signs_of(reader: Reader, events: Sequence[Transition], rates: Sequence[Rates], mode: int, below: Flags) -> Signs:
    """The signs of the arguments of kinks in a part of a mode, as functions of crossings are `below` zero there."""
    own = [one for one in events if one.mode == mode]
    crossed = dict(zip(dict.fromkeys(one.function for one in own if crosses(one)), below, strict=True))
    found = {}
    for argument, sign in reader.kinks.arguments_in(_symbols(rates[mode], own)).items():
        function = row_of(argument, reader.variables)
        for other in dict.fromkeys(one.function for one in own if not one.begins and not one.releases):
            if ratio := _ratio(function, [other]):
                found[sign] = -ratio if crossed.get(other, False) else ratio
                break
    return found


def in_part(one: Transition, before: Signs, after: Signs) -> Transition:
    """A transition with the signs in the part of the mode before it, and those just after it."""
    values = {**before, **{later(sign): value for sign, value in after.items()}}
    if not values:
        return one
    reset, curved = tuple(row.subs(values) for row in one.reset), tuple((k, formula.subs(values)) for k, formula in one.curved)
    return replace(one.with_rows(lambda row: row.subs(values)), reset=reset, curved=curved)


def later(sign: sp.Symbol) -> sp.Symbol:
    """The symbol of a sign just after an event."""
    return sp.Symbol(f"{sign}_later", real=True)


def _symbols(rates: Rates, own: Sequence[Transition]) -> set[sp.Symbol]:
    """The symbols in the rates of a mode and in its events."""
    rows = [*rates, *(row for one in own for row in (one.function, *one.reset, *one.where, *one.held, *one.begins))]
    exprs = [*(x for row in rows for x in (*row.coefficients, row.remainder)), *(x for one in own for _, x in one.curved)]
    return set().union(*(expr.free_symbols for expr in exprs))


def _ratio(function: Row, others: Sequence[Row]) -> int:
    """The sign of the number by which a function is a multiple of one of some others, 0 if it is one of none."""
    factors = (factor_of(function, other) for other in others)
    return next((int(sp.sign(factor)) for factor in factors if factor is not None and factor.is_number and factor != 0), 0)


def _check_jump(reader: Reader, function: Row, sign: sp.Symbol, rates: Rates) -> None:
    """Refuse a kink at which the rate of its own argument jumps: the motion may slide along its zero."""
    rate = function.rate(rates, reader.phase_rate).of(reader.variables)
    above, below = rate.subs(sign, 1), rate.subs(sign, -1)
    argument = function.of(reader.variables)
    for values in trials(above, below, argument) if above != below else ():
        at = _zero_near(argument, values, reader.variables)
        one, other = (sp.N(expr.subs(at)) for expr in (above, below))
        if at and abs(one - other) > JUMP * (abs(one) + abs(other)):
            raise SystemDefinitionError(
                f"{reader.name}.modes: where {text_of(argument)} is zero its own rate jumps, as by sign({text_of(argument)}), "
                "and the motion may stay there; expected: a `SlidingSurface` between two modes with this function"
            )


def _check_power(reader: Reader, function: Row, sign: sp.Symbol, rates: Rates) -> None:
    """Refuse a root of what is zero where the argument of a kink is: it has no Taylor series there, and motions come there."""
    known = zip(reader.variables, function.coefficients, strict=True)
    y, c = next(((y, c) for y, c in known if c != 0 and not function.remainder.has(y)), (None, sp.S.Zero))
    if y is None:
        return
    argument = function.of(reader.variables)
    there = {y: sp.expand(y - argument / c)}
    for rate in (row.of(reader.variables).subs(sign, side) for row in rates if row.variables for side in (1, -1)):
        for power in (part for part in rate.atoms(sp.Pow) if not part.exp.is_integer and part.base.has(*reader.variables)):
            if sp.expand(power.base.subs(there)) == 0:
                raise SystemDefinitionError(
                    f"{reader.name}.modes: {text_of(power)} has no Taylor series where {text_of(argument)} is zero, and "
                    "motions cross that; expected: a whole power, or a small length, as in u*(u**2 + eps**2)**(1/4) for u**(3/2)"
                )


def _zero_near(argument: sp.Expr, values: dict[sp.Symbol, sp.Expr], variables: Sequence[sp.Symbol]) -> dict[sp.Symbol, sp.Expr]:
    """Values at which an argument is zero, by Newton's method for one of the states; {} where it finds none."""
    y = next((y for y in variables if sp.diff(argument, y) != 0), None)
    if y is None:
        return {}
    at, slope = dict(values), sp.diff(argument, y)
    for _ in range(NEWTON):
        value, rate = sp.N(argument.subs(at)), sp.N(slope.subs(at))
        if rate == 0 or not value.is_finite or not value.is_real:
            return {}
        at[y] = sp.N(at[y] - value / rate)
    return at if abs(sp.N(argument.subs(at))) <= JUMP else {}
