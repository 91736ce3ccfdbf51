/* The hand-written opponent: first returns of the vibro-impact pair, specialised to the forcing cos(pi t).
 *
 * A flight is followed in the displacement W since the last impact, without cancellation. Its acceleration g + cos(phi + pi t)
 * vanishes at times known in closed form; between two of these the velocity has at most one zero, found by Newton; between two
 * zeros of the velocity W meets a wall at most once, found by Newton on that monotone piece.
 * Taken for granted: |g| < 1, impact speeds > 0, no sticking.
 *
 * With -DPLAIN it is what one writes first: Newton from the middle of the piece, with bisection where Newton leaves it, until it
 * stands still. Without, it is tuned: each search starts from a polynomial through what is known at the ends of its piece, uses
 * the acceleration (Halley), stops as soon as the next step is known to be right, and takes that step by Taylor.
 */
#include <math.h>

#define PI 3.14159265358979323846
#define MOST_PIECES 100000
#define MOST_IMPACTS 120 /* more are taken for chatter, which is not summed up */

typedef struct { double g, w, c, s, c1, s1, c2, s2; } flight; /* cos and sin of the phase, also over pi and pi^2 */
typedef struct { double t, w, v, a, j; } state; /* time since the impact, displacement, velocity, acceleration, jerk */

static inline state at(const flight *f, double t)
{
    double x = PI * t, h = 0.5 * x, sh = sin(h), ch = cos(h), cm = -2 * sh * sh, sn = 2 * sh * ch, sm;
    if (x > 1) {
        sm = sn - x;
    } else {
        double z = x * x;
        sm = x * z * (-1.0 / 6 + z * (1.0 / 120 + z * (-1.0 / 5040 + z * (1.0 / 362880 + z * (-1.0 / 39916800
             + z * (1.0 / 6227020800.0 + z * (-1.0 / 1307674368000.0 + z / 355687428096000.0)))))));
    }
    state q;
    q.t = t;
    q.w = t * (f->w + 0.5 * f->g * t) + f->s2 * sm - f->c2 * cm;
    q.v = f->w + f->g * t + f->s1 * cm + f->c1 * sn;
    q.a = f->g + f->c + f->c * cm - f->s * sn;
    q.j = -PI * (f->s + f->s * cm + f->c * sn);
    return q;
}

#ifdef PLAIN

static state turning(const flight *f, state l, state r)
{
    double lo = l.t, hi = r.t, x = 0.5 * (lo + hi);
    int rising = r.v > l.v;
    state q;
    for (int i = 0; i < 100; i++) {
        q = at(f, x);
        if ((q.v > 0) == rising)
            hi = x;
        else
            lo = x;
        double next = x - q.v / q.a;
        if (fabs(next - x) <= 1e-15 * x || hi - lo <= 4e-16 * x)
            break;
        x = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    return q;
}

static void crossing(const flight *f, double z, state l, state r, double *time, double *velocity)
{
    double lo = l.t, hi = r.t, x = 0.5 * (lo + hi);
    int rising = r.w > l.w;
    state q;
    for (int i = 0; i < 100; i++) {
        q = at(f, x);
        if ((q.w > z) == rising)
            hi = x;
        else
            lo = x;
        double next = x - (q.w - z) / q.v;
        if (fabs(next - x) <= 1e-15 * x || hi - lo <= 4e-16 * x)
            break;
        x = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    *time = q.t;
    *velocity = q.v;
}

#else

/* where the velocity vanishes between two states at which it has opposite signs and which are zeros of the acceleration (or the
 * start); to 1e-8 of itself, where W is flat to rounding */
static state turning(const flight *f, state l, state r)
{
    double lo = l.t, hi = r.t, x = -1;
    int rising = r.v > l.v;
    if (l.a != 0) { /* the start: a parabola */
        double d = l.a * l.a - 2 * l.j * l.v;
        if (d >= 0)
            x = rising == (l.a > 0) ? -2 * l.v / (l.a + (l.a > 0 ? sqrt(d) : -sqrt(d))) : -1;
    } else { /* a cubic that is flat at both ends */
        double y = (l.v + r.v) / (l.v - r.v);
        x = lo + (hi - lo) * (0.5 + sin(asin(y) / 3));
    }
    if (!(x > lo && x < hi))
        x = 0.5 * (lo + hi);
    state q;
    for (int i = 0; i < 60; i++) {
        q = at(f, x);
        if ((q.v > 0) == rising)
            hi = x;
        else
            lo = x;
        double dx = q.v / q.a, next = x - dx;
        if (fabs(dx) <= 1e-8 * x || hi - lo <= 4e-16 * x) {
            q.t = next;
            q.w -= 0.5 * q.v * dx;
            q.v = 0;
            return q;
        }
        x = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    return q;
}

/* where W meets a wall at displacement z, once, between two states; from a parabola at the first of them */
static void crossing(const flight *f, double z, state l, state r, double *time, double *velocity)
{
    int rising = r.w > l.w;
    double lo = l.t, hi = r.t, y = z - l.w, d = l.v * l.v + 2 * l.a * y;
    double x = lo + (d >= 0 ? 2 * y / (l.v + (rising ? sqrt(d) : -sqrt(d))) : -1);
    if (!(x > lo && x < hi))
        x = lo + (hi - lo) * y / (r.w - l.w);
    for (int i = 0; i < 100; i++) {
        state q = at(f, x);
        if ((q.w > z) == rising)
            hi = x;
        else
            lo = x;
        double dx = (q.w - z) / q.v;
        dx /= 1 - 0.5 * dx * q.a / q.v;
        double next = x - dx, cube = fabs(dx * dx * dx), v = fabs(q.v);
        if ((cube * (q.a * q.a / (4 * v * v) + fabs(q.j) / (6 * v)) <= 1e-16 * x && 2 * cube <= 1e-16 * v) || hi - lo <= 2e-16 * x) {
            *time = next;
            *velocity = q.v - dx * (q.a - 0.5 * dx * q.j);
            return;
        }
        x = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    *time = x;
    *velocity = NAN;
}

#endif

/* the first impact on a wall at displacement low or high: its time and velocity */
static int impact(const flight *f, double phi, double alpha, double low, double high, double *time, double *velocity)
{
    double zeros[2] = {alpha, 2 * PI - alpha};
    int k = phi < zeros[0] ? 0 : phi < zeros[1] ? 1 : 2;
    state l = {0, 0, f->w, f->g + f->c, -PI * f->s};
    for (int i = 0; i < MOST_PIECES; i++, k++) {
        state r = at(f, (zeros[k & 1] + 2 * PI * (k >> 1) - phi) / PI);
        r.a = 0;
        if ((l.v > 0) != (r.v > 0)) {
            state q = turning(f, l, r);
            if (q.w <= low || q.w >= high) {
                crossing(f, q.w <= low ? low : high, l, q, time, velocity);
                return 1;
            }
            l = q;
        }
        if (r.w <= low || r.w >= high) {
            crossing(f, r.w <= low ? low : high, l, r, time, velocity);
            return 1;
        }
        l = r;
    }
    return 0;
}

/* first returns to B of n starts (v, phi): impact speed and phase, and the number of impacts on T on the way; -1 where none */
void first_returns(double d, double r, double g, long n, const double *starts, double *image, signed char *tops)
{
    double alpha = acos(-g);
    for (long i = 0; i < n; i++) {
        double phi = starts[2 * i + 1], v = -starts[2 * i], time;
        int count = 0, back = 0, on_base = 1;
        for (; count < MOST_IMPACTS; count++) {
            double c = cos(phi), s = sin(phi);
            flight f = {g, r * v, c, s, c / PI, s / PI, c / (PI * PI), s / (PI * PI)};
            if (!impact(&f, phi, alpha, on_base ? -d : 0, on_base ? 0 : d, &time, &v))
                break;
            phi += PI * time;
            phi -= 2 * PI * floor(phi / (2 * PI));
            back = v > 0;
            if (back)
                break;
            on_base = 0;
            v = -v;
        }
        image[2 * i] = back ? v : NAN;
        image[2 * i + 1] = back ? phi : NAN;
        tops[i] = back ? count : -1;
    }
}
