"""The lines that several figures share: diagonals, cobwebs, the last tenth of an orbit, and interruptions of lines."""

from typing import TYPE_CHECKING
from warnings import catch_warnings, simplefilter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import TWO_PI

if TYPE_CHECKING:
    from nsmaps.dynamics.orbit import Orbit


def diagonal(ax: Axes, low: float, high: float) -> Line2D:
    """The line on which a coordinate stays as it is."""
    (line,) = ax.plot([low, high], [low, high], color="0.25", lw=0.6, ls=(0, (5, 3)), zorder=2, label="diagonal")
    return line


def staircase(values: Floats) -> tuple[Floats, Floats]:
    """The cobweb through values (L,): corners x and y, both of shape (2 L - 1,), from the diagonal to the diagonal.

    >>> [corners.tolist() for corners in staircase(np.array([1.0, 3.0]))]
    [[1.0, 1.0, 3.0], [1.0, 3.0, 3.0]]
    """
    twice = np.repeat(values, 2)
    return twice[:-1], np.concatenate([twice[:1], twice[2:]])


def last_tenth(values: Floats) -> Floats:
    """The values from the last tenth of the steps on, two at least, in which an orbit has forgotten its start."""
    return values[-max(2, len(values) // 10 + 1) :]


def finite_states(orbit: "Orbit") -> Floats:
    """The states of one orbit before it ends, shape (m, n)."""
    states = np.asarray(orbit.states, float).reshape(len(orbit.states), -1, orbit.states.shape[-1])[:, 0]
    return states[np.isfinite(states).all(axis=1)]


def ended(orbit: "Orbit") -> bool:
    """Whether one orbit ends before the last of its returns: its last states are then of no attractor."""
    return len(finite_states(orbit)) < len(orbit.states)


def window(low: float, high: float, values: Floats, reach: float = 0.3) -> tuple[float, float]:
    """The interval, widened to the values that lie within `reach` of its length, so that a wild one spoils no picture.

    >>> window(0.0, 1.0, np.array([0.5, 1.2, 1e9]))
    (0.0, 1.2)
    """
    far = reach * (high - low)
    near = values[(values >= low - far) & (values <= high + far)]
    return float(min([low, *near])), float(max([high, *near]))


def cut(values: Floats, height: float) -> Floats:
    """A copy with NaN before each jump of more than `height`, so that a line is not drawn through a wrapped angle."""
    parted = np.array(values, float)
    with np.errstate(invalid="ignore"):
        parted[:-1][np.abs(np.diff(parted)) > height] = np.nan
    return parted


def in_one_piece(angles: Floats) -> Floats:
    """Angles in the turn that begins in the middle of their largest gap, if one is a tenth of a turn at least.

    >>> in_one_piece(np.array([0.1, 6.2, 0.3])).round(2).tolist()
    [0.1, -0.08, 0.3]
    """
    places = np.unique(np.mod(angles[np.isfinite(angles)], TWO_PI))
    if not len(places):
        return angles
    gaps = np.diff(places, append=places[0] + TWO_PI)
    widest = int(gaps.argmax())
    if gaps[widest] < 0.1 * TWO_PI:
        return angles
    begin = places[widest] + gaps[widest] / 2
    begin -= TWO_PI * (begin >= TWO_PI / 2)
    return np.asarray(np.mod(angles - begin, TWO_PI) + begin)


def jumps(values: Floats, least: float) -> NDArray[np.bool_]:
    """Which steps of lines (..., m) are jumps of more than `least`, or lead to where there is nothing, shape (..., m - 1).

    A jump is five times the median of the three steps on either side. At the end of a square root, as next to a graze, the last
    step is at most 3.2 times that of those before it. Of the others, two steps of more than half of
    `least`, one up and one down, are both jumps, as a smooth line turns in small steps and one that goes to and fro between
    sheets does not; so is such a step between two jumps.
    """
    step = np.diff(values)
    size = np.abs(step)
    ends = [(0, 0)] * (step.ndim - 1)
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(size, [*ends, (3, 3)], constant_values=np.nan), 7, axis=-1)
    jump = np.isnan(size)
    with np.errstate(invalid="ignore"), catch_warnings():
        simplefilter("ignore", RuntimeWarning)  # of a step without neighbours, which is not a jump
        wide = size > least
        jump[wide] = size[wide] > 5 * np.nanmedian(np.delete(beside[wide], 3, axis=-1), axis=-1)
        large = ~jump & (size > least / 2)
    back = large[..., 1:] & large[..., :-1] & (step[..., 1:] * step[..., :-1] < 0)
    jump |= np.pad(back, [*ends, (0, 1)]) | np.pad(back, [*ends, (1, 0)])
    around = np.pad(jump, [*ends, (1, 1)], constant_values=True)
    return np.asarray(jump | (large & around[..., 2:] & around[..., :-2]))


def neighbours(chosen: Bools) -> Bools:
    """A mask (L,) with the places next to those it keeps.

    >>> neighbours(np.array([True, False])).tolist(), neighbours(np.array([False, False, True])).tolist()
    ([True, True], [False, True, True])
    """
    return np.convolve(chosen, np.ones(3))[1:-1] > 0
