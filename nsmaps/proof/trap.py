"""The search for a trap: the largest of some parallelograms around a stable cycle that is shown to be contracted."""

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.errors import ProofError
from nsmaps.verify.formula import System, UnprovedError
from nsmaps.verify.trap import Trap, contraction

if TYPE_CHECKING:
    from nsmaps.arrays import Bools, Floats, Ints
    from nsmaps.dynamics.periodic import PeriodicOrbit

SIZES = (0.08, 0.06, 0.05, 0.04, 0.03, 0.02, 0.01, 0.005, 0.002)  #: half-widths along the first direction: radians, parts of v
SHAPES = ((0.6, (40, 12)), (0.3, (80, 24)))  #: half-width along the second direction beside the first; parts of both
TURNS = (4, 2, 1)  #: of the cycle, in one iterate
PARALLEL = 0.5  #: sine of the angle below which the second direction is taken at a right angle to the first
INSIDE = 1 - 1e-9  #: share of the trap in which cells are sought, for rounding


def found_trap(system: System, letters: list[str], orbit: "PeriodicOrbit") -> Trap:
    """A trap around the first state of a stable cycle.

    Raises:
        ProofError: no parallelogram that was tried is shown to be contracted; the reason of the smallest is given.
    """
    if not orbit.converged or not orbit.stable:
        raise ProofError(
            f"the cycle at {orbit.states[0].tolist()} is not a stable one that was found; expected: a start near a stable cycle"
        )
    speed, phase = orbit.states[0].tolist()
    impacts = sum(len(word) - 1 for word in orbit.words)
    matrix, why = _directions(orbit.derivative, speed), ""
    for size in SIZES:
        for (shape, pieces), turns in product(SHAPES, TURNS):
            at = (phase, speed), (tuple(matrix[0].tolist()), tuple(matrix[1].tolist())), (size, shape * size)
            trap = Trap(letters.index(orbit.words[0][0]), *at, turns * impacts, pieces)
            try:
                contraction(system, trap)
            except UnprovedError as error:
                why = str(error)
            else:
                return trap
    raise ProofError(f"no parallelogram around the cycle at {orbit.states[0].tolist()} is shown to be contracted: {why}")


def trapped(trap: Trap, wall: "Ints", phases: "Ints", n: int, speeds: "Floats") -> "Bools":
    """Which boxes of walls (M,), phases (M, 2) in parts of 2 pi/n and speeds (M, 2) are well inside the trap, in floats."""
    inverse, (phase, speed) = np.linalg.inv(np.array(trap.matrix)), trap.centre
    turn = 2 * np.pi / n
    whole = np.round(phases.mean(axis=1) / n - phase / (2 * np.pi)) * n
    inside = wall == trap.wall
    for i in (0, 1):
        for j in (0, 1):
            way = np.stack([(phases[:, i] - whole) * turn - phase, speeds[:, j] - speed])
            inside = inside & (np.abs(inverse @ way) <= INSIDE * np.array(trap.half)[:, None]).all(axis=0)
    return inside


def _directions(derivative: "Floats", speed: float) -> "Floats":
    """Directions of phase and speed, columns (2, 2), which the derivative of speed and phase (2, 2) stretches most and least."""
    scale = np.array([1.0, speed])
    values, vectors = np.linalg.eig(derivative[::-1, ::-1] * scale / scale[:, None])
    vectors = vectors[:, np.argsort(-np.abs(values), kind="stable")]
    first = vectors[:, 0]
    vectors = (
        np.stack([first.real, first.imag], axis=1) if first.imag.any() else vectors.real.copy()
    )  # NumPy 2.5 has only complex ones
    if abs(np.linalg.det(vectors / np.linalg.norm(vectors, axis=0))) < PARALLEL:  # nearly a double multiplier
        vectors[:, 1] = [-vectors[1, 0], vectors[0, 0]]
    return np.asarray(vectors / np.abs(vectors).max(axis=0) * scale[:, None])
