"""A system with modes in symbols: its rates, guards, resets and section as rows that are affine in the states.

The features of a row are the states, 1, and cosine and sine of the multiples of the phase of the forcing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import sympy as sp

from nsmaps.coordinates import Coordinates
from nsmaps.exact.modes.definitions.numbers import Numbers
from nsmaps.exact.modes.definitions.rows import Row
from nsmaps.exact.words import Alphabet


@dataclass(frozen=True)
class Transition:
    """One event in one mode."""

    name: str
    letter: str
    mode: int
    function: Row
    target: int  #: the mode that follows, -1 where the motion ends
    reset: tuple[Row, ...]  #: every state just after, by the states just before
    where: tuple[Row, ...] = ()
    curved: tuple[tuple[int, sp.Expr], ...] = ()  #: positions of states whose reset is another formula, and these
    held: tuple[Row, ...] = ()  #: functions of the states that are zero for as long as the mode lasts
    guard: str = ""  #: the guard after whose impacts contact may begin, for these impacts and for that beginning
    begins: tuple[Row, ...] = ()  #: where lasting contact begins: speed away from the surface, and pressure towards it
    releases: bool = False  #: whether lasting contact ends
    leaves: bool = False  #: whether sliding or lasting contact ends, as its own conditions no longer hold
    crossing: bool = False  #: whether the function may be negative in the mode

    def with_rows(self, change: Callable[[Row], Row]) -> Self:
        """The transition with its function and conditions changed, but not its reset."""
        where, held, begins = (tuple(map(change, rows)) for rows in (self.where, self.held, self.begins))
        return replace(self, function=change(self.function), where=where, held=held, begins=begins)


@dataclass(frozen=True)
class Start:
    """How coordinates of the section give the state: rows over the states that are coordinates."""

    transition: int
    states: tuple[Row, ...]
    curved: tuple[tuple[int, sp.Expr], ...] = ()  #: positions of states that are another formula of the coordinates, and these
    zeros: tuple[Row, ...] = ()  #: functions of the coordinates that are zero there, where these are more than needed
    surface: tuple[Row, ...] = ()  #: functions of the states that are zero there


@dataclass(frozen=True)
class Surface:
    """A surface between two modes along which motions slide."""

    name: str
    modes: tuple[str, str]  #: above and below
    rows: tuple[Row, ...]  #: its function, its rate above, and below with the other sign: both positive where it repels


@dataclass(frozen=True, eq=False)
class Definition:
    """All formulas of a system's class."""

    symbols: tuple[sp.Symbol, ...]  #: of the parameters
    states: tuple[str, ...]
    variables: tuple[sp.Symbol, ...]  #: of the states
    phase_rate: sp.Expr  #: radians of phase a unit of time, zero without forcing
    horizon: sp.Expr
    modes: tuple[str, ...]
    rates: tuple[tuple[Row, ...], ...]  #: of each mode, of each state
    transitions: tuple[Transition, ...]
    coordinates: Coordinates
    after: bool  #: whether start and image are taken just after the reset
    starts: tuple[Start, ...]
    below: tuple[int, ...]  #: of each mode: how many of the functions that are crossed there are below zero
    surfaces: tuple[Surface, ...] = ()
    clock: int = -1  #: the transition whose function gives the phase of the section where no coordinate does; -1 for phase zero
    derived: tuple[sp.Expr, ...] = ()  #: further states behind the own ones, as formulas of these, of the phase and of parameters
    smooth: tuple[tuple[sp.Expr, ...], ...] = ()  #: of each mode the rates of the own states in a nonlinear system, else ()
    derivatives: dict[tuple[int, int], Numbers] = field(default_factory=dict)
    blurred: dict[int, Numbers] = field(default_factory=dict)  #: see `facts`

    @property
    def columns(self) -> tuple[sp.Expr, ...]:
        """What the coefficients of rows multiply: the own states, and the formulas of those derived from them."""
        return (*self.variables, *self.derived)

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of words, in the order of the transitions."""
        return tuple(dict.fromkeys(one.letter for one in self.transitions if one.letter))

    @cached_property
    def alphabet(self) -> Alphabet:
        """What the letters stand for."""
        begins = [self.transitions[start.transition] for start in self.starts]
        section = tuple(dict.fromkeys(one.letter for one in begins))
        others = [one for one in self.transitions if one.letter not in section]
        moved = {one.letter for one in others if self.moves(one.function)}
        clocks = tuple(letter for letter in self.letters if letter not in (*section, *moved))
        strobe = not self.coordinates.angles.any() and not any(self.moves(one.function) for one in begins)
        names = {one.name for one in begins}
        shared = any(one.letter and one.letter in section and one.name not in names for one in self.transitions)
        return Alphabet(section, clocks, int(strobe), shared)

    def moves(self, row: Row) -> bool:
        """Whether a row depends on the states, not on the time alone."""
        return row.of(self.columns).has(*self.variables)

    @property
    def rows(self) -> Iterator[Row]:
        """All rows, in a fixed order: rates, then functions, resets and conditions of transitions, then starts and surfaces."""
        for mode in self.rates:
            yield from mode
        for one in self.transitions:
            yield from (one.function, *one.reset, *one.where, *one.begins, *one.held)
        for start in self.starts:
            yield from start.states
        for surface in self.surfaces:
            yield from surface.rows

    @cached_property
    def states_to_recompute(self) -> tuple[list[int], ...]:
        """For each transition the positions of the derived states that change if the own states do that its reset changes."""
        own, found = len(self.states), []
        for one in self.transitions:
            moving = {
                variable
                for k, (variable, row) in enumerate(zip(self.variables, one.reset[:own], strict=True))
                if k in dict(one.curved) or row.remainder != 0 or [*row.coefficients[:own]] != [int(j == k) for j in range(own)]
            }
            found.append([own + r for r, formula in enumerate(self.derived) if formula.free_symbols & moving])
        return tuple(found)

    @cached_property
    def expansions(self) -> Numbers:
        """What computes the rows, at values of the parameters."""
        return Numbers(tuple(self.rows), self.symbols)

    def facts(self, harmonics: int) -> Numbers:
        """What computes the rows to decide what is zero in them: with floats in formulas as balls, if there are any."""
        if harmonics not in self.blurred:
            rows = tuple(self.rows)
            floats = any(expr.has(sp.Float) for row in rows for expr in (*row.coefficients, row.remainder))
            self.blurred[harmonics] = Numbers(rows, self.symbols, harmonics, blurred=True) if floats else self.expansions
        return self.blurred[harmonics]

    @cached_property
    def scalars(self) -> Numbers:
        """What computes rate of the phase and horizon, as coefficients of a row, and their derivatives by each parameter."""
        pair = Row((self.phase_rate, self.horizon), sp.S.Zero)
        return Numbers([pair, *(pair.by(symbol) for symbol in self.symbols)], self.symbols)

    def derivative(self, number: int, harmonics: int) -> Numbers:
        """What computes the derivatives of the rows by a parameter, given by its position, with so many harmonics."""
        if (number, harmonics) not in self.derivatives:
            rows = [row.by(self.symbols[number]) for row in self.rows]
            self.derivatives[number, harmonics] = Numbers(rows, self.symbols, harmonics)
        return self.derivatives[number, harmonics]
