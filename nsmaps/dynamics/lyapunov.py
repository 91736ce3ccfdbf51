"""Lyapunov exponents of return maps, through impacts: how fast neighbouring orbits part, a return and a unit of time."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, brief
from nsmaps.coordinates import Coordinates, WithCoordinates, as_numbers
from nsmaps.dynamics.returnmap import OrbitMap, ReturnMap, followed
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.parallel import SERIAL, Arrays, Jobs, divides, names_among, names_as_arrays
from nsmaps.progress import shows

BATCHES = 32  #: of successive returns, whose means tell the error
BLOCK = 100_000  #: returns of a compiled loop, of all states together, so that memory stays small


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Lyapunov(WithCoordinates):
    """Lyapunov exponents of the orbits of one or more starts; `...` is the shape of the starts without their last axis.

    An orbit that ended has none: its exponents are NaN, `outcome` says why. A return that comes to rest on a wall forgets where
    it came from: its derivative is zero, and exponents of orbits with such returns are -inf.
    """

    __repr__ = brief

    coordinates: Coordinates
    returns: int  #: that were averaged over, after the transient
    exponents: Floats  #: shape (..., dim), a return, the largest first
    error: Floats  #: shape (..., dim), their standard errors, by batch means; see `lyapunov`
    per_time: Floats  #: shape (..., dim), a unit of the system's time; NaN where the map does not know times
    per_time_error: Floats  #: shape (..., dim)
    log_det: Floats  #: shape (...), mean of `log |det|` of the derivative, to which the exponents of an orbit must add up
    running: Floats  #: shape (32, ..., dim), exponents by the first 1/32, 2/32, ... of the returns: how they converge
    outcome: NDArray[np.int8]  #: shape (...), values of `Outcome`: of the last return, or of that which ended the orbit
    final: Floats  #: shape (..., dim), the last states

    @property
    def defect(self) -> Floats:
        """How far the sum of the exponents is from the mean of `log |det|`, shape (...): rounding only. NaN without exponents."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.abs(self.exponents.sum(axis=-1) - self.log_det))


@shows
def lyapunov(map: ReturnMap, state: ArrayLike, n: int, transient: int = 1000) -> Lyapunov:
    """The Lyapunov exponents of the orbit of one state, shape (dim,), or of many, shape (..., dim), over n returns.

    A frame of tangent vectors is carried through the returns by the map's derivative and made orthonormal after each by modified
    Gram-Schmidt; the exponents are the means of the logarithms of its stretches. The error is that of 32 batch means, as if
    their autocorrelation were that of a first-order process with their correlation at lag one, where that is positive:
    s/sqrt(32) sqrt((1 + rho)/(1 - rho)). It does not see what no batch saw, such as an attractor that is left rarely.

    Args:
        map: with derivatives, such as an exact system or a composite map.
        transient: returns made before those that count, with which the frame turns to where it belongs.

    Raises:
        StateError: the state has not the map's coordinates.
        NsmapsError: n is below 32, the number of batches, or the transient negative.
    """
    start, dim = as_numbers(state, map.coordinates), len(map.coordinates)
    if start.ndim == 0 or start.shape[-1] != dim:
        raise StateError(f"the start has shape {start.shape}; its last axis must hold {map.coordinates}")
    if n < BATCHES or transient < 0:
        raise NsmapsError(f"{n} returns after {transient}; expected: at least {BATCHES}, one a batch, after zero or more")
    flat = start.reshape(-1, dim)
    frames = np.tile(np.eye(dim), (len(flat), 1, 1))
    outcome = np.full(len(flat), Outcome.invalid, np.int8)
    for part in _growth(map, flat, frames, transient):
        flat, frames, outcome = part.states, part.frames, _last(part, flat, outcome)
    sums, counts = [], np.diff(np.arange(BATCHES + 1) * n // BATCHES)
    for count in counts.tolist():
        total = np.zeros((len(flat), dim + 2))
        for part in _growth(map, flat, frames, count):
            flat, frames, outcome = part.states, part.frames, _last(part, flat, outcome)
            part.growth[..., -1][np.isneginf(part.log_det)] = -np.inf  # a direction was forgotten, but for rounding
            table = np.concatenate([part.growth, part.log_det[..., None], part.time[..., None]], axis=-1)
            total += table.sum(axis=0)
        sums.append(total)
    return _summary(map, np.stack(sums), counts, start.shape, outcome, flat)


@dataclass(frozen=True, slots=True, eq=False)
class _Growth:
    """What n returns of each of M states of dim coordinates did to frames of tangent vectors."""

    states: Floats  #: shape (M, dim), where they are now; NaN after an orbit's end
    frames: Floats  #: shape (M, dim, dim), orthonormal columns, the fastest growing first
    growth: Floats  #: shape (n, M, dim), logarithms of the diagonal of R in D Q = Q' R; -inf where a return forgets a direction
    log_det: Floats  #: shape (n, M), log |det D| of each return's derivative D
    time: Floats  #: shape (n, M), of each return; NaN where unknown
    outcome: NDArray[np.int8]  #: shape (n, M), values of `Outcome`; that which ended an orbit is repeated


def _growth(map: ReturnMap, states: Floats, frames: Floats, n: int) -> Iterator[_Growth]:
    """What n returns of states (M, dim) do to frames, in parts of many returns where the map makes many in one call."""
    block = max(BLOCK // len(states), 1) if isinstance(map, OrbitMap) and len(states) else 1
    for first in range(0, n, block):
        if isinstance(map, OrbitMap):
            returns = map.orbits(states, min(block, n - first), derivative=True)
        else:
            returns = map.first_return(states, derivative=True)
        part = _carried(returns, frames)
        states, frames = part.states, part.frames
        yield part


def _carried(returns: Returns, frames: Floats) -> _Growth:
    """What returns of M states, the first of every state first, do to their frames, by modified Gram-Schmidt."""
    from nsmaps.dynamics.frames import carried

    m, dim, frames = len(frames), frames.shape[1], frames.copy()
    n = len(returns) // m if m else 1
    assert returns.derivative is not None
    growth, slopes = np.empty((n, m, dim)), np.ascontiguousarray(returns.derivative).reshape(n, m, dim, dim)
    carried(slopes, frames, growth)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_det = np.log(np.abs(np.linalg.det(slopes)))
    time, outcome = returns.time.reshape(n, m), returns.outcome.reshape(n, m)
    return _Growth(returns.image[len(returns) - m :], frames, growth, log_det, time, outcome)


def _last(part: _Growth, before: Floats, outcome: NDArray[np.int8]) -> NDArray[np.int8]:
    """How the last return of each orbit ended, or that which ended it."""
    return np.where(np.isnan(before).any(axis=1) & (outcome != Outcome.invalid), outcome, part.outcome[-1]).astype(np.int8)


def _summary(
    map: ReturnMap, sums: Floats, counts: NDArray[np.int64], shape: tuple[int, ...], outcome: NDArray[np.int8], final: Floats
) -> Lyapunov:
    """Exponents and errors from the sums over batches, shape (B, M, dim + 2): stretches, `log |det|`, time."""
    dim, n, some = shape[-1], int(counts.sum()), shape[:-1]
    sums = np.where(np.isnan(final).any(axis=1, keepdims=True), np.nan, sums)
    growth, time = sums[..., :dim], sums[..., dim + 1 :]
    with np.errstate(invalid="ignore"):
        means, duration = growth.sum(axis=0) / n, time.sum(axis=0) / n
        per_time = means / duration
        error = _error(growth / counts[:, None, None] - means)
        per_time_error = _error((growth - per_time * time) / counts[:, None, None]) / duration
        running = growth.cumsum(axis=0) / counts.cumsum()[:, None, None]
        log_det = sums[..., dim].sum(axis=0) / n
    means, error, per_time, per_time_error = (x.reshape(shape) for x in (means, error, per_time, per_time_error))
    running = running.reshape(BATCHES, *shape)
    return Lyapunov(
        coordinates=Coordinates(map.coordinates),
        returns=n,
        exponents=means,
        error=error,
        per_time=per_time,
        per_time_error=per_time_error,
        log_det=log_det.reshape(some),
        running=running,
        outcome=outcome.reshape(some),
        final=final.reshape(shape),
    )


def _error(apart: Floats) -> Floats:
    """The standard error of a mean from its batch means less itself, shape (B, ...), one for each column.

    Of a first-order process, its correlation estimated at lag one; one that is negative counts as none.
    """
    square = (apart**2).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = np.where(square > 0, (apart[1:] * apart[:-1]).sum(axis=0) / square, 0.0)
    rho = np.clip(rho, 0.0, 1 - 1 / len(apart))
    return np.asarray(np.sqrt(square / (len(apart) * (len(apart) - 1)) * (1 + rho) / (1 - rho)))


TABLES = tuple(field.name for field in fields(Lyapunov) if field.name not in ("coordinates", "returns"))  #: its arrays


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LyapunovSweep:
    """Lyapunov exponents over V values of a parameter."""

    __repr__ = brief

    values: Floats  #: shape (V,), as given
    reasons: tuple[str, ...]  #: V texts, why no map could be made; "" where one was
    at: Lyapunov  #: all arrays with V as their first axis; NaN, and the outcome `invalid`, where there is no map


@divides
def lyapunov_sweep(
    map_of: Callable[[float], ReturnMap],
    values: ArrayLike,
    state: ArrayLike,
    n: int,
    transient: int = 1000,
    follow: Literal["up", "down"] | None = None,
    *,
    jobs: Jobs = SERIAL,
) -> LyapunovSweep:
    """The Lyapunov exponents over the values of a parameter; arguments as of `lyapunov` and of `bifurcation`.

    Every value is a part of `jobs`, see `nsmaps.Jobs`; with `follow` all of them are one.

    Raises:
        StateError, NsmapsError: as `lyapunov`, or there is a map at none of the values.
    """
    along, now = np.atleast_1d(np.asarray(values, float)), np.asarray(state, float)
    if along.ndim != 1 or not len(along) or not np.isfinite(along).all():
        raise NsmapsError(f"the values have shape {along.shape}; expected: one or more finite numbers in a row")
    order = np.argsort(-along if follow == "down" else along, kind="stable")
    cuts = [order] if follow else [order[cut] for cut in jobs.cuts(len(order))]
    parts = [(map_of, along[cut], now, n, transient, bool(follow)) for cut in cuts]
    made = jobs.run(_exponents, parts)
    reasons = np.full(len(along), "", object)
    for cut, part in zip(cuts, made, strict=True):
        reasons[cut] = part["reasons"]
    known = next((part for part in made if "exponents" in part), None)
    if known is None:
        raise NsmapsError(f"there is no map at any of {len(along)} values; at {along[0]:g}: {reasons[0]}")
    tables: Arrays = {}
    for name in TABLES:
        own = known[name]
        tables[name] = np.full((len(along), *own.shape[1:]), Outcome.invalid if name == "outcome" else np.nan, own.dtype)
        for cut, part in zip(cuts, made, strict=True):
            if name in part:
                tables[name][cut[part["reasons"] == ""]] = part[name]
    return LyapunovSweep(along, tuple(reasons.tolist()), Lyapunov(names_among(known)[0], n, **tables))


def _exponents(
    map_of: Callable[[float], ReturnMap], values: Floats, state: Floats, n: int, transient: int, follow: bool
) -> Arrays:
    """The arrays of `lyapunov` at values, taken in this order, where there are maps."""
    found, reasons, _ = followed(map_of, values, state, partial(lyapunov, n=n, transient=transient), follow)
    about = {"reasons": np.array(reasons, str)}
    if not found:
        return about
    return {
        **about,
        **names_as_arrays(found[0].coordinates),
        **{name: np.stack([getattr(made, name) for made in found]) for name in TABLES},
    }
