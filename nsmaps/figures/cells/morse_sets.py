"""The recurrent dynamics of a map in a window: the cells of its Morse sets, and orbits that approach them."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

from nsmaps.cells.grid import Cells
from nsmaps.cells.morse import MorseCover
from nsmaps.dynamics.orbit import Orbit
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREEN, MAGENTA, ORANGE, RED, SKY, YELLOW, dress, tint

_COLOURS = (BLUE, RED, GREEN, MAGENTA, ORANGE, SKY, YELLOW)
_GREY = (0.8, 0.8, 0.8)
LAST = 0.5  #: the share of an orbit, from its end, that is drawn
_AROUND = 0.04  #: of the window, around the cells that are shown
NAMED = 4  #: components with a line in the legend


def sheets(cover: MorseCover, orbits: Sequence[Orbit] | None = None) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("morse_sets", (partial(morse_sets, cover, orbits=orbits),), 1, 0.6, legend=True, share=0.8),)


def morse_sets(cover: MorseCover, ax: Axes, orbits: Sequence[Orbit] | None = None) -> Axes:
    """The cells of each component in a colour of its own, those between components grey, the exact orbits' last half as dots.

    The part of the window is shown that holds them.
    """
    count = len(cover.hulls)
    shades = [_GREY, *(tint(_COLOURS[k % len(_COLOURS)], 0.45) for k in range(count))]
    number = np.full(cover.cells.size, -1)
    number[cover.numbers] = cover.component + 1
    show(ax, cover.cells, number, shades)
    handles: list[Artist] = [Patch(color=shades[k + 1], label=_label(k, k in cover.minimal)) for k in range(min(count, NAMED))]
    if (cover.component < 0).any():
        handles.append(Patch(color=shades[0], label="between"))
    tails = [orbit.states[int(LAST * len(orbit.states)) :] for orbit in orbits or ()]
    if tails:
        handles += ax.plot(*np.concatenate(tails).T, ".", ms=1.8, color="k", mec="none", label="exact orbits")
    ax.legend(handles=handles)
    places = np.transpose(np.unravel_index(cover.numbers, cover.cells.shape)) / cover.cells.shape
    ends = np.clip([places.min(axis=0, initial=1) - _AROUND, places.max(axis=0, initial=0) + _AROUND], 0, 1)
    window = np.array(cover.cells.box)
    shown = window[:, :1] + ends.T * np.ptp(window, axis=1, keepdims=True) if len(places) else window
    ax.set(xlim=shown[0], ylim=shown[1])
    return dress(ax, (cover.cells.coordinates[0], "k"), (cover.cells.coordinates[1], "k"))


def _label(number: int, minimal: bool) -> str:
    return f"Morse set {number}{', no exit' if minimal else ''}"


def show(ax: Axes, cells: Cells, number: NDArray[np.integer], colours: Sequence[tuple[float, ...]]) -> None:
    """All cells in the colour of their number, shape (size,); negative ones are left white."""
    shown = np.ma.masked_less(number.reshape(cells.shape).T, 0)
    ends = (*cells.box[0], *cells.box[1])
    top = len(colours) - 0.5
    shades = ListedColormap(colours)
    ax.imshow(shown, shades, extent=ends, origin="lower", aspect="auto", vmin=-0.5, vmax=top, interpolation="nearest")
