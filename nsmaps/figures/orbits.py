"""Orbits of the composite map against those of the exact map, over the pieces: fig. test."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.exact.impacts import Angle, Floats
from nsmaps.figures.lines import finite_states, last_tenth, window
from nsmaps.figures.needs import Drawable, orbits_of, two
from nsmaps.figures.sheet import Sheet
from nsmaps.figures.style import GREEN, ORANGE, dress
from nsmaps.figures.words import paint_pieces

_FIRST = 60  #: states after which the line of an orbit is thin, for else it blackens the attractor


def sheets(result: Drawable) -> tuple[Sheet, ...]:
    """One sheet with a panel for every start."""
    pairs = orbits_of(result, "orbits")
    two(pairs[0].exact.coordinates, "orbits")
    panels = tuple(partial(orbits, result, number=number) for number in range(len(pairs)))
    return (Sheet("orbits", panels, min(len(pairs), 2)),)


def orbits(result: Drawable, ax: Axes, number: int = 0) -> Axes:
    """The two orbits of one start: exact map solid orange, composite map dashed green; markers are their last tenths."""
    pair = orbits_of(result, "orbits")[number]
    coordinates = pair.exact.coordinates
    two(coordinates, "orbits")
    runs = [(finite_states(pair.exact), ORANGE, "-", "D", "exact map")]
    if pair.composite is not None:
        runs.append((finite_states(pair.composite), GREEN, "--", "o", "composite map"))
    if result.composite is not None and result.surfaces:
        points = np.concatenate([_between(states) for states, *_ in runs])
        paint_pieces(ax, result.composite, next(iter(result.surfaces.values())).grid, beside=points)
    for states, colour, dashes, marker, name in runs:
        ax.plot(*states.T, color=colour, ls=dashes, lw=0.5, label=name, zorder=4)
        ax.plot(*states[:_FIRST].T, color=colour, ls=dashes, lw=1.8, zorder=4)
        ax.plot(*last_tenth(states).T, marker, mfc=colour, mec="white", mew=0.6, ms=6.5, zorder=5)
    _look(ax, result, coordinates, np.concatenate([states for states, *_ in runs]))
    start = runs[0][0][:1]
    ax.plot(*start.T, "o", mfc="white", mec="black", mew=1.4, ms=8, zorder=6, clip_on=False, label="start")
    legend = ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, frameon=False, columnspacing=1, handlelength=1.8)
    for handle in legend.get_lines():
        handle.set_linewidth(1.8)
    return dress(ax, (coordinates[0], "k"), (coordinates[1], "k"))


def _look(ax: Axes, result: Drawable, coordinates: Sequence[str], states: Floats) -> None:
    """Limits that hold the grid and the states (N, 2) near it; all states where there is no grid."""
    first = next(iter(result.surfaces.values()), None)
    for i, name in enumerate(("xlim", "ylim")):
        axis = None if first is None else list(first.grid.axes.values())[i]
        low, high = (states[:, i].min(), states[:, i].max()) if axis is None else (axis.low, axis.high)
        ends = window(low, high, states[:, i], 1.0 if isinstance(coordinates[i], Angle) else 0.25)
        margin = 0.03 * (ends[1] - ends[0])
        below, above = axis is None or ends[0] < low, axis is None or ends[1] > high
        ax.set(**{name: (ends[0] - margin * below, ends[1] + margin * above)})


def _between(states: Floats, points: int = 25) -> Floats:
    """Points along the straight lines between successive states."""
    share = np.linspace(0, 1, points)[:, np.newaxis, np.newaxis]
    return np.asarray(states[:-1] + share * np.diff(states, axis=0)).reshape(-1, states.shape[1])
