"""heyoka's programs of the modes of a nonlinear system: one of the flight, and one of its derivatives.

The time of a program begins at zero with each step. Its parameters are the phase at the beginning of the step, the parameters of
the system, their rates along a direction, and a zero: derivatives by that zero are those along the direction.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.taylor.expressions import expression, heyoka
from nsmaps.exact.taylor.linking import Step, step_of

PHASE, VALUES = 0, 1  #: places of the phase and of the first parameter of the system in the parameters of a program
FLIGHT, BY_START, ALONG = range(3)  #: programs: of a flight, of its derivatives by its start, and along a direction too
QUICK = 1  #: level of optimisation of derivatives, at which they are as fast and compile in a fraction of the time


@dataclass(frozen=True, slots=True)
class Formulas:
    """What a program is made of."""

    rates: tuple[sp.Expr, ...]  #: of the own states of a mode
    derived: tuple[sp.Expr, ...]  #: further states, as formulas of these
    variables: tuple[sp.Symbol, ...]  #: the own states
    symbols: tuple[sp.Symbol, ...]  #: of the parameters
    phase_rate: sp.Expr

    def change(self, formula: sp.Expr) -> sp.Expr:
        """The rate of a formula along the motion."""
        slopes = (sp.diff(formula, x) * rate for x, rate in zip(self.variables, self.rates, strict=True))
        return sp.Add(*slopes, sp.diff(formula, PHI) * self.phase_rate)


def steps_of(definition: Definition, kind: int) -> tuple[int, ...]:
    """The addresses of heyoka's step for each mode of a nonlinear system, `linking`; they hold as long as the process.

    The states of a program of a flight are the own and then the derived ones. Of its derivatives they are the own ones, and
    behind these for each own state its derivatives by the own states, by the phase if there is a forcing, and with ALONG along
    the direction of the parameters.

    Raises:
        NsmapsError: heyoka is not installed.
        SystemDefinitionError: a function has no Taylor series, or heyoka knows none.
    """
    fixed = definition.variables, definition.symbols, definition.phase_rate
    derived = definition.derived if kind == FLIGHT else ()
    return tuple(_step(Formulas(rates, derived, *fixed), kind).address for rates in definition.smooth)


@cache
def _step(formulas: Formulas, kind: int) -> Step:
    return step_of(program_of(formulas, kind))


def program_of(formulas: Formulas, kind: int) -> Any:
    """heyoka's `taylor_adaptive` of formulas. Arguments and errors as `steps_of`."""
    hy, count = heyoka(), len(formulas.symbols)
    states = hy.make_vars(*[f"y{k}" for k in range(len(formulas.rates) + len(formulas.derived))], "")[:-1]
    zero = VALUES + 2 * count
    along = hy.par[zero]
    values = [hy.par[VALUES + k] + (along * hy.par[VALUES + count + k] if kind == ALONG else 0.0) for k in range(count)]
    known = dict(zip((*formulas.variables, *formulas.symbols), (*states[: len(formulas.rates)], *values), strict=True))
    known[PHI] = hy.par[PHASE] + expression(formulas.phase_rate, known) * hy.time
    rates = (*formulas.rates, *map(formulas.change, formulas.derived))
    equations = [(state, expression(rate, known)) for state, rate in zip(states, rates, strict=True)]
    start = [0.0] * len(states)
    if kind == FLIGHT:
        return hy.taylor_adaptive(equations, start, tol=0.0, compact_mode=False)
    phase = [] if formulas.phase_rate == 0 else [hy.par[PHASE]]
    system = hy.var_ode_sys(equations, args=[*states, *phase, *([along] if kind == ALONG else [])], order=1)
    return hy.taylor_adaptive(system, start, tol=0.0, compact_mode=False, opt_level=QUICK)
