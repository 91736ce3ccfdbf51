"""From impact to impact, with chatter and rest, and the loop through impacts to a return, which calls an observer."""

import math
from typing import NamedTuple

import numpy as np

from nsmaps.exact.engine.accumulation import accumulation_time, corrected_time
from nsmaps.exact.engine.constants import (
    INFINITE_CODE,
    INSTANT,
    LATE,
    MOST_PHASE,
    MOST_STEPS,
    NO_SPEED,
    OUTWARD,
    ROUND_THE_CIRCLE,
    STEADY,
    SUMMED_JERK,
    SUMMED_SNAP,
    TWO_PI,
)
from nsmaps.exact.engine.flight.bounds import limits
from nsmaps.exact.engine.flight.flow import (
    acceleration_at_rest,
    angle,
    begin,
    on_top,
    phase_rate,
    rebound,
    start,
    wall_place,
)
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.march import first_impact
from nsmaps.exact.outcome import Outcome

IMPACT, CHATTER, REST, FOREVER, ESCAPED = range(5)  # how a flight ended
RETURNED, STUCK, RESTS, LOST, UNDECIDED, _, *OTHERS = map(int, Outcome)  # values that compiled code can hold
INVALID, SIMULTANEOUS, ENDLESS, REPELLING, ACCUMULATES, BLOCKED = OTHERS
SPEED, PHASE = range(2)  # the columns of states, and of their derivatives


class Impact(NamedTuple):
    """The ball just before an impact."""

    up: bool  #: on the upper wall
    phase: float  #: of the forcing, radians
    speed: float  #: at least zero


class Event(NamedTuple):
    """What follows an impact: the flight to the next one, or chatter or rest on the wall up to the release."""

    ended: int  #: IMPACT, CHATTER, REST, FOREVER or ESCAPED
    up: bool  #: True if the next impact is on the upper wall
    time: float  #: taken, in the system's time
    speed: float  #: of the next impact, zero after rest
    undecided: bool  #: True if a wall is passed within rounding of a graze
    slope: float  #: derivative of the impact law at the impact
    velocity: float  #: just after the impact


class Return(NamedTuple):
    """How a motion came to the base wall; speed and phase are NaN if it did not."""

    outcome: int  #: a value of Outcome
    speed: float
    phase: float  #: in [0, 2 pi)
    turns: int  #: whole turns of the phase on the way
    time: float  #: on the way, or to where impacts accumulate or endless rest begins; otherwise NaN


@inner
def time_to_release(p, phi, up):
    """The time for which the ball rests on a wall from phase phi on, or infinity: until the wall no longer presses.

    A march: with a bound m on |F''| the force F + F' h - m h^2/2 is at least zero up to the root h of this, so that no step
    carries it through zero (Taylor's theorem), and steps converge to a root of F at second order.
    """
    z, into, turning, s = wall_place(p, up), 1.0 if up else -1.0, phase_rate(p), 0.0
    for _ in range(MOST_STEPS):
        a, rate, bend = acceleration_at_rest(p, angle(phi + turning * s), z)
        press, rate, bend = into * a, into * rate, bend * OUTWARD
        if press <= 0.0 and rate < 0.0:
            return max(s - press / rate, 0.0)
        press = max(press, 0.0)
        if bend == 0.0 and rate >= 0.0:
            return math.inf
        h = 2.0 * press / (math.sqrt(rate * rate + 2.0 * bend * press) - rate) if press > 0.0 else 2.0 * rate / bend
        if rate < 0.0 and bend * h * h <= LATE * TWO_PI / turning * -rate:
            return s - press / rate
        s += h
        if turning * s > ROUND_THE_CIRCLE * TWO_PI:
            break
    return math.inf


@inlined
def accumulation(u, v, press, jerk, snap):
    """Time at which impacts of speeds v, u, ... accumulate, to 2nd order, and whether the 3rd makes that exact to rounding."""
    x = accumulation_time(u, u / v, press)
    return x, x * jerk <= SUMMED_JERK * press and x * x * snap <= SUMMED_SNAP * press


@inlined
def may_be_summed(p, up, v, chatter, press):
    """True if chatter that begins with an impact of speed v may be summed.

    That is always so on the other wall; on the base wall from `chatter` on, as a share of the speed that the acceleration into
    the wall gives in a radian of the forcing.
    """
    return up != on_top(p) or v * phase_rate(p) <= chatter * press


@inlined
def keeps_ratio(p, up, u, ratio, angle):
    """True if chatter over an angle of the forcing keeps its ratio of speeds from u on, so that its end is exact to rounding."""
    again, _ = rebound(p, up, u)
    return angle * abs(again / u - ratio) <= STEADY * (1.0 - ratio)


@inner
def next_impact(p, impact, chatter):
    """The event after an impact: the flight, with its coefficients in `p`, or chatter or rest.

    Chatter whose first speed is `may_be_summed` is summed once the sum is exact to rounding, by `accumulation.py`.
    """
    up, phi, v = impact
    z, into = wall_place(p, up), 1.0 if up else -1.0
    u, slope = rebound(p, up, v)
    if u < NO_SPEED:
        u = 0.0
    w = -into * u
    begin(p, angle(phi), z, w)
    a, jk, _, _ = start(p)
    press = into * a
    if u == 0.0 and (press > 0.0 or (press == 0.0 and into * jk > 0.0)):
        resting = time_to_release(p, phi, up)
        if resting == math.inf:
            return Event(FOREVER, up, 0.0, 0.0, False, slope, w)
        if resting > INSTANT * TWO_PI / phase_rate(p):
            return Event(REST, up, resting, 0.0, False, slope, w)
    elif press > 0.0 and may_be_summed(p, up, v, chatter, press) and u < v:
        bounds = limits(p, 0.0)
        x, summable = accumulation(u, v, press, bounds.jerk, bounds.snap)
        if summable and keeps_ratio(p, up, u, u / v, x * phase_rate(p)):
            _, held_jerk, _ = acceleration_at_rest(p, angle(phi), z)
            x = corrected_time(x, u / v, press, into * jk, into * held_jerk)
            resting = time_to_release(p, phi + x * phase_rate(p), up)
            if resting == math.inf:
                return Event(FOREVER, up, x, 0.0, False, slope, w)
            return Event(CHATTER, up, x + resting, 0.0, False, slope, w)
    end = first_impact(p, up, w)
    return Event(IMPACT if end.found else ESCAPED, end.up, end.time, end.speed, end.undecided, slope, w)


@inner
def append_symbol(code, place_value, base, symbol, times):
    """The code of a word with a letter appended `times` times; place value 0 marks a word longer than a code holds."""
    for _ in range(times):
        if place_value == 0:
            break
        if place_value >= INFINITE_CODE // base:
            return -code, 0
        code += symbol * place_value
        place_value *= base
    return code, place_value


@inner
def is_state(v, phi):
    """True if (v, phi) is a state: a finite speed >= 0, and a phase that has not lost its digits to whole turns."""
    return v >= 0.0 and v < math.inf and abs(phi) < MOST_PHASE


@inlined
def phase_after(p, phi, s):
    """As `phase_and_turns`, the turns as a float."""
    phi += s * phase_rate(p)
    whole = np.floor(phi / TWO_PI)
    phi = max(phi - whole * TWO_PI, 0.0)
    return phi if phi < TWO_PI else 0.0, whole if phi < TWO_PI else whole + 1.0


@inlined
def phase_at(p, phi, s):
    """The phase a time s later, in [0, 2 pi)."""
    later, _ = phase_after(p, phi, s)
    return later


@inner
def phase_and_turns(p, phi, s):
    """The phase a time s later, in [0, 2 pi), and the whole turns in between."""
    phi, whole = phase_after(p, phi, s)
    return phi, int(whole)


@inner
def follow(p, impact, chatter, limit, observe, context, seen):
    """From an impact through at most `limit` events to the next impact on the base wall, or the next release from it.

    After each event `seen` becomes `observe(p, impact, event, context, seen)`: `impact` is the one before the event, and `p` has
    the coefficients of the flight. The context may have arrays; what is seen is numbers, as inner functions count no references.
    numba compiles the loop once for each compiled function `observe`. Returns (the `Return`, what was seen); at the limit the
    outcome is ENDLESS.
    """
    if not is_state(impact.speed, impact.phase):
        return Return(INVALID, math.nan, math.nan, 0, math.nan), seen
    phase, turns = phase_and_turns(p, impact.phase, 0.0)
    impact, time, undecided = Impact(impact.up, phase, impact.speed), 0.0, False
    for _ in range(limit):
        event = next_impact(p, impact, chatter)
        seen = observe(p, impact, event, context, seen)
        undecided |= event.undecided
        if event.ended == FOREVER:
            return Return(RESTS, math.nan, math.nan, 0, time + event.time), seen
        if event.ended == ESCAPED:
            return Return(UNDECIDED if undecided else LOST, math.nan, math.nan, 0, math.nan), seen
        time += event.time
        phase, whole = phase_and_turns(p, impact.phase, event.time)
        turns += whole
        if event.up == on_top(p):
            outcome = STUCK if event.ended != IMPACT else UNDECIDED if undecided else RETURNED
            return Return(outcome, event.speed, phase, turns, time), seen
        impact = Impact(event.up, phase, event.speed)
    return Return(ENDLESS, math.nan, math.nan, 0, math.nan), seen
