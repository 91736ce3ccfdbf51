"""Noise in the formulas of a class of systems with modes: over a step in time it is a cubic, whose derivatives are states too.

These states are the noise and its derivatives by the time in units of the step, so that all are as large as the noise.
"""

from collections.abc import Mapping, Sequence

import sympy as sp

from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.modes.definitions.definition import Definition

STEP = sp.Symbol("_h", positive=True)  #: of the grid in time, the last of the symbols
DEGREE = 3  #: of the noise over a step


def check_noise(name: str, noise: str, taken: Sequence[str]) -> None:
    """Refuse a name of the noise that is that of something else."""
    if not noise.isidentifier() or noise in taken:
        raise SystemDefinitionError(
            f"{name}.noise is {noise!r}; expected: a name of its own for the noise, such as 'eta', which formulas use as y.eta"
        )


def noise_states(noise: str) -> dict[str, sp.Symbol]:
    """The noise and its derivatives by their names, as states."""
    return {noise if k == 0 else f"_{noise}_{k}": sp.Symbol(f"_n_{k}", real=True) for k in range(DEGREE + 1)}


def noise_rates(states: Mapping[str, sp.Symbol]) -> dict[str, sp.Expr]:
    """The rates of the noise and its derivatives."""
    symbols = list(states.values())
    return {name: y / STEP for name, y in zip(states, symbols[1:], strict=False)} | dict.fromkeys(list(states)[-1:], sp.S.Zero)


def check_driven(name: str, noise: str, definition: Definition) -> None:
    """Refuse noise that no formula holds."""
    place, own = definition.states.index(noise), len(definition.states) - DEGREE - 1
    symbol = definition.variables[place]
    rows = [row for mode in definition.rates for row in mode[:own]] + [one.function for one in definition.transitions]
    smooth = [rate for mode in definition.smooth for rate in mode[:own]]
    if all(row.coefficients[place] == 0 for row in rows) and not any(x.has(symbol) for x in (*smooth, *definition.derived)):
        raise SystemDefinitionError(f"{name}.noise is {noise!r}, and no rate or guard has it; expected: y.{noise} in formulas")
