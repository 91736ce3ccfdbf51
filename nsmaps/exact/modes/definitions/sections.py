"""The section of a system with modes: its coordinates, and the state and phase that they give at each of its events."""

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise

import sympy as sp

from nsmaps.coordinates import Coordinates
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, trials
from nsmaps.exact.modes.definitions.definition import Start, Transition
from nsmaps.exact.modes.definitions.events.sliding import Rates
from nsmaps.exact.modes.definitions.formulas import Reader, check_names, text_of
from nsmaps.exact.modes.definitions.rows import NEAR, Row, equal, factor_of, vanishes
from nsmaps.exact.systems.guards import PoincareSection


def coordinates_of(name: str, states: tuple[str, ...], section: PoincareSection, forced: bool) -> Coordinates:
    """The coordinates of the section of a class of this name.

    Raises:
        SystemDefinitionError: there are none, or other names than those of states and of one phase.
    """
    others = [each for each in section.coordinates if each not in states]
    wanted = f"names of the states {', '.join(states)}" + ", and of one phase" * forced
    if not section.coordinates:
        first, *_ = states
        raise SystemDefinitionError(
            f"{name}.section has no coordinates, and a map needs one; expected: {wanted}, such as ({first!r},); one that the "
            "guard gives already may be named too"
        )
    if len(others) > forced or len(set(section.coordinates)) < len(section.coordinates):
        raise SystemDefinitionError(f"{name}.section has the coordinates {', '.join(section.coordinates)}; expected: {wanted}")
    return Coordinates(tuple(section.coordinates), angles=others)


def starts_of(reader: Reader, section: PoincareSection, transitions: Sequence[Transition]) -> tuple[Start, ...]:
    """What the coordinates give at each event of the section.

    Raises:
        SystemDefinitionError: an event or a state is unknown, or the coordinates leave a state open.
    """
    names = (section.guards,) if isinstance(section.guards, str) else tuple(section.guards)
    check_names(f"{reader.name}.section is at", names, tuple(dict.fromkeys(one.name for one in transitions if one.name)))
    check_names(f"{reader.name}.section gives the state", section.states, tuple(reader.states))
    events = ((k, one) for k, one in enumerate(transitions) if one.name in names and not one.releases)
    starts = tuple(_start(reader, section, k, one) for k, one in events)
    _check_bound(reader, transitions, starts)
    return starts


def _start(reader: Reader, section: PoincareSection, number: int, transition: Transition) -> Start:
    states = _states(reader, section, transition)
    surface = tuple(zeros_at(section, transition))
    zeros = (row.at(states) for row in surface)
    bound = tuple(
        row
        for row in zeros
        if any(row.coefficients) or not (row.remainder == 0 or (row.variables and vanishes(row.of(row.variables))))
    )
    return Start(number, states, zeros=bound, surface=surface)


def _check_bound(reader: Reader, transitions: Sequence[Transition], starts: Sequence[Start]) -> None:
    """Refuse coordinates of which some determine others, at each event, by a function that is not affine."""
    for start in starts if all(start.zeros for start in starts) else ():
        for row in (row for row in start.zeros if row.variables and not row.timed):
            raise SystemDefinitionError(
                f"{reader.name}.section at {transitions[start.transition].name!r} has coordinates and `states` that lie on a "
                f"surface only where {text_of(row.of(row.variables))} is zero, which is not affine; expected: one coordinate "
                "less, and the formula of that state in `states`"
            )


def _states(reader: Reader, section: PoincareSection, transition: Transition) -> Rates:
    """The states by the coordinates: themselves, as given, or those that are left by what is zero at the event."""
    rows = {state: reader.same(state) for state in reader.states if state in section.coordinates}
    for state, given in section.states.items():
        what = f"{reader.name}.section: {state}"
        row = reader.row(given, what)
        others = reader.states_in(row) - set(section.coordinates)
        if others or state in section.coordinates:
            raise SystemDefinitionError(
                f"{what} is {text_of(reader.formula(given, what))}; expected: a formula in the coordinates, of another state"
            )
        if reader.expression(given, what) != reader.formula(given, what):
            raise SystemDefinitionError(
                f"{what} is {text_of(reader.formula(given, what))}, which has a kink; expected: a smooth formula, or another "
                "state among the coordinates"
            )
        rows[state] = row
    rows |= {state: reader.row(0, "") for state in reader.noise}
    left = [state for state in reader.states if state not in rows]
    if left:
        rows |= _solve_states(reader, section, transition, left, rows)
    return tuple(rows[state] for state in reader.states)


def _solve_states(
    reader: Reader, section: PoincareSection, transition: Transition, left: Sequence[str], rows: Mapping[str, Row]
) -> dict[str, Row]:
    """The states that are left by the zeros at an event."""
    states = [rows.get(state, reader.same(state)) for state in reader.states]
    zeros = [one.at(states).of(reader.variables) for one in zeros_at(section, transition)]
    unknown = [reader.states[state] for state in left]
    for chosen in combinations(zeros, len(left)):
        if not _has_one_zero([sp.diff(zero, x) for zero in chosen for x in unknown], unknown):
            continue  # several states may solve it
        first, *others = _solutions(chosen, unknown) or [{}]
        if not others and len(first) == len(unknown) and not any(value.has(*unknown) for value in first.values()):
            return {state: reader.row(first[reader.states[state]], f"{reader.name}.section: {state}") for state in left}
    names = " and ".join(left)
    what = f"the guard {transition.name!r}" + " with its reset" * (section.side == "after")
    depends = f"{what} does not depend on {names}" if len(left) == 1 else f"{what} does not give {names}"
    if any(zero.has(*unknown) for zero in zeros):
        depends = f"{what} is not linear in {names}, of which several values may be its zeros"
    example = ", ".join(f"{state!r}: ..." for state in left)
    raise SystemDefinitionError(
        f"{reader.name}.section leaves {names} open, and {depends}; expected: all states but one in `coordinates` or `states`, "
        f"as states={{{example}}}, {section.side} the reset"
    )


def _has_one_zero(slopes: Sequence[sp.Expr], unknown: Sequence[sp.Symbol]) -> bool:
    """Whether functions are zero at one value of states at most: they are linear in these, or one surely rises or falls."""
    first, *others = slopes
    monotone = not others and (first.is_positive or first.is_negative)
    return bool(monotone) or not any(slope.has(*unknown) for slope in slopes)


def _solutions(zeros: Sequence[sp.Expr], unknown: Sequence[sp.Symbol]) -> list[dict[sp.Symbol, sp.Expr]]:
    """The values of unknown states at which functions are zero, those that sympy finds."""
    try:
        found = sp.solve(zeros, unknown, dict=True)
    except NotImplementedError:
        return []
    return [one for one in found if not any(value.is_real is False for value in one.values())]


def zeros_at(section: PoincareSection, transition: Transition) -> list[Row]:
    """Functions of the states that are zero at an event, on the side of the reset at which the section is.

    Before it they are the event's function and what is zero all along. With the reset R b + r of a state b at which rows G b + g
    are zero, the state a just after obeys c (a - r) = d g for all c, d with c R + d G = 0; states with other resets are left out.
    """
    before = [transition.function, *transition.held]
    if section.side == "before":
        return before
    affine, curved = [row for row in before if not row.variables], [row for row in before if row.variables]
    kept = {k: row for k, row in enumerate(transition.reset) if k not in dict(transition.curved)}
    ways = sp.Matrix([row.coefficients for row in (*kept.values(), *affine)]).T.nullspace(simplify=True)
    found = [_after(list(way), kept, affine, len(transition.reset)) for way in ways]
    return [*found, *_curved_after(transition, curved)]


def _curved_after(transition: Transition, before: list[Row]) -> list[Row]:
    """Nonlinear functions as those of the states just after, where the reset is affine and has an inverse."""
    n = len(transition.reset)
    matrix = sp.Matrix([row.coefficients for row in transition.reset])
    if not before or transition.curved or any(row.variables for row in transition.reset) or matrix.det() == 0:
        return []
    inverse = matrix.inv()
    shift = inverse * sp.Matrix([row.remainder for row in transition.reset])
    states = [Row(tuple(inverse.row(k)), -shift[k]) for k in range(n)]
    return [row.at(states) for row in before]


def _after(way: list[sp.Expr], reset: Mapping[int, Row], before: list[Row], n: int) -> Row:
    """One of the rows of `zeros_at`, after a reset of some states, by their places."""
    coefficients = [sp.S.Zero] * n
    for k, c in zip(reset, way, strict=False):
        coefficients[k] = sp.cancel(c)
    remainder = sp.Add(*(c * row.remainder for c, row in zip(way, (*reset.values(), *before), strict=True)))
    return Row(tuple(coefficients), sp.expand(-remainder))


def check_starts(
    reader: Reader,
    section: PoincareSection,
    transitions: Sequence[Transition],
    starts: Sequence[Start],
    flows: Sequence[Rates],
    after: bool,
) -> None:
    """Refuse a section whose given states are on no surface, or whose coordinates do not distinguish its events.

    Raises:
        SystemDefinitionError: says which events or states, and what is expected.
    """
    for start in starts:
        name = transitions[start.transition].name
        for zero in start.zeros:
            if not any(zero.coefficients) and zero.remainder.is_number and abs(sp.N(zero.remainder)) > NEAR:
                raise SystemDefinitionError(
                    f"{reader.name}.section gives states of which none is just {section.side} {name!r}: a function that is "
                    f"zero there is {sp.N(zero.remainder, 6)}; expected: other `states`, or those that the guard gives left out"
                )
    positive = [_positive(reader, transitions, flows, start) for start in starts] if len(starts) > 1 else []
    for (i, first), (k, second) in combinations(enumerate(starts), 2):
        one, other = (transitions[start.transition].name for start in (first, second))
        pairs = zip(reader.states, first.states, second.states, strict=True)
        left = [state for state, a, b in pairs if not equal(a, b)]
        alike = after and one != other
        if left and (alike or not any(_opposite(a, b) for a in positive[i] for b in positive[k])):
            raise SystemDefinitionError(
                f"{reader.name}.section is at {one!r} and {other!r}, whose functions are zero at different "
                f"{', '.join(left)} for the same coordinates, which do not distinguish them; expected: "
                f"{' and '.join(map(repr, left))} among the `coordinates`, or one event"
            )


def _positive(reader: Reader, transitions: Sequence[Transition], flows: Sequence[Rates], start: Start) -> list[Row]:
    """Functions of the coordinates that are positive at a start: its event's comes down, its conditions and its part hold."""
    event = transitions[start.transition]
    down = -event.function.rate(flows[event.mode], reader.phase_rate)
    silent = (one.function for one in transitions if one.mode == event.mode and not one.name)
    part = [function for function in silent if factor_of(function, event.function) is None]
    return [row.at(start.states) for row in (down, *event.where, *part)]


def _opposite(one: Row, other: Row) -> bool:
    """Whether a row is a negative multiple of another one."""
    factor = factor_of(one, other)
    return factor is not None and all(sp.N(factor.subs(values)) < 0 for values in trials(factor))


def clock_of(reader: Reader, transitions: Sequence[Transition], starts: Sequence[Start], forced: bool) -> int:
    """The transition that gives the phase of a section without one among its coordinates; -1 where that is zero.

    Raises:
        SystemDefinitionError: its events are not at one phase, in a system whose rates depend on it (`forced`).
    """
    ones = [transitions[start.transition] for start in starts]
    clocks = [one.function.timed and one.function.remainder.has(PHI) for one in ones]
    for one in (one for one, clock in zip(ones, clocks, strict=True) if clock and one.function.variables):
        raise SystemDefinitionError(
            f"{reader.name}.section has no phase among its coordinates, and the function of {one.name!r}, "
            f"{text_of(one.function.remainder)}, is not a sum of harmonics; expected: one with the same zero, such as -sin(w t)"
        )
    if all(clocks) and all(equal(one.function, other.function) for one, other in pairwise(ones)):
        return next(start.transition for start in starts)
    for start, one in zip(starts, ones, strict=True):
        fixed = any(zero.remainder.has(PHI) for zero in start.zeros) or not forced
        values = [x for zero in start.zeros for x in (*zero.coefficients, zero.remainder.subs(PHI, 0))]
        if any(clocks) or not fixed or not all(map(vanishes, values)):
            raise SystemDefinitionError(
                f"{reader.name}.section has no phase among its coordinates, and the function of {one.name!r} does not fix it; "
                "expected: a name for the phase in `coordinates`, as 'phi', or a section at one clock, such as -sin(w t)"
            )
    return -1
