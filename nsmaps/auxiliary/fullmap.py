"""The full auxiliary map: in some regions the worst case of a map's coordinates, each by itself, elsewhere the map; eq. auxM."""

from dataclasses import dataclass

import numpy as np

from nsmaps.auxiliary.cells import Bools, Ints
from nsmaps.auxiliary.fittedboxes import Fitted, box_map
from nsmaps.exact.boxes import BoxImages, BoxMap
from nsmaps.exact.impacts import TWO_PI, Floats, angle_mask


@dataclass(frozen=True, slots=True, eq=False)
class FullAuxiliaryMap:
    """The set-valued map M_A of eq. auxM, as a map of boxes: for `morse_sets`, `trap`, `transient` as any other.

    From a state in a box A_n each coordinate may go to all that lies between its auxiliary maps (eq. auxv, auxphi): to its
    images over all values that the other coordinates have in A_n. From other states it goes where the map goes.
    What is true of all orbits of M_A is true of the map's, for these are among them.
    """

    map: BoxMap | Fitted
    boxes: Floats  #: shape (R, n, 2), the boxes A_n; of those that hold a state each counts

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the n coordinates."""
        return self.map.coordinates

    def image_boxes(self, boxes: Floats) -> BoxImages:
        """Outer images of boxes of shape (N, n, 2)."""
        map, inside = box_map(self.map), np.zeros(len(boxes), bool)
        parts = []
        for region in self.boxes:
            cut, meets, within = self._cut(boxes, region)
            inside |= within
            parts.append(self._products(map, cut[meets], region, np.flatnonzero(meets)))
        others = np.flatnonzero(~inside)
        plain = map.image_boxes(boxes[others])
        parts.append((others[plain.source], plain.images, plain.words, others[~plain.bounded], others[plain.empty]))
        source, images, words, unknown, empty = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(source, kind="stable")
        bounded, lost = np.ones(len(boxes), bool), np.zeros(len(boxes), bool)
        bounded[unknown], lost[empty] = False, True
        return BoxImages(source[order], images[order], words[order], bounded, lost)

    def _cut(self, boxes: Floats, region: Floats) -> tuple[Floats, Bools, Bools]:
        """Boxes cut to a region, angles on its turn; which of them meet it, and which lie within it."""
        turns = np.round((boxes.mean(axis=2) - region.mean(axis=1)) / TWO_PI) * angle_mask(self.coordinates)
        near = boxes - TWO_PI * turns[:, :, None]
        low, high = np.maximum(near[:, :, 0], region[:, 0]), np.minimum(near[:, :, 1], region[:, 1])
        within = ((low == near[:, :, 0]) & (high == near[:, :, 1])).all(axis=1)
        return np.stack([low, high], axis=2), (low <= high).all(axis=1), within

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
