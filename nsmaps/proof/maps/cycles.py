"""Cycles of a map given by formulas as a certificate states them, from periodic orbits that were found in floats."""

from typing import TYPE_CHECKING, Any

import numpy as np
from flint import arb, ctx

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.verify.formula import Doubtful
from nsmaps.verify.maps.cycles import BITS, krawczyk, stated_of, verified
from nsmaps.verify.maps.formula import PiecewiseFormulas

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit

FIRST, ROUNDS, WIDER = 2.0**-53, 8, 2.0  #: the first radii relative to states, how often and by which factor they are inflated
FACTORS = 4.0 ** np.arange(24, -1, -2)  #: of the radii at which a proof begins to succeed, the largest first


def stated(map: PiecewiseFormulas, orbit: "PeriodicOrbit") -> dict[str, Any]:
    """The statement of a cycle, with the largest radii tried within which it is shown to be the only one of its pieces.

    Raises:
        ProofError: it is not shown to exist; with the reason at the smallest box.
    """
    if not orbit.converged:
        raise ProofError(f"no cycle of {len(orbit.words)} returns was found near {orbit.states[0]}; expected: a state near one")
    pieces, states = [map.letters.index(letter) for letter in orbit.words], np.asarray(orbit.states, float)
    reason: Exception | None = None
    try:
        radii = _inflated(map, pieces, states)
        for factor in FACTORS:
            data = {"pieces": pieces, "states": states.tolist(), "radii": (factor * radii).tolist()}
            try:
                verified(map, stated_of(data, map))
                return data
            except (Doubtful, ValueError) as error:
                reason = error
    except Doubtful as error:
        reason = error
    raise ProofError(f"the cycle {orbit.word} from {orbit.states[0]} is not shown to exist: {reason}")


def _inflated(map: PiecewiseFormulas, pieces: list[int], states: Floats) -> Floats:
    """Radii (q, n) for which Krawczyk's box is within them, or nearly so."""
    with ctx.workprec(BITS):
        scale = np.abs(states).max(axis=0)
        radii = np.broadcast_to(FIRST * np.where(scale > 0, scale, 1.0), states.shape).ravel().copy()
        middle = [arb(x) for x in states.ravel()]
        for _ in range(ROUNDS):
            box = krawczyk(map, pieces, middle, [x + arb(0, r) for x, r in zip(middle, radii, strict=True)]).box
            reached = np.array([float(abs(x - y).upper()) for x, y in zip(box, middle, strict=True)])
            if (reached < radii).all():
                break
            radii = WIDER * np.maximum(radii, reached)
    return radii.reshape(states.shape)
