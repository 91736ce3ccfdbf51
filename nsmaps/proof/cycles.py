"""Cycles as a certificate states them, from periodic orbits that were found in floats."""

from collections.abc import Iterable
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import arb, ctx

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.proof.formula import balls_of, equation_of
from nsmaps.proof.maps.prove import certificate_of_map
from nsmaps.verify.certificate import Certificate
from nsmaps.verify.cycles import BITS, krawczyk, stated_of, verified
from nsmaps.verify.formula import Doubtful

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit
    from nsmaps.exact.systems.system import ImpactSystem
    from nsmaps.verify.formula import System

FIRST, ROUNDS, WIDER = 1e-16, 8, 2.0  #: the first radii, how often and by which factor they are inflated
FACTORS = 4.0 ** np.arange(24, -1, -2)  #: of the radii at which a proof begins to succeed, the largest first


def stated(system: "ImpactSystem", equation: "System", orbit: "PeriodicOrbit") -> dict[str, Any]:
    """The statement of a cycle, with the largest radii tried within which it is shown to be the only one.

    Their shape is found by inflation of a small box (S. M. Rump, Acta Numerica 19 (2010) 287), their size by `FACTORS`.

    Raises:
        ProofError: it is not shown to exist; with the reason at the smallest box.
    """
    walls, states = impacts_of(system, orbit)
    try:
        radii = _inflated(equation, walls, states)
    except Doubtful as error:
        raise ProofError(f"the cycle {orbit.word} from {orbit.states[0]} is not shown to exist: {error}") from error
    for factor in FACTORS:
        data = {"walls": walls, "states": states.tolist(), "radii": (factor * radii).tolist()}
        try:
            verified(equation, stated_of(data, len(equation.walls)))
        except (Doubtful, ValueError) as error:
            reason = error
        else:
            return data
    raise ProofError(f"the cycle {orbit.word} from {orbit.states[0]} is not shown to exist: {reason}")


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


def _inflated(equation: "System", walls: list[int], states: Floats) -> Floats:
    """Radii (m, 2) for which Krawczyk's box is within them, or nearly so."""
    with ctx.workprec(BITS):
        middle, radii = [arb(x) for x in states.ravel()], np.full(states.size, FIRST)
        for _ in range(ROUNDS):
            box = krawczyk(equation, walls, middle, [x + arb(0, r) for x, r in zip(middle, radii, strict=True)]).box
            reached = np.array([float(abs(x - y).upper()) for x, y in zip(box, middle, strict=True)])
            if (reached < radii).all():
                break
            radii = WIDER * np.maximum(radii, reached)
    return radii.reshape(states.shape)
