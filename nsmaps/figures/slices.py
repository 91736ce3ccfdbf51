"""First returns along one coordinate while the others are held, coloured by word: fig. 2d-1phi."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.exact.impacts import LONGER, Angle
from nsmaps.figures.needs import Drawable, position, slices_of
from nsmaps.figures.sheet import Sheet
from nsmaps.figures.style import dress, family_colours, symbol


def sheets(result: Drawable) -> tuple[Sheet, ...]:
    """One sheet: a row a slice, a column a coordinate of the image."""
    made = slices_of(result, "slices")
    coordinates = made[0].returns.coordinates
    panels = tuple(partial(slices, result, coordinate=name, number=k) for k in range(len(made)) for name in coordinates)
    return (Sheet("slices", panels, len(coordinates), (5.6, 4.0)),)


def slices(result: Drawable, ax: Axes, coordinate: str = "", number: int = 0) -> Axes:
    """One coordinate of the image along the coordinate that runs, in the colour of its word, with gaps where the map jumps."""
    made = slices_of(result, "slices")[number]
    returns = made.returns
    names = returns.coordinates
    i, along = position(names, coordinate or names[0]), position(names, made.along)
    words = returns.words
    colours = family_colours(sorted((word for word in np.unique(words).tolist() if word and LONGER not in word), key=len))
    x, y = returns.start[:, along], returns.image[:, i]
    pieces = np.split(np.arange(len(x)), np.flatnonzero(made.jump | (words[1:] != words[:-1])) + 1)
    named = set()
    for rows in pieces:
        word = str(words[rows[0]])
        mark = "." if len(rows) == 1 else ""  # a piece of one state is a point, for it has no line
        ax.plot(x[rows], y[rows], color=colours.get(word, "0.5"), lw=2.2, marker=mark, label="_" if word in named else word)
        named.add(word)
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]) if not isinstance(names[i], Angle) else 0.0)
    held = ", ".join(f"{symbol(name, 'k')} = {value:.4g}" for name, value in made.at.items())
    ax.set_title(held)
    ax.legend(loc="lower right", bbox_to_anchor=(1.02, 1.0), ncols=4, frameon=False, handlelength=1.4, columnspacing=1.0)
    return dress(ax, (names[along], "k"), (names[i], "k+1"))
