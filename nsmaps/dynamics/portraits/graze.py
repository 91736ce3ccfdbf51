"""The map beside a graze, as it is along a line of states that crosses one, and the motions just before, at and after it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.bisection import bisect_change
from nsmaps.coordinates import Coordinates, StateLike, WithCoordinates, as_starts
from nsmaps.dynamics.continuation.events import BifurcationPoint
from nsmaps.dynamics.portraits.portrait import motion_over
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exact.events import ModeTrack, Track
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.parameters import System
from nsmaps.results import NONE, Result, array, units_of

LEAST = 1e-8  #: share of the reach, from which on the coefficient is fitted
FITTED = 60  #: states to which it is fitted
NEAREST = 20  #: times smaller than that of the reach is the largest square root of a distance to which it is fitted
SIZES = (1e-4, 1e-3, 1e-2)  #: shares of the scales, within which words change beside an orbit that grazes
DEGREE = 5  #: of the polynomial in the square root of the distance
ROOT = 8.0  #: between the ratios of the change of an image from 1 to 1/16 of a distance to that from 1/16 to 1/256: a square root
#: has 4, a smooth map 16


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Graze(WithCoordinates, Result):
    """A map of n coordinates at K states along a line through a graze, on whose one side it grows with the square root."""

    picture: ClassVar[str] = "nsmaps.figures.system.graze"

    coordinates: Coordinates
    state: Floats = field(metadata=array("coordinate", "at the graze, to rounding"))
    direction: Floats = field(metadata=array("coordinate", "of the line, towards the side of the square root, of length 1", NONE))
    words: tuple[str, str]  #: of the returns: on the smooth side, and on that of the square root
    distance: Floats = field(metadata=array("sample", "from the graze along the line, negative on the smooth side", NONE))
    image: Floats = field(metadata=array("sample coordinate", "of the states; angles continued, not wrapped"))
    value: Floats = field(metadata=array("coordinate", "image at the graze"))
    coefficient: Floats = field(metadata=array("coordinate", "of the square root of the distance, fitted to computed states"))
    error: Floats = field(metadata=array("coordinate", "estimated: the change of the coefficient with one degree less"))
    tracks: tuple[Track | ModeTrack, ...] = ()  #: motions at the first, the smallest and the last distance; none of plain maps
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates, by name

    def summary(self) -> str:
        """The words on both sides, the state, and the coefficients."""
        roots = ", ".join(f"{a:.6g} +- {e:.1g}" for a, e in zip(self.coefficient, self.error, strict=True))
        return f"between {' and '.join(self.words)} at {self.state.tolist()}, coefficients of the square root {roots}"


@checked
def graze(system: ReturnMap, one: StateLike, other: StateLike, *, n_samples: int = 400) -> Graze:
    """The graze between two states of different words: the map along the line through them, and its square root.

    The graze is found by bisection of the word. The coefficient is that of s in a polynomial in s, the square root of the
    distance, fitted to states from 1e-8 of the smaller distance on; it is estimated, and `error` is the change with one degree
    less.

    Args:
        system: exact, or of pieces given by formulas.
        one: a state, shape (n,) or by name.
        other: another one, whose return has another word.
        n_samples: states along the line, up to the nearer of both on either side.

    Raises:
        NsmapsError: both states have one word, or the map has no square root beside the change of words.
    """
    ends = np.concatenate([as_starts(each, system.coordinates).reshape(1, -1) for each in (one, other)])
    words = system.first_return(ends).words
    if words[0] == words[1]:
        raise NsmapsError(f"the returns of both states have the word {words[0]}; expected: states on both sides of a graze")
    low, high, beyond = bisect_change(lambda rows: system.first_return(rows).words, ends[:1], ends[1:], words[:1], words[1:])
    sides = (low[0], ends[0], str(words[0])), (high[0], ends[1], str(beyond[0]))
    rooted = [_roughness(system, place, end) for place, end, _ in sides]
    if max(rooted) == 0:
        raise NsmapsError(f"the map has no square root beside the change of words at {low[0].tolist()}; expected: a graze there")
    (smooth, away, before), (place, end, after) = sides if rooted[1] >= rooted[0] else sides[::-1]
    direction = (end - place) / np.linalg.norm(end - place)
    reach = min(np.linalg.norm(end - place), np.linalg.norm(away - smooth))
    near, far = system.first_return(smooth - LEAST * reach * np.array([[1], [2]]) * direction).lifted
    value = 2 * near - far
    return _beside(system, place, direction, float(reach), value, (before, after), n_samples)


def graze_of(system: System, event: BifurcationPoint) -> Graze:
    """The graze of a periodic orbit at an event of a branch: along the coordinate and beside the state where words change.

    Raises:
        NsmapsError: no word changes beside the orbit, up to a hundredth of the scales of the coordinates.
    """
    at, orbit = system.at(**{event.parameter: event.value}), event.orbit
    sides = orbit.scale * np.concatenate([np.eye(len(orbit.scale)), -np.eye(len(orbit.scale))])
    for size in SIZES:
        for state in orbit.states:
            there = [[state - size * side, state + size * side] for side in sides]
            words = at.first_return(np.concatenate(there)).words.reshape(-1, 2)
            for ends in (there[k] for k in np.flatnonzero(words[:, 0] != words[:, 1])):
                try:
                    return graze(at, *ends)
                except NsmapsError:
                    continue
    raise NsmapsError(f"no word changes beside the orbit at {event}; expected: an orbit that grazes")


def _roughness(return_map: ReturnMap, place: Floats, end: Floats) -> float:
    """How much an image changes on one side over the smallest distances, 0 if as a smooth map does."""
    steps = LEAST * np.array([1, 1 / 16, 1 / 256])[:, None]
    far, near, nearest = return_map.first_return(place + steps * (end - place)).lifted
    change, less = np.abs(far - near), np.abs(near - nearest)
    return float(np.where(change < ROOT * less, change, 0.0).max())


def _beside(
    return_map: ReturnMap, place: Floats, direction: Floats, reach: float, value: Floats, words: tuple[str, str], samples: int
) -> Graze:
    """The map along a line on both sides of a graze, and the coefficient of its square root."""
    roots = np.geomspace(np.sqrt(LEAST * reach), np.sqrt(reach) / NEAREST, FITTED)
    fitted = return_map.first_return(place + roots[:, None] ** 2 * direction).lifted
    slopes = (fitted - value) / roots[:, None]
    best, less = (np.linalg.lstsq(np.vander(roots, n, increasing=True), slopes)[0][0] for n in (DEGREE, DEGREE - 1))
    half = np.linspace(0, 1, samples // 2 + 1)[1:] ** 2 * reach
    distance = np.concatenate([-half[::-1], half])
    states = place + distance[:, None] * direction
    shown = [states[0], place, states[-1]]
    tracks = [track for track in (motion_over(return_map, state, 1) for state in shown) if track is not None]
    line = Coordinates(return_map.coordinates), place, direction, words, distance, return_map.first_return(states).lifted
    return Graze(*line, value, best, np.abs(best - less), tuple(tracks), units_of(return_map))
