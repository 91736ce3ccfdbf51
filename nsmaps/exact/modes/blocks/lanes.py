"""What many returns in parallel work in: the motions under way, and the columns of the block that is looked at."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.modes.tables.taylor import TERMS

BATCH = 512  # motions under way: few enough to stay in the processor's cache
BLOCK = 128  # motions that are looked at together
PITCH = BLOCK + 8  # from row to row: not a power of two, which would map all rows to one part of the cache
# Numbers of columns stand at constant places, so that a compiler sees that they do not overlap; whole ones in another table.
GROWN, ERROR, SHIFT, LEAST, CHANGES, UPS, ON, X, U = range(0, 9 * PITCH, PITCH)
Y, LOW, HIGH, BEND, THERE, RATE, GUESS, WHEN, PHI, ZERO, UNSURE, A = range(9 * PITCH, 21 * PITCH, PITCH)
B = A + TERMS * PITCH
C = B + TERMS * PITCH
KIND, START, COLUMN, WHICH, DOUBTFUL, MORE, MOTION, EVENT, WHOLE = range(0, 9 * PITCH, PITCH)
PHASE, TIME, FLIGHT = range(3)
TURNS, CODE, POWER, DOUBT, STARTED, STEPS, ROW = range(7)


class Motions(NamedTuple):
    """Motions under way, a row each."""

    z: Any  #: shape (BATCH, N), features
    scalars: Any  #: shape (BATCH, 3), phase, time of the return, time since the last event
    numbers: (
        Any  #: shape (BATCH, 7), whole turns, word, place of its next letter, doubtful, last transition, steps, row of the record
    )
    queue: Any  #: shape (M + 1, BATCH), motions that wait in each mode, and last the places that are free
    length: Any  #: shape (M + 1,), how many


def motions(p: Any, some: bool) -> Motions:
    """Room for motions under way, or none."""
    queues, width = len(p.growth) + 1 if some else 0, p.growth.shape[1]
    queue, length = np.zeros((queues, BATCH), np.int64), np.zeros(queues, np.int64)
    return Motions(np.zeros((BATCH, width)), np.zeros((BATCH, 3)), np.zeros((BATCH, 7), np.int64), queue, length)


class Block(NamedTuple):
    """A block of motions in one mode, a column each."""

    t: Any  #: numbers, in rows of `PITCH`; coefficients of polynomials from A on, in the basis of Bernstein from B and C on
    h: Any  #: whole numbers
    z: Any  #: shape (N, PITCH), features
    c: Any  #: the same, of some of the motions
    other: Any  #: the same, of other states
    new: Any  #: shape (n, PITCH), states
    all: Any  #: shape (N,), the numbers of all features
    dense: Any  #: shape (TERMS,), N each: how many features a polynomial with all terms has of each degree


def block_of(p: Any) -> Block:
    """Room for a block."""
    n, width = p.first.shape[1] - 1, p.growth.shape[1]
    shapes = (C + TERMS * PITCH,), (width, PITCH), (width, PITCH), (width, PITCH), (n, PITCH)
    numbers, *others = map(np.zeros, shapes)
    whole, dense = np.arange(width), np.full(TERMS, width)
    return Block(numbers, np.zeros(WHOLE, np.int64), others[0], others[1], others[2], others[3], whole, dense)
