"""From the sum of exponentials of a flight to the table of the engine: rates, coefficients, walls and impact laws in numbers."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.engine.flight import layout as at
from nsmaps.exact.flows.balls import Recorded
from nsmaps.exact.flows.exponentials import Decomposition
from nsmaps.exact.flows.formulas import (
    PHI,
    S,
    V,
    Z,
    check_flight,
    check_symbols,
    checked_acceleration,
    displacement_at,
    in_symbols,
    is_linear,
)
from nsmaps.exact.flows.laws import law_address
from nsmaps.exact.flows.rates import table_of_flight
from nsmaps.exact.flows.source import law_of, period_of, periods_of, walls_of
from nsmaps.exact.systems.files import check_period, place_of
from nsmaps.exact.systems.parameters import choices_of
from nsmaps.exact.systems.walls import ImpactFormulas

FLIGHTS = 4096  #: number of flights that are remembered, about 1 kB each


class Scalars(NamedTuple):
    """Formulas of numbers of a system, or their derivatives by its parameters."""

    top: sp.Expr  #: place of the upper wall; of the base wall where there is none
    bottom: sp.Expr  #: place of the lower wall
    phase_rate: sp.Expr  #: radians of phase a unit of time
    horizon: sp.Expr  #: longest flight, in the system's time


class Sides(NamedTuple):
    """The walls that there are."""

    has_upper: bool
    has_lower: bool
    base_is_upper: bool


@dataclass(frozen=True, eq=False)
class Formulas:
    """The formulas of a system's class, or their derivatives by its parameters, from which tables are computed."""

    symbols: tuple[sp.Symbol, ...]  #: of the parameters, followed for derivatives by their rates of change
    displacement: sp.Expr
    numbers: Scalars
    laws: tuple[sp.Expr, sp.Expr]  #: speeds after impacts of the speed V on the lower wall and on the upper
    sides: Sides
    acceleration: sp.Expr | None = None  #: by S (the time), Z and W, of flights without a closed form, whose displacement is zero

    @cached_property
    def scalars(self) -> Recorded:
        """The numbers, then the factors of linear laws."""
        factors = [sp.diff(law, V) if is_linear(law) else sp.S.Zero for law in self.laws]
        return Recorded(self.symbols, lambda program: (list(map(program.number, [*self.numbers, *factors])), None))

    @cached_property
    def flights(self) -> Recorded:
        """The tables without walls, laws and parameters, see `table_of_flight`."""
        count = len(self.symbols)
        return Recorded(
            self.symbols, lambda program: table_of_flight(program, Decomposition(program).sum(self.displacement), count)
        )

    @cached_property
    def curved(self) -> list[tuple[int, sp.Expr]]:
        """Laws that are not linear and their derivatives, each with its place in the table."""
        laws = [(k, law) for k, law in enumerate(self.laws) if not is_linear(law)]
        return [(at.LAW + k, law) for k, law in laws] + [(at.LAW_SLOPE + k, sp.diff(law, V)) for k, law in laws]

    @cached_property
    def force(self) -> sp.Expr:
        """The acceleration at the phase PHI, the place Z and the velocity W."""
        if self.acceleration is None:
            return sp.diff(self.displacement, S, 2).subs(S, 0)
        return self.acceleration.subs(S, PHI / self.numbers.phase_rate)

    @cached_property
    def in_displacement(self) -> list[bool]:
        """Whether the flight depends on each parameter; walls and laws may depend on the others."""
        return [symbol in self.displacement.free_symbols for symbol in self.symbols]

    def table(self, values: list[float]) -> Floats:
        """The table at these values of the parameters, shape (M,)."""
        used = tuple(x if counts else 0.0 for x, counts in zip(values, self.in_displacement, strict=True))
        table = _flight(self, used).copy()
        numbers, _ = self.scalars.floats(values)
        begin = int(table[at.AT_PARAMETERS])
        table[begin : begin + len(values)] = values
        scalars, factors = np.split(numbers, [len(self.numbers)])
        table[[at.TOP, at.BOTTOM, at.PHASE_RATE, at.HORIZON]] = scalars
        table[at.RESTITUTION : at.LAW] = factors
        table[[at.HAS_UP, at.HAS_DOWN, at.BASE_UP]] = self.sides
        for place, law in self.curved:
            table[place] = law_address(law, V, self.symbols)
        return table


@lru_cache(maxsize=FLIGHTS)
def _flight(formulas: Formulas, values: tuple[float, ...]) -> Floats:
    """The table without walls, laws and parameters, at values of the parameters on which flights depend, 0 for the others."""
    found, (head, count, reach) = formulas.flights.floats(values)
    table = head.copy()
    table[at.HEAD : at.HEAD + count] = found[:count]
    table[at.REACH] = reach / found[count:].max(initial=0.0) if len(found) > count else reach
    return table


@lru_cache(maxsize=64)
def along(formulas: Formulas, names: tuple[str, ...]) -> Formulas:
    """The derivatives of all formulas along a direction; the rates of change of the parameters follow them as parameters."""
    rates = tuple(sp.Symbol(f"_way_{name}", real=True) for name in names)

    def tangent(expr: sp.Expr) -> sp.Expr:
        return sp.Add(*(rate * sp.diff(expr, symbol) for symbol, rate in zip(formulas.symbols, rates, strict=True)))

    symbols, displacement = formulas.symbols + rates, tangent(formulas.displacement)
    lower, upper = map(tangent, formulas.laws)
    return Formulas(symbols, displacement, Scalars(*map(tangent, formulas.numbers)), (lower, upper), formulas.sides)


def formulas_of(system: ImpactFormulas) -> Formulas:
    """The formulas of a system's class and of its fields that are not numbers; they are checked on first use.

    Raises:
        SystemDefinitionError: the formulas cannot become a flight whose rates have bounds; states which and why.
    """
    cls, fixed = type(system), choices_of(system)
    key = *cls.definition_key(), *sorted((name, repr(value)) for name, value in fixed.items())
    if key not in KNOWN:
        with refuse_errors(cls):
            KNOWN[key] = _formulas(cls, fixed)
    return KNOWN[key]


@contextmanager
def refuse_errors(cls: type[ImpactFormulas]) -> Iterator[None]:
    """Refuse a class by a SystemDefinitionError that states where its flight is written, whatever fails in its formulas."""
    try:
        yield
    except SystemDefinitionError:
        raise
    except Exception as error:  # errors of sympy in formulas of an unforeseen form
        why, place = f"{type(error).__name__}: {error}", place_of(cls, cls.flight())
        raise SystemDefinitionError(f"the formulas of {cls.__name__} cannot be turned into a flow ({why}){place}") from error


def table_of(system: ImpactFormulas) -> Floats:
    """The table of a system for its parameters. Raises as `formulas_of` does."""
    formulas, cls = formulas_of(system), type(system)
    with refuse_errors(cls):
        try:
            return formulas.table(list(system.parameters.values()))
        except SystemDefinitionError as error:
            place = place_of(cls, "displacement")
            raise SystemDefinitionError(f"{cls.__name__}.displacement cannot be a flight: {error}{place}") from error


KNOWN: dict[Any, Formulas] = {}  #: by class, its fields that are not numbers, and its formulas


def _formulas(cls: type[ImpactFormulas], fixed: dict[str, Any]) -> Formulas:
    symbolic, symbols = in_symbols(cls, fixed)
    period = period_of(symbolic)
    check_period(cls, period)
    given, acceleration, walls = sp.S.Zero, None, walls_of(symbolic)
    try:
        if cls.flight() == "acceleration":
            acceleration = checked_acceleration(symbolic, period, symbols)
        else:
            given = displacement_at(symbolic, period) - Z
            check_flight(cls.__name__, given + Z, period, symbols)
    except SystemDefinitionError as error:
        place = place_of(cls, cls.flight())
        raise SystemDefinitionError(f"{str(error).removesuffix(place)}{place}") from error
    base, *_ = walls
    names = [next((name for name, wall in walls.items() if wall.side == side), base) for side in (1, -1)]
    (top, bottom), (upper, lower) = ([walls[name].at for name in names], [law_of(symbolic, V, name) for name in names])
    check_symbols(cls.__name__, [top, bottom, upper, lower, period], set(symbols.values()))
    numbers = Scalars(top, bottom, 2 * sp.pi / period, periods_of(symbolic) * period)
    sides = [wall.side for wall in walls.values()]
    order = Sides(1 in sides, -1 in sides, walls[base].side == 1)
    return Formulas(tuple(symbols.values()), given, numbers, (lower, upper), order, acceleration)
