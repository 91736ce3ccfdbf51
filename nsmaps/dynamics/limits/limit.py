"""What an orbit ends on."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.exponents.growth import product_of
from nsmaps.dynamics.limits.path import Path
from nsmaps.dynamics.motion import ESCAPE, UNRESOLVED, label
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.exact.words import Alphabet, words_of


@dataclass(frozen=True, eq=False)
class Limit:
    """What one orbit ends on."""

    kind: str  #: "" of a cycle and of an orbit that ended, otherwise one of `nsmaps.dynamics.motion.MEANING`
    path: Path  #: the last returns of the orbit
    length: int = 0  #: number of states of a period; 0 without one
    cycle: PeriodicOrbit | None = None  #: by Newton's method, where it was applied
    exponent: float = np.nan  #: largest Lyapunov exponent per return
    error: float = np.nan  #: its standard error
    more: int = 0  #: returns over which the orbit was followed for it
    rests: bool = False  #: True of an orbit that comes back to one release from rest, after a period that floats do not determine
    unstable: bool = False  #: True of an orbit on an unstable cycle, on which its start or rounding has put it

    @cached_property
    def period(self) -> int:
        """In returns; 0 without one."""
        seen = int(self.path.numbers[-self.length :, 0].sum()) if self.length else 0
        return self.cycle.period if self.cycle is not None else seen

    @property
    def is_open(self) -> bool:
        """True if more returns may show what the orbit ends on."""
        return self.kind == UNRESOLVED and not self.rests

    @property
    def held(self) -> bool:
        """True if the orbit stays within bounds and did not end."""
        return bool(self.kind or self.length) and self.kind != ESCAPE

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Of the return from each state of a period; without a period, every word on the way."""
        if self.cycle is not None:
            return self.cycle.words
        words = words_of(self.path.codes[-self.length :, 0], self.path.walls).tolist()
        return tuple(words if self.length else sorted(set(words)))

    @cached_property
    def states(self) -> Floats:
        """Shape (K, n), angles in [0, 2 pi): one period in order, from which the words lead on, or states visited."""
        if self.cycle is not None:
            return self.cycle.states
        states = self.path.states[-self.length - 1 : -1, 0] if self.length else self.path.states[1:, 0]
        return self.path.coordinates.wrap(states)

    @cached_property
    def turns(self) -> int:
        """Whole turns of the phase in a period."""
        last = self.path.turns[len(self.path.turns) - self.length :, 0]
        turns = last if self.cycle is None else self.cycle.turns
        found = int(self.path.coordinates.turns_of_phase(turns).sum())
        return found or self.period * self.path.alphabet.turns

    @cached_property
    def label(self) -> str:
        """The name of the motion; see `nsmaps.dynamics.motion.label`."""
        return _name(self.words, self.turns, self.period, self.path.alphabet, self.kind) if self.held else self.kind

    @cached_property
    def multiplier(self) -> float:
        """The magnitude of the largest multiplier of a cycle; NaN where the derivatives of its returns are not known."""
        slopes = None if self.path.slopes is None else self.path.slopes[-self.length :, 0]
        return largest_multiplier(slopes if self.cycle is None else self.cycle.returns.derivative)

    @property
    def rate(self) -> float:
        """The largest exponent per return, of a cycle that of its multipliers; NaN where it is not known."""
        with np.errstate(divide="ignore"):
            return float(np.log(self.multiplier) / self.period) if self.length else self.exponent


def largest_multiplier(slopes: Floats | None) -> float:
    """The magnitude of the largest multiplier of a cycle, from the derivatives of its returns (K, n, n); NaN without these."""
    if slopes is None or not np.isfinite(slopes).all():
        return np.nan
    return float(np.abs(np.linalg.eigvals(product_of(slopes))).max(initial=0.0))


@lru_cache(maxsize=1024)
def _name(words: tuple[str, ...], turns: int, period: int, alphabet: Alphabet, kind: str) -> str:
    """As `nsmaps.dynamics.motion.label`; most orbits of a plane of parameters have one of few motions."""
    return label(words, [turns], period, alphabet, kind)
