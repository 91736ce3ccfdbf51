"""Cycles as a certificate states them, from periodic orbits that were found in floats."""

from collections.abc import Iterable
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors.arguments import checked
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.proof.formula import balls_of, equation_of
from nsmaps.proof.maps.prove import certificate_of_map
from nsmaps.proof.maps.radii import largest_statement
from nsmaps.verify.certificate import Certificate
from nsmaps.verify.cycles import krawczyk, stated_of, verified

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit
    from nsmaps.exact.systems.system import ImpactSystem
    from nsmaps.verify.formula import System

FIRST = 1e-16  #: the first radii, in radians and of the largest speed


def stated(system: "ImpactSystem", equation: "System", orbit: "PeriodicOrbit") -> dict[str, Any]:
    """The statement of a cycle, with the largest radii tried within which it is shown to be the only one.

    Their shape is found by inflation of a small box (S. M. Rump, Acta Numerica 19 (2010) 287), their size by `FACTORS`.

    Raises:
        ProofError: it is not shown to exist; with the reason at the smallest box.
    """
    walls, states = impacts_of(system, orbit)
    return largest_statement(
        orbit,
        {"walls": walls, "states": states.tolist()},
        FIRST * np.broadcast_to([1.0, states[:, 1].max()], states.shape),
        lambda middle, box: krawczyk(equation, walls, middle, box).box,
        lambda data: verified(equation, stated_of(data, len(equation.walls))),
    )


@checked
def certificate_of(system: "ImpactSystem | PiecewiseMap", orbits: Iterable["PeriodicOrbit"]) -> Certificate:
    """A certificate of cycles alone."""
    if isinstance(system, PiecewiseMap):
        return certificate_of_map(system, orbits)
    equation = equation_of(system)
    balls = balls_of(equation)
    about = {"system": repr(system), "program": f"nsmaps {version('nsmaps')}"}
    return Certificate(about, equation, cycles=[stated(system, balls, orbit) for orbit in orbits])


def impacts_of(system: "ImpactSystem", orbit: "PeriodicOrbit") -> tuple[list[int], Floats]:
    """The walls, and the phases and speeds (m, 2), of the m impacts of a periodic orbit of an exact system."""
    letters, walls, states = list(system.walls()), [], []
    for state, word in zip(orbit.states, orbit.words, strict=True):
        hits = system.impacts(state, len(word) - 1)
        walls += [letters.index(hits.walls[k]) for k in hits.wall]
        states += [hits.phase % (2 * np.pi), hits.speed]
    return walls, np.concatenate([np.column_stack(states[i : i + 2]) for i in range(0, len(states), 2)])
