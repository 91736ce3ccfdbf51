"""A system's formulas in symbols: the displacement after an impact, walls and impact laws, and what no flight can be refused."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.source import displacement_of, law_of, walls_of

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

S = sp.Symbol("_s", real=True)  #: the time since the impact
PHI = sp.Symbol("_phi", real=True)  #: the phase, place and velocity of the impact
Z = sp.Symbol("_z", real=True)
W = sp.Symbol("_w", real=True)
EXACT, ROUNDED = sp.Float("1e-35"), sp.Float("1e-12")  #: what a formula that holds is off by, as it is, or with floats in it
V = sp.Symbol("_v", nonnegative=True)  #: the speed just before an impact


def in_symbols(cls: "type[ImpactSystem]", fixed: dict[str, Any]) -> tuple[Any, dict[str, sp.Symbol]]:
    """A system with symbols for its parameters and the values given for its other fields, and these symbols."""
    symbols = {name: sp.Symbol(f"_p_{name}", real=True) for name in cls.parameter_names()}
    return cls.model_construct(**symbols, **fixed), symbols


def impact_law(symbolic: Any) -> tuple[list[sp.Expr], list[sp.Expr]]:
    """The places of the upper and of the lower wall, and the speeds after impacts of speed V on them."""
    table = walls_of(symbolic)
    base = next(iter(table))
    by_side = {wall.side: name for name, wall in table.items()}
    names = by_side.get(1, base), by_side.get(-1, base)
    return [table[name].at for name in names], [law_of(symbolic, V, name) for name in names]


def displacement_at(symbolic: Any, period: sp.Expr) -> sp.Expr:
    """The displacement at S after an impact at the phase PHI, the place Z and the velocity W."""
    start = PHI * period / (2 * sp.pi)
    return displacement_of(symbolic, start + S, start, Z, W)


def check_flight(name: str, given: sp.Expr, period: sp.Expr, symbols: dict[str, sp.Symbol]) -> None:
    """Refuse a displacement that is no flight: by its form, where it starts and how it goes on."""
    check_form(given)
    near = ROUNDED if given.has(sp.Float) or period.has(sp.Float) else EXACT
    _check(name, "start at hit.z", given.subs(S, 0) - Z, symbols, near)
    _check(name, "start with the velocity hit.w", sp.diff(given, S).subs(S, 0) - W, symbols, near)
    _check_restart(name, given, period, near)


def _check_restart(name: str, given: sp.Expr, period: sp.Expr, near: sp.Float) -> None:
    """Refuse a flight that does not go on as before when it is started again on its way, from its own place and velocity."""
    early, late = sp.Rational(2, 7), sp.Rational(3, 5)
    for values in trials(sp.diff(given, S), period, Z):
        rest = {x: value for x, value in values.items() if x not in (S, PHI, Z, W)}
        start = {PHI: values.get(PHI, sp.S.One), Z: values.get(Z, sp.S.One), W: values.get(W, sp.S.One)}
        place, velocity = (sp.N(x.subs(rest).subs({S: early, **start}), 60) for x in (given, sp.diff(given, S)))
        phase = start[PHI] + 2 * sp.pi * early / period.subs(rest)
        again = sp.N(given.subs(rest).subs({S: late, PHI: sp.N(phase, 60), Z: place, W: velocity}), 50)
        whole = sp.N(given.subs(rest).subs({S: early + late, **start}), 50)
        if not abs(again - whole) < near * (1 + abs(whole)):
            raise SystemDefinitionError(
                f"{name}.displacement does not go on as before when a flight is started again on its way: at the time "
                f"{early + late} after the impact it is {sp.N(whole, 8)}, started again at {early} it is {sp.N(again, 8)}"
            )


def _check(name: str, what: str, residue: sp.Expr, symbols: dict[str, sp.Symbol], near: sp.Float) -> None:
    """Refuse a displacement whose residue is not zero at a few points."""
    check_symbols(name, [residue], set(symbols.values()))
    for values in trials(residue):
        value = abs(sp.N(residue.subs(values), 60))
        if not value < near:
            raise SystemDefinitionError(f"{name}.displacement does not {what}: off by {sp.N(value, 6)} at {values_told(values)}")


def values_told(values: Mapping[sp.Symbol, Any]) -> str:
    """Values of parameters and of numbers of the flight, by the names that an author has for them."""
    told = {PHI: "phi", Z: "hit.z", W: "hit.w", S: "t - hit.t"}
    return ", ".join(f"{told.get(x, str(x).removeprefix('_p_'))} = {value}" for x, value in values.items())


def trials(*exprs: sp.Expr) -> list[dict[sp.Symbol, sp.Expr]]:
    """Three points to try expressions at."""
    free = sorted(set().union(*(expr.free_symbols for expr in exprs)), key=str)
    return [{x: sp.Rational(7 + 3 * i + 5 * k, 11 + 4 * i + k) for i, x in enumerate(free)} for k in range(3)]


def check_symbols(name: str, exprs: list[sp.Expr], parameters: set[sp.Symbol]) -> None:
    """Refuse formulas with symbols that are neither of the flight nor parameters."""
    unknown = set().union(*(expr.free_symbols for expr in exprs)) - {PHI, Z, W, V} - parameters
    if unknown:
        raise SystemDefinitionError(
            f"the formulas of {name} have unknown symbols: {', '.join(sorted(map(str, unknown)))}; expected: the arguments "
            "they are given and the system's own parameters"
        )


def check_form(expr: sp.Expr) -> None:
    """Refuse an expression that `Flow.split` cannot split; what is simple takes no simplification."""
    if expr == S or not expr.has(S):
        return
    if isinstance(expr, (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh)):
        k = sp.diff(expr.args[0], S)
        if k.has(S) and sp.simplify(k).has(S):
            raise SystemDefinitionError(f"{expr} has an argument that is not linear in time; only A + k t is accepted")
    elif expr.is_Add or expr.is_Mul or (expr.is_Pow and expr.exp.is_Integer and expr.exp > 0):
        for part in expr.args:
            check_form(part)
    else:
        raise SystemDefinitionError(
            f"{sp.sstr(expr)} cannot be followed in time; expected: powers of t and sin, cos, exp, sinh, cosh of A + k t"
        )
