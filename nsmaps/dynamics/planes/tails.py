"""The ends of long orbits: the last returns after many, of which exact repetitions are not computed again."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.dynamics.exponents.growth import tangent_growth
from nsmaps.dynamics.limits.decision import limits_on
from nsmaps.dynamics.limits.limit import Limit
from nsmaps.dynamics.limits.settled import Transient
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap


@dataclass(frozen=True, slots=True)
class Length:
    """The number of returns of each orbit, and of the last ones that are looked at."""

    discard: int  #: as the transient
    returns: int  #: after it, at least `window`
    window: int  #: the last ones, in which a period is sought


@dataclass(slots=True, eq=False)
class Tail:
    """The last K returns of the orbits of S starts of n coordinates."""

    states: Floats  #: shape (S, K, n); NaN after an orbit's end
    outcome: NDArray[np.int8]  #: shape (S,), values of `Outcome`, of the last return or of that which ended the orbit
    scale: Floats  #: shape (S, n), unit of each coordinate on the motion, see `scale_of`; 1 of orbits that end
    growth: Floats  #: shape (S,), mean logarithmic growth of a tangent vector a return; NaN of orbits that repeat or end
    limits: list[Limit | None]  #: what each orbit ends on; None without a map
    computed: int = 0  #: returns of all starts; the others repeat

    @classmethod
    def empty(cls, count: int, k: int, dim: int) -> "Tail":
        """Room for the last k returns of some orbits, with the outcome `invalid`."""
        outcome = np.full(count, Outcome.invalid, np.int8)
        return cls(np.full((count, k, dim), np.nan), outcome, np.ones((count, dim)), np.full(count, np.nan), [None] * count)

    @property
    def final(self) -> Floats:
        """The last states, shape (S, n)."""
        return self.states[:, -1]


def tail(return_map: ReturnMap, starts: Floats, length: Length, tolerance: float = 1e-6) -> Tail:
    """The ends of the orbits of starts (S, n) after `discard + returns` returns, and what they end on, as by `limits`.

    An orbit that comes back to a state to the last bit is not computed any further: all numbers are those of the whole
    computation, digit for digit.
    """
    (count, dim), k = starts.shape, length.window
    transient = Transient.of(return_map, starts, length.discard, length.returns, k)
    found = Tail.empty(count, k, dim)
    found.computed = transient.computed
    for own, n in ((transient.repeats, k), (~transient.repeats, length.returns)):
        which = np.flatnonzero(own)
        if not len(which):
            continue
        path = transient.path(return_map, which, n, starts[which], derivative=True)
        found.states[which], found.outcome[which] = np.swapaxes(path.coordinates.wrap(path.states[-k:]), 0, 1), path.outcome[-1]
        found.scale[which], found.computed = path.scales(return_map), found.computed + n * len(which)
        if not transient.repeats[which[0]] and path.slopes is not None:
            found.growth[which] = _growth(path.slopes)
        for orbit, one in zip(which.tolist(), limits_on(return_map, path, found.scale[which], tolerance), strict=True):
            found.limits[orbit] = one
    gone = [orbit for orbit, one in enumerate(found.limits) if one is not None and not one.held]
    found.states[gone, -1] = found.growth[gone] = np.nan
    return found


def _growth(slopes: Floats) -> Floats:
    """The mean logarithm of the growth of a tangent vector by derivatives (n, M, dim, dim), shape (M,), once it has turned."""
    each = np.ascontiguousarray(tangent_growth(slopes).T)  # so that no sum depends on the number of orbits
    return np.asarray(each.mean(axis=1))
