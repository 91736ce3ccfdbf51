"""A system's formulas as written: called with numbers or symbols; errors state class, formula, file and line."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from inspect import signature
from types import SimpleNamespace
from typing import Any

import sympy as sp

from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.systems.files import place_of
from nsmaps.exact.systems.walls import ImpactFormulas, Wall

# what can be written in place of a formula that is refused: sentences that end its message
DELAY = "a delay is out of scope: the state of such a system is a function, which finitely many coordinates do not give"
FORCING = (
    "a second forcing of frequency w is two states p, q of a `HybridSystem` with the rates p' = -w*q and q' = w*p, and a decay a "
    "state with e' = -k*e"
)
PHASE_LAW = "a restitution that depends on the phase is the `reset` of a `Guard` in a `HybridSystem`"
FRICTION = (
    "friction in contact is a `SlidingSurface` between two modes of `rests`, one for each direction, and an impact that leads to "
    "another mode a `Guard` of its own with `where`"
)
NOT_NUMBERS = "use sympy's functions (from sympy import cos), not those of math or numpy, and no float() or int()"
ADVICE = {  #: by the message of Python's error in a formula
    "truth value": "formulas may not branch on the value of a parameter or of the flight; a choice is a field of another type",
    "Cannot convert": NOT_NUMBERS,
    "ufunc": NOT_NUMBERS,
    "object is not callable": f"a state and a parameter are not functions; {DELAY}",
}
GIVEN = {
    "walls": "",
    "period": "",
    "displacement": ", t, hit",
    "acceleration": ", t, place, velocity",
    "rebound": ", speed, wall",
}  #: arguments of each formula
HIT = "the arguments are hit.t, hit.z and hit.w: time, place and velocity just after the impact"
STILL = (
    "walls may not move: measure the displacement relative to a moving wall (two walls move together or not at all); "
    "`at` is a formula in the parameters"
)
SURE = (TypeError, sp.SympifyError)  #: errors of a formula that no later definition can correct


class PrematureFormulaError(SystemDefinitionError):
    """A formula that fails for a reason that may disappear before its first use, such as a name that is defined further down."""


def periods_of(system: ImpactFormulas) -> sp.Rational:
    """The horizon of a class, in periods, as it is. Raises SystemDefinitionError unless it is a positive number."""
    horizon = system.horizon
    if not 0 < horizon < float("inf"):
        raise SystemDefinitionError(f"{type(system).__name__}.horizon is {horizon}; expected: a positive number of periods")
    return sp.Rational(horizon)


def walls_of(system: ImpactFormulas) -> dict[str, Wall]:
    """The walls of a system by their letters, with places as sympy expressions in its parameters.

    Raises:
        SystemDefinitionError: they are not walls, more than one on a side, moving, or have letters that words cannot distinguish.
    """
    table = _call(system, "walls")
    with _with_location(system, "walls"):
        _check_table(table)
        places = {letter: _place(system, letter, wall.at) for letter, wall in table.items()}
    return {letter: type(wall)(places[letter], wall.side) for letter, wall in table.items()}


def period_of(system: ImpactFormulas) -> sp.Expr:
    """The period of a system's forcing. Raises SystemDefinitionError for a value that is not an expression."""
    return _expression(system, "period")


def law_of(system: ImpactFormulas, speed: Any, wall: str) -> sp.Expr:
    """The speed just after an impact on a wall. Raises SystemDefinitionError for a value that is not an expression."""
    return _expression(system, "rebound", speed, wall)


def displacement_of(system: ImpactFormulas, t: Any, start: Any, place: Any, velocity: Any) -> sp.Expr:
    """The displacement at t after an impact, by its time, place and velocity. Raises as `period_of` does."""
    return _expression(system, "displacement", t, SimpleNamespace(t=start, z=place, w=velocity))


def acceleration_of(system: ImpactFormulas, t: Any, place: Any, velocity: Any) -> sp.Expr:
    """The acceleration of the ball between impacts. Raises as `period_of` does."""
    return _expression(system, "acceleration", t, place, velocity)


def _expression(system: ImpactFormulas, formula: str, *given: Any) -> sp.Expr:
    value = _call(system, formula, *given)
    with _with_location(system, formula):
        return _number(value, "is")


def _number(value: Any, what: str) -> sp.Expr:
    """A value as a sympy expression; text is refused."""
    try:
        expr = sp.sympify(value, strict=True)
    except sp.SympifyError:
        expr = None
    if not isinstance(expr, sp.Expr):
        raise SystemDefinitionError(f"{what} {value!r:.60}; expected: a number or a formula of sympy")
    return expr


def _call(system: ImpactFormulas, formula: str, *given: Any) -> Any:
    """The result of a formula. Every error is reported with the system's class and the place where the formula is written."""
    name, function = f"{type(system).__name__}.{formula}", getattr(system, formula)
    if not callable(function):
        method = f"a method {formula}(self{GIVEN[formula]})"
        raise SystemDefinitionError(f"{name} is {function!r:.60}; expected: {method}{place_of(type(system), formula)}")
    try:
        arguments = signature(function)
        arguments.bind(*given)
    except TypeError:
        still = {"walls": f"; {STILL}", "rebound": f"; {PHASE_LAW}"}.get(formula, "")
        taken = f"is called with (self{GIVEN[formula]})"
        raise SystemDefinitionError(f"{name} {taken}, which it does not take{still}{place_of(type(system), formula)}") from None
    try:
        return function(*given)
    except NsmapsError:
        raise
    except Exception as error:
        why = f"{type(error).__name__}: {error}".replace("_p_", "")
        on_hit = isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace)
        advice = HIT if on_hit else next((advice for sign, advice in ADVICE.items() if sign in why), "")
        kind = SystemDefinitionError if on_hit or isinstance(error, SURE) else PrematureFormulaError
        message = f"{name} cannot be written in symbols ({why}){advice and f'; {advice}'}"
        raise kind(f"{message}{place_of(type(system), formula)}") from error


@contextmanager
def _with_location(system: ImpactFormulas, formula: str) -> Iterator[None]:
    """State the class and the formula of an error, and where the formula is written."""
    try:
        yield
    except SystemDefinitionError as error:
        raise SystemDefinitionError(f"{type(system).__name__}.{formula} {error}{place_of(type(system), formula)}") from None


def _check_table(table: Any) -> None:
    """Refuse walls that are invalid, more than one on a side, or have letters that words cannot distinguish."""
    if not isinstance(table, Mapping) or not all(isinstance(wall, Wall) for wall in table.values()):
        raise SystemDefinitionError(f"is {table!r:.60}; expected: walls by their letters, such as {{'B': Wall(at=0, side=-1)}}")
    if not table:
        raise SystemDefinitionError("has no walls; expected: at least the base wall")
    if (base := next(iter(table))) and table[base].ends:
        raise SystemDefinitionError(
            f"ends motions at the base wall {base!r}; expected: a base wall after whose impacts they continue"
        )
    sides = [wall.side for wall in table.values()]
    if not set(sides) <= {-1, 1} or len(sides) != len(set(sides)):
        raise SystemDefinitionError(
            f"has walls on sides {sides}; expected: one or two walls, on different sides "
            "(-1 stops falling displacement, +1 growing)"
        )
    letters = list(table)
    if not all(isinstance(name, str) and name and name[:1] not in ("~", "_", ".") for name in letters) or (
        len({name[:1] for name in letters}) < len(letters)
    ):
        raise SystemDefinitionError(f"names its walls {letters}; expected: different first letters, none of them ~ _ .")


def _place(system: ImpactFormulas, letter: str, at: Any) -> sp.Expr:
    """The place of a wall, which does not move."""
    if callable(at) and not isinstance(at, sp.Basic):
        raise SystemDefinitionError(f"has its wall {letter} at a function, {at!r:.60}; {STILL}")
    place = _number(at, f"has its wall {letter} at")
    known = {x for x in vars(system).values() if isinstance(x, sp.Symbol)}
    if unknown := sorted(map(str, place.free_symbols - known)):
        there = f"at {sp.sstr(place).replace('_p_', '')}, with the unknown symbols: {', '.join(unknown)}"
        raise SystemDefinitionError(f"has its wall {letter} {there}; {STILL}")
    if place.is_finite is False or place.is_real is False:
        raise SystemDefinitionError(f"has its wall {letter} at {place}; expected: a finite place; a wall at infinity is omitted")
    return place
