"""The full auxiliary map: in some regions the worst case of each coordinate separately, elsewhere the map; eq. auxM."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.enclosures.box_images import Boxed, Parts, box_map
from nsmaps.exact.enclosure.images import BoxImages, BoxMap, as_boxes


@dataclass(frozen=True, slots=True, eq=False)
class FullAuxiliaryMap:
    """The set-valued map M_A of eq. auxM, as a map of boxes: for `morse_sets`, `trap` and `exit_times` a map like any other.

    From a state in a box A_n each coordinate may go to all that lies between its auxiliary maps (eq. auxv, auxphi): to its
    images over all values that the other coordinates have in A_n. From other states it goes where the map goes.
    What is true of all orbits of M_A is true of the map's, for these are among them.
    """

    map: Boxed
    boxes: ArrayLike  #: shape (R, n, 2), the boxes A_n, angles on any turn; a state may lie in several of them

    @property
    def coordinates(self) -> Coordinates:
        """The names of the n coordinates."""
        return Coordinates(self.map.coordinates)

    def image_boxes(self, boxes: ArrayLike) -> BoxImages:
        """Outer images of boxes of shape (N, n, 2), angles on any turn."""
        given = as_boxes(boxes, self.coordinates)
        map, inside = box_map(self.map), np.zeros(len(given), bool)
        parts = []
        for region in as_boxes(self.boxes, self.coordinates):
            common, is_inside = self._common(given, region)
            inside |= is_inside
            parts.append(self._products(map, common.boxes, region, common.source))
        others = np.flatnonzero(~inside)
        plain = map.image_boxes(given[others])
        parts.append((others[plain.source], plain.images, plain.words, others[~plain.bounded], others[plain.empty]))
        source, images, words, unknown, empty = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(source, kind="stable")
        bounded, lost = np.ones(len(given), bool), np.zeros(len(given), bool)
        bounded[unknown], lost[empty] = False, True
        return BoxImages(source[order], images[order], words[order], bounded, lost)

    def _common(self, boxes: Floats, region: Floats) -> tuple[Parts, Bools]:
        """What boxes have in common with a region, on its turn and rounded outwards, and which of them lie within it.

        A box that goes round the circle may meet a region at both of its ends: in a part for each.
        """
        whole = Parts(np.arange(len(boxes)), boxes, np.zeros(boxes.shape[:2], np.int64))
        parts = whole.near(np.where(self.coordinates.angles, region.mean(axis=1), np.nan))
        low, high = np.maximum(parts.boxes[:, :, 0], region[:, 0]), np.minimum(parts.boxes[:, :, 1], region[:, 1])
        beyond = ((low > parts.boxes[:, :, 0]) | (high < parts.boxes[:, :, 1])).any(axis=1)
        is_inside = np.ones(len(boxes), bool)
        is_inside[parts.source[beyond]] = False
        meets = np.asarray((low <= high).all(axis=1))
        return Parts(parts.source, np.stack([low, high], axis=2), parts.turns).of(meets), is_inside

    def _products(self, map: BoxMap, cut: Floats, region: Floats, source: Ints) -> tuple[Ints, Floats, np.ndarray, Ints, Ints]:
        """The products of each coordinate's images, over its own interval and all of the region in the others."""
        images, unknown, empty = np.empty_like(cut), np.zeros(len(cut), bool), np.zeros(len(cut), bool)
        for k in range(len(region)):
            slabs = np.repeat(region[None], len(cut), axis=0)
            slabs[:, k] = cut[:, k]
            found = map.image_boxes(slabs)
            images[:, k] = found.hulls()[:, k]
            unknown |= ~found.bounded
            empty |= found.empty
        known = np.isfinite(images).all(axis=(1, 2))
        return source[known], images[known], np.full(int(known.sum()), ""), source[unknown], source[empty]
