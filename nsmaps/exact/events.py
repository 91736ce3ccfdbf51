"""The motion of a system with modes at and between its events, sampled."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, brief
from nsmaps.errors import StateError


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
class ModeTrack:
    """The motion of a system with n states through M events, `samples` instants in each of the M - 1 flights between them."""

    __repr__ = brief

    names: tuple[str, ...]  #: of the states
    events: Events
    modes: NDArray[np.str_]  #: shape (M - 1,), of each flight, sliding and contact among them
    time: Floats  #: shape (M - 1, samples), since the start
    states: Floats  #: shape (M - 1, samples, n)


def check_samples(n: int, samples: int) -> None:
    """Refuse fewer than two impacts or events, or two samples of a flight, by a StateError."""
    if n < 2 or samples < 2:
        raise StateError(f"{n} impacts or events of {samples} samples a flight; expected: two or more of each")
