"""A system as a certificate states it: linear flights under a harmonic force, walls and a restitution, read from its formulas."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import sympy as sp

from nsmaps.errors import ProofError
from nsmaps.exact.flows.formulas import PHI, S, V, W, Z, is_linear
from nsmaps.exact.flows.source import displacement_of, law_of, period_of, walls_of
from nsmaps.exact.returnmap import NO_CLOSED_FORM, ReturnMap
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.proof.arrivals import PAD, Flow

if TYPE_CHECKING:
    from nsmaps.exact.systems.piecewise import PiecewiseMap
    from nsmaps.exact.systems.system import ImpactSystem
    from nsmaps.verify.formula import System

DIGITS = 50
NEGLIGIBLE = 1e-35
RADIUS = 2.0**-50  #: of a number relative to it: it holds the decimal, the double and a double computed in a few steps

Entry = list[Any]


def provable(system: Any) -> "ImpactSystem | PiecewiseMap":
    """A system of a class whose return maps proofs follow.

    Raises:
        ProofError: a system with modes, one without flights in closed form, or another map.
    """
    obstacle = system.obstacle() if isinstance(system, ReturnMap) else NO_CLOSED_FORM
    if not obstacle:
        return cast("ImpactSystem | PiecewiseMap", system)
    raise ProofError(
        f"{type(system).__name__} {obstacle}, and no proofs are made of such; expected: a PiecewiseMap, or an ImpactSystem whose "
        "`displacement` solves z'' = -b z' - k z + g + F cos(w t) + S sin(w t) (where flights between impacts are of this kind, "
        "write it as one)"
    )


def equation_of(system: "ImpactSystem", radii: Mapping[str, float] | None = None) -> dict[str, Any]:
    """The numbers of z'' = -b z' - k z + g + F cos(w t) + S sin(w t), of walls and restitution, each a decimal and a radius.

    Args:
        radii: of parameters on which walls alone depend, for a certificate of an interval of them.

    Raises:
        ProofError: the system is not of this kind; states in which respect.
    """
    if not isinstance(provable(system), FlowSystem):
        raise ProofError(f"{type(system).__name__} is a map by formulas, which has no equation of motion")
    middle = _numbers(system, {})
    for name, radius in (radii or {}).items():
        _widen(system, middle, name, radius)
    return middle


def _widen(system: "ImpactSystem", middle: dict[str, Any], name: str, radius: float) -> None:
    """Widen the balls of walls by those of all values of a parameter within a radius."""
    expected = (
        f"expected: a radius above zero of a parameter that walls alone depend on, of {', '.join(type(system).parameter_names())}"
    )
    if name not in type(system).parameter_names() or not radius > 0:
        raise ProofError(f"the radius of {name!r} is {radius}; {expected}")
    low, high = ends = [_numbers(system, {name: sign * radius}) for sign in (-1, 1)]
    if any({**each, "walls": ()} != {**middle, "walls": ()} for each in ends):
        raise ProofError(
            f"{name!r} is part of the equation of motion or of the restitution of {type(system).__name__}; {expected}"
        )
    for wall, *others in zip(middle["walls"], low["walls"], high["walls"], strict=True):
        at, below, above = (float(each["at"][0]) for each in (wall, *others))
        if abs(below + above - 2 * at) > 8 * RADIUS * max(abs(at), abs(below), abs(above)):
            raise ProofError(f"the place of wall {wall['letter']!r} is not linear in {name!r}; {expected}, linearly")
        wall["at"][1] = repr(float(wall["at"][1]) + max(abs(below - at), abs(above - at)) * (1 + RADIUS))


def _numbers(system: "ImpactSystem", shifts: Mapping[str, float]) -> dict[str, Any]:
    """The numbers at the parameters of a system, some of them shifted."""
    cls = type(system)
    given = {name: getattr(system, name) for name in cls.model_fields}
    exact = {name: sp.Rational(repr(given[name])) + sp.Rational(repr(shifts.get(name, 0.0))) for name in cls.parameter_names()}
    at = cls.model_construct(**{**given, **exact})
    period = period_of(at)
    start = PHI * period / (2 * sp.pi)
    flight = displacement_of(at, start + S, start, Z, W)
    push = sp.diff(flight, S, 2).subs(S, 0)
    b, k = -_constant(system, sp.diff(push, W)), -_constant(system, sp.diff(push, Z))
    force = push.subs({Z: 0, W: 0})
    there, across, back = (_digits(force.subs(PHI, x)) for x in (0, sp.pi / 2, sp.pi))
    g, cosine = (there + back) / 2, (there - back) / 2
    sine = across - g
    for phase in (sp.Rational(1, 3), sp.Rational(11, 5), sp.Rational(27, 5)):
        remainder = _digits((force - cosine * sp.cos(PHI) - sine * sp.sin(PHI)).subs(PHI, phase)) - g
        if abs(remainder) > NEGLIGIBLE * (1 + abs(there)):
            raise ProofError(
                f"the force of {cls.__name__} is not g + F cos(w t) + S sin(w t): {sp.N(remainder, 5)} is left at phase {phase}"
            )
    _check_flight(cls.__name__, flight, (b, k, g, cosine, sine), 2 * sp.pi / period)
    turns = sp.simplify(2 / period)  # the frequency over pi
    power = 0 if turns.has(sp.pi) else 1
    walls = walls_of(at)
    laws = {letter: law_of(at, V, letter) for letter in walls}
    if len(set(laws.values())) > 1 or not is_linear(next(iter(laws.values()))):
        raise ProofError(f"impacts of {cls.__name__} are not left with a constant share of their speed, the same for all walls")
    restitution = next(iter(laws.values())).subs(V, 1)
    return {
        "damping": _entry(b),
        "stiffness": _entry(k),
        "force": _entry(g),
        "cosine": _entry(cosine),
        "sine": _entry(sine),
        "frequency": [*_entry(turns * sp.pi ** (1 - power)), power],
        "restitution": _entry(restitution),
        "walls": [{"letter": letter, "at": _entry(wall.at), "side": wall.side} for letter, wall in walls.items()],
    }


def _check_flight(name: str, flight: sp.Expr, numbers: tuple[Any, ...], frequency: Any) -> None:
    """Refuse a displacement that does not solve the equation at all times of flights, as it does where they begin."""
    b, k, g, cosine, sine = numbers
    velocity, phase = sp.diff(flight, S), PHI + frequency * S
    terms = sp.diff(velocity, S), b * velocity, k * flight, -g, -cosine * sp.cos(phase), -sine * sp.sin(phase)
    for place in (1, 2, 3):
        values = {S: sp.Rational(place, 3) / frequency, PHI: sp.Rational(7 * place, 11), Z: sp.Rational(2, 1 + place), W: -place}
        parts = [_digits(term.subs(values)) for term in terms]
        if abs(sum(parts)) > NEGLIGIBLE * (1 + sum(map(abs, parts))):
            raise ProofError(
                f"the displacement of {name} does not solve z'' = -b z' - k z + g + F cos(w t) + S sin(w t) of the start of its "
                f"flights: {sp.N(sum(parts), 5)} is left after a time {sp.N(values[S], 5)}"
            )


def _constant(system: "ImpactSystem", coefficient: sp.Expr) -> sp.Expr:
    """A coefficient of the acceleration, which must not depend on the phase and the flight."""
    places = (
        (sp.Rational(1, 3), sp.Rational(11, 5), sp.Rational(27, 7)),
        (sp.Rational(17, 7), sp.Rational(-2, 3), sp.Rational(9, 11)),
    )
    values = [_digits(coefficient.subs(zip((PHI, Z, W), each, strict=True))) for each in places]
    if abs(values[0] - values[1]) > NEGLIGIBLE * (1 + abs(values[0])):
        raise ProofError(f"the acceleration of {type(system).__name__} is not linear with constant coefficients: {coefficient}")
    return values[0]


def _digits(value: sp.Expr) -> sp.Expr:
    """A number in decimals, zero where it cancels: what sympy leaves there has one bit, as then has all that it is added to."""
    number = sp.N(value, DIGITS)
    return sp.Integer(0) if abs(number) < NEGLIGIBLE else sp.Float(number, DIGITS)


def _entry(value: Any) -> Entry:
    """A number as a decimal and a radius; integers, and numbers below all rounding, are exact."""
    number = float(sp.N(value, DIGITS))
    if abs(sp.N(value, DIGITS) - round(number)) < NEGLIGIBLE:
        return [str(round(number)), "0"]
    return [repr(number), repr(abs(number) * RADIUS)]


def balls_of(equation: Mapping[str, Any]) -> "System":
    """The system of an equation as the verification reads it.

    Raises:
        ProofError: it cannot be verified, as with a negative damping, or walls that may touch.
    """
    from nsmaps.verify.formula import system_of  # needs python-flint, which reading a study does not

    try:
        return system_of(equation)
    except ValueError as error:
        raise ProofError(f"no proof is made: {error}") from error


def flow_of(system: "System", n: int, before: int, periods: int, speed: float) -> Flow:
    """Tables in floats of a system at n phases, for flights up to a number of periods and cells with speeds up to `speed`.

    Raises:
        ProofError: flights are not bounded, as at resonance.
    """
    from nsmaps.verify.formula import UnprovedError, tables_of

    try:
        tables = tables_of(system, n, before, periods, 1.02 * speed)  # above that of the verification, with strips
    except UnprovedError as error:
        raise ProofError(f"no cells are searched for: {error}") from error
    (a, da, fall), size = np.abs(tables.flights).max(0), tables.size
    pad = PAD * tables.unit * (size**2 * (1 + a + da) * (size + speed) + 1 + fall)
    b, k, g, r = tables.numbers.tolist()
    walls, gap, bounds = np.array([tables.places, tables.sides]), tables.gap * (1 + 1e-9), tables.bounds * (1 + 1e-9)
    return Flow(tables.phases, tables.flights, before, b, k, g, r, walls, tables.step, float(pad), gap, bounds)
