"""Boxes that contain the images of boxes under a system with modes."""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import ProofError
from nsmaps.exact.enclosure.images import CHUNK, BoxImages, as_boxes
from nsmaps.exact.modes.enclosure.memory import MOST_IMAGES, ball_memory
from nsmaps.exact.modes.enclosure.subdivide import all_box_images
from nsmaps.exact.modes.enclosure.tables import BallTables, ball_tables
from nsmaps.exact.modes.kernel import kernel_of
from nsmaps.exact.words import decoded

if TYPE_CHECKING:
    from nsmaps.exact.hybrid import HybridSystem


@lru_cache(maxsize=64)
def table_of(system: "HybridSystem") -> BallTables:
    """The table of a system for enclosures; those used last are remembered. Raises ProofError as `image_boxes` does."""
    kernel = kernel_of(system)
    for one in kernel.definition.transitions:
        if one.curved:
            raise ProofError(
                f"{type(system).__name__}.guards: the reset of {one.name!r} is not affine, and sets of states cannot be enclosed "
                "through it; expected: affine resets"
            )
        if one.releases:
            raise ProofError(
                f"{type(system).__name__}.guards: {one.name!r} has contact that lasts, and chatter cannot be "
                "enclosed; expected: no `rests`"
            )
    return ball_tables(kernel.definition, kernel.values, kernel.table)


def image_boxes(system: "HybridSystem", boxes: ArrayLike) -> BoxImages:
    """The images of boxes as described in `HybridSystem.image_boxes`."""
    from nsmaps.exact.kernel import in_chunks

    start = as_boxes(boxes, system.coordinates).copy()
    n, m = start.shape[:2]
    angle = np.flatnonzero(system.coordinates.angles)
    circles = np.zeros((n, m))
    circles[:, angle] = np.maximum(np.ceil((start[:, angle, 1] - start[:, angle, 0]) / TWO_PI) - 1, 0)  # after the first
    start[:, :, 1] = np.where(circles > 0, start[:, :, 0] + TWO_PI * (1 + 1e-15), start[:, :, 1])
    table = table_of(system)
    number, empty, bounded = np.empty(n, np.int64), np.empty(n, bool), np.empty(n, bool)
    parts: dict[int, tuple[NDArray[np.int64], Floats]] = {}

    def run(k: slice) -> None:
        rows = len(start[k]) * MOST_IMAGES  # an upper bound; memory is used for the rows that are written
        codes, images = np.empty(rows, np.int64), np.empty((rows, m, 2))
        rows = all_box_images(table, ball_memory(table), start[k], codes, images, number[k], empty[k], bounded[k])
        images[:rows, :, 1] += TWO_PI * (1 + 1e-15) * np.repeat(circles[k], number[k], axis=0)
        parts[k.start] = codes[:rows], images[:rows]

    in_chunks(n, run, CHUNK)
    codes = np.concatenate([np.empty(0, np.int64), *(parts[k][0] for k in sorted(parts))])
    images = np.concatenate([np.empty((0, m, 2)), *(parts[k][1] for k in sorted(parts))])
    return BoxImages(np.repeat(np.arange(n), number), images, decoded(codes, system.letters), bounded, empty)
