"""The arrays of slabs and leaves from which a map of strips is evaluated."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.polynomial.chebyshev import cheb2poly, chebpts1, chebval, chebvander

from nsmaps.arrays import Floats, Ints
from nsmaps.reduced.adaptive.kernel import ORDER, Tables, rasterize
from nsmaps.reduced.adaptive.slabs import Slab
from nsmaps.reduced.adaptive.tree import UNDIVIDED, Node, terms

NEAR = 1e-11  #: radians beside an edge within which rounding may decide its side, and the exact map answers
BUCKETS = 512  #: intervals of the speeds in which the slab is looked up
RASTER = 512  #: most cells per side of the raster that determines most leaves
FEW = 64  #: cells per side for each leaf, up to these

Trees = Sequence[Sequence[Sequence[Node]]]  #: of each slab, of each of its cells, one root, two or none


def build_tables(box: Floats, bands: Sequence[Slab], trees: Trees) -> Tables:
    """The tables of slabs and of the leaves grown in them, over a box of shape (2, 2)."""
    segment, curve = _curves(bands)
    root, across, nodes, leaves = _forest(trees)
    first = np.cumsum([0, *(len(band.curves) for band in bands)])
    coefficients = [_powers(leaf) for leaf in leaves]
    offset = np.cumsum([0, *(len(each) for each in coefficients)])[:-1]
    side = min(RASTER, FEW * max(len(leaves), 1))
    begin = np.linspace(box[0, 0], box[0, 1], BUCKETS + 1)[:-1]
    tables = Tables(
        box=box.ravel(),
        raster=np.full((side, side), -1, np.int32),
        leaf=np.array([_row(leaf, bands, segment, first, at) for leaf, at in zip(leaves, offset, strict=True)]).reshape(-1, 14),
        curve=curve,
        coefficient=np.concatenate([*coefficients, np.zeros(1)]),
        bucket=np.searchsorted([band.high for band in bands], begin * (1 - 1e-15)),
        slab=np.array([(band.low, band.high, band.chart) for band in bands], float).reshape(-1, 3),
        first=first,
        segment=segment,
        root=root,
        across=across,
        axis=nodes[:, 0].astype(np.int64),
        cut=nodes[:, 1].copy(),
        child=nodes[:, 2:].astype(np.int64),
        near=NEAR,
    )
    rasterize(tables)
    return tables


def _row(leaf: Node, bands: Sequence[Slab], segment: Ints, first: Ints, offset: int) -> list[float]:
    """A row of `Tables.leaf`."""
    band, at = bands[leaf.slab], first[leaf.slab] + leaf.cell
    s0, s1, x0, x1 = leaf.rectangle
    ends = [*segment[at], *segment[at + 1]]
    frame = [(s0 + s1) / 2, 2 / (s1 - s0), (x0 + x1) / 2, 2 / (x1 - x0)]
    return [band.low, band.high, band.chart, *ends, leaf.chart, *frame, leaf.degree, offset]


def _curves(bands: Sequence[Slab]) -> tuple[Ints, Floats]:
    """The first segment and the number of segments of every curve, (C, 2), and the segments."""
    segments_so_far = [_segments(curve) for band in bands for curve in band.curves]
    counts = np.array([len(rows) for rows in segments_so_far], np.int64)
    return np.column_stack([np.cumsum(counts) - counts, counts]), np.concatenate([*segments_so_far, np.zeros((1, ORDER))])


def _segments(curve: Floats) -> Floats:
    """A Chebyshev series of s in [-1, 1] as equal segments in powers of t in [-1, 1], exact to rounding, shape (n, ORDER)."""
    t, check = chebpts1(ORDER), np.linspace(-1, 1, 21)
    solve = np.linalg.inv(chebvander(t, ORDER - 1))
    for count in 2 ** np.arange(11):
        centre = ((2 * np.arange(count) + 1) / count - 1)[:, None]
        series = chebval(centre + t / count, curve) @ solve.T
        wrong = np.abs(series @ chebvander(check, ORDER - 1).T - chebval(centre + check / count, curve)).max()
        if wrong < 4e-15 * max(1.0, np.abs(curve).max()):
            break
    return np.asarray(series @ _to_powers(ORDER).T)


def _forest(trees: Trees) -> tuple[Ints, Ints, Floats, list[Node]]:
    """Roots and charts of the cells above all curves, (C, 2) each, the nodes of the trees, (N, 4), and their fitted leaves."""
    nodes: list[tuple[float, float, float, float]] = []
    leaves: list[Node] = []

    def planted(leaf: Node) -> int:
        number = len(nodes)
        nodes.append((UNDIVIDED, 0.0, -1, 0))
        if leaf.children is not None:
            along, low, high = leaf.children
            below, above = planted(low), planted(high)
            nodes[number] = (along, leaf.middle[along], below, above)
        elif leaf.degree >= 0:
            nodes[number] = (UNDIVIDED, 0.0, len(leaves), 0)
            leaves.append(leaf)
        return number

    cells = [cell for slab in trees for cell in (*slab, [])]  # there is no cell above the last curve of a slab
    root = [[planted(cell[k]) if k < len(cell) else -1 for k in (0, 1)] for cell in cells]
    across = [[cell[k].chart if k < len(cell) else 0 for k in (0, 1)] for cell in cells]
    roots, charts = (np.array(each, np.int64).reshape(-1, 2) for each in (root, across))
    return roots, charts, np.array(nodes, float).reshape(-1, 4), leaves


def _powers(leaf: Node) -> Floats:
    """A leaf's polynomials in powers of u and w, in the order in which they are evaluated."""
    n = leaf.degree
    table, powers = np.zeros((n + 1, n + 1, 2)), np.zeros((n + 4, n + 1, 2))
    table[tuple(np.array(terms(n)).T)] = leaf.coefficients
    change = _to_powers(n + 1)
    powers[: n + 1] = np.einsum("ai,bj,ijo->abo", change, change, table)
    parts = [powers[k : k + 4, n - k :: -1].transpose(1, 2, 0) for k in range(4 * (n // 4), -1, -4)]
    return np.concatenate([part.ravel() for part in parts])


@lru_cache(maxsize=64)
def _to_powers(n: int) -> Floats:
    """The matrix from n coefficients of a Chebyshev series to those of powers, shape (n, n)."""
    columns = [cheb2poly(row) for row in np.eye(n)]
    return np.stack([np.pad(column, (0, n - len(column))) for column in columns], axis=1)
