"""Sets of states that fly together, and the impacts of a set on a wall that all of it meets.

A *swarm* is a set of impacts on one wall that depends on x, |x_k| <= r_k, in balls: for x = 0 its centre c and derivative
d, for all x the derivative D and the second one H, and, besides, a box (V, P) around it. By Taylor's theorem (v, phi) is in
c + D x and in c + d x + H x x/2, and D in d + H x. All that is known is met: next to a graze H grows as the third power of
1/rate, D as the first, and the box does not grow; elsewhere H is what makes the image narrow. The gap to a wall at time s is
that of the box and, by the mean value theorem, that of the centre and its derivative over the set times x.
"""

from nsmaps.exact.enclosure.balls import GROW, NOTHING, ONE, badd, bangle, binv, bmeet, bmul, bneg, bsub, high, low, size
from nsmaps.exact.enclosure.bounds import ball_bounds
from nsmaps.exact.enclosure.flow import (
    at_time,
    ball_begin,
    ball_bends,
    ball_motion,
    ball_places,
    ball_rate,
    ball_rebound,
    ball_tangent,
)
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.march import OUTWARD

UPPER, SMOOTH, ROW = 38, 39, 40  # columns of a table of swarms


@inlined
def box_swarm(v, phi):
    """The swarm that fills a box."""
    flat = NOTHING, NOTHING, NOTHING, NOTHING, NOTHING, NOTHING
    unit = ONE, NOTHING, NOTHING, ONE
    return (v[0], 0.0), (phi[0], 0.0), unit, unit, flat, (v[1], phi[1]), v, phi


@inlined
def spread(a, b, r):
    """The radius of a x_1 + b x_2."""
    return (size(a) * r[0] + size(b) * r[1]) * GROW


@inlined
def widened(c, r):
    """A ball with a greater radius."""
    return c[0], (c[1] + r) * GROW


@inner
def slopes(known, d, h, r):
    """What is known of the first derivative over a swarm, within that of the centre and the second."""
    return (
        bmeet(known[0], widened(d[0], spread(h[0], h[1], r))),
        bmeet(known[1], widened(d[1], spread(h[1], h[2], r))),
        bmeet(known[2], widened(d[2], spread(h[3], h[4], r))),
        bmeet(known[3], widened(d[3], spread(h[4], h[5], r))),
    )


@inner
def launch_of(p, up, v):
    """The velocity after impacts of speeds v, and its first and second derivative by v."""
    u, slope, bend = ball_rebound(p, up, v)
    return (bneg(u), bneg(slope), bneg(bend)) if up else (u, slope, bend)


@inner
def launched(p, up, swarm):
    """Write what of the flights of a swarm, and of its centre, does not depend on time; their velocities and bounds.

    Returns ((velocities, those of the centre, phase and velocity by x, radii of x), bound on |jerk|, on |snap|).
    """
    v, phi, _, d, _, r, box_v, box_phi = swarm
    top, bottom = ball_places(p)
    z = top if up else bottom
    w, slope, _ = launch_of(p, up, box_v)
    centre, _, _ = launch_of(p, up, v)
    ball_begin(p, p.one, bangle(phi), z, centre, 1)
    ball_begin(p, p.whole, bangle(box_phi), z, w, 2)
    jerk, snap = ball_bounds(p, p.whole)
    by_x = d[2], d[3], bmul(slope, d[0]), bmul(slope, d[1])
    return (w, centre, by_x, r), jerk * OUTWARD, snap * OUTWARD


@inlined
def by_start(p, flight):
    """The derivatives of displacement and velocity by x at the time of `at_time`."""
    phi_1, phi_2, w_1, w_2 = flight[2]
    d_phi, d_w, v_phi, v_w, _, _ = ball_tangent(p, p.whole, 1)
    return (
        badd(bmul(d_phi, phi_1), bmul(d_w, w_1)),
        badd(bmul(d_phi, phi_2), bmul(d_w, w_2)),
        badd(bmul(v_phi, phi_1), bmul(v_w, w_1)),
        badd(bmul(v_phi, phi_2), bmul(v_w, w_2)),
    )


@inner
def view(p, flight, s):
    """Displacement and its rates over a swarm at time s, those of its centre, and its spread by x_1 and by x_2."""
    at_time(p, (s, 0.0))
    d, v, a, j = ball_motion(p, p.one, flight[1], 1)
    all_d, all_v, all_a, all_j = ball_motion(p, p.whole, flight[0], 3)
    d_1, d_2, v_1, v_2 = by_start(p, flight)
    r = flight[3]
    motion = bmeet(all_d, widened(d, spread(d_1, d_2, r))), bmeet(all_v, widened(v, spread(v_1, v_2, r))), all_a, all_j
    return motion, (d, v, a, j), (size(d_1) * r[0], size(d_2) * r[1])


@inlined
def gap_to(upper, room, motion):
    """The gap to a wall and its rates, in balls."""
    d, v, a, j = motion
    if upper:
        return bsub(room, d), bneg(v), bneg(a), bneg(j)
    return badd(room, d), v, a, j


@inlined
def bent(b, jerk, tau):
    """The second rate within times tau."""
    return widened(b, jerk * size(tau))


@inlined
def mean_rate(u, b, tau):
    """The rate from 0 to tau, on average: by Taylor's theorem with the second rate b of some time between."""
    return badd(u, bmul(b, (0.5 * tau[0], 0.5 * tau[1])))


@inlined
def after(gap, jerk, h):
    """The gap a time h later or, where that is negative, before."""
    y, u, b, _ = gap
    return badd(y, bmul((h, 0.0), mean_rate(u, bent(b, jerk, (h, 0.0)), (h, 0.0))))


@inner
def crossing(gap, jerk, tau):
    """When, within tau, gaps close that all do so there, once: (the times, the rates then, the second rates until then)."""
    y, u, b, _ = gap
    near = -2.0 * size(y) / high(u)
    if near > 0.0 and low(after(gap, jerk, -near)) > 0.0 and high(after(gap, jerk, near)) < 0.0:
        tau = bmeet(tau, (0.0, near))
    for _ in range(2):
        tau = bmeet(tau, bneg(bmul(y, binv(mean_rate(u, bent(b, jerk, tau), tau)))))
    b = bent(b, jerk, tau)
    return tau, badd(u, bmul(b, tau)), b


@inner
def impact_slopes(tangent, rate, a, y):
    """By the implicit function theorem, at impacts: time, velocity and velocity at fixed time by x (two of each)."""
    d_phi, d_w, v_phi, v_w, _, _ = tangent
    d_1, d_2 = badd(bmul(d_phi, y[0]), bmul(d_w, y[2])), badd(bmul(d_phi, y[1]), bmul(d_w, y[3]))
    v_1, v_2 = badd(bmul(v_phi, y[0]), bmul(v_w, y[2])), badd(bmul(v_phi, y[1]), bmul(v_w, y[3]))
    slope = bneg(binv(rate))
    s_1, s_2 = bmul(d_1, slope), bmul(d_2, slope)
    return (s_1, s_2), (badd(v_1, bmul(a, s_1)), badd(v_2, bmul(a, s_2))), (v_1, v_2)


@inner
def impact_bend(tangent, bends, motion, y_k, y_m, y_km, rates_k, rates_m):
    """As `impact_slopes`, once more by x_k and x_m: of time and of velocity. `rates` are the slopes of time and at fixed s."""
    rate, a, j = motion
    (s_k, v_k, a_k), (s_m, v_m, a_m) = rates_k, rates_m
    d_km = badd(bmul(bends[0], bmul(y_k[0], y_m[0])), badd(bmul(tangent[0], y_km[0]), bmul(tangent[1], y_km[1])))
    v_km = badd(bmul(bends[1], bmul(y_k[0], y_m[0])), badd(bmul(tangent[2], y_km[0]), bmul(tangent[3], y_km[1])))
    s_both = bmul(s_k, s_m)
    d_km = badd(d_km, badd(badd(bmul(v_k, s_m), bmul(v_m, s_k)), bmul(a, s_both)))
    s_km = bneg(bmul(d_km, binv(rate)))
    v_km = badd(v_km, badd(badd(bmul(a_k, s_m), bmul(a_m, s_k)), badd(bmul(j, s_both), bmul(a, s_km))))
    return s_km, v_km


@inner
def bends_over(p, up, flight, swarm, tangent, motion, times, fixed):
    """The second derivatives of velocity and time at impacts at the times of `at_time`: by x_1 twice, by both, by x_2 twice."""
    y = flight[2]
    bends = ball_bends(p, p.whole)
    _, _, _, d, h, _, box_v, _ = swarm
    _, law, law_bend = launch_of(p, up, box_v)
    y_1, y_2 = (y[0], y[2]), (y[1], y[3])
    rates_1 = times[0], fixed[0], badd(bmul(tangent[4], y_1[0]), bmul(tangent[5], y_1[1]))
    rates_2 = times[1], fixed[1], badd(bmul(tangent[4], y_2[0]), bmul(tangent[5], y_2[1]))
    y_11 = h[3], badd(bmul(law, h[0]), bmul(law_bend, bmul(d[0], d[0])))
    y_12 = h[4], badd(bmul(law, h[1]), bmul(law_bend, bmul(d[0], d[1])))
    y_22 = h[5], badd(bmul(law, h[2]), bmul(law_bend, bmul(d[1], d[1])))
    s_11, v_11 = impact_bend(tangent, bends, motion, y_1, y_1, y_11, rates_1, rates_1)
    s_12, v_12 = impact_bend(tangent, bends, motion, y_1, y_2, y_12, rates_1, rates_2)
    s_22, v_22 = impact_bend(tangent, bends, motion, y_2, y_2, y_22, rates_2, rates_2)
    return (v_11, v_12, v_22), (s_11, s_12, s_22)


@inlined
def reach_of(d, h, r):
    """The radius of d x + h x x/2."""
    bend = size(h[0]) * r[0] * r[0] + 2.0 * size(h[1]) * r[0] * r[1] + size(h[2]) * r[1] * r[1]
    return (spread(d[0], d[1], r) + 0.5 * bend) * GROW


@inlined
def impact_derivative(upper, v_x, d, omega, s_x):
    """The derivatives of speed and phase of impacts by x, from those of velocity and time."""
    phi_1, phi_2 = badd(d[2], bmul(omega, s_x[0])), badd(d[3], bmul(omega, s_x[1]))
    return (v_x[0], v_x[1], phi_1, phi_2) if upper else (bneg(v_x[0]), bneg(v_x[1]), phi_1, phi_2)


@inner
def landed(p, up, flight, swarm, upper, room, s, tau, jerk):
    """The impacts of a swarm that surely meets a wall once, without a turn, at s + tau: (is no rate near zero, the swarm)."""
    v, phi, d, all_x, h, r, _, box_phi = swarm
    motion, centre, _ = view(p, flight, s)
    tau, gap_rate, gap_bend = crossing(gap_to(upper, room, motion), jerk, tau)
    y, u, _, _ = gap_to(upper, room, centre)
    near = badd((s, 0.0), bneg(bmul(y, binv(mean_rate(u, gap_bend, tau)))))  # of the centre
    whole = badd((s, 0.0), tau)
    omega = ball_rate(p)
    _, law, _ = launch_of(p, up, v)
    at_time(p, near)
    _, rate, a, _ = ball_motion(p, p.one, flight[1], 2)
    y_x = d[2], d[3], bmul(law, d[0]), bmul(law, d[1])
    s_x, v_x, _ = impact_slopes(ball_tangent(p, p.one, 1), rate, a, y_x)
    d = impact_derivative(upper, v_x, d, omega, s_x)
    at_time(p, whole)
    _, _, all_a, all_j = ball_motion(p, p.whole, flight[0], 3)
    tangent = ball_tangent(p, p.whole, 2)
    all_rate = bneg(gap_rate) if upper else gap_rate
    s_x, v_x, fixed = impact_slopes(tangent, all_rate, all_a, flight[2])
    v_xx, s_xx = bends_over(p, up, flight, swarm, tangent, (all_rate, all_a, all_j), s_x, fixed)
    phi_xx = badd(h[3], bmul(omega, s_xx[0])), badd(h[4], bmul(omega, s_xx[1])), badd(h[5], bmul(omega, s_xx[2]))
    if not upper:
        rate, v_xx = bneg(rate), (bneg(v_xx[0]), bneg(v_xx[1]), bneg(v_xx[2]))
    h = v_xx[0], v_xx[1], v_xx[2], phi_xx[0], phi_xx[1], phi_xx[2]
    all_x = slopes(impact_derivative(upper, v_x, all_x, omega, s_x), d, h, r)
    phase = badd(phi, bmul(omega, near))
    all_v = bmeet(bmeet(bneg(gap_rate), widened(rate, spread(all_x[0], all_x[1], r))), widened(rate, reach_of(d[:2], h[:3], r)))
    all_phi = bmeet(badd(box_phi, bmul(omega, whole)), widened(phase, spread(all_x[2], all_x[3], r)))
    all_phi = bmeet(all_phi, widened(phase, reach_of(d[2:], h[3:], r)))
    return high(gap_rate) < 0.0, (rate, phase, d, all_x, h, r, all_v, all_phi)


@inner
def put_swarm(table, n, upper, swarm, smooth):
    """Write a swarm into row n of a table."""
    v, phi, d, all_x, h, r, box_v, box_phi = swarm
    k = 0
    for each in (v, phi, *d, *all_x, *h, r, box_v, box_phi):
        table[n, k], table[n, k + 1] = each
        k += 2
    table[n, UPPER], table[n, SMOOTH] = 1.0 if upper else 0.0, 1.0 if smooth else 0.0


@inlined
def four(t, k):
    """Four balls from place k of a row."""
    return (t[k], t[k + 1]), (t[k + 2], t[k + 3]), (t[k + 4], t[k + 5]), (t[k + 6], t[k + 7])


@inner
def get_swarm(t, n):
    """The swarm in row n of a table."""
    t = t[n]
    h = *four(t, 20), (t[28], t[29]), (t[30], t[31])
    return (t[0], t[1]), (t[2], t[3]), four(t, 4), four(t, 12), h, (t[32], t[33]), (t[34], t[35]), (t[36], t[37])
