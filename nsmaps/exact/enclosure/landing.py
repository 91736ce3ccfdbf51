"""The impacts of a set of states on a wall that all of them reach, with their derivatives: see `taylor_set`."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import (
    GROW,
    badd,
    between,
    binv,
    bmeet,
    bmul,
    bneg,
    bplus,
    bsub,
    high,
    low,
    met,
    size,
)
from nsmaps.exact.enclosure.flight.flow import at_time, ball_bends, ball_motion, ball_rate, ball_tangent
from nsmaps.exact.enclosure.taylor_set import by_start, get_set, launch_of, put_set, slopes, spread, view, widened
from nsmaps.exact.engine.jit import inlined, inner


@inlined
def gap_to(upper, room, motion):
    """The gap to a wall and its time derivatives, in balls."""
    d, v, a, j = motion
    if upper:
        return bsub(room, d), bneg(v), bneg(a), bneg(j)
    return badd(room, d), v, a, j


@inlined
def bent(b, jerk, tau):
    """A bound on the second derivative within times tau."""
    return widened(b, jerk * size(tau))


@inlined
def mean_rate(u, b, tau):
    """The mean rate from 0 to tau, by Taylor's theorem with the second derivative b at some time between."""
    return bplus(u, b, (0.5 * tau[0], 0.5 * tau[1]))


@inlined
def after(gap, jerk, h):
    """The gap a time h later or, for negative h, earlier."""
    y, u, b, _ = gap
    return bplus(y, (h, 0.0), mean_rate(u, bent(b, jerk, (h, 0.0)), (h, 0.0)))


@inner
def crossing(gap, jerk, tau):
    """For gaps that all close within tau, once, and at the time zero: (the times at which they close, the rates then)."""
    y, u, b, _ = gap
    near = -2.0 * size(y) / high(u)
    if near > 0.0 and low(after(gap, jerk, -near)) > 0.0 and high(after(gap, jerk, near)) < 0.0:
        tau = bmeet(tau, (0.0, near))
    for _ in range(2):
        tau = bmeet(tau, bneg(bmul(y, binv(mean_rate(u, bent(b, jerk, tau), tau)))))
    tau = between(min(low(tau), 0.0), max(high(tau), 0.0))
    return tau, bplus(u, bent(b, jerk, tau), tau)


@inner
def middle(p, flight, upper, room, root):
    """The centre near its impact, at the time root: (gap, its rate, acceleration, derivatives by the start)."""
    at_time(p, (root, 0.0))
    motion = ball_motion(p, p.one, flight[1], 2)
    y, u, _, _ = gap_to(upper, room, motion)
    return y, u, motion[2], ball_tangent(p, p.one, 1)


@inlined
def guessed(y, u, a, d_x, r):
    """Estimate of how long before and after the time of `middle` a set reaches the wall, with a reserve; infinite if unknown."""
    reach = (size(y) + spread(d_x[0], d_x[1], r)) / abs(u[0])
    bend = (spread(d_x[2], d_x[3], r) + abs(a[0]) * reach) / abs(u[0])
    return reach * (1.05 + 2.0 * bend) if bend < 0.5 else math.inf


@inner
def moving(p, flight, upper, y, u, root, tau):
    """A set at the times root + tau, zero in tau, from gap and rate of its centre at root: (times of impact, rates, ...).

    By the mean value theorem in x the gaps at root lie within those of the centre plus the derivatives over the set, and by the
    mean value theorem in time all of them close within -gap/rate: where that lies within tau, and no rate is zero, these are all
    impacts. The motion over the set and its derivatives by the start and by x are returned besides.
    """
    at_time(p, badd((root, 0.0), tau))
    motion, tangent = ball_motion(p, p.whole, flight[0], 3), ball_tangent(p, p.whole, 2)
    d_x, r = by_start(tangent, flight[2]), flight[3]
    y = widened(y, spread(d_x[0], d_x[1], r))
    v = bneg(motion[1]) if upper else motion[1]
    u = bmeet(v, widened(u, (spread(d_x[2], d_x[3], r) + size(motion[2]) * size(tau)) * GROW))
    return bneg(bmul(y, binv(u))), u, motion, tangent, d_x


@inner
def narrowed(p, flight, upper, room, window, root, jerk):
    """The times after root at which a set certainly reaches a wall within the window, from the motion of all states at root."""
    motion, _ = view(p, flight, root)
    return crossing(gap_to(upper, room, motion), jerk, bsub(between(window[0], window[1]), (root, 0.0)))


@inlined
def impact_slopes(d_x, slope, a):
    """Derivatives of time and velocity at impacts by x, from the derivatives at fixed times and from -1/rate: the implicit
    function theorem.
    """
    s_1, s_2 = bmul(d_x[0], slope), bmul(d_x[1], slope)
    return (s_1, s_2), (bplus(d_x[2], a, s_1), bplus(d_x[3], a, s_2))


@inner
def impact_bend(tangent, bends, a, slope, phi_phi, y_xx, cross):
    """The second derivatives of time and velocity at impacts by two components of x.

    `phi_phi` is the product of the derivatives of the phase of the start by them, `y_xx` contains the second derivatives of phase
    and velocity of the start, and `cross` the contribution of the varying time of impact to those of displacement and velocity.
    """
    d_xx = bplus(cross[0], bends[0], phi_phi)
    v_xx = bplus(cross[1], bends[1], phi_phi)
    if y_xx[0][1] != 0.0 or y_xx[1][1] != 0.0 or y_xx[0][0] != 0.0 or y_xx[1][0] != 0.0:
        d_xx = badd(d_xx, met(tangent[0], tangent[1], y_xx[0], y_xx[1]))
        v_xx = badd(v_xx, met(tangent[2], tangent[3], y_xx[0], y_xx[1]))
    s_xx = bmul(d_xx, slope)
    return s_xx, bplus(v_xx, a, s_xx)


@inlined
def started(p, up, taylor_set):
    """The second derivatives of phase and velocity of the start by x: by x_1 twice, by both, by x_2 twice."""
    _, _, _, d, h, _, box_v, _ = taylor_set
    _, law, bend = launch_of(p, up, box_v)
    w = bmul(law, h[0]), bmul(law, h[1]), bmul(law, h[2])
    if bend[0] != 0.0 or bend[1] != 0.0:
        twice = bmul(d[0], d[0]), bmul(d[0], d[1]), bmul(d[1], d[1])
        w = bplus(w[0], bend, twice[0]), bplus(w[1], bend, twice[1]), bplus(w[2], bend, twice[2])
    return (h[3], w[0]), (h[4], w[1]), (h[5], w[2])


@inlined
def doubled_ball(a):
    """Twice a ball."""
    return 2.0 * a[0], 2.0 * a[1]


@inlined
def lean(rate, bend, s):
    """A rate plus half of the contribution of its own rate up to an impact: the terms of the product of two sums that both
    variations give.
    """
    return bplus(rate, (0.5 * bend[0], 0.5 * bend[1]), s)


@inner
def bends_over(p, up, upper, flight, taylor_set, tangent, motion, slope, times, d_x, omega):
    """The second derivatives of speed and phase at impacts at the times of `at_time`: by x_1 twice, by both, by x_2 twice."""
    y, bends, (_, _, a, j) = flight[2], ball_bends(p, p.whole), motion
    s_1, s_2 = times
    a_1, a_2 = met(tangent[4], tangent[5], y[0], y[2]), met(tangent[4], tangent[5], y[1], y[3])
    d_1, d_2, v_1, v_2 = lean(d_x[2], a, s_1), lean(d_x[3], a, s_2), lean(a_1, j, s_1), lean(a_2, j, s_2)
    y_11, y_12, y_22 = started(p, up, taylor_set)
    both = met(d_1, d_2, s_2, s_1), met(v_1, v_2, s_2, s_1)
    one = doubled_ball(bmul(d_1, s_1)), doubled_ball(bmul(v_1, s_1))
    two = doubled_ball(bmul(d_2, s_2)), doubled_ball(bmul(v_2, s_2))
    s_11, v_11 = impact_bend(tangent, bends, a, slope, bmul(y[0], y[0]), y_11, one)
    s_12, v_12 = impact_bend(tangent, bends, a, slope, bmul(y[0], y[1]), y_12, both)
    s_22, v_22 = impact_bend(tangent, bends, a, slope, bmul(y[1], y[1]), y_22, two)
    if not upper:
        v_11, v_12, v_22 = bneg(v_11), bneg(v_12), bneg(v_22)
    h = taylor_set[4]
    return v_11, v_12, v_22, bplus(h[3], omega, s_11), bplus(h[4], omega, s_12), bplus(h[5], omega, s_22)


@inlined
def reach_of(d, h, r):
    """The radius of d x + h x x/2."""
    bend = size(h[0]) * r[0] * r[0] + 2.0 * size(h[1]) * r[0] * r[1] + size(h[2]) * r[1] * r[1]
    return (spread(d[0], d[1], r) + 0.5 * bend) * GROW


@inlined
def impact_derivative(upper, v_x, d, omega, s_x):
    """The derivatives of speed and phase of impacts by x, from those of velocity and time."""
    phi_1, phi_2 = bplus(d[2], omega, s_x[0]), bplus(d[3], omega, s_x[1])
    return (v_x[0], v_x[1], phi_1, phi_2) if upper else (bneg(v_x[0]), bneg(v_x[1]), phi_1, phi_2)


@inlined
def moved(u, a, tangent, late, over, bends):
    """Rate, acceleration and derivatives of `middle` at the impact, `late` after it, with bounds on their rates in between."""
    t = size(late)
    turned = (
        widened(tangent[0], size(bends[2]) * t),
        widened(tangent[1], size(bends[3]) * t),
        widened(tangent[2], size(bends[4]) * t),
        widened(tangent[3], size(bends[5]) * t),
    )
    return widened(u, size(over[2]) * t), widened(a, size(over[3]) * t), turned


@inlined
def landing(taylor_set, centre, whole, root):
    """A Taylor set at its impact with the wall: from the set at the start, and rate, time, derivatives by x of its centre and of
    all states.
    """
    _, phi, _, _, _, r, _, box_phi = taylor_set
    rate, late, d = centre
    all_rate, tau, all_x, h, omega = whole
    phase, rate = bplus(phi, omega, badd((root, 0.0), late)), bneg(rate)
    all_v = bmeet(bmeet(bneg(all_rate), widened(rate, spread(all_x[0], all_x[1], r))), widened(rate, reach_of(d[:2], h[:3], r)))
    all_phi = bmeet(bplus(box_phi, omega, badd((root, 0.0), tau)), widened(phase, spread(all_x[2], all_x[3], r)))
    return rate, phase, d, all_x, h, r, all_v, bmeet(all_phi, widened(phase, reach_of(d[2:], h[3:], r)))


@inner
def landed(p, up, flight, row, upper, room, window, root, jerk, out):
    """Write the impacts of a set that certainly reaches a wall once, without a turning point, in a window of time, its centre
    near root.

    Returns (True if no rate is near zero, the spread by x just before the wall).
    """
    taylor_set = get_set(row)
    v, _, d, all_x, h, r, _, _ = taylor_set
    _, law, _ = launch_of(p, up, v)
    y_x = d[2], d[3], bmul(law, d[0]), bmul(law, d[1])
    y, u, a, tangent = middle(p, flight, upper, room, root)
    half = guessed(y, u, a, by_start(tangent, y_x), r)
    sure = root - half > window[0] and root + half < window[1]
    tau, all_rate, over, all_tangent, d_x = moving(p, flight, upper, y, u, root, (0.0, half if sure else 0.0))
    if not (sure and size(tau) < half and high(all_rate) < 0.0):
        tau, all_rate = narrowed(p, flight, upper, room, window, root, jerk)
        _, _, over, all_tangent, d_x = moving(p, flight, upper, y, u, root, tau)
    late, omega = bneg(bmul(y, binv(all_rate))), ball_rate(p)  # of the centre
    rate, a, tangent = moved(u, a, tangent, late, over, all_tangent)
    slope = binv(rate) if upper else bneg(binv(rate))
    s_x, v_x = impact_slopes(by_start(tangent, y_x), slope, a)
    d = impact_derivative(upper, v_x, d, omega, s_x)
    slope = binv(all_rate) if upper else bneg(binv(all_rate))
    s_x, v_x = impact_slopes(d_x, slope, over[2])
    h = bends_over(p, up, upper, flight, taylor_set, all_tangent, over, slope, s_x, d_x, omega)
    all_x = slopes(impact_derivative(upper, v_x, all_x, omega, s_x), d, h, r)
    put_set(out, upper, landing(taylor_set, (rate, late, d), (all_rate, tau, all_x, h, omega), root), True)
    return high(all_rate) < 0.0, (size(d_x[0]) * r[0], size(d_x[1]) * r[1])
