"""The Poincare section of an attractor: its states one by one, or their density where they are many, with a part enlarged."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm

from nsmaps.arrays import Floats
from nsmaps.coordinates import is_angle
from nsmaps.dynamics.motion import MEANING, kind_of
from nsmaps.errors import NsmapsError
from nsmaps.figures.composite.inset import inset
from nsmaps.figures.lines import in_one_piece
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, SKY, dress

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.attractor import Attractor
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.portraits.portrait import PhasePortrait

    Found = Attractor | LimitSet

Window = tuple[tuple[float, float], tuple[float, float]]  #: an interval of each coordinate
MANY = 500  #: states, from which their density is drawn
PIXEL = 1 / 100  #: inches, the side of a cell in which states are counted
PARTS = 8  #: of each side of the picture, of which one is enlarged
_SHADES = LinearSegmentedColormap.from_list("density", ["#8FA9BF", "#1F3A5F", BLACK])
_MARGIN = 0.06


def sheets(found: "Found | Callable[[], PhasePortrait]", zoom: Window | None = None) -> tuple[Sheet, ...]:
    """One sheet, a panel an attractor, of one or of all of a portrait, which is then computed."""
    several = found().attractors if callable(found) else (found,)
    panels = tuple(partial(poincare, each, zoom=zoom) for each in several)
    return (Sheet("poincare", panels, min(len(panels), 2), 0.85, share=1.0 if len(panels) > 1 else 0.75),)


def poincare(found: "Found", ax: Axes, plane: tuple[int, int] = (0, 1), zoom: Window | None = None) -> Axes:
    """The states of an attractor in the plane of two coordinates: dots, or shades by the logarithm of their density.

    Of a map of one coordinate each state stands over the one before.

    Of very many states the window in which most lie, an eighth of each side, is enlarged, or the one that is given.
    """
    names, steps = found.coordinates, ("k", "k")
    shown = found.states[:, plane] if len(names) > 1 else np.column_stack([found.states, np.roll(found.states, -1)])[:-1]
    if len(names) == 1:
        plane, steps = (0, 0), ("k", "k+1")
    angles = [is_angle(names[k]) for k in plane]
    shown = np.column_stack([in_one_piece(part) if angle else part for part, angle in zip(shown.T, angles, strict=True)])
    if not len(shown):
        raise NsmapsError("the attractor has no states to show; expected: two or more of a map of one coordinate")
    low, high = shown.min(axis=0), shown.max(axis=0)
    margin = np.where(high > low, _MARGIN * (high - low), 0.05 * np.abs(high) + 1e-12)
    ax.set(xlim=(low[0] - margin[0], high[0] + margin[0]), ylim=(low[1] - margin[1], high[1] + margin[1]))
    _states(ax, shown)
    if len(shown) > MANY:
        corners = np.array(zoom, float).T if zoom else _densest(shown, low, high)
        inset(ax, corners, partial(_states, shown=shown), beside=shown[:: max(len(shown) // 5000, 1)])
    ax.set_title(name_of(found))
    return dress(ax, (names[plane[0]], steps[0]), (names[plane[1]], steps[1]))


def name_of(found: "Found") -> str:
    """The name of the motion, or what it is without a period, such as chaos."""
    return found.label if found.period else MEANING.get(kind_of(found.label), found.label)


def _states(ax: Axes, shown: Floats) -> None:
    """States (N, 2) within the limits of the Axes, which stay."""
    x, y = ax.get_xlim(), ax.get_ylim()
    if len(shown) <= MANY:
        ax.plot(*shown.T, "o", mfc=SKY, mec=BLACK, mew=0.6, ms=4.5 if len(shown) < MANY / 10 else 2.5)
    else:
        cells = [int(side / ax.figure.dpi / PIXEL) + 1 for side in (ax.bbox.width, ax.bbox.height)]
        counts = np.histogram2d(*shown.T, cells, [x, y])[0].T  # type: ignore[call-overload]
        norm = LogNorm(1, max(2.0, float(np.quantile(counts[counts > 0], 0.99)))) if counts.any() else None
        ax.imshow(
            np.ma.masked_equal(counts, 0), _SHADES, norm, extent=(*x, *y), origin="lower", aspect="auto", interpolation="nearest"
        )
    ax.set(xlim=x, ylim=y)


def _densest(shown: Floats, low: Floats, high: Floats) -> Floats:
    """The lower and upper corner of what lies in the window with the most states, shape (2, 2)."""
    counts = np.histogram2d(*shown.T, PARTS, np.column_stack([low, high]))[0]  # type: ignore[call-overload]
    corner = low + (high - low) * np.unravel_index(int(counts.argmax()), counts.shape) / PARTS
    own = shown[((shown >= corner) & (shown <= corner + (high - low) / PARTS)).all(axis=1)]
    return np.stack([own.min(axis=0), own.max(axis=0)])
