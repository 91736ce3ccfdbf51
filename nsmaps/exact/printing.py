"""Expressions as the source of compiled functions."""

from itertools import count
from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from nsmaps.exact.bounding import Lesser

PHI = sp.Symbol("_phi", real=True)
DECORATOR = '@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)'


class _Printer(PythonCodePrinter):  # type: ignore[misc]
    """Python in the names of the math module, whole powers as products."""

    def _print_Pow(self, expr: sp.Pow, **kwargs: Any) -> str:
        base, power = expr.args
        if power.is_Integer and 2 <= abs(power) <= 4:
            product = "*".join([f"({self._print(base)})"] * abs(int(power)))
            return f"({product})" if power > 0 else f"(1/({product}))"
        return str(super()._print_Pow(expr, **kwargs))

    def _print_Max(self, expr: sp.Max) -> str:
        return f"max({', '.join(self._print(sp.Float(a) if a.is_Integer else a) for a in expr.args)})"

    def _print_Lesser(self, expr: Lesser) -> str:
        return f"min({self._print(expr.args[0])}, {self._print(expr.args[1])})"


def code(expr: Any) -> str:
    """An expression as it stands in the source."""
    return str(_Printer({"fully_qualified_modules": True}).doprint(sp.sympify(expr)))


def shared_parts(exprs: list[sp.Expr]) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    """Expressions with the sine and cosine of the phase as given, and their common parts before them."""
    exprs = [expr.xreplace({sp.sin(PHI): sp.Symbol("_sin"), sp.cos(PHI): 1 + sp.Symbol("_less")}) for expr in exprs]
    return sp.cse(exprs, symbols=(sp.Symbol(f"_x{i}") for i in count()), order="none")


def function(head: str, doc: str, exprs: list[sp.Expr], unpack: list[str], single: bool = False) -> str:
    """The source of one jitted function that returns the expressions, common parts computed once."""
    shared, results = shared_parts(exprs)
    lines = [DECORATOR, f"def {head}:", f'    """{doc}"""', *(f"    {line}" for line in unpack)]
    lines += [f"    {name} = {code(value)}" for name, value in shared]
    out = ", ".join(code(sp.Float(r) if r.is_Integer else r) for r in results)
    return "\n".join([*lines, f"    return {out}" if single else f"    return ({out},)"]) + "\n"
