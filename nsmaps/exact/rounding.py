"""What rounding may do to a flight: from the sizes of all that is added up, to first order.

The *size* of an expression is what it could be if the signs of its parts were forgotten: computed in floats it is off by a few
units in the last place of that, however much of it cancels. Parameters, places, velocities and phases are taken as given.
"""

from collections.abc import Callable

import sympy as sp

from nsmaps.exact.printing import PHI
from nsmaps.exact.symbols import Flow, S


def size(expr: sp.Expr) -> sp.Expr:
    """The size of an expression free of s."""
    if cancels_not(expr):
        return sp.Abs(expr)
    if expr.is_Add:
        return sp.Add(*map(size, expr.args))
    if expr.is_Mul:
        return sp.Mul(*map(size, expr.args))
    if expr.is_Pow and expr.exp.is_Integer and expr.exp > 0:
        return size(expr.base) ** expr.exp
    if expr.is_Pow and expr.exp.is_number:
        return sp.Abs(expr) * (size(expr.base) / sp.Abs(expr.base)) ** sp.ceiling(abs(expr.exp))
    if isinstance(expr, sp.exp):
        return sp.Abs(expr) * (1 + size(expr.args[0]))
    return sp.Abs(expr) + sp.Add(*(size(arg.subs(PHI, 2 * sp.pi)) for arg in expr.args))  # a phase is in [0, 2 pi)


def cancels_not(expr: sp.Expr) -> bool:
    """Is an expression's size its absolute value: products, and sums or differences of two numbers that are given."""
    if expr.is_Atom or expr.is_number or (isinstance(expr, (sp.sin, sp.cos)) and expr.args[0].is_Symbol):
        return True
    if expr.is_Add:
        return len(expr.args) == 2 and all((-a if a.could_extract_minus_sign() else a).is_Atom for a in expr.args)
    return bool(expr.is_Mul or (expr.is_Pow and expr.exp.is_number)) and all(map(cancels_not, expr.args))


def weight(flow: Flow, row: sp.Expr, named: Callable[[sp.Expr], sp.Expr]) -> sp.Expr:
    """The size of a polynomial in s and the remainders, with its parts free of s as they are `named`.

    The size of a remainder counts what the rounding of its argument k s does to it.
    """

    def measured(expr: sp.Expr) -> sp.Expr:
        whole = flow.restore(expr)
        if cancels_not(whole):
            return sp.Abs(expr if expr.is_number else named(expr))
        return named(size(whole))

    sizes = {S: S}
    for w in flow.waves:
        off = measured(w.k) * S
        sizes |= {w.c: sp.Abs(w.c) + off * sp.Abs(w.n), w.n: sp.Abs(w.n) + off, w.r: sp.Abs(w.r) + off * sp.Abs(w.c)}
    for q in flow.growths:
        off = measured(q.k) * S
        sizes |= {q.x: sp.Abs(q.x) + off * (1 + q.x), q.e: sp.Abs(q.e) + off * sp.Abs(q.x)}
    for twin in flow.twins:
        off, less = measured(twin.k) * S, (1 + measured(twin.upper.k) * S) * sp.Abs(twin.n)
        sizes |= {twin.n: less + off * (1 + twin.upper.x), twin.r: less + off * (sp.Abs(twin.upper.x) + sp.Abs(twin.n))}
    return sp.Add(
        *(
            measured(c) * sp.Mul(*(sizes[g] ** n for g, n in zip(flow.generators, exponents, strict=True) if n))
            for exponents, c in flow.terms(row).items()
        )
    )
