"""Outer images of boxes of states: what an enclosure of a return map gives."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nsmaps.exact.impacts import Floats


@dataclass(frozen=True, slots=True, eq=False)
class BoxImages:
    """Boxes that together hold the images of all states of each source box, one after another for all sources.

    A source box that meets several words has an image box for each of them. Angles are on the real line, next to the turn
    of their flight; a side of a full turn or more is the whole circle. Where nothing is known of the images of a source
    box, it is not `bounded` and one of its image boxes is infinite.
    """

    source: NDArray[np.int64]  #: shape (M,), number of the source box, ascending
    images: Floats  #: shape (M, n, 2), lower and upper end of each coordinate
    words: NDArray[np.str_]  #: shape (M,), the word of the states with this image; empty where the map has none or several
    bounded: NDArray[np.bool_]  #: shape (N,), of each source box: are all images of its states known to be in its image boxes
    empty: NDArray[np.bool_]  #: shape (N,), of each source box: may some state of it have no image (rests, escapes, uncovered)

    def hulls(self) -> Floats:
        """The smallest box around all images of each source, shape (N, n, 2); NaN without images, infinite if not bounded."""
        hull = np.full((len(self.bounded), *self.images.shape[1:]), np.nan)
        hull[:, :, 0], hull[:, :, 1] = np.inf, -np.inf
        np.minimum.at(hull[:, :, 0], self.source, self.images[:, :, 0])
        np.maximum.at(hull[:, :, 1], self.source, self.images[:, :, 1])
        none = ~np.isin(np.arange(len(hull)), self.source)
        hull[none] = np.nan
        hull[~self.bounded, :, 0], hull[~self.bounded, :, 1] = -np.inf, np.inf
        return hull


class BoxMap(Protocol):
    """A map that encloses the images of boxes, rounding included: exact systems, polynomial maps, composite maps."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the n coordinates."""

    def image_boxes(self, boxes: Floats) -> BoxImages:
        """Outer images of boxes of shape (N, n, 2)."""
