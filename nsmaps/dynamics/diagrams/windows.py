"""The windows of a bifurcation diagram: the values over which a motion attracts, with borders where the motion itself ends."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import nan
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.diagrams.bifurcation import Bifurcation
from nsmaps.dynamics.diagrams.borders import RANGE, Border
from nsmaps.dynamics.diagrams.changes import Change, Pair
from nsmaps.dynamics.diagrams.runs import Runs
from nsmaps.exact.returnmap import ReturnMap


@dataclass(frozen=True, slots=True)
class Window:
    """An interval of the parameter over which the first orbit of a diagram has one motion; "" where it has none."""

    label: str  #: the motion, such as 1:1/2T
    by_returns: str  #: its name where whole turns are unknown, as of fitted maps, such as 1:1, period 2
    low: Border
    high: Border
    seen: tuple[float, float] = (nan, nan)  #: least and greatest value of the diagram in it; NaN in runs of earlier versions


def windows(
    diagram: Bifurcation,
    map_of: Callable[[float], ReturnMap],
    starts: Floats,
    discard: int,
    direction: Literal["up", "down", "both"] | None = None,
) -> tuple[Window, ...]:
    """The windows of a diagram that are at least 1/50 of its range wide and have four values, in ascending order.

    A window with a cycle ends where this ceases to be stable or to exist: it is followed as a branch to the event, whose kind
    and precision are those of the border. Where chaos follows a period doubling, it begins at the accumulation of the further
    ones. At other borders, as at a crisis, orbits that start from the last states before the change are bisected to 1e-5 of the
    range, and the precision holds the difference that orbits four times as long make. A border that none of these locates has no
    value, and the kind `not located`.

    Args:
        diagram: from `bifurcation` with the same other arguments; with "both" its first orbit is followed upwards.
        starts: shape (n,) or (S, n).
    """
    order = np.argsort(-diagram.values if direction == "down" else diagram.values, kind="stable")
    runs = Runs(diagram, lru_cache(maxsize=1)(map_of), np.atleast_2d(starts)[0], discard, direction is not None, order)
    wide = [run for run in range(len(runs.runs)) if runs.is_wide(run)]
    needed = {edge for run in wide for edge in (run - 1, run) if 0 <= edge < len(runs.runs) - 1}
    between: dict[int, Pair] = {edge: Change(runs, edge, edge + 1).borders() for edge in sorted(needed)}
    return tuple(sorted((_window(runs, run, between) for run in wide), key=lambda window: window.seen))


def _window(runs: Runs, run: int, between: dict[int, Pair]) -> Window:
    """The window of a run, from the borders between each run and the next."""
    first, last = (runs.value(place) for place in runs.runs[run])
    begins = between[run - 1][1] if run else Border(first, 0.0, RANGE)
    ends = between[run][0] if run < len(runs.runs) - 1 else Border(last, 0.0, RANGE)
    seen = (first, begins), (last, ends)
    (low, lower), (high, upper) = sorted(seen, key=lambda pair: pair[0])
    return Window(runs.motion(run), runs.name_by_returns(run), lower, upper, (low, high))
