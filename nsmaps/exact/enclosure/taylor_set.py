"""Second-order Taylor sets: sets of states that are followed together.

K. Makino, M. Berz, *Taylor models and other validated functional inclusion methods*, Int. J. Pure Appl. Math. 4, 2003, here of
first and second order with the mean value form besides.

A *Taylor set* is a set of impacts on one wall that depends on x, |x_k| <= r_k, in balls: for x = 0 its centre c and derivative d,
for all x the first derivative D and the second derivative H, and, besides, a box (V, P) around it. By Taylor's theorem (v, phi)
is in c + D x and in c + d x + H x x/2, and D in d + H x. All bounds are intersected: next to a grazing state H grows as the third
power of 1/rate, D as the first, and the box does not grow; elsewhere H makes the image narrow. The gap to a wall at time s is
that of the box and, by the mean value theorem, that of the centre plus its derivative over the set times x.
"""

from typing import Any, NamedTuple

from nsmaps.exact.enclosure.arithmetic.balls import (
    GROW,
    ONE,
    ZERO,
    Ball,
    ball_in,
    bdot,
    bmeet,
    bmul,
    bneg,
    exact,
    four_balls,
    put_balls,
    size,
    two_balls,
    widen,
)
from nsmaps.exact.enclosure.arithmetic.elementary import bangle
from nsmaps.exact.enclosure.flight.flow import (
    at_time,
    ball_begin,
    ball_motion,
    ball_places,
    ball_rebound,
    ball_start,
    ball_tangent,
    centre_begin,
)
from nsmaps.exact.enclosure.flight.terms import Motion, ball_bounds
from nsmaps.exact.engine.constants import OUTWARD
from nsmaps.exact.engine.jit import inlined, inner

# A row of a table of Taylor sets, balls in pairs of numbers
AT_CENTRE, AT_SLOPES, AT_ALL_SLOPES, AT_BENDS, AT_LAST_BENDS, AT_RADII, AT_BOX = 0, 4, 12, 20, 28, 32, 34
ON_TOP, SMOOTH, ROW = 38, 39, 40


class Slopes(NamedTuple):
    """First derivatives of speed and phase by x."""

    v_1: Ball
    v_2: Ball
    phi_1: Ball
    phi_2: Ball


class Bends(NamedTuple):
    """Second derivatives of speed and phase by x."""

    v_11: Ball
    v_12: Ball
    v_22: Ball
    phi_11: Ball
    phi_12: Ball
    phi_22: Ball


class TaylorSet(NamedTuple):
    """A set of impacts: see above."""

    v: Ball  #: speed of the centre
    phi: Ball  #: phase of the centre
    d: Slopes  #: at the centre
    all_d: Slopes  #: over the set
    h: Bends  #: over the set
    r: Any  #: radii of x_1 and x_2
    box_v: Ball
    box_phi: Ball


class StartSlopes(NamedTuple):
    """First derivatives of phase and velocity just after impacts by x."""

    phi_1: Ball
    phi_2: Ball
    w_1: Ball
    w_2: Ball


class MotionSlopes(NamedTuple):
    """First derivatives of displacement and velocity at fixed times by x."""

    d_1: Ball
    d_2: Ball
    v_1: Ball
    v_2: Ball


class Launch(NamedTuple):
    """The flights of a Taylor set."""

    part: int  #: place of the set among those that wait
    first: bool  #: whether it is the first flight of the set of a cell
    up: bool  #: whether it starts on the upper wall
    w: Ball  #: velocities at the start, over the set
    centre: Ball  #: that of the centre
    y: StartSlopes  #: over the set
    r: Any  #: radii of x_1 and x_2
    start: Motion  #: over the set
    jerk: float  #: bounds for all times, of the absolute value
    snap: float
    last: float  #: longest flight that is followed, in the system's time


@inlined
def box_set(v, phi):
    """The Taylor set that fills a box."""
    unit = Slopes(ONE, ZERO, ZERO, ONE)
    flat = Bends(ZERO, ZERO, ZERO, ZERO, ZERO, ZERO)
    return TaylorSet(exact(v.centre), exact(phi.centre), unit, unit, flat, (v.radius, phi.radius), v, phi)


@inlined
def put_set(row, upper, a_set, smooth):
    """Write a Taylor set into a row of a table."""
    put_balls(row, AT_CENTRE, (a_set.v, a_set.phi))
    put_balls(row, AT_SLOPES, a_set.d)
    put_balls(row, AT_ALL_SLOPES, a_set.all_d)
    put_balls(row, AT_BENDS, a_set.h)
    put_balls(row, AT_RADII, (Ball(*a_set.r), a_set.box_v, a_set.box_phi))
    row[ON_TOP], row[SMOOTH] = 1.0 if upper else 0.0, 1.0 if smooth else 0.0


@inlined
def get_set(row):
    """The Taylor set in a row of a table."""
    d, all_d = Slopes(*four_balls(row, AT_SLOPES)), Slopes(*four_balls(row, AT_ALL_SLOPES))
    h, (r_1, r_2) = Bends(*four_balls(row, AT_BENDS), *two_balls(row, AT_LAST_BENDS)), ball_in(row, AT_RADII)
    return TaylorSet(*two_balls(row, AT_CENTRE), d, all_d, h, (r_1, r_2), *box_of(row))


@inlined
def box_of(row):
    """The box of the Taylor set in a row."""
    return two_balls(row, AT_BOX)


@inlined
def spreads(a, b, r):
    """The radii of a x_1 and of b x_2."""
    r_1, r_2 = r
    return size(a) * r_1, size(b) * r_2


@inlined
def spread(a, b, r):
    """The radius of a x_1 + b x_2."""
    by_1, by_2 = spreads(a, b, r)
    return (by_1 + by_2) * GROW


@inner
def narrow_slopes(known, d, h, r):
    """Bounds on the first derivative over a set, intersected with those from its centre's and the second derivative."""
    return Slopes(
        bmeet(known.v_1, widen(d.v_1, spread(h.v_11, h.v_12, r))),
        bmeet(known.v_2, widen(d.v_2, spread(h.v_12, h.v_22, r))),
        bmeet(known.phi_1, widen(d.phi_1, spread(h.phi_11, h.phi_12, r))),
        bmeet(known.phi_2, widen(d.phi_2, spread(h.phi_12, h.phi_22, r))),
    )


@inner
def launch_velocity(p, up, v):
    """The velocity after impacts of speeds v, and its first and second derivatives by v."""
    u, slope, bend = ball_rebound(p, up, v)
    return (bneg(u), bneg(slope), bneg(bend)) if up else (u, slope, bend)


@inlined
def start_slopes(d, slope):
    """First derivatives of phase and velocity just after impacts, where the velocity has this derivative by the speed."""
    return StartSlopes(d.phi_1, d.phi_2, bmul(slope, d.v_1), bmul(slope, d.v_2))


@inner
def launch_set(p, part, first, row, last):
    """Write the part of the flights of the set in a row, and of its centre, that does not depend on time: the `Launch`."""
    a_set, up = get_set(row), row[ON_TOP] > 0.0
    top, bottom = ball_places(p)
    z = top if up else bottom
    w, slope, _ = launch_velocity(p, up, a_set.box_v)
    centre, _, _ = launch_velocity(p, up, a_set.v)
    whole = bangle(a_set.box_phi)
    ball_begin(p, p.one, bangle(a_set.phi), z, centre)
    centre_begin(p, centre.centre)
    ball_begin(p, p.whole, whole, z, w)
    jerk, snap = ball_bounds(p, p.whole)
    acceleration, jerk_then = ball_start(p, whole, z, w)
    y, start = start_slopes(a_set.all_d, slope), Motion(ZERO, w, acceleration, jerk_then)
    return Launch(part, first, up, w, centre, y, a_set.r, start, jerk * OUTWARD, snap * OUTWARD, last)


@inlined
def by_start(tangent, y):
    """The derivatives of displacement and velocity by x at fixed times, from those by phase and velocity of the start."""
    return MotionSlopes(
        bdot(tangent.d_phi, tangent.d_w, y.phi_1, y.w_1),
        bdot(tangent.d_phi, tangent.d_w, y.phi_2, y.w_2),
        bdot(tangent.v_phi, tangent.v_w, y.phi_1, y.w_1),
        bdot(tangent.v_phi, tangent.v_w, y.phi_2, y.w_2),
    )


@inner
def narrow_motion(p, launch, s):
    """Displacement and its rates over a set at time s, intersected with those from its centre; and its spread by x_1 and x_2."""
    at_time(p, exact(s))
    d, v, _, _ = ball_motion(p, p.one, launch.centre, 1)
    all_d, all_v, a, j = ball_motion(p, p.whole, launch.w, 3)
    x, r = by_start(ball_tangent(p, p.whole, 1), launch.y), launch.r
    d, v = bmeet(all_d, widen(d, spread(x.d_1, x.d_2, r))), bmeet(all_v, widen(v, spread(x.v_1, x.v_2, r)))
    return Motion(d, v, a, j), spreads(x.d_1, x.d_2, r)


@inlined
def reach_of(d_1, d_2, h, r):
    """The radius of d x + h x x/2."""
    (h_11, h_12, h_22), (r_1, r_2) = h, r
    bend = size(h_11) * r_1 * r_1 + 2.0 * size(h_12) * r_1 * r_2 + size(h_22) * r_2 * r_2
    return (spread(d_1, d_2, r) + 0.5 * bend) * GROW


@inlined
def impact_set(a_set, speed, phase, d, over, box):
    """A Taylor set of impacts: speed, phase and derivatives of its centre, derivatives over the set, and the box of a flight."""
    (all_d, h), r, (box_v, box_phi) = over, a_set.r, box
    v = bmeet(box_v, widen(speed, spread(all_d.v_1, all_d.v_2, r)))
    v = bmeet(v, widen(speed, reach_of(d.v_1, d.v_2, (h.v_11, h.v_12, h.v_22), r)))
    phi = bmeet(box_phi, widen(phase, spread(all_d.phi_1, all_d.phi_2, r)))
    phi = bmeet(phi, widen(phase, reach_of(d.phi_1, d.phi_2, (h.phi_11, h.phi_12, h.phi_22), r)))
    return TaylorSet(speed, phase, d, all_d, h, r, v, phi)
