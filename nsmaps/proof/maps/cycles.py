"""Cycles of a map given by formulas as a certificate states them, from periodic orbits that were found in floats."""

from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.errors import ProofError
from nsmaps.proof.maps.radii import largest_statement
from nsmaps.verify.maps.cycles import krawczyk, stated_of, verified
from nsmaps.verify.maps.formula import PiecewiseFormulas

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit

FIRST = 2.0**-53  #: the first radii relative to states


def stated(formulas: PiecewiseFormulas, orbit: "PeriodicOrbit") -> dict[str, Any]:
    """The statement of a cycle, with the largest radii tried within which it is shown to be the only one of its pieces.

    Raises:
        ProofError: it is not shown to exist; with the reason at the smallest box.
    """
    if not orbit.converged:
        raise ProofError(f"no cycle of {len(orbit.words)} returns was found near {orbit.states[0]}; expected: a state near one")
    pieces, states = [formulas.letters.index(letter) for letter in orbit.words], np.asarray(orbit.states, float)
    scale = np.abs(states).max(axis=0)
    first = np.broadcast_to(FIRST * np.where(scale > 0, scale, 1.0), states.shape)
    return largest_statement(
        orbit,
        {"pieces": pieces, "states": states.tolist()},
        first,
        lambda middle, box: krawczyk(formulas, pieces, middle, box).box,
        lambda data: verified(formulas, stated_of(data, formulas)),
    )
