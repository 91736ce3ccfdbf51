"""Horseshoes: parallelograms of states that the return map stretches across each other, so that it has chaos, in Arb balls.

The return map R, here the first return or an iterate of it by a stated number of returns, leads from an impact on a stated wall
to an impact on it. A set is N = {c + M (x, y): |x| <= 1, |y| <= 1}.
N covers another one, N', if in the coordinates (x, y) of N' the image R(N) is where |y| < 1 or |x| > 1, and the images of the two
edges |x| = 1 of N are at x < -1 and at x > 1, one each. If each of a sequence of sets covers the next one, some orbit passes them
all, and a periodic orbit if the sequence is periodic (P. Zgliczynski, M. Gidea, J. Differential Equations 202 (2004) 32).

The sets are shown to be disjoint, and all states of one to have the same impacts until they return, so that R is continuous on
them. The orbits that stay in the sets, each covering the next, form a compact set that R maps into itself; the sets that they
pass make R there semiconjugate to the subshift of the matrix of relations. So the topological entropy of R is at least the
logarithm of the spectral radius of that matrix A, and the spectral radius at least min (A x)_i/x_i over x_i > 0, for any x >= 0.
That of the first return is at least this divided by the number of returns, as it too is continuous on the images of these states.
"""

from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from math import floor, isfinite
from typing import Any, NamedTuple

import numpy as np
from flint import arb, ctx, fmpq

from nsmaps.verify.flights import Matrix, inverse_of, next_impacts, times
from nsmaps.verify.formula import System, UnprovedError, nearest_turn

BITS = 80  #: of the middles of balls
MOST = 8192  #: parts of a set
FIRST = 10.0  #: largest phase of a centre: differences in doubles, to choose pairs, are within the 1e-9 that is allowed for
ROUNDS, SCALE = 4096, 2**48  #: of the power iteration, and of its vector as whole numbers
KEYS, OF_SET = {"wall", "returns", "sets", "relations"}, {"centre", "matrix", "walls"}

Pair = tuple[arb, arb]
Test = Callable[[int, arb, arb], bool | None]  #: of the number of a set, and coordinates x and y in it; None: not known


class Parallelogram(NamedTuple):
    """A set of states of the wall; its numbers are doubles, and exact."""

    centre: tuple[float, float]  #: phase and impact speed
    matrix: tuple[tuple[float, float], tuple[float, float]]  #: M; the first column is stretched
    walls: tuple[int, ...]  #: of the impacts until the last return


class Horseshoe(NamedTuple):
    """What a certificate states of a horseshoe."""

    wall: int
    returns: int  #: to it, after which a set covers others
    sets: tuple[Parallelogram, ...]
    relations: tuple[tuple[int, int], ...]  #: numbers of a set and of one that it covers


class Chaos(NamedTuple):
    """What was proved of a horseshoe."""

    stated: Horseshoe
    entropy: float  #: lower bound of the topological entropy of the first return
    parts: int  #: of sets and edges whose images were enclosed


def horseshoe_of(data: Any, walls: int) -> Horseshoe:
    """The statement of a horseshoe in a certificate of a system with a number of walls; ValueError says what is wrong in it."""
    if not isinstance(data, Mapping) or set(data) != KEYS or not all(set(each) == OF_SET for each in data["sets"]):
        raise ValueError(f"a horseshoe needs {sorted(KEYS)}, and {sorted(OF_SET)} of each set")
    sets, home, returns = [], data["wall"], data["returns"]
    if type(home) is not int or type(returns) is not int or returns < 1:
        raise ValueError(f"a horseshoe is of {returns} returns to wall {home}; expected: whole numbers, the first above zero")
    for each in data["sets"]:
        (phase, speed), ((a, b), (c, d)), word = each["centre"], each["matrix"], each["walls"]
        if not all(type(x) is float and isfinite(x) for x in (phase, speed, a, b, c, d)):
            raise ValueError(f"a set of a horseshoe is {each!r}; expected: finite decimal numbers")
        if not (abs(a) + abs(b) < 1 and abs(c) + abs(d) < speed and abs(phase) < FIRST):
            raise ValueError(
                f"a set of a horseshoe is {each!r}; expected: within one radian of a centre on the first turn, at speeds above 0"
            )
        if not all(type(x) is int and 0 <= x < walls for x in word) or word.count(home) != returns or word[-1] != home:
            raise ValueError(f"{returns} returns have the impacts {word}; expected: as many on wall {home}, one of them the last")
        sets.append(Parallelogram((phase, speed), ((a, b), (c, d)), tuple(word)))
    relations = tuple((i, j) for i, j in data["relations"])
    numbers = range(len(sets))
    if not relations or len(set(relations)) < len(relations) or not all(i in numbers and j in numbers for i, j in relations):
        raise ValueError(f"the relations of a horseshoe must be different pairs of numbers below {len(sets)}, and at least one")
    return Horseshoe(home, returns, tuple(sets), relations)


def chaos_of(system: System, stated: Horseshoe, progress: Callable[[int, int], Any] = lambda done, total: None) -> Chaos:
    """What follows from a horseshoe; `UnprovedError` unless all its relations are shown, and its sets to be disjoint."""
    with ctx.workprec(BITS):
        for i, j in meeting(stated.sets):
            raise UnprovedError(f"sets {i} and {j} of the horseshoe are not shown to be disjoint")
        parts = 0
        for i, source in enumerate(stated.sets):
            targets = [j for k, j in stated.relations if k == i]
            parts += covers(system, stated.wall, source, [stated.sets[j] for j in targets])
            progress(i + 1, len(stated.sets))
        bound = entropy(len(stated.sets), stated.relations) / stated.returns
        return Chaos(stated, float(np.nextafter(bound, 0)), parts)


def covers(system: System, wall: int, source: Parallelogram, targets: Sequence[Parallelogram]) -> int:
    """Show that a set covers others, and return the number of parts that this took; `UnprovedError` if it is not shown."""
    one, side = arb(1), arb(0, 1)
    image = _Image(system, wall, source, targets)
    signs = [1 if x > 0 else -1 for (x, _), _ in image.of(one, arb(0))]
    return (
        image.satisfies(side, side, 1, lambda k, x, y: _either(abs(y) < 1 or abs(x) > 1, abs(y) >= 1 and abs(x) <= 1))
        + image.satisfies(one, side, 0, lambda k, x, y: _either(signs[k] * x > 1, signs[k] * x <= 1))
        + image.satisfies(-one, side, 0, lambda k, x, y: _either(signs[k] * x < -1, signs[k] * x >= -1))
    )


def meeting(sets: Sequence[Parallelogram]) -> list[tuple[int, int]]:
    """The pairs of sets that are not shown to be disjoint: no edge of one separates it from the other."""
    reach = np.array([[abs(each.matrix[k][0]) + abs(each.matrix[k][1]) for k in (0, 1)] for each in sets]) * (1 + 1e-9)
    centres, pairs = np.array([each.centre for each in sets]), []
    for i, one in enumerate(sets):
        way = centres[i + 1 :] - centres[i]
        turns = np.round(way[:, 0] / (2 * np.pi)).astype(int)
        way[:, 0] -= turns * (2 * np.pi)
        for k in np.flatnonzero((np.abs(way) <= reach[i + 1 :] + reach[i] + 1e-9).all(axis=1)).tolist():
            other, shift = sets[i + 1 + k], 2 * arb.pi() * int(turns[k])
            if not _separated(one, other, shift) and not _separated(other, one, -shift):
                pairs.append((i, i + 1 + k))
    return pairs


def entropy(size: int, relations: Sequence[tuple[int, int]]) -> float:
    """A lower bound of the logarithm of the spectral radius of the matrix of relations."""
    x, rows = np.ones(size), np.array(relations)
    for _ in range(ROUNDS):
        y = x + np.bincount(rows[:, 0], weights=x[rows[:, 1]], minlength=size)
        x = y / y.max()
    whole, image = [int(SCALE * value) for value in x], [0] * size
    for i, j in relations:
        image[i] += whole[j]
    least = min(Fraction(a, b) for a, b in zip(image, whole, strict=True) if b)
    if not least > 1:
        raise UnprovedError(
            f"the relations of the horseshoe give no chaos: the bound of the spectral radius is {float(least):.6g}"
        )
    return float(np.nextafter(float(arb(fmpq(least.numerator, least.denominator)).log().lower()), 0))


def in_words(chaos: Chaos, letters: Sequence[str]) -> str:
    """The theorem, with the letters of walls."""
    wall, returns, sets, relations = chaos.stated
    name = "first return" if returns == 1 else f"return number {returns}"
    words = Counter("".join(letters[k] for k in (wall, *each.walls)) for each in sets)
    counts = ", ".join(f"{count} with the impacts {word}" for word, count in words.items())
    return (
        f"Proved: the {name} to wall {letters[wall]} has a horseshoe of {len(sets)} disjoint parallelograms of states "
        f"({counts}), of {len(relations)} pairs of which the "
        "first covers the second. Orbits that stay in the parallelograms form a compact set, on which this map is "
        "continuous and semiconjugate to the subshift of these pairs: each sequence of them is that of some orbit, each periodic "
        f"one that of a cycle. The topological entropy of the first return is at least {floor(1e9 * chaos.entropy) / 1e9}."
    )


class _UnmetRelationError(UnprovedError):
    """A relation does not hold."""


class _Image:
    """The image of a set by the return map, in the coordinates of other sets."""

    def __init__(self, system: System, wall: int, source: Parallelogram, targets: Sequence[Parallelogram]) -> None:
        self.system, self.wall, self.source = system, wall, source
        self.matrix: Matrix = tuple(tuple(map(arb, row)) for row in source.matrix)  # type: ignore[assignment]
        self.inverses, self.centres = [inverse_of(each.matrix) for each in targets], []
        phase = self._returned(arb(0), arb(0))[0][0]
        for each in targets:
            turns = nearest_turn(phase - each.centre[0])
            self.centres.append((arb(each.centre[0]) + 2 * turns * arb.pi(), arb(each.centre[1])))

    def of(self, x: arb, y: arb) -> list[tuple[Pair, tuple[Pair, Pair]]]:
        """Balls that hold the image of a part, in the coordinates of each other set, and what x and y add to their radii."""
        point, slope = self._returned(x, y)
        way, found = (x - x.mid(), y - y.mid()), []
        for inverse, centre in zip(self.inverses, self.centres, strict=True):
            gap = point[0] - centre[0], point[1] - centre[1]
            (a, b), (c, d) = parts = [[row[k] * way[k] for k in (0, 1)] for row in times(inverse, slope)]
            u, v = (row[0] * gap[0] + row[1] * gap[1] for row in inverse)
            found.append(((u + a + b, v + c + d), parts))
        return found  # type: ignore[return-value]

    def satisfies(self, x: arb, y: arb, row: int, test: Test) -> int:
        """Show that the image of a part passes a test for all other sets, cut as needed; the number of parts.

        It is cut along what adds most to a coordinate of the image, x or y by the number of a row.
        """
        parts, count = deque([(x, y)]), 0
        while parts:
            x, y = parts.popleft()
            count += 1
            if count > MOST:
                raise UnprovedError(f"the image of the set at {self.source.centre} is not shown to cover others in {MOST} parts")
            wide = [(_size(self.matrix[0][k]) + _size(self.matrix[1][k])) * _size(z.rad()) for k, z in enumerate((x, y))]
            try:
                seen = [(test(k, *place), shares[row]) for k, (place, shares) in enumerate(self.of(x, y))]
                failed = [share for passed, share in seen if not passed]
                if any(passed is False for passed, _ in seen):
                    raise _UnmetRelationError(f"the set at {self.source.centre} does not cover one of those stated")
            except _UnmetRelationError:
                raise
            except UnprovedError:
                failed = [wide]  # type: ignore[list-item]
            if failed:
                first, second = (max(_size(share[k]) for share in failed) for k in (0, 1))
                parts += [(half, y) for half in _halves(x)] if first > second else [(x, half) for half in _halves(y)]
        return count

    def _returned(self, x: arb, y: arb) -> tuple[Pair, Matrix]:
        """The return from the middle of a part, and the derivative of the return by x and y for all of it."""
        m, (u, v), middle = self.matrix, self.source.centre, (arb(x.mid()), arb(y.mid()))
        point: Pair = tuple(c + row[0] * middle[0] + row[1] * middle[1] for c, row in zip((u, v), m, strict=True))  # type: ignore[assignment]
        walls, end, slope = next_impacts(self.system, self.wall, point, m, (x - middle[0], y - middle[1]), len(self.source.walls))
        if walls != self.source.walls:
            raise _UnmetRelationError(
                f"a return from the set at {self.source.centre} has the impacts {walls}, not {self.source.walls}"
            )
        return end, slope


def _separated(one: Parallelogram, other: Parallelogram, shift: arb) -> bool:
    """Whether all corners of the other set, moved back in phase by a shift, are beyond one edge of the first."""
    gap = arb(other.centre[0]) - shift - one.centre[0], arb(other.centre[1]) - one.centre[1]
    for u, v in inverse_of(one.matrix):
        middle = u * gap[0] + v * gap[1]
        wide = sum(abs(u * other.matrix[0][k] + v * other.matrix[1][k]) for k in (0, 1))
        if abs(middle) > 1 + wide:
            return True
    return False


def _either(yes: bool, no: bool) -> bool | None:
    """What is known of a condition."""
    return True if yes else False if no else None


def _size(x: arb | float) -> float:
    """About the largest absolute value in a ball."""
    return float(abs(arb(x)).upper())


def _halves(x: arb) -> tuple[arb, arb]:
    """The two halves of a ball, one within the other of which no number is lost."""
    middle, half = arb(x.mid()), arb(x.rad()) / 2
    return tuple(middle + sign * half + arb(0, 1) * half for sign in (-1, 1))  # type: ignore[return-value]
