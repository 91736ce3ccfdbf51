"""A return by any integrator that stops at events: flights one after another in displacement since the last impact."""

from collections.abc import Callable
from math import copysign, pi

from nsmaps.arrays import Floats
from nsmaps.bench.task import Answer, Pair

Flight = Callable[[float, float, float, float, float], tuple[float, float, bool]]
"""From (phase, start, velocity, lower wall, upper wall) to (time, velocity, was there an impact). Walls are displacements since
the last impact, one of them 0; the start is inside them by INSIDE, for an integrator that starts on an event's zero may lose
the next one."""

INSIDE = 1e-40
MOST_IMPACTS = 120


def absolute(rtol: float, w: float) -> float:
    """The absolute tolerance of a flight that starts with velocity w: a slow one goes no further than about w^2."""
    return rtol * min(1.0, w * w)


def returns_by_flights(flight: Flight, pair: Pair, starts: Floats) -> Answer:
    """First returns of the starts one by one; a flight without an impact ends the attempt."""
    answer = Answer.none(len(starts))
    for i, (v, phi) in enumerate(starts.tolist()):
        w, low, high = -pair.r * v, -pair.d, 0.0
        for tops in range(MOST_IMPACTS):
            time, velocity, hit = flight(phi, copysign(INSIDE, w), w, low, high)
            if not hit:
                break
            phi = (phi + pi * time) % (2 * pi)
            if velocity > 0:
                answer.image[i] = velocity, phi
                answer.tops[i] = tops
                break
            w, low, high = -pair.r * velocity, 0.0, pair.d
    return answer
