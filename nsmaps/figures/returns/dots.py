"""Many opaque dots in three dimensions, painted pixel by pixel in place of one path each."""

from typing import Any

import numpy as np
from matplotlib.artist import allow_rasterization
from matplotlib.path import Path
from mpl_toolkits.mplot3d import Axes3D, proj3d
from mpl_toolkits.mplot3d.art3d import Path3DCollection
from numpy.typing import NDArray

from nsmaps.arrays import Floats

_POINTS = 72.0  #: an inch
_FINER = 2  #: dots are painted so many times finer than the page, which smooths their rims


class Dots(Path3DCollection):  # type: ignore[misc]
    """Points (N, 3) as dots with colours (N, 3) and a diameter in points, of which the nearest is seen at each pixel."""

    def __init__(self, ax: Axes3D, points: Floats, colours: Floats, diameter: float) -> None:
        x, y, z = points.T
        super().__init__(
            [Path.unit_circle()],
            sizes=[diameter**2],
            offsets=np.column_stack([x, y]),
            offset_transform=ax.transData,
            facecolors=colours,
            linewidths=0,
            zs=z,
            depthshade=False,
            rasterized=True,
        )
        self._points, self._diameter = points, diameter
        opaque = np.round(255 * np.column_stack([colours, np.ones(len(colours))]))
        self._colours = np.append(opaque, np.zeros((1, 4)), axis=0).astype(np.uint8)  # and none
        ax.add_collection(self, autolim=False)

    @allow_rasterization  # type: ignore[untyped-decorator]
    def draw(self, renderer: Any) -> None:
        """Paint the dots into the pixels of the axes."""
        place, depth = self._projected()
        if len(place):
            figure = self.get_figure(root=True)
            radius = self._diameter / 2 * figure.dpi / _POINTS
            corner = np.floor(place.min(axis=0) - radius)
            seen = nearest(_FINER * (place - corner), depth, _FINER * radius)
            image = _averaged(self._colours, seen)
            gc = renderer.new_gc()
            self._set_gc_clip(gc)
            renderer.draw_image(gc, *corner.astype(int), image)
            gc.restore()

    def _projected(self) -> tuple[Floats, Floats]:
        """Where the points are on the page, pixels (N, 2), and how far from the eye (N,)."""
        x, y, depth = proj3d.proj_transform(*self._points.T, self.axes.get_proj())
        return self.axes.transData.transform(np.column_stack([x, y])), depth


def nearest(place: Floats, depth: Floats, radius: float) -> NDArray[np.int32]:
    """The number of the nearest dot over each pixel from (0, 0) on, (height, width) from below, -1 for none.

    >>> nearest(np.array([[1.5, 1.5], [2.5, 1.5]]), np.array([1.0, 2.0]), 1.0).tolist()
    [[-1, 0, 1, -1], [0, 0, 0, 1], [-1, 0, 1, -1]]
    """
    reach = int(radius)
    pixel = place.astype(np.intp)
    width, height = pixel.max(axis=0) + reach + 1
    order = np.argsort(-depth).astype(np.int32)  # the nearest last
    row = np.full((height, width), -1, np.int32)
    row[tuple(pixel[order].T[::-1])] = np.arange(len(order))  # of several at one pixel the last
    own, top = row.copy(), np.full_like(row, -1)
    for dx in range(reach + 1):  # rows of the disc, those of its rim first, each as wide as they all are at least
        if dx:
            _raise(row[:, dx:], own[:, :-dx])
            _raise(row[:, :-dx], own[:, dx:])
        for dy in range(reach + 1):
            if int(np.sqrt(radius**2 - dy**2)) == dx:
                _raise(top[dy:], row[: height - dy])
                _raise(top[: height - dy], row[dy:])
    return np.where(top >= 0, order[top], np.int32(-1))


def _raise(values: NDArray[np.int32], least: NDArray[np.int32]) -> None:
    np.maximum(values, least, out=values)


def _averaged(colours: NDArray[np.uint8], seen: NDArray[np.int32]) -> NDArray[np.uint8]:
    """The colours (N + 1, 4) of the dots that are seen, of none the last, averaged over the fine pixels of each pixel."""
    whole = np.pad(seen, [(0, -size % _FINER) for size in seen.shape], constant_values=-1)
    total = np.zeros((*(size // _FINER for size in whole.shape), 4), np.uint16)
    for part in (whole[y::_FINER, x::_FINER] for y in range(_FINER) for x in range(_FINER)):
        total += colours[part]
    count = np.maximum(total[..., 3:] // 255, 1)  # fine pixels that have a dot
    return np.concatenate([total[..., :3] // count, total[..., 3:] // _FINER**2], axis=-1).astype(np.uint8)
