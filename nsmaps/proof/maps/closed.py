"""The search for a forward invariant set of cells of a map given by formulas: those that images of an attractor's cells meet."""

from collections import deque

import numpy as np
from flint import ctx
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.progress import beat
from nsmaps.verify.formula import UnprovedError
from nsmaps.verify.maps.closed import BITS, Cells, indices, met
from nsmaps.verify.maps.formula import PiecewiseFormulas


def closed_set(formulas: PiecewiseFormulas, cells: Cells, seed: Floats) -> NDArray[np.uint16]:
    """The codes of the cells that orbits from the cell of a state meet: their images are all within them.

    Args:
        formulas: in balls.
        cells: the grid.
        seed: a state on the attractor, shape (n,).

    Raises:
        ProofError: the state is not in the grid, or images leave the grid or have no bound.
    """
    shape, angles = cells.counts, np.array(formulas.angles)
    low = np.where(angles, 0.0, cells.low)
    high = np.where(angles, 2 * np.pi, cells.high)
    start = np.floor((seed - low) / (high - low) * shape).astype(int)
    if not ((start >= 0) & (start < shape)).all():
        raise ProofError(f"the state {seed.tolist()} of the attractor is not in the box {list(zip(low, high, strict=True))}")
    inside = np.zeros(shape, bool)
    inside[tuple(start)] = True
    waiting = deque([tuple(start.tolist())])
    with ctx.workprec(BITS):
        while waiting:
            number = waiting.popleft()
            try:
                found = list(met(formulas, cells, number, cells.parts))
            except UnprovedError as error:
                where = low + (np.array(number) + 0.5) * (high - low) / shape
                text = f"orbits from the attractor come to the cell at {where.tolist()}: {error}"
                raise ProofError(f"{text}; expected: a larger box, or more cells or parts of cells") from error
            for ranges in found:
                window = np.ix_(*indices(ranges, shape, formulas.angles))
                new = np.argwhere(~inside[window])
                inside[window] = True
                waiting.extend(tuple(int(axis.ravel()[k]) for axis, k in zip(window, row, strict=True)) for row in new)
            beat(0.0, f"{inside.sum()} cells, {len(waiting)} to be mapped")
    return np.where(inside, 0, 1).astype(np.uint16).ravel()
