"""A map given by formulas in pieces, in Arb balls: its values, its derivatives, and the pieces that states of a box may be in.

The text of formulas is a part of Python's syntax: whole and decimal numbers, which stand for the doubles nearest to them, names of
coordinates and parameters, pi, + - * / **, the functions below, comparisons, `and`, `or` and `not`. The first piece whose condition
is true applies, and angles are in [0, 2 pi). Where a function has a kink, its derivative is the ball of the slopes on both sides:
for the states x, y of a box f(x) - f(y) is then in the derivative times x - y, as it is where there is none.
"""

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from flint import arb

from nsmaps.verify.formula import Doubtful, ball

KEYS = {"coordinates", "angles", "parameters", "pieces"}
ARITHMETIC = ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow
TURNED: dict[type[ast.cmpop], type[ast.cmpop]] = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt}
MOST_POWER = 64

Condition = ast.expr
Sum = tuple[tuple[str, int], ...]  #: terms, as text, with the whole numbers by which they are multiplied


class Jet(NamedTuple):
    """A value, and its derivatives by the coordinates, for all states of a box."""

    value: arb
    slopes: tuple[arb, ...]


class PiecewiseFormulas(NamedTuple):
    """A map of n coordinates."""

    coordinates: tuple[str, ...]
    angles: tuple[bool, ...]  #: shape (n,)
    numbers: Mapping[str, arb]  #: of the parameters, and pi
    letters: tuple[str, ...]  #: of the pieces
    conditions: tuple[ast.expr, ...]  #: of the pieces
    images: tuple[tuple[ast.expr, ...], ...]  #: of the pieces, of the coordinates


class Known(NamedTuple):
    """What the conditions of pieces say of states: sums that are zero or above, and sums that are above zero."""

    least: frozenset[Sum] = frozenset()
    above: frozenset[Sum] = frozenset()


def map_of(data: Mapping[str, Any]) -> PiecewiseFormulas:
    """The map of a certificate; ValueError says what is wrong in it."""
    if set(data) != KEYS:
        raise ValueError(f"a map has {sorted(data)}; expected: {sorted(KEYS)}")
    names, angles, numbers = tuple(data["coordinates"]), tuple(data["angles"]), {"pi": arb.pi()}
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


def pieces_of(map: PiecewiseFormulas, box: Sequence[arb]) -> Iterator[tuple[int, list[arb], Known]]:
    """The pieces that states of a box may be in, each with the part of the box that is, and what is known there.

    `Doubtful` where a state may be in none.
    """
    known, part = Known(), list(box)
    for k, condition in enumerate(map.conditions):
        values = _jets(map, part)
        here = _truth(condition, values, known)
        if here is not False:
            narrowed = _narrowed(map, condition, True, part)
            if narrowed is not None:
                yield k, narrowed, _with_condition(condition, True, known)
        if here is True:
            return
        known, rest = _with_condition(condition, False, known), _narrowed(map, condition, False, part)
        if rest is None:
            return
        part = rest
    raise Doubtful(f"a state with {_written(map, box)} may be in no piece")


def image(map: PiecewiseFormulas, piece: int, box: Sequence[arb]) -> list[Jet]:
    """The images of all states of a box and their derivatives; `Doubtful` unless these are shown to be in one piece."""
    for x, angle, name in zip(box, map.angles, map.coordinates, strict=True):
        if angle and not (x >= 0 and x < 2 * arb.pi()):
            raise Doubtful(f"states with {name} = {x.str(6)} may be on both sides of the angle 0")
    found = list(pieces_of(map, box))
    if [k for k, _, _ in found] != [piece]:
        others = ", ".join(map.letters[k] for k, _, _ in found)
        raise Doubtful(f"states with {_written(map, box)} may be in the pieces {others}, not in {map.letters[piece]} alone")
    return jets(map, piece, box, found[0][2])


def jets(map: PiecewiseFormulas, piece: int, box: Sequence[arb], known: Known) -> list[Jet]:
    """The formulas of a piece over a box; a value that is not finite says that nothing is known."""
    values = _jets(map, box)
    return [_jet(formula, values, known) for formula in map.images[piece]]


def hull(map: PiecewiseFormulas, piece: int, box: Sequence[arb], known: Known) -> list[arb]:
    """Balls that hold the images of a box in a piece: by the formulas, and by the derivatives around the middle of the box."""
    found, middle = jets(map, piece, box, known), [arb(x.mid()) for x in box]
    near, balls = jets(map, piece, middle, known), []
    for whole, at in zip(found, near, strict=True):
        value = at.value
        for slope, x, y in zip(whole.slopes, box, middle, strict=True):
            value += slope * (x - y)
        kept = [each for each in (whole.value, value) if each.is_finite()]
        if not kept:
            raise Doubtful(f"the image of {_written(map, box)} by the piece {map.letters[piece]} is not bounded")
        balls.append(kept[0].intersection(kept[-1]))
    return balls


def in_words(data: Mapping[str, Any]) -> str:
    """The formulas of a certificate, with the parameters and radii that it states."""
    pieces = [
        f"{piece['letter']}: "
        + ", ".join(f"{name}' = {piece['image'][name]}" for name in data["coordinates"])
        + (f" where {piece['condition']}" if piece["condition"] != "True" else "")
        for piece in data["pieces"]
    ]
    numbers = [f"{name} = {at} +/- {radius}" if arb(radius) else f"{name} = {at}" for name, (at, radius) in data["parameters"].items()]
    circles = [name for name, angle in zip(data["coordinates"], data["angles"], strict=True) if angle]
    about = "".join([f"; with {', '.join(numbers)}" if numbers else "", f"; {', '.join(circles)} modulo 2 pi" if circles else ""])
    return f"The map, the first piece that holds a state: {'; '.join(pieces)}{about}."


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


def _jets(map: PiecewiseFormulas, box: Sequence[arb]) -> dict[str, Jet]:
    """The jets of names over a box."""
    n = len(box)
    values = {name: Jet(x, tuple(arb(int(i == k)) for i in range(n))) for k, (name, x) in enumerate(zip(map.coordinates, box, strict=True))}
    return values | {name: _constant(x, n) for name, x in map.numbers.items()}


def _constant(x: arb, n: int) -> Jet:
    return Jet(x, (arb(0),) * n)


def _jet(node: ast.expr, values: Mapping[str, Jet], known: Known) -> Jet:
    """A formula over a box."""
    match node:
        case ast.Constant(value=value):
            return _constant(arb(value), len(next(iter(values.values())).slopes))
        case ast.Name(id=name):
            return values[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            x = _jet(operand, values, known)
            return Jet(-x.value, tuple(-slope for slope in x.slopes))
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _jet(operand, values, known)
        case ast.BinOp(op=ast.Pow(), left=left, right=right):
            return _power(_jet(left, values, known), right, _jet(right, values, known))
        case ast.BinOp(op=operation, left=left, right=right):
            return _of_two(operation, _jet(left, values, known), _jet(right, values, known))
        case ast.Call(func=ast.Name(id="sqrt"), args=[argument]):
            return _root(_jet(argument, values, known), _sum(argument) in known.least)
        case ast.Call(func=ast.Name(id="min" | "max" as name), args=[first, *others]):
            found = _jet(first, values, known)
            for other in others:
                found = _extreme(1 if name == "max" else -1, found, _jet(other, values, known))
            return found
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            x = _jet(argument, values, known)
            value, slope = FUNCTIONS[name](x.value)
            return Jet(value, tuple(slope * each for each in x.slopes))
    raise ValueError(f"{ast.unparse(node)!r} is not a number")


def _of_two(operation: ast.operator, x: Jet, y: Jet) -> Jet:
    match operation:
        case ast.Add():
            return Jet(x.value + y.value, tuple(a + b for a, b in zip(x.slopes, y.slopes, strict=True)))
        case ast.Sub():
            return Jet(x.value - y.value, tuple(a - b for a, b in zip(x.slopes, y.slopes, strict=True)))
        case ast.Mult():
            return Jet(x.value * y.value, tuple(a * y.value + x.value * b for a, b in zip(x.slopes, y.slopes, strict=True)))
        case ast.Div():
            value = x.value / y.value
            return Jet(value, tuple((a - value * b) / y.value for a, b in zip(x.slopes, y.slopes, strict=True)))
    raise ValueError(f"an operation {type(operation).__name__} of numbers")


def _power(x: Jet, node: ast.expr, exponent: Jet) -> Jet:
    """A whole power of any number, or a constant power of a positive one."""
    power = exponent.value.unique_fmpz() if exponent.value.is_exact() else None
    if power is not None and abs(power) <= MOST_POWER:
        n = int(power)
        return Jet(x.value**n, tuple(n * x.value ** (n - 1) * slope if n else arb(0) for slope in x.slopes))
    if not x.value > 0:
        raise Doubtful(f"a power {ast.unparse(node)} of a number that is not shown to be above zero")
    slow = x.value ** (exponent.value - 1)
    rise = x.value**exponent.value * x.value.log()
    return Jet(x.value**exponent.value, tuple(exponent.value * slow * a + rise * b for a, b in zip(x.slopes, exponent.slopes, strict=True)))


def _root(x: Jet, known: bool) -> Jet:
    """A square root, of which it may be known that its argument is not below zero."""
    if x.value > 0:
        root = x.value.sqrt()
        return Jet(root, tuple(slope / (2 * root) for slope in x.slopes))
    if not known:
        raise Doubtful(f"the square root of {x.value}, which is not shown to be above zero")
    return Jet(arb(0).union(abs(x.value).upper().sqrt()), tuple(arb("nan") if slope != 0 else slope for slope in x.slopes))


def _extreme(sign: int, x: Jet, y: Jet) -> Jet:
    """The larger of two numbers (sign 1), or the smaller (-1)."""
    if sign * x.value > sign * y.value:
        return x
    if sign * y.value > sign * x.value:
        return y
    value = x.value.max(y.value) if sign > 0 else x.value.min(y.value)
    return Jet(value, tuple(a.union(b) for a, b in zip(x.slopes, y.slopes, strict=True)))


def _size(x: arb) -> tuple[arb, arb]:
    """The absolute value."""
    return abs(x), arb(1) if x > 0 else arb(-1) if x < 0 else arb(0, 1)


def _sign(x: arb) -> tuple[arb, arb]:
    """The sign of a number that is shown not to be zero."""
    if not (x > 0 or x < 0 or x == 0):
        raise Doubtful(f"the sign of {x}")
    return x.sgn(), arb(0)


def _floor(x: arb) -> tuple[arb, arb]:
    """The whole part, if it is shown to be one."""
    whole = x.floor().unique_fmpz()
    if whole is None:
        raise Doubtful(f"the whole part of {x}")
    return arb(whole), arb(0)


FUNCTIONS: dict[str, Callable[[arb], tuple[arb, arb]]] = {  #: the value and the derivative
    "sqrt": lambda x: (x.sqrt(), 1 / (2 * x.sqrt())),
    "sin": lambda x: (x.sin(), x.cos()),
    "cos": lambda x: (x.cos(), -x.sin()),
    "tan": lambda x: (x.tan(), 1 + x.tan() ** 2),
    "asin": lambda x: (x.asin(), (1 - x * x).rsqrt()),
    "acos": lambda x: (x.acos(), -(1 - x * x).rsqrt()),
    "atan": lambda x: (x.atan(), 1 / (1 + x * x)),
    "sinh": lambda x: (x.sinh(), x.cosh()),
    "cosh": lambda x: (x.cosh(), x.sinh()),
    "tanh": lambda x: (x.tanh(), 1 - x.tanh() ** 2),
    "exp": lambda x: (x.exp(), x.exp()),
    "log": lambda x: (x.log(), 1 / x),
    "abs": _size,
    "sign": _sign,
    "floor": _floor,
}


def _truth(node: Condition, values: Mapping[str, Jet], known: Known) -> bool | None:
    """Whether a condition holds at all states of a box, or at none; None where that is not known."""
    match node:
        case ast.Constant(value=bool() as value):
            return value
        case ast.BoolOp(op=operation, values=parts):
            found = [_truth(part, values, known) for part in parts]
            decisive = isinstance(operation, ast.Or)
            return decisive if decisive in found else None if None in found else not decisive
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            inner = _truth(operand, values, known)
            return None if inner is None else not inner
        case ast.Compare(left=left, ops=operations, comparators=rights):
            terms = [left, *rights]
            pairs = zip(operations, terms, rights, strict=False)
            found = [_compared(operation, a, b, values, known) for operation, a, b in pairs]
            return False if False in found else None if None in found else True
    raise ValueError(f"{ast.unparse(node)!r} is not a condition")


def _compared(operation: ast.cmpop, left: ast.expr, right: ast.expr, values: Mapping[str, Jet], known: Known) -> bool | None:
    """Whether a comparison holds."""
    if isinstance(operation, ast.Gt | ast.GtE):
        return _compared(ast.Lt() if isinstance(operation, ast.Gt) else ast.LtE(), right, left, values, known)
    rise, fall = _sum(ast.BinOp(right, ast.Sub(), left)), _sum(ast.BinOp(left, ast.Sub(), right))
    if isinstance(operation, ast.Lt) and (rise in known.above or fall in known.least):
        return rise in known.above
    if isinstance(operation, ast.LtE) and (rise in known.least or fall in known.above):
        return rise in known.least
    a, b = _jet(left, values, known).value, _jet(right, values, known).value
    match operation:
        case ast.Lt():
            return True if a < b else False if a >= b else None
        case ast.LtE():
            return True if a <= b else False if a > b else None
        case ast.Eq() | ast.NotEq():
            equal = True if a == b else False if a != b else None
            return equal if equal is None or isinstance(operation, ast.Eq) else not equal
    raise ValueError(f"a comparison {type(operation).__name__}")


def _alone(node: Condition, holds: bool) -> Iterator[tuple[ast.cmpop, ast.expr, ast.expr]]:
    """The comparisons that are true if a condition holds, or if it does not."""
    match node:
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield from _alone(operand, not holds)
        case ast.BoolOp(op=operation, values=parts) if isinstance(operation, ast.And) == holds:
            for part in parts:
                yield from _alone(part, holds)
        case ast.Compare(left=left, ops=operations, comparators=rights) if holds or len(rights) == 1:
            for operation, a, b in zip(operations, [left, *rights], rights, strict=False):
                if holds:
                    yield operation, a, b
                elif type(operation) in TURNED:
                    yield TURNED[type(operation)](), a, b


def _with_condition(node: Condition, holds: bool, known: Known) -> Known:
    """What is known in addition if a condition holds, or does not."""
    least, above = set(known.least), set(known.above)
    for operation, a, b in _alone(node, holds):
        low, high = (a, b) if isinstance(operation, ast.Lt | ast.LtE) else (b, a)
        if isinstance(operation, ast.Lt | ast.LtE | ast.Gt | ast.GtE):
            least.add(_sum(ast.BinOp(high, ast.Sub(), low)))
        if isinstance(operation, ast.Lt | ast.Gt):
            above.add(_sum(ast.BinOp(high, ast.Sub(), low)))
    return Known(frozenset(least), frozenset(above))


def _narrowed(map: PiecewiseFormulas, node: Condition, holds: bool, box: Sequence[arb]) -> list[arb] | None:
    """A part of a box that holds all of its states where a condition holds, or does not; None if there is no such state.

    Only a comparison of a coordinate with a number narrows.
    """
    part, numbers = list(box), {name: _constant(x, 0) for name, x in map.numbers.items()}
    for operation, a, b in _alone(node, holds):
        for name, bound, below in ((a, b, ast.Lt | ast.LtE), (b, a, ast.Gt | ast.GtE)):
            other = ast.walk(bound)
            if not (isinstance(name, ast.Name) and name.id in map.coordinates):
                continue
            if any(isinstance(each, ast.Name) and each.id in map.coordinates for each in other) or isinstance(operation, ast.Eq | ast.NotEq):
                continue
            k, limit = map.coordinates.index(name.id), _jet(bound, numbers or {"pi": _constant(arb.pi(), 0)}, Known()).value
            low, high = part[k].lower(), part[k].upper()
            if isinstance(operation, below):
                if low > limit:
                    return None
                high = high.min(limit.upper())
            else:
                if high < limit:
                    return None
                low = low.max(limit.lower())
            part[k] = part[k].intersection(low.union(high))
    return part


def _sum(node: ast.expr) -> Sum:
    """A formula as a sum of terms."""
    terms: dict[str, int] = {}

    def add(node: ast.expr, sign: int) -> None:
        match node:
            case ast.BinOp(op=ast.Add() | ast.Sub() as operation, left=left, right=right):
                add(left, sign)
                add(right, sign if isinstance(operation, ast.Add) else -sign)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                add(operand, -sign)
            case ast.Constant(value=0):
                pass
            case _:
                terms[ast.dump(node)] = terms.get(ast.dump(node), 0) + sign

    add(node, 1)
    return tuple(sorted((term, count) for term, count in terms.items() if count))


def _written(map: PiecewiseFormulas, box: Sequence[arb]) -> str:
    """A box in words."""
    return ", ".join(f"{name} = {x.str(6)}" for name, x in zip(map.coordinates, box, strict=True))
