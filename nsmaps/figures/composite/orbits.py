"""Orbits of the composite map against those of the exact map, over the pieces: fig. test."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, Coordinates, is_angle
from nsmaps.dynamics.attractors.limit_set import LimitSet, OrbitPair
from nsmaps.dynamics.orbit import Orbit
from nsmaps.figures.composite.areas import colours_over, paint_pieces
from nsmaps.figures.composite.inset import inset
from nsmaps.figures.lines import ended, finite_states, last_tenth, window
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import position
from nsmaps.figures.style import GREEN, HALO, ORANGE, dress

if TYPE_CHECKING:
    from nsmaps.exact.surfaces.surface import Grid
    from nsmaps.exact.systems.parameters import System
    from nsmaps.reduced.composite.composite import CompositeMap

Found = Orbit | OrbitPair | Sequence[OrbitPair]
Over = tuple["Grid", "CompositeMap | None"]  #: the range of a picture, and what divides it into pieces
Run = tuple[Orbit, "LimitSet | None", str, str, tuple[str, str, str, float], str]
"""An orbit, what it ends on, colour, dashes, marker of its attractor, name."""
_NEAR = 0.04  #: of the orbit's extent, within which it has come to the attractor, and its line is thin not to hide it


def sheets(found: Found, system: "System | None" = None, over: Over | None = None, number: int = 0) -> tuple[Sheet, ...]:
    """One sheet: a panel for every start; of an orbit by itself, that of a start by its number and one for each coordinate."""
    if isinstance(found, Orbit):
        plane = (partial(orbits, found, number=number),) if len(found.coordinates) == 2 else ()
        each = (partial(over_returns, found, coordinate=name, number=number) for name in found.coordinates)
        return (Sheet("orbits", (*plane, *each), 1, 0.4, legend=bool(plane)),)
    title, count = system.map_name if system else "exact map", 1 if isinstance(found, OrbitPair) else len(found)
    panels = tuple(partial(orbits, found, number=k, over=over, title=title) for k in range(count))
    return (Sheet("orbits", panels, min(count, 2), 0.8, legend=True),)


def over_returns(orbit: Orbit, ax: Axes, coordinate: str, number: int = 0) -> Axes:
    """A coordinate of the orbit of one start over the returns."""
    values = _of_start(orbit, number).states[:, position(orbit.coordinates, coordinate)]
    ax.plot(np.arange(len(values)), values, ".-", color=ORANGE, lw=0.5, ms=2.5, mew=0)
    dress(ax, ("k", ""), (orbit.coordinates[position(orbit.coordinates, coordinate)], "k"))
    ax.set_xlabel("return")
    return ax


def _of_start(orbit: Orbit, number: int) -> Orbit:
    """The states of one start alone."""
    return replace(orbit, states=orbit.states.reshape(len(orbit.states), -1, len(orbit.coordinates))[:, number])


def orbits(found: Found, ax: Axes, number: int = 0, *, over: Over | None = None, title: str = "exact map") -> Axes:
    """The orbits of one start: exact map solid orange, composite map dashed green; markers are their last tenths.

    Where these have no period, dots are what they visit.

    Only pieces that an orbit visits have a colour, and an attractor that is small is enlarged. An orbit that ends before has no
    last tenth: a cross marks its last state, or the last one in the picture, if it leaves that.
    A step across the seam of a phase, where it is wrapped, is not a line across the figure: the line leaves at one edge and
    comes in at the other. An orbit without a plane of states is drawn by its first coordinate over the returns.

    Args:
        number: of the start.
        over: the grid whose range is shown, and the composite map whose pieces are.
        title: name of the map of the first orbit.
    """
    if isinstance(found, Orbit) and len(found.coordinates) != 2:
        return over_returns(found, ax, found.coordinates[0], number)
    pairs = (OrbitPair(found.states[0], _of_start(found, number), None),) if isinstance(found, Orbit) else found
    pairs = (pairs,) if isinstance(pairs, OrbitPair) else pairs
    pair = pairs[0 if isinstance(found, Orbit) else number]
    coordinates = pair.coordinates
    runs: list[Run] = [(pair.exact, pair.ends, ORANGE, "-", ("D", "white", ORANGE, 6.0), title)]
    if pair.composite is not None:
        runs.append((pair.composite, pair.composite_ends, GREEN, "--", ("o", GREEN, "white", 4.0), "composite map"))
    every = [finite_states(orbit) for orbit, *_ in runs]
    if over is not None and over[1] is not None:
        points = np.concatenate([_between(states) for states in every])
        visited = np.unique(over[1].piece_of(np.concatenate(every)))
        paint_pieces(ax, over[1], colours_over(over[1], over[0], pairs), over[0], beside=points, only=visited)
    for states, (orbit, ends, colour, dashes, _, name) in zip(every, runs, strict=True):
        first = states if ended(orbit) else states[: _arrival(states) + 1]
        if ends is None or ends.period:  # others fill what they visit
            ax.plot(*around(states, coordinates).T, color=colour, lw=0.4, alpha=0.6, zorder=4)
        ax.plot(*around(first, coordinates).T, color=colour, ls=dashes, lw=1.1, label=name, zorder=4, path_effects=HALO)
    _last(ax, runs, every)
    _look(ax, over[0] if over else None, coordinates, np.concatenate(every))
    for states, (orbit, _, colour, *_, name) in zip(every, runs, strict=True):
        if ended(orbit):
            _end(ax, states, colour, name)
    start = every[0][:1]
    ax.plot(*start.T, "o", mfc="white", mec="black", mew=0.8, ms=4.8, zorder=6, clip_on=False, label="start")
    ax.legend()
    lasting = [_settled(run, states) for states, run in zip(every, runs, strict=True) if not ended(run[0])]
    if lasting:
        inset(ax, np.concatenate(lasting), partial(_last, runs=runs, every=every), free=True)
    return dress(ax, (coordinates[0], "k"), (coordinates[1], "k"))


def _last(ax: Axes, runs: Sequence[Run], every: Sequence[Floats]) -> None:
    """The last tenths of the orbits that do not end before, or as dots what those visit that end on no cycle."""
    for states, run in zip(every, runs, strict=True):
        orbit, ends, colour, _, (marker, fill, edge, size), name = run
        if not ended(orbit):
            look: dict[str, Any] = {"marker": marker, "mfc": fill, "mec": edge, "mew": 0.7, "ms": size}
            if ends is not None and not ends.period:
                look = {"marker": ".", "mfc": colour, "mew": 0, "ms": 2.5}
            text = f"{name.removesuffix(' map')}, last tenth"
            ax.plot(*_settled(run, states).T, ls="", zorder=5, clip_on=False, label=text, **look)


def _settled(run: Run, states: Floats) -> Floats:
    """The last tenth of an orbit's states; of one that ends on no cycle many that it visits later."""
    ends = run[1]
    return last_tenth(states) if ends is None or ends.period else ends.states


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


def _look(ax: Axes, grid: "Grid | None", coordinates: Sequence[str], states: Floats) -> None:
    """Limits that hold the grid and the states (N, 2) near it; all states where there is no grid."""
    for i, name in enumerate(("xlim", "ylim")):
        axis = None if grid is None else list(grid.axes.values())[i]
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
