"""Orbits with incomplete chatter, which replace one with complete chatter beyond the border orbit, and how they scale.

At the border orbit impacts accumulate where the wall ceases to press. There, with the time t until the release and the distance
x from the wall in suitable units, x'' = t to leading order, with the symmetry t -> c t, x' -> c^2 x'. Speeds u = k t^2 after
impacts with k = (1 - s)(2 + s)/6 are followed by those at the times s t, s^2 t, ..., if s^3 + 2 s^2 = r (2 s + 1): this sequence
ends at the release. As u du dt becomes r^2 u du dt from one impact to the next, a deviation of k grows by r^2/s^5 with each. The
deviation with which n impacts pass before the release is smaller by that factor for each further one, and so is the distance of
the parameter from the border. The time by which the ball then misses the release is smaller by s, its speed by s^2.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np

from nsmaps.dynamics.chatter.complete import CompleteChatter
from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.continuation.events import CHATTER_ENDS, TESTS, BifurcationPoint
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.dynamics.returnmap import map_along, map_or_reason
from nsmaps.errors import NsmapsError, check_class
from nsmaps.errors.arguments import checked
from nsmaps.exact.returnmap import single_returns
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.progress import shows

SHRINK = 1.15  #: ratio of successive distances from the border, at which orbits are looked for
LEAST = 1e-12  #: share of the range: distance from the border, below which none is looked for
LOOPS = 60  #: times round the border orbit, after which the attractor is looked at
SPREAD = 4.0  #: range of a branch, in distances of its first orbit from the border
DIRECTIONS: tuple[Literal["down", "up"], ...] = ("down", "up")
SAME = 1e-6  #: largest relative difference of the times round an orbit and the border orbit

ChatterAt = Callable[[float], CompleteChatter]


@dataclass(frozen=True, slots=True)
class ChatterScaling:
    """The ratios of successive orbits in the cascade of incomplete chatter, with one impact more, to leading order."""

    time: float  #: of the times between the last impacts and the release: s
    parameter: float  #: of the parameter's distances from the border orbit: r^2/s^5
    exponent: float  #: the release is missed by a speed of this power of that distance: 2 log(s)/log(s^5/r^2)


@dataclass(frozen=True, slots=True)
class IncompleteChatter:
    """The orbit with one number of impacts near the border orbit, over the parameters where it attracts."""

    impacts: int  #: on the base wall, in one period
    near: Branch  #: towards the border, to the first event
    far: Branch  #: away from it, to the first event


@checked
def chatter_scaling(r: float) -> ChatterScaling:
    """How orbits with incomplete chatter scale near the border orbit, at a restitution coefficient r for slow impacts.

    Raises:
        NsmapsError: r is not between 0 and 1.
    """
    if not 0 < r < 1:
        raise NsmapsError(f"the restitution coefficient is {r:g}; expected: between 0 and 1, where impacts accumulate")
    roots = np.roots([1.0, 2.0, -2 * r, -r])
    s = float(roots[np.argmax(roots.real)].real)
    return ChatterScaling(s, r**2 / s**5, float(2 * np.log(s) / np.log(s**5 / r**2)))


@shows
def chatter_cascade(
    system: CompleteChatter | Callable[[float], CompleteChatter],
    parameter: str,
    point: BifurcationPoint,
    bounds: tuple[float, float],
    n_orbits: int,
    *,
    step: float = 0.1,
) -> tuple[IncompleteChatter, ...]:
    """The attracting orbits with incomplete chatter near the border orbit, those with the fewest impacts first.

    Attractors are looked for at distances from the border that shrink by 1.15, from the end of the range on; each that returns
    in the time of the border orbit is continued both ways to its first event. A number of impacts whose orbit attracts only
    between two of these distances is missed, as are attractors of several times round.

    Args:
        system: the `CompleteChatter` of a system, or a function of the parameter's value that gives it.
        parameter: its name.
        point: an `end of complete chatter` of a branch of that map.
        bounds: least and greatest value of the parameter.
        n_orbits: greatest number of orbits.
        step: longest step of the branches, in arclength, whose unit is four times the distance at which an orbit was found.

    Raises:
        NsmapsError: another kind of event, or `n_orbits` below one.
    """
    check_class(point, BifurcationPoint, "a cascade begins at the end of a branch")
    if point.kind != CHATTER_ENDS or n_orbits < 1:
        raise NsmapsError(f"{n_orbits} orbits at a {point.kind}; expected: one or more at an {CHATTER_ENDS}")
    border, found, map_of = point.value, dict[int, IncompleteChatter](), cast(ChatterAt, map_along(system, parameter))
    single = lambda value: map_of(value).system  # noqa: E731
    for value, orbit in _attractors(single, point, _way(map_of, point, bounds)):
        number = len(orbit.states)
        if number not in found:
            ends = sorted((border, border + SPREAD * (value - border)))
            how: Any = {"step": step, "until": tuple(TESTS)}
            down, up = (
                continue_branch(single, parameter, orbit, value, (ends[0], ends[1]), direction=way, **how) for way in DIRECTIONS
            )
            found[number] = IncompleteChatter(number, *((down, up) if value > border else (up, down)))
        if len(found) == n_orbits:
            break
    return tuple(found[number] for number in sorted(found))


def _way(map_of: Callable[[float], CompleteChatter], event: BifurcationPoint, bounds: tuple[float, float]) -> float:
    """The end of the range, less the border, on whose side chatter is not complete."""
    low, high = bounds
    return_map, _ = map_or_reason(map_of, event.value + 1e-6 * (high - low))
    if return_map is not None:
        times = [float(each.time[0]) for each in single_returns(return_map, event.orbit.states[:1], 2 * len(event.orbit.states))]
        if np.allclose(sum(times[len(times) // 2 :]), event.orbit.returns.time.sum(), rtol=0.1):
            return low - event.value
    return high - event.value


def _attractors(
    system_of: Callable[[float], FlowSystem], event: BifurcationPoint, way: float
) -> Iterator[tuple[float, PeriodicOrbit]]:
    """The attracting orbits of single impacts that take the border orbit's time, at distances that shrink."""
    whole, share, count = float(event.orbit.returns.time.sum()), 1.0, 64
    while share > LEAST:
        value = event.value + share * way
        share /= SHRINK
        system, _ = map_or_reason(system_of, value)
        if not isinstance(system, FlowSystem):
            continue
        run = system.orbits(event.orbit.states[:1], count * LOOPS, chatter=np.inf)
        number = int(np.argmin(np.abs(np.cumsum(run.time[::-1]) - whole))) + 1
        if not run.valid.all() or abs(run.time[-number:].sum() - whole) > SAME * whole:
            continue
        orbit = periodic_orbit(system, run.start[-number:], number)
        if orbit.converged and orbit.exists and orbit.stable:
            yield value, orbit
