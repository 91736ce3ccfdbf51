"""Boxes that contain the images of boxes under an impact system, and how threads compute those of any system in chunks."""

from collections.abc import Callable

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import ProofError
from nsmaps.exact.enclosure.arithmetic.balls import ENLARGE
from nsmaps.exact.enclosure.arithmetic.formulas import ball_law_address
from nsmaps.exact.enclosure.cells import all_box_images
from nsmaps.exact.enclosure.flight.flow import BallFlow
from nsmaps.exact.enclosure.images import UPPER, BoxImages, as_boxes
from nsmaps.exact.enclosure.subdivide import MOST_IMAGES
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.engine.returns import SPEED
from nsmaps.exact.flows.formulas import V
from nsmaps.exact.kernel import in_chunks
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.exact.systems.walls import ImpactFormulas
from nsmaps.exact.words import words_of

CHUNK = 1_000  #: boxes that a thread takes at a time
FULL_TURN = TWO_PI * ENLARGE  #: an upper bound


def image_boxes(system: ImpactFormulas, boxes: ArrayLike) -> BoxImages:
    """The images of boxes as described in `ImpactSystem.image_boxes`."""
    start, table = as_boxes(boxes, system.coordinates).copy(), enclosed_table(system)
    below, none = start[:, SPEED].T < 0
    start[:, SPEED] = np.maximum(start[:, SPEED], 0)
    found = images_in_chunks(system, start, lambda *given: all_box_images(ball_flow(table), *given))
    kept, bounded, empty = ~none[found.source], found.bounded | none, found.empty | below
    return BoxImages(found.source[kept], found.images[kept], found.words[kept], bounded, empty)


def images_in_chunks(system: HybridFormulas, start: Floats, enclose: Callable[..., int]) -> BoxImages:
    """The images of boxes (N, n, 2), which threads compute in chunks; a side of several turns of an angle is taken as one.

    Args:
        enclose: of a chunk of boxes and of rows, as many of which it fills as it returns: see `subdivide.enclose_boxes`.
    """
    (n, m), angles = start.shape[:2], system.coordinates.angles
    low, high = np.moveaxis(start, -1, 0)
    circles = np.where(angles, np.maximum(np.ceil((high - low) / TWO_PI) - 1, 0), 0.0)  # after the first
    if circles.any():
        start = np.stack([low, np.where(circles > 0, low + FULL_TURN, high)], axis=2)
    number, empty, bounded = np.empty(n, np.int64), np.empty(n, bool), np.empty(n, bool)
    parts = {0: (np.empty(0, np.int64), np.empty((0, m, 2)))}

    def run(k: slice) -> None:
        rows = len(start[k]) * MOST_IMAGES  # memory is used for the rows that are written
        codes, images = np.empty(rows, np.int64), np.empty((rows, m, 2))
        rows = enclose(start[k], (codes, images, number[k], empty[k], bounded[k]))
        if circles[k].any():
            images[:rows, :, UPPER] += FULL_TURN * np.repeat(circles[k], number[k], axis=0)
        parts[k.start] = codes[:rows], images[:rows]

    in_chunks(n, run, CHUNK)
    codes, images = (np.concatenate(each) for each in zip(*(parts[k] for k in sorted(parts)), strict=True))
    return BoxImages(np.repeat(np.arange(n), number), images, words_of(codes, system.letters), bounded, empty)


def ball_flow(table: Floats) -> BallFlow:
    """A table with room for the coefficients of a flight and of two sets of flights, and for the functions of its rates."""
    rates = int(table[layout.SIMPLE] + table[layout.CHAINED])
    rows = 4 * 2 * (int(table[layout.POWERS]) + 2 * rates)
    flight, one, whole, basis, end = len(table) + np.cumsum([0, table[layout.FLIGHT_SIZE], rows, rows, 8 + 8 * rates], dtype=int)
    room = np.zeros(end)
    room[:flight] = table
    return BallFlow(room, int(flight), int(one), int(whole), int(basis))


def enclosed_table(system: ImpactFormulas) -> Floats:
    """The table of a system with the addresses of its impact laws in balls. Raises ProofError as `image_boxes` does."""
    kernel = system._kernel().closed_form("images of boxes", ProofError)
    table = kernel.table.copy()
    for k, law in enumerate(kernel.formulas.laws):
        if table[layout.LAW + k]:
            table[layout.BALL_LAW + k] = ball_law_address(law, V, kernel.formulas.symbols)
    return table
