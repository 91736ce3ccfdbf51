"""The first impact of a flight, with a certificate: no step of the march can carry the ball through a wall.

This file is not imported: `kernel.py` copies what stands below the mark, behind the functions that it generates for a system
(`flow.py`), into one module, so that numba compiles and caches them together.
"""

import math

from numba import njit

from nsmaps.exact.flow import HAS_DOWN, HAS_UP, HORIZON, bounds, coefficients, evaluate, phase_rate, wall_places

# === engine ===

TWO_PI = 2 * math.pi
MOST_STEPS = 100_000  # of one flight; reached only by flights that skim a wall for ever
ROUNDING = 1e-15  # a few units in the last place


@njit(cache=True, nogil=True, error_model="numpy")
def first_step(u, b, j, jerk, snap):
    """A step from the wall just left, at speed u >= 0 and acceleration b, within which the gap stays positive.

    The known root at zero is divided out: gap/h >= u + b h/2 - m h^2/6, with m >= -(the jerk over the step).
    """
    if b < 0.0:
        reach = -2.0 * u / b
        m = min(max(snap * reach / 4.0 - j, 0.0), jerk)
        return 2.0 * u / (math.sqrt(b * b / 4.0 + 2.0 * m * u / 3.0) - b / 2.0)
    if jerk == 0.0:
        return HORIZON
    far = 3.0 * (b / 2.0 + math.sqrt(b * b / 4.0 + 2.0 * jerk * u / 3.0)) / jerk
    return max(far, 2.0 * j / snap) if snap > 0.0 else far


@njit(cache=True, nogil=True, error_model="numpy")
def quadratic_root(y, u, b):
    """The first h > 0 with y + u h + b h^2/2 = 0, or infinity."""
    d = u * u - 2.0 * y * b
    if d < 0.0:
        return math.inf
    q = math.sqrt(d) - u
    return 2.0 * y / q if q > 0.0 else math.inf


@njit(cache=True, nogil=True, error_model="numpy")
def safe_step(y, u, b, j, jerk, snap):
    """A step within which a gap y > 0 with rates u, b, j stays positive, given bounds on |jerk| and |snap|.

    Within h <= reach the gap is at least y + u h + (b - m reach/3) h^2/2, m = max(snap reach/4 - j, 0) or the bound on jerk.
    """
    reach = quadratic_root(y, u, b)
    if reach < math.inf:
        m = min(max(snap * reach / 4.0 - j, 0.0), jerk)
        return quadratic_root(y, u, b - m * reach / 3.0)
    if jerk == 0.0:
        return HORIZON
    # The wall recedes or will turn before it is met: b > 0, or y and b vanish together.
    step = 0.0
    d = b * b + 2.0 * jerk * u
    if d >= 0.0:
        root = math.sqrt(d)
        turn = -2.0 * u / (b + root) if u < 0.0 else 0.0
        if y + turn * (u + turn * (b / 2.0 - turn * jerk / 6.0)) > 0.0:
            step = (b + root) / jerk  # beyond the lower cubic's minimum it rises until here
    for reach in (3.0 * b / jerk, 6.0 * b / jerk, max((6.0 * y / jerk) ** (1.0 / 3.0), step)):
        step = max(step, min(reach, quadratic_root(y, u, b - jerk * reach / 3.0)))
    return step


@njit(cache=True, nogil=True, error_model="numpy")
def polish(y, u, b, j, h):
    """The root of y + u h + b h^2/2 + j h^3/6 next to h, and the rate there."""
    for _ in range(4):
        rate = u + h * (b + h * j / 2.0)
        move = (y + h * (u + h * (b / 2.0 + h * j / 6.0))) / rate
        if not abs(move) <= abs(h):
            break
        h -= move
        if abs(move) <= ROUNDING * abs(h):
            break
    return h, u + h * (b + h * j / 2.0)


@njit(cache=True, nogil=True, error_model="numpy")
def polish_start(u, b, j, h):
    """The root of u + b h/2 + j h^2/6 next to h, and the rate of the gap there."""
    for _ in range(4):
        move = (u + h * (b / 2.0 + h * j / 6.0)) / (b / 2.0 + h * j / 3.0)
        if not abs(move) <= abs(h):
            break
        h -= move
        if abs(move) <= ROUNDING * abs(h):
            break
    return h, u + h * (b + h * j / 2.0)


@njit(cache=True, nogil=True, error_model="numpy")
def leave(c, up, w, room_up, room_down, jerk, snap):
    """The start of a flight: (is the impact found, its time or a safe first step, impact speed).

    It is found at once where the ball comes back to the wall so soon that three terms of Taylor give it to rounding.
    """
    _, _, a, jk = evaluate(c, 0.0)
    left = -1.0 if up else 1.0  # sign of the gap to the wall just left, in displacement
    u, b, j = left * w, left * a, left * jk
    if u == 0.0 and b < 0.0:
        b = 0.0  # released: the acceleration is zero but for rounding
    h = first_step(u, b, j, jerk, snap)
    if up and HAS_DOWN:
        free = safe_step(room_down, w, a, jk, jerk, snap)
    elif not up and HAS_UP:
        free = safe_step(room_up, -w, -a, -jk, jerk, snap)
    else:
        free = math.inf
    if b < 0.0:
        x, rate = polish_start(u, b, j, h)
        if snap * x * x * x <= ROUNDING * -rate and x <= free:
            return True, x, -rate
    return False, min(h, free), 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_wall(room_up, room_down, d, v, a, jk, jerk, snap):
    """The wall that may be met first: (is it the upper, a step safe for both, its gap and the gap's rates)."""
    up = safe_step(max(room_up - d, 0.0), -v, -a, -jk, jerk, snap) if HAS_UP else math.inf
    down = safe_step(max(room_down + d, 0.0), v, a, jk, jerk, snap) if HAS_DOWN else math.inf
    if up <= down:
        return True, up, room_up - d, -v, -a, -jk
    return False, down, room_down + d, v, a, jk


@njit(cache=True, nogil=True, error_model="numpy")
def flight(p, c, up, w, jerk, snap):
    """The first impact after leaving a wall: (found, on the upper wall, time, impact speed, undecided).

    A march: no step can carry the gap to either wall through zero, and steps close in on a root at third order. It ends when
    the Taylor polynomial of third order gives the impact to rounding.
    """
    top, bottom = wall_places(p)
    z = top if up else bottom
    room_up, room_down = top - z, z - bottom
    found, h, speed = leave(c, up, w, room_up, room_down, jerk, snap)
    if found:
        return True, up, h, speed, False
    s = 0.0
    undecided = False
    for _ in range(MOST_STEPS):
        s += h
        if not s < HORIZON:
            break
        d, v, a, jk = evaluate(c, s)
        to_up, h, y, u, b, j = nearest_wall(room_up, room_down, d, v, a, jk, jerk, snap)
        stalled = h <= ROUNDING * s
        if u < 0.0 and (h * h * h * snap <= 0.01 * -u or stalled):
            x, rate = polish(y, u, b, j, h if y > 0.0 else y / -u)
            if rate < 0.0 and (abs(x * x * x) * snap <= ROUNDING * -rate or stalled):
                # how deep the arc beyond the wall is, against the gap's rounding: to the wall just left that is relative
                scale = s * (abs(w) + s * abs(a)) if to_up == up else room_up + room_down
                return True, to_up, s + x, -rate, undecided or rate * rate <= 16.0 * ROUNDING * scale * abs(b)
        if stalled:  # a graze within rounding: the wall is touched, or passed, as one likes
            if y <= 0.0 and u <= 0.0:
                return True, to_up, s, max(-u, 0.0), True
            undecided = True
            h = 4.0 * ROUNDING * s
    return False, up, s, 0.0, undecided


@njit(cache=True, nogil=True, error_model="numpy")
def release(p, phi, up):
    """How long the ball rests on a wall from phase phi on, or infinity: the first time that the wall no longer presses."""
    top, bottom = wall_places(p)
    z = top if up else bottom
    into = 1.0 if up else -1.0
    c = coefficients(p, phi, z, 0.0)
    _, snap = bounds(p, phi, z, 0.0)
    period = TWO_PI / phase_rate(p)
    s = 0.0
    for _ in range(MOST_STEPS):
        _, _, a, jk = evaluate(c, s)
        press, rate = into * a, into * jk
        if press <= 0.0 and rate < 0.0:
            return max(s - press / rate, 0.0)
        press = max(press, 0.0)
        if snap == 0.0 and rate >= 0.0:
            return math.inf
        h = 2.0 * press / (math.sqrt(rate * rate + 2.0 * snap * press) - rate) if press > 0.0 else 2.0 * rate / snap
        if rate < 0.0 and snap * h * h <= 1e-17 * period * -rate:
            return s - press / rate
        s += h
        if s > 1.000001 * period:
            break
    return math.inf
