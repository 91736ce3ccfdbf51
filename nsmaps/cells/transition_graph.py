"""The graph of a map on cells: an arc to every cell that may hold an image; its recurrent components and what they reach."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Bools, Ints
from nsmaps.cells.grid import Cells, Targets
from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

MOST_ARCS = 40_000_000  #: of one graph, about a gigabyte


def graph_of(cells: Cells, numbers: Ints, targets: Iterable[Targets]) -> "csr_matrix":
    """The arcs among M cells, a matrix of M + 1 rows: the last node stands between cells of unknown images and all cells.

    Args:
        numbers: of the cells, ascending, shape (M,).
        targets: of them, in batches.

    Raises:
        NsmapsError: more arcs than `MOST_ARCS`; says what to do.
    """
    from scipy.sparse import csr_matrix

    size, count, arcs, unknown = len(numbers), 0, 0, False
    rows = [np.empty(0, np.int64)]
    columns = [np.empty(0, np.int64)]
    for found in targets:
        source, target = np.divmod(_once(_arcs(cells, numbers, found, MOST_ARCS - arcs)), size)
        arcs += len(source)
        rows += [source + count, count + np.flatnonzero(found.anywhere)]
        columns += [target, np.full(found.anywhere.sum(), size)]
        count, unknown = count + len(found.anywhere), unknown or bool(found.anywhere.any())
    if unknown:
        rows.append(np.full(size, size))
        columns.append(np.arange(size))
    ends = np.concatenate(rows), np.concatenate(columns)
    return csr_matrix((np.ones(len(ends[0]), bool), ends), shape=(size + 1, size + 1))


def _arcs(cells: Cells, numbers: Ints, found: Targets, max_arcs: int) -> Ints:
    """Every source times M plus the position of a target, some twice; cells in one row of the grid are numbered in a run."""
    lead, width = cells.shape[:-1], cells.shape[-1]
    spans = found.high[:, :-1] - found.low[:, :-1] + 1
    counts = spans.prod(axis=1)
    if counts.sum() > max_arcs:
        raise _too_many(cells, len(numbers))
    row = np.repeat(np.arange(len(counts)), counts)
    left = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    base = np.zeros(len(row), np.int64)
    for k, stride in zip(reversed(range(len(lead))), np.cumprod([1, *lead[:0:-1]]), strict=False):
        left, place = np.divmod(left, spans[row, k])
        base += (found.low[row, k] + place) * stride
    first = np.searchsorted(numbers, base * width + found.low[row, -1], side="left")
    last = np.searchsorted(numbers, base * width + found.high[row, -1], side="right")
    lengths = last - first
    total = int(lengths.sum())
    if total > max_arcs:
        raise _too_many(cells, len(numbers))
    target = np.arange(total) + np.repeat(first - (np.cumsum(lengths) - lengths), lengths)
    return np.repeat(found.source[row], lengths) * len(numbers) + target


def _once(numbers: Ints) -> Ints:
    """Numbers in ascending order, each once: ten times as fast as `np.unique`, which builds a table of them."""
    numbers.sort()
    return numbers[np.flatnonzero(np.diff(numbers, prepend=-1))]


def _too_many(cells: Cells, kept: int) -> NsmapsError:
    shape = " x ".join(map(str, cells.shape))
    return NsmapsError(
        f"{kept} of {shape} cells have more than {MOST_ARCS} arcs among them, too many to hold; "
        "expected: less depth, fewer cells at the start, or a smaller window"
    )


def recurrent(graph: "csr_matrix") -> Ints:
    """The component of each of M nodes that a closed walk passes, -1 of the others, shape (M,); the largest is number 0.

    Two nodes are of one component if walks lead from each to the other. The last node is left out.
    """
    from scipy.sparse.csgraph import connected_components

    label = connected_components(graph, directed=True, connection="strong")[1]
    sizes = np.bincount(label)
    loops = np.bincount(label, weights=graph.diagonal(), minlength=len(sizes)) > 0
    label, again = label[:-1], (sizes > 1) | loops
    names, first, inverse, counts = np.unique(label, return_index=True, return_inverse=True, return_counts=True)
    order = np.lexsort((first, -counts, ~again[names]))
    rank = np.empty(len(names), np.int64)
    rank[order] = np.arange(len(names))
    rank[~again[names]] = -1
    return rank[inverse]


def reached(graph: "csr_matrix", starts: Bools) -> Bools:
    """Which of M nodes some walk from the starts, shape (M,), comes to; the starts themselves included."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order

    size = graph.shape[0]
    ends = np.append(graph.indptr, graph.indptr[-1] + starts.sum())
    columns = np.concatenate([graph.indices, np.flatnonzero(starts)])
    more: Any = csr_matrix((np.ones(len(columns), bool), columns, ends), shape=(size + 1, size + 1))
    found = breadth_first_order(more, size, directed=True, return_predecessors=False)
    mask = np.zeros(size + 1, bool)
    mask[found] = True
    return mask[: size - 1]


def invariant(graph: "csr_matrix", component: Ints) -> Bools:
    """Which of M nodes walks without end pass, forwards and backwards: those on a walk between recurrent ones; shape (M,)."""
    again = component >= 0
    return reached(graph, again) & reached(graph.T.tocsr(), again)


def order_of(graph: "csr_matrix", component: Ints) -> Ints:
    """Pairs (i, j) of different components, shape (E, 2): a walk leads from i to j."""
    pairs = []
    for i in range(component.max(initial=-1) + 1):
        there = np.unique(component[reached(graph, component == i)])
        pairs += [(i, j) for j in there.tolist() if j not in (-1, i)]
    return np.array(pairs, np.int64).reshape(-1, 2)
