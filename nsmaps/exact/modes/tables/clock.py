"""The phase of a section at a clock: where a function of the phase alone falls through zero."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.modes.definitions.definition import Definition

LOOKS = 360  #: phases a harmonic at which the function is looked at
STEPS = 60  #: of bisection and of Newton's method, more than a float needs
ZERO = 4e-16  #: of the sizes of its terms: a function that is zero


def phase_of_fall(definition: Definition, function: Floats, values: Sequence[float]) -> float:
    """The phase at which the clock of a section falls through zero, within a turn; `function` is its row over the features.

    Raises:
        SystemDefinitionError: it does so never in a period, or more than once.
    """
    waves = function[len(definition.states) + len(definition.derived) :]
    value, slope = at_phase(waves, 0.0)
    if abs(value) <= ZERO * abs(waves).sum() and slope < 0:
        value = 0.0
    grid = np.linspace(0, TWO_PI, LOOKS * max(1, len(waves) // 2) + 1)
    heights = np.array([at_phase(waves, phi)[0] for phi in grid])
    heights[0] = heights[-1] = value
    falls = np.flatnonzero((heights[:-1] > 0) & (heights[1:] <= 0))
    if len(falls) != 1:
        shown = ", ".join(f"{x:.6g}" for x in values)
        raise SystemDefinitionError(
            f"the section's clock {definition.transitions[definition.clock].name!r} falls through zero {len(falls)} times a "
            f"period, at the parameters ({shown}); expected: once, or a name for the phase in the section's `coordinates`"
        )
    low, high = grid[falls[0]], grid[falls[0] + 1]
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if at_phase(waves, middle)[0] > 0 else (low, middle)
    phase = high - at_phase(waves, high)[0] / at_phase(waves, high)[1]
    return 0.0 if value == 0.0 and high > grid[-2] else float(phase % TWO_PI)


def later_fall(function: Floats, change: Floats, states: int, phase: float) -> float:
    """How fast that phase moves where the function, a row over the features, changes at a rate given as a row."""
    return -at_phase(change[states:], phase)[0] / at_phase(function[states:], phase)[1]


def at_phase(waves: Floats, phi: float) -> tuple[float, float]:
    """A function of the phase, by its coefficients of 1 and of the waves, and its derivative."""
    m = np.arange(1, len(waves) // 2 + 1)
    cosines, sines = np.cos(m * phi), np.sin(m * phi)
    return float(waves[0] + waves[1::2] @ cosines + waves[2::2] @ sines), float(
        (m * sines) @ -waves[1::2] + (m * cosines) @ waves[2::2]
    )
