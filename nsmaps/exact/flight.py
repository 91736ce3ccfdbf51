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
OUTWARD, INWARD = 1.0 + 1e-12, 1.0 - 1e-12  # what bounds are raised by, and steps shortened by, against rounding
THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0  # a product is cheaper than a division


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def first_step(u, b, j, jerk, snap):
    """A step from the wall just left, at speed u >= 0 and acceleration b, within which the gap stays positive.

    The known root at zero is divided out: gap/h >= u + b h/2 - m h^2/6, with m >= -(the jerk over the step).
    """
    if b < 0.0:
        reach = -2.0 * u / b
        m = min(max(snap * reach * 0.25 - j, 0.0), jerk)
        return 2.0 * u / (math.sqrt(b * b * 0.25 + 2.0 * m * u * THIRD) - b * 0.5)
    if jerk == 0.0:
        return HORIZON
    far = 3.0 * (b * 0.5 + math.sqrt(b * b * 0.25 + 2.0 * jerk * u * THIRD)) / jerk
    return max(far, 2.0 * j / snap) if snap > 0.0 else far


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def quadratic_root(y, u, b):
    """The first h > 0 with y + u h + b h^2/2 = 0, or infinity."""
    d = u * u - 2.0 * y * b
    if d < 0.0:
        return math.inf
    if u > 0.0:
        return -(u + math.sqrt(d)) / b if b < 0.0 else math.inf
    q = math.sqrt(d) - u
    return 2.0 * y / q if q > 0.0 else math.inf


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def safe_step(y, u, b, j, jerk, snap):
    """A step within which a gap y > 0 with rates u, b, j stays positive, given bounds on |jerk| and |snap|.

    Within h <= reach the gap is at least y + u h + (b - m reach/3) h^2/2, m = max(snap reach/4 - j, 0) or the bound on jerk.
    """
    reach = quadratic_root(y, u, b)
    if reach < math.inf:
        m = min(max(snap * reach * 0.25 - j, 0.0), jerk)
        return quadratic_root(y, u, b - m * reach * THIRD)
    if jerk == 0.0:
        return HORIZON
    # The wall recedes or will turn before it is met: b > 0, or y and b vanish together.
    step = 0.0
    d = b * b + 2.0 * jerk * u
    if d >= 0.0:
        root = math.sqrt(d)
        turn = -2.0 * u / (b + root) if u < 0.0 else 0.0
        if y + turn * (u + turn * (b * 0.5 - turn * jerk * SIXTH)) > 0.0:
            step = (b + root) / jerk  # beyond the lower cubic's minimum it rises until here
    reach = 3.0 * b / jerk
    step = max(step, min(reach, quadratic_root(y, u, 0.0)))
    step = max(step, min(2.0 * reach, quadratic_root(y, u, -b)))
    if 6.0 * y > jerk * (3.0 * reach) ** 3:  # so far away, or so little bent, that jerk alone decides
        reach = (6.0 * y / jerk) ** THIRD
        step = max(step, min(reach, quadratic_root(y, u, b - jerk * reach * THIRD)))
    return step


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def stays_clear(y, u, b, jerk, h):
    """Does a gap y > 0 that does not shrink at first, u >= 0, surely stay positive for a time h: a concave or single hump."""
    return u >= 0.0 and y + h * (u + h * (b * 0.5 - h * jerk * SIXTH)) > 0.0


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def approach(y, u, b, j, jerk, snap, error):
    """What is known of a gap y >= 0, right to `error`, with rates u, b, j: (will it surely close, after about x).

    Surely: once and without a turn, within 1.25 x. Where that is not sure, x is a step within which the gap stays positive.
    """
    most, least = y + error, max(y - error, 0.0)
    d = u * u - 2.0 * most * b
    if d > 0.0 and u < 0.0:
        x = 2.0 * most / (math.sqrt(d) - u)
        far = 1.25 * x
        highest = most + far * (u + far * (b * 0.5 + far * min(jerk, j + snap * far * 0.25) * SIXTH))
        fastest = u + far * (b + far * max(min(jerk, j + snap * far * THIRD), 0.0) * 0.5)
        if highest < 0.0 and fastest < 0.0:
            return True, x
    return False, safe_step(least, u, b, j, jerk, snap)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def certain_return(u, b, j, jerk, snap):
    """As `approach`, for the wall just left with acceleration b < 0 back into it: sure where the gap is concave throughout."""
    x = -2.0 * u / b
    far = 1.5 * x
    highest = u + far * (b * 0.5 + far * min(jerk, j + snap * far * 0.25) * SIXTH)
    bend = max(min(jerk, j + snap * far * 0.5), 0.0)
    return x > 0.0 and highest < 0.0 and b + far * bend < 0.0, x


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def taylor_root(y, u, b, j, k, q, x):
    """The root of the gap's Taylor polynomial (rates u, b, j, snap k, crackle q) near x by two steps of Newton, and its rate."""
    rate = u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * (SIXTH * 0.25))))
    left = y + x * (u + x * (b * 0.5 + x * (j * SIXTH + x * (k * (SIXTH * 0.25) + x * q * (SIXTH * 0.05)))))
    slope = 1.0 / rate
    x -= left * slope
    rate = u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * (SIXTH * 0.25))))
    left = y + x * (u + x * (b * 0.5 + x * (j * SIXTH + x * (k * (SIXTH * 0.25) + x * q * (SIXTH * 0.05)))))
    x -= left * slope * (2.0 - rate * slope)  # 1/rate to second order, without another division
    return x, u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * (SIXTH * 0.25))))


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def ahead(to_up, room_up, room_down, d, v, a, j, k, q):
    """The gap to a wall, and its rates."""
    if to_up:
        return room_up - d, -v, -a, -j, -k, -q
    return room_down + d, v, a, j, k, q


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def refine(c, to_up, room_up, room_down, s, x, gap, pop):
    """The one crossing of a gap with these rates between s and s + 1.5 x, to rounding: (its time, the gap's rate).

    Each step goes to the root of a Taylor polynomial of fifth order; the last is that whose speed cannot be wrong by more than
    rounding. Steps that leave the bracket, or do not shrink, halve it.
    """
    low, high = s, s + 1.5 * x
    y, u, b, j, k, q = gap
    rate = u
    for _ in range(200):
        before = x
        x, rate = taylor_root(y, u, b, j, k, q, x)
        size = abs(x)
        if size * size * (size * size * size) * pop <= -120.0 * ROUNDING * rate or size <= ROUNDING * s:
            break
        if not low < s + x < high:
            x = (low + high) * 0.5 - s
        s += x
        d, v, a, j, k, q = evaluate(c, s)
        y, u, b, j, k, q = ahead(to_up, room_up, room_down, d, v, a, j, k, q)
        low, high = (s, high) if y > 0.0 else (low, s)
        x = -y / u
        if not abs(x) < 0.5 * abs(before):
            x = (low + high) * 0.5 - s
    return s + x, rate


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def leave(u, b, j, room, jerk, snap):
    """The start of a flight at speed u into free room: (does it surely return to the wall just left, after about x).

    Where that is not sure, x is a step safe from both walls.
    """
    if b < 0.0:
        surely, x = certain_return(u, b, j, jerk, snap)
        far = 1.5 * x
        if surely and room - far * (u + far * far * jerk * SIXTH) > 0.0:
            return True, x
    h = safe_step(room, -u, -b, -j, jerk, snap)
    if u > 0.0 and u + h * (b * 0.5 - h * jerk * SIXTH) > 0.0:  # the wall just left stays behind
        return False, h
    return False, min(h, first_step(u, b, j, jerk, snap))


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=True)
def look(gap, behind, jerk, snap, error, error_behind):
    """What is ahead at this gap, `behind` being that to the other wall, both right to an error: (will it surely close, x).

    Then x is about when; where it is not sure, x is a step safe from both walls.
    """
    y, u, b, j, _, _ = gap
    surely, x = approach(y, u, b, j, jerk, snap, error)
    least = max(behind - error_behind, 0.0)
    if not (HAS_UP and HAS_DOWN) or stays_clear(least, -u, -b, jerk, 1.5 * x if surely else x):
        return surely, x
    other = safe_step(least, -u, -b, -j, jerk, snap)
    return False, min(other, safe_step(max(y - error, 0.0), u, b, j, jerk, snap))


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def doubtful(rate, back, s, w, most, room):
    """Is an arc beyond the wall, at least rate^2/(2 most) deep, within the gap's rounding: relative to the wall just left."""
    scale = s * (abs(w) + s * most) if back else room
    return rate * rate <= 16.0 * ROUNDING * scale * most


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def flight(p, c, up, w, first, limits):
    """The first impact after leaving a wall: (found, on the upper wall, time, impact speed, undecided).

    A march: no step can carry the gap to either wall through zero, and steps close in on a root at third order. It ends where
    the wall will surely be met, once and without a turn: then the root is refined to rounding. Rounding is counted: the bounds
    are raised, the steps shortened, and a gap is taken less what it may be wrong by, which to the wall just left is relative.
    """
    top, bottom = wall_places(p)
    z = top if up else bottom
    jerk, snap, pop = limits[0] * OUTWARD, limits[1] * OUTWARD, limits[3] * OUTWARD
    a, j, k, q = first
    room_up, room_down = top - z, z - bottom
    room = math.inf if not (HAS_UP and HAS_DOWN) else room_down if up else room_up
    to_up, s, undecided, error = up, 0.0, False, 0.0
    gap = ahead(up, 0.0, 0.0, 0.0, w, a, j, k, q)
    if gap[1] == 0.0 and gap[2] < 0.0:
        gap = 0.0, 0.0, 0.0, gap[3], gap[4], gap[5]  # released: the acceleration is zero but for rounding
    surely, h = leave(gap[1], gap[2], gap[3], room, jerk, snap)
    for _ in range(MOST_STEPS):
        if surely:
            s, rate = refine(c, to_up, room_up, room_down, s, h, gap, pop)
            return True, to_up, s, max(-rate, 0.0), undecided or doubtful(rate, to_up == up, s, w, abs(a) + s * jerk, room)
        if h <= ROUNDING * s:
            if gap[0] <= 0.0:
                rate = gap[1]
                return True, to_up, s, max(-rate, 0.0), undecided or doubtful(rate, to_up == up, s, w, abs(a) + s * jerk, room)
            undecided = True  # a graze within rounding: pass it, to where the wall recedes again
            h = 4.0 * ROUNDING * s
            if gap[2] > 0.0:
                h += 2.0 * (abs(gap[1]) + math.sqrt(2.0 * gap[2] * error)) / gap[2]
        s += h * INWARD
        if not s < HORIZON:
            break
        d, v, a_s, j, k, q = evaluate(c, s)
        to_up = HAS_UP and (v > 0.0 or not HAS_DOWN)
        gap = ahead(to_up, room_up, room_down, d, v, a_s, j, k, q)
        near = ROUNDING * s * (abs(w) + s * (abs(a) + s * jerk))
        error, error_behind = (near, near + ROUNDING * room) if to_up == up else (near + ROUNDING * room, near)
        surely, h = look(gap, room_down + d if to_up else room_up - d, jerk, snap, error, error_behind)
    return False, up, s, 0.0, undecided


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "nsz"})
def release(p, phi, up):
    """How long the ball rests on a wall from phase phi on, or infinity: the first time that the wall no longer presses."""
    top, bottom = wall_places(p)
    z = top if up else bottom
    into = 1.0 if up else -1.0
    c = coefficients(p, phi, z, 0.0)
    snap = bounds(p, phi, z, 0.0)[1] * OUTWARD
    period = TWO_PI / phase_rate(p)
    s = 0.0
    for _ in range(MOST_STEPS):
        _, _, a, jk, _, _ = evaluate(c, s)
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
