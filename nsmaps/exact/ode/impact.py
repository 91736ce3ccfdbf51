"""What happens at a wall: the start of a flight, rest and chatter until the release, and derivatives through impacts."""

import math

from nsmaps.exact.engine.constants import NO_SPEED, TWO_PI
from nsmaps.exact.engine.flight.flow import phase_rate, rebound, wall_places
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.returns import CHATTER, FOREVER, IMPACT, REST, steady, summed
from nsmaps.exact.modes.march.zeros import limits
from nsmaps.exact.ode.flight import series_of
from nsmaps.exact.ode.integrator import PLACE, PLACE_RATE, TIME
from nsmaps.exact.ode.layout import (
    BEFORE,
    BOTH,
    FLOWN,
    FRESH,
    PHI,
    PLACES,
    SINCE,
    SPEED,
    STEP_PHI,
    UP,
    VELOCITIES,
    VELOCITY,
    WAYS,
)
from nsmaps.exact.ode.steps.resolution import resolved

SHORT = 1e-13  #: of a period: a rest that is rounding
EXACT_JERK, EXACT_SNAP = 1e-5, 1e-10  #: by which jerk and snap may change the acceleration within chatter that is summed


@inner
def resting(phases, phi, rate):
    """The time from phase phi in [0, 2 pi) on for which a wall presses on a ball at rest; zero if it does not, up to rounding."""
    for i in range(len(phases)):
        for turn in range(2):
            at = phi + turn * TWO_PI
            if phases[i, 0] <= at and at < phases[i, 1]:
                return (phases[i, 1] - at) / rate
    return 0.0


@inlined
def place_at(w, k):
    """Let the integrator begin a step of lane k where its displacement and velocity are."""
    by = (len(w.state) - 2) // 2
    for i in range(2, len(w.state)):
        w.state[i, k] = 0.0
    w.state[2, k], w.state[3 + by, k] = 1.0, 1.0
    w.pars[TIME, k] = w.lanes[k, STEP_PHI] / phase_rate(w.p)


@inner
def take_off(w, k):
    """Begin the flight of lane k after the impact that it has made."""
    lane, up = w.lanes[k], w.counts[k, UP] == 1
    top, bottom = wall_places(w.p)
    top_rate, bottom_rate = wall_places(w.moved)
    u, slope = rebound(w.p, up, lane[SPEED])
    u_rate = rebound(w.moved, up, lane[SPEED])[0]
    into = 1.0 if up else -1.0
    u = u if u >= NO_SPEED else 0.0
    lane[VELOCITY], lane[FLOWN], lane[STEP_PHI] = -into * u, 0.0, lane[PHI]
    lane[PLACES], lane[BOTH], lane[VELOCITIES] = 0.0, 0.0, 0.0
    w.counts[k, FRESH] = 1
    w.pars[PLACE, k], w.pars[PLACE_RATE, k] = (top, top_rate) if up else (bottom, bottom_rate)
    w.state[0, k], w.state[1, k] = 0.0, lane[VELOCITY]
    for j in range(WAYS):
        lane[SINCE + j] = 0.0
        lane[SINCE + WAYS + j] = -into * (slope * lane[BEFORE + j] + (u_rate if j == 2 else 0.0))
    place_at(w, k)


@inlined
def chatter_time(w, k, v, u, press):
    """The time after which impacts of speeds v, u, ... accumulate, or zero where that is not exact to rounding.

    It is that of `nsmaps.exact.engine.returns.next_impact`, with bounds on jerk and snap by the flight's own series.
    """
    up, a, tc = w.counts[k, UP] == 1, w.series[0], w.tc
    into, by = 1.0 if up else -1.0, (len(w.state) - 2) // 2
    x = 2.0 * u / (press * (1.0 - u / v))
    if not (steady(w.p, up, u, u / v, x * phase_rate(w.p)) and resolved(w, k, min(x, 2.0 * u / press))):
        return 0.0
    series_of(tc, 0, k, 1.0, a)
    _, jerk, snap = limits(a, x)
    if not (x * jerk <= EXACT_JERK * press and x * x * snap <= EXACT_SNAP * press):
        return 0.0
    r, j, beta = u / v, into * 6.0 * a[3], into * tc[4 + by, 1, k]
    return x + x * x * (j * (2.0 * r - 1.0) / 3.0 - beta * r - (j - beta) * r * (1.0 - r) / 2.0) / (press * (1.0 + r))


@inner
def held_back(w, k):
    """Whether the ball of lane k stays at the wall instead of flying: (IMPACT for a flight, else how and for how long)."""
    lane, count = w.lanes[k], w.counts[k]
    up, rate, v, u = count[UP] == 1, phase_rate(w.p), lane[SPEED], abs(lane[VELOCITY])
    into, phases = (1.0, w.pressing[1]) if up else (-1.0, w.pressing[0])
    press, rise = into * w.tc[1, 1, k], into * w.tc[1, 2, k]
    if u == 0.0 and (press > 0.0 or (press == 0.0 and rise > 0.0)):
        pause = resting(phases, lane[PHI], rate)
        if pause > SHORT * TWO_PI / rate:
            return FOREVER if pause == math.inf else REST, pause
    elif press > 0.0 and summed(w.p, up, v, w.chatter, press) and u < v:
        x = chatter_time(w, k, v, u, press)
        if x > 0.0:
            phi = lane[PHI] + x * rate
            pause = resting(phases, phi - math.floor(phi / TWO_PI) * TWO_PI, rate)
            return FOREVER if pause == math.inf else CHATTER, x + pause
    return IMPACT, 0.0


@inner
def carried(w, k, h):
    """Carry the derivatives of lane k through a step h, of which `evaluate` wrote the end."""
    lane, e = w.lanes[k], w.ends
    by, rate, rate_moved = (len(e) - 2) // 2, phase_rate(w.p), phase_rate(w.moved)
    for j in range(WAYS):
        place, velocity = lane[SINCE + j], lane[SINCE + WAYS + j]
        phi = lane[BEFORE + WAYS + j] + (rate_moved * lane[FLOWN] if j == 2 else 0.0)
        time = phi / rate - (lane[STEP_PHI] * rate_moved / (rate * rate) if j == 2 else 0.0)
        lane[SINCE + j] = e[2] * place + e[3] * velocity + e[4] * time
        lane[SINCE + WAYS + j] = e[2 + by] * place + e[3 + by] * velocity + e[4 + by] * time
        if j == 2 and by > WAYS:
            lane[SINCE + j] += e[2 + WAYS]
            lane[SINCE + WAYS + j] += e[2 + by + WAYS]


@inner
def through_impact(w, k, now_up, a):
    """The derivatives of speed and phase just before the impact in which the flight of lane k ends, by `carried` and its end."""
    lane, up = w.lanes[k], w.counts[k, UP] == 1
    top, bottom = wall_places(w.moved)
    wall = (top if up else bottom) - (top if now_up else bottom)
    rate, rate_moved, into = phase_rate(w.p), phase_rate(w.moved), 1.0 if now_up else -1.0
    for j in range(WAYS):
        later = -(lane[SINCE + j] + (wall if j == 2 else 0.0)) / w.ends[1]
        lane[BEFORE + j] = into * (a * later + lane[SINCE + WAYS + j])
        lane[BEFORE + WAYS + j] += rate * later + (rate_moved * lane[FLOWN] if j == 2 else 0.0)
