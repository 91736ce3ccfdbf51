"""Second-order Taylor sets: sets of states that are followed together.

A *Taylor set* is a set of impacts on one wall that depends on x, |x_k| <= r_k, in balls: for x = 0 its centre c and derivative d,
for all x the first derivative D and the second derivative H, and, besides, a box (V, P) around it. By Taylor's theorem (v, phi)
is in c + D x and in c + d x + H x x/2, and D in d + H x. All bounds are intersected: next to a grazing state H grows as the third
power of 1/rate, D as the first, and the box does not grow; elsewhere H makes the image narrow. The gap to a wall at time s is
that of the box and, by the mean value theorem, that of the centre plus its derivative over the set times x.
"""

from nsmaps.exact.enclosure.arithmetic.balls import GROW, NOTHING, ONE, bmeet, bmul, bneg, met, size
from nsmaps.exact.enclosure.arithmetic.elementary import bangle
from nsmaps.exact.enclosure.flight.bounds import ball_bounds
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
from nsmaps.exact.engine.constants import OUTWARD
from nsmaps.exact.engine.jit import inlined, inner

ON_TOP, SMOOTH, ROW = 38, 39, 40  # columns of a table of Taylor sets


@inlined
def box_set(v, phi):
    """The Taylor set that fills a box."""
    flat = NOTHING, NOTHING, NOTHING, NOTHING, NOTHING, NOTHING
    unit = ONE, NOTHING, NOTHING, ONE
    return (v[0], 0.0), (phi[0], 0.0), unit, unit, flat, (v[1], phi[1]), v, phi


@inlined
def put_set(t, upper, taylor_set, smooth):
    """Write a Taylor set into a row of a table."""
    v, phi, d, all_x, h, r, box_v, box_phi = taylor_set
    k = 0
    for each in (v, phi, *d, *all_x, *h, r, box_v, box_phi):
        t[k], t[k + 1] = each
        k += 2
    t[ON_TOP], t[SMOOTH] = 1.0 if upper else 0.0, 1.0 if smooth else 0.0


@inlined
def four(t, k):
    """Four balls from place k of a row."""
    return (t[k], t[k + 1]), (t[k + 2], t[k + 3]), (t[k + 4], t[k + 5]), (t[k + 6], t[k + 7])


@inlined
def get_set(t):
    """The Taylor set in a row of a table."""
    h = *four(t, 20), (t[28], t[29]), (t[30], t[31])
    return (t[0], t[1]), (t[2], t[3]), four(t, 4), four(t, 12), h, radii(t), (t[34], t[35]), (t[36], t[37])


@inlined
def radii(t):
    """The radii of x of the Taylor set in a row."""
    return t[32], t[33]


@inlined
def box_of(t):
    """The box of the Taylor set in a row."""
    return (t[34], t[35]), (t[36], t[37])


@inlined
def spread(a, b, r):
    """The radius of a x_1 + b x_2."""
    return (size(a) * r[0] + size(b) * r[1]) * GROW


@inlined
def widened(c, r):
    """A ball with a larger radius."""
    return c[0], (c[1] + r) * GROW


@inner
def slopes(known, d, h, r):
    """Bounds on the first derivative over a set, intersected with those from the derivative of the centre and the second
    derivative.
    """
    return (
        bmeet(known[0], widened(d[0], spread(h[0], h[1], r))),
        bmeet(known[1], widened(d[1], spread(h[1], h[2], r))),
        bmeet(known[2], widened(d[2], spread(h[3], h[4], r))),
        bmeet(known[3], widened(d[3], spread(h[4], h[5], r))),
    )


@inner
def launch_of(p, up, v):
    """The velocity after impacts of speeds v, and its first and second derivatives by v."""
    u, slope, bend = ball_rebound(p, up, v)
    return (bneg(u), bneg(slope), bneg(bend)) if up else (u, slope, bend)


@inner
def launched(p, up, row):
    """Write the part of the flights of the set in a row, and of its centre, that does not depend on time; their velocities and
    bounds.

    Returns ((velocities, those of the centre, phase and velocity by x, radii of x), acceleration and jerk at the start, bound on
    |jerk|, on |snap|).
    """
    v, phi, _, d, _, r, box_v, box_phi = get_set(row)
    top, bottom = ball_places(p)
    z = top if up else bottom
    w, slope, _ = launch_of(p, up, box_v)
    centre, _, _ = launch_of(p, up, v)
    whole = bangle(box_phi)
    ball_begin(p, p.one, bangle(phi), z, centre)
    centre_begin(p, centre[0])
    ball_begin(p, p.whole, whole, z, w)
    jerk, snap = ball_bounds(p, p.whole)
    by_x = d[2], d[3], bmul(slope, d[0]), bmul(slope, d[1])
    return (w, centre, by_x, r), ball_start(p, whole, z, w), jerk * OUTWARD, snap * OUTWARD


@inlined
def by_start(tangent, y):
    """The derivatives of displacement and velocity by x at fixed times, from those by phase and velocity of the start."""
    return (
        met(tangent[0], tangent[1], y[0], y[2]),
        met(tangent[0], tangent[1], y[1], y[3]),
        met(tangent[2], tangent[3], y[0], y[2]),
        met(tangent[2], tangent[3], y[1], y[3]),
    )


@inner
def view(p, flight, s):
    """Displacement and its rates over a set at time s, intersected with those from its centre; and its spread by x_1 and x_2."""
    at_time(p, (s, 0.0))
    d, v, _, _ = ball_motion(p, p.one, flight[1], 1)
    all_d, all_v, all_a, all_j = ball_motion(p, p.whole, flight[0], 3)
    d_1, d_2, v_1, v_2 = by_start(ball_tangent(p, p.whole, 1), flight[2])
    r = flight[3]
    motion = bmeet(all_d, widened(d, spread(d_1, d_2, r))), bmeet(all_v, widened(v, spread(v_1, v_2, r))), all_a, all_j
    return motion, (size(d_1) * r[0], size(d_2) * r[1])
