"""The motion on each attractor over a period: its phase portrait, and beside it the motion over time."""

from collections.abc import Callable
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.dynamics.portraits.portrait import PhasePortrait
from nsmaps.exact.events import Track
from nsmaps.figures.attractors.poincare import MANY, name_of, poincare
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, dress
from nsmaps.figures.system.motion import motion, phase_plane

_SHOWN, _IMPACTS = 100, 20  #: states over the returns, and impacts or events over time, of an attractor without a period

Found = PhasePortrait | Callable[[], PhasePortrait]  #: or what computes it when it is drawn


def sheets(found: Found) -> tuple[Sheet, ...]:
    """One sheet, a row an attractor."""
    found = found if isinstance(found, PhasePortrait) else found()
    panels = [partial(of, found, number=k) for k in range(len(found.attractors)) for of in (portrait, over_time)]
    return (Sheet("portrait", tuple(panels), 2, 0.85, legend=True),)


def portrait(found: PhasePortrait, ax: Axes, number: int = 0) -> Axes:
    """The motion on one attractor in the plane of displacement and velocity, or of the first two states of a system with modes.

    Of a map without motions, the states of the attractor.
    """
    track, attractor = found.tracks[number], found.attractors[number]
    if track is None:
        return poincare(attractor, ax)
    phase_plane(track, ax, start=False)
    ax.set_title(name_of(attractor))
    return ax


def over_time(found: PhasePortrait, ax: Axes, number: int = 0) -> Axes:
    """The motion on one attractor over time, or the first coordinate over the returns of a map without motions."""
    track, attractor = found.tracks[number], found.attractors[number]
    if track is not None:
        motion(track, ax)
        times = (track.impacts if isinstance(track, Track) else track.events).time
        ax.set_xlim(0, times[-1] if attractor.period else times[:_IMPACTS].max())
        for line in ax.lines:
            line.set_clip_on(True)
        return ax
    values = np.resize(attractor.states[:, 0], 2 * attractor.period + 1) if attractor.period else attractor.states[:_SHOWN, 0]
    ax.plot(values, ".-" if len(values) < MANY else "-", color=BLUE, lw=0.6, ms=4, mew=0)
    dress(ax, ("k", ""), (attractor.coordinates[0], "k"))
    ax.set_xlabel("return $k$")
    return ax
