"""Outer images of boxes of states: the result of an enclosure of a return map."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.coordinates import TWO_PI, Coordinates
from nsmaps.errors import StateError
from nsmaps.exact.words import decoded

if TYPE_CHECKING:
    from nsmaps.exact.systems.flow import FlowSystem
    from nsmaps.exact.systems.system import ImpactSystem

CHUNK = 1_000  #: boxes that a thread takes at a time
MOST_PHASE = 1e10  #: radians; larger phases have lost too many digits


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BoxImages:
    """Boxes that contain the images of all states of each of N source boxes, M boxes in all, ordered by source.

    A source box whose states have several words has an image box for each word. Angles are on the real line, next to the turn of
    their flight; a side of a full turn or more is the whole circle. Where no bound on the images of a source box is known, it is
    not `bounded` and one of its image boxes is infinite.
    """

    __repr__ = brief

    source: NDArray[np.int64]  #: shape (M,), number of the source box, ascending
    images: Floats  #: shape (M, n, 2), lower and upper end of each coordinate
    words: NDArray[np.str_]  #: shape (M,), the word of the states with this image; empty where the map has none or several
    bounded: NDArray[np.bool_]  #: shape (N,), True if the image boxes contain all images of the source box
    empty: NDArray[np.bool_]  #: shape (N,), True if some state of the source box may have no image
    inherent: NDArray[np.bool_] | None = None  #: shape (M,), True if parts of the source box have images as wide: the map's own

    def hulls(self) -> Floats:
        """The smallest box around all images of each source, shape (N, n, 2); NaN without images, infinite if not bounded."""
        hull = np.full((len(self.bounded), *self.images.shape[1:]), np.nan)
        if len(self.source):
            first = np.flatnonzero(np.diff(self.source, prepend=-1))
            hull[self.source[first], :, 0] = np.minimum.reduceat(self.images[:, :, 0], first)
            hull[self.source[first], :, 1] = np.maximum.reduceat(self.images[:, :, 1], first)
        hull[~self.bounded, :, 0], hull[~self.bounded, :, 1] = -np.inf, np.inf
        return hull


@runtime_checkable
class BoxMap(Protocol):
    """A map that encloses the images of boxes, rounding errors included: exact systems, polynomial maps, composite maps."""

    @property
    def coordinates(self) -> Sequence[str]:
        """The names of the n coordinates."""

    def image_boxes(self, boxes: Floats) -> BoxImages:
        """Outer images of boxes of shape (N, n, 2)."""


def as_boxes(boxes: ArrayLike, coordinates: Sequence[str]) -> Floats:
    """Boxes as a float array of shape (N, n, 2).

    Raises:
        StateError: the boxes have another shape, or an end that is not finite; states what is expected.
    """
    array = np.ascontiguousarray(boxes, float)
    n = len(coordinates)
    if array.ndim != 3 or array.shape[1:] != (n, 2):
        raise StateError(
            f"boxes have shape {array.shape}; expected: a batch of shape (N, {n}, 2), "
            f"the lower and the upper end of each of {coordinates}"
        )
    angles = np.abs(array[:, Coordinates(coordinates).angles]).max(axis=(1, 2), initial=0.0)
    right = np.isfinite(array).all(axis=(1, 2)) & (array[:, :, 0] <= array[:, :, 1]).all(axis=1) & (angles <= MOST_PHASE)
    if not right.all():
        i = int(np.argmin(right))
        raise StateError(
            f"box {i} is {array[i].tolist()}; expected: finite ends, each lower one at most the upper one, "
            f"and angles up to {MOST_PHASE:g}"
        )
    return array


def image_boxes(system: "ImpactSystem", boxes: ArrayLike) -> BoxImages:
    """The images of boxes as described in `ImpactSystem.image_boxes`."""
    from nsmaps.exact.enclosure.flight.tables import ball_flow, enclosed_table
    from nsmaps.exact.enclosure.subdivide import MOST_IMAGES, all_box_images

    start, table = as_boxes(boxes, system.coordinates).copy(), enclosed_table(system)
    below, none = start[:, 0].T < 0
    start[:, 0] = np.maximum(start[:, 0], 0)
    found = images_in_chunks(system, start, MOST_IMAGES, lambda *room: all_box_images(ball_flow(table), *room))
    kept, bounded, empty = ~none[found.source], found.bounded | none, found.empty | below
    return BoxImages(found.source[kept], found.images[kept], found.words[kept], bounded, empty)


def images_in_chunks(system: "FlowSystem", start: Floats, most_images: int, enclose: Callable[..., int]) -> BoxImages:
    """The images of boxes (N, n, 2), which threads compute in chunks; a side of several turns of an angle is taken as one.

    Args:
        most_images: upper bound on the image boxes of one box.
        enclose: of a chunk of boxes; it fills the codes and images of as many rows as it returns, and for each box the number
            of its images, whether a state may have none, and whether they are bounded.
    """
    from nsmaps.exact.kernel import in_chunks

    (n, m), angles = start.shape[:2], system.coordinates.angles
    low, high = start[:, :, 0], start[:, :, 1]
    circles = np.where(angles, np.maximum(np.ceil((high - low) / TWO_PI) - 1, 0), 0.0)  # after the first
    if circles.any():
        start = np.stack([low, np.where(circles > 0, low + TWO_PI * (1 + 1e-15), high)], axis=2)
    number, empty, bounded = np.empty(n, np.int64), np.empty(n, bool), np.empty(n, bool)
    parts = {0: (np.empty(0, np.int64), np.empty((0, m, 2)))}

    def run(k: slice) -> None:
        rows = len(start[k]) * most_images  # memory is used for the rows that are written
        codes, images = np.empty(rows, np.int64), np.empty((rows, m, 2))
        rows = enclose(start[k], codes, images, number[k], empty[k], bounded[k])
        if circles[k].any():
            images[:rows, :, 1] += TWO_PI * (1 + 1e-15) * np.repeat(circles[k], number[k], axis=0)
        parts[k.start] = codes[:rows], images[:rows]

    in_chunks(n, run, CHUNK)
    codes, images = (np.concatenate(each) for each in zip(*(parts[k] for k in sorted(parts)), strict=True))
    return BoxImages(np.repeat(np.arange(n), number), images, decoded(codes, system.letters), bounded, empty)
