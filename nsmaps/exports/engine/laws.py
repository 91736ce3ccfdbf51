"""The impact laws of a system as expressions that C and Julia both read."""

from collections.abc import Mapping
from typing import Any

import sympy as sp
from sympy.printing.c import C99CodePrinter

from nsmaps.errors import NsmapsError
from nsmaps.exact.engine.flight.layout import AT_PARAMETERS
from nsmaps.exact.flows.formulas import V, is_linear
from nsmaps.exact.kernel import Kernel

#: what C calls the functions of an expression, in Julia
ALIASES = """fabs(x) = abs(x)
pow(x, y) = x < 0.0 && !isinteger(y) ? NaN : Float64(x)^y
sqrt(x) = square_root(x)
log(x) = x < 0.0 ? NaN : Base.log(x)"""


class _Expression(C99CodePrinter):  # type: ignore[misc]
    """Functions of C's library, whole powers as products in the order of the compiled law, numbers as floats."""

    def __init__(self, texts: Mapping[sp.Symbol, str]) -> None:
        super().__init__({"strict": True})
        self.texts = texts

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return self.texts[expr]

    def _print_NumberSymbol(self, expr: Any) -> str:
        return repr(float(expr))

    def _print_Rational(self, expr: sp.Rational) -> str:
        return f"{expr.p}.0/{expr.q}.0"

    def _print_Float(self, expr: sp.Float) -> str:
        return repr(float(expr))

    def _print_Pow(self, expr: sp.Pow, **kwargs: Any) -> str:
        base, power = expr.args
        if power.is_Integer and 2 <= abs(power) <= 4:
            product = "*".join([f"({self._print(base)})"] * abs(int(power)))
            return f"({product})" if power > 0 else f"(1.0/({product}))"
        return str(super()._print_Pow(expr))

    def _print_Max(self, expr: sp.Max) -> str:
        return self._nested("larger", expr)

    def _print_Min(self, expr: sp.Min) -> str:
        return self._nested("smaller", expr)

    def _nested(self, name: str, expr: Any) -> str:
        text, *others = map(self._print, expr.args)
        for other in others:
            text = f"{name}({text}, {other})"
        return text


def law_texts(kernel: Kernel, table: str, first: int) -> list[tuple[str, str] | None]:
    """For the lower wall and for the upper the speed after an impact of speed v and its derivative; None for a law linear in v.

    `table` is what the numbers of the system are called, `first` the index of the first of them.

    Raises:
        NsmapsError: a law has a function that C does not have.
    """
    place = int(kernel.table[AT_PARAMETERS]) + first
    texts = {symbol: f"{table}[{place + k}]" for k, symbol in enumerate(kernel.formulas.symbols)} | {V: "v"}
    found: list[tuple[str, str] | None] = []
    for law in kernel.formulas.laws:
        try:
            printed = None if is_linear(law) else [_Expression(texts).doprint(each) for each in (law, sp.diff(law, V))]
        except Exception as error:  # sympy's own, of several classes
            name, plain = type(kernel.system).__name__, law.xreplace({V: sp.Symbol("v")})
            raise NsmapsError(f"the impact law {plain} of {name} has a part that C has not: {error}") from error
        found.append((printed[0], printed[1]) if printed else None)
    return found
