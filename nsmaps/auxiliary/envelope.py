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

    The grid has `samples` points along every other coordinate of the box, shape (n, 2), its ends included; an extreme inside the
    grid is taken at the vertex of the parabola through its neighbours, which leaves an error of fourth order in the spacing.
    """
    x = np.asarray(x, float)
    others = [np.linspace(low, high, samples) for k, (low, high) in enumerate(box) if k != index]
    axes = [*others[:index], x, *others[index:]]
    states = np.column_stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])
    shape = tuple(len(axis) for axis in axes)
    images = np.moveaxis(function(states)[:, index].reshape(shape), index, 0).reshape(len(x), -1)
    return -_maximum(-images, samples), _maximum(images, samples)


def _maximum(values: Floats, samples: int) -> Floats:
    """The maximum of each row, shape (m,), of values on a flattened grid with `samples` points an axis, between points too."""
    best = np.argmax(np.where(np.isnan(values), np.inf, values), axis=1)[:, None]
    top = np.take_along_axis(values, best, axis=1)
    total = top.copy()
    stride = values.shape[1] // samples
    while stride >= 1:
        inner = (best // stride % samples > 0) & (best // stride % samples < samples - 1)
        before = np.take_along_axis(values, np.where(inner, best - stride, best), axis=1)
        after = np.take_along_axis(values, np.where(inner, best + stride, best), axis=1)
        total += vertex_gain(before, top, after)
        stride //= samples
    return total[:, 0]


def vertex_gain(before: Floats, top: Floats, after: Floats) -> Floats:
    """By how much the vertex of the parabola through three equidistant values exceeds the middle one, the largest."""
    bend = 2 * top - before - after
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = (after - before) ** 2 / (8 * bend)
    return np.where(bend > 0, gain, 0.0)


def envelope(map: AnyMap, box: ArrayLike, coordinate: int | str, samples: int = 201) -> Envelope:
    """The auxiliary maps of one coordinate of a map on a box, shape (n, 2), sampled on a grid of `samples` points an axis."""
    array = np.asarray(box, float)
    index = coordinate if isinstance(coordinate, int) else map.coordinates.index(coordinate)
    x = np.linspace(array[index, 0], array[index, 1], samples)
    return Envelope(map.coordinates[index], x, *extremes(image_function(map, array), index, x, array, samples))
