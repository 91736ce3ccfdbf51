"""The same formulas in balls: from what is derived of a displacement to functions that enclose it over sets of states."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import sympy as sp

from nsmaps.errors import ProofError
from nsmaps.exact.bounding import Lesser
from nsmaps.exact.generate import UP, Formulas, V, W, formulas_of, impact_law
from nsmaps.exact.printing import PHI, shared_parts
from nsmaps.exact.symbols import Flow

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

WAVES = {
    sp.sin: "bwave({0})[1]",
    sp.cos: "badd((1.0, 0.0), bwave({0})[0])",
    sp.exp: "bexp({0})",
    sp.log: "blog({0})",
    sp.Abs: "babs({0})",
}
DECORATOR = '@njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)'  #: as `INNER` of `swarm.py`
LONG = 16  #: parts of a sum or product that are written one within the other
CHAINS = {sp.Add: "badd", sp.Mul: "bmul", sp.Max: "bmax", sp.Min: "bmin", Lesser: "bmin"}


def ball_code(expr: sp.Expr) -> str:
    """Python that encloses an expression, whose symbols are names of balls.

    Raises:
        ProofError: the expression has a part that nothing is known to enclose.
    """
    if expr.is_Symbol:
        return str(expr)
    if expr.is_number:
        return _number(expr)
    if isinstance(expr, sp.Mul) and expr.args[0] is sp.S.NegativeOne:
        return f"bneg({ball_code(sp.Mul(*expr.args[1:]))})"
    if type(expr) in CHAINS:
        return _chain(CHAINS[type(expr)], [ball_code(part) for part in expr.args])
    if isinstance(expr, sp.Pow):
        return _power(*expr.args)
    if isinstance(expr, sp.Piecewise) and len(expr.args) == 2 and expr.args[0][1] == UP:
        return f"({ball_code(expr.args[0][0])} if up else {ball_code(expr.args[1][0])})"
    if type(expr) in WAVES:
        return WAVES[type(expr)].format(ball_code(expr.args[0]))
    if isinstance(expr, (sp.tan, sp.sinh, sp.cosh, sp.tanh)):
        return ball_code(expr.rewrite(sp.cos) if isinstance(expr, sp.tan) else expr.rewrite(sp.exp))
    raise ProofError(
        f"{sp.sstr(expr)} cannot be enclosed over a set of states; accepted: sums, products, powers, sin, cos, tan, exp, log, "
        "sinh, cosh, tanh, abs, max and min"
    )


def _chain(name: str, parts: Sequence[str]) -> str:
    if len(parts) > LONG:  # Python reads at most 200 parentheses within each other
        return f"{name}({_chain(name, parts[: len(parts) // 2])}, {_chain(name, parts[len(parts) // 2 :])})"
    code = parts[0]
    for part in parts[1:]:
        code = f"{name}({code}, {part})"
    return code


def _number(expr: sp.Expr) -> str:
    if expr.is_Rational and sp.Rational(float(expr)) == expr:
        return f"({float(expr)!r}, 0.0)"
    value = sp.N(expr, 40)
    if not value.is_real:
        raise ProofError(f"{sp.sstr(expr)} is no real number; only real ones can be enclosed")
    return f"({float(value)!r}, {abs(float(value)) * 2.0**-52!r})"


def _power(base: sp.Expr, power: sp.Expr) -> str:
    code = ball_code(base)
    if power.is_Integer:
        product = _chain("bmul", [code] * abs(int(power)))
        return product if power > 0 else f"binv({product})"
    if power in (sp.S.Half, -sp.S.Half):
        return f"bsqrt({code})" if power > 0 else f"binv(bsqrt({code}))"
    return f"bexp(bmul({ball_code(power)}, blog({code})))"


def _function(head: str, doc: str, exprs: list[sp.Expr], unpack: list[str]) -> str:
    """The source of one jitted function that returns balls of the expressions."""
    shared, results = shared_parts(exprs)
    lines = [DECORATOR, f"def {head}:", f'    """{doc}"""', *(f"    {line}" for line in unpack)]
    lines += [f"    {name} = {ball_code(value)}" for name, value in shared]
    return "\n".join([*lines, f"    return ({', '.join(map(ball_code, results))},)"]) + "\n"


def _remainders(flow: Flow, k: dict[sp.Expr, sp.Expr]) -> list[str]:
    lines = [f"{w.c}, {w.n}, {w.r} = bwave(bmul({ball_code(k[w.k])}, s))" for w in flow.waves]
    lines += [f"{q.x}, {q.e} = bgrowth(bmul({ball_code(k[q.k])}, s))" for q in flow.growths]
    return lines + [f"{q.n}, {q.r} = btwin(bmul({ball_code(k[q.k])}, s), {q.upper.x})" for q in flow.twins]


def ball_source(system: "ImpactSystem") -> str:
    """The source of the functions of `ballflow.py`, for a system's class.

    Raises:
        SystemDefinitionError: as `formulas_of`.
        ProofError: the formulas have a part that nothing is known to enclose.
    """
    f: Formulas = formulas_of(system)
    p = [f"{symbol} = (p[{i}], 0.0)" for i, symbol in enumerate(f.symbols.values())]
    state = [*p, "_phi, _less, _sin = at", "_z = z", "_w = w"]
    plain = {k: k for k in f.flow.frequencies}
    places, rebound = impact_law(f.system)
    rebound.append(sp.diff(rebound[1], V))
    bends = [sp.diff(f.tangent[i], x) for i, x in ((0, PHI), (0, W), (1, W), (2, PHI), (2, W), (3, W))]
    bends += [f.flow.restore(f.flow.rate(rate)) for rate in f.tangent[2:]]
    timed = [*state, "_s = s", *_remainders(f.flow, plain)]
    return "\n\n".join(
        [
            _function("ball_places(p)", "Places of the upper and lower wall.", places, p),
            _function("ball_rebound(p, up, v)", "Speed after an impact and its two derivatives.", rebound, [*p, f"{V} = v"]),
            _function("ball_rate(p)", "Radians of phase a unit of time.", [2 * sp.pi / f.period], p),
            _function("ball_coefficients(p, at, z, w)", "What is free of s.", f.free, state),
            _function("ball_bounds(p, at, z, w)", "Bounds on |jerk| and |snap|.", f.limits[:2], state),
            _function(
                "ball_motion(c, s)",
                "Displacement, velocity, acceleration, jerk.",
                f.sums[:4],
                ["_s = s", *_remainders(f.flow, f.named)],
            ),
            _function("ball_tangent(p, at, z, w, s)", "By phase and velocity at fixed s.", f.tangent, timed),
            _function("ball_bends(p, at, z, w, s)", "The same, once more.", bends, timed),
        ]
    )
