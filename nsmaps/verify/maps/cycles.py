"""Cycles of a map given by formulas: each shown to exist and to be the only one of its pieces near its stated states.

As in `nsmaps.verify.cycles`, with Krawczyk's operator for the vector of all states of a cycle, here of n coordinates each.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import isfinite
from typing import Any, NamedTuple

from flint import acb, acb_mat, arb, arb_mat, ctx

from nsmaps.verify.cycles import BITS, Step, existing, identity, meet, step_of
from nsmaps.verify.formula import UnprovedError
from nsmaps.verify.maps.formula import PiecewiseFormulas, image

KEYS = {"pieces", "states", "radii"}

Point = tuple[arb, ...]


class Stated(NamedTuple):
    """What a certificate states of a cycle of q states; its numbers are doubles, and exact."""

    pieces: tuple[int, ...]  #: of its states
    states: tuple[tuple[float, ...], ...]  #: shape (q, n)
    radii: tuple[tuple[float, ...], ...]  #: shape (q, n): within these it is the only cycle of its pieces


class Cycle(NamedTuple):
    """A cycle that exists, with balls that hold its numbers."""

    pieces: tuple[int, ...]
    states: tuple[Point, ...]
    turns: tuple[int, ...]  #: of each angle, zero of others, until it closes
    derivative: arb_mat  #: of the map of all its returns, shape (n, n)
    multipliers: tuple[acb | arb, ...]  #: none where they are not shown to be different from each other
    kind: str  #: `stable`, `unstable`, or `open` where neither is shown


def stated_of(data: Any, formulas: PiecewiseFormulas) -> Stated:
    """The statement of a cycle in a certificate; ValueError says what is wrong in it."""
    if not isinstance(data, Mapping) or set(data) != KEYS:
        raise ValueError(f"a cycle has {sorted(data) if isinstance(data, Mapping) else data!r}; expected: {sorted(KEYS)}")
    pieces, states, radii = (tuple(data[key]) for key in ("pieces", "states", "radii"))
    n = len(formulas.coordinates)
    if not len(pieces) == len(states) == len(radii) > 0 or any(len(row) != n for row in (*states, *radii)):
        raise ValueError(f"a cycle needs as many pieces as states and radii, each of {n} numbers")
    if not all(type(x) is int and 0 <= x < len(formulas.letters) for x in pieces):
        raise ValueError(f"the pieces of a cycle are {pieces}; expected: numbers from 0 to {len(formulas.letters) - 1}")
    if (
        not all(type(x) is float and isfinite(x) for row in (*states, *radii) for x in row)
        or min(x for row in radii for x in row) <= 0
    ):
        raise ValueError("a state of a cycle, or a radius, is not a finite decimal number, or a radius is not above zero")
    return Stated(pieces, tuple(tuple(row) for row in states), tuple(tuple(row) for row in radii))


def verified(formulas: PiecewiseFormulas, stated: Stated) -> Cycle:
    """The cycle that is stated; `UnprovedError` unless it is shown to exist and to be the only one within its radii."""
    with ctx.workprec(BITS):
        states, radii = ([x for row in rows for x in row] for rows in (stated.states, stated.radii))
        box, step = existing(partial(krawczyk, formulas, stated.pieces), states, radii, str(stated.states[0]))
        return _described(formulas, stated.pieces, box, step)


def all_verified(
    formulas: PiecewiseFormulas, entries: Sequence[Any], progress: Callable[[int, int], Any] = lambda done, total: None
) -> tuple[Cycle, ...]:
    """The cycles of a certificate; `UnprovedError` or ValueError where one is not proved or may be one of the others."""
    cycles: list[Cycle] = []
    for i, entry in enumerate(entries):
        cycle = verified(formulas, stated_of(entry, formulas))
        for other in (*cycles, cycle):
            first = 1 if other is cycle else 0
            if any(meet(formulas.angles, cycle.states[0], state) for state in other.states[first:]):
                raise UnprovedError(f"cycles are not shown to differ, at {[x.str(6) for x in cycle.states[0]]}")
        cycles.append(cycle)
        progress(i + 1, len(entries))
    return tuple(cycles)


def krawczyk(formulas: PiecewiseFormulas, pieces: Sequence[int], middle: list[arb], box: list[arb]) -> Step:
    """K for a vector in a box; `UnprovedError` unless each state of the box is in its piece."""
    return step_of(partial(_images, formulas, pieces), formulas.angles, middle, box)


def _images(formulas: PiecewiseFormulas, pieces: Sequence[int], x: Sequence[arb]) -> tuple[list[arb], list[arb_mat]]:
    """The image of each state of a vector, in the order of the states, and the derivatives."""
    n = len(formulas.coordinates)
    found = [image(formulas, piece, x[n * i : n * i + n]) for i, piece in enumerate(pieces)]
    return [jet.value for row in found for jet in row], [arb_mat([list(jet.slopes) for jet in row]) for row in found]


def _described(formulas: PiecewiseFormulas, pieces: tuple[int, ...], box: list[arb], step: Step) -> Cycle:
    """A cycle in a box, with what follows from the derivatives of its returns there."""
    n = len(formulas.coordinates)
    product = identity(n)
    for derivative in step.derivatives:
        product = derivative * product
    try:
        multipliers = (product[0, 0],) if n == 1 else tuple(_real(x) for x in acb_mat(product).eig())
    except ValueError:
        multipliers = ()
    kind = "open"
    if multipliers and all(abs(x) < 1 for x in multipliers):
        kind = "stable"
    elif any(abs(x) > 1 for x in multipliers) or abs(product.det()) > 1:
        kind = "unstable"
    states = tuple(tuple(box[i : i + n]) for i in range(0, len(box), n))
    return Cycle(pieces, states, step.turns, product, multipliers, kind)


def _real(x: acb) -> acb | arb:
    """A multiplier, real where its ball is symmetric: it then holds its conjugate, and it holds one multiplier alone."""
    return x.real if x.imag.mid() == 0 else x
