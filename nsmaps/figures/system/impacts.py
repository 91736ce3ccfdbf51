"""Velocity and phase at all impacts of an orbit, in their order: fig. impact-time."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.exact.events import ModeTrack, Track
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import with_unit
from nsmaps.figures.system.flights import at_events, legend, ring
from nsmaps.figures.system.motion import mark_impacts, marks_of, several
from nsmaps.figures.ticks import angle_ticks


def sheets(tracks: Track | ModeTrack | Sequence[Track | ModeTrack]) -> tuple[Sheet, ...]:
    """One sheet with a panel for every tracked orbit."""
    panels = tuple(partial(impacts, track) for track in several(tracks))
    return (Sheet("impacts", panels, min(len(panels), 2), 0.6, legend=True),)


def impacts(track: Track | ModeTrack, ax: Axes) -> Axes:
    """Phase over velocity just before each impact, marked by wall: the velocity has the sign of its wall's side.

    Dotted lines lead from each impact to the next; phases are in [0, 2 pi). Of a system with modes it is the first coordinate of
    its section that is a state.
    """
    if isinstance(track, ModeTrack):
        return at_events(track, ax)
    phase = track.impacts.phase
    ax.axvline(0, color="0.75", lw=0.5, zorder=0)
    ax.plot(track.rates, phase, color="0.35", ls=":", lw=0.7)
    mark_impacts(ax, track, track.rates, phase)
    start = ring(ax, track.rates[0], phase[0])
    ax.margins(0.06)
    legend(ax, [*marks_of(track), start])
    angle_ticks(ax.yaxis, float(np.ptp(ax.get_ylim())))
    ax.set_xlabel(with_unit(r"relative velocity $\dot{Z}_j$", "velocity"))
    ax.set_ylabel(r"phase $\psi_j$ (rad)")
    return ax
