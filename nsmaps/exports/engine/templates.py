"""The texts around the engine's functions: how a program is called, and the few functions that it has of its own."""

from string import Template

HEADER = Template("""/*
$about
 *
 * Compile with -std=c99, link with -lm. Products and sums must be rounded one by one: no -ffast-math, and no fused products,
 * which gcc leaves out with -std=c99, and clang by a pragma in the source; other compilers have options of their own.
 */
#ifndef $guard
#define $guard

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One return. Where there is no image, it and the derivative are NaN. */
typedef struct {
    int outcome;             /* why it ended: $outcomes */
    double image[2];         /* impact speed and phase, in [0, 2 pi) */
    int64_t turns;           /* whole turns of the phase on the way */
    double time;             /* taken, in the system's time */
    int64_t code;            /* of the impact word: see ${name}_word */
    double derivative[2][2]; /* of the image by the state: rows are those of the image; if it was asked for */
} ${name}_return;

/* The first return of a state. `chatter` as of nsmaps: $chatter there by default, 0 for every single impact. */
${name}_return ${name}_of(const double state[2], double chatter, bool derivative);

/* The image of a state, with chatter $chatter. Returns the outcome. */
int $name(const double state[2], double image[2]);

/* The same of count states, row after row: states and images (count, 2), outcomes and codes (count,) or NULL. */
void ${name}_batch(size_t count, const double *states, double *images, int *outcomes, int64_t *codes);

/* Write the impact word of a code, and an end, into the room for `size` characters; returns the length of the word. */
size_t ${name}_word(int64_t code, char *text, size_t size);

/* The name of an outcome. */
const char *${name}_outcome(int outcome);

#ifdef __cplusplus
}
#endif

#endif
""")
SOURCE = Template("""/* $title See $name.h. */
#include "$name.h"

#include <math.h>

#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

/* The numbers of the system, and places of numbers in them. */
static const double numbers[] = {
$table
};

$constants

/* The numbers of a system and the coefficients of the current flight. */
typedef struct {
    const double *table;
    double *flight;
} flow;

typedef struct {
    double re;
    double im;
} complex_number;

$structures

static double smaller(double x, double y)
{
    return y < x ? y : x;
}

static double larger(double x, double y)
{
    return y > x ? y : x;
}

static double complex_size(complex_number x)
{
    return hypot(x.re, x.im);
}

static complex_number complex_sum(complex_number x, complex_number y)
{
    return (complex_number){x.re + y.re, x.im + y.im};
}

static complex_number complex_difference(complex_number x, complex_number y)
{
    return (complex_number){x.re - y.re, x.im - y.im};
}

static complex_number complex_product(complex_number x, complex_number y)
{
    return (complex_number){x.re * y.re - x.im * y.im, x.re * y.im + x.im * y.re};
}

static complex_number complex_quotient(complex_number x, complex_number y)
{
    if (fabs(y.re) >= fabs(y.im)) {
        const double ratio = y.im / y.re, size = y.re + y.im * ratio;
        return (complex_number){(x.re + x.im * ratio) / size, (x.im - x.re * ratio) / size};
    }
    const double ratio = y.re / y.im, size = y.re * ratio + y.im;
    return (complex_number){(x.re * ratio + x.im) / size, (x.im * ratio - x.re) / size};
}

/* Speed just after an impact of speed v on the upper (or lower) wall, and its derivative by v. */
static tuple_dd rebound(const flow *p, bool up, double v)
{
    (void)p;
    if (up)
        return (tuple_dd){$upper};
    return (tuple_dd){$lower};
}

$functions
${name}_return ${name}_of(const double state[2], double chatter, bool derivative)
{
    double flight_now[$flight];
    const flow now = {numbers, flight_now};
    const $result got = first_return(&now, state[0], state[1], chatter, derivative);
    return (${name}_return){
        (int)got.m0, {got.m1, got.m2}, got.m3, got.m4, got.m5, {{got.m6.m0, got.m6.m1}, {got.m6.m2, got.m6.m3}}
    };
}

int $name(const double state[2], double image[2])
{
    const ${name}_return got = ${name}_of(state, $chatter, false);
    image[0] = got.image[0];
    image[1] = got.image[1];
    return got.outcome;
}

void ${name}_batch(size_t count, const double *states, double *images, int *outcomes, int64_t *codes)
{
    for (size_t k = 0; k < count; ++k) {
        const ${name}_return got = ${name}_of(states + 2 * k, $chatter, false);
        images[2 * k] = got.image[0];
        images[2 * k + 1] = got.image[1];
        if (outcomes)
            outcomes[k] = got.outcome;
        if (codes)
            codes[k] = got.code;
    }
}

size_t ${name}_word(int64_t code, char *text, size_t size)
{
    static const char *const letters[] = {$letters};
    size_t length = 0;
    for (int64_t rest = code < 0 ? -code : code; rest > 0 || code < 0; rest /= $base) {
        const char *letter = rest > 0 ? letters[rest % $base - 1] : "...";
        for (; *letter; ++letter, ++length)
            if (length + 1 < size)
                text[length] = *letter;
        if (rest == 0)
            break;
    }
    if (size > 0)
        text[length < size ? length : size - 1] = '\\0';
    return length;
}

const char *${name}_outcome(int outcome)
{
    static const char *const names[] = {$names};
    return 0 <= outcome && outcome < $outcome_count ? names[outcome] : "";
}
""")
MODULE = Template('''"""
$about

    using .$module
    $module.$name([v, phi])                  # (outcome, image, turns, time, code, derivative), the derivative NaN
    $module.$name([v, phi]; derivative=true)
    $module.word(code)                       # impact word of a code
"""
module $module

export $name

const NUMBERS = [
$table
]

$constants

"The outcomes by their number, from 0."
const OUTCOMES = ($names)

"The numbers of a system and the coefficients of the current flight."
struct Flow
    table::Vector{Float64}
    flight::Vector{Float64}
end

smaller(x, y) = y < x ? y : x
larger(x, y) = y > x ? y : x
whole_part(x) = trunc(Int64, x)
square_root(x) = x < 0.0 ? NaN : Base.sqrt(x)
$aliases
"The quotient of complex numbers as the engine divides them."
function complex_quotient(x, y)
    if abs(y.re) >= abs(y.im)
        ratio = y.im / y.re
        size = y.re + y.im * ratio
        return complex((x.re + x.im * ratio) / size, (x.im - x.re * ratio) / size)
    end
    ratio = y.re / y.im
    size = y.re * ratio + y.im
    return complex((x.re * ratio + x.im) / size, (x.im * ratio - x.re) / size)
end

"Speed just after an impact of speed v on the upper (or lower) wall, and its derivative by v."
function rebound(p, up, v)
    if up
        return ($upper)
    end
    return ($lower)
end

$functions
"The first return of a state: impact speed and phase. `chatter` as of nsmaps: 0 for every single impact."
function $name(state; chatter=$chatter, derivative=false)
    now = Flow(NUMBERS, zeros($flight))
    got = first_return(now, Float64(state[1]), Float64(state[2]), Float64(chatter), derivative)
    slopes = derivative ? [got[7][1] got[7][2]; got[7][3] got[7][4]] : fill(NaN, 2, 2)
    return (outcome=OUTCOMES[got[1] + 1], image=[got[2], got[3]], turns=got[4], time=got[5], code=got[6], derivative=slopes)
end

"The impact word of a code."
function word(code)
    letters, text, rest = ($letters), "", abs(code)
    while rest > 0
        text *= letters[rest % $base]
        rest = div(rest, $base)
    end
    return code < 0 ? text * "..." : text
end

end
''')
