"""First returns along one coordinate while the others are held, coloured by word: fig. 2d-1phi."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from nsmaps.coordinates import is_angle
from nsmaps.exact.surfaces.slice import Slice
from nsmaps.exact.words import LONGER
from nsmaps.figures.lines import diagonal
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import position
from nsmaps.figures.style import GREY, dress, family_colours, symbol

_ENDS: dict[str, Any] = {"solid_capstyle": "butt", "solid_joinstyle": "bevel"}  #: of lines, which keep within their images
_THICK = (4.2, 1.2)  #: points, of the lines of words that lie over one another, the first and the last


def sheets(found: Slice | Sequence[Slice]) -> tuple[Sheet, ...]:
    """One sheet: of each slice the phase plane of every coordinate, then images of those held over the coordinate that runs."""
    panels: list[Any] = []
    every = [found] if isinstance(found, Slice) else found
    for each in every:
        names, titled = each.coordinates, len(every) > 1
        panels += [partial(slices, each, coordinate=name, titled=titled) for name in names]
        panels += [partial(slices, each, coordinate=name, over=each.along, titled=titled) for name in names if name != each.along]
    title = _held(every[0]) if len(every) == 1 else ""
    return (Sheet("slices", tuple(panels), min(len(panels), 3), 1.1, title=title, legend=True),)


def slices(found: Slice, ax: Axes, coordinate: str = "", over: str = "", titled: bool = True) -> Axes:
    """One coordinate of the image in the colour of its word, with gaps where the map jumps, over the same or another coordinate.

    In the phase plane of a coordinate that is held all images stand over one value, words with few impacts on thin lines
    over those with more.
    """
    names = found.coordinates
    i = position(names, coordinate or names[0])
    below = position(names, over or names[i])
    _draw(ax, found, below, i)
    x, y = found.returns.start[:, below], found.returns.image[:, i]
    if below == i:
        ends = np.nanmin([*x, *y]), np.nanmax([*x, *y])
        diagonal(ax, *((x[0], x[-1]) if names[i] == found.along else ends))
    if np.ptp(x):
        ax.set_xlim(x[0], x[-1])
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]) if not is_angle(names[i]) else 0.0)
    if titled:
        ax.set_title(_held(found))
    ax.legend()
    return dress(ax, (names[below], "k"), (names[i], "k+1"))


def _held(found: Slice) -> str:
    """The values at which the other coordinates are held."""
    angles = {name for name in found.coordinates if is_angle(name)}
    return ", ".join(f"{symbol(name, 'k')} = {value:.4g}{' rad' * (name in angles)}" for name, value in found.at.items())


def _draw(ax: Axes, found: Slice, below: int, i: int) -> None:
    """The pieces between jumps and changes of the word: coordinate i of the image over coordinate `below` of the start."""
    returns = found.returns
    words = returns.words
    colours = family_colours(sorted((word for word in np.unique(words).tolist() if word and LONGER not in word), key=len))
    x, y = returns.start[:, below], returns.image[:, i]
    stands = not np.ptp(x)
    pieces = np.split(np.arange(len(x)), np.flatnonzero(found.jump | (words[1:] != words[:-1])) + 1)
    named = set()
    for rows in pieces:
        word = str(words[rows[0]])
        mark = "." if len(rows) == 1 else ""  # a piece of one state is a point, for it has no line
        colour = colours.get(word, GREY)
        known = word in named or (colour == GREY and word in colours)  # which are counted
        place = list(colours).index(word) / max(len(colours) - 1, 1) if stands and word in colours else 0.0
        width = float(np.interp(place, (0, 1), _THICK[::-1])) if stands else 1.3
        ax.plot(x[rows], y[rows], color=colour, marker=mark, label="_" if known else word, lw=width, zorder=3 - place, **_ENDS)
        named.add(word)
    if more := sum(colour == GREY for colour in colours.values()):
        ax.plot([], [], color=GREY, lw=1.3, label=f"{more} more words")
