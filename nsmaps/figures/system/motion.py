"""The exact motion at and between impacts or events: fig. model:abc, panels (b) and (c)."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.arrays import Floats
from nsmaps.exact.events import ModeTrack, Track
from nsmaps.figures.page import Panel, Sheet
from nsmaps.figures.style import BLUE, GREEN, RED, with_unit
from nsmaps.figures.system.flights import in_lines, legend, over_time, plane, ring

MARKS = ((GREEN, "*", 8.0), (BLUE, "o", 4.2))  #: colour, shape and size of impacts, by wall: a star for the base wall
_ARROWS = 14  #: flights with an arrow of time, at most: the first, before they lie over each other


def sheets(tracks: Track | ModeTrack | Sequence[Track | ModeTrack]) -> tuple[Sheet, ...]:
    """One sheet: a row a tracked orbit, its places over time and its phase plane; with modes all states, one or two a row."""
    panels: list[Panel] = []
    for track in several(tracks):
        more = partial(phase_plane, track)
        if isinstance(track, ModeTrack):
            panels += [partial(motion, track, state=k) for k in range(len(track.names))]
            panels += [more] * (len(track.names) > 1)
        else:
            panels += [partial(motion, track), more]
    return (Sheet("motion", tuple(panels), 2, 0.85, legend=True),)


def several(tracks: Track | ModeTrack | Sequence[Track | ModeTrack]) -> Sequence[Track | ModeTrack]:
    """Tracks, of which one may be given alone."""
    return [tracks] if isinstance(tracks, Track | ModeTrack) else tracks


def motion(track: Track | ModeTrack, ax: Axes, state: int = 0) -> Axes:
    """The ball between the walls over time, solid, with its impacts marked by wall; dashed the walls.

    Places are at rest where the system says how its walls move; else they are displacements, and walls do not move. Of a system
    with modes it is the state of this position.
    """
    if isinstance(track, ModeTrack):
        return over_time(track, ax, state)
    time = track.time.ravel()
    for wall in track.walls:
        ax.plot(time, wall.ravel(), color="black", ls=(0, (4, 2)), lw=0.6)
    ax.plot(time, track.ball.ravel(), color=RED, lw=0.9)
    places = np.concatenate([track.ball[:1, 0], track.ball[:, -1]])
    mark_impacts(ax, track, track.impacts.time, places)
    ax.set_xlim(time[0], time[-1])
    ax.margins(y=0.05)
    handles = [Line2D([], [], color="black", ls=(0, (4, 2)), label="walls"), Line2D([], [], color=RED, label="ball")]
    legend(ax, [*handles, *marks_of(track)])
    ax.set_xlabel(with_unit("time $t$", "time"))
    ax.set_ylabel(in_lines(with_unit(f"{'absolute' if track.moving else 'relative'} displacement", "displacement")))
    return ax


def phase_plane(track: Track | ModeTrack, ax: Axes, start: bool = True) -> Axes:
    """Relative velocity over relative displacement with arrows of time; upright where an impact turns it, grey the walls.

    Of a system with modes it is the second state over the first. A ring marks the `start`, unless it is any state of a period.
    """
    if isinstance(track, ModeTrack):
        return plane(track, ax, start)
    for at in track.at:
        ax.axvline(at, color="0.87", lw=3.6, zorder=0)
    for k, (place, rate) in enumerate(zip(track.displacement, track.velocity, strict=True)):
        ax.plot(place, rate, color=RED, lw=0.7)
        ax.plot([place[0]] * 2, [track.rates[k], rate[0]], color="0.25", lw=0.5)
        middle = len(place) // 2
        if k < _ARROWS and np.ptp(place) > 0:
            tip, tail = ((place[j], rate[j]) for j in (middle + 1, middle))
            ax.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": RED, "lw": 0, "mutation_scale": 13})
    mark_impacts(ax, track, track.at[track.impacts.wall], track.rates)
    handles = [Line2D([], [], color="0.87", lw=3.6, label="places of walls"), *marks_of(track)]
    if start:
        handles.append(ring(ax, track.at[track.impacts.wall[0]], track.rates[0]))
    legend(ax, handles)
    ax.set_xlabel(in_lines(with_unit("relative displacement $Z$", "displacement")))
    ax.set_ylabel(in_lines(with_unit(r"relative velocity $\dot{Z}$", "velocity")))
    return ax


def mark_impacts(ax: Axes, track: Track, x: Floats, y: Floats) -> None:
    """The impacts at given points, each in the mark of its wall."""
    for wall, (colour, shape, size) in zip(range(len(track.at)), MARKS, strict=False):
        own = track.impacts.wall == wall
        if own.any():
            ax.plot(x[own], y[own], shape, color=colour, mec="white", mew=0.3, ms=size, zorder=5, clip_on=False)


def marks_of(track: Track) -> list[Line2D]:
    """What the marks of the walls mean, for a legend."""
    return [
        Line2D([], [], color=colour, marker=shape, ls="", ms=size, mec="white", mew=0.3, label=f"impact on {name}")
        for wall, (name, (colour, shape, size)) in enumerate(zip(track.impacts.walls, MARKS, strict=False))
        if (track.impacts.wall == wall).any()
    ]
