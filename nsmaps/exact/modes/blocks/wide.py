"""Many first returns of a system with modes in parallel: motions wait in a queue for each mode, and advance in blocks.

A block is taken through one longest step, or to its events; a motion that ends makes room for the next, so that blocks are full.
All decisions at an event are those of `happens`; returns of many events, of two at once, and of an event that takes place at once
after another are left to `first_return`.
"""

import math

from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.engine.returns import RETURNED, UNDECIDED
from nsmaps.exact.modes.blocks.columns import AT_ONCE, moved, next_events, turned
from nsmaps.exact.modes.blocks.lanes import (
    BATCH,
    BLOCK,
    CODE,
    DOUBT,
    DOUBTFUL,
    EVENT,
    FLIGHT,
    GROWN,
    KIND,
    MORE,
    MOTION,
    PHASE,
    PHI,
    POWER,
    ROW,
    SHIFT,
    START,
    STARTED,
    STEPS,
    TIME,
    TURNS,
    WHEN,
    WHICH,
    X,
)  # fmt: skip
from nsmaps.exact.modes.blocks.passing import NONE, NOT_PLAIN, begun_columns, jumped
from nsmaps.exact.modes.march.beginning import GOES_ON, begins, brief
from nsmaps.exact.modes.march.flight import NO_FUNCTION
from nsmaps.exact.modes.march.resting import entered
from nsmaps.exact.modes.march.returns import PAUSE, alone, cleared, happens, lengthened, put, settled
from nsmaps.exact.modes.march.starting import starting

FEW = 16  # fewer returns than this are not computed in blocks
MOST = 64  # events, or longest steps, of a return in a block; more are rare
LEFT = -2  # in place of an outcome: for `first_return`


@inner
def gathered(p, mode, n, o, b):
    """Write the last motions that wait in a mode to the columns of a block."""
    o.length[mode] -= n
    for k in range(n):
        i = o.queue[mode, o.length[mode] + k]
        b.h[MOTION + k], b.t[PHI + k], b.h[START + k] = i, o.scalars[i, PHASE], o.numbers[i, STARTED]
        b.t[GROWN + k] = math.expm1(min(p.abscissa[mode] * o.scalars[i, FLIGHT], 700.0)) if p.abscissa[mode] > 0.0 else 0.0
        for j in range(o.z.shape[1]):
            b.z[j, k] = o.z[i, j]


@inner
def waits(o, mode, i):
    """Put a motion into the queue of a mode, or its place among those that are free."""
    o.queue[mode, o.length[mode]] = i
    o.length[mode] += 1


@inner
def imaged(p, k, z, found, r, row, b):
    """Write the image of a motion in a column."""
    for c in range(len(p.places)):
        found.states[r + 1, row, c] = b.t[PHI + k] if p.places[c] < 0 else z[p.places[c], k]


@inner
def plainly(p, e, k, found, r, o, b):
    """Take note that a column has passed a plain event: the outcome, or GOES_ON, and the mode that follows."""
    i = b.h[MOTION + k]
    numbers = o.numbers[i]
    numbers[DOUBT] |= 1 if e == NONE or b.t[SHIFT + k] > 0.0 else 0
    if e == NONE:
        return UNDECIDED, e
    numbers[CODE], numbers[POWER] = lengthened(p.base, p.digit[e], numbers[CODE], numbers[POWER])
    numbers[STARTED], o.scalars[i, FLIGHT] = e, 0.0
    if p.is_section[e]:
        imaged(p, k, b.z if p.after else b.c, found, r, numbers[ROW], b)
        return RETURNED, p.target[e]
    return GOES_ON, p.target[e]


@inner
def decided(p, mode, k, found, r, o, b, w):
    """Take a column through its event: the outcome, or GOES_ON, and the mode that follows."""
    i = b.h[MOTION + k]
    numbers, row = o.numbers[i], o.numbers[i, ROW]
    for j in range(len(w.z)):
        w.z[j] = b.z[j, k]
    outcome, mode, numbers[CODE], numbers[POWER], unsure, numbers[STARTED] = happens(
        p, mode, b.h[WHICH + k], b.t[PHI + k], numbers[CODE], numbers[POWER], found.states[r + 1, row], found.tangents[r, row], w
    )
    numbers[DOUBT] |= 1 if unsure else 0
    o.scalars[i, FLIGHT] = 0.0
    for j in range(len(w.z)):
        b.z[j, k] = w.z[j]
    return outcome, mode


@inner
def goes_on(p, mode, k, found, r, o, b, w):
    """Take a column on, through its event if it has one: its outcome, or GOES_ON, and the mode that follows."""
    i, which = b.h[MOTION + k], b.h[WHICH + k]
    numbers, scalars = o.numbers[i], o.scalars[i]
    step = b.t[WHEN + k] * p.steps[mode]
    scalars[PHASE], scalars[TIME], scalars[FLIGHT] = b.t[PHI + k], scalars[TIME] + step, scalars[FLIGHT] + step
    numbers[TURNS] += b.h[MORE + k]
    numbers[DOUBT] |= b.h[DOUBTFUL + k]
    numbers[STEPS] += 1
    if (
        b.h[DOUBTFUL + k] == AT_ONCE
        or numbers[STEPS] > MOST
        or not b.t[X + k] < math.inf
        or (which != NO_FUNCTION and b.t[WHEN + k] == 0.0)
        or (which == NO_FUNCTION and scalars[FLIGHT] >= p.horizon)
    ):
        return LEFT, mode
    numbers[STARTED], outcome = -1, GOES_ON
    if which != NO_FUNCTION:
        e = b.h[EVENT + k]
        if e == NOT_PLAIN:
            outcome, mode = decided(p, mode, k, found, r, o, b, w)
        else:
            outcome, mode = plainly(p, e, k, found, r, o, b)
    if outcome == RETURNED and brief(p, mode, scalars[TIME], w):
        return LEFT, mode
    if outcome == GOES_ON:
        for j in range(o.z.shape[1]):
            o.z[i, j] = b.z[j, k]
    return outcome, mode


@inner
def under_way(row, k, code, power, phi, i, o):
    """Write the record of a motion that starts."""
    o.numbers[i, CODE], o.numbers[i, POWER], o.numbers[i, STARTED], o.numbers[i, ROW] = code, power, k, row
    o.numbers[i, TURNS], o.numbers[i, DOUBT], o.numbers[i, STEPS] = 0, 0, 0
    o.scalars[i, PHASE], o.scalars[i, TIME], o.scalars[i, FLIGHT] = phi, 0.0, 0.0


@inner
def launched(p, found, r, row, i, o, w):
    """Put a motion at its start into the queue of its mode; whether it is to be left to `first_return`."""
    k, phi = starting(p, found.states[r, row], w)
    if k < 0:
        return True
    code, power = cleared(p, k, found.states[r + 1, row], found.tangents[r, row], w)
    mode = entered(p, k, not p.after, phi, w)
    if begins(p, mode, w) != GOES_ON:
        return True
    under_way(row, k, code, power, phi, i, o)
    for j in range(len(w.z)):
        o.z[i, j] = w.z[j]
    waits(o, mode, i)
    return False


@inner
def launched_in_columns(p, found, r, row, n, o, b, w):
    """Put n motions at their starts, from a row on, into the queue of their mode."""
    begun_columns(p, found, r, row, n, b)
    free = len(p.growth)
    for k in range(n):
        if b.h[KIND + k] > 0:
            found.outcome[r, row + k] = LEFT
            continue
        o.length[free] -= 1
        i, e = o.queue[free, o.length[free]], b.h[EVENT + k]
        code, power = lengthened(p.base, p.digit[e], 0, 1)
        under_way(row + k, e, code, power, b.t[PHI + k], i, o)
        for j in range(o.z.shape[1]):
            o.z[i, j] = b.z[j, k]
        waits(o, p.target[e], i)


@inner
def filled(p, found, r, row, o, b, w):
    """Put motions from a row on at their starts for as long as there is room; the row that follows them."""
    free, rows = len(p.growth), found.states.shape[1]
    plain = len(p.starts) == 1 and p.plain[p.function[p.starts[0]]]
    while o.length[free] > 0 and row < rows:
        if plain:
            n = min(min(BLOCK, o.length[free]), rows - row)
            launched_in_columns(p, found, r, row, n, o, b, w)
            row += n
            continue
        if launched(p, found, r, row, o.queue[free, o.length[free] - 1], o, w):
            found.outcome[r, row] = LEFT
        else:
            o.length[free] -= 1
        row += 1
    return row


@inner
def block(p, mode, found, r, o, b, w):
    """Take a block of motions that wait in a mode one step on; returns that end are written."""
    n = min(BLOCK, o.length[mode])
    gathered(p, mode, n, o, b)
    next_events(p, mode, n, b, w)
    moved(p, mode, n, b)
    turned(p, mode, n, b)
    jumped(p, mode, n, b)
    for k in range(n):
        i = b.h[MOTION + k]
        outcome, after = goes_on(p, mode, k, found, r, o, b, w)
        waits(o, after if outcome == GOES_ON else len(p.growth), i)
        row = o.numbers[i, ROW]
        if outcome == LEFT:
            found.outcome[r, row] = LEFT
        elif outcome != GOES_ON:
            turns = o.numbers[i, TURNS]
            ended = settled(outcome, o.numbers[i, CODE], o.scalars[i, TIME], turns, o.numbers[i, DOUBT] > 0)
            put(p, found, r, row, ended, w)


@inner
def side_by_side(p, found, r, o, b, w):
    """Return number r of all motions of a record."""
    free, row = len(p.growth), 0
    for i in range(BATCH):
        o.queue[free, i] = i
    o.length[free] = BATCH
    while True:
        row = filled(p, found, r, row, o, b, w)
        mode = 0
        for other in range(free):
            mode = other if o.length[other] > o.length[mode] else mode
        if o.length[mode] == 0:
            break
        block(p, mode, found, r, o, b, w)


@long_entry
def returns(p, found, at, w, o, b):
    """The first n returns of M states, written to a `Record` with the first states; in blocks if there is room for them.

    They are computed from `at` on, the number of a return and of a motion, in about `PAUSE` pieces of flights: whether all are.
    """
    wide, w.spent[0] = len(o.length) > 0, 0
    while at[0] < len(found.codes):
        r = at[0]
        if wide and at[1] == 0:
            side_by_side(p, found, r, o, b, w)
        for k in range(at[1], found.states.shape[1]):
            if not wide or found.outcome[r, k] == LEFT:
                alone(p, found, r, k, w)
            at[1] = k + 1
            if w.spent[0] > PAUSE:
                return False
        at[0], at[1] = r + 1, 0
    return True
