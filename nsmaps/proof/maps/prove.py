"""A certificate of a map given by formulas: cycles, and a forward invariant set of cells around an attractor."""

from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.coordinates import BoxLike, StateLike, as_box
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.errors import ProofError
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.progress import Progress, shows
from nsmaps.proof.maps.closed import closed_set
from nsmaps.proof.maps.cycles import stated
from nsmaps.proof.maps.formula import stated_map
from nsmaps.verify.certificate import Certificate
from nsmaps.verify.maps.closed import cells_of
from nsmaps.verify.maps.formula import map_of

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit


def certificate_of_map(system: PiecewiseMap, orbits: Iterable["PeriodicOrbit"]) -> Certificate:
    """A certificate of cycles alone.

    Raises:
        ProofError: one is not shown to exist.
    """
    formulas = stated_map(system)
    balls = map_of(formulas)
    return Certificate(_about(system), formulas, cycles=[stated(balls, each) for each in orbits])


@shows
def prove_map(
    system: PiecewiseMap,
    *,
    cycles: Sequence[tuple[StateLike, int]] = (),
    start: StateLike | None = None,
    box: BoxLike | None = None,
    n_cells: int | Mapping[str, int] = 64,
    n_parts: int = 4,
    transient: int = 2000,
    progress: Progress | None = None,
) -> Certificate:
    """Search for a proof that cycles exist, and that a set of cells around an attractor is forward invariant.

    The search works in floats and with the images that `nsmaps.verify` computes; it proves nothing.

    Args:
        system: by formulas.
        cycles: states near cycles, with their periods.
        start: a state whose orbit comes to the attractor; None for cycles alone.
        box: of states, that is divided into cells; of an angle they are on the whole circle.
        n_cells: number of cells along each coordinate, or by coordinate.
        n_parts: number of parts of a cell along each coordinate, whose images are enclosed one by one, a power of two.
        transient: returns of the orbit until it is on the attractor.
        progress: called now and then.

    Raises:
        ProofError: a cycle is not proved, the orbit ends, or images of the cells leave the box or have no bound.
    """
    formulas, names = stated_map(system), system.coordinates
    balls = map_of(formulas)
    known = [stated(balls, periodic_orbit(system, near, period)) for near, period in cycles]
    if start is None:
        return Certificate(_about(system), formulas, cycles=known)
    if box is None:
        raise ProofError("a forward invariant set needs a box of states; expected: `box`, with bounds of each coordinate")
    low, high = as_box(box, names).T.tolist()
    counts = [n_cells if isinstance(n_cells, int) else n_cells.get(name, 0) for name in names]
    grid: dict[str, Any] = {"low": low, "high": high, "cells": counts, "parts": n_parts}
    try:
        read = cells_of(grid, balls)
    except ValueError as error:
        raise ProofError(str(error)) from error
    seed = orbit(system, start, transient).final
    if not np.isfinite(seed).all():
        raise ProofError(
            f"the orbit from {start} ends within {transient} returns; expected: a state whose orbit comes to an attractor"
        )
    return Certificate(_about(system), formulas, grid=grid, codes=closed_set(balls, read, seed), cycles=known)


def _about(system: PiecewiseMap) -> dict[str, str]:
    """Of what the certificate is, and of which program."""
    return {"system": repr(system), "program": f"nsmaps {version('nsmaps')}"}
