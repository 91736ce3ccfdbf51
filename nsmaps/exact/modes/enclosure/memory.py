"""What the compiled functions of enclosures work in."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.compiling.addresses import by_address
from nsmaps.exact.enclosure.subdivide import MOST_HITS, MOST_PARTS, BoxMemory, box_memory
from nsmaps.exact.modes.enclosure.tables import RATES, BallTables

MODE, BEHIND, KNOWN = range(3)  #: of a set that waits: its mode, the transition behind it, what is known of it (`events.STARTED`)
EVENT_FUNCTION, EVENT_KNOWN = range(2)  #: of an event: the function, what is known of it


@by_address
class BallMemory(NamedTuple):
    """Memory for the boxes of one thread; a set has n + 1 forms of n + 3 numbers, q in all."""

    box: BoxMemory
    parts: Any  #: shape (MOST_PARTS + 1, n + 1, q), sets that wait; the last place is that of the set in flight
    kind: Any  #: shape (MOST_PARTS + 1, 3), of each of them: see `MODE`
    hits: Any  #: shape (MOST_HITS + 1, n + 1, q), sets at events; the last place is for a copy
    events: Any  #: shape (MOST_HITS, 2), of each event: see `EVENT_FUNCTION`
    start: Any  #: shape (N, q), features at the start of a flight
    z: Any  #: shape (N, q), features now
    rates: Any  #: shape (N, q), their derivatives
    bends: Any  #: shape (N, q), their second derivatives
    rows: Any  #: shape (RATES, q), a function and its derivatives
    delay: Any  #: shape (q,), the time of an event after that of its set's features, or another form
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
    excess: Any  #: shape (m,), the largest width of an image of a cell over its linear part


def ball_memory(p: BallTables) -> BallMemory:
    """Memory for a table."""
    functions, (_, n, width) = len(p.functions), p.table.resets.shape
    phase = int(np.argmin(p.table.places)) if (p.table.places < 0).any() else -1
    q = n + 3
    matrices = {name: np.zeros((width, width)) for name in ("e", "off", "f", "f_off")}
    features = {name: np.zeros((width, q)) for name in ("start", "z", "rates", "bends")}
    values = {name: np.zeros(functions) for name in ("jerk", "snap", "clear")}
    return BallMemory(
        **matrices,
        **features,
        **values,
        box=box_memory(len(p.table.places), phase),
        parts=np.zeros((MOST_PARTS + 1, n + 1, q)),
        kind=np.zeros((MOST_PARTS + 1, 3), np.int64),
        hits=np.zeros((MOST_HITS + 1, n + 1, q)),
        events=np.zeros((MOST_HITS, 2), np.int64),
        rows=np.zeros((RATES, q)),
        delay=np.zeros(q),
        low=np.zeros((functions, RATES)),
        high=np.zeros((functions, RATES)),
        proper=np.zeros(functions, bool),
        lower=np.zeros(width),
        upper=np.zeros(width),
        excess=np.zeros(len(p.table.places)),
    )
