"""The formulas of a class of systems with modes as it states them: called with symbols, and of the kinds that are expected."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import sympy as sp

from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.flows.source import ADVICE
from nsmaps.exact.systems.guards import Guard, HybridFormulas, PoincareSection, SlidingSurface

Formulas = tuple[Mapping[str, Mapping[str, Any]], Mapping[str, Guard | SlidingSurface], PoincareSection]
SIDES = "before", "after"


def evaluate_formulas(system: HybridFormulas, t: sp.Expr, y: SimpleNamespace) -> Formulas:
    """The modes, guards and section of a system, at symbols for the time and the states.

    Raises:
        SystemDefinitionError: one of them fails with symbols, or is of another kind.
    """
    modes, guards, section = (_call(system, formula, t, y) for formula in ("modes", "guards", "section"))
    if not isinstance(modes, Mapping) or not modes or not all(isinstance(rates, Mapping) for rates in modes.values()):
        raise _wrong_kind(
            system, "modes", modes, "the rates of all states by the names of modes, as {'flight': {'x': y.v, 'v': -1}}"
        )
    if not isinstance(guards, Mapping) or not all(isinstance(one, Guard | SlidingSurface) for one in guards.values()):
        raise _wrong_kind(system, "guards", guards, "a `Guard` or a `SlidingSurface` by its name, as {'I': Guard('flight', y.x)}")
    if not isinstance(section, PoincareSection):
        raise _wrong_kind(system, "section", section, "a `PoincareSection`, as PoincareSection('I', ('v', 'phi'))")
    if section.side not in SIDES:
        raise _wrong_kind(system, "section", section.side, f"its side as {' or '.join(map(repr, SIDES))}")
    return modes, guards, section


def _wrong_kind(system: HybridFormulas, formula: str, given: Any, expected: str) -> SystemDefinitionError:
    """The error of a formula of another kind."""
    return SystemDefinitionError(f"{type(system).__name__}.{formula} is {given!r:.60}; expected: {expected}")


def _call(system: HybridFormulas, formula: str, t: sp.Expr, y: SimpleNamespace) -> Any:
    """The result of a formula; an error of Python in it as one of the definition."""
    try:
        return getattr(system, formula)(t, y)
    except NsmapsError:
        raise
    except Exception as error:
        why = f"{type(error).__name__}: {error}".replace("_p_", "").replace("_y_", "y.").replace("_phi", "phi")
        missing = isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace)
        advice = next((advice for sign, advice in ADVICE.items() if sign in why), "")
        if missing:
            advice = f"the states are {', '.join(f'y.{name}' for name in vars(y))}"
        message = f"{type(system).__name__}.{formula} cannot be written in symbols ({why}){advice and f'; {advice}'}"
        raise SystemDefinitionError(message) from error
