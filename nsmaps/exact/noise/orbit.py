"""Orbits under additive Ornstein-Uhlenbeck forcing, from grid point to grid point of its exact discretisation.

Flights obey z'' = -k z - c z' + f(t), and noise eta(t) is added to f. By superposition the place is that of the deterministic
flight plus n(t), n'' = eta - k n - c n', and (n, n', eta) is Gaussian and is drawn exactly at the grid points. Between them n is
the quintic through its value and two derivatives at either end. At impacts the deterministic flight starts anew, and the noise
continues.
"""

import math

from nsmaps.exact.engine.flight.bounds import limits
from nsmaps.exact.engine.flight.flow import angle, begin, horizon, phase_rate, rebound, start, wall_places, walls_of
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.returns import (
    INVALID,
    LOST,
    MOST_IMPACTS,
    NO_SPEED,
    RESTS,
    RETURNED,
    STUCK,
    TWO_PI,
    accumulation,
    is_state,
    onward,
    spell,
    steady,
    summed,
)
from nsmaps.exact.noise.flight import met_again, met_ahead, moved, noise_over, quintic, shifted

LONGEST_FLIGHT = 1000.0  # periods, if the system's horizon is longer
UNDER_WAY = -1  # the fate of a ball under way; others are values of Outcome
# The record of a ball: times in the step, at its start and of the return, and whole numbers
NOW, PLACE, VELOCITY, PHASE, ETA, SINCE, ALOFT, RESTED, NUMBERS = range(9)
UP, LEFT, RESTING, CODE, POWER, LETTER, RUN, WHOLE, MADE, HITS, BOUNCES, STEPS, FATE, COUNTS = range(14)


@inner
def next_wall(p, ball, count, n, end):
    """The next impact before the end: (time until then, or infinity; True on the upper wall)."""
    has_up, has_down, _ = walls_of(p)
    top, bottom = wall_places(p)
    left, above, below = 0 if count[LEFT] == 0 else 1 if count[UP] else -1, math.inf, math.inf
    if has_up:
        above = met_again(p, n, 1.0, end) if left > 0 else met_ahead(p, n, 1.0, top - ball[PLACE], end)
    if has_down:
        below = met_again(p, n, -1.0, end) if left < 0 else met_ahead(p, n, -1.0, ball[PLACE] - bottom, end)
    return (above, True) if above <= below else (below, False)


@inner
def pressing(p, law, ball, up, w, q, s):
    """The acceleration into a wall a time s into the step, at velocity w."""
    top, bottom = wall_places(p)
    n, m, a, _, _, _ = shifted(q, s)
    phi, _ = onward(p, ball[PHASE], s)
    begin(p, angle(phi), top if up else bottom, w)
    force = start(p)[0] + 2.0 * a + law[1] * m + law[0] * n
    return force if up else -force


@inner
def lift(p, law, ball, up, q, h):
    """The time in the step at which a wall no longer presses, or infinity."""
    low, high = ball[NOW], h
    if pressing(p, law, ball, up, 0.0, q, low) <= 0.0:
        return low
    if pressing(p, law, ball, up, 0.0, q, high) > 0.0:
        return math.inf
    for _ in range(60):
        s = 0.5 * (low + high)
        if pressing(p, law, ball, up, 0.0, q, s) > 0.0:
            low = s
        else:
            high = s
    return high


@inner
def bounce(p, law, ball, count, q, h, v, chatter):
    """Leave the wall after an impact of speed v, or come to rest on it: at once, or after chatter that is summed."""
    up = count[UP] == 1
    top, bottom = wall_places(p)
    into = 1.0 if up else -1.0
    u, _ = rebound(p, up, v)
    u = 0.0 if u < NO_SPEED else u
    ball[PLACE], ball[VELOCITY], count[LEFT], count[RESTING] = top if up else bottom, -into * u, 1, 0
    ball[ALOFT], ball[RESTED] = -ball[NOW], 0.0
    press = pressing(p, law, ball, up, -into * u, q, ball[NOW])
    if press > 0.0:
        if u == 0.0:
            count[RESTING] = 2
        elif u < v and summed(p, up, v, chatter, press):
            phi, _ = onward(p, ball[PHASE], ball[NOW])
            begin(p, angle(phi), ball[PLACE], -into * u)
            x, summable = accumulation(u, v, press, limits(p, 0.0))
            if summable and steady(p, up, u, u / v, x * phase_rate(p)):
                count[RESTING], ball[NOW] = 1, min(ball[NOW] + x, h)


@inner
def hit(p, ball, count, up, v, hits):
    """Record an impact in the word and in the list of impacts."""
    has_up, has_down, base_up = walls_of(p)
    base = 5 if has_up and has_down else 4
    if up != (count[UP] == 1):
        count[CODE], count[POWER] = spell(count[CODE], count[POWER], base, count[LETTER], count[RUN])
        count[LETTER], count[RUN] = 1 if up == base_up else 2, 0
    count[RUN] += 1
    count[UP] = up
    count[BOUNCES] += 1
    if count[HITS] < len(hits):
        hits[count[HITS]] = 0.0 if up == base_up else 1.0, v, onward(p, ball[PHASE], ball[NOW])[0]
        count[HITS] += 1


@inner
def released(p, count):
    """Record the end of a rest in the word."""
    has_up, has_down, _ = walls_of(p)
    walls = 2 if has_up and has_down else 1
    count[CODE], count[POWER] = spell(count[CODE], count[POWER], walls + 3, count[LETTER], 1)
    count[CODE], count[POWER] = spell(count[CODE], count[POWER], walls + 3, walls + count[RESTING], 1)
    count[RUN] = 0


@inner
def returned(p, ball, count, v, how, q, law, states, turns, codes, outcome, time, eta):
    """Write one return of the ball, which stands on the base wall."""
    has_up, has_down, _ = walls_of(p)
    i, base = count[MADE], 5 if has_up and has_down else 4
    codes[i], _ = spell(count[CODE], count[POWER], base, count[LETTER], count[RUN])
    phi, whole = onward(p, ball[PHASE], ball[NOW])
    n, m, a, _, _, _ = shifted(q, ball[NOW])
    states[i + 1, 0], states[i + 1, 1], turns[i, 0], turns[i, 1] = v, phi, 0, count[WHOLE] + whole
    outcome[i], time[i], eta[i + 1] = how, ball[SINCE] + ball[NOW], 2.0 * a + law[1] * m + law[0] * n
    count[CODE], count[POWER], count[LETTER], count[RUN], count[BOUNCES] = 0, 1, 1, 1, 0
    count[WHOLE], count[MADE], ball[SINCE] = -whole, i + 1, -ball[NOW]


@inner
def through(p, law, ball, count, q, h, chatter, hits, states, turns, codes, outcome, time, eta):
    """Advance through one step: every impact and release in it, up to the last return for which there is room."""
    base_up = walls_of(p)[2]
    while count[MADE] < len(codes) and count[BOUNCES] <= MOST_IMPACTS:
        if count[RESTING]:
            s = lift(p, law, ball, count[UP] == 1, q, h)
            if s == math.inf:
                break
            ball[NOW] = s
        n = shifted(q, ball[NOW])
        phi, _ = onward(p, ball[PHASE], ball[NOW])
        begin(p, angle(phi), ball[PLACE] - n[0], ball[VELOCITY] * (count[RESTING] == 0) - n[1])
        left = h - ball[NOW]
        x, up = next_wall(p, ball, count, n, left)
        if x == 0.0 or left <= 0.0:  # it does not lift off
            count[RESTING] = max(count[RESTING], 2 * (left > 0.0))
            break
        if count[RESTING]:
            released(p, count)
            count[RESTING], count[LEFT], ball[VELOCITY], ball[ALOFT] = 0, 1, 0.0, -ball[NOW]
            if (count[UP] == 1) == base_up:
                returned(p, ball, count, 0.0, STUCK, q, law, states, turns, codes, outcome, time, eta)
                continue
        d, v = moved(p, n, min(x, left))
        if x == math.inf:
            ball[PLACE], ball[VELOCITY], count[LEFT] = ball[PLACE] + d, v, 0
            break
        ball[NOW] += x
        v = max(v if up else -v, 0.0)
        hit(p, ball, count, up, v, hits)
        if up == base_up:
            returned(p, ball, count, v, RETURNED, q, law, states, turns, codes, outcome, time, eta)
        bounce(p, law, ball, count, q, h, v, chatter)


@entry
def ready(p, ball, count, sigma, normal, states, eta):
    """Prepare a ball for its first step."""
    ball[PHASE], ball[ETA], eta[0] = states[0, 1], sigma * normal, sigma * normal
    count[UP], count[POWER], count[LETTER], count[RUN], count[WHOLE] = walls_of(p)[2], 1, 1, 1, 0
    count[FATE] = UNDER_WAY if is_state(states[0, 0], states[0, 1]) else INVALID


@entry
def noisy_orbit(p, law, step, normals, chatter, ball, count, hits, states, turns, codes, outcome, time, eta):
    """Advance through as many steps as there are normals, shape (steps, parts, 3), or as there is room for returns."""
    h, period = law[2], TWO_PI / phase_rate(p)
    max_flight = min(horizon(p), LONGEST_FLIGHT * period)
    max_rest = max_flight if law[3] > 0.0 else 1.000001 * period + 2.0 * h
    for k in range(len(normals)):
        if count[FATE] != UNDER_WAY or count[MADE] == len(codes):
            break
        a, b, last = noise_over(normals[k], step, ball[ETA])
        q = quintic(h, ball[ETA], a, b, last - law[0] * a - law[1] * b)
        if count[STEPS] == 0:
            ball[PHASE], count[WHOLE] = onward(p, ball[PHASE], 0.0)
            bounce(p, law, ball, count, q, h, states[0, 0], chatter)
        through(p, law, ball, count, q, h, chatter, hits, states, turns, codes, outcome, time, eta)
        if count[RESTING]:
            ball[RESTED], ball[ALOFT] = ball[RESTED] + h, -h
        if ball[RESTED] > max_rest:
            count[FATE] = RESTS
        elif count[BOUNCES] > MOST_IMPACTS or ball[ALOFT] > max_flight:
            count[FATE] = LOST
        ball[PHASE], whole = onward(p, ball[PHASE], h)
        ball[NOW], ball[ETA], ball[SINCE], ball[ALOFT] = 0.0, last, ball[SINCE] + h, ball[ALOFT] + h
        count[WHOLE] += whole
        count[STEPS] += 1


@entry
def finish(count, states, turns, codes, outcome, time, eta):
    """Fill the tables of an orbit that ended."""
    for i in range(count[MADE], len(codes)):
        states[i + 1, 0], states[i + 1, 1], eta[i + 1], time[i] = math.nan, math.nan, math.nan, math.nan
        turns[i, 0], turns[i, 1], codes[i], outcome[i] = 0, 0, 0, count[FATE]
