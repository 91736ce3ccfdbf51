"""Auxiliary maps sampled on grids: of any map, and no bound."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats
from nsmaps.auxiliary.envelope import AnyMap, Envelope, Extremes, family, image_function
from nsmaps.coordinates import Coordinates, WithCoordinates

Function = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Sampled(WithCoordinates):
    """The auxiliary maps of a map on a box, shape (n, 2), on grids of `samples` points an axis, its ends included."""

    coordinates: Coordinates
    box: Floats
    function: Function
    samples: int
    grid: tuple[Envelope, ...] = field(repr=False)
    status: str = "sampled"
    same: float = 1e-12

    @classmethod
    def of(cls, map: AnyMap, box: Floats, samples: int) -> "Sampled":
        """From one grid over the box."""
        function = image_function(map, box)
        axes = [np.linspace(low, high, samples) for low, high in box]
        images = _images(function, axes)
        curves = [
            Envelope(name, axes[i], *_over_others(images[..., i], i), *family(function, i, axes[i], box))
            for i, name in enumerate(map.coordinates)
        ]
        return cls(Coordinates(map.coordinates), box, function, samples, tuple(curves))

    def curves(self, index: int, x: ArrayLike) -> tuple[Floats, Floats]:
        """See AuxiliaryMaps."""
        return extremes(self.function, index, x, self.box, self.samples)

    @classmethod
    def at(cls, maps: Sequence[Self], states: Floats, side: int) -> Floats:
        """See AuxiliaryMaps."""
        return np.array([[curves[side][0] for curves in map._each(x[:, None])] for map, x in zip(maps, states, strict=True)])

    def worst(self, intervals: Floats, known: Extremes | None = None) -> Extremes:
        """See AuxiliaryMaps: an interval's own ends are evaluated, what lies between them is read off the grid."""
        found = []
        for e, interval, (lower, upper) in zip(self.grid, intervals, self._each(intervals), strict=True):
            between = (e.x > interval[0]) & (e.x < interval[1])
            least, at_least = _peak(e.x, -e.lower, between, interval, -lower)
            found.append(((-least, at_least), _peak(e.x, e.upper, between, interval, upper)))
        values, at = np.moveaxis(np.array(found), 2, 0)
        return Extremes(values, np.repeat(at[..., None], 2, axis=2))

    def envelopes(self) -> tuple[Envelope, ...]:
        """See AuxiliaryMaps."""
        return self.grid

    def _each(self, values: Floats) -> list[tuple[Floats, Floats]]:
        """The lower and upper map of every coordinate at some of its values, shape (n, m), in one call of the map."""
        axes = [np.linspace(low, high, self.samples) for low, high in self.box]
        grids = [_states([*axes[:k], x, *axes[k + 1 :]]) for k, x in enumerate(values)]
        images = self.function(np.concatenate(grids)).reshape(len(values), -1, len(values))
        shapes = [[self.samples] * k + [len(x)] + [self.samples] * (len(values) - k - 1) for k, x in enumerate(values)]
        return [_over_others(image[:, k].reshape(shape), k) for k, (image, shape) in enumerate(zip(images, shapes, strict=True))]


def extremes(function: Callable[[Floats], Floats], index: int, x: ArrayLike, box: Floats, samples: int) -> tuple[Floats, Floats]:
    """The least and largest image of coordinate `index` at each of its values x, shape (m,), over a grid of the others.

    The grid has `samples` points along every other coordinate of the box, shape (n, 2), its ends included; an extreme inside
    the grid is taken at the vertex of the parabola through its neighbours, which leaves an error of fourth order in the spacing.
    """
    axes = [np.linspace(low, high, samples) for low, high in box]
    axes[index] = np.asarray(x, float)
    return _over_others(_images(function, axes)[..., index], index)


def _images(function: Callable[[Floats], Floats], axes: list[Floats]) -> Floats:
    """The images of a tensor grid, shape (len of each axis, n)."""
    return function(_states(axes)).reshape(*(len(axis) for axis in axes), len(axes))


def _states(axes: list[Floats]) -> Floats:
    """The states of a tensor grid, row after row."""
    return np.column_stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")])


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


def _peak(x: Floats, curve: Floats, between: Bools, interval: Floats, ends: Floats) -> tuple[float, float]:
    """The maximum of a sampled curve over the samples in `between` and the interval's two ends, and where it is."""
    if not np.isfinite(curve).all() or not np.isfinite(ends).all():
        return np.nan, np.nan
    best, at = float(ends.max()), float(interval[int(ends.argmax())])
    if between.any():
        k = int(np.argmax(np.where(between, curve, -np.inf)))
        inner = 0 < k < len(curve) - 1 and between[k - 1] and between[k + 1]
        gain = float(vertex_gain(curve[k - 1], curve[k], curve[k + 1])) if inner else 0.0
        if curve[k] + gain > best:
            best, at = float(curve[k]) + gain, float(x[k])
    return best, at
