"""The motions of many orbits, each named once, and the attractors among those of one pixel."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Storable
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.attractor import kept
from nsmaps.dynamics.attractors.coexistence import grouped
from nsmaps.dynamics.motion import condensed, label
from nsmaps.exact.words import PLAIN, Alphabet, decode

NEAR = 0.01  #: share of the scale within which two sets of states count as one attractor


@dataclass(frozen=True, slots=True)
class Motion(Storable):
    """What an orbit does in the long run."""

    label: str  #: such as 1:1/2T; see `nsmaps.dynamics.motion.label`
    words: tuple[str, ...]  #: of one period in order, the least of its rotations; without a period, every word seen
    period: int  #: in returns, of which a complete chatter with the release after it is one; 0: none found
    turns: int  #: whole turns of all angles in a period: its length in periods of the forcing; 0 without a period


def motion_of(name: str, words: Sequence[str], period: int, turns: int) -> Motion:
    """The motion of a name, of the words of one period in returns or of every word seen."""
    if not period:
        return Motion(name, tuple(sorted(set(words))), 0, 0)
    events = condensed(words)
    return Motion(name, tuple(min([*events[k:], *events[:k]] for k in range(len(events)))), len(events), turns)


@dataclass(slots=True)
class Motions:
    """The motions of orbits by their number, in the order in which they are met."""

    walls: tuple[str, ...] = ()
    alphabet: Alphabet = PLAIN
    known: dict[Motion, int] = field(default_factory=dict)
    seen: dict[tuple[int, bytes, bytes], int] = field(default_factory=dict)  #: by period, words and turns as they came

    def number(self, motion: Motion) -> int:
        """The number of a motion, a new one if it is not known."""
        return self.known.setdefault(motion, len(self.known))

    def of(self, codes: NDArray[np.int64], turns: NDArray[np.int64], period: int) -> int:
        """The number of the motion of a period whose last returns have these words, as numbers, and turns, shape (K,)."""
        codes, turns = codes[-period:], turns[-period:]
        key = period, codes.tobytes(), turns.tobytes()
        if key not in self.seen:
            words = [decode(code, self.walls) for code in codes.tolist()]
            name, took = label(words, turns.tolist(), period, self.alphabet), int(turns.sum()) or period * self.alphabet.turns
            self.seen[key] = self.number(motion_of(name, words, period, took))
        return self.seen[key]


def attractors(coordinates: Coordinates, states: Floats, period: NDArray[np.int64], scale: Floats) -> NDArray[np.int8]:
    """A number of the attractor of each orbit of one pixel, in the order of the orbits; -1 of one that ended.

    Orbits with periods have one attractor if each of their states is within 0.01 of the largest scale of a state of the
    other; an orbit without a period is a sample of it, compared as in `match_attractors`.

    Args:
        states: shape (S, K, n), the last ones.
        period: of each, in returns; 0 without one.
        scale: shape (S, n), of each.
    """
    numbers = np.full(len(states), -1, np.int8)
    held = np.flatnonzero(np.isfinite(states[:, -1]).all(axis=1))
    if len(held) == 1:
        numbers[held] = 0
    elif len(held):
        unit = scale[held].max(axis=0)
        sets = [kept(coordinates, states[s], int(period[s]), "", NEAR, unit) for s in held.tolist()]
        for number, group in enumerate(grouped(sets)):
            numbers[held[group]] = number
    return numbers
