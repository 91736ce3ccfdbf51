"""Cycles between releases from rest, after which everything repeats: their periods, and whether floats determine them."""

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.limits.path import Path
from nsmaps.dynamics.orbit import orbit
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap

ROUNDED = 1e-12  #: of the scale: states that repeat as exactly are on their cycle
BESIDE, ROUNDING = 16, 1e-14  #: states beside another one, and their distance, of the scale: some ten times what rounding moves


def comes_to_rest(path: Path) -> bool:
    """True if the orbit of one path rests on the way."""
    return bool((path.outcome == Outcome.stuck).any())


def until_release(path: Path) -> Path:
    """A path up to its last release from rest; all of it without one."""
    released = np.flatnonzero(path.outcome[:, 0] == Outcome.stuck)
    return path.first(int(released[-1]) + 1) if len(released) else path


def between_releases(path: Path, near: Floats) -> int:
    """The number of returns between the last two releases at one phase of a path that ends with one; 0 without such two."""
    released = np.flatnonzero(path.outcome[:, 0] == Outcome.stuck)
    states = path.states[1:, 0][released]
    same = np.flatnonzero(path.coordinates.near(states[:-1], states[-1:], near)) if len(released) > 1 else released[:0]
    return int(released[-1] - released[same[-1]]) if len(same) else 0


def is_determined(return_map: ReturnMap, path: Path, period: int, scale: Floats) -> bool:
    """True unless rounding decides when the last period of one path comes back to a release, as of `words_hold_beside`."""
    last = path.last(period)
    return words_hold_beside(return_map, last.states[1:, 0], last.codes[:, 0], last.outcome[:, 0], scale)


def words_hold_beside(
    return_map: ReturnMap, states: Floats, codes: Ints, outcome: NDArray[np.signedinteger], scale: Floats
) -> bool:
    """True unless rounding decides when a cycle comes back to a release from rest.

    A rest makes all multipliers of such a cycle zero. But where orbits are chaotic between rare rests, differences grow from one
    release to the next beyond all bounds: orbits that begin up to rounding beside the first state after a release then have other
    words than the cycle, and no cycle of floats is one of the map. True of a cycle without rest.

    Args:
        states: shape (K, n), the images of the returns of a period, whose words are `codes`, shape (K,); `outcome` likewise.
    """
    for release in np.flatnonzero(outcome == Outcome.stuck).tolist() if len(states) > 1 else ():
        beside = orbit(return_map, _beside(return_map, states[(release + 1) % len(states)], scale), len(states) - 1)
        begun = np.isfinite(beside.states[1]).all(axis=1)
        same = beside.codes[:, begun] == np.roll(codes, -release - 2)[:-1, None]
        same &= beside.outcome[:, begun] == np.roll(outcome, -release - 2)[:-1, None]
        if not same.all():
            return False
    return True


def beside_release(return_map: ReturnMap, path: Path, scale: Floats) -> Floats:
    """States up to rounding beside the first one after the last release but one of a path, shape (16, n)."""
    return _beside(return_map, path.states[np.flatnonzero(path.outcome[:, 0] == Outcome.stuck)[-2] + 2, 0], scale)


def _beside(return_map: ReturnMap, state: Floats, scale: Floats) -> Floats:
    """States up to rounding beside another one, shape (16, n)."""
    steps = np.random.default_rng(0).uniform(-ROUNDING, ROUNDING, (BESIDE, len(state)))
    return Coordinates(return_map.coordinates).wrap(state + steps * scale)
