"""check_system: whether an impact system is one, by its formulas and by what the compiled map makes of them."""

import warnings

import mpmath as mp
import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI, BoxLike, as_states
from nsmaps.errors import CheckError
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.testing.formulas import (
    DIGITS,
    Acceleration,
    Flight,
    check_description,
    check_equation,
    check_growth,
    check_law,
    check_period,
    check_restart,
    check_setting,
    check_start,
    check_turns_back,
    check_units,
    check_use,
    flight_of,
    neighbours,
)
from nsmaps.testing.hybrid import check_hybrid
from nsmaps.testing.maps import check_map

SPEEDS, PHASES = np.geomspace(1e-3, 30, 12), np.arange(12) / 12 * TWO_PI + 0.1  #: of trial states, in the system's units
CLOSE = 1e-7  #: of the compiled flight to the formulas, relative
FOLLOWED, IMPACTS, LOOKS = 6, 4, 40  #: trajectories compared with the formulas, their impacts, places looked at in a flight


def check_system(
    system: System, acceleration: Acceleration | None = None, states: ArrayLike | None = None, box: BoxLike | None = None
) -> None:
    """Check that a system's formulas make a return map; takes seconds, and up to a minute or more to compile it when it is new.

    Errors are: walls without room between them, or missing walls, so that flights never return; a wrong period; a flight with a
    wrong initial place or velocity, or that violates its equation of motion; an impact that does not reverse the motion; a
    parameter on which no formula, or no return, depends; compiled flights that differ from the formulas. Warnings are missing
    descriptions, an impact that gains energy, and an acceleration that was not given.

    A formula that is right for another system cannot be distinguished from the intended one. A force of the wrong sign that
    lets the ball return, or the second wall if its absence has no other effect, is found by the equation of motion alone.

    Of a system that is given by its acceleration flights are integrated by Runge-Kutta steps for these checks.

    Of a system with modes errors are a wrong period; states none of which returns; a parameter on which no return depends;
    derivatives that are not those of differences; returns that an integrator with the formulas of modes, guards and resets does
    not reach, through sliding and lasting contact too. Warnings are missing descriptions and events that never take place.

    Of a map that a class gives by its `first_return` errors are states none of which has an image; images that depend on the
    other states of a batch; angles beyond a turn; derivatives that are not those of differences; a parameter on which no return
    depends. Of a map given by formulas also a piece that never applies; an image that is not finite in its piece; `states` or
    states within `box` that are in no piece; `preimages` whose images differ. Warnings are trial states in no piece, a piece
    without trial states, a border that is in no piece or has no derivative, and a coordinate that seems to be an angle.

    Args:
        system: with parameters at which the base wall, or the section, is reached.
        acceleration: the right-hand side of the equation of motion x'' = f(t, x, x'), with which the displacement is compared;
            without it a wrong sign of the forcing, the same in every term, is not found.
        states: trial states, shape (N, n); else of an impact system speeds of all sizes, as the forces at the base wall have it,
            at all phases, and of a map states of all sizes.
        box: of a map: that, as by coordinate, from which trial states are drawn instead.

    Raises:
        CheckError: says what is wrong, with the values, and what is expected.
        SystemDefinitionError: the formulas have no form that can be compiled.
    """
    if not isinstance(system, System):
        expected = "an object of a class that inherits from nsmaps.ImpactSystem, nsmaps.HybridSystem or nsmaps.System"
        raise CheckError(f"{system!r} is not a system; expected: {expected}{', with its parameters' * isinstance(system, type)}")
    check_description(system)
    check_units(system)
    if isinstance(system, ImpactSystem):
        _check_impacts(system, acceleration, states)
    elif isinstance(system, HybridSystem):
        check_hybrid(system, states)
    else:
        check_map(system, states, box)


def _check_impacts(system: ImpactSystem, acceleration: Acceleration | None, states: ArrayLike | None) -> None:
    """As `check_system`."""
    with mp.workdps(DIGITS):
        check_setting(system)
        flight = flight_of(system)
        check_start(flight)
        check_period(flight)
        check_restart(flight)
        if acceleration is not None:
            check_equation(flight, acceleration)
        size = _speed(flight)
        check_law(system, size)
        starts = _trial_states(size) if states is None else as_states(states, system.coordinates)
        if type(system).flight() == "displacement":
            check_growth(system, flight)
            check_turns_back(system, flight, starts)
        check_use(system)
        returns = system.first_return(starts)
        if not returns.valid.any():
            raise CheckError(
                f"none of {len(returns)} flights of {flight.name} comes back to its wall {system.letters[0]} "
                f"({returns.counts()}); expected: parameters at which it is reached, or `states` from which it is"
            )
        _check_flights(system, flight, starts[returns.valid][:: max(1, int(returns.valid.sum()) // FOLLOWED)])
    _check_influence(system, returns.select(returns.valid))  # flights that do not come back take long
    if acceleration is None and type(system).flight() == "displacement":
        warnings.warn(
            f"{flight.name} passes, but the acceleration was not given: a wrong sign of the forcing cannot be detected; "
            "pass acceleration=lambda t, place, velocity: ..., the right-hand side of the equation of motion",
            stacklevel=3,
        )


def _speed(flight: Flight) -> float:
    """A speed that the forces at the base wall give within a period; one where there are none."""
    times = [flight.period * k / 12 for k in range(12)]
    largest = max(abs(flight.acceleration(t, t, flight.places[0], mp.mpf(0))) for t in times)
    return float(largest * flight.period) or 1.0


def _trial_states(size: float) -> Floats:
    v, phi = np.meshgrid(size * SPEEDS, PHASES)
    return np.column_stack([v.ravel(), phi.ravel()])


def _check_flights(system: ImpactSystem, flight: Flight, starts: Floats) -> None:
    """The compiled trajectories are those of the formulas: each impact on its wall, with its speed, and no wall passed before."""
    walls = list(system.walls().items())
    for start in starts:
        hits = system.impacts(start, IMPACTS)
        for i in np.flatnonzero(hits.mark[1:] == ""):
            letter, wall = walls[hits.wall[i]]
            t0 = mp.mpf(hits.phase[i]) / (2 * mp.pi) * flight.period
            w = -wall.side * mp.mpf(float(system.rebound(float(hits.speed[i]), letter)))
            impact, length = (t0, flight.places[hits.wall[i]], w), mp.mpf(hits.time[i + 1] - hits.time[i])
            end, met = walls[hits.wall[i + 1]][1], flight.places[hits.wall[i + 1]]
            path = [flight.place(t0 + length * k / LOOKS, *impact) for k in range(1, LOOKS + 1)]
            speed = end.side * flight.velocity(t0 + length, *impact)
            tolerance = CLOSE * (1 + max(abs(x) for x in (*path, w, speed)))
            beyond = max(each.side * (x - at) for x in path for (_, each), at in zip(walls, flight.places, strict=True))
            if abs(path[-1] - met) > tolerance or abs(speed - hits.speed[i + 1]) > tolerance or beyond > tolerance:
                raise CheckError(
                    f"the compiled flight of {flight.name} is not that of its formulas: after an impact on {letter} at "
                    f"phase {hits.phase[i]:.6g} with speed {hits.speed[i]:.6g}, {float(length):.6g} later the formulas give the "
                    f"place {float(path[-1]):.6g} and the speed {float(speed):.6g}, and pass a wall by "
                    f"{max(float(beyond), 0):.3g}; expected: the wall at {float(met):.6g} with speed {hits.speed[i + 1]:.6g}"
                )


def _check_influence(system: ImpactSystem, returns: Returns) -> None:
    """Every parameter changes some return."""
    for name in type(system).parameter_names():
        others = [other.first_return(returns.start) for other in neighbours(system, name)]
        if others and all(_alike(returns, other) for other in others):
            raise CheckError(
                f"no return of {type(system).__name__} depends on its parameter {name!r}, which its formulas have: the same "
                f"from {len(returns)} states, of speeds up to {returns.start[:, 0].max():.3g}, with {name} a hundredth more or "
                "less. Is a wall forgotten at whose place it stands? expected: an effect, faster `states` that show it, or no "
                "such parameter"
            )


def _alike(a: Returns, b: Returns) -> bool:
    same = np.isclose(a.lifted, b.lifted, rtol=1e-9, atol=1e-9, equal_nan=True)
    return bool(same.all() and (a.codes == b.codes).all())
