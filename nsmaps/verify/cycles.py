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
from functools import partial
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_mat, ctx

from nsmaps.verify.flights import State, next_impact
from nsmaps.verify.formula import System, UnprovedError, may_meet, only_turn

BITS = 96  #: of the middles of balls
ROUNDS = 40  #: steps at most by which a box is narrowed
KEYS = {"walls", "states", "radii"}
ANGLES = True, False  #: which coordinates are angles: the phase


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
    """What Krawczyk's operator finds for a box of the states of a cycle."""

    box: list[arb]  #: K
    turns: tuple[int, ...]  #: of each coordinate until the cycle closes, zero of others than angles
    derivatives: list[arb_mat]  #: of each state by the one before, for all states of the box


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
        start = f"phase {stated.middle[0]} and speed {stated.middle[1]}"
        box, step = existing(partial(krawczyk, system, stated.walls), stated.middle, stated.radii, start)
        return _described(stated.walls, box, step)


def existing(
    krawczyk: Callable[[list[arb], list[arb]], Step], states: Sequence[float], radii: Sequence[float], start: str
) -> tuple[list[arb], Step]:
    """The box of a cycle, narrowed, and Krawczyk's step for it; `UnprovedError` unless it exists, alone within its radii."""
    middle = [arb(x) for x in states]
    box = [x + arb(0, radius) for x, radius in zip(middle, radii, strict=True)]
    step = krawczyk(middle, box)
    if not all(x.contains_interior(y) for x, y in zip(box, step.box, strict=True)):
        raise UnprovedError(f"the cycle from {start} is not shown to exist within its radii")
    for _ in range(ROUNDS):
        before, box = box, [x.intersection(y) for x, y in zip(box, step.box, strict=True)]
        step = krawczyk([arb(x.mid()) for x in box], box)
        if sum(float(x.rad()) for x in box) > 0.99 * sum(float(x.rad()) for x in before):
            break
    return box, step


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
                if other.walls[i + (other is cycle)] == cycle.walls[0] and meet(ANGLES, cycle.states[0], state):
                    raise UnprovedError(f"cycles are not shown to differ, at phase {state[0]} and speed {state[1]}")
        known[tuple(sorted(cycle.walls))].append(cycle)


def krawczyk(system: System, walls: Sequence[int], middle: list[arb], box: list[arb]) -> Step:
    """K for a vector in a box; `UnprovedError` unless each impact of the box is followed by the next one of the cycle."""
    return step_of(partial(_images, system, walls), ANGLES, middle, box)


def _images(system: System, walls: Sequence[int], x: Sequence[arb]) -> tuple[list[arb], list[arb_mat]]:
    """The impact after each state of a vector, and the derivatives; `UnprovedError` unless it is on the wall of the next."""
    states, derivatives = [], []
    for i, wall in enumerate(walls):
        impact, expected = next_impact(system, wall, x[2 * i], x[2 * i + 1]), walls[(i + 1) % len(walls)]
        if impact.wall != expected:
            raise UnprovedError(f"impact {i + 1} of a cycle is followed by one on wall {impact.wall}, not {expected}")
        states += [impact.phase, impact.speed]
        derivatives.append(arb_mat([list(row) for row in impact.derivative]))
    return states, derivatives


def step_of(
    follow: Callable[[Sequence[arb]], tuple[list[arb], list[arb_mat]]],
    angles: Sequence[bool],
    middle: list[arb],
    box: list[arb],
) -> Step:
    """K for the vector of the states of a cycle in a box.

    Args:
        follow: gives the state that follows each state of a vector, and its derivative; may raise `UnprovedError`.
        angles: which coordinates of a state are the same up to whole turns.
        middle: a vector in the box.
        box: a ball for each entry.

    Raises:
        UnprovedError: the turns until a next state may differ in the box, or the derivative is singular.
    """
    (images, derivatives), n, size = follow(box), len(angles), len(box)
    turns = _turns(angles, images, box)
    near, _ = follow(middle)
    gaps = [x - middle[(i + n) % size] - 2 * turns[i] * arb.pi() for i, x in enumerate(near)]
    slope = arb_mat(size, size)
    for i, derivative in enumerate(derivatives):
        after = n * ((i + 1) % len(derivatives))
        for row in range(n):
            for column in range(n):
                slope[n * i + row, n * i + column] += derivative[row, column]
            slope[n * i + row, after + row] -= 1
    try:
        inverse = np.linalg.inv(np.array([[float(slope[i, j].mid()) for j in range(size)] for i in range(size)]))
    except np.linalg.LinAlgError as error:
        raise UnprovedError("the derivative of a cycle is singular") from error
    c = arb_mat(inverse.tolist())
    way = arb_mat([[x - y] for x, y in zip(box, middle, strict=True)])
    move = (identity(size) - c * slope) * way - c * arb_mat([[x] for x in gaps])
    return Step([x + move[i, 0] for i, x in enumerate(middle)], tuple(sum(turns[i::n]) for i in range(n)), derivatives)


def _turns(angles: Sequence[bool], images: Sequence[arb], box: Sequence[arb]) -> list[int]:
    """By how many turns each image exceeds the next state; `UnprovedError` unless they are the same for all cycles in a box."""
    n, found = len(angles), []
    for i, x in enumerate(images):
        turns = only_turn(x - box[(i + n) % len(box)]) if angles[i % n] else 0
        if turns is None:
            raise UnprovedError(
                f"state {i // n + 1} of a cycle is not shown to be followed by the next after one number of turns"
            )
        found.append(turns)
    return found


def identity(size: int) -> arb_mat:
    """The unit matrix."""
    return arb_mat([[int(i == j) for j in range(size)] for i in range(size)])


def _described(walls: tuple[int, ...], box: list[arb], step: Step) -> Cycle:
    """A cycle in a box, with what follows from the derivatives of its impacts there."""
    product, determinant = identity(2), arb(1)
    for derivative in step.derivatives:
        product, determinant = derivative * product, determinant * derivative.det()
    trace = product[0, 0] + product[1, 1]
    real = trace * trace - 4 * determinant
    kind = "stable" if abs(trace) < 1 + determinant and determinant < 1 else "saddle" if abs(trace) > 1 + determinant else "open"
    multipliers = None
    if real > 0 and (trace > 0 or trace < 0):
        large = (trace + trace.sgn() * real.sqrt()) / 2
        multipliers = large, determinant / large
    states = tuple((box[i], box[i + 1]) for i in range(0, len(box), 2))
    return Cycle(walls, states, step.turns[0], trace, determinant, multipliers, kind)


def meet(angles: Sequence[bool], a: Sequence[arb], b: Sequence[arb]) -> bool:
    """Whether two balls of states may have a state in common, up to whole turns of angles."""
    return all(may_meet(x, y) if angle else bool(x.overlaps(y)) for x, y, angle in zip(a, b, angles, strict=True))
