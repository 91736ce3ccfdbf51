"""A class of systems with modes, read as a whole: modes, guards, slidings and section become a `Definition`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import sympy as sp

from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, in_symbols
from nsmaps.exact.flows.source import ADVICE
from nsmaps.exact.modes.definitions.definition import Definition, Transition
from nsmaps.exact.modes.definitions.events.contact import Contact, contact_of, contact_transitions
from nsmaps.exact.modes.definitions.events.crossings import divide_modes, nothing_changes
from nsmaps.exact.modes.definitions.events.parts import in_part, later, signs_of, with_kink_crossings
from nsmaps.exact.modes.definitions.events.sliding import Rates, check_held, slide_rates, slide_transitions, surface_of
from nsmaps.exact.modes.definitions.formulas import CLOCK, Reader, check_names, check_periodic
from nsmaps.exact.modes.definitions.nonlinear import with_derived_states
from nsmaps.exact.modes.definitions.rows import Row, affine_row
from nsmaps.exact.modes.definitions.sections import check_starts, clock_of, coordinates_of, starts_of
from nsmaps.exact.systems.files import check_period
from nsmaps.exact.systems.guards import Guard, HybridFormulas, PoincareSection, SlidingSurface
from nsmaps.exact.systems.parameters import choices_of

Formulas = tuple[Mapping[str, Mapping[str, Any]], Mapping[str, Guard | SlidingSurface], PoincareSection]
SIDES = "before", "after"
STEP = sp.Symbol("_h", positive=True)  #: of the grid in time, the last of the symbols
DEGREE = 3  #: of the noise over a step


def definition_of(system: HybridFormulas, driven: bool = False) -> Definition:
    """The formulas of a system's class with symbols for its parameters; where it is `driven`, with its noise as states.

    Raises:
        SystemDefinitionError: they are not those of a system with modes; says which formula, and why.
    """
    cls = type(system)
    if not cls.states or not all(isinstance(name, str) and name.isidentifier() for name in cls.states):
        raise SystemDefinitionError(f"{cls.__name__}.states is {cls.states!r}; expected: names of states, such as ('x', 'v')")
    symbolic, symbols = in_symbols(cls, choices_of(system))
    period = symbolic.period()
    check_period(cls, period)
    t = CLOCK if period is None else PHI * sp.sympify(period) / (2 * sp.pi)
    rate = sp.S.Zero if period is None else 2 * sp.pi / sp.sympify(period)
    variables = {name: sp.Symbol(f"_y_{name}", real=True) for name in cls.states}
    names = [cls.noise if k == 0 else f"_{cls.noise}_{k}" for k in range(DEGREE + 1 if driven else 0)]
    noise = {name: sp.Symbol(f"_n_{k}", real=True) for k, name in enumerate(names)}  # a cubic over a step, and its derivatives
    known = (*symbols.values(), STEP) if driven else tuple(symbols.values())
    reader = Reader(cls.__name__, frozenset(known), variables | noise, rate, tuple(noise))
    y = cls._arguments(reader.states)
    if cls.noise:
        check_noise(cls.__name__, cls.noise, cls.states)
    modes, guards, section = evaluate_formulas(symbolic, t, y)
    if cls.noise:
        check_noise(cls.__name__, cls.noise, section.coordinates)
    rates = {mode: _rates(reader, mode, {**given, **noise_rates(noise)}) for mode, given in modes.items()}
    horizon = sp.sympify(cls.horizon) * (1 if period is None else sp.sympify(period))
    definition = _build_definition(reader, known, rates, guards, section, horizon)
    if driven:
        check_driven(cls.__name__, cls.noise, definition)
    return definition


def _build_definition(
    reader: Reader,
    symbols: tuple[sp.Symbol, ...],
    rates: dict[str, Rates],
    guards: Mapping[str, Guard | SlidingSurface],
    section: PoincareSection,
    horizon: sp.Expr,
) -> Definition:
    """The definition from the rates of the modes that are given, the events, and the section."""
    forced, names = reader.phase_rate != 0, tuple(reader.states)
    events = with_kink_crossings(reader, _events(reader, guards, rates), tuple(rates.values()))
    later_signs = {sign: later(sign) for sign in reader.kinks.signs.values()}
    transitions, parts = divide_modes(reader.name, events, len(rates), later_signs)
    signs = [signs_of(reader, events, tuple(rates.values()), *part) for part in parts]
    transitions = tuple(in_part(one, signs[one.mode], signs[one.target] if one.target >= 0 else {}) for one in transitions)
    named = [tuple(rates.items())[mode] for mode, _ in parts]
    flows = tuple(tuple(row.subs(known) for row in rows) for (_, rows), known in zip(named, signs, strict=True))
    coordinates = coordinates_of(reader.name, names, section, forced)
    starts = starts_of(reader, section, transitions)
    after = section.side == "after" and not all(nothing_changes(transitions[start.transition]) for start in starts)
    surfaces = tuple(surface_of(reader, name, one, rates) for name, one in guards.items() if isinstance(one, SlidingSurface))
    check_starts(reader, section, transitions, starts, flows, after)
    moved = forced and any(row.remainder.has(PHI) for mode in rates.values() for row in mode)
    clock = clock_of(reader, transitions, starts, moved) if forced and not coordinates.angles.any() else -1
    definition = Definition(
        symbols,
        names,
        reader.variables,
        reader.phase_rate,
        horizon,
        tuple(mode for mode, _ in named),
        flows,
        transitions,
        coordinates,
        after,
        starts,
        tuple(sum(flags) for _, flags in parts),
        surfaces,
        clock,
    )
    return with_derived_states(definition)


def _events(reader: Reader, guards: Mapping[str, Guard | SlidingSurface], rates: dict[str, Rates]) -> tuple[Transition, ...]:
    """The events of guards; the rates of the modes that follow from others are added."""
    contacts = _derive(reader, guards, rates)
    events = tuple(_transitions(reader, rates, guards, contacts))
    held = {one.mode: one.held for one in events if one.held}
    events = tuple(replace(one, held=held.get(one.mode, ())) for one in events)
    check_held(reader, tuple(rates), events)
    left = {one.mode for one in events if not one.begins}
    for closed in (mode for number, mode in enumerate(rates) if number not in left):
        raise SystemDefinitionError(
            f"{reader.name}.guards: none is watched in the mode {closed!r}, which a motion never leaves; expected: a guard "
            "there, or `ends=True` for the guards that lead to it"
        )
    return events


def _rates(reader: Reader, mode: str, given: Mapping[str, Any]) -> tuple[Row, ...]:
    names = ", ".join(reader.states)
    if set(given) != set(reader.states):
        there = ", ".join(given) or "nothing"
        raise SystemDefinitionError(f"{reader.name}.modes has in mode {mode!r} the rates of {there}; expected: of {names}")
    what = f"{reader.name}.modes: in mode {mode!r} the rate of"
    return tuple(reader.row(given[state], f"{what} {state}") for state in reader.states)


def _derive(reader: Reader, guards: Mapping[str, Guard | SlidingSurface], rates: dict[str, Rates]) -> dict[str, Contact]:
    """Add the rates of the modes that follow from others; the contacts that last, by their guards."""
    contacts: dict[str, Contact] = {}
    for name, given in guards.items():
        if isinstance(given, SlidingSurface):
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
    reader: Reader, rates: Mapping[str, Rates], guards: Mapping[str, Guard | SlidingSurface], contacts: Mapping[str, Contact]
) -> Iterator[Transition]:
    for name, given in guards.items():
        if isinstance(given, SlidingSurface):
            yield from slide_transitions(reader, name, given, rates)
        else:
            yield from _guard_transitions(reader, tuple(rates), name, given)
        if name in contacts and isinstance(given, Guard):
            yield from contact_transitions(name, given, contacts[name], tuple(rates))


def _guard_transitions(reader: Reader, modes: tuple[str, ...], name: str, guard: Guard) -> Iterator[Transition]:
    """The event of a guard in each of its modes."""
    what = f"{reader.name}.guards: {name!r}"
    check_names(f"{what} names the mode", [*guard.watched, *([guard.to] if guard.to else [])], modes)
    check_names(f"{what} resets", guard.reset, tuple(reader.states))
    function = reader.row(guard.function, f"the function of {what}")
    where = tuple(reader.row(one, f"a condition of {what}") for one in guard.where)
    reset, curved = _reset(reader, guard, what)
    letter = name[:1] if guard.letter is None else guard.letter
    for mode in guard.watched:
        target = -1 if guard.ends else modes.index(guard.to or mode)
        contact = name if guard.rests else ""
        yield Transition(
            name, letter, modes.index(mode), function, target, reset, where, curved, guard=contact, crossing=guard.crossing
        )


def _reset(reader: Reader, guard: Guard, what: str) -> tuple[tuple[Row, ...], tuple[tuple[int, sp.Expr], ...]]:
    """The states just after an event as rows, the state itself where it is another formula, and these formulas."""
    rows, curved = [], []
    for k, state in enumerate(reader.states):
        expr = reader.formula(guard.reset.get(state, reader.states[state]), f"the reset of {state} by {what}")
        row = affine_row(expr, reader.variables)
        rows.append(row or reader.same(state))
        if row is None:
            check_periodic(expr, f"the reset of {state} by {what}")
            curved.append((k, expr))
    return tuple(rows), tuple(curved)


def check_noise(name: str, noise: str, taken: Sequence[str]) -> None:
    """Refuse a name of the noise that is that of something else."""
    if not noise.isidentifier() or noise in taken:
        raise SystemDefinitionError(
            f"{name}.noise is {noise!r}; expected: a name of its own for the noise, such as 'eta', which formulas use as y.eta"
        )


def noise_rates(states: Mapping[str, sp.Symbol]) -> dict[str, sp.Expr]:
    """The rates of the noise and its derivatives."""
    symbols = list(states.values())
    return {name: y / STEP for name, y in zip(states, symbols[1:], strict=False)} | dict.fromkeys(list(states)[-1:], sp.S.Zero)


def check_driven(name: str, noise: str, definition: Definition) -> None:
    """Refuse noise that no formula holds."""
    place, own = definition.states.index(noise), len(definition.states) - DEGREE - 1
    symbol = definition.variables[place]
    rows = [row for mode in definition.rates for row in mode[:own]] + [one.function for one in definition.transitions]
    smooth = [rate for mode in definition.smooth for rate in mode[:own]]
    if all(row.coefficients[place] == 0 for row in rows) and not any(x.has(symbol) for x in (*smooth, *definition.derived)):
        raise SystemDefinitionError(f"{name}.noise is {noise!r}, and no rate or guard has it; expected: y.{noise} in formulas")


def evaluate_formulas(system: HybridFormulas, t: sp.Expr, y: SimpleNamespace) -> Formulas:
    """The modes, guards and section of a system, at symbols for the time and the states.

    Raises:
        SystemDefinitionError: one of them fails with symbols, or is of another kind.
    """
    modes, guards, section = (_call(system, formula, t, y) for formula in ("modes", "guards", "section"))
    if not isinstance(modes, Mapping) or not modes or not all(isinstance(rates, Mapping) for rates in modes.values()):
        raise _wrong_kind(
            system, "modes", modes, "the rates of all states by the names of modes, as {'flight': {'x': y.v, 'v': -1}}"
        )
    if not isinstance(guards, Mapping) or not all(isinstance(one, Guard | SlidingSurface) for one in guards.values()):
        raise _wrong_kind(system, "guards", guards, "a `Guard` or a `SlidingSurface` by its name, as {'I': Guard('flight', y.x)}")
    if not isinstance(section, PoincareSection):
        raise _wrong_kind(system, "section", section, "a `PoincareSection`, as PoincareSection('I', ('v', 'phi'))")
    if section.side not in SIDES:
        raise _wrong_kind(system, "section", section.side, f"its side as {' or '.join(map(repr, SIDES))}")
    return modes, guards, section


def _wrong_kind(system: HybridFormulas, formula: str, given: Any, expected: str) -> SystemDefinitionError:
    """The error of a formula of another kind."""
    return SystemDefinitionError(f"{type(system).__name__}.{formula} is {given!r:.60}; expected: {expected}")


def _call(system: HybridFormulas, formula: str, t: sp.Expr, y: SimpleNamespace) -> Any:
    """The result of a formula; an error of Python in it as one of the definition."""
    try:
        return getattr(system, formula)(t, y)
    except NsmapsError:
        raise
    except Exception as error:
        why = f"{type(error).__name__}: {error}".replace("_p_", "").replace("_y_", "y.").replace("_phi", "phi")
        missing = isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace)
        advice = next((advice for sign, advice in ADVICE.items() if sign in why), "")
        if missing:
            advice = f"the states are {', '.join(f'y.{name}' for name in vars(y))}"
        message = f"{type(system).__name__}.{formula} cannot be written in symbols ({why}){advice and f'; {advice}'}"
        raise SystemDefinitionError(message) from error
