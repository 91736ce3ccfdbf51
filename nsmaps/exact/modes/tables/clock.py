"""The phase of a section at a clock: where a function of the phase alone falls through zero."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.modes.definitions.definition import Definition

LOOKS = 360  #: phases a harmonic at which the function is looked at
STEPS, PARTS = 10, 64  #: of the search for the zero, each into so many parts, which is more than a float needs
ZERO = 4e-16  #: of the sizes of its terms: a function that is zero


def phase_of_fall(definition: Definition, function: Floats, values: Sequence[float]) -> float:
    """The phase at which the clock of a section falls through zero, within a turn; `function` is its row over the features.

    Raises:
        SystemDefinitionError: it does so never in a period, or more than once.
    """
    waves = function[len(definition.states) + len(definition.derived) :]
    value, slope = (float(each) for each in at_phase(waves, 0.0))
    if abs(value) <= ZERO * abs(waves).sum() and slope < 0:
        value = 0.0
    grid = np.linspace(0, TWO_PI, LOOKS * max(1, len(waves) // 2) + 1)
    between, _ = at_phase(waves, grid[1:-1])
    heights = np.concatenate([[value], between, [value]])
    falls = np.flatnonzero((heights[:-1] > 0) & (heights[1:] <= 0))
    if len(falls) != 1:
        shown = ", ".join(f"{x:.6g}" for x in values)
        raise SystemDefinitionError(
            f"the section's clock {definition.transitions[definition.clock].name!r} falls through zero {len(falls)} times a "
            f"period, at the parameters ({shown}); expected: once, or a name for the phase in the section's `coordinates`"
        )
    (fall,) = falls
    low, high = grid[fall : fall + 2]
    for _ in range(STEPS):
        inner = np.linspace(low, high, PARTS + 1)
        heights, _ = at_phase(waves, inner[1:-1])
        first = int(np.argmax(np.append(heights <= 0, True)))
        low, high = inner[first : first + 2]
    height, slope = (float(each) for each in at_phase(waves, high))
    return 0.0 if value == 0.0 and fall == len(grid) - 2 else float((high - height / slope) % TWO_PI)


def at_phase(waves: Floats, phi: ArrayLike) -> tuple[Floats, Floats]:
    """A function of phases, by its coefficients of 1 and of the waves, and its derivative."""
    m = np.arange(1, len(waves) // 2 + 1)
    cosines, sines = np.cos(np.multiply.outer(phi, m)), np.sin(np.multiply.outer(phi, m))
    mean, of_cosines, of_sines = waves[:1], waves[1::2], waves[2::2]
    return mean.sum() + cosines @ of_cosines + sines @ of_sines, cosines @ (m * of_sines) - sines @ (m * of_cosines)
