"""Orbits after a transient that do not stay on an unstable cycle, on which rounding or their start has put them."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.limits.releases import ROUNDED, words_hold_beside
from nsmaps.dynamics.orbit import Orbit, orbit_after
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.scale import scale_of
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap

ASIDE = 1e-3  #: of the scale: how far from an unstable cycle an orbit starts again
UNSTABLE = 1e-9  #: by how much the largest multiplier of an unstable cycle exceeds one, at least


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """The orbits of S starts of n coordinates after a transient."""

    orbit: Orbit
    scale: Floats  #: shape (S, n), of the motion of each
    unstable: Bools  #: shape (S,), those on an unstable cycle, up to rounding, or one between rests that rounding decides

    @classmethod
    def of(cls, return_map: ReturnMap, orbit: Orbit, sizes: Floats) -> "Settled":
        """Orbits whose last states are known; `sizes` are states (S, n) whose magnitudes are units of maps without extents."""
        each = list(zip(np.swapaxes(orbit.states, 0, 1), sizes, strict=True))
        scale = np.array([scale_of(return_map, states, beside=size) for states, size in each]).reshape(sizes.shape)
        unstable = [_is_unstable(return_map, orbit, s, own) for s, own in enumerate(scale)]
        return cls(orbit, scale, np.array(unstable, bool))

    @property
    def final(self) -> Floats:
        """The last states, shape (S, n)."""
        return self.orbit.final


def settled(return_map: ReturnMap, states: Floats, discard: int, returns: int, sizes: Floats) -> Settled:
    """As `orbit_after`; orbits that repeat up to rounding on an unstable cycle start again from beside it, once.

    They may come back to it, as where rounding of a map by formula leads there.
    """
    found = Settled.of(return_map, orbit_after(return_map, states, discard, returns), sizes)
    if not found.unstable.any():
        return found
    beside = states.copy()
    for s in np.flatnonzero(found.unstable).tolist():
        beside[s] = _beside(return_map, found.final[s], ASIDE * found.scale[s])
    return Settled.of(return_map, orbit_after(return_map, beside, discard, returns), sizes)


def _is_unstable(return_map: ReturnMap, orbit: Orbit, s: int, scale: Floats) -> bool:
    """True if the last state of one orbit repeats an earlier one up to rounding, and the cycle between them is unstable."""
    states, outcome = orbit.states[1:, s], orbit.outcome[:, s]
    same = np.flatnonzero(orbit.coordinates.near(states[:-1], states[-1], ROUNDED, scale))
    last = slice(int(same[-1]) + 1 if len(same) else len(states), None)
    if (outcome[last] == Outcome.stuck).any():
        return not words_hold_beside(return_map, states[last], orbit.codes[last, s], outcome[last], scale)
    returns = return_map.first_return(states[same[-1] : -1], derivative=True) if len(same) else None
    if returns is None or returns.derivative is None or not np.isfinite(returns.derivative).all():
        return False
    return bool(np.abs(PeriodicOrbit(returns, ROUNDED, scale).multipliers[0]) > 1 + UNSTABLE)


def _beside(return_map: ReturnMap, state: Floats, aside: Floats) -> Floats:
    """A state beside another one, on the side on which it has an image."""
    step = aside * np.random.default_rng(0).uniform(0.5, 1, len(state))
    both = Coordinates(return_map.coordinates).wrap(np.array([state + step, state - step]))
    valid = return_map.first_return(both).valid
    return np.asarray(both[0] if valid[0] or not valid[1] else both[1])
