"""A trap: a parallelogram of states that an iterate of the impact map contracts into itself: orbits converge to one cycle.

Let F be the map of m impacts and K = {c + M x: |x_1| <= h_1, |x_2| <= h_2}. K is cut into boxes. On each box the m next impacts
are the same for all states, and DF is enclosed. If M^-1 DF M maps the box |x_i| <= h_i into q times itself for all of them, with
q < 1, and |M^-1 (F(c) - c)|_i <= (1 - q) h_i, then F maps K into K and is a contraction in the norm max |x_i|/h_i, K being
convex: all orbits from K converge to the one fixed point of F in K, which is a cycle of m impacts or of a divisor of them.
"""

from collections.abc import Iterable, Mapping
from math import isfinite, pi
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from numpy.typing import NDArray

from nsmaps.verify.flights import Matrix, inverse_of, next_impacts, times
from nsmaps.verify.formula import System, UnprovedError, lifts, nearest_turn


class Trap(NamedTuple):
    """What a certificate states of a trap; its numbers are doubles, and exact."""

    wall: int
    centre: tuple[float, float]  #: phase and impact speed
    matrix: tuple[tuple[float, float], tuple[float, float]]  #: M
    half: tuple[float, float]  #: h
    impacts: int  #: m
    pieces: tuple[int, int]  #: into which the sides of K are cut


def trap_of(data: Mapping[str, Any]) -> Trap:
    """The trap of a certificate."""
    (a, b), (c, d) = data["matrix"]
    (phase, speed), (first, second), (rows, columns) = data["centre"], data["half"], data["pieces"]
    trap = Trap(data["wall"], (phase, speed), ((a, b), (c, d)), (first, second), data["impacts"], (rows, columns))
    numbers = (phase, speed, a, b, c, d, first, second)
    if not all(type(x) in (int, float) and isfinite(x) for x in numbers) or not all(
        type(x) is int for x in (trap.wall, trap.impacts, rows, columns)
    ):
        raise ValueError(f"the trap {trap} needs finite numbers, and whole ones of wall, impacts and pieces")
    if not (first > 0 and second > 0 and trap.impacts > 0 and rows > 0 and columns > 0 and speed > 0):
        raise ValueError(f"the trap {trap} needs half-widths, a speed, impacts and pieces above zero")
    if not abs(a) * first + abs(b) * second <= 2 * pi:
        raise ValueError(f"the trap {trap} is more than two turns of the phase wide")
    return trap


def contraction(system: System, trap: Trap, words: set[tuple[int, ...]] | None = None) -> float:
    """A factor q < 1 by which the iterate contracts the trap; `UnprovedError` if it is not shown to, with the reason."""
    largest, met = arb(0), set[tuple[int, ...]]() if words is None else words
    for i in range(trap.pieces[0]):
        for j in range(trap.pieces[1]):
            walls, _, derivative = carried(system, trap, (_part(trap, 0, i), _part(trap, 1, j)))
            met.add(walls)
            if len(met) > 1:
                raise UnprovedError(f"states of the trap have different impacts: {sorted(met)}")
            largest = largest.max(_norm(trap, derivative))
            if not largest < 1:
                raise UnprovedError(
                    f"the trap is not contracted: a bound of the norm of the derivative is {float(largest.mid()):.6g}"
                )
    (walls, (phase, speed), _), inverse = carried(system, trap, (arb(0), arb(0))), inverse_of(trap.matrix)
    if walls[-1] != trap.wall:
        raise UnprovedError(f"the {trap.impacts} impacts of the trap end on wall {walls[-1]}")
    gap = phase - trap.centre[0]
    moved = gap - 2 * nearest_turn(gap) * arb.pi(), speed - trap.centre[1]
    for row, half in zip(inverse, trap.half, strict=True):
        if not abs(row[0] * moved[0] + row[1] * moved[1]) <= (1 - largest) * half:
            raise UnprovedError("the centre of the trap is moved too far for a contraction into the trap")
    return float(largest.upper())


def carried(system: System, trap: Trap, part: tuple[arb, arb]) -> tuple[tuple[int, ...], tuple[arb, arb], Matrix]:
    """The walls of the impacts that follow states of a part of the trap, the last state of its middle, and M^-1 DF M there."""
    middle = arb(part[0].mid()), arb(part[1].mid())
    way = part[0] - middle[0], part[1] - middle[1]
    matrix = tuple(tuple(map(arb, row)) for row in trap.matrix)
    point = tuple(arb(trap.centre[k]) + matrix[k][0] * middle[0] + matrix[k][1] * middle[1] for k in (0, 1))
    walls, end, derivative = next_impacts(system, trap.wall, point, matrix, way, trap.impacts)  # type: ignore[arg-type]
    return walls, end, times(inverse_of(trap.matrix), derivative)


def holds(trap: Trap, wall: int, phases: NDArray[np.int64], n: int, speeds: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which boxes of a wall lie in the trap: phases (N, 2) in parts of 2 pi/n, speeds (N, 2), up to whole turns of the phase."""
    if wall != trap.wall:
        return np.zeros(len(phases), bool)
    inverse = inverse_of(trap.matrix)
    boxes = zip(phases.tolist(), speeds.tolist(), strict=True)
    return np.array([_inside(trap, inverse, (first, last), n, speed) for (first, last), speed in boxes], bool)


def _inside(trap: Trap, inverse: Matrix, ends: tuple[int, int], n: int, speeds: Iterable[float]) -> bool:
    """Whether a box lies in the trap: all its corners do, of one lift of the whole box to the line, as the trap is convex."""
    turn, reach = 2 * arb.pi() / n, abs(trap.matrix[0][0]) * trap.half[0] + abs(trap.matrix[0][1]) * trap.half[1]
    corners = [(phase, arb(speed) - trap.centre[1]) for phase in ends for speed in speeds]
    return any(
        all(
            abs(u * (turn * (phase - turns * n) - trap.centre[0]) + v * way) <= half
            for phase, way in corners
            for (u, v), half in zip(inverse, trap.half, strict=True)
        )
        for turns in lifts(2 * pi / n * ends[0], 2 * pi / n * ends[1], trap.centre[0], reach)
    )


def _part(trap: Trap, side: int, k: int) -> arb:
    """A part of a side of the trap."""
    count, half = trap.pieces[side], arb(trap.half[side])
    return half * (arb(2 * k + 1) / count - 1) + half / count * arb(0, 1)


def _norm(trap: Trap, derivative: Matrix) -> arb:
    """The factor by which a matrix stretches the box |x_i| <= h_i, as a ball without radius."""
    rows = [(abs(row[0]) * trap.half[0] + abs(row[1]) * trap.half[1]) / trap.half[i] for i, row in enumerate(derivative)]
    return arb(rows[0].max(rows[1]).upper())
