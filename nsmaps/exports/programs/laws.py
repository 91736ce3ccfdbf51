"""The impact laws and curved resets of a system as expressions that C, Julia and JavaScript read."""

from collections.abc import Mapping, Sequence
from string import Template
from typing import Any

import sympy as sp
from sympy.printing.c import C99CodePrinter

from nsmaps.errors import NsmapsError
from nsmaps.exact.engine.flight.layout import AT_PARAMETERS
from nsmaps.exact.engine.kernel import SpectralKernel
from nsmaps.exact.flows.formulas import PHI, V, is_linear
from nsmaps.exact.flows.laws import SLOPES, replace_functions
from nsmaps.exact.modes.definitions.definition import Definition

#: what C calls the functions of an expression, in Julia
ALIASES = """fabs(x) = abs(x)
pow(x, y) = x < 0.0 && !isinteger(y) ? NaN : Float64(x)^y
sqrt(x) = square_root(x)
log(x) = x < 0.0 ? NaN : Base.log(x)"""

PLACES = {"c": "out[{0}][{1}]", "julia": "out[{1}, {0}]", "javascript": "out[{0}][{1}]"}  #: of a table by row and column
CONSTANT = {"c": "const double ", "javascript": "const "}
REBOUND = {
    "c": Template("""/* Speed just after an impact of speed v on the upper (or lower) wall, and its derivative by v. */
static tuple_dd rebound(bool up, double v)
{
    if (up)
        return (tuple_dd){$upper};
    return (tuple_dd){$lower};
}"""),
    "julia": Template(""""Speed just after an impact of speed v on the upper (or lower) wall, and its derivative by v."
function rebound(up, v)
    if up
        return ($upper)
    end
    return ($lower)
end"""),
    "javascript": Template("""/* Speed just after an impact of speed v on the upper (or lower) wall, and its derivative by v. */
function rebound(up, v) {
    const [speed, slope] = up ? [$upper] : [$lower]
    return {m0: speed, m1: slope}
}"""),
}
RESETS = {
    "c": Template("""/* Write the states after an event, row by row with their derivatives by states y, phase and parameters q. */
static void call_reset(int64_t law, double phi, const double *y, const double *q, double (*out)[$width])
{
    (void)phi;
    (void)q;
$cases
}"""),
    "julia": Template(""""Write the states after an event with their derivatives by states y, phase and parameters q."
function call_reset(law, phi, y, q, out)
$cases
end"""),
    "javascript": Template("""/* Write the states after an event with their derivatives by states y, phase and parameters q. */
function call_reset(law, phi, y, q, out) {
$cases
}"""),
}


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


def law_texts(kernel: SpectralKernel, table: str, first: int) -> list[tuple[str, str] | None]:
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


def reset_text(resets: Sequence[Sequence[tuple[int, sp.Expr]]], definition: Definition, language: str) -> str:
    """The function that writes the states after an event and their derivatives, for resets by formulas, by their number.

    Raises:
        NsmapsError: a reset has a function that C does not have.
    """
    first, by = (1 if language == "julia" else 0), (*definition.variables, PHI, *definition.symbols)
    texts = {PHI: "phi"} | {x: f"y[{k + first}]" for k, x in enumerate(definition.variables)}
    texts |= {x: f"q[{k + first}]" for k, x in enumerate(definition.symbols)}
    lines = []
    for number, curved in enumerate(resets, 1):
        places = [(k + first, j + first) for k, _ in curved for j in range(1 + len(by))]
        formulas = [entry for _, formula in curved for entry in (formula, *(sp.diff(formula, x) for x in by))]
        shared, short = sp.cse([replace_functions(formula, SLOPES) for formula in formulas], symbols=sp.numbered_symbols("c"))
        named = {symbol: str(symbol) for symbol, _ in shared}
        try:
            own = [(str(symbol), _Expression(texts | named).doprint(formula)) for symbol, formula in shared]
            own += [
                (place, _Expression(texts | named).doprint(formula))
                for place, formula in zip([PLACES[language].format(*place) for place in places], short, strict=True)
            ]
        except Exception as error:  # sympy's own, of several classes
            raise NsmapsError(f"the reset {curved[0][1]} has a part that C has not: {error}") from error
        lines += _case(number, own, language)
    return RESETS[language].substitute(cases="\n".join(lines), width=1 + len(by))


def _case(number: int, own: Sequence[tuple[str, str]], language: str) -> list[str]:
    """The lines of one reset."""
    if language == "julia":
        return [f"    if law == {number}", *(f"        {name} = {text}" for name, text in own), "    end"]
    return [
        f"    if (law == {number}) {{",
        *(f"        {'' if '[' in name else CONSTANT[language]}{name} = {text};" for name, text in own),
        "    }",
    ]
