"""An inset: what is small in a picture, enlarged in the corner in which least else is drawn."""

from itertools import product
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from nsmaps.arrays import Floats
from nsmaps.figures.style import HALO, SIZE

_SIDE = 0.4  #: of the picture's sides
_GAP = 0.03  #: between the inset and the frame
_FULL = 10  #: digits below or above an inset, an inch
_DIGITS = np.array([0.36, 0.16])  #: inches that numbers need beside and above an inset
_SMALL, _POINT = 0.3, 1e-3  #: of the picture, between which an attractor is enlarged: a single point stays one
_AROUND = 0.15  #: of the extent of what is enlarged, around it


def inset(ax: Axes, points: Floats, taken: Floats, above: bool = False) -> Axes | None:
    """Axes that enlarge points (N, 2), in the corner that holds the fewest of others (K, 2); None where they are not small.

    Its axes have numbers on the sides that face the middle of the picture, where a frame marks what is enlarged. The limits of
    the picture are final, but that room for it can be made `above` what is drawn.
    """
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    share = np.ptp(points, axis=0) / (high - low)
    inside = ((points >= low) & (points <= high)).all()
    if not inside or share.max() > _SMALL or share.max() < _POINT:
        return None
    if above:
        high[1] += (high[1] - low[1]) * (_SIDE + _GAP) / (1 - _SIDE - _GAP)
        ax.set_ylim(top=high[1])
    middle, half = (points.max(axis=0) + points.min(axis=0)) / 2, np.ptp(points, axis=0) / 2
    half = (1 + 2 * _AROUND) * np.maximum(half, 0.2 * (half / (high - low)).max() * (high - low))
    marked = middle + half * np.array(list(product((-1, 0, 1), repeat=2)))
    corner = _corner(ax, *((each - low) / (high - low) for each in (marked, np.concatenate([taken, points]))))
    for text in list(ax.texts):  # a name below the inset would be cut by it
        if (np.abs((np.array(text.get_position()) - low) / (high - low) - corner - _SIDE / 2) < _SIDE / 2 + 2 * _GAP).all():
            text.remove()
    inner = ax.inset_axes((*corner, _SIDE, _SIDE), zorder=20, facecolor="white")
    inner.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
    _number(inner, corner)
    ax.add_patch(Rectangle((middle - half).tolist(), *(2 * half), fill=False, label="_", ec="0.2", lw=0.5, zorder=8))
    return inner


def _corner(ax: Axes, marked: Floats, taken: Floats) -> Floats:
    """The lower left end of an inset, in shares of the picture, where it covers none of what it marks and least of all else."""
    numbers = _DIGITS * ax.figure.dpi / [ax.bbox.width, ax.bbox.height]
    corners = [np.array(corner) for corner in product((_GAP, 1 - _SIDE - _GAP), repeat=2)]
    covered = []
    for corner in corners:
        low, high = corner - _GAP - numbers * (corner > _GAP), corner + _SIDE + _GAP + numbers * (corner == _GAP)
        boxes = ((marked, corner, corner + _SIDE), (taken, low, high))
        covered.append(tuple(int(((points >= a) & (points <= b)).all(axis=1).sum()) for points, a, b in boxes))
    return corners[min(range(len(corners)), key=covered.__getitem__)]


def _number(inner: Axes, corner: Floats) -> None:
    """Two or three numbers on the axes of an inset, on the sides that face the middle of the picture."""
    for axis, place, ends in ((inner.xaxis, corner[1], ("bottom", "top")), (inner.yaxis, corner[0], ("left", "right"))):
        formatter = cast(Any, axis.get_major_formatter())
        formatter.set_useOffset(False)
        low, high = sorted(axis.get_view_interval())
        ticks = [tick for tick in MaxNLocator(3, steps=[1, 2, 5, 10]).tick_values(low, high) if low <= tick <= high]
        if axis is inner.xaxis and sum(map(len, formatter.format_ticks(ticks))) > _FULL * inner.bbox.width / inner.figure.dpi:
            ticks = ticks[:: max(len(ticks) - 1, 1)]  # the first and the last
        axis.set_ticks(ticks)
        cast(Any, axis).set_ticks_position(ends[int(place == _GAP)])
        axis.set_tick_params(labelsize=SIZE, pad=1, size=2)
    for label in (*inner.get_xticklabels(), *inner.get_yticklabels()):
        label.set_path_effects(list(HALO))
