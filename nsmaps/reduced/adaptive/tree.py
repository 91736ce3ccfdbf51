"""The trees of a map of strips: each cell between two edges is divided until polynomials of low degree meet a tolerance."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.polynomial.legendre import leggauss

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.progress import Work, beat
from nsmaps.reduced.adaptive.scanlines import MANY_IMPACTS
from nsmaps.reduced.adaptive.slabs import HIGH, LOW, STRAIGHT, Slab

if TYPE_CHECKING:
    from nsmaps.exact.systems.flow import FlowSystem

ALONG_S, ALONG_X, UNDIVIDED = range(3)  #: direction in which a node is divided
HALF = np.sqrt(0.5)
SAFETY = 0.5  #: share of the tolerance for the points that decide whether a leaf is good
INSIDE, BESIDE = 200, 40  #: such points all over a leaf, and near its sides in each coordinate and near its corners
SMALLEST = 1e-7  #: share of the box below which a leaf is not divided again but left to the exact map


@dataclass(slots=True, eq=False)
class Node:
    """A rectangle in the charts of a cell: a leaf with the polynomials fitted there, or divided into two nodes."""

    slab: int
    cell: int
    chart: int  #: of x across the cell, from its lower edge; HIGH: from its upper edge
    rectangle: tuple[float, float, float, float]  #: s from, to; x from, to
    area: float  #: share of the box, approximately
    degree: int = -1  #: total degree; -1: left to the exact map
    coefficients: Floats | None = None  #: shape (terms, 2), of speed and advance of the phase, in Chebyshev products
    children: "tuple[int, Node, Node] | None" = None  #: divided: ALONG_S or ALONG_X, and the halves

    @property
    def middle(self) -> tuple[float, float]:
        """The values of s and of x at which it is divided."""
        s0, s1, x0, x1 = self.rectangle
        return (s0 + s1) / 2, (x0 + x1) / 2


@lru_cache(maxsize=16)
def terms(degree: int) -> tuple[tuple[int, int], ...]:
    """The powers (of u, of w) up to a total degree."""
    return tuple((i, j) for i in range(degree + 1) for j in range(degree + 1 - i))


def design(degree: int, u: Floats, w: Floats) -> Floats:
    """The Chebyshev products of a total degree at points (M,), shape (M, terms)."""
    i, j = np.array(terms(degree)).T
    return chebvander(u, degree)[:, i] * chebvander(w, degree)[:, j]


def roots_of(slabs: Sequence[Slab], span: Floats) -> list[list[list[Node]]]:
    """The undivided nodes of every cell of every slab: one, or two halves where both its edges are square roots.

    There are none where there is no image, or so many impacts that the cell is left to the exact map.
    """
    return [[_roots(k, slab, cell, span) for cell in range(len(slab.words))] for k, slab in enumerate(slabs)]


def _roots(k: int, slab: Slab, cell: int, span: Floats) -> list[Node]:
    low = cell > 0 and slab.hit[cell - 1] > 0  # the wall is met above its lower edge
    high = cell < len(slab.hit) and slab.hit[cell] < 0
    if slab.words[cell] == MANY_IMPACTS or slab.outcomes[cell] not in (Outcome.returned, Outcome.stuck):
        return []
    area = cell_area(slab, cell)
    charts = [LOW] * low + [HIGH] * high or [STRAIGHT]
    top = HALF if len(charts) == 2 else 1.0
    return [Node(k, cell, chart, (-1.0, 1.0, 0.0, top), area / len(charts) / float(np.prod(span))) for chart in charts]


def cell_area(slab: Slab, cell: int) -> float:
    """The area of a cell, in speed times radians, by Gauss's rule over s."""
    s, weight = leggauss(24)
    width = np.diff(slab.phases(s)[cell : cell + 2], axis=0)[0]
    rate = {STRAIGHT: np.full(len(s), 0.5), LOW: (1 + s) / 2, HIGH: (1 - s) / 2}[slab.chart]  # of v by s, over its range
    return float(weight @ (width * rate)) * (slab.high - slab.low)


def grow(
    system: "FlowSystem",
    slabs: Sequence[Slab],
    leaves: Sequence[Node],
    tolerance: float,
    degrees: Sequence[int],
    work: Work,
) -> tuple[int, bool]:
    """Fit leaves, dividing them until their polynomials are within `tolerance` (of speed and of phase in radians).

    Returns the number of exact returns, and True if all was done before the limit of work.
    """
    trial = _trial()
    waiting, done, returns = list(leaves), 0, 0
    nodes = _nodes(max(degrees))
    while waiting and not work.over:
        beat(done / (done + len(waiting)), f"{done} leaves done, {len(waiting)} to fit")
        left: list[Node] = []
        for some in (waiting[k : k + 512] for k in range(0, len(waiting), 512)):
            if work.over:
                left += some
                continue
            values, good = _sampled(system, slabs, some, np.concatenate([nodes, trial]))
            returns += values.shape[0] * values.shape[1]
            for leaf, y, fine in zip(some, values, good, strict=True):
                left += _refine(leaf, y, fine, tolerance, degrees)
        done += len(waiting) - len(left) // 2
        waiting = left
    return returns, not waiting


def _refine(leaf: Node, y: Floats, fine: bool, tolerance: float, degrees: Sequence[int]) -> list[Node]:
    """Fit one leaf with the lowest sufficient degree, or divide it: the halves, if any."""
    along = ALONG_X
    if fine:
        n = len(_nodes(max(degrees)))
        for degree in degrees:
            c = _solver(max(degrees), degree) @ y[:n]
            error = float(np.abs(_trial_design(degree) @ c - y[n:]).max())
            if error <= SAFETY * tolerance:
                leaf.degree, leaf.coefficients = degree, c
                return []
        i, j = np.array(terms(degrees[-1])).T
        last = i + j >= degrees[-1] - 2
        size = np.abs(c[last]).max(axis=1)
        along = ALONG_X if (size * j[last]).sum() > (size * i[last]).sum() else ALONG_S
    elif leaf.rectangle[1] - leaf.rectangle[0] > leaf.rectangle[3] - leaf.rectangle[2]:
        along = ALONG_S
    if leaf.area < SMALLEST:
        return []
    return divide(leaf, along)


def divide(leaf: Node, along: int) -> list[Node]:
    """The halves of a node along s or x, which it keeps as its children."""
    s0, s1, x0, x1 = leaf.rectangle
    s, x = leaf.middle
    parts = ((s0, s, x0, x1), (s, s1, x0, x1)) if along == ALONG_S else ((s0, s1, x0, x), (s0, s1, x, x1))
    shares = [(b**2 - a**2) / (x1**2 - x0**2) if leaf.chart != STRAIGHT and along == ALONG_X else 0.5 for _, _, a, b in parts]
    halves = [Node(leaf.slab, leaf.cell, leaf.chart, part, leaf.area * share) for part, share in zip(parts, shares, strict=True)]
    leaf.children = along, halves[0], halves[1]
    return halves


def places(slabs: Sequence[Slab], leaves: Sequence[Node], local: Floats) -> Floats:
    """The states at local coordinates (u, w) in [-1, 1], shape (P, 2), of leaves, shape (leaves, P, 2)."""
    states = np.empty((len(leaves), len(local), 2))
    for k in {leaf.slab for leaf in leaves}:
        mine = [n for n, leaf in enumerate(leaves) if leaf.slab == k]
        box = np.array([leaves[n].rectangle for n in mine])[:, :, None]
        s = (box[:, 0] + box[:, 1]) / 2 + (box[:, 1] - box[:, 0]) / 2 * local[:, 0]
        x = (box[:, 2] + box[:, 3]) / 2 + (box[:, 3] - box[:, 2]) / 2 * local[:, 1]
        curves = slabs[k].phases(s)
        cell = np.array([leaves[n].cell for n in mine])
        rows = np.arange(len(mine))
        low, high = curves[cell, rows], curves[cell + 1, rows]
        chart = np.array([leaves[n].chart for n in mine])[:, None]
        phi = np.where(chart == HIGH, high - (high - low) * x**2, low + (high - low) * np.where(chart == LOW, x**2, x))
        states[mine] = np.stack([slabs[k].speeds(s), phi], axis=-1)
    return states


def _sampled(system: "FlowSystem", slabs: Sequence[Slab], leaves: Sequence[Node], local: Floats) -> tuple[Floats, list[bool]]:
    """Speed and advance of the phase at points of leaves, (leaves, P, 2), and a mask of leaves with one word throughout."""
    states = places(slabs, leaves, local)
    returns = system.first_return(states.reshape(-1, 2))
    values = np.stack([returns.image[:, 0], returns.time * system.phase_rate()], axis=-1).reshape(states.shape)
    words = np.array([slabs[leaf.slab].words[leaf.cell] for leaf in leaves])
    good = (returns.codes.reshape(len(leaves), -1) == words[:, None]) & np.isfinite(values).all(axis=-1)
    return values, good.all(axis=1).tolist()


@lru_cache(maxsize=16)
def _nodes(degree: int) -> Floats:
    """Chebyshev points of a square for fits up to a degree, shape (P, 2)."""
    n = degree + 3
    x = np.cos(np.pi * (np.arange(n) + 0.5) / n)
    return np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)


@lru_cache(maxsize=64)
def _solver(highest: int, degree: int) -> Floats:
    """The matrix from values at the nodes to the coefficients of a degree."""
    return np.asarray(np.linalg.pinv(design(degree, *_nodes(highest).T)))


@lru_cache(maxsize=1)
def _trial() -> Floats:
    """Points of a square that decide whether a fit is good, (P, 2): everywhere, denser towards its sides and corners."""
    rng = np.random.default_rng(1)
    inside = rng.uniform(-1, 1, (INSIDE, 2))
    near = (1 - 2 * 10.0 ** -rng.uniform(0.5, 5, (3 * BESIDE, 2))) * rng.choice([-1, 1], (3 * BESIDE, 2))
    near[:BESIDE, 0], near[BESIDE : 2 * BESIDE, 1] = inside[:BESIDE, 0], inside[:BESIDE, 1]
    return np.concatenate([inside, near])


@lru_cache(maxsize=16)
def _trial_design(degree: int) -> Floats:
    return design(degree, *_trial().T)
