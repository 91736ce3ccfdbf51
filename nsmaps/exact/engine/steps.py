"""Steps within which a gap certainly stays open, and tests for its certain closing, from its rates and bounds on its derivatives.

A gap y has the rates u, b, j, its first to third derivative by the time; `jerk` and `snap` bound the third and the fourth. By
Taylor's theorem y(h) lies within snap h^4/24 of y + u h + b h^2/2 + j h^3/6, and within jerk h^3/6 of it without its last term.
Units are those of the gap and of its time.
"""

import math
from typing import NamedTuple

from nsmaps.exact.engine.constants import BRACKET, FAR, FOURTH, LATEST, OVER_24, OVER_120, ROUNDING, SIXTH, THIRD, THREE
from nsmaps.exact.engine.jit import inlined


class Gap(NamedTuple):
    """The gap to a wall and its derivatives by the time; `rate` is negative towards the wall."""

    size: float
    rate: float
    acceleration: float
    jerk: float
    snap: float
    crackle: float


@inlined
def first_step(u, b, j, jerk, snap):
    """A step from the wall just left, at speed u >= 0 and acceleration b, within which the gap stays positive.

    The known root at zero is divided out: gap/h >= u + b h/2 - m h^2/6, with m >= -(the jerk over the step).
    """
    m = min(max(snap * (-2.0 * u / b) * FOURTH - j, 0.0), jerk) if b < 0.0 else jerk
    root = math.sqrt(b * b * FOURTH + 2.0 * m * u * THIRD)
    if b < 0.0:
        return 2.0 * u / (root - b * 0.5)
    if jerk == 0.0:
        return FAR
    far = THREE * (b * 0.5 + root) / jerk
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
    m = min(max(snap * reach * FOURTH - j, 0.0), jerk)
    if not reach < math.inf:  # the wall recedes, or the gap has a minimum before it closes: b > 0, or y and b vanish together
        if jerk == 0.0:
            return FAR
        root = math.sqrt(max(b * b + 2.0 * jerk * u, 0.0))
        turn = min(u, 0.0) * -2.0 / (b + root) if b + root > 0.0 else 0.0
        if b * b + 2.0 * jerk * u >= 0.0 and y + turn * (u + turn * (b * 0.5 - turn * jerk * SIXTH)) > 0.0:
            step = (b + root) / jerk  # after the minimum of the lower cubic it rises until here
        reach, m, cube = THREE * b / jerk, jerk, 6 * y / jerk
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
    """For a gap of at most `gap`, with rates u, b, j: (True if it surely closes, once, with no minimum, within LATEST x; x)."""
    x = 2.0 * gap / (math.sqrt(max(u * u - 2.0 * gap * b, 0.0)) - u) if u < 0.0 else 0.0
    far = LATEST * x
    highest = gap + far * (u + far * (b * 0.5 + far * min(jerk, j + snap * far * FOURTH) * SIXTH))
    fastest = u + far * (b + far * max(min(jerk, j + snap * far * THIRD), 0.0) * 0.5)
    return u < 0.0 and highest < 0.0 and fastest < 0.0, x


@inlined
def taylor_root(gap, x):
    """The root of the gap's Taylor polynomial of fifth order near x by two Newton steps, and its rate."""
    y, u, b, j, k, q = gap
    rate = u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * OVER_24)))
    left = y + x * (u + x * (b * 0.5 + x * (j * SIXTH + x * (k * OVER_24 + x * q * OVER_120))))
    slope = 1.0 / rate
    x -= left * slope
    rate = u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * OVER_24)))
    left = y + x * (u + x * (b * 0.5 + x * (j * SIXTH + x * (k * OVER_24 + x * q * OVER_120))))
    x -= left * slope * (2.0 - rate * slope)  # 1/rate to second order, without another division
    return x, u + x * (b + x * (j * 0.5 + x * (k * SIXTH + x * q * OVER_24)))


@inlined
def is_converged(step, rate, s, pop):
    """True if the gap's Taylor polynomial at s, a step away from its root, is exact to rounding there, and its rate as well."""
    size = abs(step)
    return size * size * (size * size * size) * pop <= -120 * ROUNDING * rate or size <= ROUNDING * s  # 120 = 5!


@inlined
def departure(two, gap, room, jerk, snap):
    """The start of a flight: (True if it certainly returns to the wall just left, near x).

    Where that is not certain, x is a step safe from the walls, which are `room` apart where there are two.
    """
    _, u, b, j, _, _ = gap
    if b < 0.0:
        x = -2.0 * u / b  # certain if the gap is concave throughout
        far = BRACKET * x
        highest = u + far * (b * 0.5 + far * min(jerk, j + snap * far * FOURTH) * SIXTH)
        bend = max(min(jerk, j + snap * far * 0.5), 0.0)
        surely = x > 0.0 and highest < 0.0 and b + far * bend < 0.0
        if surely and (not two or room - far * (u + far * far * jerk * SIXTH) > 0.0):
            return True, x
    h = safe_step(room, -u, -b, -j, jerk, snap) if two else FAR
    if u > 0.0 and u + h * (b * 0.5 - h * jerk * SIXTH) > 0.0:  # the wall just left recedes
        return False, h
    return False, min(h, first_step(u, b, j, jerk, snap))


@inlined
def surely_reached(two, farthest, least_behind, gap, jerk, snap):
    """(True if the wall ahead, at a gap of at most `farthest`, is certainly reached, and no other before it; near this time)."""
    _, u, b, j, _, _ = gap
    surely, x = closes(farthest, u, b, j, jerk, snap)
    if two:
        surely = surely and stays_clear(least_behind, -u, -b, jerk, BRACKET * x)
    return surely, x


@inlined
def careful_step(two, least, least_behind, gap, jerk, snap):
    """A step safe from both walls, given lower bounds on the gaps to the one ahead and to the one behind."""
    _, u, b, j, _, _ = gap
    h = safe_step(least, u, b, j, jerk, snap)
    if two and not stays_clear(least_behind, -u, -b, jerk, h):
        h = min(h, safe_step(least_behind, -u, -b, -j, jerk, snap))
    return h
