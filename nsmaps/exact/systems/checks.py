"""Checks of a system's formulas when its class is defined: of their form, without evaluating a number."""

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import S, V, W, Z, check_form, check_symbols, displacement_at, in_symbols, trials, values_text
from nsmaps.exact.flows.source import PrematureFormulaError, law_of, period_of, walls_of
from nsmaps.exact.systems.files import place_of
from nsmaps.exact.systems.walls import ImpactFormulas

NEAR = 1e-9  # to which a flight must start at its impact, with parameters that are floats


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


def check_start(system: ImpactFormulas) -> None:
    """Refuse a displacement that does not start at the place and with the velocity of its impact, for the system's parameters.

    A value that is not finite there, as where a formula divides by the time since the impact, is reported at first use.

    Raises:
        SystemDefinitionError: states the deviation, and where the formula is written.
    """
    name, period = type(system).__name__, period_of(system)
    given = displacement_at(system, period)
    check_form(given)
    for what, found, start in (("start at hit.z", given, Z), ("start with the velocity hit.w", sp.diff(given, S), W)):
        residue = found.subs(S, 0) - start
        for values in trials(residue):
            off = sp.N(residue.subs(values))
            if off.is_finite and abs(off) > NEAR * (1 + abs(values.get(start, 0))):
                at = f" at {values_text(values)}" if values else ""
                text = f"{name}.displacement does not {what}: off by {abs(off):.6g}{at}{place_of(type(system), 'displacement')}"
                raise SystemDefinitionError(text)


def _check_form(cls: type[ImpactFormulas], fixed: dict[str, object]) -> None:
    symbolic, symbols = in_symbols(cls, fixed)
    laws = [law_of(symbolic, V, name) for name in walls_of(symbolic)]
    period = period_of(symbolic)
    given = displacement_at(symbolic, period)
    check_form(given)
    check_symbols(cls.__name__, [given, period, *laws], {*symbols.values(), S})
