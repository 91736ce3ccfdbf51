"""Closed walks of a given length in the graph of a map on cells: which nodes are reached in so many arcs, as rows of bits."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Bits = NDArray[np.uint8]  #: shape (M, ceil(M/8)), of each node which nodes are reached
GATHERED = 2**26  #: bytes of rows that are joined at once


def on_closed_walks(graph: "csr_matrix", period: int, tries: int = 1) -> tuple[Bools, tuple[Ints, ...]]:
    """Which of M nodes lie on a closed walk of 1, 2, ..., `period` arcs, shape (M, period), and some such walks of each.

    The last node of the graph, which leads everywhere, is passed in no time. Walks are arrays of nodes, shape (W, p) for
    each p as many times as there are `tries`, one of each node that lies on one that does not pass it.
    """
    rng = np.random.default_rng(0)
    plain = graph[:-1, :-1].tocsr()
    closed = _past_anywhere(plain, graph[:-1, -1].toarray().ravel(), period)
    nodes, reach, walks = np.arange(plain.shape[0]), list[Bits](), list[Ints]()
    for p in range(1, period + 1):
        reach.append(_stepped(plain, reach[-1] if reach else None))
        closes = _holds(reach[-1], nodes, nodes)
        closed[closes, p - 1] = True
        walks += [_walks(plain, reach, nodes[closes], p, rng) for _ in range(tries)]
    return closed, tuple(walks)


def _past_anywhere(plain: "csr_matrix", anywhere: Bools, period: int) -> Bools:
    """Which nodes come within fewer arcs than p to one that leads everywhere, and so back to themselves."""
    closed, comes = np.zeros((plain.shape[0], period), bool), anywhere.astype(bool)
    for p in range(period):
        closed[:, p] = comes
        comes = comes | (plain @ comes > 0)
    return closed


def _stepped(plain: "csr_matrix", reach: Bits | None) -> Bits:
    """What each node reaches in one arc more than the nodes reach by themselves; in one arc, where that is nothing yet."""
    size, width = plain.shape[0], -(-plain.shape[0] // 8)
    steps, starts = np.zeros((size, width), np.uint8), plain.indptr.astype(np.int64)
    if reach is None:
        row = np.repeat(np.arange(size), np.diff(starts))
        np.bitwise_or.at(steps, (row, plain.indices // 8), (128 >> plain.indices % 8).astype(np.uint8))
        return steps
    first = 0
    while first < size:
        last = int(np.searchsorted(starts, starts[first] + max(GATHERED // max(width, 1), 1), side="right")) - 1
        last = min(max(last, first + 1), size)
        some = first + np.flatnonzero(np.diff(starts[first : last + 1]))
        if len(some):
            rows = reach[plain.indices[starts[first] : starts[last]]]
            steps[some] = np.bitwise_or.reduceat(rows, starts[some] - starts[first], axis=0)
        first = last
    return steps


def _holds(reach: Bits, nodes: Ints, others: Ints) -> Bools:
    """Whether each node reaches the other beside it."""
    return (reach[nodes, others // 8] & (128 >> others % 8)) > 0


def _walks(plain: "csr_matrix", reach: list[Bits], nodes: Ints, length: int, rng: np.random.Generator) -> Ints:
    """A closed walk of some arcs from each node, shape (W, length): every next node is any one of those that may be."""
    walk = np.empty((len(nodes), length), np.int64)
    walk[:, 0] = nodes
    for k in range(1, length):
        at = walk[:, k - 1]
        counts = plain.indptr[at + 1] - plain.indptr[at]
        ends = np.cumsum(counts)
        row = np.repeat(np.arange(len(at)), counts)
        place = np.arange(len(row)) - np.repeat(ends - counts, counts) + plain.indptr[at][row]
        may = _holds(reach[length - k - 1], plain.indices[place].astype(np.int64), nodes[row])
        row, place = row[may], place[may]
        found = np.searchsorted(row, np.arange(len(at) + 1))
        walk[:, k] = plain.indices[place[rng.integers(found[:-1], found[1:])]]
    return walk
