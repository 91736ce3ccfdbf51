"""The tables of systems for enclosures."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.exact.enclosure.flow import BallFlow
from nsmaps.exact.enclosure.formulas import ball_law_address
from nsmaps.exact.engine import layout
from nsmaps.exact.flows.formulas import V

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

Floats = NDArray[np.float64]


def ball_flow(table: Floats) -> BallFlow:
    """A table with room for the coefficients of two sets of flights and for the functions of its rates."""
    rates = int(table[layout.SIMPLE] + table[layout.CHAINED])
    rows = 4 * 2 * (int(table[layout.POWERS]) + 2 * rates) + 1
    return BallFlow(table, np.zeros(rows), np.zeros(rows), np.zeros(8 + 8 * rates))


def enclosed_table(system: "ImpactSystem") -> Floats:
    """The table of a system with the addresses of its impact laws in balls. Raises ProofError as `image_boxes`."""
    kernel = system._kernel()
    table = kernel.table.copy()
    for k, law in enumerate(kernel.formulas.laws):
        if table[layout.LAW + k]:
            table[layout.BALL_LAW + k] = ball_law_address(law, V, kernel.formulas.symbols)
    return table
