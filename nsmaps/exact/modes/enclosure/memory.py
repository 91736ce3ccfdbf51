"""What the compiled functions of enclosures work in."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.modes.enclosure.tables import RATES, BallTables

MOST_IMAGES = 16  #: words distinguished in one box
MOST_PARTS = 64  #: sets of one cell that wait to be followed
MOST_HITS = 48  #: events of one flight of a set
ALL_CELLS = 32  #: cells of a box and their halves


class BallMemory(NamedTuple):
    """Memory for the boxes of one thread; a set has n + 1 forms of n + 3 numbers, q in all."""

    parts: Any  #: shape (MOST_PARTS + 1, n + 1, q), sets that wait; the last place is that of the set in flight
    kind: Any  #: shape (MOST_PARTS + 1, 3): mode, the transition behind, and what is known of it (`STARTED`, `FALLING`, `LOOSE`)
    names: Any  #: shape (MOST_PARTS + 1, 2), code of the word so far, place of the next letter
    hits: Any  #: shape (MOST_HITS + 1, n + 1, q), sets at events; the last place is for a copy
    met: Any  #: shape (MOST_HITS, 2): function, what is known of the event
    start: Any  #: shape (N, q), features at the start of a flight
    z: Any  #: shape (N, q), features now
    rates: Any  #: shape (N, q), their derivatives
    bends: Any  #: shape (N, q), their second derivatives
    rows: Any  #: shape (RATES, q), a function and its derivatives
    late: Any  #: shape (q,), the time of an event after that of its set's features
    e: Any  #: shape (N, N), a matrix, and bounds on its errors
    off: Any
    f: Any  #: another
    f_off: Any
    low: Any  #: shape (S, RATES), bounds on functions and derivatives
    high: Any
    jerk: Any  #: shape (S,)
    snap: Any
    clear: Any  #: shape (S,), times for which functions certainly stay positive
    proper: Any  #: shape (S,), whether every state's function was positive at the start, or began to rise
    lower: Any  #: shape (N,), a box of features
    upper: Any
    by: Any  #: shape (m,), how much an event depends on each coordinate
    codes: Any  #: shape (MOST_IMAGES,)
    images: Any  #: shape (MOST_IMAGES, m, 2)
    excess: Any  #: shape (1,), the largest width of an image over its linear part
    cells: Any  #: shape (ALL_CELLS, m, 2)


def ball_memory(p: BallTables) -> BallMemory:
    """Memory for a table."""
    functions, width, n, m = len(p.functions), p.resets.shape[2], p.resets.shape[1], len(p.places)
    q = n + 3
    matrices = {name: np.zeros((width, width)) for name in ("e", "off", "f", "f_off")}
    features = {name: np.zeros((width, q)) for name in ("start", "z", "rates", "bends")}
    values = {name: np.zeros(functions) for name in ("jerk", "snap", "clear")}
    return BallMemory(
        **matrices,
        **features,
        **values,
        parts=np.zeros((MOST_PARTS + 1, n + 1, q)),
        kind=np.zeros((MOST_PARTS + 1, 3), np.int64),
        names=np.zeros((MOST_PARTS + 1, 2), np.int64),
        hits=np.zeros((MOST_HITS + 1, n + 1, q)),
        met=np.zeros((MOST_HITS, 2), np.int64),
        rows=np.zeros((RATES, q)),
        late=np.zeros(q),
        low=np.zeros((functions, RATES)),
        high=np.zeros((functions, RATES)),
        proper=np.zeros(functions, bool),
        lower=np.zeros(width),
        upper=np.zeros(width),
        by=np.zeros(m),
        codes=np.zeros(MOST_IMAGES, np.int64),
        images=np.zeros((MOST_IMAGES, m, 2)),
        excess=np.zeros(1),
        cells=np.zeros((ALL_CELLS, m, 2)),
    )
