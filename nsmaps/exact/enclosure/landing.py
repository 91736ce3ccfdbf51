"""The impacts of a set of states on a wall that all of them reach, with their derivatives: see `taylor_set`."""

import math
from typing import NamedTuple

from nsmaps.exact.enclosure.arithmetic.balls import (
    GROW,
    Ball,
    badd,
    bdot,
    between,
    bhalf,
    binv,
    bmeet,
    bmul,
    bneg,
    bplus,
    bsub,
    btwice,
    exact,
    high,
    low,
    size,
    widen,
)
from nsmaps.exact.enclosure.first_events import RESERVE
from nsmaps.exact.enclosure.flight.flow import Tangent, at_time, ball_bends, ball_motion, ball_rate, ball_tangent
from nsmaps.exact.enclosure.flight.terms import Motion
from nsmaps.exact.enclosure.taylor_set import (
    Bends,
    MotionSlopes,
    Slopes,
    by_start,
    get_set,
    impact_set,
    launch_velocity,
    narrow_motion,
    narrow_slopes,
    put_set,
    spread,
    spreads,
    start_slopes,
)
from nsmaps.exact.engine.jit import inlined, inner


class Gap(NamedTuple):
    """The gap to a wall and its derivatives by the time, in balls."""

    y: Ball
    u: Ball
    b: Ball
    j: Ball


class Impact(NamedTuple):
    """Where and about when a set reaches a wall."""

    upper: bool
    room: Ball  #: distance of the wall from the one that the flight left
    first: float  #: all states reach the wall, once, between these times
    last: float
    root: float  #: about when the centre does


class Centre(NamedTuple):
    """The centre of a set at a time near its impact."""

    y: Ball  #: gap to the wall
    u: Ball  #: its rate
    a: Ball  #: acceleration
    tangent: Tangent


class Passage(NamedTuple):
    """A set at the times of its impacts."""

    times: Ball  #: after the time near the impact of the centre
    u: Ball  #: rates of the gap
    motion: Motion
    tangent: Tangent  #: with that of the acceleration
    x: MotionSlopes


@inlined
def gap_to(upper, room, motion):
    """The gap to a wall and its time derivatives, in balls."""
    if upper:
        return Gap(bsub(room, motion.d), bneg(motion.v), bneg(motion.a), bneg(motion.j))
    return Gap(badd(room, motion.d), motion.v, motion.a, motion.j)


@inlined
def bend_within(b, jerk, tau):
    """A bound on the second derivative within times tau."""
    return widen(b, jerk * size(tau))


@inlined
def later_gap(gap, jerk, h):
    """The gap a time h later or, for negative h, earlier, by Taylor's theorem with the second derivative at some time between."""
    time = exact(h)
    return bplus(gap.y, time, bplus(gap.u, bend_within(gap.b, jerk, time), bhalf(time)))


@inner
def closing_times(gap, jerk, tau):
    """The times at which gaps close that all do so once within tau, by the interval Newton method (Moore, Kearfott, Cloud)."""
    near = -2.0 * size(gap.y) / high(gap.u)
    if near > 0.0 and low(later_gap(gap, jerk, -near)) > 0.0 and high(later_gap(gap, jerk, near)) < 0.0:
        tau = bmeet(tau, Ball(0.0, near))
    for _ in range(2):
        tau = bmeet(tau, bneg(bmul(gap.y, binv(bplus(gap.u, bend_within(gap.b, jerk, tau), bhalf(tau))))))
    return between(min(low(tau), 0.0), max(high(tau), 0.0))


@inner
def centre_at(p, launch, impact):
    """The centre near its impact."""
    at_time(p, exact(impact.root))
    motion = ball_motion(p, p.one, launch.centre, 2)
    gap = gap_to(impact.upper, impact.room, motion)
    return Centre(gap.y, gap.u, motion.a, ball_tangent(p, p.one, 1))


@inlined
def guess_reach(centre, x, r):
    """Estimate of how long before and after the time of the centre a set reaches the wall, with reserve; infinite if unknown."""
    rate = abs(centre.u.centre)
    reach = (size(centre.y) + spread(x.d_1, x.d_2, r)) / rate
    bend = (spread(x.v_1, x.v_2, r) + abs(centre.a.centre) * reach) / rate
    return reach * (RESERVE + 2.0 * bend) if bend < 0.5 else math.inf


@inner
def pass_wall(p, launch, impact, centre, tau):
    """A set at the times root + tau, zero in tau.

    By the mean value theorem in x the gaps at root lie within those of the centre plus the derivatives over the set, and by the
    mean value theorem in time all of them close within -gap/rate: where that lies within tau, and no rate is zero, these are all
    impacts.
    """
    at_time(p, badd(exact(impact.root), tau))
    motion, tangent = ball_motion(p, p.whole, launch.w, 3), ball_tangent(p, p.whole, 2)
    x, r = by_start(tangent, launch.y), launch.r
    y = widen(centre.y, spread(x.d_1, x.d_2, r))
    v = bneg(motion.v) if impact.upper else motion.v
    u = bmeet(v, widen(centre.u, (spread(x.v_1, x.v_2, r) + size(motion.a) * size(tau)) * GROW))
    return Passage(bneg(bmul(y, binv(u))), u, motion, tangent, x)


@inner
def pass_wall_in_window(p, launch, impact, centre):
    """As `pass_wall`, for the times at which the set certainly reaches the wall, from the motion of all states at root."""
    motion, _ = narrow_motion(p, launch, impact.root)
    gap, window = gap_to(impact.upper, impact.room, motion), bsub(between(impact.first, impact.last), exact(impact.root))
    times = closing_times(gap, launch.jerk, window)
    found = pass_wall(p, launch, impact, centre, times)
    rates = bplus(gap.u, bend_within(gap.b, launch.jerk, times), times)
    return Passage(times, rates, found.motion, found.tangent, found.x)


@inlined
def impact_slopes(x, slope, a):
    """Derivatives of time and velocity at impacts by x, from those at fixed times and -1/rate: the implicit function theorem."""
    s_1, s_2 = bmul(x.d_1, slope), bmul(x.d_2, slope)
    return (s_1, s_2), (bplus(x.v_1, a, s_1), bplus(x.v_2, a, s_2))


@inner
def impact_bend(passage, bends, slope, phi_phi, y_xx, cross):
    """The second derivatives of time and velocity at impacts by two components of x.

    `phi_phi` is the product of the derivatives of the phase of the start by them, `y_xx` contains the second derivatives of phase
    and velocity of the start, and `cross` the contribution of the varying time of impact to those of displacement and velocity.
    """
    tangent, (d_bend, v_bend), (phi_xx, w_xx), (d_cross, v_cross) = passage.tangent, bends, y_xx, cross
    d_xx, v_xx = bplus(d_cross, d_bend, phi_phi), bplus(v_cross, v_bend, phi_phi)
    if phi_xx.radius != 0.0 or w_xx.radius != 0.0 or phi_xx.centre != 0.0 or w_xx.centre != 0.0:
        d_xx = badd(d_xx, bdot(tangent.d_phi, tangent.d_w, phi_xx, w_xx))
        v_xx = badd(v_xx, bdot(tangent.v_phi, tangent.v_w, phi_xx, w_xx))
    s_xx = bmul(d_xx, slope)
    return s_xx, bplus(v_xx, passage.motion.a, s_xx)


@inlined
def start_bends(p, up, a_set):
    """The second derivatives of phase and velocity of the start by x: by x_1 twice, by both, by x_2 twice."""
    d, h = a_set.all_d, a_set.h
    _, law, bend = launch_velocity(p, up, a_set.box_v)
    w_11, w_12, w_22 = bmul(law, h.v_11), bmul(law, h.v_12), bmul(law, h.v_22)
    if bend.centre != 0.0 or bend.radius != 0.0:
        w_11, w_12 = bplus(w_11, bend, bmul(d.v_1, d.v_1)), bplus(w_12, bend, bmul(d.v_1, d.v_2))
        w_22 = bplus(w_22, bend, bmul(d.v_2, d.v_2))
    return (h.phi_11, w_11), (h.phi_12, w_12), (h.phi_22, w_22)


@inlined
def half_way(rate, bend, s):
    """A rate plus half the contribution of its own rate up to an impact: terms of a product that both variations give."""
    return bplus(rate, bhalf(bend), s)


@inner
def bends_over(p, launch, upper, a_set, passage, times):
    """The second derivatives of speed and phase at impacts at the times of `at_time`, from the first ones of these times by x."""
    y, bends, tangent, motion, x = launch.y, ball_bends(p, p.whole), passage.tangent, passage.motion, passage.x
    slope, (s_1, s_2), omega = impact_slope(upper, passage.u), times, ball_rate(p)
    a_1 = bdot(tangent.a_phi, tangent.a_w, y.phi_1, y.w_1)
    a_2 = bdot(tangent.a_phi, tangent.a_w, y.phi_2, y.w_2)
    d_1, d_2 = half_way(x.v_1, motion.a, s_1), half_way(x.v_2, motion.a, s_2)
    v_1, v_2 = half_way(a_1, motion.j, s_1), half_way(a_2, motion.j, s_2)
    y_11, y_12, y_22 = start_bends(p, launch.up, a_set)
    one = btwice(bmul(d_1, s_1)), btwice(bmul(v_1, s_1))
    both = bdot(d_1, d_2, s_2, s_1), bdot(v_1, v_2, s_2, s_1)
    two = btwice(bmul(d_2, s_2)), btwice(bmul(v_2, s_2))
    s_11, v_11 = impact_bend(passage, bends, slope, bmul(y.phi_1, y.phi_1), y_11, one)
    s_12, v_12 = impact_bend(passage, bends, slope, bmul(y.phi_1, y.phi_2), y_12, both)
    s_22, v_22 = impact_bend(passage, bends, slope, bmul(y.phi_2, y.phi_2), y_22, two)
    if not upper:
        v_11, v_12, v_22 = bneg(v_11), bneg(v_12), bneg(v_22)
    h = a_set.h
    return Bends(v_11, v_12, v_22, bplus(h.phi_11, omega, s_11), bplus(h.phi_12, omega, s_12), bplus(h.phi_22, omega, s_22))


@inlined
def impact_derivative(upper, v_x, d, omega, s_x):
    """The derivatives of speed and phase of impacts by x, from those of velocity and time."""
    (s_1, s_2), (v_1, v_2) = s_x, v_x
    phi_1, phi_2 = bplus(d.phi_1, omega, s_1), bplus(d.phi_2, omega, s_2)
    return Slopes(v_1, v_2, phi_1, phi_2) if upper else Slopes(bneg(v_1), bneg(v_2), phi_1, phi_2)


@inlined
def impact_slope(upper, u):
    """The derivative of the time of an impact by the displacement at fixed times, from the rate of the gap."""
    return binv(u) if upper else bneg(binv(u))


@inlined
def centre_at_impact(centre, late, passage):
    """The centre at the impact, `late` after it, with bounds on its rates in between: without its gap, which is zero."""
    t, bends, here = size(late), passage.tangent, centre.tangent
    d_phi, d_w = widen(here.d_phi, size(bends.v_phi) * t), widen(here.d_w, size(bends.v_w) * t)
    v_phi, v_w = widen(here.v_phi, size(bends.a_phi) * t), widen(here.v_w, size(bends.a_w) * t)
    u, a = widen(centre.u, size(passage.motion.a) * t), widen(centre.a, size(passage.motion.j) * t)
    return Centre(centre.y, u, a, Tangent(d_phi, d_w, v_phi, v_w, here.a_phi, here.a_w))


@inner
def land_set(p, launch, impact, row, out):
    """Write the impacts of a set that certainly reaches a wall once, without a turning point, in a window of time.

    Returns (True if no rate is near zero, the spread by x just before the wall).
    """
    a_set, upper, omega = get_set(row), impact.upper, ball_rate(p)
    _, law, _ = launch_velocity(p, launch.up, a_set.v)
    y_x, centre, r = start_slopes(a_set.d, law), centre_at(p, launch, impact), a_set.r
    half = guess_reach(centre, by_start(centre.tangent, y_x), r)
    sure = impact.root - half > impact.first and impact.root + half < impact.last
    passage = pass_wall(p, launch, impact, centre, Ball(0.0, half if sure else 0.0))
    if not (sure and size(passage.times) < half and high(passage.u) < 0.0):
        passage = pass_wall_in_window(p, launch, impact, centre)
    late = bneg(bmul(centre.y, binv(passage.u)))  # of the centre
    centre = centre_at_impact(centre, late, passage)
    s_x, v_x = impact_slopes(by_start(centre.tangent, y_x), impact_slope(upper, centre.u), centre.a)
    d = impact_derivative(upper, v_x, a_set.d, omega, s_x)
    s_x, v_x = impact_slopes(passage.x, impact_slope(upper, passage.u), passage.motion.a)
    h = bends_over(p, launch, upper, a_set, passage, s_x)
    all_d = narrow_slopes(impact_derivative(upper, v_x, a_set.all_d, omega, s_x), d, h, r)
    phase = bplus(a_set.phi, omega, badd(exact(impact.root), late))
    box = bneg(passage.u), bplus(a_set.box_phi, omega, badd(exact(impact.root), passage.times))
    put_set(out, upper, impact_set(a_set, bneg(centre.u), phase, d, (all_d, h), box), True)
    return high(passage.u) < 0.0, spreads(passage.x.d_1, passage.x.d_2, r)
