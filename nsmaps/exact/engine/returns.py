"""From impact to impact and from return to return: chatter, rest, words, first returns and their derivatives."""

import math

import numpy as np

from nsmaps.exact.engine.flight.bounds import limits
from nsmaps.exact.engine.flight.flow import (
    angle,
    begin,
    evaluate,
    held,
    phase_rate,
    rebound,
    start,
    tangent_at,
    wall_places,
    walls_of,
)
from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.engine.march import MOST_STEPS, OUTWARD, flight

TWO_PI = 2 * math.pi
IMPACT, CHATTER, REST, FOREVER, ESCAPED = 0, 1, 2, 3, 4  # how a flight ended
RETURNED, STUCK, RESTS, LOST, UNDECIDED, UNCOVERED = 0, 1, 2, 3, 4, 5  # values of Outcome
INVALID, SIMULTANEOUS, ENDLESS, REPELLING, ACCUMULATES, BLOCKED = 6, 7, 8, 9, 10, 11
MOST_IMPACTS = 100_000  # of one return
INFINITE_CODE = 2**62
MOST_PHASE = 1e10  # radians, whose turns fit into an int32
STEADY = 1e-15  # radians of phase, by which the end of chatter may shift
NO_SPEED = 1e-300  # a ball that leaves a wall slower than this stays on it: the reciprocal would overflow


@inner
def release(p, phi, up):
    """The time for which the ball rests on a wall from phase phi on, or infinity: until the wall no longer presses.

    A march: no step can carry the force of the wall through zero, and steps converge to a root at second order.
    """
    top, bottom = wall_places(p)
    z = top if up else bottom
    into = 1.0 if up else -1.0
    turning = phase_rate(p)
    s = 0.0
    for _ in range(MOST_STEPS):
        a, rate, bend = held(p, angle(phi + turning * s), z)
        press, rate, bend = into * a, into * rate, bend * OUTWARD
        if press <= 0.0 and rate < 0.0:
            return max(s - press / rate, 0.0)
        press = max(press, 0.0)
        if bend == 0.0 and rate >= 0.0:
            return math.inf
        h = 2.0 * press / (math.sqrt(rate * rate + 2.0 * bend * press) - rate) if press > 0.0 else 2.0 * rate / bend
        if rate < 0.0 and bend * h * h <= 1e-17 * TWO_PI / turning * -rate:
            return s - press / rate
        s += h
        if turning * s > 1.000001 * TWO_PI:
            break
    return math.inf


@inlined
def accumulation(u, v, press, bounds):
    """The time at which impacts of speeds v, u, ... accumulate, to second order, and whether the third order makes that exact to
    rounding.
    """
    x = 2.0 * u / (press * (1.0 - u / v))
    return x, x * bounds[0] <= 1e-5 * press and x * x * bounds[1] <= 1e-10 * press


@inlined
def summed(p, up, v, chatter, press):
    """True if chatter that begins with an impact of speed v may be summed: always on the other wall, and on the base wall from
    `chatter` on, as a share of the speed that the acceleration into the wall gives in a radian of the forcing.
    """
    return up != walls_of(p)[2] or v * phase_rate(p) <= chatter * press


@inlined
def steady(p, up, u, ratio, angle):
    """True if chatter over an angle of the forcing keeps the ratio of its speeds, from u on, so well that its end is exact to
    rounding.
    """
    again, _ = rebound(p, up, u)
    return angle * abs(again / u - ratio) <= STEADY * (1.0 - ratio)


@inner
def next_impact(p, up, phi, v, chatter):
    """From just before an impact of speed v at phase phi to just before the next impact.

    Returns (how it ended, on the upper wall, time taken, speed, undecided, du/dv of the rebound, velocity after the impact).
    Chatter whose first speed is `summed` is summed once the sum is exact to rounding: with acceleration alpha into the wall,
    alpha' = beta of a ball held there and x = 2 u/(alpha (1 - r)) the impacts accumulate after x - beta x^2/(3 alpha) + O(x^3) if
    forces do not depend on the velocity; if they do, flights have a jerk j different from beta.
    """
    top, bottom = wall_places(p)
    z = top if up else bottom
    into = 1.0 if up else -1.0
    u, slope = rebound(p, up, v)
    if u < NO_SPEED:
        u = 0.0
    w = -into * u
    begin(p, angle(phi), z, w)
    a, jk, _, _ = start(p)
    press = into * a
    if u == 0.0 and (press > 0.0 or (press == 0.0 and into * jk > 0.0)):
        resting = release(p, phi, up)
        if resting == math.inf:
            return FOREVER, up, 0.0, 0.0, False, slope, w
        if resting > 1e-13 * TWO_PI / phase_rate(p):
            return REST, up, resting, 0.0, False, slope, w
    elif press > 0.0 and summed(p, up, v, chatter, press) and u < v:
        x, summable = accumulation(u, v, press, limits(p, 0.0))
        if summable and steady(p, up, u, u / v, x * phase_rate(p)):
            r, j, beta = u / v, into * jk, into * held(p, angle(phi), z)[1]
            x += x * x * (j * (2.0 * r - 1.0) / 3.0 - beta * r - (j - beta) * r * (1.0 - r) / 2.0) / (press * (1.0 + r))
            phase = phi + x * phase_rate(p)
            resting = release(p, phase, up)
            if resting == math.inf:
                return FOREVER, up, x, 0.0, False, slope, w
            return CHATTER, up, x + resting, 0.0, False, slope, w
    found, up, s, v, undecided = flight(p, up, w)
    return IMPACT if found else ESCAPED, up, s, v, undecided, slope, w


@inlined
def advance_tangent(p, up, at, slope, now_up, s, d):
    """Carry the derivative d of (v, phi) through one impact and the flight of time s after it."""
    moves = tangent_at(p, at, s)
    _, velocity, a, _, _, _ = evaluate(p, s)
    return saltation(up, now_up, slope, velocity, a, moves, phase_rate(p), d)


@inlined
def saltation(up, now_up, slope, velocity, a, moves, rate, d):
    """As `advance_tangent`, from what is known at the end of the flight: velocity, acceleration and `moves`, the result of
    `tangent_at`.
    """
    into, now_into = 1.0 if up else -1.0, 1.0 if now_up else -1.0
    w_phi, w_w, v_phi, v_w = moves
    d00, d01, d10, d11 = d
    u0, u1 = -into * slope * d00, -into * slope * d01
    slowness = -1.0 / velocity
    s0 = (w_phi * d10 + w_w * u0) * slowness
    s1 = (w_phi * d11 + w_w * u1) * slowness
    return (
        now_into * (a * s0 + v_phi * d10 + v_w * u0),
        now_into * (a * s1 + v_phi * d11 + v_w * u1),
        d10 + rate * s0,
        d11 + rate * s1,
    )


@inner
def spell(code, power, base, digit, times):
    """The code of a word with a letter appended `times` times; power 0 marks a word longer than a code holds."""
    for _ in range(times):
        if power == 0:
            break
        if power >= INFINITE_CODE // base:
            return -code, 0
        code += digit * power
        power *= base
    return code, power


@inner
def is_state(v, phi):
    """True if (v, phi) is a state: a finite speed >= 0, and a phase that has not lost its digits to whole turns."""
    return v >= 0.0 and v < math.inf and abs(phi) < MOST_PHASE


@inlined
def turned(p, phi, s):
    """As `onward`, the turns as a float."""
    phi += s * phase_rate(p)
    whole = np.floor(phi / TWO_PI)
    phi = max(phi - whole * TWO_PI, 0.0)
    return phi if phi < TWO_PI else 0.0, whole if phi < TWO_PI else whole + 1.0


@inner
def onward(p, phi, s):
    """The phase a time s later, in [0, 2 pi), and the whole turns in between."""
    phi, whole = turned(p, phi, s)
    return phi, int(whole)


@inner
def first_return(p, v, phi, chatter, derivative):
    """The first return to the base wall: (outcome, speed, phase, turns, time, code of the word, derivative)."""
    d = (1.0, 0.0, 0.0, 1.0)
    lost = (math.nan, math.nan, math.nan, math.nan)
    if not is_state(v, phi):
        return INVALID, math.nan, math.nan, 0, math.nan, 0, lost
    phi, turns = onward(p, phi, 0.0)
    has_up, has_down, base_up = walls_of(p)
    walls = 2 if has_up and has_down else 1
    base = walls + 3  # of the word's code: walls, two marks, none
    up, power, code, time, undecided = base_up, 1, 0, 0.0, False
    letter, run = 1, 1  # the wall of the last impacts and their number in a row: written when the row ends, once if it is chatter
    for _ in range(MOST_IMPACTS):
        on_base = up == base_up
        ended, now_up, s, now_v, unsure, slope, _ = next_impact(p, up, phi, v, chatter)
        undecided |= unsure
        if ended == FOREVER:
            return RESTS, math.nan, math.nan, 0, time, code, lost
        if ended == ESCAPED:
            return UNDECIDED if undecided else LOST, math.nan, math.nan, 0, math.nan, code, lost
        if ended != IMPACT:
            code, power = spell(code, power, base, letter, 1)
            code, power = spell(code, power, base, walls + (1 if ended == CHATTER else 2), 1)
            run, d = 0, (0.0, 0.0, 0.0, 0.0)
        else:
            if now_up != up:
                code, power = spell(code, power, base, letter, run)
                letter, run = 1 if now_up == base_up else 2, 0
            run += 1
            if derivative:
                d = advance_tangent(p, up, angle(phi), slope, now_up, s, d)
        time += s
        phi, whole = onward(p, phi, s)
        turns += whole
        v, up = now_v, now_up
        if up == base_up and (ended == IMPACT or on_base):
            code, power = spell(code, power, base, letter, run)
            outcome = STUCK if ended != IMPACT else UNDECIDED if undecided else RETURNED
            return outcome, v, phi, turns, time, code, d
    return LOST, math.nan, math.nan, 0, math.nan, code, lost


@inner
def put(i, k, result, states, turns, codes, outcome, time, tangents):
    """Write return number i of orbit k into the arrays of all orbits; the derivative if `tangents` has rows."""
    outcome[i, k], states[i, k, 0], states[i, k, 1], turns[i, k, 1], time[i, k], codes[i, k], d = result
    turns[i, k, 0] = 0
    if len(tangents):
        tangents[i, k, 0, 0], tangents[i, k, 0, 1], tangents[i, k, 1, 0], tangents[i, k, 1, 1] = d


@entry
def trajectory(p, v, phi, chatter, up, wall, time, phase, speed, mark):
    """Every impact of one trajectory, written into the given arrays; returns their number."""
    n, base_up = len(wall), walls_of(p)[2]
    t = 0.0
    for i in range(n):
        wall[i], time[i], phase[i], speed[i] = up == base_up, t, phi, v
        if i + 1 == n:
            return n
        ended, up, s, v, _, _, _ = next_impact(p, up, phi, v, chatter)
        if ended in (FOREVER, ESCAPED):
            mark[i] = ended
            return i + 1
        mark[i + 1] = ended
        t += s
        phi, _ = onward(p, phi, s)
    return n


@entry
def sampled(p, up, phi, v, times, places, velocities):
    """Displacements and velocities at times after an impact of speed v, written into the given arrays."""
    top, bottom = wall_places(p)
    u, _ = rebound(p, up, v)
    begin(p, angle(phi), top if up else bottom, -u if up else u)
    for i in range(len(times)):
        places[i], velocities[i], _, _, _, _ = evaluate(p, times[i])
