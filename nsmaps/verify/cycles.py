"""Cycles: each is shown to exist and to be the only one near its stated impacts, with multipliers and stability, in Arb balls.

The unknowns of a cycle of m impacts are the phases and speeds x_1, ..., x_m just before these. With the impact map F, f(x) has
the parts F(x_1) - x_2, ..., F(x_m) - x_1, up to whole turns of the phase. X is the box of all x within stated radii of the stated
ones. On it each impact is shown to be followed by the stated one, no other coming before and after one number of turns, and f' is
enclosed. If with a matrix C

    K = c - C f(c) + (1 - C f'(X)) (X - c)

lies in the interior of X for the middle c of X, then C is regular and f has exactly one zero in X, which lies in K (R. Krawczyk,
Computing 4 (1969) 187). C is an inverse in doubles, whatever its errors. The numbers of the system are balls: the statement holds
for each system in them.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_mat, ctx

from nsmaps.verify.flights import Matrix, State, next_impact
from nsmaps.verify.formula import System, UnprovedError, may_meet, only_turn

BITS = 96  #: of the middles of balls
ROUNDS = 40  #: steps at most by which a box is narrowed
KEYS = {"walls", "states", "radii"}


class Stated(NamedTuple):
    """What a certificate states of a cycle; its numbers are doubles, and exact."""

    walls: tuple[int, ...]  #: of its impacts
    middle: tuple[float, ...]  #: phase and speed just before each impact
    radii: tuple[float, ...]  #: of phase and speed: within these it is the only cycle with its walls


class Cycle(NamedTuple):
    """A cycle that exists, with balls that hold its numbers."""

    walls: tuple[int, ...]
    states: tuple[State, ...]  #: phase and speed before each impact
    turns: int  #: periods of the force until it closes
    trace: arb  #: of the derivative of the map of all its impacts
    determinant: arb
    multipliers: tuple[arb, arb] | None  #: the larger first; None where they are not shown to be real
    kind: str  #: `stable`, `saddle`, or `open` where neither is shown


class Step(NamedTuple):
    """What `krawczyk` finds for a box."""

    box: list[arb]  #: K
    turns: int
    derivatives: list[Matrix]  #: of each impact by the one before, for all states of the box


def stated_of(data: Any, walls: int) -> Stated:
    """The statement of a cycle in a certificate of a system with a number of walls; ValueError says what is wrong in it."""
    if not isinstance(data, Mapping) or set(data) != KEYS:
        raise ValueError(f"a cycle has {sorted(data) if isinstance(data, Mapping) else data!r}; expected: {sorted(KEYS)}")
    letters, states, radii = data["walls"], data["states"], data["radii"]
    if not all(isinstance(x, list) and len(x) == len(letters) > 0 for x in (letters, states, radii)):
        raise ValueError("a cycle needs lists of walls, states and radii of the same length, at least one")
    if not all(type(x) is int and 0 <= x < walls for x in letters):
        raise ValueError(f"the walls of a cycle are {letters}; expected: numbers from 0 to {walls - 1}")
    pairs = [pair for pair in (*states, *radii) if not (isinstance(pair, list) and [type(x) for x in pair] == [float, float])]
    if pairs:
        raise ValueError(f"a state of a cycle, or its radii, is {pairs[0]!r}; expected: a phase and a speed as decimal numbers")
    for (phase, speed), (wide, high) in zip(states, radii, strict=True):
        if not (isfinite(phase) and 0 < wide < 1 and 0 < high < speed < inf):
            raise ValueError(
                f"a cycle has the phase {phase} and speed {speed} with the radii {wide} and {high}; "
                "expected: finite numbers, radii above zero, below one radian and below the speed"
            )
    return Stated(tuple(letters), tuple(x for pair in states for x in pair), tuple(x for pair in radii for x in pair))


def verified(system: System, stated: Stated) -> Cycle:
    """The cycle that is stated; `UnprovedError` unless it is shown to exist and to be the only one within its radii."""
    with ctx.workprec(BITS):
        middle = [arb(x) for x in stated.middle]
        box = [x + arb(0, radius) for x, radius in zip(middle, stated.radii, strict=True)]
        step = krawczyk(system, stated.walls, middle, box)
        if not all(x.contains_interior(y) for x, y in zip(box, step.box, strict=True)):
            raise UnprovedError(
                f"the cycle from phase {stated.middle[0]} and speed {stated.middle[1]} is not shown to exist within its radii"
            )
        for _ in range(ROUNDS):
            before, box = box, [x.intersection(y) for x, y in zip(box, step.box, strict=True)]
            step = krawczyk(system, stated.walls, [arb(x.mid()) for x in box], box)
            if sum(float(x.rad()) for x in box) > 0.99 * sum(float(x.rad()) for x in before):
                break
        return _described(stated.walls, box, step)


def all_verified(
    system: System, entries: Sequence[Any], progress: Callable[[int, int], Any] = lambda done, total: None
) -> tuple[Cycle, ...]:
    """The cycles of a certificate; `UnprovedError` or ValueError where one is not proved or may be one of the others."""
    cycles = []
    for i, entry in enumerate(entries):
        cycles.append(verified(system, stated_of(entry, len(system.walls))))
        progress(i + 1, len(entries))
    distinct(cycles)
    return tuple(cycles)


def distinct(cycles: Iterable[Cycle]) -> None:
    """`UnprovedError` unless no two of some cycles are the same, and none is a shorter one several times over."""
    known: dict[tuple[int, ...], list[Cycle]] = {}
    for cycle in cycles:
        for other in (*known.setdefault(tuple(sorted(cycle.walls)), []), cycle):
            for i, state in enumerate(other.states[other is cycle :]):
                if other.walls[i + (other is cycle)] == cycle.walls[0] and _meet(cycle.states[0], state):
                    raise UnprovedError(f"cycles are not shown to differ, at phase {state[0]} and speed {state[1]}")
        known[tuple(sorted(cycle.walls))].append(cycle)


def krawczyk(system: System, walls: Sequence[int], middle: list[arb], box: list[arb]) -> Step:
    """K for a vector in a box; `UnprovedError` unless each impact of the box is followed by the next one of the cycle."""
    images, derivatives = _images(system, walls, box)
    turns, size = _turns(images, box), len(middle)
    gaps = _gaps(_images(system, walls, middle)[0], middle, turns)
    slope = arb_mat(size, size)
    for i, derivative in enumerate(derivatives):
        k = 2 * ((i + 1) % len(derivatives))
        for row in (0, 1):
            for column in (0, 1):
                slope[2 * i + row, 2 * i + column] += derivative[row][column]
            slope[2 * i + row, k + row] -= 1
    try:
        inverse = np.linalg.inv(np.array([[float(slope[i, j].mid()) for j in range(size)] for i in range(size)]))
    except np.linalg.LinAlgError as error:
        raise UnprovedError("the derivative of a cycle is singular") from error
    c, one = arb_mat(inverse.tolist()), arb_mat([[int(i == j) for j in range(size)] for i in range(size)])
    way = arb_mat([[x - y] for x, y in zip(box, middle, strict=True)])
    move = (one - c * slope) * way - c * arb_mat([[x] for x in gaps])
    return Step([x + move[i, 0] for i, x in enumerate(middle)], sum(turns), derivatives)


def _images(system: System, walls: Sequence[int], x: Sequence[arb]) -> tuple[list[State], list[Matrix]]:
    """The impact after each state of a vector, and the derivatives; `UnprovedError` unless it is on the wall of the next."""
    states, derivatives = [], []
    for i, wall in enumerate(walls):
        impact, expected = next_impact(system, wall, x[2 * i], x[2 * i + 1]), walls[(i + 1) % len(walls)]
        if impact.wall != expected:
            raise UnprovedError(f"impact {i + 1} of a cycle is followed by one on wall {impact.wall}, not {expected}")
        states.append((impact.phase, impact.speed))
        derivatives.append(impact.derivative)
    return states, derivatives


def _turns(images: Sequence[State], box: Sequence[arb]) -> list[int]:
    """The periods that pass until each next impact; `UnprovedError` unless they are the same for all cycles in a box."""
    found = []
    for i, (phase, _) in enumerate(images):
        turns = only_turn(phase - box[2 * (i + 1) % len(box)])
        if turns is None:
            raise UnprovedError(
                f"impact {i + 1} of a cycle is not shown to be followed by the next one after one number of periods"
            )
        found.append(turns)
    return found


def _gaps(images: Sequence[State], x: Sequence[arb], turns: Sequence[int]) -> list[arb]:
    """f at a vector."""
    gaps = []
    for i, (phase, speed) in enumerate(images):
        k = 2 * (i + 1) % len(x)
        gaps += [phase - x[k] - 2 * turns[i] * arb.pi(), speed - x[k + 1]]
    return gaps


def _described(walls: tuple[int, ...], box: list[arb], step: Step) -> Cycle:
    """A cycle in a box, with what follows from the derivatives of its impacts there."""
    product, determinant = arb_mat([[1, 0], [0, 1]]), arb(1)
    for derivative in step.derivatives:
        factor = arb_mat([list(row) for row in derivative])
        product, determinant = factor * product, determinant * factor.det()
    trace = product[0, 0] + product[1, 1]
    real = trace * trace - 4 * determinant
    kind = "stable" if abs(trace) < 1 + determinant and determinant < 1 else "saddle" if abs(trace) > 1 + determinant else "open"
    multipliers = None
    if real > 0 and (trace > 0 or trace < 0):
        large = (trace + trace.sgn() * real.sqrt()) / 2
        multipliers = large, determinant / large
    states = tuple((box[i], box[i + 1]) for i in range(0, len(box), 2))
    return Cycle(walls, states, step.turns, trace, determinant, multipliers, kind)


def _meet(a: State, b: State) -> bool:
    """Whether two balls of states may have a state in common, up to whole turns of the phase."""
    return bool(a[1].overlaps(b[1])) and may_meet(a[0], b[0])
