"""The pieces of the composite map by name, as areas of the state space: fig. regions, panel (b)."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.figures.composite.areas import colours_over, finer, paint_pieces, pieces_on
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import REST, dress, fill_of, piece_label
from nsmaps.reduced.composite.composite import CompositeMap

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.limit_set import OrbitPair


def sheets(composite: CompositeMap, grid: Grid | None = None, orbits: "Sequence[OrbitPair]" = ()) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("regions", (partial(regions, composite, grid=grid, orbits=orbits),), 1, 0.66, legend=True),)


def regions(
    composite: CompositeMap, ax: Axes, grid: Grid | None = None, orbits: "Sequence[OrbitPair]" = (), shares: bool = True
) -> Axes:
    """Each state in the colour of the first piece that holds it (eq. compositemapM), lines between pieces.

    The window is that of the grid, or else holds the data of all fits. The legend has the words of the pieces, their shares of
    the window, if they are to be shown, and that of what is in no piece. Of many pieces those have a colour in which the orbits
    end.
    """
    grid = finer(grid or window_of(composite))
    colours = colours_over(composite, grid, orbits)
    paint_pieces(ax, composite, colours, grid)
    number = pieces_on(composite, grid)
    handles = []
    for k, (piece, colour) in enumerate(zip(composite.pieces, colours, strict=True)):
        own = number == k
        if not shares or not own.any() or colour == REST:
            continue
        text = f"{piece_label(piece.name)}{f', {piece.word}' if piece.word else ''}: {100 * own.mean():.3g} %"
        handles.append(Patch(fc=fill_of(colour), ec="0.25", lw=0.5, label=text))
    resets = np.isin(number, [k for k, colour in enumerate(colours) if colour == REST])
    if shares and resets.any():
        text = f"{len(np.unique(number[resets]))} more: {100 * resets.mean():.3g} %"
        handles.append(Patch(fc=REST, ec="0.25", lw=0.5, label=text))
    if np.any(number < 0):
        handles.append(Patch(fc="none", ec="0.6", hatch="////", lw=0, label=f"in no piece: {100 * np.mean(number < 0):.3g} %"))
    if handles:
        ax.legend(handles=handles)
    return dress(ax, (composite.coordinates[0], "k"), (composite.coordinates[1], "k"))


def window_of(composite: CompositeMap) -> Grid:
    """A grid over the smallest box that holds the data of all fits."""
    boxes = np.array([piece.map.domain for piece in composite.pieces if np.isfinite(piece.map.domain).all()])
    if len(composite.coordinates) != 2 or not len(boxes):
        raise NsmapsError(
            "the regions of a map of other than two coordinates, or without a fit, have no picture; expected: a `grid`"
        )
    ends = zip(boxes[:, :, 0].min(axis=0).tolist(), boxes[:, :, 1].max(axis=0).tolist(), strict=True)
    return Grid(
        axes={name: Axis(low=low, high=high, points=2) for name, (low, high) in zip(composite.coordinates, ends, strict=True)}
    )
