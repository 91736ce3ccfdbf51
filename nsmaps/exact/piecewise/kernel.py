"""The compiled returns of a map given by formulas, which are evaluated by a function at an address."""

import math

import numpy as np

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import entry, inlined
from nsmaps.exact.engine.law import reset_by
from nsmaps.exact.outcome import Outcome

RETURNED, UNCOVERED = int(Outcome.returned), int(Outcome.uncovered)
ESCAPED, INVALID = int(Outcome.escaped), int(Outcome.invalid)
MOST_TURNS = 2.0**31 - 1


@inlined
def placed(angle, state, x, away):
    """Write a state with its angles in [0, 2 pi), and by how much they were changed; whether it is finite."""
    finite = True
    for j in range(len(x)):
        x[j], away[j] = state[j], 0.0
        finite = finite and math.isfinite(x[j])
        if finite and angle[j] and not 0.0 <= x[j] < TWO_PI:
            turned = x[j] % TWO_PI
            turned = turned if turned < TWO_PI else 0.0
            x[j], away[j] = turned, x[j] - turned
    return finite


@inlined
def arrived(angle, out, away, image, turns):
    """Write the image that a formula has, angles in [0, 2 pi), and its turns; the outcome."""
    finite = True
    for j in range(len(image)):
        finite = finite and math.isfinite(out[1 + j])
    for j in range(len(image)):
        image[j], turns[j] = out[1 + j] if finite else math.nan, 0
        if finite and angle[j]:
            lifted = out[1 + j] + away[j]
            turned = out[1 + j] % TWO_PI
            image[j] = turned if turned < TWO_PI else 0.0
            turns[j] = min(max(np.rint((lifted - image[j]) / TWO_PI), -MOST_TURNS - 1.0), MOST_TURNS)
    return RETURNED if finite else ESCAPED


@entry
def orbits(address, p, angle, words, room, start, image, turns, codes, outcome, time, slopes):
    """Write the fields of `Returns` for the first n returns of M states (M, dim), each array of shape (n, M, ...).

    Args:
        address: of a function as of `PieceFormulas.source`, with derivatives by the states where `slopes` has rows.
        p: the parameters.
        words: the code of each piece.
        room: memory for a state, what wrapping changed, and what the function writes.
    """
    x, away, out = room
    for m in range(len(start)):
        state = start[m]
        for i in range(len(outcome)):
            if placed(angle, state, x, away):
                reset_by(address, 0.0, x.ctypes.data, p.ctypes.data, out.ctypes.data)
                piece = int(out[0])
            else:
                piece = -2
            if piece >= 0:
                outcome[i, m], codes[i, m], time[i, m] = arrived(angle, out, away, image[i, m], turns[i, m]), words[piece], 1.0
            else:
                before = outcome[i - 1, m] if i > 0 else INVALID
                outcome[i, m] = UNCOVERED if piece == -1 else before
            ended = outcome[i, m] != RETURNED
            for j in range(len(x)):
                if ended:
                    image[i, m, j], turns[i, m, j], codes[i, m], time[i, m] = math.nan, 0, 0, math.nan
                for k in range(len(x) if len(slopes) else 0):
                    slopes[i, m, j, k] = math.nan if piece < 0 else out[1 + len(x) + j * len(x) + k]
            state = image[i, m]


@entry
def rows_of(address, p, angle, room, start, rows):
    """Write what the function at an address gives at states (N, dim), shape (N, R); NaN where there is no piece."""
    x, away, out = room
    for m in range(len(start)):
        found = placed(angle, start[m], x, away)
        if found:
            reset_by(address, 0.0, x.ctypes.data, p.ctypes.data, out.ctypes.data)
        for r in range(rows.shape[1]):
            rows[m, r] = out[r] if found and out[0] >= 0.0 else math.nan
