"""Compiled code at work for one system with modes under noise."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError, SystemDefinitionError
from nsmaps.exact.kernel import STEPS
from nsmaps.exact.modes.kernel import known_definition
from nsmaps.exact.modes.tables.memory import Record, memory
from nsmaps.exact.modes.tables.tables import Tables, tables_of
from nsmaps.exact.noise import modes
from nsmaps.interrupts import check_stop

if TYPE_CHECKING:
    from nsmaps.exact.systems.hybrid import HybridSystem


@dataclass(frozen=True, slots=True)
class DrivenKernel:
    """The compiled engine with the table of one system, whose last states are the noise over a step and its derivatives."""

    table: Tables

    def noisy_orbit(self, law: Any, step: Floats, parts: int, chatter: float, rng: np.random.Generator, tables: Any) -> None:
        """One realisation under noise, written into its tables: see `nsmaps.dynamics.noise.orbits`."""
        p, w, run, count = (
            self.table,
            memory(self.table, 0, chatter=chatter),
            np.zeros(modes.NUMBERS),
            np.zeros(modes.COUNTS, np.int64),
        )
        states, turns, codes, outcome, time, eta, hits = tables
        n, m = len(codes), states.shape[1]
        rows = states[:, None], turns[:, None], codes[:, None], outcome[:, None], time[:, None]
        found = Record(*rows, np.empty((n, 1, m, 0)), np.empty((n, 1, 3)))
        modes.ready(p, law[3], rng.standard_normal(), run, count, found, eta, w)
        while count[modes.FATE] == modes.UNDER_WAY and count[modes.MADE] < n:
            normals, at = rng.standard_normal((STEPS, parts, 3)), 0
            while at < STEPS:
                at = modes.noisy_motion(p, law[2], step, normals, at, run, count, found, eta, hits, w)
                check_stop()
        modes.finish(count, found, eta)


def driven_kernel(system: "HybridSystem", step: float) -> DrivenKernel:
    """The kernel of a system for noise on a grid in time.

    Raises:
        NsmapsError: the class declares no noise.
        SystemDefinitionError: no formula has it, or it is in formulas that are not affine in the states.
    """
    if not system.noise:
        raise NsmapsError(
            f'{type(system).__name__} has no noise; expected: a name for it in the class, such as `noise = "noise"`, and '
            "y.noise in the formulas, beside the forcing"
        )
    return _kernel(system, step)


@lru_cache(maxsize=64)
def _kernel(system: "HybridSystem", step: float) -> DrivenKernel:
    definition = known_definition(system, driven=True)
    if definition.smooth:
        raise SystemDefinitionError(
            f"{type(system).__name__} has rates or guards that are not affine in the states, and noise is added to flights of "
            "affine modes alone; expected: such a system, or noise on the images of its map"
        )
    return DrivenKernel(tables_of(definition, (*system.parameters.values(), step), step))
