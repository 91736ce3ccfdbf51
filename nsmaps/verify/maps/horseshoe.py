"""Horseshoes of a map given by formulas: sets that an iterate of it stretches across each other, in Arb balls.

A set is N = {c + M u: |u_i| <= 1} in n coordinates. N covers another one, N', if in the coordinates u of N' the image of N is
where |u_1| > 1 or all other |u_i| < 1, and those of its two ends u_1 = -1 and u_1 = 1 are beyond opposite ends of N' (in one
coordinate: the ends alone). What follows of sequences of sets, and of the topological entropy, is stated in
`nsmaps.verify.horseshoe`. All states of a set are shown to be in the stated pieces until they return, so that the iterate is
continuous on it.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import floor, isfinite
from typing import Any, NamedTuple

from flint import arb, arb_mat, ctx

from nsmaps.verify.formula import UnprovedError, may_meet, nearest_turn
from nsmaps.verify.horseshoe import entropy
from nsmaps.verify.maps.formula import PiecewiseFormulas, image

BITS = 80  #: of the middles of balls
MOST = 8192  #: parts of a set
WIDEST = 1.5  #: radians, below a quarter of a turn: of two sets one lift is looked at
KEYS, OF_SET = {"returns", "sets", "relations"}, {"centre", "matrix", "pieces"}

Vector = list[arb]


class Block(NamedTuple):
    """A set of states; its numbers are doubles, and exact."""

    centre: tuple[float, ...]
    matrix: tuple[tuple[float, ...], ...]  #: M; the first column is stretched
    pieces: tuple[int, ...]  #: of its states and of their images, until the last return


class Horseshoe(NamedTuple):
    """What a certificate states of a horseshoe."""

    returns: int  #: after which a set covers others
    sets: tuple[Block, ...]
    relations: tuple[tuple[int, int], ...]  #: numbers of a set and of one that it covers


class Chaos(NamedTuple):
    """What was proved of a horseshoe."""

    stated: Horseshoe
    entropy: float  #: lower bound of the topological entropy of the map
    parts: int  #: of sets and ends whose images were enclosed


def horseshoe_of(data: Any, formulas: PiecewiseFormulas) -> Horseshoe:
    """The statement of a horseshoe in a certificate; ValueError says what is wrong in it."""
    if not isinstance(data, Mapping) or set(data) != KEYS or not all(set(each) == OF_SET for each in data["sets"]):
        raise ValueError(f"a horseshoe needs {sorted(KEYS)}, and {sorted(OF_SET)} of each set")
    n, returns, sets = len(formulas.coordinates), data["returns"], []
    for each in data["sets"]:
        centre, matrix, pieces = tuple(each["centre"]), tuple(_rows(each["matrix"])), tuple(each["pieces"])
        numbers = [*centre, *(x for row in matrix for x in row)]
        if len(numbers) != n + n * n or not all(type(x) is float and isfinite(x) for x in numbers):
            raise ValueError(f"a set of a horseshoe is {each!r}; expected: finite decimal numbers, {n} and {n} rows of {n}")
        if any(angle and sum(abs(x) for x in row) > WIDEST for row, angle in zip(matrix, formulas.angles, strict=True)):
            raise ValueError(f"a set of a horseshoe is {each!r}; expected: within {WIDEST} radians of its centre")
        if len(pieces) != returns or not all(type(x) is int and 0 <= x < len(formulas.letters) for x in pieces):
            raise ValueError(
                f"{returns} returns are of the pieces {pieces}; expected: a number below {len(formulas.letters)} for each"
            )
        sets.append(Block(centre, matrix, pieces))
    relations = tuple((i, j) for i, j in data["relations"])
    if type(returns) is not int or returns < 1 or not sets:
        raise ValueError(f"a horseshoe of {len(sets)} sets and {returns} returns; expected: at least one of both")
    if (
        len(set(relations)) < len(relations)
        or not relations
        or not all(k in range(len(sets)) for pair in relations for k in pair)
    ):
        raise ValueError(f"the relations of a horseshoe must be different pairs of numbers below {len(sets)}, and at least one")
    return Horseshoe(returns, tuple(sets), relations)


def chaos_of(
    formulas: PiecewiseFormulas, stated: Horseshoe, progress: Callable[[int, int], Any] = lambda done, total: None
) -> Chaos:
    """What follows from a horseshoe; `UnprovedError` unless all its relations are shown, and its sets to be disjoint."""
    with ctx.workprec(BITS):
        for i, j in meeting(formulas, stated.sets):
            raise UnprovedError(f"sets {i} and {j} of the horseshoe are not shown to be disjoint")
        parts = 0
        for i, source in enumerate(stated.sets):
            for j in (j for k, j in stated.relations if k == i):
                parts += covers(formulas, source, stated.sets[j])
            progress(i + 1, len(stated.sets))
        return Chaos(stated, entropy(len(stated.sets), stated.relations) / stated.returns, parts)


def covers(formulas: PiecewiseFormulas, source: Block, target: Block) -> int:
    """Show that a set covers another one, and return the number of parts that this took; `UnprovedError` if it is not shown."""
    inverse, n = arb_mat([list(row) for row in target.matrix]).inv(), len(formulas.coordinates)
    ends = [[arb(sign), *(arb(0, 1) for _ in range(n - 1))] for sign in (-1, 1)]
    centre = _turned(formulas, _image(formulas, source, [arb(0)] * n)[0], target.centre)

    def seen(part: Vector) -> Vector:
        return _in_coordinates(inverse, centre, *_image(formulas, source, part), [x - x.mid() for x in part])

    sign = 1 if seen([arb(1), *[arb(0)] * (n - 1)])[0] > 0 else -1
    return (
        _satisfied(seen, ends[0], lambda u: -sign * u[0] > 1)
        + _satisfied(seen, ends[1], lambda u: sign * u[0] > 1)
        + _satisfied(seen, [arb(0, 1)] * n, lambda u: u[0].is_finite() and (abs(u[0]) > 1 or all(abs(x) < 1 for x in u[1:])))
    )


def meeting(formulas: PiecewiseFormulas, sets: Sequence[Block]) -> Iterator[tuple[int, int]]:
    """The pairs of sets that are not shown to be disjoint: no face of one separates it from the other, nor do their hulls."""
    inverses = [arb_mat([list(row) for row in each.matrix]).inv() for each in sets]
    hulls = [
        [arb(c) + sum((abs(arb(x)) for x in row), arb(0)) * arb(0, 1) for c, row in zip(s.centre, s.matrix, strict=True)]
        for s in sets
    ]
    for i, one in enumerate(sets):
        for j in range(i + 1, len(sets)):
            other = sets[j]
            pairs = zip(hulls[i], hulls[j], formulas.angles, strict=True)
            if not all(may_meet(x, y) if angle else x.overlaps(y) for x, y, angle in pairs):
                continue
            if not (_separated(formulas, one, other, inverses[i]) or _separated(formulas, other, one, inverses[j])):
                yield i, j


def in_words(formulas: PiecewiseFormulas, chaos: Chaos) -> str:
    """The theorem."""
    returns, sets, relations = chaos.stated
    name = "the map" if returns == 1 else f"its iterate {returns}"
    words = Counter("".join(formulas.letters[k] for k in each.pieces) for each in sets)
    counts = ", ".join(f"{count} in the pieces {word}" for word, count in words.items())
    return (
        f"Proved: {name} has a horseshoe of {len(sets)} disjoint sets of states ({counts}), of {len(relations)} pairs of which "
        "the first covers the second. Orbits that stay in the sets form a compact set, on which this map is continuous and "
        "semiconjugate to the subshift of these pairs: each sequence of them is that of some orbit, each periodic one that of a "
        f"cycle. The topological entropy of the map is at least {floor(1e9 * chaos.entropy) / 1e9}."
    )


def _rows(matrix: Any) -> Iterator[tuple[float, ...]]:
    """The rows of a matrix."""
    return (tuple(row) for row in matrix)


def _satisfied(seen: Callable[[Vector], Vector], part: Vector, test: Callable[[Vector], bool]) -> int:
    """Show that the image of a part of a set passes a test, cut as needed; the number of parts."""
    waiting, count = deque([part]), 0
    while waiting:
        part = waiting.popleft()
        count += 1
        if count > MOST:
            raise UnprovedError(f"a set is not shown to cover another one in {MOST} parts")
        try:
            passed = test(seen(part))
        except UnprovedError:
            passed = False
            if all(x.rad() < 2.0**-30 for x in part):
                raise
        if not passed:
            k = max(range(len(part)), key=lambda j: part[j].rad())
            if part[k].rad() < 2.0**-30:
                raise UnprovedError("a set does not cover another one that is stated")
            middle, radius = arb(part[k].mid()), arb(part[k].rad()) / 2
            waiting += [[*part[:k], middle + sign * radius + arb(0, 1) * radius, *part[k + 1 :]] for sign in (-1, 1)]
    return count


def _image(formulas: PiecewiseFormulas, source: Block, part: Vector) -> tuple[Vector, arb_mat]:
    """The image of the middle of a part of a set by all returns, and the derivative of the iterate by u for all of the part."""
    matrix = arb_mat([list(row) for row in source.matrix])
    way = arb_mat([[x - x.mid()] for x in part])
    shift = matrix * arb_mat([[arb(x.mid())] for x in part])
    middle, slope = [arb(c) + shift[k, 0] for k, c in enumerate(source.centre)], matrix
    for piece in source.pieces:
        reach = slope * way
        whole = [_placed(x, angle) for x, angle in zip(middle, formulas.angles, strict=True)]
        box = [x + reach[k, 0] for k, x in enumerate(whole)]
        jets = image(formulas, piece, box)
        slope = arb_mat([list(jet.slopes) for jet in jets]) * slope
        middle = [jet.value for jet in image(formulas, piece, whole)]
    return middle, slope


def _placed(x: arb, angle: bool) -> arb:
    """A coordinate, an angle on the turn from 0 to 2 pi of its middle."""
    if not angle:
        return x
    turn = (arb(x.mid()) / (2 * arb.pi())).floor().mid().floor().unique_fmpz()
    return x - 2 * int(turn or 0) * arb.pi()


def _turned(formulas: PiecewiseFormulas, image: Vector, centre: Sequence[float]) -> Vector:
    """The centre of a set on the turns of angles next to an image."""
    return [
        arb(c) + (2 * nearest_turn(x - c) * arb.pi() if angle else 0)
        for x, c, angle in zip(image, centre, formulas.angles, strict=True)
    ]


def _in_coordinates(inverse: arb_mat, centre: Vector, image: Vector, slope: arb_mat, way: Vector) -> Vector:
    """Balls that hold the image of a part, in the coordinates of a set."""
    found = inverse * arb_mat([[x - c] for x, c in zip(image, centre, strict=True)]) + (inverse * slope) * arb_mat(
        [[x] for x in way]
    )
    return [found[k, 0] for k in range(len(way))]


def _separated(formulas: PiecewiseFormulas, one: Block, other: Block, inverse: arb_mat) -> bool:
    """Whether the other set is beyond a face of the first."""
    centre = _turned(formulas, [arb(x) for x in other.centre], one.centre)
    way = inverse * arb_mat([[arb(x) - c] for x, c in zip(other.centre, centre, strict=True)])
    matrix = inverse * arb_mat([list(row) for row in other.matrix])
    n = len(centre)
    return any(abs(way[k, 0]) > 1 + sum((abs(matrix[k, j]) for j in range(n)), arb(0)) for k in range(n))
