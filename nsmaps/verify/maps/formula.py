"""A map given by formulas in pieces, in Arb balls: its values, its derivatives, and the pieces that states of a box may be in.

The text of formulas is a part of Python's syntax: whole and decimal numbers, which stand for the doubles nearest to them, names
of coordinates and parameters, pi, e, + - * / **, the functions of `jets`, comparisons, `and`, `or` and `not`. The first piece
whose condition is true applies, and angles are in [0, 2 pi). Where a function has a kink, its derivative is the ball of the
slopes on both sides: for states x, y of a box f(x) - f(y) is in the derivative times x - y, as it is where there is none.
"""

import ast
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from flint import arb

from nsmaps.verify.formula import UnprovedError, ball
from nsmaps.verify.maps.conditions import narrowed, truth, with_condition
from nsmaps.verify.maps.jets import FUNCTIONS, Jet, Known, constant, jet_of

KEYS = {"coordinates", "angles", "parameters", "pieces"}
WIDER = 1 + 2.0**-20


class PiecewiseFormulas(NamedTuple):
    """A map of n coordinates."""

    coordinates: tuple[str, ...]
    angles: tuple[bool, ...]  #: shape (n,)
    numbers: Mapping[str, arb]  #: of the parameters, and pi
    letters: tuple[str, ...]  #: of the pieces
    conditions: tuple[ast.expr, ...]  #: of the pieces
    images: tuple[tuple[ast.expr, ...], ...]  #: of the pieces, of the coordinates


def map_of(data: Mapping[str, Any]) -> PiecewiseFormulas:
    """The map of a certificate; ValueError says what is wrong in it."""
    if set(data) != KEYS:
        raise ValueError(f"a map has {sorted(data)}; expected: {sorted(KEYS)}")
    names, angles = tuple(data["coordinates"]), tuple(data["angles"])
    numbers = {name: value for name, value in (("pi", arb.pi()), ("e", arb.const_e())) if name not in names}
    for name, entry in data["parameters"].items():
        numbers[name] = ball(entry)
    if not all(x.is_finite() for x in numbers.values()) or len({*names, *numbers}) < len(names) + len(numbers):
        raise ValueError("a number of a map is not finite, or a name is given twice")
    if len(angles) != len(names) or not names or not all(type(x) is bool for x in angles) or not data["pieces"]:
        raise ValueError("a map needs coordinates, for each whether it is an angle, and pieces")
    pieces, known = data["pieces"], {*names, *numbers}
    conditions = tuple(_parsed(piece["condition"], known) for piece in pieces)
    images = tuple(tuple(_parsed(piece["image"][name], known) for name in names) for piece in pieces)
    return PiecewiseFormulas(names, angles, numbers, tuple(str(piece["letter"]) for piece in pieces), conditions, images)


def pieces_of(formulas: PiecewiseFormulas, box: Sequence[arb]) -> Iterator[tuple[int, list[arb], Known]]:
    """The pieces that states of a box may be in, each with the part of the box that is, and what is known there.

    `UnprovedError` where a state may be in none.
    """
    known, part = Known(), list(box)
    for k, condition in enumerate(formulas.conditions):
        values = _jets(formulas, part)
        here = truth(condition, values, known)
        if here is not False:
            narrow = narrowed(condition, True, formulas.coordinates, formulas.numbers, part)
            if narrow is not None:
                yield k, narrow, with_condition(condition, True, known)
        if here is True:
            return
        known, remainder = (
            with_condition(condition, False, known),
            narrowed(condition, False, formulas.coordinates, formulas.numbers, part),
        )
        if remainder is None:
            return
        part = remainder
    raise UnprovedError(f"a state with {_written(formulas, box)} may be in no piece")


def image(formulas: PiecewiseFormulas, piece: int, box: Sequence[arb]) -> list[Jet]:
    """The images of all states of a box and their derivatives; `UnprovedError` unless these are shown to be in one piece."""
    for x, angle, name in zip(box, formulas.angles, formulas.coordinates, strict=True):
        if angle and not (x >= 0 and x < 2 * arb.pi()):
            raise UnprovedError(f"states with {name} = {x.str(6)} may be on both sides of the angle 0")
    found = list(pieces_of(formulas, box))
    if [k for k, _, _ in found] != [piece]:
        others = ", ".join(formulas.letters[k] for k, _, _ in found)
        raise UnprovedError(
            f"states with {_written(formulas, box)} may be in the pieces {others}, not in {formulas.letters[piece]} alone"
        )
    return jets(formulas, piece, box, found[0][2])


def jets(formulas: PiecewiseFormulas, piece: int, box: Sequence[arb], known: Known) -> list[Jet]:
    """The formulas of a piece over a box; a value that is not finite says that nothing is known."""
    values = _jets(formulas, box)
    return [jet_of(formula, values, known) for formula in formulas.images[piece]]


def hull(formulas: PiecewiseFormulas, piece: int, box: Sequence[arb], known: Known) -> list[arb]:
    """Balls that hold the images of a box in a piece: by the formulas, and by the derivatives around the middle of the box.

    The second are left out where they would be no smaller, as of formulas that are linear in each coordinate.
    """
    found = jets(formulas, piece, box, known)
    spreads = [sum((abs(slope) * x.rad() for slope, x in zip(jet.slopes, box, strict=True)), arb(0)) for jet in found]
    if all(jet.value.rad() <= WIDER * spread for jet, spread in zip(found, spreads, strict=True)):
        return [jet.value for jet in found]
    balls = []
    for whole, spread, at in zip(found, spreads, jets(formulas, piece, [arb(x.mid()) for x in box], known), strict=True):
        around = at.value + spread * arb(0, 1)
        kept = [each for each in (whole.value, around) if each.is_finite()]
        if not kept:
            raise UnprovedError(f"the image of {_written(formulas, box)} by the piece {formulas.letters[piece]} is not bounded")
        balls.append(kept[0].intersection(kept[-1]))
    return balls


def in_words(data: Mapping[str, Any]) -> str:
    """The formulas of a certificate, with the parameters and radii that it states."""
    pieces = [_piece_in_words(piece, data["coordinates"]) for piece in data["pieces"]]
    numbers = [f"{name} = {at}" + (f" +/- {radius}" if arb(radius) else "") for name, (at, radius) in data["parameters"].items()]
    circles = [name for name, angle in zip(data["coordinates"], data["angles"], strict=True) if angle]
    about = [f"; with {', '.join(numbers)}"] * bool(numbers) + [f"; {', '.join(circles)} modulo 2 pi"] * bool(circles)
    return f"The map, of which the first piece that holds a state applies: {'; '.join(pieces)}{''.join(about)}."


def _piece_in_words(piece: Mapping[str, Any], names: Sequence[str]) -> str:
    """The formulas of a piece."""
    images = ", ".join(f"{name}' = {piece['image'][name]}" for name in names)
    return f"{piece['letter']}: {images}" + ("" if piece["condition"] == "0 == 0" else f" where {piece['condition']}")


def _parsed(text: Any, names: set[str]) -> ast.expr:
    """The syntax tree of a formula; ValueError where it has another part than those allowed."""
    tree = ast.parse(str(text), mode="eval").body
    for node in ast.walk(tree):
        allowed = isinstance(node, ast.BinOp | ast.UnaryOp | ast.BoolOp | ast.Compare | ast.operator | ast.unaryop | ast.cmpop)
        allowed |= isinstance(node, ast.boolop | ast.expr_context)
        allowed |= isinstance(node, ast.Constant) and type(node.value) in (int, float, bool)
        allowed |= isinstance(node, ast.Name) and node.id in {*names, *FUNCTIONS, "min", "max"}
        allowed |= isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords
        if not allowed:
            raise ValueError(f"a formula has {ast.unparse(node)!r} in {text!r}; expected: numbers, names and known functions")
    return tree


def _jets(formulas: PiecewiseFormulas, box: Sequence[arb]) -> dict[str, Jet]:
    """The jets of names over a box."""
    n = len(box)
    values = {
        name: Jet(x, tuple(arb(int(i == k)) for i in range(n)))
        for k, (name, x) in enumerate(zip(formulas.coordinates, box, strict=True))
    }
    return values | {name: constant(x, n) for name, x in formulas.numbers.items()}


def _written(formulas: PiecewiseFormulas, box: Sequence[arb]) -> str:
    """A box in words."""
    return ", ".join(f"{name} = {x.str(6)}" for name, x in zip(formulas.coordinates, box, strict=True))
