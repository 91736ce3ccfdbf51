"""The windows of a bifurcation diagram: the values over which a motion attracts, with borders where the motion itself ends."""

from collections.abc import Callable
from functools import lru_cache
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.diagrams.borders import RANGE
from nsmaps.dynamics.diagrams.changes import Change, Pair
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, Border, Window
from nsmaps.dynamics.diagrams.runs import Runs
from nsmaps.exact.returnmap import ReturnMap


def windows(
    diagram: BifurcationDiagram,
    map_of: Callable[[float], ReturnMap],
    starts: Floats,
    transient: int,
    direction: Literal["up", "down", "both"] | None = None,
) -> tuple[Window, ...]:
    """The windows of a diagram that are at least 1/50 of its range wide and have four values, in ascending order.

    Narrower chaos next to the period doublings of such a window is one, too: windows of cycles interrupt it.

    A window with a cycle ends where this ceases to be stable or to exist: it is followed as a branch to the event, whose kind
    and precision are those of the border. Where chaos follows a period doubling, it begins at the accumulation of the further
    ones. At other borders, as at a crisis, orbits that start from the last states before the change are bisected to 1e-5 of the
    range, and the precision holds the difference that orbits four times as long make. A border that none of these locates has no
    value, and the kind `not located`.

    Args:
        diagram: from `bifurcation_diagram` with the same other arguments; with "both" its first orbit is followed upwards.
        starts: shape (n,) or (S, n).
    """
    order = np.argsort(-diagram.values if direction == "down" else diagram.values, kind="stable")
    runs = Runs(diagram, lru_cache(maxsize=1)(map_of), np.atleast_2d(starts)[0], transient, direction is not None, order)
    wide = [run for run in range(len(runs.runs)) if runs.is_window(run)]
    beside = [(run, runs.beside(run, way)) for run in wide for way in (-1, 1)]
    edges = {(min(run, other), max(run, other)) for run, other in beside if other is not None}
    between: dict[tuple[int, int], Pair] = {edge: Change(runs, *edge).borders() for edge in sorted(edges)}
    return tuple(sorted((_window(runs, run, between) for run in wide), key=lambda window: window.seen))


def _window(runs: Runs, run: int, between: dict[tuple[int, int], Pair]) -> Window:
    """The window of a run, from the borders between runs."""
    (first, last), before, after = (runs.value(place) for place in runs.runs[run]), runs.beside(run, -1), runs.beside(run, 1)
    begins = Border(first, 0.0, RANGE) if before is None else between[before, run][1]
    ends = Border(last, 0.0, RANGE) if after is None else between[run, after][0]
    seen = (first, begins), (last, ends)
    (low, lower), (high, upper) = sorted(seen, key=lambda pair: pair[0])
    return Window(runs.motion(run), runs.name_by_returns(run), lower, upper, (low, high), runs.rotation(run))
