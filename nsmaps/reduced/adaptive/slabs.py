"""Bands of impact speed in which every edge of a planar return map is one smooth curve over the speed.

Lines of constant speed meet the same edges in the same order throughout a band. Bands end where that changes, and they are
bisected
where a curve of moderate degree does not follow an edge to rounding.
"""

from dataclasses import dataclass, field
from itertools import groupby, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.progress import Work, beat
from nsmaps.reduced.adaptive.scanlines import Line, lines
from nsmaps.results import Result, array

if TYPE_CHECKING:
    from nsmaps.exact.systems.flow import FlowSystem

LINES = 60  #: lines of constant speed in the first comparison
NODES = 33  #: lines from which the curves of a band are computed
ENDS = 3  #: of these lines at either end of a band, so close to it that rounding may change their kind
RESOLVED = 2e-15  #: bound on the last coefficients of a curve, relative to the largest
NOISE = 15  #: factor of this bound in bands narrower than a hundredth of the speeds
MANY = 64  #: changes of kind at once: more are due to the rounding of one, and are resolved only so far
ROUGH = 1e-9  #: of the range of speeds
NARROW = 2e-6  #: share of the range of speeds: narrower bands are left to the exact map
PLACES = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)  #: of these lines, in s
STRAIGHT, LOW, HIGH = 0, 1, 2  #: a coordinate's chart: itself, or the square root of the distance from its low or high end


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Slab(Result):
    """A band of speeds with its edges as Chebyshev series of s in [-1, 1]; K edges, K + 1 cells between them."""

    low: float
    high: float
    chart: int  #: STRAIGHT: s is linear in v; LOW, HIGH: in the square root of the distance from that end
    curves: Floats = field(
        metadata=array("edge coefficient", "coefficients of the phases of the lower end, the edges and the upper end")
    )
    hit: tuple[int, ...]  #: of the K edges, as in `Line`
    words: tuple[int, ...]  #: codes of the words in the cells
    outcomes: tuple[int, ...]

    def speeds(self, s: Floats) -> Floats:
        """The speeds at s in [-1, 1]."""
        return unchart(self.chart, self.low, self.high, s)

    def phases(self, s: Floats) -> Floats:
        """The phases of all curves at s, shape (K + 2, ...)."""
        return np.moveaxis(chebvander(s, NODES - 1) @ self.curves.T, -1, 0)


def unchart(chart: int, low: float, high: float, s: Floats) -> Floats:
    """The point between low and high at s in [-1, 1] of a chart."""
    near, far = (1 + s) / 2, (1 - s) / 2
    if chart == LOW:
        return low + (high - low) * near**2
    return high - (high - low) * (far**2 if chart == HIGH else far)


def slabs(system: "FlowSystem", speeds: tuple[float, float], phases: tuple[float, float], work: Work) -> tuple[list[Slab], bool]:
    """The bands between two speeds, in order, over the phases from low to high (radians); and True if these are all.

    Gaps between two bands, together less than a millionth of the range, are so close to a change that no curve follows.
    """
    whole = speeds[1] - speeds[0]
    x = np.linspace(0, 1, LINES)
    found = _resolved(system, lines(system, speeds[0] + whole * x * (1 + x) / 2, *phases), phases, work)
    complete = not work.over
    runs = [list(run) for _, run in groupby(found, key=lambda line: line.kind)]
    waiting = [(run[0].v, run[-1].v) for run in runs if run[-1].v - run[0].v > NARROW * whole]
    resolved: list[Slab] = []
    while waiting and not work.over:
        beat(0.0, f"{len(resolved)} bands of edges, {len(waiting)} to resolve")
        fitted = _fitted(system, waiting, phases, 0.01 * whole)
        resolved += [slab for slab in fitted if slab]
        left = [band for band, slab in zip(waiting, fitted, strict=True) if not slab]
        halves = [half for low, high in left for half in ((low, (low + high) / 2), ((low + high) / 2, high))]
        waiting = [(low, high) for low, high in halves if high - low > NARROW * whole]
    return sorted(resolved, key=lambda slab: slab.low), complete and not waiting


def clear_phase(system: "FlowSystem", speeds: tuple[float, float]) -> float:
    """The phase at which a circle is best cut: that with the largest distance from all edges."""
    seen = lines(system, np.linspace(*speeds, LINES), 0.0, TWO_PI)
    at = np.linspace(0, TWO_PI, 257)[:-1]
    away = np.full(len(at), np.pi)
    for line in seen:
        for phi in line.phi:
            away = np.minimum(away, np.abs(np.mod(at - phi + np.pi, TWO_PI) - np.pi))
    return float(at[np.argmax(away)])


def _resolved(system: "FlowSystem", found: list[Line], phases: tuple[float, float], work: Work) -> list[Line]:
    """Lines such that neighbours of different kinds are as close as floats can be."""
    whole = found[-1].v - found[0].v
    for number in range(60):
        ends = [(a.v, b.v) for a, b in pairwise(found) if a.kind != b.kind]
        least = 4e-16 * max(abs(found[0].v), abs(found[-1].v)) if len(ends) <= MANY else ROUGH * whole
        pairs = [(a + b) / 2 for a, b in ends if b - a > least]
        if not pairs or work.over:
            break
        beat(0.0, f"edges resolved on {len(found)} lines, round {number + 1}")
        between = lines(system, pairs, *phases)
        both = sorted([*found, *between], key=lambda line: line.v)
        inner = [b for a, b, c in zip(both, both[1:], both[2:], strict=False) if not a.kind == b.kind == c.kind]
        found = [both[0], *inner, both[-1]]  # of a run of one kind only the ends matter
    return found


def _fitted(
    system: "FlowSystem", bands: list[tuple[float, float]], phases: tuple[float, float], narrow: float
) -> list[Slab | None]:
    """Each band as a slab, in the simplest chart in which its curves are resolved, or None.

    A band in which lines away from its ends are of several kinds has no chart in which it is a slab, and is not tried.
    """
    result: list[Slab | None] = [None] * len(bands)
    left = list(range(len(bands)))
    for chart in (STRAIGHT, LOW, HIGH):
        if not left:
            break
        seen = lines(system, np.concatenate([unchart(chart, *bands[k], PLACES) for k in left]), *phases)
        of_band = {k: seen[j * NODES : (j + 1) * NODES] for j, k in enumerate(left)}
        for k in left:
            bound = RESOLVED * (NOISE if bands[k][1] - bands[k][0] < narrow else 1)
            result[k] = _slab(bands[k], chart, of_band[k], phases, bound)
        left = [k for k in left if result[k] is None and len({line.kind for line in of_band[k][ENDS:-ENDS]}) == 1]
    return result


def _slab(band: tuple[float, float], chart: int, seen: list[Line], phases: tuple[float, float], bound: float) -> Slab | None:
    """A band with the curves through the edges on its lines, unless these are of several kinds or not resolved."""
    first = seen[0]
    if any(line.kind != first.kind for line in seen):
        return None
    curves = np.linalg.solve(chebvander(PLACES, NODES - 1), [[phases[0], *line.phi, phases[1]] for line in seen]).T
    if np.abs(curves[:, -6:]).max() > bound * np.abs(curves).max():
        return None
    return Slab(*band, chart, curves, first.hit, first.words, first.outcomes)
