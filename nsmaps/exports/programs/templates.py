"""The texts around the engine's functions: how a program is called."""

from dataclasses import dataclass
from string import Template


@dataclass(frozen=True)
class Entry:
    """How the first return of a kind of system is called."""

    c: Template
    julia: Template
    javascript: Template


HEADER = Template("""/*
$about
 *
 * Compile with -std=c99, link with -lm. Products and sums must be rounded one by one: no -ffast-math, and no fused products,
 * which gcc leaves out with -std=c99 (gcc 12 for AVX-512 with -fno-tree-slp-vectorize too), and clang by a pragma in the source;
 * other compilers have options of their own.
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
    double image[$n];         /* $coordinates */
    int64_t turns;           /* whole turns of the phase on the way */
    double time;             /* taken, in the system's time */
    int64_t code;            /* of the impact word: see ${name}_word */
    double derivative[$n][$n]; /* of the image by the state: rows are those of the image; if it was asked for */
} ${name}_return;

/* The first return of a state. `chatter` as of nsmaps: $chatter there by default, 0 for every single impact. */
${name}_return ${name}_of(const double state[$n], double chatter, bool derivative);

/* The image of a state, with chatter $chatter. Returns the outcome. */
int $name(const double state[$n], double image[$n]);

/* The same of count states, row after row: states and images (count, $n), outcomes and codes (count,) or NULL. */
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
#include <string.h>

#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

$data

$functions
$entry
int $name(const double state[$n], double image[$n])
{
    const ${name}_return got = ${name}_of(state, $chatter, false);
    memcpy(image, got.image, sizeof got.image);
    return got.outcome;
}

void ${name}_batch(size_t count, const double *states, double *images, int *outcomes, int64_t *codes)
{
    for (size_t k = 0; k < count; ++k) {
        const ${name}_return got = ${name}_of(states + $n * k, $chatter, false);
        memcpy(images + $n * k, got.image, sizeof got.image);
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
    $module.$name([$state])                  # (outcome, image, turns, time, code, derivative), the derivative NaN
    $module.$name([$state]; derivative=true)
    $module.word(code)                       # word of a code
"""
module $module

export $name

"The outcomes by their number, from 0."
const OUTCOMES = ($names)

$data

smaller(x, y) = y < x ? y : x
larger(x, y) = y > x ? y : x
whole_part(x) = trunc(Int64, x)
whole_floor(x) = floor(Int64, x)
square_root(x) = x < 0.0 ? NaN : Base.sqrt(x)

$functions
$entry

"The word of a code."
function word(code)
    letters, text, rest = ($letters,), "", abs(code)
    while rest > 0
        text *= letters[rest % $base]
        rest = div(rest, $base)
    end
    return code < 0 ? text * "..." : text
end

end
''')
DISPLACEMENT = Entry(
    c=Template("""${name}_return ${name}_of(const double state[2], double chatter, bool derivative)
{
    flow now = {$start};
    const $result got = $first_return(&now, state[0], state[1], chatter, derivative);
    return (${name}_return){
        (int)got.m0, {got.m1, got.m2}, got.m3, got.m4, got.m5, {{got.m6.m0, got.m6.m1}, {got.m6.m2, got.m6.m3}}
    };
}
"""),
    julia=Template(""""The first return of a state: impact speed and phase. `chatter` as of nsmaps: 0 for every single impact."
function $name(state; chatter=$chatter, derivative=false)
    got = $first_return(flow(0), Float64(state[1]), Float64(state[2]), Float64(chatter), derivative)
    slopes = derivative ? [got[7][1] got[7][2]; got[7][3] got[7][4]] : fill(NaN, 2, 2)
    return (outcome=OUTCOMES[got[1] + 1], image=[got[2], got[3]], turns=got[4], time=got[5], code=got[6], derivative=slopes)
end
"""),
    javascript=Template("""const now = memory(0, $chatter)

/* The first return of a state: impact speed and phase. `chatter` as of nsmaps: 0 for every single impact. */
function of(state, derivative = false, chatter = $chatter) {
    const got = $first_return(now, state[0], state[1], chatter, derivative)
    const slopes = derivative ? [[got.m6.m0, got.m6.m1], [got.m6.m2, got.m6.m3]] : [[NaN, NaN], [NaN, NaN]]
    return {outcome: OUTCOMES[got.m0], image: [got.m1, got.m2], turns: got.m3, time: got.m4, code: got.m5, derivative: slopes}
}
"""),
)
MODES = Entry(
    c=Template("""${name}_return ${name}_of(const double state[$n], double chatter, bool derivative)
{
    memory now = {$start};
    ${name}_return found;
    (void)chatter;
    for (int k = 0; k < $n * $n; ++k)
        found.derivative[k / $n][k % $n] = NAN;
    const $result got = $first_return(state, found.image, found.derivative, &now);
    found.outcome = (int)got.m0;
    found.code = got.m1;
    found.time = got.m2;
    found.turns = $turns;
    return found;
}
"""),
    julia=Template(""""The first return of a state. `chatter` as of nsmaps: 0 for every single impact."
function $name(state; chatter=$chatter, derivative=false)
    row, image, slopes = collect(Float64, state), fill(NaN, $n), fill(NaN, $n, $n)
    got = $first_return(row, image, slopes, memory(derivative ? $n : 0, Float64(chatter)))
    outcome = OUTCOMES[got[1] + 1]
    return (outcome=outcome, image=image, turns=$turns, time=got[3], code=got[2], derivative=permutedims(slopes))
end
"""),
    javascript=Template("""/* The first return of a state. `chatter` as of nsmaps: 0 for every single impact. */
function of(state, derivative = false, chatter = $chatter) {
    const image = Array($n).fill(NaN), slopes = Array.from({length: $n}, () => Array($n).fill(NaN))
    const got = $first_return(state, image, slopes, memory(derivative ? $n : 0, chatter))
    return {outcome: OUTCOMES[got.m0], image, turns: $turns, time: got.m2, code: got.m1, derivative: slopes}
}
"""),
)
