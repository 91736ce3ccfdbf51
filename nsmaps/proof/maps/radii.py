"""The radii within which a cycle is stated to be the only one: their shape by inflation, their size by trial."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import arb, ctx

from nsmaps.arrays import Floats
from nsmaps.errors import ProofError
from nsmaps.verify.cycles import BITS
from nsmaps.verify.formula import UnprovedError

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit

ROUNDS, WIDER = 8, 2.0  #: how often and by which factor radii are inflated
FACTORS = 4.0 ** np.arange(24, -1, -2)  #: of the radii at which a proof begins to succeed, the largest first


def largest_statement(
    orbit: "PeriodicOrbit",
    data: dict[str, Any],
    first: Floats,
    krawczyk: Callable[[list[arb], list[arb]], list[arb]],
    verify: Callable[[dict[str, Any]], Any],
) -> dict[str, Any]:
    """The statement of a cycle, with the largest radii tried within which it is shown to be the only one.

    Their shape is found by inflation of a small box (S. M. Rump, Acta Numerica 19 (2010) 287), their size by `FACTORS`.

    Args:
        orbit: named in errors.
        data: the statement without `radii`; its `states` are rows of floats.
        first: radii to begin with, of the shape of the states.
        krawczyk: the box K of a middle and a box around it.
        verify: raises `UnprovedError` or ValueError for a statement that is not shown.

    Raises:
        ProofError: it is not shown to exist; with the reason at the smallest box.
    """
    reason: Exception
    try:
        radii = _inflated(np.array(data["states"], float), first, krawczyk)
    except UnprovedError as error:
        raise ProofError(f"the cycle {orbit.word} from {orbit.states[0]} is not shown to exist: {error}") from error
    for factor in FACTORS:
        statement = data | {"radii": (factor * radii).tolist()}
        try:
            verify(statement)
        except (UnprovedError, ValueError) as error:
            reason = error
        else:
            return statement
    raise ProofError(f"the cycle {orbit.word} from {orbit.states[0]} is not shown to exist: {reason}")


def _inflated(states: Floats, first: Floats, krawczyk: Callable[[list[arb], list[arb]], list[arb]]) -> Floats:
    """Radii of the shape of the states for which Krawczyk's box is within them, or nearly so."""
    with ctx.workprec(BITS):
        middle, radii = [arb(x) for x in states.ravel()], first.ravel().copy()
        for _ in range(ROUNDS):
            box = krawczyk(middle, [x + arb(0, r) for x, r in zip(middle, radii, strict=True)])
            reached = np.array([float(abs(x - y).upper()) for x, y in zip(box, middle, strict=True)])
            if (reached < radii).all():
                break
            radii = WIDER * np.maximum(radii, reached)
    return radii.reshape(states.shape)
