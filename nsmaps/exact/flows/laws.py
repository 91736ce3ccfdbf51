"""Impact laws that are not linear in the speed, compiled from their formula and kept in memory."""

from functools import lru_cache
from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from nsmaps.exact.engine.jit import law_of


@lru_cache(maxsize=256)
def law_address(law: sp.Expr, speed: sp.Symbol, parameters: tuple[sp.Symbol, ...]) -> int:
    """The address of a compiled function of the impact speed and of the address of the parameters' values."""
    names = [f"    {symbol} = p[{i}]" for i, symbol in enumerate(parameters)]
    text = "\n".join([f"def law({speed}, p):", *names, f"    return {code(law)}"])
    return _compiled(text).address


@lru_cache(maxsize=256)
def _compiled(text: str) -> Any:
    return law_of(text)


class _Printer(PythonCodePrinter):  # type: ignore[misc]
    """Python code in functions of the math module, with integer powers as products."""

    def _print_Pow(self, expr: sp.Pow, **kwargs: Any) -> str:
        base, power = expr.args
        if power.is_Integer and 2 <= abs(power) <= 4:
            product = "*".join([f"({self._print(base)})"] * abs(int(power)))
            return f"({product})" if power > 0 else f"(1/({product}))"
        return str(super()._print_Pow(expr, **kwargs))

    def _print_Max(self, expr: sp.Max) -> str:
        return f"max({', '.join(self._print(sp.Float(a) if a.is_Integer else a) for a in expr.args)})"


def code(expr: Any) -> str:
    """An expression as source code."""
    return str(_Printer({"fully_qualified_modules": True}).doprint(sp.sympify(expr)))
