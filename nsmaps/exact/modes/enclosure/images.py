"""Boxes that contain the images of boxes under a system with modes."""

from functools import lru_cache

from nsmaps.arrays import ArrayLike
from nsmaps.errors import ProofError
from nsmaps.exact.enclosure.images import BoxImages, as_boxes
from nsmaps.exact.enclosure.impacts import images_in_chunks
from nsmaps.exact.modes.enclosure.cells import all_box_images
from nsmaps.exact.modes.enclosure.memory import ball_memory
from nsmaps.exact.modes.enclosure.tables import BallTables, ball_tables
from nsmaps.exact.systems.guards import HybridFormulas


@lru_cache(maxsize=64)
def table_of(system: HybridFormulas) -> BallTables:
    """The table of a system for enclosures; those used last are remembered. Raises ProofError as `image_boxes` does."""
    kernel = system._kernel().modes
    if kernel.definition.smooth:
        raise ProofError(
            f"{type(system).__name__} has rates or guards that are not affine in the states, and sets of states are enclosed in "
            "flights of affine modes alone; expected: such a system, or images of single states"
        )
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
    if kernel.table.phase != 0.0:
        raise ProofError(
            f"{type(system).__name__}.section is at the phase {kernel.table.phase:.6g} of the forcing, and sets of states are "
            "enclosed from the phase zero on; expected: a clock that falls at t = 0, or a name for the phase in `coordinates`"
        )
    if kernel.definition.after and len(kernel.definition.starts) > 1:
        raise ProofError(
            f"{type(system).__name__}.section is just after an event in several modes, or parts of them, and sets of states are "
            "enclosed from one; expected: side='before'"
        )
    return ball_tables(kernel.definition, kernel.values, kernel.table)


def image_boxes(system: HybridFormulas, boxes: ArrayLike) -> BoxImages:
    """The images of boxes as described in `HybridSystem.image_boxes`."""
    start, table = as_boxes(boxes, system.coordinates).copy(), table_of(system)
    return images_in_chunks(system, start, lambda *given: all_box_images(table, ball_memory(table), *given))
