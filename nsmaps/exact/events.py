"""The motion of a system at and between impacts or events, sampled, and first arrivals at a section."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, brief, finite_rows
from nsmaps.coordinates import Coordinates
from nsmaps.errors import StateError
from nsmaps.exact.returns import Impacts
from nsmaps.exact.words import words_of


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Events:
    """M events of one motion of a system with modes, in their order."""

    __repr__ = brief

    name: NDArray[np.str_]  #: shape (M,), of the guard, or "slip to stick" at a surface of sliding
    letter: NDArray[np.str_]  #: shape (M,), in words
    time: Floats  #: shape (M,), since the start, in the system's time
    phase: Floats  #: shape (M,), radians in [0, 2 pi); zero without forcing
    before: Floats  #: shape (M, n), states just before; at a start just after the section's reset, those after it
    after: Floats  #: shape (M, n), states just after


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Track:
    """The motion through M impacts, `samples` instants in each of the M - 1 flights between them, with W walls.

    A rest or chatter on a wall counts as a flight along it. Displacement is relative to the walls; places are those of
    `ImpactSystem.absolute`, relative to an observer at rest.
    """

    __repr__ = brief

    impacts: Impacts
    sides: NDArray[np.int8]  #: shape (W,), +1 for a wall that growing displacement meets, else -1
    at: Floats  #: shape (W,), displacement of each wall
    time: Floats  #: shape (M - 1, samples), since the start, in the system's time
    displacement: Floats  #: shape (M - 1, samples)
    velocity: Floats  #: shape (M - 1, samples), rate of the displacement
    ball: Floats  #: shape (M - 1, samples), place of the ball
    walls: Floats  #: shape (W, M - 1, samples), places of the walls

    @property
    def rates(self) -> Floats:
        """Velocity just before each impact, shape (M,): the impact speed with the sign of its wall's side."""
        return np.asarray(self.sides[self.impacts.wall] * self.impacts.speed, float)

    @property
    def moving(self) -> bool:
        """True if the system defines the motion of its walls."""
        return bool((np.ptp(self.walls.reshape(len(self.at), -1), axis=1) > 0).any())


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ModeTrack:
    """The motion of a system with n states through M events, `samples` instants in each of the M - 1 flights between them."""

    __repr__ = brief

    names: tuple[str, ...]  #: of the states
    events: Events
    modes: NDArray[np.str_]  #: shape (M - 1,), of each flight, sliding and contact among them
    time: Floats  #: shape (M - 1, samples), since the start
    states: Floats  #: shape (M - 1, samples, n)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Arrivals:
    """First arrivals of N states of a system with modes at its section, of m coordinates."""

    __repr__ = brief

    coordinates: Coordinates  #: of the section
    names: Coordinates  #: of the start: the states, and the phase where there is forcing
    letters: tuple[str, ...]
    start: Floats  #: shape (N, k), as given
    mode: NDArray[np.str_]  #: shape (N,), in which the motion starts, "" where the state belongs to none
    image: Floats  #: shape (N, m), at the section, angles in [0, 2 pi); NaN where there is none
    turns: NDArray[np.int32]  #: shape (N, m), whole turns of an angle until then
    codes: NDArray[np.int64]  #: shape (N,), words as numbers; see `words`
    outcome: NDArray[np.int8]  #: shape (N,), values of `Outcome`
    time: Floats  #: shape (N,), until the arrival, or as of `Returns`, in the system's time; NaN where unknown
    derivative: Floats | None = None  #: shape (N, m, k), d image / d start, if requested

    def __len__(self) -> int:
        return len(self.start)

    @property
    def words(self) -> NDArray[np.str_]:
        """The events of each motion, that at the section the last, shape (N,)."""
        return words_of(self.codes, self.letters)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """The arrivals that have an image, shape (N,)."""
        return finite_rows(self.image)


def check_samples(n: int, samples: int) -> None:
    """Refuse fewer than two impacts or events, or two samples of a flight, by a StateError."""
    if n < 2 or samples < 2:
        raise StateError(f"{n} impacts or events of {samples} samples a flight; expected: two or more of each")
