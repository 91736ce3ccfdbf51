"""An inset: what is small in a picture, enlarged at the place where least else is drawn."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from nsmaps.arrays import Floats
from nsmaps.figures.style import SIZE

_SIDES = (0.4, 0.32)  #: of the picture's sides
_GAP = 0.03  #: around the inset and its numbers
_PLACES = 7  #: along each side of the picture, where it may stand
_DIGIT, _LINE = 0.07, 0.16  #: inches, the width of a digit of the numbers beside an inset, and the height of those below it
_LEAST = 0.85  #: share of its width and height that a panel has at least when all around it has its place
_END = 0.1  #: of the inset's sides, at whose ends there are no numbers
_SMALL, _POINT = 0.3, 1e-3  #: of the picture, between which an attractor is enlarged: a single point stays one
_STEP, _MOST = 0.02, 50  #: of the picture, between points along a line, and how many of them a step of it has at most
_AROUND = 0.15  #: of the extent of what is enlarged, around it


def inset(
    ax: Axes,
    points: Floats,
    draw: Callable[[Axes], object],
    above: bool = False,
    free: bool = False,
    beside: Floats | None = None,
) -> Axes | None:
    """Axes that enlarge points (N, 2), where they hide the least of them and of all lines; None where the points are not small.

    Others (K, 2) `beside` them are not to be hidden either. Its content is what `draw` draws, its numbers stand on white, and a
    frame in the picture marks what is enlarged. The limits of the picture are final, but that room for it can be made `above`
    what is drawn. One that must be `free` hides nothing, or there is none.
    """
    extent = _extent(ax, points, above)
    if extent is None:
        return None
    (middle, half), (low, high) = extent, np.transpose([ax.get_xlim(), ax.get_ylim()])
    low_end, high_end = middle - half, middle + half
    scale = _SIDES[-1] * _LEAST * np.array(ax.bbox.size) / ax.figure.dpi / (high_end - low_end)
    x, y = (_numbers(*ends) for ends in zip(low_end, high_end, strict=True))
    x, y = _spaced(x, scale[0], _DIGIT * (1 + max(map(len, x), default=0))), _spaced(y, scale[1], _LINE)
    room = np.array([_DIGIT * max(map(len, y), default=0), _LINE]) * ax.figure.dpi / ax.bbox.size
    marked = middle + half * np.array(list(product((-1, 0, 1), repeat=2)))
    others = np.concatenate([*_drawn(ax), points, *([] if beside is None else [beside])])
    side, corner, hidden = _place(room, (marked - low) / (high - low), (others - low) / (high - low))
    if free and hidden:
        return None
    _remove_names(ax, corner, side)
    inner = ax.inset_axes((*corner, side, side), zorder=20, facecolor="white")
    limits = {"xlim": (low_end[0], high_end[0]), "ylim": (low_end[1], high_end[1])}
    inner.set(**limits)
    draw(inner)
    if (legend := inner.get_legend()) is not None:
        legend.remove()
    inner.set(xlabel="", ylabel="", title="", **limits)
    inner.set_xticks([*x.values()], [*x])
    inner.set_yticks([*y.values()], [*y])
    inner.tick_params(labelsize=SIZE, pad=1, size=2)
    paper: dict[str, Any] = {"transform": ax.transAxes, "fc": "white", "ec": "0.7", "lw": 0.4, "zorder": 19, "label": "_"}
    ax.add_artist(Rectangle((corner - room).tolist(), *(room + side + _GAP / 2), **paper))
    ax.add_patch(Rectangle(low_end.tolist(), *(2 * half), fill=False, label="_", ec="0.2", lw=0.5, zorder=8))
    return inner


def _extent(ax: Axes, points: Floats, above: bool) -> tuple[Floats, Floats] | None:
    """The middle of what is enlarged, and half its sides; None where the points are not small. Room may be made `above`."""
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    share = np.ptp(points, axis=0) / (high - low)
    inside = ((points >= low) & (points <= high)).all()
    if not inside or share.max() > _SMALL or share.max() < _POINT:
        return None
    if above:
        high[1] += (high[1] - low[1]) * (_SIDES[0] + _GAP) / (1 - _SIDES[0] - _GAP)
        ax.set_ylim(top=high[1])
    middle, half = (points.max(axis=0) + points.min(axis=0)) / 2, np.ptp(points, axis=0) / 2
    return middle, (1 + 2 * _AROUND) * np.maximum(half, 0.2 * (half / (high - low)).max() * (high - low))


def _remove_names(ax: Axes, corner: Floats, side: float) -> None:
    """Remove the names in a picture that an inset with this lower left end would cut."""
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    for text in list(ax.texts):
        if (np.abs((np.array(text.get_position()) - low) / (high - low) - corner - side / 2) < side / 2 + 2 * _GAP).all():
            text.remove()


def _drawn(ax: Axes) -> Iterator[Floats]:
    """Points along the lines of a picture, and its markers, each several times."""
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    for line in ax.lines:
        if line.get_transform() == ax.transData:
            points = np.column_stack(line.get_data())
            steps = np.abs(np.diff(points, axis=0) / (high - low)).max(axis=1, initial=0.0)
            shares = np.linspace(0, 1, int(np.clip(np.nanmax(steps, initial=0.0) / _STEP, 1, _MOST)), endpoint=False)
            joined = points[:-1, None] + shares[:, None] * np.diff(points, axis=0)[:, None]
            yield np.repeat(points, 5, axis=0) if line.get_linestyle() == "None" else joined.reshape(-1, 2)


def _place(room: Floats, marked: Floats, taken: Floats) -> tuple[float, Floats, int]:
    """The side of an inset, its lower left end, in shares of the picture, and how many points it hides: least of what it marks.

    `room` is what its numbers take on the left and below. Of equal places the largest nearest to a corner is chosen.
    """
    found = []
    for side, *shares in product(_SIDES, *[np.linspace(0, 1, _PLACES)] * 2):
        corner = _GAP + room + np.array(shares) * (1 - 2 * _GAP - room - side)
        low, high = corner - room - _GAP / 2, corner + side + _GAP / 2
        hidden = [int(((points >= low) & (points <= high)).all(axis=1).sum()) for points in (marked, taken)]
        found.append((*hidden, -side, sum(min(share, 1 - share) for share in shares), corner.tolist()))
    marks, points, less, _, place = min(found)
    return -less, np.array(place), marks + points


def _numbers(low: float, high: float) -> dict[str, float]:
    """Two or three round numbers between the ends of an axis, by how they are written."""
    ticks = MaxNLocator(3, steps=[1, 2, 5, 10]).tick_values(low, high)
    decimals = max(0, -int(np.floor(np.log10(ticks[1] - ticks[0]) + 1e-9)))
    inside = [[tick for tick in ticks if low + end <= tick <= high - end] for end in (_END * (high - low), 0.0)]
    return {f"{tick:.{decimals}f}": float(tick) for tick in (inside[0] if len(inside[0]) > 1 else inside[1])}


def _spaced(numbers: dict[str, float], scale: float, room: float) -> dict[str, float]:
    """All numbers if each has room, in inches, on an axis of this scale; else the first and the last, or the first alone."""
    listed = [*numbers.items()]
    for step in range(1, len(listed)):
        if (len(listed) - 1) % step == 0 and scale * step * (listed[1][1] - listed[0][1]) >= room:
            return dict(listed[::step])
    return dict(listed[:1])
