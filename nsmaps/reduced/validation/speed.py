"""The speed of a reduced map in comparison with the exact map: both timed alternately, by processor time."""

from dataclasses import dataclass
from time import process_time_ns
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.results import Result

if TYPE_CHECKING:
    from nsmaps.exact.returnmap import ReturnMap

STATES, ROUNDS = 20_000, 7  #: states of a batch
CLEARLY = 0.8  #: share of the exact map's time below which a map is clearly faster


@dataclass(frozen=True, slots=True, repr=False)
class Speed(Result):
    """Nanoseconds of processor time per state, the best of some rounds, in batches of 20,000."""

    picture: ClassVar[str] = "nsmaps.figures.composite.speed_error"

    exact: float
    composite: float

    def summary(self) -> str:
        """The numbers that matter."""
        return self.text

    @property
    def faster(self) -> bool:
        """True if the composite map is clearly faster than the exact one."""
        return self.composite < CLEARLY * self.exact

    @property
    def text(self) -> str:
        """The comparison as a sentence."""
        times = f"{self.composite:.0f} ns per state, the exact map {self.exact:.0f} ns"
        return times if self.faster else f"{times}: pointless for speed"


def speeds(exact: "ReturnMap", composite: "ReturnMap", box: Floats) -> Speed:
    """The speeds of two maps at random states of a box, shape (n, 2)."""
    low, high = box.T
    states = low + (high - low) * np.random.default_rng(5).random((STATES, len(low)))
    best = [np.inf, np.inf]
    for _ in range(ROUNDS):
        for k, return_map in enumerate((exact, composite)):
            begun = process_time_ns()
            return_map.first_return(states)
            best[k] = min(best[k], (process_time_ns() - begun) / STATES)
    return Speed(*best)
