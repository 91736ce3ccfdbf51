"""The tables of systems that enclosures use."""

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.exact.enclosure.arithmetic.formulas import ball_law_address
from nsmaps.exact.enclosure.flight.flow import BallFlow
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.flows.formulas import V
from nsmaps.exact.systems.walls import ImpactFormulas


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
