"""The memory of many returns in parallel: motions under way, and the columns of the block that is advanced."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.compiling.addresses import by_address
from nsmaps.exact.modes.tables.taylor import TERMS

BATCH = 512  # motions under way: few enough to stay in the processor's cache
BLOCK = 128  # motions that are advanced together
VECTOR = 16  # columns: loops over a multiple of it have no remainder
PITCH = BLOCK + 8  # from row to row: not a power of two, which would map all rows to one part of the cache


class Row(NamedTuple):
    """The places of rows in the array of a block; they are constants, so that a compiler sees that rows do not overlap."""

    phase: int
    time: int  #: of the event, as a share of a longest step, 1 without an event
    guess: int  #: the same, by Newton's method
    growth: int  #: of rounding errors since the last event
    error: int  #: of a function's value
    shift: int  #: what is added to a function's coefficients: its constant, or its value at the start with the other sign
    at_zero: int  #: 1: the first coefficient is zero
    zero_terms: int  #: how many of the first terms of a function are zero
    least: int  #: smallest size of a coefficient
    changes: int  #: how often the coefficients change sign
    positives: int  #: how many of them are positive
    x: int  #: where polynomials are evaluated
    value: int  #: of a polynomial or a row
    slope: int  #: its derivative, or the sum of the sizes of its terms
    low: int  #: bracket of a zero
    high: int
    bend: int  #: bound on the second derivative
    rate: int  #: of a function at its zero
    done: int  #: 1: Newton's method has converged, or a condition holds
    unsure: int  #: 1: a condition is zero but for rounding
    doubtful: int  #: 1: it is doubtful which transition takes place
    size: int  #: sum of the sizes of the features
    delay: int  #: change of an event's time along a direction


class Whole(NamedTuple):
    """The places of rows of whole numbers."""

    kind: int  #: zeros of a function: none, one or an unknown number; at a start 1 for one that is left to `first_return`
    start: int  #: the transition at which the flight began, -1 for none
    column: int  #: columns that are gathered
    function: int  #: that is zero first
    doubtful: int  #: 1: whether there is an event is doubtful; `AT_ONCE`
    windings: int  #: whole turns of the phase
    motion: int
    transition: int


AT = Row(*range(0, len(Row._fields) * PITCH, PITCH))
IN = Whole(*range(0, len(Whole._fields) * PITCH, PITCH))
SERIES = len(AT) * PITCH  # from here on the coefficients of polynomials
POINTS = SERIES + TERMS * PITCH  # the same over a longest step in the basis of Bernstein
PART_POINTS = POINTS + TERMS * PITCH  # and over its first part
PHASE, TIME, FLIGHT = range(3)  # in `Workspace.scalars`: phase, time of the return, time since the last event
# In `Workspace.numbers`: whole turns, word, place of its next letter, doubtful, last transition, steps, row of the record
TURNS, CODE, POWER, DOUBT, STARTED, STEPS, ROW = range(7)


@by_address
class Workspace(NamedTuple):
    """Memory of returns with D directions of derivatives in blocks: N features, n states, M modes."""

    states: Any  #: shape (BATCH, 1 + D, N), features of motions under way, and their derivatives, these of states alone
    phase_tangents: Any  #: shape (BATCH, D)
    scalars: Any  #: shape (BATCH, 3)
    numbers: Any  #: shape (BATCH, 7)
    queue: Any  #: shape (M + 1, BATCH), motions that wait in each mode, and last the places that are free
    length: Any  #: shape (M + 1,), how many
    t: Any  #: of the block: numbers, in rows of `PITCH`
    h: Any  #: whole numbers
    features: Any  #: shape (1 + D, N, PITCH), features, and their derivatives
    z: Any  #: shape (N, PITCH), the first of these
    dz: Any  #: shape (D, N, PITCH), the others
    dphi: Any  #: shape (D, PITCH), derivatives of the phase
    c: Any  #: shape (N, PITCH), features of the columns that are gathered
    change: Any  #: shape (1 + D, n, PITCH), how states and their derivatives change
    field: Any  #: shape (N, PITCH), rates of the features in steps of the mode
    moved: Any  #: how the table moves with parameters: see `nsmaps.exact.modes.tables.memory`
    all_features: Any  #: shape (N,), their numbers
    all_used: Any  #: shape (TERMS,), N each: how many features a polynomial with all terms has of each degree


def workspace(p: Any, directions: int, in_blocks: bool, moved: Any) -> Workspace:
    """Memory for returns of the system of a table, without room for motions where none are computed in blocks."""
    n, width, queues = p.first.shape[1] - 1, p.functions.shape[1], len(p.steps) + 1 if in_blocks else 0
    batch, pitch, d = (BATCH, PITCH, directions) if in_blocks else (0, 0, 0)
    features = np.zeros((1 + d, width, pitch))
    z, *_ = features
    return Workspace(
        states=np.zeros((batch, 1 + d, width)),
        phase_tangents=np.zeros((batch, d)),
        scalars=np.zeros((batch, 3)),
        numbers=np.zeros((batch, 7), np.int64),
        queue=np.zeros((queues, batch), np.int64),
        length=np.zeros(queues, np.int64),
        t=np.zeros(PART_POINTS + TERMS * PITCH if in_blocks else 0),
        h=np.zeros(len(IN) * pitch, np.int64),
        features=features,
        z=z,
        dz=features[1:],
        dphi=np.zeros((d, pitch)),
        c=np.zeros((width, pitch)),
        change=np.zeros((1 + d, n, pitch)),
        field=np.zeros((width, pitch)),
        moved=moved,
        all_features=np.arange(width),
        all_used=np.full(TERMS, width),
    )
