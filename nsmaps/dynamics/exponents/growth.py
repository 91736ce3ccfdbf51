"""The growth of frames of tangent vectors in the returns of an orbit, and the standard error of means over batches."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

SINGULAR = 4 * np.finfo(float).eps  #: share of Hadamard's bound at which a determinant is rounding
ALIGN = 50  #: returns in which a tangent vector turns into the direction that grows fastest
BLOCK = 100_000  #: returns of a compiled loop, of all states together, so that memory stays small


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """The growth of frames of tangent vectors in n returns of each of M states of dim coordinates."""

    states: Floats  #: shape (M, dim), after the returns; NaN after an orbit's end
    frames: Floats  #: shape (M, dim, dim), orthonormal columns, in descending order of growth
    growth: Floats  #: shape (n, M, dim), logarithms of the diagonal of R in D Q = Q' R; -inf where D is singular
    log_det: Floats  #: shape (n, M), log |det D| of each return's derivative D; -inf where it is rounding
    time: Floats  #: shape (n, M), of each return; NaN where unknown
    numbers: NDArray[np.int32]  #: shape (n, M), successive returns of each image
    outcome: NDArray[np.int8]  #: shape (n, M), values of `Outcome`; that which ended an orbit is repeated


def growth_of(return_map: ReturnMap, states: Floats, frames: Floats, n: int) -> Iterator[Growth]:
    """The growth of frames in n returns of states (M, dim), in parts of many returns if the map computes many in one call."""
    block = max(BLOCK // len(states), 1) if return_map.has_orbits and len(states) else 1
    for first in range(0, n, block):
        part = _carried(return_map.orbits(states, min(block, n - first), derivative=True), frames)
        states, frames = part.states, part.frames
        yield part


def _carried(returns: Returns, frames: Floats) -> Growth:
    """The growth of frames in returns of M states, in the order of `ReturnMap.orbits`, by modified Gram-Schmidt."""
    m, dim, frames = len(frames), frames.shape[1], frames.copy()
    n = len(returns) // m if m else 1
    slopes = returns.slopes.reshape(n, m, dim, dim)
    growth = carry_frames(slopes, frames)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_det = np.log(determinants(slopes))
    time, numbers, outcome = returns.time.reshape(n, m), returns.numbers.reshape(n, m), returns.outcome.reshape(n, m)
    return Growth(returns.image[len(returns) - m :], frames, growth, log_det, time, numbers, outcome)


def carry_frames(slopes: Floats, frames: Floats) -> Floats:
    """Carry frames (M, dim, dim) through derivatives (n, M, dim, dim), in place: the logarithms of their growth, (n, M, dim)."""
    from nsmaps.dynamics.exponents.frames import carried

    growth = np.empty(slopes.shape[:-1])
    carried(np.ascontiguousarray(slopes), frames, growth)
    return growth


def tangent_growth(slopes: Floats) -> Floats:
    """The logarithms of the growth of a tangent vector by derivatives (n, M, dim, dim), once it has turned, shape (K, M)."""
    n, m, dim, _ = slopes.shape
    return carry_frames(slopes, np.tile(np.eye(dim), (m, 1, 1)))[min(ALIGN, n // 2) :, :, 0]


def product_of(derivatives: Iterable[Floats]) -> Floats:
    """The derivative of successive returns, from those of each."""
    return reduce(lambda so_far, each: each @ so_far, derivatives)


def determinants(slopes: Floats) -> Floats:
    """|det D| of derivatives (..., dim, dim), zero where it is rounding of the terms, whatever the units of the coordinates."""
    found = np.abs(np.linalg.det(slopes))
    units = np.sqrt(np.linalg.norm(slopes, axis=-1) / np.linalg.norm(slopes, axis=-2))
    bound = np.linalg.norm(slopes * units[..., None, :] / units[..., :, None], axis=-2).prod(axis=-1)  # Hadamard's
    return np.where(found <= SINGULAR * bound, 0.0, found)


def last_outcome(part: Growth, before: Floats, outcome: NDArray[np.int8]) -> NDArray[np.int8]:
    """The outcome of the last return of each orbit, or of the return that ended it."""
    return np.where(np.isnan(before).any(axis=1) & (outcome != Outcome.invalid), outcome, part.outcome[-1]).astype(np.int8)


def batch_error(differences: Floats) -> Floats:
    """The standard error of a mean from the differences of its batch means from it, shape (B, ...), for each column.

    The batch means are taken for a first-order process with their correlation at lag one, or with zero if that is negative.
    """
    square = (differences**2).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = np.where(square > 0, (differences[1:] * differences[:-1]).sum(axis=0) / square, 0.0)
    rho = np.clip(rho, 0.0, 1 - 1 / len(differences))
    return np.asarray(np.sqrt(square / (len(differences) * (len(differences) - 1)) * (1 + rho) / (1 - rho)))
