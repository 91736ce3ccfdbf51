"""Formulas compiled by themselves and kept in memory: impact laws and resets that are not linear, observables."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, reduce
from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from nsmaps.exact.engine.jit import law_of
from nsmaps.exact.flows.formulas import PHI


@lru_cache(maxsize=256)
def law_address(law: sp.Expr, speed: sp.Symbol, parameters: tuple[sp.Symbol, ...]) -> int:
    """The address of a compiled function of the impact speed and of the address of the parameters' values."""
    names = [f"    {symbol} = p[{i}]" for i, symbol in enumerate(parameters)]
    text = "\n".join([f"def law({speed}, p):", *names, f"    return {code(law)}"])
    return int(law_of("impact law", text).address)


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


def rows_source(
    formulas: Sequence[sp.Expr], places: Sequence[int], variables: Sequence[sp.Symbol], parameters: Sequence[sp.Symbol]
) -> str:
    """The source of a function of the phase and of the addresses of variables `y`, parameters `p` and a table `out`.

    It writes the formulas to these places of the table.
    """
    lines = [f"{symbol} = y[{k}]" for k, symbol in enumerate(variables)]
    lines += [f"{symbol} = p[{k}]" for k, symbol in enumerate(parameters)]
    return "\n    ".join([f"def law({PHI}, y, p, out):", *lines, *assignments(formulas, [f"out[{place}]" for place in places])])


def assignments(formulas: Sequence[sp.Expr], places: Sequence[str]) -> list[str]:
    """Lines that write formulas to places, what they share first."""
    shared, short = sp.cse([replace_functions(formula, SLOPES) for formula in formulas], symbols=sp.numbered_symbols("_c"))
    lines = [f"{symbol} = {code(formula)}" for symbol, formula in shared]
    return [*lines, *(f"{place} = {code(formula)}" for place, formula in zip(places, short, strict=True))]


def rows_address(source: str) -> int:
    """The address of the compiled function of a source by `rows_source`."""
    return int(law_of("reset", source).address)


STEPS = (sp.floor, sp.sign, sp.Heaviside)
REMAINDERS: dict[Any, Callable[..., Any]] = {
    sp.Mod: lambda x, y: x - y * sp.floor(x / y),
    sp.frac: lambda x: x - sp.floor(x),
    sp.ceiling: lambda x: -sp.floor(-x),
}  #: by floor
SLOPES: dict[Any, Callable[..., Any]] = {
    sp.Derivative: lambda of, *by: (
        sp.S.Zero if isinstance(of, STEPS) else sp.Derivative(replace_functions(of, REMAINDERS), *by).doit()
    ),
    sp.Subs: lambda inner, *at: sp.Subs(inner, *at).doit(),
    sp.DiracDelta: lambda *_: sp.S.Zero,
    sp.Heaviside: lambda x, *_: 1 - sp.Max(0, -sp.sign(x)),
}  #: what derivatives of steps and kinks leave


def replace_functions(formula: Any, changes: Mapping[Any, Callable[..., Any]]) -> Any:
    """A formula without some functions, for each of which there is a formula of its arguments."""
    changed = reduce(lambda each, kind: each.replace(kind, changes[kind]), changes, formula)
    return formula if changed == formula else replace_functions(changed, changes)
