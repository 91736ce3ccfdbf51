"""The motions of many orbits, each named once, and the attractors among those of one pixel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Storable
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.attractor import kept
from nsmaps.dynamics.attractors.coexistence import grouped
from nsmaps.dynamics.limits.limit import Limit
from nsmaps.dynamics.motion import condensed, rotations

NEAR = 0.01  #: share of the scale within which two sets of states count as one attractor


@dataclass(frozen=True, slots=True)
class Motion(Storable):
    """What an orbit does in the long run."""

    label: str  #: such as 1:1/2T; see `nsmaps.dynamics.motion.label`
    words: tuple[str, ...]  #: of one period in order, the least of its rotations; without a period, every word seen
    period: int  #: in returns, of which a complete chatter with the release after it is one; 0: none found
    turns: int  #: whole turns of all angles in a period: its length in periods of the forcing; 0 without a period


def motion_of(one: Limit) -> Motion:
    """The motion on which an orbit ends."""
    if not one.period:
        return Motion(one.label, one.words, 0, 0)
    events = condensed(one.words)
    return Motion(one.label, min(rotations(events)), len(events), one.turns)


def attractors(
    coordinates: Coordinates, states: Floats, period: NDArray[np.int64], scale: Floats, labels: NDArray[np.str_]
) -> NDArray[np.int8]:
    """A number of the attractor of each orbit of one pixel, in the order of the orbits; -1 of one that ended.

    Orbits with periods have one attractor if each of their states is within 0.01 of the largest scale of a state of the
    other; an orbit without a period is a sample of it, compared as in `match_attractors`.

    Args:
        states: shape (S, K, n), the last ones.
        period: of each, in returns; 0 without one.
        scale: shape (S, n), of each.
        labels: of its motion.
    """
    numbers = np.full(len(states), -1, np.int8)
    held = np.flatnonzero(np.isfinite(states[:, -1]).all(axis=1))
    if len(held) == 1:
        numbers[held] = 0
    elif len(held):
        unit = scale[held].max(axis=0)
        sets = [kept(coordinates, states[s], int(period[s]), str(labels[s]), NEAR, unit) for s in held.tolist()]
        for number, group in enumerate(grouped(sets)):
            numbers[held[group]] = number
    return numbers
