"""First returns along one coordinate while the others are held, coloured by word: fig. 2d-1phi."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.coordinates import is_angle
from nsmaps.exact.words import LONGER
from nsmaps.figures.data import SLICES, position
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import GREY, dress, family_colours, symbol

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet: a row a slice, a column a coordinate of the image."""
    found = SLICES.of(result, "slices")
    coordinates = found[0].returns.coordinates
    panels = tuple(partial(slices, result, coordinate=name, number=k) for k in range(len(found)) for name in coordinates)
    return (Sheet("slices", panels, 2, 0.75, legend=True),)


def slices(result: "StudyResult", ax: Axes, coordinate: str = "", number: int = 0) -> Axes:
    """One coordinate of the image along the coordinate that runs, in the colour of its word, with gaps where the map jumps."""
    found = SLICES.of(result, "slices")[number]
    returns = found.returns
    names = returns.coordinates
    i, along = position(names, coordinate or names[0]), position(names, found.along)
    words = returns.words
    colours = family_colours(sorted((word for word in np.unique(words).tolist() if word and LONGER not in word), key=len))
    x, y = returns.start[:, along], returns.image[:, i]
    pieces = np.split(np.arange(len(x)), np.flatnonzero(found.jump | (words[1:] != words[:-1])) + 1)
    named = set()
    for rows in pieces:
        word = str(words[rows[0]])
        mark = "." if len(rows) == 1 else ""  # a piece of one state is a point, for it has no line
        colour = colours.get(word, GREY)
        known = word in named or (colour == GREY and word in colours)  # which are counted
        ax.plot(x[rows], y[rows], color=colour, lw=1.3, marker=mark, label="_" if known else word)
        named.add(word)
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]) if not is_angle(names[i]) else 0.0)
    angles = {name for name in names if is_angle(name)}
    held = [f"{symbol(name, 'k')} = {value:.4g}{' rad' * (name in angles)}" for name, value in found.at.items()]
    ax.set_title(", ".join(held))
    if more := sum(colour == GREY for colour in colours.values()):
        ax.plot([], [], color=GREY, lw=1.3, label=f"{more} more words")
    ax.legend()
    return dress(ax, (names[along], "k"), (names[i], "k+1"))
