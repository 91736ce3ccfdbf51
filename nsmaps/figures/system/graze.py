"""A graze: the motions just before, at and after it, and the square root of the map beside it."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.dynamics.portraits.graze import Graze, graze_of
from nsmaps.exact.events import Track
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import position
from nsmaps.figures.style import BLACK, BLUE, ORANGE, RED, dress, label, symbol, with_unit

if TYPE_CHECKING:
    from nsmaps.dynamics.continuation.events import BifurcationPoint
    from nsmaps.exact.systems.parameters import System

_LOOKS = ((BLUE, "-", 1.0), (BLACK, (0, (4, 2)), 0.8), (RED, "-", 1.0))  #: before, at and after the graze


def sheets(found: "Graze | Sequence[BifurcationPoint]", system: "System | None" = None) -> tuple[Sheet, ...]:
    """One sheet: the motions beside the map, or each coordinate of the map if there are none; of events, the first graze."""
    if not isinstance(found, Graze):
        assert system is not None
        found = graze_of(system, found[0])
    maps = [partial(graze, found, coordinate=name) for name in found.coordinates]
    panels = [partial(flights, found), *maps[:1]] if found.tracks else maps
    return (Sheet("graze", tuple(panels), min(len(panels), 2), 0.85, legend=True),)


def flights(found: Graze, ax: Axes) -> Axes:
    """The displacement, or the first state of a system with modes, over time on both sides of the graze and at it."""
    before, after = found.words
    names = f"before the graze, {before}", "at the graze", f"after the graze, {after}"
    for track, (colour, dashes, width), name in zip(found.tracks, _LOOKS, names, strict=True):
        value = track.displacement if isinstance(track, Track) else track.states[..., 0]
        ax.plot(track.time.ravel(), value.ravel(), color=colour, ls=dashes, lw=width, label=name)
    first = found.tracks[0]
    if isinstance(first, Track):
        for at in first.at:
            ax.axhline(at, color="0.87", lw=2.4, zorder=0)
    ax.set_xlim(0, max(track.time.max() for track in found.tracks))
    ax.set_xlabel(with_unit("time $t$", "time"))
    ax.set_ylabel(with_unit("relative displacement $Z$", "displacement") if isinstance(first, Track) else label(first.names[0]))
    ax.legend()
    return ax


def graze(found: Graze, ax: Axes, coordinate: str = "") -> Axes:
    """One coordinate of the image over the distance from the graze, and the square root with its coefficient, dashed."""
    i = position(found.coordinates, coordinate or found.coordinates[0])
    name, smooth = found.coordinates[i], found.distance < 0
    for own, colour, word in ((smooth, BLUE, found.words[0]), (~smooth, RED, found.words[1])):
        ax.plot(found.distance[own], found.image[own, i], color=colour, lw=1.6, label="_" if found.tracks else word)
    x = np.linspace(0, 1, 200) ** 2 * found.distance[-1]
    text = rf"${symbol(name)[1:-1]}^* {found.coefficient[i]:+.4g}\sqrt{{s}}$"
    low, high = ax.get_ylim()
    ax.plot(x, found.value[i] + found.coefficient[i] * np.sqrt(x), color=BLACK, ls=(0, (4, 2)), lw=0.8, label=text)
    ax.plot([0], found.value[i], "o", color=ORANGE, mec=BLACK, mew=0.5, ms=4, label="graze")
    margin = 0.1 * (high - low)
    ax.set_ylim(low - margin, high + margin)
    along = int(np.abs(found.direction).argmax())
    where = f" in {symbol(found.coordinates[along])}" if abs(found.direction[along]) > 1 - 1e-9 else ""
    ax.legend()
    dress(ax, (name, "k"), (name, "k+1"))
    ax.set_xlabel(f"distance $s$ from the graze{where}")
    return ax
