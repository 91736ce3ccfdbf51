"""The auxiliary maps of one coordinate: the largest and smallest image over the others, eq. auxv and auxphi."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.exact.impacts import TWO_PI, Floats, angle_mask, nearest_turn


class PlainMap(Protocol):
    """A map given by a formula, such as a PolyMap: states (N, n) to images (N, n), angles not wrapped."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the n coordinates."""

    def __call__(self, states: Floats) -> Floats:
        """Images of states of shape (N, n)."""


AnyMap = ReturnMap | PlainMap


def image_function(map: AnyMap, box: Floats) -> Callable[[Floats], Floats]:
    """The map as a function of states (N, n) whose angles come out on the turn nearest to the box's centre, shape (n, 2)."""
    angles = angle_mask(map.coordinates)
    centre = box.mean(axis=1)
    if isinstance(map, ReturnMap):
        exact = map

        def of_returns(states: Floats) -> Floats:
            image = exact.first_return(states).image
            return np.where(angles, nearest_turn(image, centre), image)

        return of_returns
    plain = map
    shift = plain(centre[None, :])[0] - centre
    turns = np.where(angles, TWO_PI * np.round(shift / TWO_PI), 0.0)  # one for all, so that the formula stays continuous
    return lambda states: plain(states) - turns


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """The auxiliary maps of one coordinate: for each of its values the extreme images over all others in the box.

    Sampled: the extremes are those of a grid that includes the box's ends.
    """

    coordinate: str
    x: Floats  #: shape (m,), values of the coordinate, both ends of its interval included
    lower: Floats  #: shape (m,), xi_L or eta_L
    upper: Floats  #: shape (m,), xi_U or eta_U


def extremes(function: Callable[[Floats], Floats], index: int, x: ArrayLike, box: Floats, samples: int) -> tuple[Floats, Floats]:
    """The least and largest image of coordinate `index` at each of its values x, shape (m,), over a grid of the others.

    The grid has `samples` points along every other coordinate of the box, shape (n, 2), its ends included; an extreme inside
    the grid is taken at the vertex of the parabola through its neighbours, which leaves an error of fourth order in the spacing.
    """
    axes = [np.linspace(low, high, samples) for low, high in box]
    axes[index] = np.asarray(x, float)
    return _over_others(_images(function, axes)[..., index], index)


def envelopes(map: AnyMap, box: ArrayLike, samples: int = 201) -> tuple[Envelope, ...]:
    """The auxiliary maps of every coordinate on a box, shape (n, 2), from one grid of `samples` points an axis."""
    array = np.asarray(box, float)
    axes = [np.linspace(low, high, samples) for low, high in array]
    images = _images(image_function(map, array), axes)
    names = map.coordinates
    return tuple(Envelope(name, axes[i], *_over_others(images[..., i], i)) for i, name in enumerate(names))


def _images(function: Callable[[Floats], Floats], axes: list[Floats]) -> Floats:
    """The images of a tensor grid, shape (len of each axis, n)."""
    states = np.column_stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")])
    return function(states).reshape(*(len(axis) for axis in axes), len(axes))


def _over_others(values: Floats, index: int) -> tuple[Floats, Floats]:
    """The least and largest of the values on a grid over all axes but one."""
    rows = np.moveaxis(values, index, 0)
    return -_maximum(-rows), _maximum(rows)


def _maximum(grid: Floats) -> Floats:
    """The maximum over all axes but the first, shape (m,), between grid points too: the vertex along each axis."""
    values = grid.reshape(len(grid), -1)
    rows = np.arange(len(values))
    best = np.argmax(values, axis=1)  # of a row with NaN, the NaN
    top = values[rows, best]
    total = top.copy()
    stride = 1
    for points in reversed(grid.shape[1:]):
        place = best // stride % points
        step = np.where((place > 0) & (place < points - 1), stride, 0)
        total += vertex_gain(values[rows, best - step], top, values[rows, best + step])
        stride *= points
    return total


def vertex_gain(before: Floats, top: Floats, after: Floats) -> Floats:
    """By how much the vertex of the parabola through three equidistant values exceeds the middle one, the largest."""
    bend = 2 * top - before - after
    return (after - before) ** 2 / (8 * np.where(bend > 0, bend, np.inf))
