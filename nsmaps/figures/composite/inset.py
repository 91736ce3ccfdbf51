"""An inset: what is small in a picture, enlarged in the corner in which least else is drawn."""

from itertools import product

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats

_SIDE = 0.4  #: of the picture's sides
_GAP = 0.03  #: between the inset and the frame
_SMALL, _POINT = 0.3, 1e-3  #: of the picture, between which an attractor is enlarged: a single point stays one
_AROUND = 0.15  #: of the extent of what is enlarged, around it


def inset(ax: Axes, points: Floats, taken: Floats, above: bool = False) -> Axes | None:
    """Axes that enlarge points (N, 2), in the corner that holds the fewest of others (K, 2); None where they are not small.

    The limits of the picture are final, but that room for it can be made `above` what is drawn.
    """
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    share = np.ptp(points, axis=0) / (high - low)
    inside = ((points >= low) & (points <= high)).all()
    if not inside or share.max() > _SMALL or share.max() < _POINT:
        return None
    if above:
        high[1] += (high[1] - low[1]) * (_SIDE + _GAP) / (1 - _SIDE - _GAP)
        ax.set_ylim(top=high[1])
    where = (np.concatenate([taken, points]) - low) / (high - low)
    reach = _SIDE + 2 * _GAP
    corners = [np.array(corner) for corner in product((_GAP, 1 - _SIDE - _GAP), repeat=2)]
    busy = [int(((where >= corner - _GAP) & (where <= corner - _GAP + reach)).all(axis=1).sum()) for corner in corners]
    corner = corners[int(np.argmin(busy))]
    for text in list(ax.texts):  # a name below the inset would be cut by it
        if (np.abs((np.array(text.get_position()) - low) / (high - low) - corner - _SIDE / 2) < _SIDE / 2 + 2 * _GAP).all():
            text.remove()
    inner = ax.inset_axes((*corner, _SIDE, _SIDE), zorder=20)
    middle, half = (points.max(axis=0) + points.min(axis=0)) / 2, np.ptp(points, axis=0) / 2
    half = (1 + 2 * _AROUND) * np.maximum(half, 0.2 * (half / (high - low)).max() * (high - low))
    inner.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
    inner.set(xticks=[], yticks=[], facecolor="white")
    ax.indicate_inset((*(middle - half), *(2 * half)), inner, edgecolor="0.2", lw=0.5, alpha=1, zorder=8)
    return inner
