"""Orbits under additive Ornstein-Uhlenbeck forcing, from grid point to grid point of its exact discretisation.

Flights obey z'' = -k z - c z' + f(t), and the noise eta of an Ornstein-Uhlenbeck process (G. E. Uhlenbeck and L. S. Ornstein,
Phys. Rev. 36, 1930) is added to f. By superposition the place is that of the deterministic flight plus n(t), n'' = eta - k n -
c n', and (n, n', eta) is Gaussian and is drawn exactly at the grid points (D. T. Gillespie, Phys. Rev. E 54, 1996). Between them
n is the quintic through its value and two derivatives at either end. At impacts the deterministic flight starts anew, and the
noise continues.
"""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.constants import MOST_IMPACTS, NO_SPEED, ROUND_THE_CIRCLE, TWO_PI
from nsmaps.exact.engine.flight.bounds import limits
from nsmaps.exact.engine.flight.flow import (
    angle,
    begin,
    horizon,
    on_top,
    phase_rate,
    rebound,
    start,
    wall_place,
    wall_places,
    walls_of,
)
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.observers import BASE, OTHER, Word, append_impact, append_rest, base_of
from nsmaps.exact.engine.returns import (
    CHATTER,
    ENDLESS,
    INVALID,
    LOST,
    PHASE,
    REST,
    RESTS,
    RETURNED,
    SPEED,
    STUCK,
    accumulation,
    append_symbol,
    is_state,
    keeps_ratio,
    may_be_summed,
    phase_and_turns,
    phase_at,
)
from nsmaps.exact.noise.flight import (
    HALVINGS,
    expand_about,
    noise_over,
    position_at,
    quintic,
    time_to_same_wall,
    time_to_wall,
)

LONGEST_FLIGHT = 1000.0  # periods, if the system's horizon is longer
START = 0  # the row of the start
UNDER_WAY = -1  # the fate of a ball under way; others are values of Outcome
# The record of a ball: the time in the step, its place and velocity there, the phase and the noise at the start of the step, the
# time since the last return and the last impact, that of the rest; and whole numbers, of which RESTING is IMPACT, CHATTER or REST
NOW, PLACE, VELOCITY, ANGLE, ETA, SINCE, ALOFT, RESTED, NUMBERS = range(9)
UP, LEFT, RESTING, CODE, POWER, LETTER, ROW, WHOLE, MADE, HITS, BOUNCES, STEPS, FATE, COUNTS = range(14)


class Law(NamedTuple):
    """Flights z'' = -k z - c z' + f(t), the grid in time, and the noise."""

    stiffness: float  #: k
    damping: float  #: c
    step: float  #: from grid point to grid point
    sigma: float  #: standard deviation of the noise


class Realisation(NamedTuple):
    """Arrays for n returns of one orbit."""

    states: Any  #: shape (n + 1, 2), the start first
    turns: Any  #: shape (n, 2)
    codes: Any  #: shape (n,)
    outcome: Any  #: shape (n,)
    time: Any  #: shape (n,), of each return
    eta: Any  #: shape (n + 1,), the noise
    impacts: Any  #: shape (k, 3), of the first impacts: the wall, 0 for the base wall; speed; phase


class Step(NamedTuple):
    """What one step from grid point to grid point takes."""

    p: Any  #: a Flow
    law: Law
    noise: tuple[float, float, float, float]  #: n as `quintic` over the step
    chatter: float


@inner
def next_wall(p, ball, count, n, end):
    """The next impact before the end: (time until then, or infinity; True on the upper wall)."""
    has_up, has_down, _ = walls_of(p)
    top, bottom = wall_places(p)
    left, above, below = 0 if count[LEFT] == 0 else 1 if count[UP] else -1, math.inf, math.inf
    if has_up:
        above = time_to_same_wall(p, n, 1.0, end) if left > 0 else time_to_wall(p, n, 1.0, top - ball[PLACE], end)
    if has_down:
        below = time_to_same_wall(p, n, -1.0, end) if left < 0 else time_to_wall(p, n, -1.0, ball[PLACE] - bottom, end)
    return (above, True) if above <= below else (below, False)


@inner
def pressing(step, ball, up, w, s):
    """The acceleration into a wall a time s into the step, at velocity w."""
    p, n = step.p, expand_about(step.noise, s)
    begin(p, angle(phase_at(p, ball[ANGLE], s)), wall_place(p, up), w)
    a, _, _, _ = start(p)
    force = a + 2.0 * n.second + step.law.damping * n.rate + step.law.stiffness * n.value
    return force if up else -force


@inner
def time_to_release(step, ball, up):
    """The time in the step at which a wall no longer presses, or infinity."""
    low, high = ball[NOW], step.law.step
    if pressing(step, ball, up, 0.0, low) <= 0.0:
        return low
    if pressing(step, ball, up, 0.0, high) > 0.0:
        return math.inf
    for _ in range(HALVINGS):
        s = 0.5 * (low + high)
        if pressing(step, ball, up, 0.0, s) > 0.0:
            low = s
        else:
            high = s
    return high


@inner
def bounce(step, ball, count, v):
    """Leave the wall after an impact of speed v, or come to rest on it: at once, or after chatter that is summed."""
    p, up = step.p, count[UP] == 1
    into = 1.0 if up else -1.0
    u, _ = rebound(p, up, v)
    u = 0.0 if u < NO_SPEED else u
    ball[PLACE], ball[VELOCITY], count[LEFT], count[RESTING] = wall_place(p, up), -into * u, 1, 0
    ball[ALOFT], ball[RESTED] = -ball[NOW], 0.0
    press = pressing(step, ball, up, -into * u, ball[NOW])
    if press > 0.0:
        if u == 0.0:
            count[RESTING] = REST
        elif u < v and may_be_summed(p, up, v, step.chatter, press):
            begin(p, angle(phase_at(p, ball[ANGLE], ball[NOW])), ball[PLACE], -into * u)
            bounds = limits(p, 0.0)
            x, summable = accumulation(u, v, press, bounds.jerk, bounds.snap)
            if summable and keeps_ratio(p, up, u, u / v, x * phase_rate(p)):
                count[RESTING], ball[NOW] = CHATTER, min(ball[NOW] + x, step.law.step)


@inner
def word_of(count):
    """The word of the return under way."""
    return Word(count[CODE], count[POWER], count[LETTER], count[ROW])


@inner
def record_impact(p, ball, count, up, v, impacts):
    """Record an impact in the word and in the list of impacts."""
    same, letter = up == (count[UP] == 1), BASE if up == on_top(p) else OTHER
    count[CODE], count[POWER], count[LETTER], count[ROW] = append_impact(word_of(count), base_of(p), same, letter)
    count[UP] = up
    count[BOUNCES] += 1
    if count[HITS] < len(impacts):
        impacts[count[HITS]] = 0.0 if up == on_top(p) else 1.0, v, phase_at(p, ball[ANGLE], ball[NOW])
        count[HITS] += 1


@inner
def write_return(step, ball, count, v, how, out):
    """Write one return of the ball, which stands on the base wall."""
    p, i, word, n, law = step.p, count[MADE], word_of(count), expand_about(step.noise, ball[NOW]), step.law
    after = i + 1
    out.codes[i], _ = append_symbol(word.code, word.place_value, base_of(p), word.letter, word.row)
    phi, whole = phase_and_turns(p, ball[ANGLE], ball[NOW])
    out.states[after, SPEED], out.states[after, PHASE] = v, phi
    out.turns[i, SPEED], out.turns[i, PHASE] = 0, count[WHOLE] + whole
    eta = 2.0 * n.second + law.damping * n.rate + law.stiffness * n.value
    out.outcome[i], out.time[i], out.eta[after] = how, ball[SINCE] + ball[NOW], eta
    count[CODE], count[POWER], count[LETTER], count[ROW] = Word(0, 1, BASE, 1)
    count[BOUNCES], count[WHOLE], count[MADE], ball[SINCE] = 0, -whole, after, -ball[NOW]


@inner
def advance(step, ball, count, out):
    """Advance through one step: every impact and release in it, up to the last return for which there is room."""
    p, h = step.p, step.law.step
    while count[MADE] < len(out.codes) and count[BOUNCES] <= MOST_IMPACTS:
        if count[RESTING]:
            s = time_to_release(step, ball, count[UP] == 1)
            if s == math.inf:
                break
            ball[NOW] = s
        n = expand_about(step.noise, ball[NOW])
        begin(
            p, angle(phase_at(p, ball[ANGLE], ball[NOW])), ball[PLACE] - n.value, ball[VELOCITY] * (count[RESTING] == 0) - n.rate
        )
        left = h - ball[NOW]
        x, up = next_wall(p, ball, count, n, left)
        if x == 0.0 or left <= 0.0:  # it does not lift off
            count[RESTING] = max(count[RESTING], REST * (left > 0.0))
            break
        if count[RESTING]:
            ended = count[RESTING]
            count[CODE], count[POWER], count[LETTER], count[ROW] = append_rest(word_of(count), base_of(p), ended)
            count[RESTING], count[LEFT], ball[VELOCITY], ball[ALOFT] = 0, 1, 0.0, -ball[NOW]
            if (count[UP] == 1) == on_top(p):
                write_return(step, ball, count, 0.0, STUCK, out)
                continue
        d, v = position_at(p, n, min(x, left))
        if x == math.inf:
            ball[PLACE], ball[VELOCITY], count[LEFT] = ball[PLACE] + d, v, 0
            break
        ball[NOW] += x
        v = max(v if up else -v, 0.0)
        record_impact(p, ball, count, up, v, out.impacts)
        if up == on_top(p):
            write_return(step, ball, count, v, RETURNED, out)
        bounce(step, ball, count, v)


@entry
def prepare(p, ball, count, eta, out):
    """Prepare a ball for its first step, with the noise at its start.

    Its record has the shapes (NUMBERS,) and (COUNTS,).
    """
    v, phi = out.states[START, SPEED], out.states[START, PHASE]
    ball[ANGLE], ball[ETA], out.eta[START] = phi, eta, eta
    count[CODE], count[POWER], count[LETTER], count[ROW] = Word(0, 1, BASE, 1)
    count[UP], count[WHOLE] = on_top(p), 0
    count[FATE] = UNDER_WAY if is_state(v, phi) else INVALID


@entry
def noisy_orbit(step, discretisation, normals, ball, count, out):
    """Advance through as many steps as there are normals, shape (steps, parts, 3), or as there is room for returns.

    `discretisation` is the law of (n, n', eta) over a part of a step: transition and root of the covariance, shape (2, 3, 3).
    """
    p, law = step.p, step.law
    h, period = law.step, TWO_PI / phase_rate(p)
    max_flight = min(horizon(p), LONGEST_FLIGHT * period)
    max_rest = max_flight if law.sigma > 0.0 else ROUND_THE_CIRCLE * period + 2.0 * h
    for k in range(len(normals)):
        if count[FATE] != UNDER_WAY or count[MADE] == len(out.codes):
            break
        a, b, last = noise_over(normals[k], discretisation, ball[ETA])
        q = quintic(h, ball[ETA], a, b, last - law.stiffness * a - law.damping * b)
        now = Step(p, law, q, step.chatter)
        if count[STEPS] == 0:
            ball[ANGLE], count[WHOLE] = phase_and_turns(p, ball[ANGLE], 0.0)
            bounce(now, ball, count, out.states[START, SPEED])
        advance(now, ball, count, out)
        if count[RESTING]:
            ball[RESTED], ball[ALOFT] = ball[RESTED] + h, -h
        if ball[RESTED] > max_rest:
            count[FATE] = RESTS
        elif count[BOUNCES] > MOST_IMPACTS:
            count[FATE] = ENDLESS
        elif ball[ALOFT] > max_flight:
            count[FATE] = LOST
        ball[ANGLE], whole = phase_and_turns(p, ball[ANGLE], h)
        ball[NOW], ball[ETA], ball[SINCE], ball[ALOFT] = 0.0, last, ball[SINCE] + h, ball[ALOFT] + h
        count[WHOLE] += whole
        count[STEPS] += 1
