"""Conditions of pieces over boxes: whether they hold, what they say of states, and which part of a box they leave."""

import ast
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

from flint import arb

from nsmaps.verify.maps.jets import Jet, Known, Sum, constant, jet_of, sum_of

TURNED: dict[type[ast.cmpop], type[ast.cmpop]] = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt}


def truth(node: ast.expr, values: Mapping[str, Jet], known: Known) -> bool | None:
    """Whether a condition holds at all states of a box, or at none; None where that is not known."""
    match node:
        case ast.Constant(value=bool() as value):
            return value
        case ast.BoolOp(op=operation, values=parts):
            found = [truth(part, values, known) for part in parts]
            decisive = isinstance(operation, ast.Or)
            return decisive if decisive in found else None if None in found else not decisive
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            inner = truth(operand, values, known)
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
    rise, fall = _differences(left, right)
    if isinstance(operation, ast.Lt) and (rise in known.above or fall in known.least):
        return rise in known.above
    if isinstance(operation, ast.LtE) and (rise in known.least or fall in known.above):
        return rise in known.least
    a, b = jet_of(left, values, known).value, jet_of(right, values, known).value
    match operation:
        case ast.Lt():
            return True if a < b else False if a >= b else None
        case ast.LtE():
            return True if a <= b else False if a > b else None
        case ast.Eq() | ast.NotEq():
            equal = True if a == b else False if a != b else None
            return equal if equal is None or isinstance(operation, ast.Eq) else not equal
    raise ValueError(f"a comparison {type(operation).__name__}")


def _alone(node: ast.expr, holds: bool) -> Iterator[tuple[ast.cmpop, ast.expr, ast.expr]]:
    """The comparisons that are true if a condition holds, or if it does not."""
    match node:
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield from _alone(operand, not holds)
        case ast.BoolOp(op=join, values=parts) if isinstance(join, ast.And) == holds:
            for part in parts:
                yield from _alone(part, holds)
        case ast.Compare(left=left, ops=operations, comparators=rights) if holds or len(rights) == 1:
            for operation, a, b in zip(operations, [left, *rights], rights, strict=False):
                if holds:
                    yield operation, a, b
                elif type(operation) in TURNED:
                    yield TURNED[type(operation)](), a, b


def with_condition(node: ast.expr, holds: bool, known: Known) -> Known:
    """What is known in addition if a condition holds, or does not."""
    more = _said(node, holds)
    return Known(known.least | more.least, known.above | more.above)


@lru_cache(maxsize=1024)
def _said(node: ast.expr, holds: bool) -> Known:
    """What is known if a condition holds, or does not."""
    least, above = set(), set()
    for operation, a, b in _alone(node, holds):
        rise, fall = _differences(a, b)
        if isinstance(operation, ast.Lt | ast.LtE | ast.Gt | ast.GtE):
            least.add(rise if isinstance(operation, ast.Lt | ast.LtE) else fall)
        if isinstance(operation, ast.Lt | ast.Gt):
            above.add(rise if isinstance(operation, ast.Lt) else fall)
    return Known(frozenset(least), frozenset(above))


def narrowed(
    node: ast.expr, holds: bool, names: Sequence[str], numbers: Mapping[str, arb], box: Sequence[arb]
) -> list[arb] | None:
    """A part of a box that holds all of its states where a condition holds, or does not; None if there is no such state.

    Only a comparison of a coordinate with a number narrows.
    """
    part, known = list(box), {name: constant(x, 0) for name, x in numbers.items()}
    for k, is_below, bound in _limits(node, holds, tuple(names)):
        limit, low, high = jet_of(bound, known, Known()).value, part[k].lower(), part[k].upper()
        if low > limit if is_below else high < limit:
            return None
        kept = low.union(high.min(limit.upper())) if is_below else low.max(limit.lower()).union(high)
        part[k] = part[k].intersection(kept)
    return part


@lru_cache(maxsize=1024)
def _limits(node: ast.expr, holds: bool, names: tuple[str, ...]) -> tuple[tuple[int, bool, ast.expr], ...]:
    """Coordinates compared with a number if a condition holds, or does not: whether they are below, and the number."""
    found = []
    for operation, a, b in _alone(node, holds):
        for name, bound, below in ((a, b, ast.Lt | ast.LtE), (b, a, ast.Gt | ast.GtE)):
            free = {each.id for each in ast.walk(bound) if isinstance(each, ast.Name)}
            if isinstance(name, ast.Name) and name.id in names and free.isdisjoint(names) and type(operation) in TURNED:
                found.append((names.index(name.id), isinstance(operation, below), bound))
    return tuple(found)


@lru_cache(maxsize=1024)
def _differences(a: ast.expr, b: ast.expr) -> tuple[Sum, Sum]:
    """The sums b - a and a - b."""
    return sum_of(ast.BinOp(b, ast.Sub(), a)), sum_of(ast.BinOp(a, ast.Sub(), b))
