"""Outer images of boxes of states: the result of an enclosure of a return map."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.coordinates import Coordinates
from nsmaps.errors import StateError
from nsmaps.exact.engine.constants import MOST_PHASE

LOWER, UPPER = range(2)  #: ends of the side of a box


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
            hull[self.source[first], :, LOWER] = np.minimum.reduceat(self.images[:, :, LOWER], first)
            hull[self.source[first], :, UPPER] = np.maximum.reduceat(self.images[:, :, UPPER], first)
        hull[~self.bounded] = -np.inf, np.inf
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
    phases, (low, high) = np.abs(array[:, Coordinates(coordinates).angles]), np.moveaxis(array, 2, 0)
    if np.isfinite(array).all() and (low <= high).all() and phases.max(initial=0.0) <= MOST_PHASE:
        return array
    right = np.isfinite(array).all(axis=(1, 2)) & (low <= high).all(axis=1) & (phases.max(axis=(1, 2), initial=0.0) <= MOST_PHASE)
    i = int(np.argmin(right))
    raise StateError(
        f"box {i} is {array[i].tolist()}; expected: finite ends, each lower one at most the upper one, "
        f"and angles up to {MOST_PHASE:g}"
    )
