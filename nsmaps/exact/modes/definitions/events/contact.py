"""Contact that lasts, derived from an impact: its rates, and the events that begin and end it.

An impact at g = 0 changes the states along a direction q, scaled so that g' grows by one. Impacts that accumulate bring g' to
zero along q; then the contact force, along q too, holds g'' at zero, at the rates f - g'' q, until the free g'' becomes positive
(A. Nordmark and P. Piiroinen, Nonlinear Dynamics 58, 2009).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import PHI, trials
from nsmaps.exact.flows.source import FRICTION
from nsmaps.exact.modes.definitions.definition import Transition
from nsmaps.exact.modes.definitions.events.sliding import Rates, on_surface
from nsmaps.exact.modes.definitions.formulas import Reader, check_names, text_of
from nsmaps.exact.modes.definitions.rows import NEAR, Row, row_of, vanishes
from nsmaps.exact.systems.guards import Guard


@dataclass(frozen=True)
class Contact:
    """What follows from the impact of a guard, in the mode in which it is watched."""

    free: str
    gap: Row
    speed: Row  #: g'
    lift: Row  #: g'' in free motion
    rates: Rates  #: in contact
    states: Rates  #: those of contact, by those of free motion: g = 0 and g' = 0


def contact_of(reader: Reader, name: str, guard: Guard, rates: Mapping[str, Rates]) -> Contact:
    """The contact at a guard.

    Raises:
        SystemDefinitionError: its event is not an impact in one mode, or its direction depends on states that it changes.
    """
    what = f"{reader.name}.guards: {name!r} with rests={guard.rests!r}"
    free, *others = guard.watched
    check_names(f"{what} names the mode", (free,), tuple(rates))
    if others or guard.to not in ("", free) or guard.ends:
        raise SystemDefinitionError(
            f"{what} concerns several modes; expected: an impact in one mode, which follows it too; {FRICTION}"
        )
    if guard.rests in rates:
        raise SystemDefinitionError(f"{what} has the name of a mode; expected: another")
    gap = reader.row(guard.function, f"the function of {what}")
    speed = gap.rate(rates[free], reader.phase_rate)
    lift = speed.rate(rates[free], reader.phase_rate)
    if gap.variables or speed.variables:
        raise SystemDefinitionError(
            f"{what} has the function {text_of(gap.of(reader.variables))}, which or whose rate is not affine in the "
            "states; expected: for contact that lasts a distance that is a state, as in polar coordinates, or no `rests`"
        )
    after = [reader.formula(guard.reset.get(state, y), f"{what}: {state}") for state, y in reader.states.items()]
    jumps = [sp.expand(one - y) for one, y in zip(after, reader.variables, strict=True)]
    _check_impact(reader, what, gap, speed, jumps)
    whole = sp.Add(*(c * jump for c, jump in zip(speed.coefficients, jumps, strict=True)))
    changed = {y for y, jump in zip(reader.variables, jumps, strict=True) if jump != 0}
    names = zip(reader.states, jumps, strict=True)
    direction = [_constant_component(sp.simplify(jump / whole), changed, f"{what}: {state}") for state, jump in names]
    held = tuple(_along(one, lift, -q, reader.variables) for one, q in zip(rates[free], direction, strict=True))
    same = tuple(map(reader.same, reader.states))
    still = tuple(_along(one, speed, -q, reader.variables) for one, q in zip(same, direction, strict=True))
    states = tuple(row.at(still) for row in on_surface(reader, gap, what))
    return Contact(free, gap, speed, lift, tuple(row.at(same) for row in held), states)


def _along(row: Row, other: Row, factor: sp.Expr, variables: tuple[sp.Symbol, ...]) -> Row:
    """A row plus another one times a factor, which may depend on states and time."""
    if factor.has(PHI, *variables):
        return row_of(row.of(variables) + factor * other.of(variables), variables)
    return row + other.times(factor)


def _constant_component(share: sp.Expr, changed: set[sp.Symbol], what: str) -> sp.Expr:
    """A component of the direction of an impact, free of the states that it changes, also where these cancel in floats alone."""
    moving = share.free_symbols & changed
    if not moving:
        return share
    values = [share.subs({x: value for x, value in at.items() if x in moving}) for at in trials(share)]
    numbers = [[sp.N(one.subs(at), 30) for one in values] for at in trials(share)]
    if not all(abs(x - first) <= NEAR * (1 + abs(first)) for first, *others in numbers for x in others):
        raise SystemDefinitionError(
            f"{what} changes by {text_of(share)} at an impact where the rate of the function grows by one; expected: a "
            "direction of the impact that is free of the states that it changes"
        )
    value, *_ = values
    return value


def _check_impact(reader: Reader, what: str, gap: Row, speed: Row, jumps: list[sp.Expr]) -> None:
    """Refuse a reset that changes the function itself, or its rate where that is zero."""

    def jump(row: Row, where: Row) -> sp.Expr:
        total = sp.Add(*(c * one for c, one in zip(row.coefficients, jumps, strict=True)))
        known = [one.of(reader.variables) for one in on_surface(reader, where, what)]
        return total.subs(dict(zip(reader.variables, known, strict=True)), simultaneous=True)

    changes = jump(gap, gap), jump(speed, speed)
    for text, change in zip(("changes the function of the guard", "is not an impact, -r times its rate"), changes, strict=True):
        if not vanishes(change):
            raise SystemDefinitionError(f"{what}: its reset {text}; expected: d/dt of the function becomes -r times that before")
    if not any(c != 0 and one != 0 for c, one in zip(speed.coefficients, jumps, strict=True)):
        raise SystemDefinitionError(f"{what}: its reset does not change the rate of the function; expected: an impact")


def contact_transitions(name: str, guard: Guard, found: Contact, modes: tuple[str, ...]) -> Iterator[Transition]:
    """How contact begins, by itself after an impact, and its release."""
    free, resting = modes.index(found.free), modes.index(guard.rests)
    begins = found.speed, -found.lift
    yield Transition("", "", free, found.gap, resting, found.states, begins=begins, guard=name)
    press = -found.lift.at(found.states)
    held = found.gap, found.speed
    yield Transition(name, "", resting, press, free, found.states, held=held, releases=True, leaves=True)
