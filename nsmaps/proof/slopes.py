"""Slopes of the strips into which cells are cut: directions that the next impacts contract, along the stable sets of saddles."""

import numpy as np

from nsmaps.exact.engine.jit import entry, inner
from nsmaps.proof.arrivals import Cells, Doubles, Flow, Integers
from nsmaps.proof.flights import expansion

IMPACTS = 4  #: of the orbit of a middle along which its direction is found
LARGEST = 96  #: slope, in SHARES of a height by width
SHARES = 8
STRIDE = 256  #: steps of a period in which impacts are looked for


def slopes_of(flow: Flow, cells: Cells, squares: Integers) -> Integers:
    """The slope for each of some squares, in eighths of its height by width, and never zero."""
    slopes = np.zeros(len(squares))
    _fill(flow, cells, squares, slopes)
    eighths = np.clip(np.rint(slopes * SHARES * cells.n / cells.top), -LARGEST, LARGEST).astype(np.int64)
    return np.where(eighths == 0, 1, eighths)


@entry
def _fill(flow: Flow, cells: Cells, squares: Integers, slopes: Doubles) -> None:
    """The slope dv/dphase of the speeds that impacts IMPACTS later bring closest together; zero where there is no impact.

    A direction with the slope s of u by t1 after an impact had, with m = (du/dt1 - s)/(df/dt1), the slope dkappa/dt0 for which
    du - m df = 0 before it.
    """
    df, du = np.empty((IMPACTS, 3)), np.empty((IMPACTS, 3))
    for i in range(squares.size):
        wall, first, width, row = cells.place[squares[i]]
        phase, speed, count = first + width // 2, (row + 0.5) * cells.top * width / cells.n, 0
        while count < IMPACTS:
            wall, phase, speed = _landing(flow, wall, phase, flow.r * speed, df[count], du[count])
            if wall < 0:
                break
            count += 1
        for j in range(count - 1, -1, -1):
            late = j == count - 1
            m = 1.0 if late else (du[j, 2] - slopes[i] / flow.step) / df[j, 2]
            across, along = (df[j, 1], df[j, 0]) if late else (du[j, 1] - m * df[j, 1], du[j, 0] - m * df[j, 0])
            slopes[i] = -along / across / flow.r * flow.step if across != 0 else 0.0


@inner
def _landing(flow: Flow, wall: int, phase: int, kappa: float, df: Doubles, du: Doubles) -> tuple[int, int, float]:
    """The next impact: wall (-1: none), phase and speed; the derivatives of place and speed are filled in."""
    n, low, high, hit = flow.phases.shape[0], 0, 0, -1
    while hit < 0:
        low, high = high, high + max(1, min(n // STRIDE, high))
        if high >= flow.flights.shape[0] - flow.before:
            return -1, 0, 0.0
        at, _ = expansion(flow, wall, phase, phase + high, kappa, 0.0, (0.0, 0.0, 0.0))
        for other in range(flow.walls.shape[1]):
            side = flow.walls[1, other]
            if side * (at[0] - flow.walls[0, other]) > 0 and side * at[1] > 0:
                hit = other
    side = flow.walls[1, hit]
    while high - low > 1:
        middle = (low + high) // 2
        at, _ = expansion(flow, wall, phase, phase + middle, kappa, 0.0, (0.0, 0.0, 0.0))
        if side * (at[0] - flow.walls[0, hit]) > 0:
            high = middle
        else:
            low = middle
    (_, v, z0, zk, v0, vk, push), _ = expansion(flow, wall, phase, phase + high, kappa, 0.0, (0.0, 0.0, 0.0))
    df[0], df[1], df[2] = side * z0, side * zk, side * v
    du[0], du[1], du[2] = side * v0, side * vk, side * push
    return (hit if side * v > 0 else -1), (phase + high) % n, side * v
