"""Compiled code at work for one system under noise whose flights are those of modes, affine or nonlinear."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.exact.kernel import STEPS
from nsmaps.exact.modes.definitions.build import STEP
from nsmaps.exact.modes.kernel import known_definition
from nsmaps.exact.modes.tables.memory import Record, memory
from nsmaps.exact.modes.tables.tables import Tables, tables_of
from nsmaps.exact.noise import modes
from nsmaps.exact.observables.formulas import Plan
from nsmaps.exact.observables.motions import COUNTED, Observation
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.observables.totals import plan_by_modes
from nsmaps.exact.systems.guards import HybridFormulas
from nsmaps.interrupts import check_stop


@dataclass(frozen=True, slots=True)
class DrivenKernel:
    """The compiled engine with the table of one system, whose last own states are the noise over a step and its derivatives."""

    table: Tables
    values: tuple[float, ...]  #: of the parameters, and the step
    plan: Plan  #: of what is added up along realisations

    def noisy_orbit(self, law: Any, step: Floats, parts: int, chatter: float, rng: np.random.Generator, tables: Any) -> None:
        """One realisation under noise, written into its tables: see `nsmaps.dynamics.noise.orbits`; totals last, if there are."""
        p, w = self.table, memory(self.table, 0, chatter=chatter)
        *_, h, sigma = law
        motion = modes.MotionRecord(np.zeros(modes.NUMBERS), np.zeros(modes.COUNTS, np.int64))
        states, turns, codes, outcome, time, eta, hits, *totals = tables
        n, m = len(codes), states.shape[1]
        rows = states[:, None], turns[:, None], codes[:, None], outcome[:, None], time[:, None]
        out = modes.Realisation(Record(*rows, np.empty((n, 1, m, 0)), np.empty((n, 1, 3))), eta, hits)
        o = Observation(self.plan.memory(self.values, np.inf), memory(self.table, 0), np.array([0, COUNTED]))
        modes.prepare(p, sigma * rng.standard_normal(), motion, out, w)
        while motion.count[modes.FATE] == modes.UNDER_WAY and motion.count[modes.MADE] < n:
            normals, motion.count[modes.DRAWN] = rng.standard_normal((STEPS, parts, 3)), 0
            while motion.count[modes.DRAWN] < STEPS:
                modes.noisy_motion(p, modes.Grid(h, step), normals, motion, out, o, w)
                check_stop()
        outcome[motion.count[modes.MADE] :] = motion.count[modes.FATE]
        for total in totals:
            total[:] = o.q.total * self.plan.scales


@lru_cache(maxsize=64)
def driven_kernel(system: HybridFormulas, step: float, observables: tuple[Observable, ...] = ()) -> DrivenKernel:
    """The kernel of a system for noise on a grid in time, and for totals of observables.

    Raises:
        NsmapsError: the class declares no noise.
        SystemDefinitionError: no formula has it.
    """
    if not system.noise:
        raise NsmapsError(
            f'{type(system).__name__} has no noise; expected: a name for it in the class, such as `noise = "noise"`, and '
            "y.noise in the formulas, beside the forcing"
        )
    definition, values = known_definition(system, driven=True), (*system.parameters.values(), step)
    plan = plan_by_modes(system, observables, definition, (*system.parameter_names(), STEP.name))
    return DrivenKernel(tables_of(definition, values, step), values, plan)
