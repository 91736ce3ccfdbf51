"""A system with modes in symbols: its rates, guards, resets and section as rows that are affine in the states.

The features of a row are the states, 1, and cosine and sine of the multiples of the phase of the forcing.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import mpmath as mp
import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.errors import SystemDefinitionError, near_match
from nsmaps.exact.flows.exponentials import DIGITS, Expansion
from nsmaps.exact.flows.formulas import PHI

if TYPE_CHECKING:
    from nsmaps.exact.hybrid import Guard, HybridSystem, Section

CLOCK = sp.Symbol("_t", real=True)  #: the time in a system without forcing, in which no formula may depend on it


@dataclass(frozen=True)
class Row:
    """An expression that is affine in the states: their coefficients, and the remainder, which may depend on the phase."""

    coefficients: tuple[sp.Expr, ...]
    remainder: sp.Expr

    def by(self, parameter: sp.Symbol) -> "Row":
        """Its derivative by a parameter, at a fixed phase."""
        return Row(tuple(sp.diff(c, parameter) for c in self.coefficients), sp.diff(self.remainder, parameter))

    def scaled(self, factor: sp.Expr) -> "Row":
        """The row times a factor that is free of the states."""
        return Row(tuple(factor * c for c in self.coefficients), factor * self.remainder)

    def __add__(self, other: "Row") -> "Row":
        return Row(
            tuple(a + b for a, b in zip(self.coefficients, other.coefficients, strict=True)), self.remainder + other.remainder
        )


@dataclass(frozen=True)
class Transition:
    """One event in one mode."""

    name: str
    letter: str
    mode: int
    function: Row
    target: int  #: the mode that follows, -1 where the motion ends
    reset: tuple[Row, ...]  #: every state just after, by the states just before
    where: tuple[Row, ...]


@dataclass(frozen=True)
class Start:
    """How coordinates of the section give the state: rows over the states that are coordinates."""

    transition: int
    states: tuple[Row, ...]


@dataclass(frozen=True, eq=False)
class Definition:
    """All formulas of a system's class."""

    symbols: tuple[sp.Symbol, ...]  #: of the parameters
    states: tuple[str, ...]
    phase_rate: sp.Expr  #: radians of phase a unit of time, zero without forcing
    horizon: sp.Expr
    modes: tuple[str, ...]
    rates: tuple[tuple[Row, ...], ...]  #: of each mode, of each state
    transitions: tuple[Transition, ...]
    coordinates: Coordinates
    after: bool  #: whether start and image are taken just after the reset
    starts: tuple[Start, ...]
    derivatives: dict[int, "Numbers"] = field(default_factory=dict)

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of words, in the order of the transitions."""
        return tuple(dict.fromkeys(one.letter for one in self.transitions if one.letter))

    @property
    def rows(self) -> Iterator[Row]:
        """All rows, in a fixed order: rates, then functions, resets and conditions of transitions, then starts."""
        for mode in self.rates:
            yield from mode
        for one in self.transitions:
            yield from (one.function, *one.reset, *one.where)
        for start in self.starts:
            yield from start.states

    @cached_property
    def expansions(self) -> "Numbers":
        """What computes the rows, at values of the parameters."""
        return Numbers(list(self.rows), self.symbols)

    @cached_property
    def scalars(self) -> "Numbers":
        """What computes rate of the phase and horizon, as coefficients of a row, and their derivatives by each parameter."""
        pair = Row((self.phase_rate, self.horizon), sp.S.Zero)
        return Numbers([pair, *(pair.by(symbol) for symbol in self.symbols)], self.symbols)

    def derivative(self, number: int) -> "Numbers":
        """What computes the derivatives of the rows by a parameter, given by its position."""
        if number not in self.derivatives:
            self.derivatives[number] = Numbers([row.by(self.symbols[number]) for row in self.rows], self.symbols)
        return self.derivatives[number]


class Numbers:
    """Rows in numbers, computed in many digits."""

    def __init__(self, rows: list[Row], symbols: Sequence[sp.Symbol]) -> None:
        coefficients = [c for row in rows for c in row.coefficients]
        self.coefficients = sp.lambdify(symbols, coefficients, "mpmath", cse=True)
        self.inhomogeneous = [Expansion(row.remainder, tuple(symbols)) if row.remainder != 0 else None for row in rows]

    def at(self, values: Sequence[float]) -> list[tuple[list[Any], dict[int, Any]]]:
        """Of each row the coefficients of the states, and of exp(i m phi) by m."""
        with mp.workdps(DIGITS):
            known = list(self.coefficients(*map(mp.mpf, values)))
            n = len(known) // len(self.inhomogeneous)
            waves = [
                {} if remainder is None else {term.harmonic: x for term, x in remainder.at(list(values)).items()}
                for remainder in self.inhomogeneous
            ]
        return [(known[k * n : (k + 1) * n], wave) for k, wave in enumerate(waves)]


def filled(row: tuple[list[Any], dict[int, Any]], harmonics: int) -> Floats:
    """A row over the features in floats, shape (n + 1 + 2 harmonics,)."""
    known, waves = row
    n = len(known)
    values = np.zeros(n + 1 + 2 * harmonics)
    values[:n] = [float(mp.re(x)) for x in known]
    values[n] = float(mp.re(waves.get(0, mp.mpf(0))))
    for m in range(1, harmonics + 1):
        plus, minus = waves.get(m, mp.mpf(0)), waves.get(-m, mp.mpf(0))
        values[n + 2 * m - 1] = float(mp.re(plus + minus))
        values[n + 2 * m] = float(mp.re(mp.mpc(0, 1) * (plus - minus)))
    return values


@dataclass(frozen=True)
class Reader:
    """Reads the formulas of one class."""

    name: str
    parameters: frozenset[sp.Symbol]
    states: Mapping[str, sp.Symbol]

    def row(self, expr: Any, what: str) -> Row:
        """An expression as a row, or a SystemDefinitionError with the reason."""
        try:
            expr = sp.sympify(expr, strict=True)
        except sp.SympifyError:
            raise SystemDefinitionError(f"{what} is {expr!r:.60}; expected: a formula of sympy or a number") from None
        unknown = expr.free_symbols - self.parameters - set(self.states.values()) - {PHI}
        if CLOCK in unknown:
            raise SystemDefinitionError(
                f"{what} depends on the time, and {self.name} has no `period`; expected: one, or a state of rate 1 as a clock"
            )
        if unknown:
            raise SystemDefinitionError(f"{what} has the unknown symbols {', '.join(sorted(map(str, unknown)))}")
        coefficients = tuple(sp.diff(expr, y) for y in self.states.values())
        if any(c.free_symbols & {*self.states.values(), PHI} for c in coefficients):
            shown = str(expr).replace("_y_", "y.").replace("_p_", "")
            raise SystemDefinitionError(f"{what} is {shown}; expected: affine in the states, with coefficients free of the time")
        return Row(coefficients, sp.expand(expr.subs(dict.fromkeys(self.states.values(), 0))))

    def same(self, state: str) -> Row:
        """The row of a state itself."""
        return Row(tuple(sp.S.One if name == state else sp.S.Zero for name in self.states), sp.S.Zero)


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
    transitions = tuple(_transitions(reader, tuple(modes), guards))
    names = (section.guards,) if isinstance(section.guards, str) else tuple(section.guards)
    if unknown := [name for name in names if name not in guards]:
        raise SystemDefinitionError(f"{cls.__name__}.section is at {unknown[0]!r}; expected: one of {', '.join(guards)}")
    coordinates = _coordinates(cls.__name__, cls.states, section, period is not None)
    starts = tuple(_start(reader, section, k, one) for k, one in enumerate(transitions) if one.name in names)
    if section.side == "after" and len(starts) > 1:
        raise SystemDefinitionError(f"{cls.__name__}.section has several events; expected: one, or side='before'")
    horizon = sp.sympify(cls.horizon) * (sp.S.One if period is None else sp.sympify(period))
    return Definition(
        tuple(symbols.values()), cls.states, rate, horizon, tuple(modes), rates, transitions, coordinates,
        section.side == "after", starts,
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
        reset = tuple(
            reader.row(guard.reset[state], f"the reset of {state} by {what}") if state in guard.reset else reader.same(state)
            for state in reader.states
        )
        letter = name[0] if guard.letter is None else guard.letter
        for mode in watched:
            target = -1 if guard.ends else modes.index(guard.to or mode)
            yield Transition(name, letter, modes.index(mode), function, target, reset, where)


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
