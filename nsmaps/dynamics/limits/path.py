"""Many successive returns with their derivatives, the growth of tangent vectors on them, and whether they leave every bound."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.exponents.growth import batch_error, tangent_growth
from nsmaps.dynamics.motion import repetition
from nsmaps.dynamics.orbit import Orbit, returns_of
from nsmaps.dynamics.scale import scale_of
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import Alphabet

BATCHES = 32  #: of successive returns, from whose means the error of an exponent follows
UNIT = 1e-7  #: of the scale: differences from which slopes follow where the map has no derivative
LARGE, VAST, GROWS = 1e3, 1e15, 1.01  #: of the scale: size of escaping orbits, of what cannot come back, and growth by parts
LOOKED = 60  #: last states of an orbit, whose magnitudes are units of maps that have no extents
GROWN = 10.0  #: by which an orbit that leaves for infinity is larger in the second half of its last states


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """N successive returns of M states of n coordinates, with the derivatives of the returns."""

    coordinates: Coordinates
    walls: tuple[str, ...]
    alphabet: Alphabet
    states: Floats  #: shape (N + 1, M, n), the starts first
    codes: Ints  #: shape (N, M)
    turns: NDArray[np.int32]  #: shape (N, M, n), whole turns of the angles
    time: Floats  #: shape (N, M)
    outcome: Ints  #: shape (N, M)
    numbers: Ints  #: shape (N, M), successive returns of each, of which a composite map may have several
    begun: Floats  #: shape (M, n), where the orbits began, before a transient
    slopes: Floats | None = None  #: shape (N, M, n, n), where known

    @classmethod
    def of(cls, returns: Returns, begun: Floats) -> "Path":
        """The path of states that began at some starts (M, n), from their returns in the order of `ReturnMap.orbits`."""
        count, dim = begun.shape
        states = np.concatenate([returns.start[:count], returns.image]).reshape(-1, count, dim)
        rows: dict[str, Any] = {"codes": returns.codes, "numbers": returns.numbers, "time": returns.time}
        each: Any = {name: row.reshape(-1, count) for name, row in (rows | {"outcome": returns.outcome}).items()}
        turns = returns.known_turns.reshape(-1, count, dim)
        slopes = None if returns.derivative is None else returns.derivative.reshape(-1, count, dim, dim)
        about = returns.coordinates, returns.walls, returns.alphabet
        return cls(*about, states, turns=turns, **each, begun=begun, slopes=slopes)

    @classmethod
    def of_orbit(cls, orbit: Orbit, begun: Floats) -> "Path":
        """The path of the orbits of one start or of many, shape (M, n), that began at others before a transient."""
        names = "states", "codes", "turns", "time", "outcome", "numbers"
        rows: Any = {name: getattr(orbit, name) for name in names}
        if orbit.states.ndim == 2:
            rows = {name: row[:, None] for name, row in rows.items()}
        return cls(orbit.coordinates, orbit.walls, orbit.alphabet, **rows, begun=begun)

    def of_one(self, k: int) -> "Path":
        """The path of one of the states."""
        if len(self.begun) == 1:
            return self
        names = "states", "codes", "turns", "time", "outcome", "numbers"
        rows = {name: getattr(self, name)[:, k : k + 1] for name in names} | {"begun": self.begun[k : k + 1]}
        return replace(self, **rows, slopes=None if self.slopes is None else self.slopes[:, k : k + 1])

    def first(self, count: int) -> "Path":
        """The first returns."""
        return self._cut(slice(None, count), slice(None, count + 1))

    def last(self, count: int) -> "Path":
        """The last returns."""
        return self._cut(slice(-count, None), slice(-count - 1, None))

    def _cut(self, returns: slice, states: slice) -> "Path":
        rows = {name: getattr(self, name)[returns] for name in ("codes", "turns", "time", "outcome", "numbers")}
        return replace(self, states=self.states[states], **rows, slopes=None if self.slopes is None else self.slopes[returns])

    def scales(self, return_map: ReturnMap) -> Floats:
        """The unit of each coordinate on the motion of each, shape (M, n); see `nsmaps.dynamics.scale.scale_of`."""
        last = np.swapaxes(self.states[-2:], 0, 1)
        beside = np.swapaxes(np.vstack([self.states[-LOOKED:], self.begun[None]]), 0, 1)
        found = [scale_of(return_map, own, beside=others) for own, others in zip(last, beside, strict=True)]
        return np.reshape(found, self.begun.shape)

    def repeats(self, near: Floats) -> int:
        """The number of states after which the orbit of one path repeats within a tolerance (n,), see `repetition`."""
        return repetition(self.states[1:, 0], self.codes[:, 0], self.coordinates, near, self.time[:, 0])


def followed(return_map: ReturnMap, states: Floats, count: int, begun: Floats) -> Path:
    """The path of states (M, n), M above zero, over some returns, with derivatives, of orbits that began at others."""
    return Path.of(Returns.concatenate(list(returns_of(return_map, states, count, derivative=True))), begun)


def escapes(path: Path, scale: Floats) -> bool:
    """True if the orbit of one path leaves every bound: a coordinate that is not an angle is vast, or large and grows on."""
    line = ~path.coordinates.angles
    if not (np.abs(path.states[-len(path.states) // 8 :, 0, line]) > LARGE * scale[line]).any():
        return False
    sizes = np.array(
        [(np.abs(part[:, line]) / scale[line]).max() for part in np.array_split(path.states[:, 0], min(8, len(path.states)))]
    )
    return bool(sizes[-1] > VAST or (sizes[-1] > LARGE and (sizes[-4:] > GROWS * sizes[-5:-1]).all()))


def vast(coordinates: Coordinates, states: Floats, scale: Floats) -> Bools:
    """A mask of the states (..., n) with a coordinate from which no orbit comes back, 1e15 times its scale."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((np.abs(states) > VAST * scale) & ~coordinates.angles).any(axis=-1))


def diverges(path: Path) -> bool:
    """True if the orbit of one path leaves for infinity, by the size of its start.

    Its last state is vast beside this, and a coordinate is larger in the second half by the factor GROWN: starts next to zero
    say little of the size of an attractor.
    """
    if not vast(path.coordinates, path.states[-1, 0], path.coordinates.magnitudes(path.begun)):
        return False
    first, second = (np.abs(half).max(axis=0, initial=0.0) for half in np.array_split(path.states[1:, 0], 2))
    return bool(((second > GROWN * first) & ~path.coordinates.angles).any())


def growth_on(return_map: ReturnMap, path: Path, scale: Floats) -> Floats:
    """The logarithms of the growth of a tangent vector on each return of one path, once it has turned, shape (N,)."""
    slopes = None if path.slopes is None else path.slopes[:, 0]
    if slopes is None or not np.isfinite(slopes).all():
        slopes = (
            slopes_by_differences(return_map, path, scale) if slopes is None else slopes[np.isfinite(slopes).all(axis=(1, 2))]
        )
    return tangent_growth(slopes[:, None])[:, 0]


def slopes_by_differences(return_map: ReturnMap, path: Path, scale: Floats) -> Floats:
    """The slopes of the returns of one path by differences, shape (N, n, n); those across an edge of the map are left out."""
    states, images = path.states[:-1, 0], path.states[1:, 0]
    n, dim = states.shape
    slopes = np.full((n, dim, dim), np.nan)
    for j, unit in enumerate((UNIT * scale).tolist()):
        for way in (unit, -unit):
            there = return_map.first_return(states + way * np.eye(dim)[j])
            slope = path.coordinates.difference(there.image, images) / way
            own = (there.codes == path.codes[:, 0]) & ~np.isfinite(slopes[:, :, j]).all(axis=1)
            slopes[own, :, j] = slope[own]
    return slopes[np.isfinite(slopes).all(axis=(1, 2))]


def exponent_of(growth: Floats, returns: float = 1.0) -> tuple[float, float]:
    """The logarithm of growth per return, and its standard error by batch means, from that on successive images.

    Args:
        growth: shape (N,).
        returns: mean number of returns of an image.
    """
    if len(growth) < BATCHES or np.isnan(growth).any():
        return np.nan, np.nan
    if np.isneginf(growth).any():
        return -np.inf, np.nan
    cut = growth[len(growth) % BATCHES :].reshape(BATCHES, -1)
    return float(cut.mean() / returns), float(batch_error(cut.mean(axis=1)[:, None] - cut.mean())[0] / returns)
