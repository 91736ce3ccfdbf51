"""Many successive returns with their derivatives, the growth of tangent vectors on them, and whether they leave every bound."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.lyapunov import batch_error
from nsmaps.dynamics.motion import periods
from nsmaps.dynamics.orbit import returns_of
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import Alphabet

ALIGN = 50  #: returns in which a tangent vector turns into the direction that grows fastest
BATCHES = 32  #: of successive returns, from whose means the error of an exponent follows
UNIT = 1e-7  #: of the scale: differences from which slopes follow where the map has no derivative
LARGE, VAST, GROWS = 1e3, 1e15, 1.01  #: of the scale: size of escaping orbits, of what cannot come back, and growth by parts
GROWN = 10.0  #: by which an orbit that leaves for infinity is larger in the second half of its last states


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """N successive returns of M states of n coordinates, with the derivatives of the returns."""

    coordinates: Coordinates
    walls: tuple[str, ...]
    alphabet: Alphabet
    states: Floats  #: shape (N + 1, M, n), the starts first
    codes: Ints  #: shape (N, M)
    turns: Ints  #: shape (N, M), of all angles
    time: Floats  #: shape (N, M)
    outcome: Ints  #: shape (N, M)
    numbers: Ints  #: shape (N, M), successive returns of each, of which a composite map may have several
    slopes: Floats | None = None  #: shape (N, M, n, n), where known

    @classmethod
    def of(cls, returns: Returns, count: int) -> "Path":
        """The path of `count` states, from their returns in the order of `ReturnMap.orbits`."""
        dim, circle = returns.start.shape[1], returns.coordinates.angles
        states = np.concatenate([returns.start[:count], returns.image]).reshape(-1, count, dim)
        turns: Ints = returns.known_turns[:, circle].sum(axis=1)
        rows: dict[str, Any] = {"codes": returns.codes, "turns": turns, "numbers": returns.numbers}
        rows |= {"time": returns.time, "outcome": returns.outcome}
        each: Any = {name: row.reshape(-1, count) for name, row in rows.items()}
        slopes = None if returns.derivative is None else returns.derivative.reshape(-1, count, dim, dim)
        return cls(returns.coordinates, returns.walls, returns.alphabet, states, **each, slopes=slopes)

    def of_one(self, k: int) -> "Path":
        """The path of one of the states."""
        names = "states", "codes", "turns", "time", "outcome", "numbers"
        rows = {name: getattr(self, name)[:, k : k + 1] for name in names}
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

    def repeats(self, near: Floats) -> Ints:
        """The number of states after which each orbit repeats within a tolerance (n,), see `periods`, shape (M,)."""
        rows = np.swapaxes(self.states[1:], 0, 1), self.codes.T, self.coordinates, near, self.time.T
        return periods(*rows)


def followed(return_map: ReturnMap, states: Floats, count: int) -> Path:
    """The path of states (M, n), M above zero, over some returns, with derivatives."""
    parts = list(returns_of(return_map, states, count, derivative=True))
    return Path.of(Returns.concatenate(parts), len(states))


def escapes(path: Path, scale: Floats) -> bool:
    """True if the orbit of one path leaves every bound: a coordinate that is not an angle is vast, or large and grows on."""
    line = ~path.coordinates.angles
    if not line.any():
        return False
    sizes = np.array(
        [(np.abs(part[:, line]) / scale[line]).max() for part in np.array_split(path.states[:, 0], min(8, len(path.states)))]
    )
    return bool(sizes[-1] > VAST or (sizes[-1] > LARGE and (sizes[-4:] > GROWS * sizes[-5:-1]).all()))


def vast(coordinates: Coordinates, states: Floats, scale: Floats) -> Bools:
    """A mask of the states (..., n) with a coordinate from which no orbit comes back, 1e15 times its scale."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((np.abs(states) > VAST * scale) & ~coordinates.angles).any(axis=-1))


def diverges(coordinates: Coordinates, states: Floats, starts: Floats) -> Bools:
    """A mask of the orbits (..., k, n), of k states in a row, that leave for infinity, by the size of their starts.

    The last state is vast beside these, and a coordinate is larger in the second half by the factor GROWN: starts next to zero
    say little of the size of an attractor.
    """
    with np.errstate(invalid="ignore"):
        first, second = (np.abs(half).max(axis=-2, initial=0.0) for half in np.array_split(states, 2, axis=-2))
        grows = ((second > GROWN * first) & ~coordinates.angles).any(axis=-1)
    return grows & vast(coordinates, states[..., -1, :], coordinates.magnitudes(starts))


def growth_on(return_map: ReturnMap, path: Path, scale: Floats) -> Floats:
    """The logarithms of the growth of a tangent vector on each return of one path, once it has turned, shape (N,)."""
    from nsmaps.dynamics.frames import carried

    slopes = None if path.slopes is None else path.slopes[:, 0]
    if slopes is None or not np.isfinite(slopes).all():
        slopes = (
            slopes_by_differences(return_map, path, scale) if slopes is None else slopes[np.isfinite(slopes).all(axis=(1, 2))]
        )
    n, dim, _ = slopes.shape
    growth = np.empty((n, 1, dim))
    carried(np.ascontiguousarray(slopes[:, None]), np.eye(dim)[None].copy(), growth)
    return growth[min(ALIGN, n // 2) :, 0, 0]


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
