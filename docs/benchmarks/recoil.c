/* The hand-written opponent: first returns of the recoil pair, specialised to it; see loop.c.
 *
 * Between impacts the capsule X'' = cos(psi) - kappa X - lambda X', psi = phi + pi t, is the harmonic response plus an oscillation
 * that decays, and the relative place x is X and a parabola. Neither the zeros of the velocity nor those of the acceleration are
 * known in closed form: a flight is followed in steps of a length that has at most one zero of the velocity. Where the velocity
 * changes sign between two steps its zero is found, and where x leaves [-d/2, d/2] on a monotone piece the impact, both by Newton
 * from the middle with bisection where Newton leaves the bracket.
 * Taken for granted: kappa > lambda^2/4, no sticking.
 *
 * With -DPLAIN every place is computed from the closed form. Without, it is tuned: steps multiply by the matrix of one step, which is
 * computed once, the searches start from a cubic through the ends of the step and stop as soon as the next step is known to be right.
 */
#include <math.h>

#define PI 3.14159265358979323846
#define STEP 0.125
#define MOST_STEPS 100000
#define MOST_IMPACTS 120

typedef struct { double kappa, lambda, d, r, g, eta, p, q, decay, w; } pair; /* harmonic response p cos + q sin */
typedef struct { double t, x, v, X, V, c, s; } state; /* c and s of the phase */
typedef struct { const pair *k; double phi, x, v, X, V, a, b; } flight; /* state at the start; of the oscillation that decays */

static flight begun(const pair *k, const state *q, double phi)
{
    double X = q->X - k->p * q->c - k->q * q->s, V = q->V - PI * (k->q * q->c - k->p * q->s);
    flight f = {k, phi, q->x, q->v, q->X, q->V, X, (V + k->decay * X) / k->w};
    return f;
}

static inline state at(const flight *f, double t)
{
    const pair *k = f->k;
    double c = cos(f->phi + PI * t), s = sin(f->phi + PI * t), e = exp(-k->decay * t), C = e * cos(k->w * t), S = e * sin(k->w * t);
    double X = k->p * c + k->q * s + f->a * C + f->b * S;
    double V = PI * (k->q * c - k->p * s) + (k->w * f->b - k->decay * f->a) * C - (k->w * f->a + k->decay * f->b) * S;
    state q = {t, f->x + (f->v - f->V) * t + 0.5 * k->g * t * t + (X - f->X), f->v - f->V + k->g * t + V, X, V, c, s};
    return q;
}

static inline double acceleration(const pair *k, const state *q)
{
    return q->c - k->kappa * q->X - k->lambda * q->V + k->g;
}

#ifdef PLAIN
#define FIRST(l, r, y, x) (void)0
#define DONE(dx, bend, slope, x) 0
#else
/* from a cubic through places and velocities at both ends, one secant and two Newton steps on it, in [0, 1] of the step */
static double cubic(double y0, double u0, double y1, double u1)
{
    double c = 3 * (y1 - y0) - 2 * u0 - u1, d = 2 * (y0 - y1) + u0 + u1, z = y0 / (y0 - y1);
    for (int i = 0; i < 3; i++)
        z -= (y0 + z * (u0 + z * (c + z * d))) / (u0 + z * (2 * c + z * 3 * d));
    return z;
}
#endif

/* the one zero of the velocity (place NaN), or of x - place, between two states on either side of it */
static state zero(const flight *f, double place, state l, state r)
{
    int turning = isnan(place), rising = turning ? r.v > l.v : r.x > l.x;
    double lo = l.t, hi = r.t, x = 0.5 * (lo + hi);
#ifndef PLAIN
    double h = hi - lo, z = turning ? cubic(l.v, h * acceleration(f->k, &l), r.v, h * acceleration(f->k, &r))
                                    : cubic(l.x - place, h * l.v, r.x - place, h * r.v);
    if (z > 0 && z < 1)
        x = lo + z * h;
#endif
    state q;
    for (int i = 0; i < 100; i++) {
        q = at(f, x);
        double y = turning ? q.v : q.x - place, u = turning ? acceleration(f->k, &q) : q.v;
        if ((y > 0) == rising)
            hi = x;
        else
            lo = x;
        double dx = y / u, next = x - dx;
#ifdef PLAIN
        if (fabs(dx) <= 1e-15 * x || hi - lo <= 4e-16 * x)
            break;
#else
        if (fabs(dx) <= (turning ? 1e-8 : 1e-15) * x || hi - lo <= 4e-16 * x) /* at a turning point x is flat */
            break;
        if (!turning) { /* Halley, whose next step is known where it is cubically small; then Taylor */
            double b = acceleration(f->k, &q);
            dx /= 1 - 0.5 * dx * b / u;
            next = x - dx;
            if (fabs(dx) <= 1e-6 && next > lo && next < hi) {
                double jerk = -PI * q.s - f->k->kappa * q.V - f->k->lambda * (b - f->k->g), B = b - f->k->g, t = dx * dx;
                q.t = next, q.x = place, q.X -= dx * (q.V - 0.5 * dx * B), q.V -= dx * (B - 0.5 * dx * jerk);
                q.v -= dx * (b - 0.5 * dx * jerk);
                double c = q.c + PI * dx * q.s - 0.5 * PI * PI * t * q.c, s = q.s - PI * dx * q.c - 0.5 * PI * PI * t * q.s;
                q.c = c, q.s = s;
                return q;
            }
        }
#endif
        x = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    return q;
}

#ifndef PLAIN
/* the matrix of one step on (X, V, cos, sin), and of the displacement that X alone gives to x */
static double matrix[2][4];

static void prepare(const pair *k)
{
    for (int j = 0; j < 4; j++) {
        state q = {0, 0, 0, j == 0, j == 1, j == 2, j == 3};
        double X = q.X - k->p * q.c - k->q * q.s, V = q.V - PI * (k->q * q.c - k->p * q.s);
        flight f = {k, 0, 0, 0, 0, 0, X, (V + k->decay * X) / k->w};
        double e = exp(-k->decay * STEP), C = e * cos(k->w * STEP), S = e * sin(k->w * STEP), c = cos(PI * STEP), s = sin(PI * STEP);
        double cc = q.c * c - q.s * s, ss = q.s * c + q.c * s;
        matrix[0][j] = k->p * cc + k->q * ss + f.a * C + f.b * S;
        matrix[1][j] = PI * (k->q * cc - k->p * ss) + (k->w * f.b - k->decay * f.a) * C - (k->w * f.a + k->decay * f.b) * S;
    }
}

static inline state next_state(const flight *f, const state *l)
{
    static const double c = 0.92387953251128675613, s = 0.38268343236508977173; /* cos and sin of pi/8 */
    double t = l->t + STEP, g = f->k->g;
    double X = matrix[0][0] * l->X + matrix[0][1] * l->V + matrix[0][2] * l->c + matrix[0][3] * l->s;
    double V = matrix[1][0] * l->X + matrix[1][1] * l->V + matrix[1][2] * l->c + matrix[1][3] * l->s;
    state q = {t, f->x + (f->v - f->V) * t + 0.5 * g * t * t + (X - f->X), f->v - f->V + g * t + V, X, V,
               l->c * c - l->s * s, l->s * c + l->c * s};
    return q;
}
#endif

/* the state at the first impact after the start; 0 where there is none */
static int impact(const flight *f, state l, state *met)
{
    double wall = 0.5 * f->k->d;
    for (int i = 1; i < MOST_STEPS; i++) {
#ifdef PLAIN
        state r = at(f, i * STEP);
#else
        state r = next_state(f, &l);
#endif
        if ((l.v > 0) != (r.v > 0)) {
            state q = zero(f, NAN, l, r);
            if (fabs(q.x) >= wall) {
                *met = zero(f, q.x > 0 ? wall : -wall, l, q);
                return 1;
            }
            l = q;
        }
        if (fabs(r.x) >= wall) {
            *met = zero(f, r.x > 0 ? wall : -wall, l, r);
            return 1;
        }
        l = r;
    }
    return 0;
}

/* first returns to B of n starts (v, X, V, phi); and the number of impacts on T on the way, -1 where there is none */
void first_returns(double kappa, double lambda, double d, double r, double g, double eta, long n, const double *starts, double *image,
                   signed char *tops)
{
    double stiff = kappa - PI * PI, drag = PI * lambda, size = stiff * stiff + drag * drag;
    pair k = {kappa, lambda, d, r, g, eta, stiff / size, drag / size, 0.5 * lambda, sqrt(kappa - 0.25 * lambda * lambda)};
#ifndef PLAIN
    prepare(&k);
#endif
    for (long i = 0; i < n; i++) {
        const double *row = starts + 4 * i;
        double phi = row[3];
        state q = {0, 0.5 * d, row[0], row[1], row[2], cos(phi), sin(phi)};
        int count = 0, back = 0;
        for (; count < MOST_IMPACTS; count++) {
            q.x = q.x > 0 ? 0.5 * d : -0.5 * d, q.t = 0;
            q.V -= eta * (1 + r) / (1 + eta) * q.v, q.v *= -r;
            flight f = begun(&k, &q, phi);
            if (!impact(&f, q, &q))
                break;
            phi += PI * q.t;
            phi -= 2 * PI * floor(phi / (2 * PI));
            back = q.x > 0;
            if (back)
                break;
        }
        double *out = image + 4 * i;
        out[0] = back ? q.v : NAN, out[1] = q.X, out[2] = q.V, out[3] = phi, tops[i] = back ? count : -1;
    }
}
