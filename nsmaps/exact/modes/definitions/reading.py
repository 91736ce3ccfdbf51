"""A class of systems with modes, read as a whole: modes, guards, slidings and section become a `Definition`."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import sympy as sp

from nsmaps.coordinates import Coordinates
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, trials
from nsmaps.exact.modes.definitions.contact import Contact, contact_of, contact_transitions
from nsmaps.exact.modes.definitions.crossings import crosses, divided
from nsmaps.exact.modes.definitions.definition import Definition, Row, Start, Transition
from nsmaps.exact.modes.definitions.driven import STEP, check_driven, check_noise, noise_rates, noise_states
from nsmaps.exact.modes.definitions.formulas import CLOCK, NEAR, Reader, check_names, check_periodic
from nsmaps.exact.modes.definitions.sliding import Rates, slide_rates, slide_transitions, surface_of
from nsmaps.exact.modes.definitions.stated import formulas_stated
from nsmaps.exact.systems.guards import Guard, Section, Sliding

if TYPE_CHECKING:
    from nsmaps.exact.systems.hybrid import HybridSystem


def definition_of(system: "HybridSystem", driven: bool = False) -> Definition:
    """The formulas of a system's class with symbols for its parameters; where it is `driven`, with its noise as states.

    Raises:
        SystemDefinitionError: they are not those of a piecewise-linear system; says which formula, and why.
    """
    cls = type(system)
    if not cls.states or not all(isinstance(name, str) and name.isidentifier() for name in cls.states):
        raise SystemDefinitionError(f"{cls.__name__}.states is {cls.states!r}; expected: names of states, such as ('x', 'v')")
    symbols = {name: sp.Symbol(f"_p_{name}", real=True) for name in cls.parameter_names()}
    fixed = {name: getattr(system, name) for name in cls.model_fields if name not in symbols}
    symbolic = cls.model_construct(**symbols, **fixed)
    period = symbolic.period()
    t = CLOCK if period is None else PHI * sp.sympify(period) / (2 * sp.pi)
    rate = sp.S.Zero if period is None else 2 * sp.pi / sp.sympify(period)
    variables = {name: sp.Symbol(f"_y_{name}", real=True) for name in cls.states}
    noise = noise_states(cls.noise) if driven else {}
    known = (*symbols.values(), STEP) if driven else tuple(symbols.values())
    reader = Reader(cls.__name__, frozenset(known), variables | noise, rate, tuple(noise))
    y = cls._arguments(reader.states)
    if cls.noise:
        check_noise(cls.__name__, cls.noise, cls.states)
    modes, guards, section = formulas_stated(symbolic, t, y)
    if cls.noise:
        check_noise(cls.__name__, cls.noise, section.coordinates)
    rates = {mode: _rates(reader, mode, {**given, **noise_rates(noise)}) for mode, given in modes.items()}
    definition = _defined(reader, known, rates, guards, section, _horizon(cls.horizon, period))
    if driven:
        check_driven(cls.__name__, cls.noise, definition)
    return definition


def _horizon(periods: float, period: Any) -> sp.Expr:
    return sp.sympify(periods) * (sp.S.One if period is None else sp.sympify(period))


def _defined(
    reader: Reader,
    symbols: tuple[sp.Symbol, ...],
    rates: dict[str, Rates],
    guards: Mapping[str, Guard | Sliding],
    section: Section,
    horizon: sp.Expr,
) -> Definition:
    """The definition from the rates of the modes that are given, the events, and the section."""
    forced, names = reader.phase_rate != 0, tuple(reader.states)
    contacts = _derive(reader, guards, rates)
    events = tuple(_transitions(reader, rates, guards, contacts))
    left = {one.mode for one in events if not one.begins}
    if closed := [mode for number, mode in enumerate(rates) if number not in left]:
        raise SystemDefinitionError(
            f"{reader.name}.guards: none is watched in the mode {closed[0]!r}, which a motion never leaves; expected: a guard "
            "there, or `ends=True` for the guards that lead to it"
        )
    transitions, parts = divided(reader.name, events, len(rates))
    coordinates = _coordinates(reader.name, names, section, forced)
    starts = _starts(reader, section, transitions)
    if forced and not coordinates.angles.any():
        _check_phase_zero(reader, transitions, starts)
    after = section.side == "after" and not all(crosses(transitions[start.transition]) for start in starts)
    if after and len(starts) > 1:
        raise SystemDefinitionError(f"{reader.name}.section has several events; expected: one, or side='before'")
    surfaces = tuple(surface_of(reader, name, one, rates) for name, one in guards.items() if isinstance(one, Sliding))
    modes, flows = tuple(tuple(rates)[k] for k in parts), tuple(tuple(rates.values())[k] for k in parts)
    variables = tuple(reader.states.values())
    return Definition(
        symbols, names, variables, reader.phase_rate, horizon, modes, flows, transitions, coordinates, after, starts, surfaces
    )


def _rates(reader: Reader, mode: str, given: Mapping[str, Any]) -> tuple[Row, ...]:
    names = ", ".join(reader.states)
    if set(given) != set(reader.states):
        there = ", ".join(given) or "nothing"
        raise SystemDefinitionError(f"{reader.name}.modes has in mode {mode!r} the rates of {there}; expected: of {names}")
    what = f"{reader.name}.modes: in mode {mode!r} the rate of"
    return tuple(reader.row(given[state], f"{what} {state}") for state in reader.states)


def _derive(reader: Reader, guards: Mapping[str, Guard | Sliding], rates: dict[str, Rates]) -> dict[str, Contact]:
    """Add the rates of the modes that follow from others; the contacts that last, by their guards."""
    contacts: dict[str, Contact] = {}
    for name, given in guards.items():
        if isinstance(given, Sliding):
            if name in rates:
                raise SystemDefinitionError(
                    f"{reader.name}.guards: the sliding {name!r} has the name of a mode; expected: another"
                )
            rates[name] = slide_rates(reader, name, given, rates)
        elif given.rests:
            contacts[name] = contact_of(reader, name, given, rates)
            rates[given.rests] = contacts[name].rates
    return contacts


def _transitions(
    reader: Reader, rates: Mapping[str, Rates], guards: Mapping[str, Guard | Sliding], contacts: Mapping[str, Contact]
) -> Iterator[Transition]:
    for name, given in guards.items():
        if isinstance(given, Sliding):
            yield from slide_transitions(reader, name, given, rates)
        else:
            yield from _guarded(reader, tuple(rates), name, given)
        if name in contacts and isinstance(given, Guard):
            yield from contact_transitions(reader, name, given, contacts[name], tuple(rates))


def _guarded(reader: Reader, modes: tuple[str, ...], name: str, guard: Guard) -> Iterator[Transition]:
    """The event of a guard in each of its modes."""
    what = f"{reader.name}.guards: {name!r}"
    check_names(f"{what} names the mode", [*guard.watched, *([guard.to] if guard.to else [])], modes)
    check_names(f"{what} resets", guard.reset, tuple(reader.states))
    function = reader.row(guard.function, f"the function of {what}")
    where = tuple(reader.row(one, f"a condition of {what}") for one in guard.where)
    reset, curved = _reset(reader, guard, what)
    letter = name[0] if guard.letter is None else guard.letter
    for mode in guard.watched:
        target = -1 if guard.ends else modes.index(guard.to or mode)
        contact = name if guard.rests else ""
        yield Transition(name, letter, modes.index(mode), function, target, reset, where, curved, guard=contact)


def _reset(reader: Reader, guard: Guard, what: str) -> tuple[tuple[Row, ...], tuple[tuple[int, sp.Expr], ...]]:
    """The states just after an event as rows, the state itself where it is another formula, and these formulas."""
    rows, curved = [], []
    for k, state in enumerate(reader.states):
        expr = reader.expression(guard.reset.get(state, reader.states[state]), f"the reset of {state} by {what}")
        row = reader.affine(expr)
        rows.append(row or reader.same(state))
        if row is None:
            check_periodic(expr, f"the reset of {state} by {what}")
            curved.append((k, expr))
    return tuple(rows), tuple(curved)


def _coordinates(name: str, states: tuple[str, ...], section: Section, forced: bool) -> Coordinates:
    others = [each for each in section.coordinates if each not in states]
    if len(others) > forced or not section.coordinates:
        wanted = f"names of the states {', '.join(states)}" + ", and of one phase" * forced
        raise SystemDefinitionError(f"{name}.section has the coordinates {', '.join(section.coordinates)}; expected: {wanted}")
    return Coordinates(tuple(section.coordinates), angles=others)


def _check_phase_zero(reader: Reader, transitions: Sequence[Transition], starts: Sequence[Start]) -> None:
    """Refuse a section without a phase among its coordinates whose event is at another phase than zero."""
    for start in starts:
        one = transitions[start.transition]
        zero = one.function.at(start.states)
        for expr in (*zero.coefficients, zero.remainder.subs(PHI, 0)):
            if any(abs(sp.N(expr.subs(values), 30)) > NEAR for values in trials(expr)):
                raise SystemDefinitionError(
                    f"{reader.name}.section has no phase among its coordinates, and the function of {one.name!r} is not zero "
                    "at t = 0; expected: a name for the phase in `coordinates`, or an event at t = 0, such as -sin(w t)"
                )


def _starts(reader: Reader, section: Section, transitions: Sequence[Transition]) -> tuple[Start, ...]:
    """What the coordinates give at each event of the section."""
    names = (section.guards,) if isinstance(section.guards, str) else tuple(section.guards)
    check_names(f"{reader.name}.section is at", names, tuple(dict.fromkeys(one.name for one in transitions if one.name)))
    return tuple(_start(reader, section, k, one) for k, one in enumerate(transitions) if one.name in names and not one.releases)


def _start(reader: Reader, section: Section, number: int, transition: Transition) -> Start:
    """The states by the coordinates: themselves, as given, or those that are left by what is zero at the event."""
    rows = {state: reader.same(state) for state in reader.states if state in section.coordinates}
    rows |= {state: reader.row(given, f"{reader.name}.section: {state}") for state, given in section.states.items()}
    rows |= {state: reader.row(0, "") for state in reader.noise}
    left = [state for state in reader.states if state not in rows]
    if left:
        rows |= _solved(reader, transition, left, rows)
    return Start(number, tuple(rows[state] for state in reader.states))


def _solved(reader: Reader, transition: Transition, left: Sequence[str], rows: Mapping[str, Row]) -> dict[str, Row]:
    """The states that are left by the zeros of the function of an event, and of what is zero all along before it."""
    states = [rows.get(state, reader.same(state)) for state in reader.states]
    zeros = [one.at(states).of(tuple(reader.states.values())) for one in (transition.function, *transition.held)]
    unknown = [reader.states[state] for state in left]
    for chosen in combinations(zeros, len(left)):
        found = sp.solve(chosen, unknown, dict=True)
        if len(found) == 1 and len(found[0]) == len(unknown) and not any(value.has(*unknown) for value in found[0].values()):
            return {state: reader.row(found[0][reader.states[state]], f"{reader.name}.section: {state}") for state in left}
    depends = "does not depend on" if len(left) == 1 else "does not give"
    raise SystemDefinitionError(
        f"{reader.name}.section leaves {' and '.join(left)} open, and the guard {transition.name!r} {depends} "
        f"{' and '.join(left)}; expected: all states but one in `coordinates` or `states`"
    )
