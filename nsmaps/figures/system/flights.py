"""The motion of a system with modes: its states over time, in a plane, and at its events."""

from itertools import cycle
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.exact.events import ModeTrack
from nsmaps.figures.style import BLACK, BLUE, BROWN, GREEN, GREY, MAGENTA, OLIVE, ORANGE, RED, SKY, label, with_unit
from nsmaps.figures.ticks import angle_ticks

MODES = (RED, SKY, OLIVE, MAGENTA, BROWN, GREY)  #: colours of flights, by mode
EVENTS = ((GREEN, "*", 7.5), (BLUE, "o", 4.0), (ORANGE, "s", 3.8), (BLACK, "^", 4.2), (GREY, "D", 3.6))  #: by letter
_ONE_PLACE = 1e-9  #: share of the extent of the motion


def over_time(track: ModeTrack, ax: Axes, k: int) -> Axes:
    """The state k over time, coloured by mode; marks at events, dotted lines where the state jumps."""
    _flights(ax, track, track.time, track.states[..., k])
    _events(ax, track, (track.events.time, track.events.time), (track.events.before[:, k], track.events.after[:, k]))
    ax.set_xlim(0, track.events.time[-1] or 1.0)
    ax.margins(y=0.06)
    ax.set_xlabel(with_unit("time $t$", "time"))
    ax.set_ylabel(label(track.names[k]))
    return ax


def plane(track: ModeTrack, ax: Axes, start: bool = True) -> Axes:
    """The second state over the first, coloured by mode, a ring at the start; marks at events, dotted lines at jumps.

    Grey lines are where one state is the same at all events of a letter while the other is not, as at a stop.
    """
    events, fixed = track.events, list[Line2D]()
    extent = np.ptp(track.states[..., :2].reshape(-1, 2), axis=0)
    for letter in dict.fromkeys(events.letter.tolist()):
        places = events.before[events.letter == letter, :2]
        same = np.ptp(places, axis=0) <= _ONE_PLACE * extent
        if same.sum() == 1:
            line = ax.axvline if same[0] else ax.axhline
            fixed = [line(places[0, same][0], color="0.87", lw=2.4, zorder=0, label="places of events")]
    _flights(ax, track, track.states[..., 0], track.states[..., 1])
    _events(ax, track, *((events.before[:, k], events.after[:, k]) for k in (0, 1)))
    legend(ax, [*cast(Any, ax.get_legend()).legend_handles, *fixed])
    return _labelled(ax, events.before[0, :2] if start else None, *map(label, track.names[:2]))


def at_events(track: ModeTrack, ax: Axes) -> Axes:
    """The phase, or the second coordinate, over the first one just before each event; dotted lines give their order."""
    coordinates = track.coordinates or Coordinates(track.names)
    names = [name for name in coordinates if name in track.names] or list(track.names)
    x = track.events.before[:, track.names.index(names[0])]
    phased = bool(coordinates.angles.any()) or len(names) < 2
    y = track.events.phase if phased else track.events.before[:, track.names.index(names[1])]
    _events(ax, track, (x, x), (y, y))
    ax.plot(x, y, color="0.35", ls=":", lw=0.7, zorder=0)
    if phased:
        angle_ticks(ax.yaxis, float(np.ptp(ax.get_ylim())))
    phase = next((name for name, angle in zip(coordinates, coordinates.angles, strict=True) if angle), names[-1])
    return _labelled(ax, np.array([x[0], y[0]]), label(names[0]), label(phase if phased else names[1]))


def _flights(ax: Axes, track: ModeTrack, x: Floats, y: Floats) -> None:
    """Curves (M - 1, samples), coloured by mode."""
    colours = _colours(track)
    for mode, across, up in zip(track.modes, x, y, strict=True):
        ax.plot(across, up, color=colours[str(mode)], lw=0.9)


def _events(ax: Axes, track: ModeTrack, x: tuple[Floats, Floats], y: tuple[Floats, Floats]) -> None:
    """Marks by letter just before events, dotted lines to just after them, and what the marks and the colours of curves mean."""
    handles = [Line2D([], [], color=colour, label=mode) for mode, colour in _colours(track).items()] if ax.lines else []
    ax.plot(np.stack(x), np.stack(y), color="0.35", ls=":", lw=0.5)
    for letter, (colour, shape, size) in zip(dict.fromkeys(track.events.letter.tolist()), EVENTS, strict=False):
        own = track.events.letter == letter
        look: dict[str, Any] = {"color": colour, "marker": shape, "ls": "", "ms": size, "mec": "white", "mew": 0.5}
        ax.plot(x[0][own], y[0][own], zorder=5, clip_on=False, **look)
        name = track.events.name[own][0]
        handles.append(Line2D([], [], label=f"event {name}" if name.startswith(letter) else f"{letter}: {name}", **look))
    legend(ax, handles)


def _labelled(ax: Axes, start: Floats | None, across: str, up: str) -> Axes:
    """Names of both axes, and a ring around the start."""
    if start is not None:
        own = cast(Any, ax.get_legend())
        legend(ax, [*own.legend_handles, ring(ax, *start.tolist())])
    ax.margins(0.06)
    ax.set_xlabel(across)
    ax.set_ylabel(up)
    return ax


def ring(ax: Axes, x: float, y: float) -> Line2D:
    """A ring around the start, which is what a legend has of it."""
    return ax.plot([x], [y], "o", mfc="none", mec=ORANGE, mew=1, ms=7.8, label="start")[0]


def _colours(track: ModeTrack) -> dict[str, str]:
    """A colour for each mode that occurs, in the order in which they do."""
    return dict(zip(dict.fromkeys(track.modes.tolist()), cycle(MODES), strict=False))


def in_lines(text: str) -> str:
    """A label with its unit in a second line."""
    return text.replace(" (", "\n(")


def legend(ax: Axes, handles: list[Line2D]) -> None:
    """A line of names above the axes."""
    look: dict[str, Any] = {"ncols": 4, "frameon": False, "columnspacing": 1.1, "handletextpad": 0.4}
    ax.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), **look)
