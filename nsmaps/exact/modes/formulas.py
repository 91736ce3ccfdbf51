"""The formulas of a class of systems with modes, read as rows: what is not piecewise linear is refused."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import sympy as sp

from nsmaps.coordinates import Coordinates
from nsmaps.errors import SystemDefinitionError, near_match
from nsmaps.exact.flows.formulas import PHI, trials
from nsmaps.exact.modes.crossings import composed, crosses, divided
from nsmaps.exact.modes.definition import Definition, Row, Start, Transition

if TYPE_CHECKING:
    from nsmaps.exact.hybrid import Guard, HybridSystem, Section

CLOCK = sp.Symbol("_t", real=True)  #: the time in a system without forcing, in which no formula may depend on it
NEAR = 1e-12  #: of values of a formula that are the same, relative


@dataclass(frozen=True)
class Reader:
    """Reads the formulas of one class."""

    name: str
    parameters: frozenset[sp.Symbol]
    states: Mapping[str, sp.Symbol]

    def expression(self, given: Any, what: str) -> sp.Expr:
        """A formula in sympy with known symbols, or a SystemDefinitionError with the reason."""
        try:
            expr = sp.sympify(given, strict=True)
        except sp.SympifyError:
            raise SystemDefinitionError(f"{what} is {given!r:.60}; expected: a formula of sympy or a number") from None
        unknown = expr.free_symbols - self.parameters - set(self.states.values()) - {PHI}
        if CLOCK in unknown:
            raise SystemDefinitionError(
                f"{what} depends on the time, and {self.name} has no `period`; expected: one, or a state of rate 1 as a clock"
            )
        if unknown:
            raise SystemDefinitionError(f"{what} has the unknown symbols {', '.join(sorted(map(str, unknown)))}")
        return expr

    def row(self, given: Any, what: str) -> Row:
        """A formula as a row, or a SystemDefinitionError with the reason."""
        expr = self.expression(given, what)
        row = self.affine(expr)
        if row is None:
            raise SystemDefinitionError(
                f"{what} is {shown(expr)}; expected: affine in the states, with coefficients free of the time"
            )
        return row

    def affine(self, expr: sp.Expr) -> Row | None:
        """A formula as a row, None where it is not affine in the states with coefficients that are free of the time."""
        coefficients = tuple(sp.diff(expr, y) for y in self.states.values())
        if any(c.free_symbols & {*self.states.values(), PHI} for c in coefficients):
            return None
        return Row(coefficients, sp.expand(expr.subs(dict.fromkeys(self.states.values(), 0))))

    def same(self, state: str) -> Row:
        """The row of a state itself."""
        return Row(tuple(sp.S.One if name == state else sp.S.Zero for name in self.states), sp.S.Zero)


def shown(expr: sp.Expr) -> str:
    """An expression in the author's names."""
    return str(expr).replace("_y_", "y.").replace("_p_", "")


def definition_of(system: "HybridSystem") -> Definition:
    """The formulas of a system's class with symbols for its parameters.

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
    reader = Reader(cls.__name__, frozenset(symbols.values()), {name: sp.Symbol(f"_y_{name}", real=True) for name in cls.states})
    y = SimpleNamespace(**reader.states)
    modes = symbolic.modes(t, y)
    rates = tuple(_rates(reader, mode, given) for mode, given in modes.items())
    guards, section = symbolic.guards(t, y), symbolic.section(t, y)
    events = tuple(_transitions(reader, tuple(modes), guards))
    transitions, parts = divided(cls.__name__, events, len(modes))
    coordinates = _coordinates(cls.__name__, cls.states, section, period is not None)
    starts = _starts(reader, section, guards, transitions)
    if period is not None and not coordinates.angles.any():
        _check_phase_zero(reader, transitions, starts)
    after = section.side == "after" and not all(crosses(transitions[start.transition]) for start in starts)
    if after and len(starts) > 1:
        raise SystemDefinitionError(f"{cls.__name__}.section has several events; expected: one, or side='before'")
    horizon = sp.sympify(cls.horizon) * (sp.S.One if period is None else sp.sympify(period))
    variables = tuple(reader.states.values())
    return Definition(
        tuple(symbols.values()), cls.states, variables, rate, horizon, tuple(tuple(modes)[k] for k in parts),
        tuple(rates[k] for k in parts), transitions, coordinates, after, starts,
    )  # fmt: skip


def _rates(reader: Reader, mode: str, given: Mapping[str, Any]) -> tuple[Row, ...]:
    names = ", ".join(reader.states)
    if set(given) != set(reader.states):
        there = ", ".join(given) or "nothing"
        raise SystemDefinitionError(f"{reader.name}.modes has in mode {mode!r} the rates of {there}; expected: of {names}")
    what = f"{reader.name}.modes: in mode {mode!r} the rate of"
    return tuple(reader.row(given[state], f"{what} {state}") for state in reader.states)


def _transitions(reader: Reader, modes: tuple[str, ...], guards: "Mapping[str, Guard]") -> Iterator[Transition]:
    for name, guard in guards.items():
        what = f"{reader.name}.guards: {name!r}"
        watched = (guard.modes,) if isinstance(guard.modes, str) else tuple(guard.modes)
        _one_of(f"{what} names the mode", [*watched, *([guard.to] if guard.to else [])], modes)
        _one_of(f"{what} resets", guard.reset, tuple(reader.states))
        function = reader.row(guard.function, f"the function of {what}")
        where = tuple(reader.row(one, f"a condition of {what}") for one in guard.where)
        reset, curved = _reset(reader, guard, what)
        letter = name[0] if guard.letter is None else guard.letter
        for mode in watched:
            target = -1 if guard.ends else modes.index(guard.to or mode)
            yield Transition(name, letter, modes.index(mode), function, target, reset, where, curved)


def _reset(reader: Reader, guard: "Guard", what: str) -> tuple[tuple[Row, ...], tuple[tuple[int, sp.Expr], ...]]:
    """The states just after an event as rows, the state itself where it is another formula, and these formulas."""
    rows, curved = [], []
    for k, state in enumerate(reader.states):
        expr = reader.expression(guard.reset.get(state, reader.states[state]), f"the reset of {state} by {what}")
        row = reader.affine(expr)
        rows.append(row or reader.same(state))
        if row is None:
            _check_periodic(expr, f"the reset of {state} by {what}")
            curved.append((k, expr))
    return tuple(rows), tuple(curved)


def _check_phase_zero(reader: Reader, transitions: Sequence[Transition], starts: Sequence[Start]) -> None:
    """Refuse a section without a phase among its coordinates whose event is at another phase than zero."""
    for start in starts:
        one = transitions[start.transition]
        rest = composed(one.function, start.states)
        for expr in (*rest.coefficients, rest.remainder.subs(PHI, 0)):
            if any(abs(sp.N(expr.subs(values), 30)) > NEAR for values in trials(expr)):
                raise SystemDefinitionError(
                    f"{reader.name}.section has no phase among its coordinates, and the function of {one.name!r} is not zero "
                    "at t = 0; expected: a name for the phase in `coordinates`, or an event at t = 0, such as -sin(w t)"
                )


def _check_periodic(expr: sp.Expr, what: str) -> None:
    """Refuse a formula that is not the same one turn of the phase later."""
    later = expr.subs(PHI, PHI + 2 * sp.pi)
    for values in trials(expr) if expr.has(PHI) else ():
        first, second = (sp.N(one.subs(values), 30) for one in (expr, later))
        if first.is_finite and abs(first - second) > NEAR * (1 + abs(first)):
            raise SystemDefinitionError(f"{what} is {shown(expr)}, which is not the same after one `period` of the forcing")


def _one_of(what: str, names: Iterable[str], known: tuple[str, ...]) -> None:
    for name in names:
        if name not in known:
            raise SystemDefinitionError(f"{what} {name!r}; expected: one of {', '.join(known)}{near_match(name, known)}")


def _coordinates(name: str, states: tuple[str, ...], section: "Section", forced: bool) -> Coordinates:
    others = [each for each in section.coordinates if each not in states]
    if len(others) > forced or not section.coordinates:
        wanted = f"names of the states {', '.join(states)}" + ", and of one phase" * forced
        raise SystemDefinitionError(f"{name}.section has the coordinates {', '.join(section.coordinates)}; expected: {wanted}")
    return Coordinates(tuple(section.coordinates), angles=others)


def _starts(
    reader: Reader, section: "Section", guards: "Mapping[str, Guard]", transitions: Sequence[Transition]
) -> tuple[Start, ...]:
    """What the coordinates give at each event of the section."""
    names = (section.guards,) if isinstance(section.guards, str) else tuple(section.guards)
    if unknown := [name for name in names if name not in guards]:
        raise SystemDefinitionError(f"{reader.name}.section is at {unknown[0]!r}; expected: one of {', '.join(guards)}")
    return tuple(_start(reader, section, k, one) for k, one in enumerate(transitions) if one.name in names)


def _start(reader: Reader, section: "Section", number: int, transition: Transition) -> Start:
    """The states by the coordinates: themselves, as given, or the one that is left by the guard's zero."""
    rows = {state: reader.same(state) for state in reader.states if state in section.coordinates}
    rows |= {state: reader.row(given, f"{reader.name}.section: {state}") for state, given in section.states.items()}
    left = [state for state in reader.states if state not in rows]
    if len(left) > 1:
        raise SystemDefinitionError(
            f"{reader.name}.section leaves {' and '.join(left)} open; expected: all states but one in `coordinates` or `states`"
        )
    if left:
        rows[left[0]] = _solved(reader, transition, left[0], rows)
    return Start(number, tuple(rows[state] for state in reader.states))


def _solved(reader: Reader, transition: Transition, state: str, rows: Mapping[str, Row]) -> Row:
    """The state for which the function of a guard is zero."""
    function, names = transition.function, list(reader.states)
    own = function.coefficients[names.index(state)]
    if own == 0:
        raise SystemDefinitionError(
            f"{reader.name}.section: the guard {transition.name!r} does not depend on {state}; expected: {state} in `states`"
        )
    total = Row(tuple(sp.S.Zero for _ in names), function.remainder)
    for k, name in enumerate(names):
        if name != state:
            total = total + rows[name].scaled(function.coefficients[k])
    return total.scaled(-1 / own)
