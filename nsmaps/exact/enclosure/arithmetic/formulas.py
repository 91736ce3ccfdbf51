"""Impact laws in balls: from a formula to a compiled function that encloses it and its derivatives."""

from collections.abc import Sequence
from functools import lru_cache, reduce
from itertools import count

import sympy as sp

from nsmaps.errors import ProofError
from nsmaps.exact.enclosure.arithmetic import balls, elementary
from nsmaps.exact.engine.jit import law_of

WAVES = {
    sp.sin: "bangle({0}).sine",
    sp.cos: "badd(Ball(1.0, 0.0), bangle({0}).less)",
    sp.exp: "bexp({0})",
    sp.log: "blog({0})",
    sp.Abs: "babs({0})",
}
DIGITS, LAST_PLACE = 40, 2.0**-52  #: of irrational numbers, and the relative error with which they are rounded
LONG = 16  #: operations of a sum or product, which are nested
CHAINS = {sp.Add: "badd", sp.Mul: "bmul", sp.Max: "bmax", sp.Min: "bmin"}


def ball_code(expr: sp.Expr) -> str:
    """Python code that encloses an expression, whose symbols are names of balls.

    Raises:
        ProofError: the expression has a part for which no enclosure is known.
    """
    if expr.is_Symbol:
        return str(expr)
    if expr.is_number:
        return _number(expr)
    first, *others = expr.args
    if isinstance(expr, sp.Mul) and first is sp.S.NegativeOne:
        return f"bneg({ball_code(sp.Mul(*others))})"
    if type(expr) in CHAINS:
        return _chain(CHAINS[type(expr)], [ball_code(part) for part in expr.args])
    if isinstance(expr, sp.Pow):
        return _power(*expr.args)
    if type(expr) in WAVES:
        return WAVES[type(expr)].format(ball_code(first))
    if isinstance(expr, (sp.tan, sp.sinh, sp.cosh, sp.tanh)):
        return ball_code(expr.rewrite(sp.cos) if isinstance(expr, sp.tan) else expr.rewrite(sp.exp))
    raise ProofError(
        f"{sp.sstr(expr)} cannot be enclosed over a set of states; expected: sums, products, powers, sin, cos, tan, exp, log, "
        "sinh, cosh, tanh, abs, max and min"
    )


def _chain(name: str, parts: Sequence[str]) -> str:
    if len(parts) > LONG:  # Python reads at most 200 nested parentheses
        return f"{name}({_chain(name, parts[: len(parts) // 2])}, {_chain(name, parts[len(parts) // 2 :])})"
    return reduce(lambda code, part: f"{name}({code}, {part})", parts)


def _number(expr: sp.Expr) -> str:
    if expr.is_Rational and sp.Rational(float(expr)) == expr:
        return f"Ball({float(expr)!r}, 0.0)"
    value = sp.N(expr, DIGITS)
    if not value.is_real:
        raise ProofError(f"{sp.sstr(expr)} is not a real number; only real numbers can be enclosed")
    return f"Ball({float(value)!r}, {abs(float(value)) * LAST_PLACE!r})"


def _power(base: sp.Expr, power: sp.Expr) -> str:
    code = ball_code(base)
    if power.is_Integer:
        product = _chain("bmul", [code] * abs(int(power)))
        return product if power > 0 else f"binv({product})"
    if power in (sp.S.Half, -sp.S.Half):
        return f"bsqrt({code})" if power > 0 else f"binv(bsqrt({code}))"
    return f"bexp(bmul({ball_code(power)}, blog({code})))"


@lru_cache(maxsize=256)
def ball_law_address(law: sp.Expr, speed: sp.Symbol, parameters: tuple[sp.Symbol, ...]) -> int:
    """The address of a compiled function that encloses an impact law and its two derivatives: see `engine.law.write_law_ball`.

    Raises:
        ProofError: the law has a part for which no enclosure is known.
    """
    exprs = [law, sp.diff(law, speed), sp.diff(law, speed, 2)]
    shared, results = sp.cse(exprs, symbols=(sp.Symbol(f"_x{i}") for i in count()), order="none")
    lines = [f"    {speed} = Ball(centre, radius)", *(f"    {symbol} = Ball(p[{i}], 0.0)" for i, symbol in enumerate(parameters))]
    lines += [f"    {name} = {ball_code(value)}" for name, value in shared]
    lines += [f"    out[{2 * i}], out[{2 * i + 1}] = {ball_code(result)}" for i, result in enumerate(results)]
    text = "\n".join(["def law(centre, radius, p, out):", *lines])
    return int(law_of("impact law in balls", text, balls, elementary).address)
