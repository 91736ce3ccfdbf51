"""Many first returns of a system with modes in parallel: motions wait in a queue for each mode, and advance in blocks.

A block is taken through one longest step, or to its events; a motion that ends makes room for the next, so that blocks are full.
All decisions at an event are those of `take_event`; returns of many events, of two at once, and of an event that takes place
at once after another are left to `first_return`.
"""

import math

from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.engine.returns import RETURNED, UNDECIDED
from nsmaps.exact.modes.blocks.events_block import NONE, NOT_PLAIN, begin_block, pass_events
from nsmaps.exact.modes.blocks.flights_block import UNSURE, load_column, move, next_events, store_column
from nsmaps.exact.modes.blocks.workspace import (
    AT,
    BATCH,
    BLOCK,
    CODE,
    DOUBT,
    FLIGHT,
    IN,
    PHASE,
    POWER,
    ROW,
    STARTED,
    STEPS,
    TIME,
    TURNS,
)
from nsmaps.exact.modes.march.beginning import GOES_ON, brief
from nsmaps.exact.modes.march.events import Motion, Passage, take_event
from nsmaps.exact.modes.march.returns import PAUSE, begin_return, end_of_return, first_return, write_image, write_return
from nsmaps.exact.modes.march.starting import find_start
from nsmaps.exact.modes.march.words import append_letter
from nsmaps.exact.modes.tables.memory import FLIGHT_TIME, NO_FUNCTION, PIECES

FEW = 16  # fewer returns than this are not computed in blocks
MOST = 64  # events, or longest steps, of a return in a block; more are rare
LEFT = -2  # in place of an outcome: for `first_return`
LARGEST_EXPONENT = 700.0  # beyond, exp is infinite
RETURN, MOTION = 0, 1  # places in the progress of `returns`


@inner
def gather(p, mode, n, b):
    """Write the last motions that wait in a mode to the columns of the block."""
    b.length[mode] -= n
    for k in range(n):
        i = b.queue[mode, b.length[mode] + k]
        b.h[IN.motion + k], b.t[AT.phase + k], b.h[IN.start + k] = i, b.scalars[i, PHASE], b.numbers[i, STARTED]
        exponent = min(p.abscissa[mode] * b.scalars[i, FLIGHT], LARGEST_EXPONENT)
        b.t[AT.growth + k] = math.expm1(exponent) if p.abscissa[mode] > 0.0 else 0.0
        for d in range(len(b.features)):
            for j in range(b.states.shape[2] if d == 0 else p.first.shape[1] - 1):
                b.features[d, j, k] = b.states[i, d, j]
        for d in range(len(b.dz)):
            b.dphi[d, k] = b.phase_tangents[i, d]


@inner
def scatter(p, k, i, b):
    """Write a column of the block to a motion."""
    for d in range(len(b.features)):
        for j in range(b.states.shape[2] if d == 0 else p.first.shape[1] - 1):
            b.states[i, d, j] = b.features[d, j, k]
    for d in range(len(b.dz)):
        b.phase_tangents[i, d] = b.dphi[d, k]


@inner
def enqueue(mode, i, b):
    """Put a motion into the queue of a mode, or its place among those that are free."""
    b.queue[mode, b.length[mode]] = i
    b.length[mode] += 1


@inner
def pass_plain_event(p, e, k, b):
    """Record that a column has passed a plain event: the outcome, or GOES_ON, and the mode that follows."""
    i = b.h[IN.motion + k]
    numbers = b.numbers[i]
    numbers[DOUBT] |= 1 if e == NONE or b.t[AT.doubtful + k] > 0.0 else 0
    if e == NONE:
        return UNDECIDED, e
    numbers[CODE], numbers[POWER] = append_letter(p.base, p.digit[e], numbers[CODE], numbers[POWER])
    numbers[STARTED], b.scalars[i, FLIGHT] = e, 0.0
    return RETURNED if p.is_section[e] else GOES_ON, p.target[e]


@inner
def pass_event(p, mode, k, found, r, b, w):
    """Take a column through an event that is not plain: the outcome, or GOES_ON, and the mode that follows."""
    i = b.h[IN.motion + k]
    numbers, row = b.numbers[i], b.numbers[i, ROW]
    w.reals[FLIGHT_TIME] = b.scalars[i, FLIGHT]
    load_column(k, b, w)
    passage = take_event(p, Motion(mode, b.t[AT.phase + k], numbers[CODE], numbers[POWER], 0.0, 0, 0), b.h[IN.function + k], w)
    motion = passage.motion
    numbers[CODE], numbers[POWER], numbers[STARTED] = motion.code, motion.power, passage.transition
    numbers[DOUBT] |= motion.doubts
    if passage.outcome == RETURNED:
        write_image(found, r, row, w)
    b.scalars[i, FLIGHT] = 0.0
    store_column(k, b, w)
    return passage.outcome, motion.mode


@inner
def advance(p, mode, k, found, r, b, w):
    """Advance a column's motion, through its event if it has one: its outcome, or GOES_ON, and the mode that follows."""
    i, which = b.h[IN.motion + k], b.h[IN.function + k]
    numbers, scalars = b.numbers[i], b.scalars[i]
    step = b.t[AT.time + k] * p.steps[mode]
    scalars[PHASE], scalars[TIME], scalars[FLIGHT] = b.t[AT.phase + k], scalars[TIME] + step, scalars[FLIGHT] + step
    numbers[TURNS] += b.h[IN.windings + k]
    numbers[DOUBT] |= b.h[IN.doubtful + k]
    numbers[STEPS] += 1
    if (
        b.h[IN.doubtful + k] == UNSURE
        or numbers[STEPS] > MOST
        or not b.t[AT.size + k] < math.inf
        or (which != NO_FUNCTION and b.t[AT.time + k] == 0.0)
        or (which == NO_FUNCTION and scalars[FLIGHT] >= p.horizon)
    ):
        return LEFT, mode
    numbers[STARTED], outcome = -1, GOES_ON
    if which != NO_FUNCTION:
        e = b.h[IN.transition + k]
        if e == NOT_PLAIN:
            outcome, mode = pass_event(p, mode, k, found, r, b, w)
        else:
            outcome, mode = pass_plain_event(p, e, k, b)
    if outcome == RETURNED and brief(p, mode, scalars[TIME], w):
        return LEFT, mode
    if outcome == GOES_ON:
        scatter(p, k, i, b)
    return outcome, mode


@inner
def begin_record(row, k, code, power, phi, i, b):
    """Write the numbers of a motion i that starts from a row by a transition k."""
    numbers, scalars = b.numbers[i], b.scalars[i]
    numbers[CODE], numbers[POWER], numbers[STARTED], numbers[ROW] = code, power, k, row
    numbers[TURNS], numbers[DOUBT], numbers[STEPS] = 0, 0, 0
    scalars[PHASE], scalars[TIME], scalars[FLIGHT] = phi, 0.0, 0.0


@inner
def begin_alone(p, found, r, row, i, b, w):
    """Put a motion i at its start into the queue of its mode; whether it is to be left to `first_return`."""
    k, phi = find_start(p, found.states[r, row], w)
    if k < 0:
        return True
    passage = begin_return(p, k, phi, w)
    motion = passage.motion
    if passage.outcome != GOES_ON:
        return True
    write_image(found, r, row, w)
    begin_record(row, k, motion.code, motion.power, phi, i, b)
    store_column(0, b, w)
    scatter(p, 0, i, b)
    enqueue(motion.mode, i, b)
    return False


@inner
def begin_in_block(p, e, found, r, row, n, b):
    """Put n motions at their starts, from a row on, by a transition, into the queue of their mode."""
    begin_block(p, e, found, r, row, n, b)
    free = len(p.steps)
    for k in range(n):
        if b.h[IN.kind + k] > 0:
            found.outcome[r, row + k] = LEFT
            continue
        b.length[free] -= 1
        i = b.queue[free, b.length[free]]
        code, power = append_letter(p.base, p.digit[e], 0, 1)
        begin_record(row + k, e, code, power, b.t[AT.phase + k], i, b)
        scatter(p, k, i, b)
        enqueue(p.target[e], i, b)


@inner
def refill(p, found, r, row, b, w):
    """Put motions from a row on at their starts for as long as there is room; the row that follows them."""
    free, rows, first = len(p.steps), found.states.shape[1], 0
    e = p.starts[first]
    plain = len(p.starts) == 1 and p.plain[p.function[e]]
    while b.length[free] > 0 and row < rows:
        if plain:
            n = min(min(BLOCK, b.length[free]), rows - row)
            begin_in_block(p, e, found, r, row, n, b)
            row += n
            continue
        last = b.length[free] - 1
        if begin_alone(p, found, r, row, b.queue[free, last], b, w):
            found.outcome[r, row] = LEFT
        else:
            b.length[free] -= 1
        row += 1
    return row


@inner
def advance_block(p, mode, found, r, b, w):
    """Take a block of motions that wait in a mode one step on; returns that end are written."""
    n = min(BLOCK, b.length[mode])
    gather(p, mode, n, b)
    next_events(p, mode, n, b, w)
    move(p, mode, n, b)
    pass_events(p, mode, found, r, n, b)
    for k in range(n):
        i = b.h[IN.motion + k]
        outcome, after = advance(p, mode, k, found, r, b, w)
        enqueue(after if outcome == GOES_ON else len(p.steps), i, b)
        row = b.numbers[i, ROW]
        if outcome == LEFT:
            found.outcome[r, row] = LEFT
        elif outcome != GOES_ON:
            turns = b.numbers[i, TURNS]
            motion = Motion(after, 0.0, b.numbers[i, CODE], 0, b.scalars[i, TIME], turns, b.numbers[i, DOUBT])
            write_return(p, found, r, row, end_of_return(Passage(outcome, motion, -1)))


@inner
def returns_in_blocks(p, found, r, b, w):
    """Return number r of all motions of a record."""
    free, row = len(p.steps), 0
    for i in range(BATCH):
        b.queue[free, i] = i
    b.length[free] = BATCH
    while True:
        row = refill(p, found, r, row, b, w)
        mode = 0
        for other in range(free):
            mode = other if b.length[other] > b.length[mode] else mode
        if b.length[mode] == 0:
            break
        advance_block(p, mode, found, r, b, w)


@long_entry
def returns(p, found, at, w, b):
    """The first n returns of states (M, m), written to a `Record` with the first states; in blocks if there is room for them.

    They are computed from `at` on, the number of a return and of a motion, in about `PAUSE` pieces of flights: whether all are.
    """
    in_blocks, w.integers[PIECES] = len(b.length) > 0, 0
    while at[RETURN] < len(found.codes):
        r = at[RETURN]
        if in_blocks and at[MOTION] == 0:
            returns_in_blocks(p, found, r, b, w)
        for k in range(at[MOTION], found.states.shape[1]):
            if not in_blocks or found.outcome[r, k] == LEFT:
                ended = first_return(p, found.states[r, k], w)
                write_image(found, r, k, w)
                write_return(p, found, r, k, ended)
            at[MOTION] = k + 1
            if w.integers[PIECES] > PAUSE:
                return False
        at[RETURN], at[MOTION] = r + 1, 0
    return True
