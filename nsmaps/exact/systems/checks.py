"""Checks of a system's formulas when its class is defined: of their form, without evaluating a number."""

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.flows.formulas import S, V, check_form, check_symbols, displacement_at, in_symbols
from nsmaps.exact.flows.source import PrematureFormulaError, law_of, period_of, walls_of
from nsmaps.exact.systems.walls import ImpactFormulas


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
