"""Morse graphs with Conley indices by CMGDB, on the box images of this package: the extra `morse`."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.cells.grid import Cells
from nsmaps.coordinates import TWO_PI, BoxLike
from nsmaps.enclosures.box_images import Boxed, box_map, name_of
from nsmaps.errors import NsmapsError
from nsmaps.progress import shows


@dataclass(frozen=True, slots=True, eq=False)
class MorseGraph:
    """The Morse sets of a map in a window and their Conley indices, as CMGDB computes them."""

    of: str  #: the map for which this holds
    hulls: Floats  #: shape (K, n, 2), of the Morse sets; on a circle from the window's one end to the other, if it passes it
    edges: Ints  #: shape (E, 2), from a Morse set to the next that may be reached from it
    indices: tuple[tuple[str, ...], ...]  #: of each set, in each dimension: factors, "0" of the trivial; none: unknown


@shows
def conley_indices(system: Boxed, box: BoxLike, *, depth: int = 5, of: str = "") -> MorseGraph:
    """The Morse graph with Conley indices of a map in a window of 2^depth cells an axis.

    CMGDB takes one image box of a cell: the hull of the images by all words, so that its sets may be larger than those of
    `morse_sets`. A fixed point that attracts has the index x - 1 in dimension 0, a q-cycle that attracts x^q - 1.

    Raises:
        NsmapsError: CMGDB is not installed (the extra `morse`), or the window is not valid.
    """
    try:
        import CMGDB
    except ImportError as error:
        raise NsmapsError("Conley indices are computed by CMGDB, which is not installed; expected: the extra 'morse'") from error
    cells = Cells.over(system.coordinates, box, 1)
    low, high = cells.box.T
    enclosing = box_map(system)

    def images(rects: ArrayLike) -> Floats:
        sides = np.asarray(rects, float).reshape(-1, 2, len(low)).transpose(0, 2, 1)
        hulls = _in_window(cells, enclosing.image_boxes(np.ascontiguousarray(sides)).hulls())
        return hulls.transpose(0, 2, 1).reshape(len(sides), -1)

    parts = len(low) * depth
    model = CMGDB.Model(
        parts, parts, min(parts, len(low)), 10**7, low, high, cells.circles.tolist(), lambda rect: images(rect)[0].tolist()
    )
    model.set_batch_map(images)
    graph, _ = CMGDB.ComputeConleyMorseGraph(model)
    sets = [np.array(graph.morse_set_boxes(k)).reshape(-1, 2, len(low)) for k in graph.vertices()]
    hulls = np.array([np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)], axis=1) for boxes in sets])
    edges = np.array(graph.edges(), np.int64).reshape(-1, 2)
    indices = tuple(tuple(graph.annotations(k)) for k in graph.vertices())
    return MorseGraph(of or name_of(system), hulls.reshape(-1, len(low), 2), edges, indices)


def _in_window(cells: Cells, hulls: Floats) -> Floats:
    """Image boxes with angles on the window's turn; the window with a margin where nothing is known, a box beyond it of none."""
    low, high = cells.box.T
    size = (high - low)[:, None]
    unknown, none = ~np.isfinite(hulls).all(axis=(1, 2)), np.isnan(hulls).any(axis=(1, 2))
    hulls = hulls.copy()
    hulls[unknown] = cells.box + size * [-0.5, 0.5]
    hulls[none] = cells.box + 2 * size
    part = cells.coordinates.angles & ~cells.circles  # of a turn, whose ends an image may pass on either side
    turns = np.floor((np.where(part, hulls[:, :, 1], hulls[:, :, 0]) - low) / TWO_PI) * cells.coordinates.angles
    hulls -= TWO_PI * turns[:, :, None]
    both = part & (hulls[:, :, 0] + TWO_PI <= high)
    hulls[:, :, 1] = np.where(both, np.maximum(hulls[:, :, 1], high), hulls[:, :, 1])
    return hulls
