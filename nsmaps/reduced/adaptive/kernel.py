"""The compiled evaluation of a map of strips: find the leaf of a state, then evaluate two polynomials."""

import math
from typing import NamedTuple

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.exact.compiling.compiled import njit
from nsmaps.exact.engine.constants import MOST_PHASE
from nsmaps.exact.engine.jit import ENTRY, LEAN
from nsmaps.exact.outcome import Outcome
from nsmaps.reduced.adaptive.slabs import HIGH, LOW, STRAIGHT
from nsmaps.reduced.adaptive.tree import ALONG_S, UNDIVIDED

ORDER = 8  #: coefficients of a segment of a curve
BLOCK, FEW = 64, 8  # states of a leaf that are evaluated together, and the number below which they are evaluated singly
TWO_PI, WHOLE = 2 * math.pi, 2 * math.pi * (1 - 1e-12)  #: and the length from which phases are those of the whole circle
UNCOVERED, INVALID = int(Outcome.uncovered), int(Outcome.invalid)
EXACT, OUTSIDE = -1, -2  #: in place of a leaf: the exact map must answer; the state is not in the box


class Tables(NamedTuple):
    """A map of strips in arrays: S slabs, C curves, N nodes of trees, L leaves, B buckets of speeds."""

    box: Floats  #: shape (4,), low and high speed, low and high phase
    raster: Ints  #: the leaf that contains a cell of a raster over the box entirely, or -1
    leaf: Floats  #: shape (L, 14), the data for evaluating a leaf: the columns are named below
    curve: Floats  #: shape (segments, ORDER), powers of t in [-1, 1]
    coefficient: Floats  #: by four powers of u and powers of w, each with four coefficients of speed and of advance
    bucket: Ints  #: shape (B,), the slab in which each of B equal parts of the speeds begins
    slab: Floats  #: shape (S, 3), low and high speed, chart of s over the speeds
    first: Ints  #: shape (S + 1,), the first curve of each slab
    segment: Ints  #: shape (C, 2), the first segment of each curve, and how many it has
    root: Ints  #: shape (C, 2), the trees of the cell above each curve: its own, or of its lower and its upper half; -1 for none
    across: Ints  #: shape (C, 2), the charts of x in these trees
    axis: Ints  #: shape (N,), ALONG_S: divided at a value of s, ALONG_X: of x, UNDIVIDED: not divided
    cut: Floats  #: shape (N,)
    child: Ints  #: shape (N, 2), the nodes below and above the cut; the number of a leaf
    near: float  #: radians from an edge within which the exact map must answer


#: The columns of `Tables.leaf`: the speeds and the chart of the slab; the first segment and the number of segments of the curves
#: below and above the leaf; the chart across the cell; how the charts are scaled to [-1, 1]; degree and place of polynomials.
SPEED_LOW, SPEED_HIGH, S_CHART, BELOW_FIRST, BELOW_COUNT, ABOVE_FIRST, ABOVE_COUNT, X_CHART = range(8)
S_CENTRE, S_SCALE, X_CENTRE, X_SCALE, DEGREE, OFFSET = range(8, 14)


FAST = {"contract": True, "nsz": True}  #: a product and a sum may be rounded once, and zeros have no sign
inner = njit(**LEAN, fastmath=FAST)
inlined = njit(**LEAN, fastmath=FAST, forceinline=True)
allocating = njit(**{**LEAN, "_nrt": True}, fastmath=FAST)
entry = njit(**ENTRY, fastmath=FAST)


@inlined
def along(low, high, chart, v):
    """The place s in [-1, 1] of a speed in a slab."""
    if chart == LOW:
        return 2.0 * math.sqrt((v - low) / (high - low)) - 1.0
    if chart == HIGH:
        return 1.0 - 2.0 * math.sqrt((high - v) / (high - low))
    return 2.0 * ((v - low) / (high - low)) - 1.0


@inlined
def across(rise, drop, chart):
    """The place x in [0, 1] across a cell, of a state at these heights above its lower and below its upper edge."""
    x = (drop if chart == HIGH else rise) / (rise + drop)
    return x if chart == STRAIGHT else math.sqrt(x)


@inlined
def phase(curve, first, count, s):
    """The phase at s of a curve of `count` segments."""
    x = (s + 1.0) * (0.5 * count)
    k = min(max(int(x), 0), count - 1)
    t = 2.0 * (x - k) - 1.0
    k += first
    tt = t * t
    low = (curve[k, 0] + t * curve[k, 1]) + tt * (curve[k, 2] + t * curve[k, 3])
    return low + (tt * tt) * ((curve[k, 4] + t * curve[k, 5]) + tt * (curve[k, 6] + t * curve[k, 7]))


@inner
def search(tables, v, phi):
    """The leaf of a state in the box, or EXACT."""
    box, slab, segment = tables.box, tables.slab, tables.segment
    count = len(tables.bucket)
    i = tables.bucket[min(int((v - box[0]) * (count / (box[1] - box[0]))), count - 1)]
    while i < len(slab) and v > slab[i, 1]:
        i += 1
    if i == len(slab) or v < slab[i, 0]:
        return EXACT
    s = along(slab[i, 0], slab[i, 1], slab[i, 2], v)
    bottom, top = tables.first[i], tables.first[i + 1] - 1
    c = bottom
    below = phase(tables.curve, segment[c, 0], segment[c, 1], s)
    above = phase(tables.curve, segment[c + 1, 0], segment[c + 1, 1], s)
    while c + 1 < top and phi >= above:
        c, below = c + 1, above
        above = phase(tables.curve, segment[c + 1, 0], segment[c + 1, 1], s)
    rise, drop = max(phi - below, 0.0), max(above - phi, 0.0)
    half = 1 if tables.root[c, 1] >= 0 and rise > drop else 0
    node = tables.root[c, half]
    if node < 0 or (rise < tables.near and c > bottom) or (drop < tables.near and c + 1 < top):
        return EXACT
    x = across(rise, drop, tables.across[c, half])
    while tables.axis[node] != UNDIVIDED:
        node = tables.child[node, 0 if (s if tables.axis[node] == ALONG_S else x) <= tables.cut[node] else 1]
    return tables.child[node, 0]


@inner
def places(row, curve, u, w):
    """Transform speeds and phases of states of one leaf, in place, to its coordinates u and w in [-1, 1]."""
    low, high, bend, chart = row[SPEED_LOW], row[SPEED_HIGH], row[S_CHART], row[X_CHART]
    first, count = int(row[BELOW_FIRST]), int(row[BELOW_COUNT])
    next_first, next_count = int(row[ABOVE_FIRST]), int(row[ABOVE_COUNT])
    s0, s_scale, x0, x_scale = row[S_CENTRE], row[S_SCALE], row[X_CENTRE], row[X_SCALE]
    for j in range(len(u)):
        u[j] = along(low, high, bend, u[j])
    for j in range(len(u)):
        rise = max(w[j] - phase(curve, first, count, u[j]), 0.0)
        drop = max(phase(curve, next_first, next_count, u[j]) - w[j], 0.0)
        w[j] = (across(rise, drop, chart) - x0) * x_scale
        u[j] = (u[j] - s0) * s_scale


@inlined
def polynomials(a, at, degree, u, w):
    """Speed and advance of the phase: four powers of u together, in powers of w, from the highest on."""
    uu = u * u
    speed, advance = 0.0, 0.0
    for power in range(degree % 4, degree + 1, 4):
        p0, p1, p2, p3, q0, q1, q2, q3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for _ in range(power + 1):
            p0, p1, p2, p3 = p0 * w + a[at], p1 * w + a[at + 1], p2 * w + a[at + 2], p3 * w + a[at + 3]
            q0, q1, q2, q3 = q0 * w + a[at + 4], q1 * w + a[at + 5], q2 * w + a[at + 6], q3 * w + a[at + 7]
            at += 8
        speed = speed * (uu * uu) + ((p0 + u * p1) + uu * (p2 + u * p3))
        advance = advance * (uu * uu) + ((q0 + u * q1) + uu * (q2 + u * q3))
    return speed, advance


@inner
def leaves_of(tables, v, phi, number):
    """The leaf of every state, EXACT or OUTSIDE, written into an array. The raster gives it except near boundaries."""
    box, raster = tables.box, tables.raster
    rows, columns = raster.shape
    v0, v1, phi0, phi1 = box
    dv, dphi = rows / (v1 - v0), columns / (phi1 - phi0)
    for i in range(len(v)):
        k = OUTSIDE
        if v0 <= v[i] <= v1 and phi0 <= phi[i] <= phi1:
            k = raster[min(int((v[i] - v0) * dv), rows - 1), min(int((phi[i] - phi0) * dphi), columns - 1)]
            if k < 0:
                k = search(tables, v[i], phi[i])
        number[i] = k


@inner
def crowd(a, at, degree, u, w, rows, speed, advance):
    """As `polynomials`, for many states of one leaf together."""
    n = len(u)
    for k in range(n):
        speed[k], advance[k] = 0.0, 0.0
    for power in range(degree % 4, degree + 1, 4):
        for r in range(8):
            for k in range(n):
                rows[r, k] = 0.0
        for _ in range(power + 1):
            for r in range(8):
                term = a[at + r]
                for k in range(n):
                    rows[r, k] = rows[r, k] * w[k] + term
            at += 8
        for k in range(n):
            uu = u[k] * u[k]
            low, high = rows[0, k] + u[k] * rows[1, k], rows[2, k] + u[k] * rows[3, k]
            speed[k] = speed[k] * (uu * uu) + (low + uu * high)
            low, high = rows[4, k] + u[k] * rows[5, k], rows[6, k] + u[k] * rows[7, k]
            advance[k] = advance[k] * (uu * uu) + (low + uu * high)


@allocating
def by_leaf(number, leaves):
    """The states ordered by leaf, and the place at which each leaf begins; a state in no leaf has a number below 0."""
    first = np.zeros(leaves + 1, np.int64)
    for k in number:
        if k >= 0:
            first[k + 1] += 1
    for k in range(leaves):
        first[k + 1] += first[k]
    order, at = np.empty(first[leaves], np.int64), first.copy()
    for i in range(len(number)):
        if number[i] >= 0:
            order[at[number[i]]] = i
            at[number[i]] += 1
    return order, first


@entry
def evaluate(tables, v, phi, speed, advance, number):
    """Speeds, advances of the phase and leaves of a batch, written into the given arrays."""
    leaf, curve, coefficient = tables.leaf, tables.curve, tables.coefficient
    leaves_of(tables, v, phi, number)
    for i in range(len(v)):
        speed[i], advance[i] = math.nan, math.nan
    order, first = by_leaf(number, len(leaf))
    u, w, rows, f, g = np.empty(BLOCK), np.empty(BLOCK), np.empty((8, BLOCK)), np.empty(BLOCK), np.empty(BLOCK)
    for k in range(len(leaf)):
        degree, offset = int(leaf[k, DEGREE]), int(leaf[k, OFFSET])
        for begin in range(first[k], first[k + 1], BLOCK):
            n = min(BLOCK, first[k + 1] - begin)
            for j in range(n):
                u[j], w[j] = v[order[begin + j]], phi[order[begin + j]]
            places(leaf[k], curve, u[:n], w[:n])
            if n < FEW:
                for j in range(n):
                    f[j], g[j] = polynomials(coefficient, offset, degree, u[j], w[j])
            else:
                crowd(coefficient, offset, degree, u[:n], w[:n], rows, f, g)
            for j in range(n):
                speed[order[begin + j]], advance[order[begin + j]] = f[j], g[j]


@entry
def turned_into(phases, start, v, phi):
    """Write speeds, and phases in the turn from the lowest phase on, of states (N, 2)."""
    low, high = phases
    for i in range(len(v)):
        v[i] = start[i, 0]
        phi[i] = start[i, 1] - TWO_PI * math.floor((start[i, 1] - low) / TWO_PI) if abs(start[i, 1]) < MOST_PHASE else math.nan
        if high - low >= WHOLE and abs(phi[i] - math.pi - low) < 4:  # otherwise rounding at an end leads out of the circle
            phi[i] = min(max(phi[i], low), high)


@entry
def finish(start, phi, speed, advance, number, words, rate, image, turns, codes, outcome, time):
    """Write the fields of `Returns`, from speeds, advances of the phase and leaves."""
    for i in range(len(number)):
        k = number[i]
        lifted = phi[i] + advance[i]
        angle = max(lifted - TWO_PI * math.floor(lifted / TWO_PI), 0.0)
        angle = angle if angle < TWO_PI else 0.0
        image[i, 0], image[i, 1], time[i] = speed[i], angle if k >= 0 else math.nan, advance[i] / rate
        turns[i, 0], turns[i, 1] = 0, 0
        codes[i], outcome[i] = 0, UNCOVERED if math.isfinite(start[i, 0]) and abs(start[i, 1]) < MOST_PHASE else INVALID
        if k >= 0:
            turns[i, 1] = round((start[i, 1] + advance[i] - angle) / TWO_PI)
            codes[i], outcome[i] = words[k, 0], words[k, 1]


@entry
def rasterize(tables):
    """Write into the raster the leaf that contains each of its cells entirely.

    At one speed a leaf covers an interval of phases, so a cell lies in it if its two ends do, at every speed: they are tested
    at nine speeds, half a cell further out, a margin that the smooth curves bounding a leaf do not exceed.
    """
    box, raster = tables.box, tables.raster
    rows, columns = raster.shape
    dv, dphi = (box[1] - box[0]) / rows, (box[3] - box[2]) / columns
    found = np.empty(columns + 2, np.int64)  # at lower ends; the upper end of a cell is the lower one of the next but one
    for i in range(rows):
        for k in range(9):
            v = min(max(box[0] + (i + k * 0.1275 - 0.01) * dv, box[0]), box[1])
            for j in range(columns + 2):
                if k == 0 or raster[i, min(j, columns - 1)] >= 0 or raster[i, max(j - 2, 0)] >= 0:
                    found[j] = search(tables, v, min(max(box[2] + (j - 0.5) * dphi, box[2]), box[3]))
            for j in range(columns):
                if found[j] != found[j + 2] or (k > 0 and found[j] != raster[i, j]):
                    raster[i, j] = -1
                elif k == 0:
                    raster[i, j] = found[j]


@entry
def chain(tables, phases, words, rate, at, states, turns, codes, outcome, time):
    """Returns of one orbit from number `at` on; the number of the first that the exact map must compute, or the end."""
    v, phi, u, w = np.empty(1), np.empty(1), np.empty(1), np.empty(1)
    speed, advance, number = np.empty(1), np.empty(1), np.empty(1, np.int64)
    for i in range(at, len(codes)):
        turned_into(phases, states[i : i + 1], v, phi)
        leaves_of(tables, v, phi, number)
        if number[0] == EXACT:
            return i
        speed[0], advance[0] = math.nan, math.nan
        if number[0] >= 0:
            row = tables.leaf[number[0]]
            u[0], w[0] = v[0], phi[0]
            places(row, tables.curve, u, w)
            speed[0], advance[0] = polynomials(tables.coefficient, int(row[OFFSET]), int(row[DEGREE]), u[0], w[0])
        one, image = slice(i, i + 1), states[i + 1 : i + 2]
        finish(states[one], phi, speed, advance, number, words, rate, image, turns[one], codes[one], outcome[one], time[one])
        if i > 0 and outcome[i] == INVALID:
            outcome[i] = outcome[i - 1]
    return len(codes)
