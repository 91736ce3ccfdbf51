"""The first impact of a flight, with a certificate: no step of the march can carry the ball through a wall."""

import math

from nsmaps.exact.engine.flight.bounds import grown, limits
from nsmaps.exact.engine.flight.flow import evaluate, horizon, start, wall_places, walls_of
from nsmaps.exact.engine.flight.layout import LOCAL
from nsmaps.exact.engine.jit import inlined, inner

MOST_STEPS = 100_000  # of one flight; reached only by flights that stay close to a wall indefinitely
FAR = 1e300  # a step longer than any horizon
ROUNDING = 1e-15  # a few units in the last place
OUTWARD, INWARD = 1.0 + 1e-12, 1.0 - 1e-12  # factors by which bounds are enlarged, and steps shortened, against rounding
CLOUDED = 1e-10  # of the way flown: a flight whose gap may have a larger error is undecided
THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0  # a product is cheaper than a division


@inlined
def first_step(u, b, j, jerk, snap):
    """A step from the wall just left, at speed u >= 0 and acceleration b, within which the gap stays positive.

    The known root at zero is divided out: gap/h >= u + b h/2 - m h^2/6, with m >= -(the jerk over the step).
    """
    m = min(max(snap * (-2.0 * u / b) * 0.25 - j, 0.0), jerk) if b < 0.0 else jerk
    root = math.sqrt(b * b * 0.25 + 2.0 * m * u * THIRD)
    if b < 0.0:
        return 2.0 * u / (root - b * 0.5)
    if jerk == 0.0:
        return FAR
    far = 3.0 * (b * 0.5 + root) / jerk
    return max(far, 2.0 * j / snap) if snap > 0.0 else far


@inlined
def quadratic_root(y, u, b):
    """The first h > 0 with y + u h + b h^2/2 = 0, or infinity."""
    d = u * u - 2.0 * y * b
    root = math.sqrt(max(d, 0.0))
    over, under = (u + root, -b) if u > 0.0 else (2.0 * y, root - u)
    return over / under if d >= 0.0 and under > 0.0 else math.inf


@inlined
def safe_step(y, u, b, j, jerk, snap):
    """A step within which a gap y > 0 with rates u, b, j stays positive, given bounds on |jerk| and |snap|.

    Within h <= reach the gap is at least y + u h + (b - m reach/3) h^2/2, m = max(snap reach/4 - j, 0) or the bound on jerk.
    """
    reach, step = quadratic_root(y, u, b), 0.0
    m = min(max(snap * reach * 0.25 - j, 0.0), jerk)
    if not reach < math.inf:  # the wall recedes, or the gap has a minimum before it closes: b > 0, or y and b vanish together
        if jerk == 0.0:
            return FAR
        root = math.sqrt(max(b * b + 2.0 * jerk * u, 0.0))
        turn = min(u, 0.0) * -2.0 / (b + root) if b + root > 0.0 else 0.0
        if b * b + 2.0 * jerk * u >= 0.0 and y + turn * (u + turn * (b * 0.5 - turn * jerk * SIXTH)) > 0.0:
            step = (b + root) / jerk  # after the minimum of the lower cubic it rises until here
        reach, m, cube = 3.0 * b / jerk, jerk, 6.0 * y / jerk
        if cube >= reach * reach * reach:  # an estimate of the root of h^3 = reach h^2 + cube: any reach is valid
            root = math.sqrt(math.sqrt(cube))
            reach += root * math.sqrt(math.sqrt(root))
        else:
            reach += cube / (reach * reach)
    return max(step, min(reach, quadratic_root(y, u, b - m * reach * THIRD)))


@inlined
def stays_clear(y, u, b, jerk, h):
    """True if a gap y > 0 with u >= 0 certainly stays positive for a time h: concave, or with a single maximum."""
    return u >= 0.0 and y + h * (u + h * (b * 0.5 - h * jerk * SIXTH)) > 0.0


@inlined
def closes(gap, u, b, j, jerk, snap):
    """For a gap of at most `gap`, with rates u, b, j: (True if it certainly closes, once and without a minimum, within 1.25 x;
    x).
    """
    x = 2.0 * gap / (math.sqrt(max(u * u - 2.0 * gap * b, 0.0)) - u) if u < 0.0 else 0.0
    far = 1.25 * x
    highest = gap + far * (u + far * (b * 0.5 + far * min(jerk, j + snap * far * 0.25) * SIXTH))
    fastest = u + far * (b + far * max(min(jerk, j + snap * far * THIRD), 0.0) * 0.5)
    return u < 0.0 and highest < 0.0 and fastest < 0.0, x


@inlined
def approach(y, u, b, j, jerk, snap):
    """For a gap y >= 0 with rates u, b, j: (True if it certainly closes, near x), or else x is a safe step."""
    surely, x = closes(y, u, b, j, jerk, snap)
    return surely, x if surely else safe_step(y, u, b, j, jerk, snap)


@inlined
def certain_return(u, b, j, jerk, snap):
    """As `approach`, for the wall just left with acceleration b < 0 towards it: certain if the gap is concave throughout."""
    x = -2.0 * u / b
    far = 1.5 * x
    highest = u + far * (b * 0.5 + far * min(jerk, j + snap * far * 0.25) * SIXTH)
    bend = max(min(jerk, j + snap * far * 0.5), 0.0)
    return x > 0.0 and highest < 0.0 and b + far * bend < 0.0, x


@inlined
def taylor_root(gap, x):
    """The root of the gap's Taylor polynomial of fifth order near x by two Newton steps, and its rate."""
    y, u, b, j, k, q = gap
    rate = u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * (SIXTH * 0.25))))
    left = y + x * (u + x * (b * 0.5 + x * (j * SIXTH + x * (k * (SIXTH * 0.25) + x * q * (SIXTH * 0.05)))))
    slope = 1.0 / rate
    x -= left * slope
    rate = u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * (SIXTH * 0.25))))
    left = y + x * (u + x * (b * 0.5 + x * (j * SIXTH + x * (k * (SIXTH * 0.25) + x * q * (SIXTH * 0.05)))))
    x -= left * slope * (2.0 - rate * slope)  # 1/rate to second order, without another division
    return x, u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * (SIXTH * 0.25))))


@inlined
def ahead(to_up, room_up, room_down, motion):
    """The gap to a wall and its time derivatives, from displacement, velocity and further derivatives."""
    d, v, a, j, k, q = motion
    if to_up:
        return room_up - d, -v, -a, -j, -k, -q
    return room_down + d, v, a, j, k, q


@inlined
def converged(step, rate, s, pop):
    """True if the gap's Taylor polynomial at s, a step away from its root, is exact to rounding there, and its rate as well."""
    size = abs(step)
    return size * size * (size * size * size) * pop <= -120.0 * ROUNDING * rate or size <= ROUNDING * s


@inlined
def close_in(p, to_up, room_up, room_down, s, x, step, gap, low, high):
    """Move to the root of the last Taylor polynomial, and compute the root of the next: (its rate, the next time).

    The single crossing lies between low and high. Steps that leave this bracket, or do not shrink, bisect it.
    """
    s += step if low < s + step and s + step < high else (low + high) * 0.5 - s
    gap = ahead(to_up, room_up, room_down, evaluate(p, s))
    low, high = s if gap[0] > 0.0 else low, high if gap[0] > 0.0 else s
    newton = -gap[0] / gap[1]
    x = newton if abs(newton) < 0.5 * abs(x) else (low + high) * 0.5 - s
    step, rate = taylor_root(gap, x)
    return rate, (s, x, step, gap, low, high)


@inlined
def refine(p, to_up, room_up, room_down, s, x, gap, pop):
    """The single crossing of a gap with these rates between s and s + 1.5 x, to rounding: (its time, the gap's rate)."""
    step, rate = taylor_root(gap, x)
    at = s, x, step, gap, s, s + 1.5 * x
    for _ in range(200):
        if converged(at[2], rate, at[0], pop):
            break
        rate, at = close_in(p, to_up, room_up, room_down, *at)
    return at[0] + at[2], rate


@inlined
def leave(two, gap, room, jerk, snap):
    """The start of a flight: (True if it certainly returns to the wall just left, near x).

    Where that is not certain, x is a step safe from the walls, which are `room` apart where there are two.
    """
    _, u, b, j, _, _ = gap
    if b < 0.0:
        surely, x = certain_return(u, b, j, jerk, snap)
        far = 1.5 * x
        if surely and (not two or room - far * (u + far * far * jerk * SIXTH) > 0.0):
            return True, x
    h = safe_step(room, -u, -b, -j, jerk, snap) if two else FAR
    if u > 0.0 and u + h * (b * 0.5 - h * jerk * SIXTH) > 0.0:  # the wall just left recedes
        return False, h
    return False, min(h, first_step(u, b, j, jerk, snap))


@inlined
def look(two, farthest, least_behind, gap, jerk, snap):
    """(True if the wall ahead, at a gap of at most `farthest`, is certainly reached, and no other before it; near this time)."""
    surely, x = closes(farthest, gap[1], gap[2], gap[3], jerk, snap)
    if two:
        surely = surely and stays_clear(least_behind, -gap[1], -gap[2], jerk, 1.5 * x)
    return surely, x


@inlined
def careful_step(two, least, least_behind, gap, jerk, snap):
    """A step safe from both walls, given lower bounds on the gaps to the one ahead and to the one behind."""
    _, u, b, j, _, _ = gap
    h = safe_step(least, u, b, j, jerk, snap)
    if two and not stays_clear(least_behind, -u, -b, jerk, h):
        h = min(h, safe_step(least_behind, -u, -b, -j, jerk, snap))
    return h


@inlined
def see(has_up, has_down, motion, up, room_up, room_down, size):
    """A motion relative to the walls: (towards the upper wall, gap ahead and its rates, bound on its error, least gap behind).

    Rounding errors are bounded relative to the sizes of the displacement's terms in the gap to the wall just left, and relative
    to the distance of the walls besides in that to the other.
    """
    d, v = motion[0], motion[1]
    to_up = has_up and (v > 0.0 or not has_down)
    near = ROUNDING * size
    far = near + ROUNDING * (room_up + room_down)
    behind = (room_down + d if to_up else room_up - d) - (far if to_up == up else near)
    return to_up, ahead(to_up, room_up, room_down, motion), near if to_up == up else far, max(behind, 0.0)


@inlined
def doubtful(rate, size, bound, room, way, blur):
    """True if an impact lies within the rounding of the gap: an arc beyond the wall, at least rate^2/(2 bound) deep, or the way
    flown to it.

    `size` is that of the displacement's terms, `room` the distance to the wall, zero for that just left, `way` the distance flown
    at the speed of the start, and `blur` the size to which rounding errors at the start have grown.
    """
    error = ROUNDING * (size + room)
    return rate * rate <= 16.0 * (error + blur) * bound or error > CLOUDED * max(room, way)


@inlined
def rooms(p, up):
    """The place of a wall, and the distances from there to the upper and to the lower wall."""
    top, bottom = wall_places(p)
    z = top if up else bottom
    return z, top - z, z - bottom


@inlined
def set_out(p, up, w, two, room, jerk, snap, reach):
    """The start of a flight with velocity w: (the gap to the wall just left and its rates, then as `leave`, whose return is only
    certain within the reach of the bounds).
    """
    gap = ahead(up, 0.0, 0.0, (0.0, w, *start(p)))
    if gap[1] == 0.0 and gap[2] < 0.0:
        gap = 0.0, 0.0, 0.0, gap[3], gap[4], gap[5]  # released: the acceleration is zero up to rounding
    surely, h = leave(two, gap, room, jerk, snap)
    if surely and 1.5 * h > reach:
        surely, h = False, first_step(gap[1], gap[2], gap[3], jerk, snap)
        h = min(h, safe_step(room, -gap[1], -gap[2], -gap[3], jerk, snap)) if two else h
    return gap, surely, h


@inner
def flight(p, up, w):
    """The first impact after leaving a wall: (found, on the upper wall, time, impact speed, undecided).

    A march: no step can carry the gap to either wall through zero, and steps converge to a root at third order. It ends where the
    wall is certainly reached, once and without a turning point: then the root is refined to rounding. Rounding is accounted for:
    bounds are enlarged, steps shortened, and the gap is reduced by a bound on its error, which is relative for the wall just
    left. Bounds hold for a reach, which is infinite except for flights that may grow; no step exceeds it. The growth of rounding
    errors of the start counts too; where it hides which wall is met, the flight is undecided, and is followed as computed in
    floats.
    """
    z, room_up, room_down = rooms(p, up)
    has_up, has_down, _ = walls_of(p)
    two = has_up and has_down
    jerk, snap, _, pop, reach, bound, size = limits(p, 0.0)
    jerk, snap, pop = jerk * OUTWARD, snap * OUTWARD, pop * OUTWARD
    to_up, s, undecided, error, max_time, growing = up, 0.0, False, 0.0, horizon(p), p.table[LOCAL] > 0.0
    gap, surely, h = set_out(p, up, w, two, room_up + room_down, jerk, snap, reach)
    for _ in range(MOST_STEPS):
        if surely or (h <= ROUNDING * s and gap[0] <= 0.0):
            s, rate = refine(p, to_up, room_up, room_down, s, h, gap, pop) if surely else (s, gap[1])
            if s > max_time:
                break
            _, _, _, _, _, bound, size = limits(p, s)
            room, way = 0.0 if to_up == up else room_up + room_down, s * max(abs(w), abs(rate))
            blur = grown(p, z, s, ROUNDING) if growing else 0.0
            return True, to_up, s, max(-rate, 0.0), undecided or doubtful(rate, size, bound, room, way, blur)
        if h <= ROUNDING * s:
            undecided = True  # a graze within rounding: pass it, to where the wall recedes again
            h = 4.0 * ROUNDING * s
            if gap[2] > 0.0:
                h += 2.0 * (abs(gap[1]) + math.sqrt(2.0 * gap[2] * error)) / gap[2]
        s += min(h, reach) * INWARD
        if not s < max_time:
            break
        jerk, snap, _, pop, reach, bound, size = limits(p, s)
        if not size < FAR:
            break  # it has grown beyond the range of floats
        jerk, snap, pop = jerk * OUTWARD, snap * OUTWARD, pop * OUTWARD
        to_up, gap, error, behind = see(has_up, has_down, evaluate(p, s), up, room_up, room_down, size)
        if growing:
            blur = grown(p, z, s, ROUNDING)
            growing = blur < gap[0] and (blur < behind or not two)
            undecided, error, behind = undecided or not growing, error + growing * blur, behind - growing * blur
        surely, h = look(two, gap[0] + error, behind, gap, jerk, snap)
        if not surely or 1.5 * h > reach:
            surely, h = False, careful_step(two, max(gap[0] - error, 0.0), behind, gap, jerk, snap)
    return False, up, s, 0.0, undecided
