"""The edges of a planar return map on lines of constant impact speed: states at which a flight grazes a wall.

On one side of an edge the flight just misses the wall, and the gap at its turning point falls to zero; on the other it just
meets it, and the map behaves like the square root of the distance. The birth of a pair of turning points is not an edge.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.continuation.bisection import bisect_changes
from nsmaps.exact.words import longer_than

if TYPE_CHECKING:
    from nsmaps.exact.returns import Itineraries
    from nsmaps.exact.systems.flow import FlowSystem

LONGEST = 12  #: impacts and turning points of a return: longer ones, as of long chatter, are not distinguished
MANY_IMPACTS = -1  #: in place of the code of a longer word
SCAN = 600  #: phases of a line in the first scan
ZOOM = 24  #: phases into which a place that may hide two edges is divided, three times
CHANGES = 20  #: changes that are sought between neighbouring phases
FIRST = 30  #: halvings of a scanned interval, which leave less than the smallest of these distances:
NEAR = 10.0 ** -np.arange(3, 11)  #: distance from an edge at which another is sought, in radians
GRAZE = 1e-8  #: share of the largest gap on the lines, below which a gap at an edge is a graze; for a speed its root
STENCIL = 1e-10  #: radians between the three places from which the gap is continued to zero


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """The edges on one line of constant speed, ordered by phase; K edges, K + 1 intervals."""

    v: float
    phi: Floats  #: shape (K,), radians
    hit: tuple[int, ...]  #: the side on which the wall is met: 1 above the edge, -1 below, 0 where that cannot be decided
    words: tuple[int, ...]  #: codes of the words in the intervals
    outcomes: tuple[int, ...]  #: values of `Outcome` in the intervals

    @property
    def kind(self) -> tuple[tuple[int, ...], ...]:
        """The data that two lines share if every edge can be followed between them."""
        return self.hit, self.words, self.outcomes


@dataclass(slots=True, eq=False)
class _Points:
    """States on lines, with the data of their returns."""

    line: Ints
    phi: Floats
    code: Ints
    outcome: NDArray[np.int8]
    gap: Floats
    slow: Floats

    def take(self, index: Any) -> "_Points":
        return _Points(*(getattr(self, name)[index] for name in self.__slots__))

    def also(self, more: "_Points") -> "_Points":
        return _Points(*(np.concatenate([getattr(self, name), getattr(more, name)]) for name in self.__slots__))

    def sorted(self) -> "_Points":
        return self.take(np.lexsort((self.phi, self.line)))

    @property
    def label(self) -> Ints:
        """Code and outcome, shape (N, 2)."""
        return np.column_stack([self.code, self.outcome])

    def differs(self, other: "_Points") -> NDArray[np.bool_]:
        return np.asarray((self.label != other.label).any(axis=1))


def lines(system: "FlowSystem", speeds: Sequence[float] | Floats, low: float, high: float) -> list[Line]:
    """The edges on lines of constant speed, over phases from low to high (radians), each exact to rounding.

    Two edges closer to each other than about 1e-7 of the range, or a sliver that no scanned phase approaches, are missed.
    """
    v = np.asarray(speeds, float)
    grid = np.linspace(low, high, SCAN)
    points = _look(system, v, np.repeat(np.arange(len(v)), SCAN), np.tile(grid, len(v)))
    for spacing in (high - low) / SCAN / ZOOM ** np.arange(3.0):
        hidden = _hidden(points, spacing)
        if not len(hidden.phi):
            break
        offsets = np.linspace(-1, 1, 2 * ZOOM + 1)[1:-1] * spacing
        phi = np.clip(hidden.phi[:, None] + offsets, low, high)
        points = points.also(_look(system, v, np.repeat(hidden.line, len(offsets)), phi.ravel())).sorted()
    below, above = _bisected(system, v, points, FIRST)
    beside = np.concatenate([-NEAR, NEAR])
    phi = below.phi[:, None] + beside
    line = np.repeat(below.line, len(beside))
    inside = (phi.ravel() > low) & (phi.ravel() < high)
    points = points.also(_look(system, v, line[inside], phi.ravel()[inside])).sorted()
    below, above = _bisected(system, v, points)
    return _lines(system, v, below, above, points)


def _followed(system: "FlowSystem", v: Floats, line: Ints, phi: Floats) -> tuple["Itineraries", Bools, Ints]:
    """The itineraries of states on lines, which of them are long, and their codes."""
    itineraries = system.itineraries(np.column_stack([v[line], phi]))
    long = longer_than(LONGEST, itineraries.codes, itineraries.walls, turns=True)
    return itineraries, long, np.where(long, MANY_IMPACTS, itineraries.codes)


def _look(system: "FlowSystem", v: Floats, line: Ints, phi: Floats) -> _Points:
    itineraries, long, codes = _followed(system, v, line, phi)
    return _Points(
        line,
        phi,
        codes,
        itineraries.outcome,
        np.where(long | np.isnan(itineraries.clearance), np.inf, itineraries.clearance),
        np.where(long | np.isnan(itineraries.slowest), np.inf, itineraries.slowest),
    )


def _hidden(points: _Points, spacing: float) -> _Points:
    """The points beside which two edges may hide: gap or impact speed nearly touches zero between equal neighbours."""
    left, mid, right = points.take(slice(0, -2)), points.take(slice(1, -1)), points.take(slice(2, None))
    alike = (left.line == right.line) & ~left.differs(right) & ~left.differs(mid)
    alike &= (mid.phi - left.phi < 1.01 * spacing) & (right.phi - mid.phi < 1.01 * spacing)
    found = np.zeros(len(mid.phi), bool)
    with np.errstate(invalid="ignore"):
        for a, b, c in ((left.gap, mid.gap, right.gap), (left.slow**2, mid.slow**2, right.slow**2)):
            found |= (b <= a) & (b <= c) & (b < 2 * (a - 2 * b + c))
    return mid.take(alike & found)


def _bisected(system: "FlowSystem", v: Floats, points: _Points, halvings: int = 60) -> tuple[_Points, _Points]:
    """Every change between neighbouring points, located by so many halvings: the points below and above it."""
    change = (points.line[1:] == points.line[:-1]) & points.take(slice(1, None)).differs(points.take(slice(0, -1)))
    low, high = points.take(slice(0, -1)).take(change), points.take(slice(1, None)).take(change)

    def label(states: Floats) -> Ints:
        itineraries, _, codes = _followed(system, v, states[:, 0].astype(int), states[:, 1])
        return np.column_stack([codes, itineraries.outcome])

    start, end = (np.column_stack([side.line, side.phi]) for side in (low, high))
    _, *sides = bisect_changes(label, start, end, low.label, high.label, CHANGES, halvings)
    below, above = (_look(system, v, side[:, 0].astype(int), side[:, 1]) for side in sides)
    order = np.lexsort((below.phi, below.line))
    return below.take(order), above.take(order)


def _lines(system: "FlowSystem", v: Floats, below: _Points, above: _Points, points: _Points) -> list[Line]:
    """The edges among the changes, sharpened, by line."""
    lowest = points.take(np.searchsorted(points.line, np.arange(len(v))))
    codes = [system.first_return(np.column_stack([v[side.line], side.phi])).codes for side in (lowest, below, above)]
    codes = [
        np.where(side.code == MANY_IMPACTS, MANY_IMPACTS, each) for side, each in zip((lowest, below, above), codes, strict=True)
    ]
    gap, slow = (GRAZE * _largest(points.gap), np.sqrt(GRAZE) * _largest(points.slow))
    misses_below = (below.gap < gap) & (above.slow < slow)
    misses_above = (above.gap < gap) & (below.slow < slow)
    edge = misses_below | misses_above | (codes[1] != codes[2]) | (below.outcome != above.outcome)
    hit = np.where(misses_below == misses_above, 0, np.where(misses_below, 1, -1))
    phi = _sharpened(system, v, below, above, hit)
    result = []
    for k, speed in enumerate(v):
        mine = np.flatnonzero(edge & (below.line == k))
        words = [int(codes[0][k]), *codes[2][mine].tolist()]
        outcomes = [int(lowest.outcome[k]), *above.outcome[mine].tolist()]
        result.append(Line(float(speed), phi[mine], tuple(hit[mine].tolist()), tuple(words), tuple(outcomes)))
    return result


def _largest(margins: Floats) -> float:
    """The largest finite margin, the scale of small margins; zero without any."""
    return float(margins.max(initial=0.0, where=np.isfinite(margins)))


def _sharpened(system: "FlowSystem", v: Floats, below: _Points, above: _Points, hit: Ints) -> Floats:
    """The edges' phases, where the gap on the side that misses, continued by a parabola from three places, is zero."""
    phi = np.where(hit > 0, below.phi, above.phi)
    away = -hit[:, None] * STENCIL * np.arange(1, 4)
    seen = _look(system, v, np.repeat(below.line, 3), (phi[:, None] + away).ravel())
    g1, g2, g3 = seen.gap.reshape(-1, 3).T
    with np.errstate(all="ignore"):
        g0, slope = 3 * g1 - 3 * g2 + g3, (-5 * g1 + 8 * g2 - 3 * g3) / 2  # at the place itself, by steps of the stencil
        better = phi - hit * STENCIL * (-g0 / slope)
    usable = (hit != 0) & (np.abs(better - phi) < 1e-11)
    return np.where(usable, better, (below.phi + above.phi) / 2)
