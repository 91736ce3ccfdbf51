"""What an impact system's formulas say by themselves, in numbers of 30 digits, without the compiled map."""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import mpmath as mp
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.errors import CheckError, check_known
from nsmaps.exact.flows.formulas import in_symbols
from nsmaps.exact.flows.source import FORCING, acceleration_of, displacement_of, law_of, period_of, walls_of
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System, choices_of
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.testing.integrated import integrated_flight

AnySystem = TypeVar("AnySystem", bound=System)
Acceleration = Callable[[Any, Any, Any], Any]  #: of time, place and velocity

DIGITS = 30
MOTION = ("time", "displacement", "velocity")  #: quantities of a motion, which may have units
NEAR = 1e-9  #: relative, of what is the same: formulas may hold floats
SHORTER = range(2, 7)  #: shares of a period that are tried as periods
SLIPS = {"2 pi": 2 * mp.pi, "2": 2, "pi": mp.pi}  #: by which a period is often wrong
HUGE, FAR = 1e100, 100  #: what no power of time reaches; periods after which a flight is checked for escape
LOOKS = 40  #: places that are looked at in a period of such a flight
ROUND = (0.5, 1, 2, 7)  #: speeds at which an impact law is tried, in units of the system's own


@dataclass(frozen=True, slots=True)
class Flight:
    """A system's flight as functions of (t, t0, z, w): time, and time, place and velocity just after the impact."""

    name: str
    place: Callable[..., Any]
    velocity: Callable[..., Any]
    acceleration: Callable[..., Any]
    period: Any
    places: tuple[Any, ...]  #: of the walls

    def trials(self) -> Iterator[tuple[Any, Any, Any, Any]]:
        """A few flights: how long after the impact, and the impact's time, place and velocity."""
        size = abs(self.acceleration(mp.mpf(0), mp.mpf(0), self.places[0], mp.mpf(0))) * self.period or mp.mpf(1)
        for k, place in enumerate([*self.places, self.places[0] + size * self.period / 7]):
            share = mp.mpf(3 * k + 2) / 13
            yield self.period * (share + mp.mpf(1) / 9), self.period * share, mp.mpf(place), size * (k - mp.mpf(3) / 5)


def flight_of(system: ImpactSystem) -> Flight:
    """The flight of a system, with the values of its parameters put in only where numbers are asked for."""
    cls = type(system)
    places = tuple(mp.mpf(str(sp.N(wall.at, DIGITS))) for wall in walls_of(system).values())
    period = mp.mpf(str(sp.N(period_of(system), DIGITS)))
    if cls.flight() == "acceleration":
        return Flight(cls.__name__, *integrated_flight(system), period, places)
    symbolic, symbols = in_symbols(cls, choices_of(system))
    arguments = sp.symbols("t t0 z w", real=True)
    given = displacement_of(symbolic, *arguments)
    values = [mp.mpf(value) for value in system.parameters.values()]
    functions = [
        sp.lambdify((*arguments, *symbols.values()), expr, "mpmath", cse=True)
        for expr in (given, given.diff(arguments[0]), given.diff(arguments[0], 2))
    ]
    place, velocity, acceleration = (lambda *flight, f=f: mp.re(f(*flight, *values)) for f in functions)
    return Flight(cls.__name__, place, velocity, acceleration, period, places)


def check_description(system: System) -> None:
    """Warn where `nsmaps systems` would list no description."""
    cls = type(system)
    if not vars(cls).get("__doc__"):
        warnings.warn(f"{cls.__name__} has no docstring; say what moves, in which units, by which equation", stacklevel=3)
    if bare := [f"{cls.__name__}.{name}" for name, field in cls.model_fields.items() if not field.description]:
        warnings.warn(f"no description of {', '.join(bare)}; write it with its unit into `Field`", stacklevel=3)


def check_units(system: System) -> None:
    """Units of what the system has, each a text; none where it says that nothing has a unit."""
    states = system.states if isinstance(system, HybridSystem) else ()
    cls, known = type(system).__name__, list(dict.fromkeys([*system.coordinates, *states, *system.parameters, *MOTION]))
    for name, unit in system.units.items():
        check_known(f"{cls}.units has", name, known, CheckError)
        if not (isinstance(unit, str) and unit.strip()):
            raise CheckError(f"the unit of {name!r} in {cls}.units is {unit!r}; expected: a text such as 'm/s'")
    if system.dimensionless and system.units:
        raise CheckError(f"{cls} is dimensionless and names units; expected: one of both")


def check_setting(system: ImpactSystem) -> None:
    """Walls that are walls, in their order, and a period that is one."""
    name, walls, period = type(system).__name__, walls_of(system), period_of(system)
    places = {wall.side: (letter, wall.at) for letter, wall in walls.items()}
    if len(places) == 2 and not places[1][1] > places[-1][1]:
        raise CheckError(
            f"the walls of {name} leave no room: {places[1][0]}, which stops growing displacement, is at "
            f"{sp.N(places[1][1], 6)}, and {places[-1][0]}, which stops falling displacement, at {sp.N(places[-1][1], 6)}; "
            "expected: the first above the "
            "second, or their `side` the other way round"
        )
    if not (period.is_number and period.is_real and period.is_finite and period > 0):
        raise CheckError(f"the period of {name} is {period}; expected: a positive number")


def check_start(flight: Flight) -> None:
    """A flight starts at the place and with the velocity of its impact."""
    for _, *hit in flight.trials():
        for what, value, given in (
            ("place", flight.place(hit[0], *hit), hit[1]),
            ("velocity", flight.velocity(hit[0], *hit), hit[2]),
        ):
            if not _same(value, given):
                letter = "z" if what == "place" else "w"
                slip = ", but with the opposite sign" if _same(value, -given) else ""
                rate = "" if what == "place" else ", the rate of the displacement,"
                raise CheckError(
                    f"a flight of {flight.name} does not start with the {what} that it is given{slip}: just after an impact at "
                    f"{_hit(hit)} its {what}{rate} is {_short(value)}; expected: hit.{letter} = {_short(given)}. "
                    "A term has a wrong sign, is missing, or is not zero at hit.t"
                )


def check_period(flight: Flight) -> None:
    """A flight is the same one period later, and no sooner."""

    def repeats(period: Any) -> bool:
        return all(_later(flight, trial, period) for trial in flight.trials())

    if not repeats(flight.period):
        slips = {f"{text} times it": flight.period * by for text, by in SLIPS.items()}
        slips |= {f"it over {text}": flight.period / by for text, by in SLIPS.items()}
        fits = [f"{text}, {_short(period)}, would do" for text, period in slips.items() if repeats(period)]
        raise CheckError(
            f"the period of {flight.name} is wrong: a flight that starts {_short(flight.period)} later is another one; "
            f"{fits[0] if fits else f'expected: the period of all that depends on t and hit.t; {FORCING}'}"
        )
    forced = not repeats(flight.period / mp.sqrt(5))
    shares = [k for k in SHORTER if repeats(flight.period / k)] if forced else []
    if shares:
        raise CheckError(
            f"the period of {flight.name} is wrong: flights are the same already {_short(flight.period / shares[-1])} later, "
            f"{shares[-1]} times within the period of {_short(flight.period)}; expected: the shortest period"
        )


def check_restart(flight: Flight) -> None:
    """A flight continues unchanged when it is restarted on its way: it depends on place, velocity and time alone."""
    for length, *hit in flight.trials():
        halfway = hit[0] + length / 3
        again = halfway, flight.place(halfway, *hit), flight.velocity(halfway, *hit)
        whole, renewed = flight.place(hit[0] + length, *hit), flight.place(hit[0] + length, *again)
        if not _same(whole, renewed):
            raise CheckError(
                f"a flight of {flight.name} does not continue as before when it is restarted on its way: after an impact at "
                f"{_hit(hit)} it is at {_short(whole)} a time {_short(length)} later, and at {_short(renewed)} if started anew "
                "after a third of it; a term in s = t - hit.t has a wrong sign or factor, or hit.t stands where t should"
            )


def check_equation(flight: Flight, acceleration: Acceleration) -> None:
    """The flight obeys its equation of motion."""
    for length, *hit in flight.trials():
        t = hit[0] + length
        found, place, velocity = (f(t, *hit) for f in (flight.acceleration, flight.place, flight.velocity))
        try:
            expected = mp.mpf(str(sp.N(acceleration(t, place, velocity), DIGITS)))
        except (TypeError, AttributeError) as error:
            taken = f"the acceleration does not take numbers of {DIGITS} digits ({error})"
            raise CheckError(f"{taken}; use sympy's functions (from sympy import cos)") from error
        if not _same(found, expected):
            slip = ": it has the wrong sign" if _same(found, -expected) else ": a term has a wrong sign or factor, or is missing"
            raise CheckError(
                f"the displacement of {flight.name} does not obey its equation of motion{slip}. At t = {_short(t)}, place "
                f"{_short(place)} and velocity {_short(velocity)} it is accelerated by {_short(found)}; "
                f"expected: {_short(expected)}"
            )


def check_growth(system: ImpactSystem, flight: Flight) -> None:
    """Flights grow at most like a power of time, or the horizon is short."""
    for _, *hit in flight.trials():
        end = abs(flight.place(hit[0] + mp.mpf(system.horizon) * flight.period, *hit))
        if not end < HUGE:
            raise CheckError(
                f"the flights of {flight.name} grow without bound: after an impact at {_hit(hit)} one is "
                f"1e{int(mp.log10(end))} away at the end of the horizon of {system.horizon:g} periods; a damping or a spring "
                "has the wrong sign, or is it meant? then a shorter `horizon` of the class is expected"
            )


def check_turns_back(system: ImpactSystem, flight: Flight, states: Floats) -> None:
    """With one wall, most free flights return to it."""
    walls = list(system.walls().items())
    letter, base = walls[0]
    gone = [state for state in states if _goes_away(system, flight, state)] if len(walls) == 1 else []
    if 2 * len(gone) > len(states):
        v, phi = gone[len(gone) // 2]
        stops, away = ("growing", "falling") if base.side == 1 else ("falling", "growing")
        raise CheckError(
            f"{len(gone)} of {len(states)} flights of {flight.name} that leave its wall {letter} never return, such as that "
            f"after an impact of speed {v:.3g} at phase {phi:.3g}, towards {away} displacement. A force has the wrong sign, the "
            f"wall has the wrong `side` ({base.side:+d} stops {stops} displacement), or a wall on the other side is forgotten: "
            f"expected is what turns the ball back to {letter}"
        )


def _goes_away(system: ImpactSystem, flight: Flight, state: Floats) -> bool:
    """Whether a free flight from the base wall is ever farther from it: at twice a late time, more than half again.

    A flight that is seen beyond the wall on its way is not, such as one that swings ever wider.
    """
    letter, base = next(iter(system.walls().items()))
    t0 = mp.mpf(state[1]) / (2 * mp.pi) * flight.period
    hit = t0, flight.places[0], -base.side * mp.mpf(float(system.rebound(float(state[0]), letter)))

    def gap(periods: Any) -> Any:
        return base.side * (flight.places[0] - flight.place(t0 + periods * flight.period, *hit))

    late, later = gap(FAR), gap(2 * FAR)
    if not later > 1.5 * late > 0:
        return False
    seen = [gap(begin + mp.mpf(k) / LOOKS) for begin in (0, FAR) for k in range(1, 2 * LOOKS)]
    return min(seen) > 0 and later > 1.5 * max(seen)


def check_law(system: ImpactSystem, size: float) -> None:
    """An impact turns the ball round, and gives it no speed."""
    for letter in system.letters:
        for speed in (0.0, *(size * share for share in ROUND)):
            after = float(sp.N(law_of(system, speed, letter)))
            call = f"{type(system).__name__}.rebound({_short(speed)}, {letter!r}) is {_short(after)}"
            if not after >= 0:
                raise CheckError(
                    f"an impact does not reverse the motion: {call}; expected: the speed just after the impact, at least zero. "
                    "A speed has no sign: the wall turns the velocity round by itself"
                )
            if after > speed * (1 + NEAR):
                warnings.warn(f"an impact gains energy: {call}, more than the speed just before it", stacklevel=4)
                break


def check_use(system: ImpactSystem) -> None:
    """Every parameter appears in some formula, unless it has one admissible value."""
    cls = type(system)
    symbolic, symbols = in_symbols(cls, choices_of(system))
    t, t0, z, w, v = sp.symbols("t t0 z w v")
    walls = walls_of(symbolic)
    integrated = cls.flight() == "acceleration"
    flight = acceleration_of(symbolic, t, z, w) if integrated else displacement_of(symbolic, t, t0, z, w)
    said = [period_of(symbolic), flight, *(wall.at for wall in walls.values())]
    said += [law_of(symbolic, v, letter) for letter in walls]
    used = set().union(*(expr.free_symbols for expr in said))
    for name, symbol in symbols.items():
        if symbol not in used and next(neighbours(system, name), None) is not None:
            raise CheckError(
                f"the formulas of {cls.__name__} ignore its parameter {name!r}: neither walls, period, {cls.flight()} nor "
                "rebound have it in them; is a wall or a force forgotten? expected: a formula that uses it, or no such parameter"
            )


def neighbours(system: AnySystem, name: str) -> Iterator[AnySystem]:
    """The system with one parameter changed slightly, either way, where the value is admissible."""
    value = getattr(system, name)
    for step in (0.01, -0.01):
        try:
            yield system.at(**{name: value + step * (abs(value) or 1.0)})
        except ValueError:
            continue


def _later(flight: Flight, trial: tuple[Any, Any, Any, Any], by: Any) -> bool:
    length, t0, z, w = trial
    return _same(flight.place(t0 + length, t0, z, w), flight.place(t0 + by + length, t0 + by, z, w))


def _same(a: Any, b: Any) -> bool:
    return bool(abs(a - b) <= NEAR * (1 + abs(a) + abs(b)))


def _hit(hit: list[Any]) -> str:
    return ", ".join(f"hit.{letter} = {_short(value)}" for letter, value in zip("tzw", hit, strict=True))


def _short(value: Any) -> str:
    return f"{float(value):.6g}"
