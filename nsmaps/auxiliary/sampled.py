"""Auxiliary maps sampled on grids: of any map, and no bound. Every extreme is a value that the map takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.auxiliary.envelope import AnyMap, Envelope, Extremes, family, image_function
from nsmaps.coordinates import Coordinates, WithCoordinates

Function = Callable[[Floats], Floats]

ZOOMS, FINER = 5, 17  #: how often the best of samples is sought on a finer grid between its neighbours, and the points of that
SHARES = np.linspace(0, 1, FINER)
AT_MOST = 10_000  #: points, nearly, of a grid over the other coordinates: 100 along each of two, 22 along each of three
SIGNS = np.array([-1.0, 1.0])  #: by which images are multiplied, so that the lower map is a maximum too


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
    peaks: dict[tuple[int, int, int], tuple[float, float]] = field(default_factory=dict, repr=False)  #: those sought

    @classmethod
    def of(cls, return_map: AnyMap, box: Floats, samples: int) -> "Sampled":
        """From grids over the box."""
        function, n, curves = image_function(return_map, box), len(box), []
        axes = np.linspace(box[:, 0], box[:, 1], samples, axis=-1)
        values = None
        if n == 2 and samples <= AT_MOST:  # one grid serves both coordinates
            grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
            values = function(grid.reshape(-1, n)).reshape(grid.shape)
        for i, (name, x) in enumerate(zip(return_map.coordinates, axes, strict=True)):
            known = None if values is None else np.moveaxis(values[..., i], i, 0)
            lower, upper = extremes(function, i, x, box, samples, known)
            curves.append(Envelope(name, x, lower, upper, *family(function, i, x, box)))
        return cls(Coordinates(return_map.coordinates), box, function, samples, tuple(curves))

    def curves(self, index: int, x: ArrayLike) -> tuple[Floats, Floats]:
        """See AuxiliaryMaps."""
        lower, upper = extremes(self.function, index, x, self.box, self.samples)
        return lower, upper

    @classmethod
    def at(cls, maps: Sequence[Self], states: Floats, side: int) -> Floats:
        """See AuxiliaryMaps."""
        (count, n), first = states.shape, maps[0]
        boxes = np.repeat([formulas.box for formulas in maps], n, axis=0)
        index = np.tile(np.arange(n), count)
        return _extremes(first.function, boxes, index, states.ravel(), first.samples, (side,)).reshape(states.shape)

    def worst(self, intervals: Floats, known: Extremes | None = None) -> Extremes:
        """See AuxiliaryMaps."""
        found = self.found(intervals[None])[0]
        return Extremes(found[..., 0], np.repeat(found[..., 1, None], 2, axis=2))

    def places(self, intervals: Floats, known: Floats) -> Floats:
        """See AuxiliaryMaps: those known."""
        return known

    def found(self, intervals: Floats) -> Floats:
        """The extreme and its place over each of the intervals (K, n, 2), by side: shape (K, n, 2, 2).

        An interval's own ends are evaluated, and the best of the grid between them is refined.
        """
        count, n = intervals.shape[:2]
        boxes, index = np.tile(self.box, (2 * n * count, 1, 1)), np.tile(np.repeat(np.arange(n), 2), count)
        ends = _extremes(self.function, boxes, index, intervals.ravel(), self.samples).reshape(2, count, n, 2)
        found = np.empty((count, n, 2, 2))
        for k, i, side in np.ndindex(count, n, 2):
            found[k, i, side] = self._peak(i, side, intervals[k, i], ends[side, k, i])
        return found

    def envelopes(self) -> tuple[Envelope, ...]:
        """See AuxiliaryMaps."""
        return self.grid

    def _peak(self, index: int, side: int, interval: Floats, ends: Floats) -> tuple[float, float]:
        """The extreme of one map over an interval, whose ends have the images `ends`, and where it is; NaN without images."""
        envelope, sign = self.grid[index], SIGNS[side]
        x, curve = envelope.x, sign * (envelope.upper if side else envelope.lower)
        if not np.isfinite(curve).all() or not np.isfinite(ends).all():
            return np.nan, np.nan
        end = int((sign * ends).argmax())
        between = np.flatnonzero((x > interval[0]) & (x < interval[1]))
        k = int(between[curve[between].argmax()]) if len(between) else 0
        if not len(between) or curve[k] <= sign * ends[end]:
            return float(ends[end]), float(interval[end])
        neighbours = x[max(k - 1, 0)], x[min(k + 1, len(x) - 1)]
        if neighbours[0] < interval[0] or neighbours[1] > interval[1]:
            return self._refined(index, side, k, np.clip(neighbours, *interval))
        if (index, side, k) not in self.peaks:
            self.peaks[index, side, k] = self._refined(index, side, k, np.array(neighbours))
        return self.peaks[index, side, k]

    def _refined(self, index: int, side: int, k: int, around: Floats) -> tuple[float, float]:
        """The extreme of one map, and where it is, between the neighbours `around` of its sample k."""
        envelope = self.grid[index]

        def values(x: Floats) -> Floats:
            return SIGNS[side] * self.curves(index, x.ravel())[side].reshape(x.shape)

        top = SIGNS[side] * (envelope.upper if side else envelope.lower)[k : k + 1]
        place, value = zoomed(values, envelope.x[k : k + 1], top, around[None])
        return float(SIGNS[side] * value[0]), float(place[0])


def extremes(function: Function, index: int, x: ArrayLike, box: Floats, samples: int, known: Floats | None = None) -> Floats:
    """The least and the largest image of coordinate `index` at each of its values x, shape (m,), over the others: shape (2, m).

    The best of a grid with `samples` points along every other coordinate of the box, shape (n, 2), its ends included, or fewer
    where these are several (AT_MOST), is refined between its neighbours, along one axis after the other. No curve is laid
    through samples, so that nothing exceeds what the map takes, at a jump either. `known` has images on the grid, a row a value.
    """
    values = np.asarray(x, float)
    boxes, which = np.tile(box, (len(values), 1, 1)), np.full(len(values), index)
    return _extremes(function, boxes, which, values, samples, known=known)


def zoomed(values: Function, at: Floats, top: Floats, around: Floats) -> tuple[Floats, Floats]:
    """Where a function of one number is largest between the ends `around`, shape (R, 2), and its value there, row by row.

    Most extremes are at an end: where all are, and stay there, one call of `values` shows it.

    Args:
        values: takes numbers of shape (R, m) to their values; those without a value are passed over.
        at: shape (R,), the best number known.
        top: shape (R,), its value, which is kept if it is NaN or if none exceeds it.
    """
    low, high, row = *around.T, np.arange(len(at))
    if ((at == low) | (at == high)).all() and not _exceeded(values, at, top, around):
        return at, top
    for _ in range(ZOOMS):
        x = low[:, None] * (1 - SHARES) + high[:, None] * SHARES
        found = values(x)
        best = np.argmax(np.where(np.isfinite(found), found, -np.inf), axis=1)
        better = found[row, best] > top
        at, top = np.where(better, x[row, best], at), np.where(better, found[row, best], top)
        low, high = _narrowed(at, low, high)
    return at, top


def _exceeded(values: Function, at: Floats, top: Floats, around: Floats) -> bool:
    """Whether any of the values `top` is exceeded on the grids that follow one another while none is: all in one call."""
    grids, (low, high) = [], around.T
    for _ in range(ZOOMS):
        grids.append(low[:, None] * (1 - SHARES) + high[:, None] * SHARES)
        low, high = _narrowed(at, low, high)
    found = values(np.concatenate(grids, axis=1))
    return bool(((found > top[:, None]) & np.isfinite(found)).any())


def _narrowed(at: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """The ends of the next finer grid, about the best number known."""
    step = (high - low) / (FINER - 1)
    return np.maximum(low, at - step), np.minimum(high, at + step)


def _extremes(
    function: Function,
    boxes: Floats,
    index: Ints,
    x: Floats,
    samples: int,
    sides: Sequence[int] = (0, 1),
    known: Floats | None = None,
) -> Floats:
    """The least (side 0) and the largest (1) image of a coordinate at one of its values over the others, shape (S, R).

    Args:
        boxes: shape (R, n, 2).
        index: shape (R,), the coordinate; `x` its value.
        sides: which of the two, in this order.
        known: images of the coordinate on the grid over the others, shape (R, J), if they are.
    """
    (count, n), row = boxes.shape[:2], np.arange(len(x))
    samples = min(samples, round(AT_MOST ** (1 / max(n - 1, 1))))
    others = np.array([[k for k in range(n) if k != i] for i in range(n)], int).reshape(n, n - 1)[index]
    share = np.indices((samples,) * (n - 1)).reshape(n - 1, samples ** (n - 1)) / (samples - 1)
    ends = np.take_along_axis(boxes, others[:, :, None], axis=1)
    grid = np.empty((count, share.shape[1], n))
    grid[row, :, index] = x[:, None]
    grid[row[:, None], :, others] = ends[..., :1] * (1 - share) + ends[..., 1:] * share
    values = function(grid.reshape(-1, n)).reshape(grid.shape)[row, :, index] if known is None else known
    signed = values * SIGNS[[*sides], None, None]
    best = np.argmax(signed, axis=2).ravel()  # of a row with NaN, the NaN
    row, index, others, ends = (np.concatenate([each] * len(sides)) for each in (row, index, others, ends))
    signs, states, top = np.repeat(SIGNS[[*sides]], count), grid[row, best], signed.reshape(len(row), -1).max(axis=1)
    row = np.arange(len(row))
    around = states[row[:, None], others][..., None] + (ends[..., 1:] - ends[..., :1]) / (samples - 1) * SIGNS
    around = np.clip(around, ends[..., :1], ends[..., 1:])
    for k in [*range(n - 1)] * (n - 1):  # more than once where the axes depend on each other

        def along(x: Floats, axis: Ints = others[:, k]) -> Floats:
            tried = np.repeat(states[:, None], x.shape[1], axis=1)
            tried[row, :, axis] = x
            return signs[:, None] * function(tried.reshape(-1, n)).reshape(tried.shape)[row, :, index]

        states[row, others[:, k]], top = zoomed(along, states[row, others[:, k]], top, around[:, k])
    return (signs * top).reshape(len(sides), count)
