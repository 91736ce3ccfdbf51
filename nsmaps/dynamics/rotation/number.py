"""Rotation numbers: mean turns of an angle a return, or the share of a letter in the words of a map in two pieces."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI, Coordinates, StateLike, as_starts
from nsmaps.dynamics.limits.cycles import SHORT
from nsmaps.dynamics.limits.decision import limits
from nsmaps.dynamics.limits.releases import ROUNDED
from nsmaps.dynamics.orbit import Orbit, orbit
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.dynamics.scale import scale_of
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exact.returnmap import ReturnMap, letters_of
from nsmaps.results import Result


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RotationNumber(Result):
    """The rotation number of an orbit."""

    value: float
    error: float  #: rounding of a fraction; an estimate otherwise, from two halves of the orbit
    counted: str  #: the angle whose turns are counted, or the letter
    fraction: Fraction | None = None  #: p/q of an orbit that ends on a cycle of q returns, exact
    cycle: PeriodicOrbit | None = None  #: this cycle

    def summary(self) -> str:
        """The number, and where it is a fraction the cycle that has it."""
        if self.cycle is None:
            return f"{self.counted}: {self.value:.12g} +- {self.error:.1g}"
        return f"{self.counted}: {self.fraction}, of {self.cycle}"


@checked
def rotation_number(
    system: ReturnMap, start: StateLike, *, n_returns: int = 10_000, transient: int = 1000, counted: str | None = None
) -> RotationNumber:
    """The rotation number of the orbit of a start: exact where it ends on a cycle, estimated otherwise.

    The mean over an orbit without a period is weighted with exp(-1/(t (1 - t))), t from 0 to 1, which converges faster than any
    power on smooth quasi-periodic orbits: S. Das, Y. Saiki, E. Sander, J. A. Yorke, Nonlinearity 30 (2017) 4111.

    Args:
        system: with an angle, whose turns are counted from each state to its image, or whose words have two letters.
        start: one state, shape (n,) or by name.
        n_returns: number over which the mean is taken.
        transient: number before these.
        counted: the name of an angle, or a letter whose share is counted; if omitted the only angle, or the last of two letters.

    Raises:
        NsmapsError: no such angle or letter, several to choose from, or an orbit that ends or escapes.
    """
    coordinates = Coordinates(ReturnMap.require(system, "a rotation number").coordinates)
    state = as_starts(start, coordinates)[None]
    settled = orbit(system, state, transient).final
    name = _named(system, coordinates, counted)
    scale = scale_of(system, settled, beside=state)
    found = limits(system, settled, scale, 1e-6, state)[0] if np.isfinite(settled).all() else None
    if found is None or not found.held:
        raise NsmapsError(f"the orbit of {state[0].tolist()} ends or escapes; expected: a start whose orbit stays")
    length = found.path.last(SHORT).repeats(ROUNDED * scale) if found.unstable else found.length
    if length:
        seen = found.path.states[-length - 1 : -1, 0]
        cycle = found.cycle if found.cycle is not None else periodic_orbit(system, seen, length)
        fraction = Fraction(steps(cycle.turns, list(cycle.words), coordinates, name), cycle.period)
        return RotationNumber(float(fraction), float(np.spacing(float(fraction))), name, fraction, cycle)
    path = orbit(system, settled[0], n_returns)
    each = _each(path, coordinates, name)
    halves, value = [_mean(half) for half in np.array_split(each, 2)], _mean(each)
    return RotationNumber(value, max(abs(half - value) for half in halves) + float(np.spacing(value)), name)


def only_counted(return_map: ReturnMap, coordinates: Coordinates) -> str:
    """The only angle, or without angles the last of two letters; "" where there are others."""
    angles = [name for name, angle in zip(coordinates.names, coordinates.angles, strict=True) if angle]
    letters = letters_of(return_map)
    found = angles or (letters[-1:] if len(letters) == 2 else ())
    return found[0] if len(found) == 1 else ""


def _named(return_map: ReturnMap, coordinates: Coordinates, given: str | None) -> str:
    """The angle or the letter that is counted."""
    known = [name for name, angle in zip(coordinates.names, coordinates.angles, strict=True) if angle] + [*letters_of(return_map)]
    found = only_counted(return_map, coordinates) if given is None else given
    if found not in known:
        which = f"of {given!r}" if given is not None else "which is not that of one angle or of two letters"
        raise NsmapsError(f"a rotation number, {which}; expected: `counted`, one of {', '.join(known) or 'an angle or a letter'}")
    return found


def steps(turns: Ints, words: Sequence[str], coordinates: Coordinates, name: str) -> int:
    """Whole turns of an angle, or the number of a letter, in a period, from the turns (q, n) and words of its returns."""
    if name in coordinates.names:
        return int(turns[:, coordinates.names.index(name)].sum())
    return sum(word.count(name) for word in words)


def _each(path: Orbit, coordinates: Coordinates, name: str) -> Floats:
    """The turns of an angle, or the number of a letter, on each return of an orbit, shape (n,)."""
    if name in coordinates.names:
        k = coordinates.names.index(name)
        lifted = path.states[1:, k] + TWO_PI * path.turns[:, k] - path.states[:-1, k]
        return np.asarray(lifted / TWO_PI)
    return np.char.count(path.words.astype(str), name).astype(float)


def _mean(steps: Floats) -> float:
    """The mean, with weights that vanish at both ends."""
    t = (np.arange(len(steps)) + 0.5) / len(steps)
    weights = np.exp(-1 / (t * (1 - t)))
    return float(weights @ steps / weights.sum())
