"""States over a parameter as an image: dark where many lie."""

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgb

from nsmaps.arrays import Floats, Ints

ROWS = 400  #: of a raster
MOST = 4096  #: columns of a raster, where values are not equidistant
_REACH = 1  #: rows on either side to which a state belongs: lines of half a point
_FAINTEST = 0.55  #: opacity of a place that one state of an orbit visits


def raster(
    values: Floats, states: Floats, groups: Ints, colours: Sequence[str], ends: tuple[float, float]
) -> tuple[Floats, tuple[float, float]]:
    """One coordinate of states as an image on white (ROWS, columns, 3), the lowest row first, and its left and right end.

    A column has the orbits at the value next to its middle: all V values, where they are equidistant. Opacity grows with the
    logarithm of the share of an orbit's states that lie within a row of a place, and is full where all of them do.

    Args:
        values: of the parameter, shape (V,).
        states: shape (V, S, K); NaN is not drawn.
        groups: the index of the colour of each state, of the same shape.
        colours: one a group.
        ends: the least and the greatest state in the image.
    """
    near, beside = _columns(values)
    along, groups = states[near], groups[near]
    with np.errstate(invalid="ignore"):
        places = (along - ends[0]) / (ends[1] - ends[0]) * (ROWS - 1)
        shown = (places > -0.5) & (places < ROWS - 0.5)
    column = np.broadcast_to(np.arange(len(near))[:, None, None], along.shape)[shown]
    cells, groups = np.rint(places[shown]).astype(np.int64) * len(near) + column, groups[shown]
    layers, total = np.zeros((ROWS, len(near), 3)), np.zeros((ROWS, len(near)))
    for group in np.unique(groups).tolist():
        count = np.bincount(cells[groups == group], minlength=total.size).reshape(total.shape)
        rows = np.pad(count, ((_REACH, _REACH), (0, 0)))
        wide = np.lib.stride_tricks.sliding_window_view(rows, 2 * _REACH + 1, axis=0).sum(axis=-1)
        layers += wide[..., None] * np.array(to_rgb(colours[group]))
        total += wide
    kept, seen = states.shape[2], np.maximum(total, 1)
    share = np.clip(1 + np.log(seen / kept) / np.log(max(kept, 2)), 0, 1)
    opacity = np.where(total > 0, _FAINTEST + (1 - _FAINTEST) * share, 0.0)[..., None]
    return np.asarray(1 - opacity * (1 - layers / seen[..., None])), beside


def _columns(values: Floats) -> tuple[Ints, tuple[float, float]]:
    """The index of the value that each column of a raster shows, and the left and right end of all columns."""
    order = np.argsort(values, kind="stable")
    along, steps = values[order], np.diff(np.unique(values))
    if not len(steps):
        return order[:1], (float(along[0]) - 0.5, float(along[0]) + 0.5)
    equal = np.allclose(steps, steps[0], rtol=1e-6) and len(steps) + 1 == len(values)
    count = len(values) if equal else int(min(max(np.ptp(values) / steps.min() + 1, len(values)), MOST))
    middles, half = np.linspace(along[0], along[-1], count), np.ptp(values) / (count - 1) / 2
    return order[np.searchsorted((along[1:] + along[:-1]) / 2, middles)], (along[0] - half, along[-1] + half)
