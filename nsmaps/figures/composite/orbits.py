"""Orbits of the composite map against those of the exact map, over the pieces: fig. test."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, Coordinates, is_angle
from nsmaps.figures.composite.areas import paint_pieces
from nsmaps.figures.data import ORBITS
from nsmaps.figures.lines import ended, finite_states, last_tenth, window
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import GREEN, ORANGE, dress

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

_NEAR = 0.04  #: of the orbit's extent, within which it has come to the attractor, and its line is thin not to hide it


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with a panel for every start."""
    pairs = ORBITS.of(result, "orbits")
    panels = tuple(partial(orbits, result, number=number) for number in range(len(pairs)))
    return (Sheet("orbits", panels, min(len(pairs), 2)),)


def orbits(result: "StudyResult", ax: Axes, number: int = 0) -> Axes:
    """The two orbits of one start: exact map solid orange, composite map dashed green; markers are their last tenths.

    An orbit that ends before has none: a cross marks its last state, or the last one in the picture, if it leaves that.
    A step across the seam of a phase, where it is wrapped, is not a line across the figure: the line leaves at one edge and
    comes in at the other.
    """
    pair = ORBITS.of(result, "orbits")[number]
    coordinates = pair.exact.coordinates
    runs = [(pair.exact, ORANGE, "-", ("D", "none", ORANGE, 8.0), result.system.map_name)]
    if pair.composite is not None:
        runs.append((pair.composite, GREEN, "--", ("o", GREEN, "white", 5.5), "composite map"))
    every = [finite_states(orbit) for orbit, *_ in runs]
    if result.composite is not None and result.surfaces:
        points = np.concatenate([_between(states) for states in every])
        paint_pieces(ax, result, "orbits", next(iter(result.surfaces.values())).grid, beside=points)
    for states, (orbit, colour, dashes, (marker, fill, edge, size), name) in zip(every, runs, strict=True):
        first = states if ended(orbit) else states[: _arrival(states) + 1]
        ax.plot(*around(states, coordinates).T, color=colour, lw=0.4, alpha=0.6, zorder=4)
        ax.plot(*around(first, coordinates).T, color=colour, ls=dashes, lw=1.1, label=name, zorder=4)
        ends = f"{name.split()[0]}, last 10 %"
        if not ended(orbit):
            ax.plot(*last_tenth(states).T, marker, mfc=fill, mec=edge, mew=0.7, ms=size, zorder=5, label=ends)
    _look(ax, result, coordinates, np.concatenate(every))
    for states, (orbit, colour, *_, name) in zip(every, runs, strict=True):
        if ended(orbit):
            _end(ax, states, colour, name)
    start = every[0][:1]
    ax.plot(*start.T, "o", mfc="white", mec="black", mew=0.8, ms=4.8, zorder=6, clip_on=False, label="start")
    ax.legend(loc="lower right", bbox_to_anchor=(1, 1.06), ncols=len(runs) + 1, frameon=False, columnspacing=1, handlelength=1.8)
    return dress(ax, (coordinates[0], "k"), (coordinates[1], "k"))


def _end(ax: Axes, states: Floats, colour: str, name: str) -> None:
    """A cross at the last state, or at the last one within the limits of the picture."""
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    inside = np.flatnonzero(((low <= states) & (states <= high)).all(axis=1))
    text = f"{name} ends" if inside[-1] == len(states) - 1 else f"{name}, last inside"
    ax.plot(*states[inside[-1:]].T, "X", mfc=colour, mec="black", mew=0.5, ms=5.4, zorder=6, clip_on=False, label=text)


def _arrival(states: Floats) -> int:
    """The number of the first state that is near one of the last tenth, in which the orbit has come to its attractor."""
    distance = np.abs(states[:, np.newaxis] - last_tenth(states)) / np.maximum(np.ptp(states, axis=0), 1e-300)
    return int(np.argmax((distance < _NEAR).all(axis=2).any(axis=1)))


def around(states: Floats, coordinates: Sequence[str]) -> Floats:
    """The corners of an orbit's line (m, n): a step of an angle by more than half a turn goes the short way, in two parts.

    >>> from nsmaps.coordinates import Angle
    >>> around(np.array([[0.0, 6.2], [1.0, 0.2]]), ("v", Angle("phi"))).round(1).tolist()
    [[0.0, 6.2], [1.0, 6.5], [nan, nan], [0.0, -0.1], [1.0, 0.2]]
    """
    angles = Coordinates(coordinates).angles
    corners = [states[:1]]
    for here, there in pairwise(states):
        turns = TWO_PI * np.round((there - here) / TWO_PI) * angles
        if turns.any():
            corners.append(np.array([there - turns, np.full(len(here), np.nan), here + turns]))
        corners.append(there[np.newaxis])
    return np.concatenate(corners)


def _look(ax: Axes, result: "StudyResult", coordinates: Sequence[str], states: Floats) -> None:
    """Limits that hold the grid and the states (N, 2) near it; all states where there is no grid."""
    first = next(iter(result.surfaces.values()), None)
    for i, name in enumerate(("xlim", "ylim")):
        axis = None if first is None else list(first.grid.axes.values())[i]
        low, high = (states[:, i].min(), states[:, i].max()) if axis is None else (axis.low, axis.high)
        ends = window(low, high, states[:, i], 1.0 if is_angle(coordinates[i]) else 0.25)
        margin = 0.03 * (ends[1] - ends[0])
        below, above = axis is None or ends[0] < low, axis is None or ends[1] > high
        limits = np.array([ends[0] - margin * below, ends[1] + margin * above])
        ax.set(**{name: np.clip(limits, 0, TWO_PI) if is_angle(coordinates[i]) and low >= 0 else limits})


def _between(states: Floats, points: int = 25) -> Floats:
    """Points along the straight lines between successive states."""
    share = np.linspace(0, 1, points)[:, np.newaxis, np.newaxis]
    return np.asarray(states[:-1] + share * np.diff(states, axis=0)).reshape(-1, states.shape[1])
