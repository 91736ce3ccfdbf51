"""A system's formulas in symbols: the displacement after an impact, walls and impact laws, and conditions on a flight."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.source import PrematureFormulaError, acceleration_of, displacement_of, law_of, period_of, walls_of
from nsmaps.exact.systems.walls import ImpactFormulas

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

S = sp.Symbol("_s", real=True)  #: the time since the impact
PHI = sp.Symbol("_phi", real=True)  #: the phase, place and velocity of the impact
Z = sp.Symbol("_z", real=True)
W = sp.Symbol("_w", real=True)
#: largest residue of a formula that holds, exact or with floats in it
EXACT_RESIDUE, ROUNDED_RESIDUE = sp.Float("1e-35"), sp.Float("1e-12")
V = sp.Symbol("_v", nonnegative=True)  #: the speed just before an impact


def in_symbols(cls: "type[System]", fixed: dict[str, Any]) -> tuple[Any, dict[str, sp.Symbol]]:
    """A system with symbols for its parameters and the given values for its other fields, and these symbols."""
    symbols = {name: sp.Symbol(f"_p_{name}", real=True) for name in cls.parameter_names()}
    return cls.model_construct(**symbols, **fixed), symbols


def is_linear(law: sp.Expr) -> bool:
    """True if the speed after an impact is proportional to that before it."""
    return not sp.diff(law, V).has(V) and law.subs(V, 0) == 0


def displacement_at(symbolic: Any, period: sp.Expr) -> sp.Expr:
    """The displacement at S after an impact at the phase PHI, the place Z and the velocity W."""
    start = PHI * period / (2 * sp.pi)
    return displacement_of(symbolic, start + S, start, Z, W)


def check_flight(name: str, given: sp.Expr, period: sp.Expr, symbols: dict[str, sp.Symbol]) -> None:
    """Refuse a displacement that cannot be a flight: by its form, its start and its continuation."""
    check_form(given)
    near = ROUNDED_RESIDUE if given.has(sp.Float) or period.has(sp.Float) else EXACT_RESIDUE
    _check(name, "start at hit.z", given.subs(S, 0) - Z, symbols, near)
    _check(name, "start with the velocity hit.w", sp.diff(given, S).subs(S, 0) - W, symbols, near)
    _check_restart(name, given, period, near)


def checked_acceleration(symbolic: Any, period: sp.Expr, symbols: dict[str, sp.Symbol]) -> sp.Expr:
    """The acceleration at the time S, the place Z and the velocity W; refused if it is not the same one period later."""
    given, name = acceleration_of(symbolic, S, Z, W), type(symbolic).__name__
    check_symbols(name, [given], {*symbols.values(), S})
    for values in trials(given):
        now, later = (sp.N(given.subs(S, time).xreplace(values), 50) for time in (S, S + period))
        if now.is_finite and not abs(later - now) < ROUNDED_RESIDUE * (1 + abs(now)):
            raise SystemDefinitionError(
                f"{name}.acceleration is not the same after one `period`: {sp.N(now, 8)} becomes {sp.N(later, 8)} at "
                f"{values_text(values)}; expected: forces of one period, also as the common one of several"
            )
    return given


def _check_restart(name: str, given: sp.Expr, period: sp.Expr, near: sp.Float) -> None:
    """Refuse a flight that changes when it is restarted at a later time from its own place and velocity."""
    early, late = sp.Rational(2, 7), sp.Rational(3, 5)
    for values in trials(sp.diff(given, S), period, Z):
        parameters_at = {x: value for x, value in values.items() if x not in (S, PHI, Z, W)}
        start = {PHI: values.get(PHI, sp.S.One), Z: values.get(Z, sp.S.One), W: values.get(W, sp.S.One)}
        place, velocity = (sp.N(x.xreplace({**parameters_at, S: early, **start}), 60) for x in (given, sp.diff(given, S)))
        phase = start[PHI] + 2 * sp.pi * early / period.xreplace(parameters_at)
        again = sp.N(given.xreplace({**parameters_at, S: late, PHI: sp.N(phase, 60), Z: place, W: velocity}), 50)
        whole = sp.N(given.xreplace({**parameters_at, S: early + late, **start}), 50)
        if not abs(again - whole) < near * (1 + abs(whole)):
            raise SystemDefinitionError(
                f"{name}.displacement is not the same flight when restarted at a later time: at the time "
                f"{early + late} after the impact it is {sp.N(whole, 8)}, restarted at {early} it is {sp.N(again, 8)}"
            )


def _check(name: str, what: str, residue: sp.Expr, symbols: dict[str, sp.Symbol], near: sp.Float) -> None:
    """Refuse a displacement whose residue is not zero at a few points."""
    check_symbols(name, [residue], set(symbols.values()))
    for values in trials(residue):
        value = abs(sp.N(residue.xreplace(values), 60))
        if not value < near:
            raise SystemDefinitionError(f"{name}.displacement does not {what}: off by {sp.N(value, 6)} at {values_text(values)}")


def values_text(values: Mapping[sp.Symbol, Any]) -> str:
    """Values of parameters and of numbers of the flight, in the author's names."""
    shown = {PHI: "phi", Z: "hit.z", W: "hit.w", S: "t - hit.t"}
    return ", ".join(f"{shown.get(x, str(x).removeprefix('_p_'))} = {value}" for x, value in values.items())


def trials(*exprs: sp.Expr) -> list[dict[sp.Symbol, sp.Expr]]:
    """Three points at which expressions are evaluated."""
    free = sorted(set().union(*(expr.free_symbols for expr in exprs)), key=str)
    return [{x: sp.Rational(7 + 3 * i + 5 * k, 11 + 4 * i + k) for i, x in enumerate(free)} for k in range(3)]


def check_symbols(name: str, exprs: list[sp.Expr], parameters: set[sp.Symbol]) -> None:
    """Refuse formulas with symbols that belong neither to the flight nor to the parameters."""
    unknown = set().union(*(expr.free_symbols for expr in exprs)) - {PHI, Z, W, V} - parameters
    if unknown:
        raise SystemDefinitionError(
            f"the formulas of {name} have unknown symbols: {', '.join(sorted(map(str, unknown)))}; expected: the arguments "
            "of each formula and the parameters of the system"
        )


def check_form(expr: sp.Expr) -> None:
    """Refuse an expression that `Decomposition` cannot decompose; a simple one is not simplified."""
    if expr == S or not expr.has(S):
        return
    if isinstance(expr, (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh)):
        (argument,) = expr.args
        k = sp.diff(argument, S)
        if k.has(S) and sp.simplify(k).has(S):
            raise SystemDefinitionError(f"{expr} has an argument that is not linear in time; expected: A + k t")
    elif expr.is_Add or expr.is_Mul or (expr.is_Pow and expr.exp.is_Integer and expr.exp > 0):
        for part in expr.args:
            check_form(part)
    else:
        raise SystemDefinitionError(
            f"{sp.sstr(expr)} cannot be followed in time; expected: powers of t and sin, cos, exp, sinh, cosh of A + k t"
        )


def check_definition(cls: type[ImpactFormulas]) -> None:
    """Refuse a class from whose flight no bounds can be derived, or whose walls are invalid.

    Formulas are evaluated with symbols for the parameters and with the defaults of the other fields. Where such a field has no
    default (or None), or a formula fails for another reason, such as a name that its module defines further down, errors appear
    at first use.

    Raises:
        SystemDefinitionError: states which formula fails, and how.
    """
    others = {name: field for name, field in cls.model_fields.items() if name not in cls.parameter_names()}
    if any(field.is_required() or field.default is None for field in others.values()):
        return
    try:
        _check_form(cls, {name: field.get_default(call_default_factory=True) for name, field in others.items()})
    except PrematureFormulaError:
        return
    except SystemDefinitionError:
        raise
    except Exception:
        return


def _check_form(cls: type[ImpactFormulas], fixed: dict[str, object]) -> None:
    symbolic, symbols = in_symbols(cls, fixed)
    laws = [law_of(symbolic, V, name) for name in walls_of(symbolic)]
    period = period_of(symbolic)
    given = displacement_at(symbolic, period)
    check_form(given)
    check_symbols(cls.__name__, [given, period, *laws], {*symbols.values(), S})
