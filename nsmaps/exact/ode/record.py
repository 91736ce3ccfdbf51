"""Returns as they begin and end in a lane: states taken from a batch, words letter by letter, results written."""

import math

from nsmaps.exact.engine.flight.flow import walls_of
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.returns import CHATTER, INVALID, RESTS, is_state, onward, spell
from nsmaps.exact.ode.impact import place_at, take_off
from nsmaps.exact.ode.layout import (
    BEFORE,
    CLEARANCE,
    CODE,
    ELAPSED,
    IMPACTS,
    LETTER,
    MADE,
    PHI,
    POWER,
    ROW,
    RUN,
    SLOWEST,
    SPEED,
    STEP_PHI,
    STEPS,
    SURE,
    TURNED,
    TURNS,
    UNSURE,
    UP,
    WAYS,
)
from nsmaps.exact.ode.turns import letters

IDLE = -1  #: the row of a lane without a return


@inner
def begin_return(w, k):
    """Begin return number MADE of lane k, from the phase and speed where it is."""
    lane, count = w.lanes[k], w.counts[k]
    _, _, base_up = walls_of(w.p)
    count[UP], count[LETTER], count[RUN], count[CODE], count[POWER] = 1 if base_up else 0, 1, 1, 0, 1
    count[TURNS], count[IMPACTS], count[STEPS], count[UNSURE], count[TURNED] = 0, 0, 0, SURE, 0
    lane[ELAPSED], lane[CLEARANCE], lane[SLOWEST] = 0.0, math.inf, math.inf
    if w.turning:
        count[CODE], count[POWER] = spell(0, 1, letters(w.p)[1], 1, 1)
    for j in range(WAYS):
        lane[BEFORE + j], lane[BEFORE + WAYS + j] = 1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0
    lane[PHI], count[TURNS] = onward(w.p, lane[PHI], 0.0)
    take_off(w, k)


@inner
def begin_orbit(w, k):
    """Let lane k follow the next state, or none if all have been taken; a start that is not a state has no returns."""
    count = w.counts[k]
    while w.next[0] < len(w.start):
        row = w.next[0]
        w.next[0] += 1
        count[ROW], count[MADE] = row, 0
        w.lanes[k, SPEED], w.lanes[k, PHI] = w.start[row, 0], w.start[row, 1]
        if is_state(w.start[row, 0], w.start[row, 1]):
            begin_return(w, k)
            return
        write(w, k, INVALID, False)
        fill(w, k, INVALID)
    count[ROW] = IDLE
    w.state[0, k], w.state[1, k] = 0.0, 0.0
    w.lanes[k, STEP_PHI] = 0.0
    place_at(w, k)


@inner
def write(w, k, outcome, image):
    """Write the return of lane k that has ended, with an image or without."""
    lane, count = w.lanes[k], w.counts[k]
    i, row = count[MADE], count[ROW]
    w.outcome[i, row], w.codes[i, row] = outcome, 0 if outcome == INVALID else count[CODE]
    w.states[i, row, 0], w.states[i, row, 1] = (lane[SPEED], lane[PHI]) if image else (math.nan, math.nan)
    w.turns[i, row, 0], w.turns[i, row, 1] = 0, count[TURNS] if image else 0
    w.doubts[i, row] = count[UNSURE] if outcome != INVALID else SURE
    w.time[i, row] = lane[ELAPSED] if image or outcome == RESTS else math.nan
    if len(w.tangents):
        for j in range(WAYS):
            w.tangents[i, row, 0, j] = lane[BEFORE + j] if image else math.nan
            w.tangents[i, row, 1, j] = lane[BEFORE + WAYS + j] if image else math.nan
    if len(w.margins):
        known = outcome != INVALID
        w.margins[row, 0] = lane[CLEARANCE] if known else math.nan
        w.margins[row, 1] = lane[SLOWEST] if known else math.nan
        w.margins[row, 2] = count[TURNED] if known else 0


@inner
def fill(w, k, outcome):
    """Write the returns of lane k after the last: none, with the outcome repeated."""
    begun = w.counts[k, MADE] + 1
    for _ in range(begun, len(w.codes)):
        w.counts[k, MADE] += 1
        write(w, k, INVALID, False)
        w.outcome[w.counts[k, MADE], w.counts[k, ROW]] = outcome


@inner
def finish(w, k, outcome, image):
    """End the return of lane k, and begin the next one of its orbit, or the next orbit."""
    write(w, k, outcome, image)
    if image and w.counts[k, MADE] + 1 < len(w.codes):
        w.counts[k, MADE] += 1
        begin_return(w, k)
        return
    fill(w, k, outcome)
    begin_orbit(w, k)


@inlined
def letter_at(w, k, now_up):
    """Add the impact that lane k has made to its word: written when a row of impacts on one wall ends, once if it is chatter."""
    count = w.counts[k]
    walls, base = letters(w.p)
    digit = 1 if (now_up == 1) == walls_of(w.p)[2] else 2
    if w.turning:
        count[CODE], count[POWER] = spell(count[CODE], count[POWER], base, digit, 1)
        return
    if digit != count[LETTER] or count[RUN] == 0:
        count[CODE], count[POWER] = spell(count[CODE], count[POWER], walls + 3, count[LETTER], count[RUN])
        count[LETTER], count[RUN] = digit, 0
    count[RUN] += 1


@inlined
def mark_at(w, k, ended):
    """Add a rest or chatter to the word of lane k."""
    count = w.counts[k]
    walls, base = letters(w.p)
    if not w.turning:
        base = walls + 3
        count[CODE], count[POWER] = spell(count[CODE], count[POWER], base, count[LETTER], 1)
    count[CODE], count[POWER] = spell(count[CODE], count[POWER], base, walls + (1 if ended == CHATTER else 2), 1)
    count[RUN] = 0


@inner
def record(w, k, mark):
    """Write the impact or release of lane k into the impacts of a trajectory; returns whether there is room for more."""
    n = w.counts[k, IMPACTS]
    if n < len(w.hits):
        on_base = (w.counts[k, UP] == 1) == walls_of(w.p)[2]
        lane = w.lanes[k]
        w.hits[n, 0], w.hits[n, 1], w.hits[n, 2] = 1.0 if on_base else 0.0, lane[ELAPSED], lane[PHI]
        w.hits[n, 3], w.hits[n, 4] = lane[SPEED], mark
    return n + 1 < len(w.hits)
