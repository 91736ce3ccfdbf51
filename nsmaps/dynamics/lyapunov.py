"""Lyapunov exponents of return maps, through impacts, per return and per unit of time."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any, ClassVar, Literal, overload

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import Coordinates, StateLike, WithCoordinates, as_starts
from nsmaps.dynamics.exponents.growth import batch_error, growth_of, last_outcome
from nsmaps.dynamics.returnmap import Model, check_values, followed, map_along, reasons_over, starts_under
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.parallel import SERIAL, Arrays, Parallel, divides, names_among, names_as_arrays
from nsmaps.results import NONE, Result, array, array_property, range_text, units_of

BATCHES = 32  #: of successive returns, whose means determine the standard error
PER_RETURN, PER_TIME = "per return", "per time unit of the system"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Lyapunov(WithCoordinates, Result):
    """Lyapunov exponents of the orbits of one or more starts; `...` is the shape of the starts without their last axis.

    The exponents of an orbit that ended are NaN, and `outcome` gives the reason. A return that comes to rest on a wall, or is the
    image of a constant piece of a composite map, does not depend on its start: its derivative is zero, and exponents of orbits
    with such returns are -inf. So is the least where a derivative is singular up to rounding, as after sliding.
    """

    coordinates: Coordinates
    n_returns: int  #: images over which the exponents are averaged, after the transient; of a composite map some count several
    exponents: Floats = field(metadata=array("... exponent", "exponents, in descending order", PER_RETURN))
    error: Floats = field(metadata=array("... exponent", "standard errors, by batch means; see `lyapunov`", PER_RETURN))
    per_time: Floats = field(metadata=array("... exponent", "exponents; NaN where the map has no times", PER_TIME))
    per_time_error: Floats = field(metadata=array("... exponent", "standard errors", PER_TIME))
    log_det: Floats = field(metadata=array("...", "mean of log |det| of the derivative, the sum of the exponents", PER_RETURN))
    running: Floats = field(metadata=array("... batch exponent", "exponents of the first 1/32, 2/32, ... returns", PER_RETURN))
    outcome: NDArray[np.int8] = field(metadata=array("...", f"of the last return, or of that which ended it: {OUTCOMES}", NONE))
    final: Floats = field(metadata=array("... coordinate", "last states"))

    def summary(self) -> str:
        """The numbers that matter."""
        above = self.positive
        if above.ndim:
            return f"{above.size} orbits of {self.n_returns} returns, largest exponent positive in {int(above.sum())}"
        spectrum = ", ".join(f"{value:.5g}" for value in self.exponents)
        error = f", standard error {self.error[0]:.1g}" if np.isfinite(self.error[0]) else ""  # none of -inf
        return f"exponents {spectrum} per return{error}, {self.n_returns} returns"

    @property
    def positive(self) -> NDArray[np.bool_]:
        """Whether the largest exponent exceeds two standard errors, shape (...)."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.exponents[..., 0] > 2 * self.error[..., 0])

    @array_property("...", "difference of the sum of the exponents from log_det, due to rounding", PER_RETURN)
    def defect(self) -> Floats:
        """Absolute difference of the sum of the exponents from the mean of `log |det|`, shape (...), due to rounding."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.abs(self.exponents.sum(axis=-1) - self.log_det))


def exponents_of(model: ReturnMap, starts: StateLike, n_returns: int, transient: int) -> Lyapunov:
    """The Lyapunov exponents of the orbits of some states, as of `lyapunov`."""
    start, dim = as_starts(starts, ReturnMap.require(model, "exponents").coordinates), len(model.coordinates)
    if n_returns < BATCHES or transient < 0:
        raise NsmapsError(
            f"{n_returns} returns after {transient}; expected: at least {BATCHES}, one per batch, after zero or more"
        )
    flat = start.reshape(-1, dim)
    frames = np.tile(np.eye(dim), (len(flat), 1, 1))
    outcome = np.full(len(flat), Outcome.invalid, np.int8)
    for part in growth_of(model, flat, frames, transient):
        flat, frames, outcome = part.states, part.frames, last_outcome(part, flat, outcome)
    sums, counts = [], np.diff(np.arange(BATCHES + 1) * n_returns // BATCHES)
    for count in counts.tolist():
        total = np.zeros((len(flat), dim + 3))
        for part in growth_of(model, flat, frames, count):
            flat, frames, outcome = part.states, part.frames, last_outcome(part, flat, outcome)
            part.growth[..., -1][np.isneginf(part.log_det)] = -np.inf
            others = np.stack([part.log_det, part.time, part.numbers], axis=-1)
            total += np.concatenate([part.growth, others], axis=-1).sum(axis=0)
        sums.append(total)
    return _summary(model, np.stack(sums), counts, start.shape, outcome, flat)


def _summary(
    return_map: ReturnMap,
    sums: Floats,
    counts: NDArray[np.int64],
    shape: tuple[int, ...],
    outcome: NDArray[np.int8],
    final: Floats,
) -> Lyapunov:
    """Exponents and errors from the sums over batches, shape (B, M, dim + 3): growth, `log |det|`, time, number of returns."""
    dim, n, some = shape[-1], int(counts.sum()), shape[:-1]
    sums = np.where(np.isnan(final).any(axis=1, keepdims=True), np.nan, sums)
    growth, clocks = sums[..., :dim], (sums[..., -1:], sums[..., -2:-1])
    with np.errstate(invalid="ignore"):
        (means, error), (per_time, per_time_error) = (_rate(growth, clock, counts) for clock in clocks)
        running = growth.cumsum(axis=0) / clocks[0].cumsum(axis=0)
        log_det = sums[..., dim].sum(axis=0) / clocks[0].sum(axis=0)[..., 0]
    means, error, per_time, per_time_error = (x.reshape(shape) for x in (means, error, per_time, per_time_error))
    running = np.moveaxis(running, 0, 1).reshape(*some, BATCHES, dim)
    return Lyapunov(
        coordinates=Coordinates(return_map.coordinates),
        n_returns=n,
        exponents=means,
        error=error,
        per_time=per_time,
        per_time_error=per_time_error,
        log_det=log_det.reshape(some),
        running=running,
        outcome=outcome.reshape(some),
        final=final.reshape(shape),
    )


def _rate(growth: Floats, clock: Floats, counts: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Growth per unit of a clock and its standard error, shape (M, dim), from sums over B batches, (B, M, dim) and (B, M, 1)."""
    rate = growth.sum(axis=0) / clock.sum(axis=0)
    return rate, batch_error((growth - rate * clock) / counts[:, None, None]) / (clock.sum(axis=0) / counts.sum())


TABLES = tuple(each.name for each in fields(Lyapunov) if each.metadata)  #: its arrays


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LyapunovSweep(Lyapunov):
    """Lyapunov exponents over V values of a parameter, which are the first axis of all arrays.

    Where there is no map, they are NaN, and the outcome is `invalid`.
    """

    picture: ClassVar[str] = "nsmaps.figures.parameters.lyapunov"
    leading: ClassVar[tuple[str, ...]] = ("value",)

    parameter: str
    values: Floats = field(metadata=array("value", "values of the parameter, as given", name="parameter"))
    reasons: tuple[str, ...]  #: V texts, the reason why there is no map; "" where there is one
    units: Mapping[str, str] = field(default_factory=dict)  #: of coordinates and parameters, by name

    def summary(self) -> str:
        """The numbers that matter."""
        return f"{range_text(self.parameter, self.values)}, largest exponent positive at {int(self.positive.sum())}"


@overload
def lyapunov(system: ReturnMap, *, starts: StateLike, n_returns: int = ..., transient: int = ...) -> Lyapunov: ...


@overload
def lyapunov(
    system: Model,
    parameter: str,
    values: ArrayLike,
    starts: StateLike,
    *,
    n_returns: int = ...,
    transient: int = ...,
    direction: Literal["up", "down"] | None = ...,
    parallel: Parallel = ...,
) -> LyapunovSweep: ...


@divides
def lyapunov(
    system: Any,
    parameter: str | None = None,
    values: ArrayLike | None = None,
    starts: StateLike | None = None,
    *,
    n_returns: int = 10_000,
    transient: int = 1000,
    direction: Literal["up", "down"] | None = None,
    parallel: Parallel = SERIAL,
) -> Lyapunov | LyapunovSweep:
    """The Lyapunov exponents of the orbit of one state, shape (dim,), or of many, shape (..., dim), maybe over a parameter.

    A frame of tangent vectors is carried through the returns by the map's derivative and made orthonormal after each by modified
    Gram-Schmidt; the exponents are the means of the logarithms of its growth factors. The error is that of 32 batch means, as if
    their autocorrelation were that of a first-order process with their correlation at lag one, where that is positive:
    s/sqrt(32) sqrt((1 + rho)/(1 - rho)). It does not account for events that are rarer than
    a batch is long, such as escapes from an attractor.

    Args:
        system: a return map with derivatives, such as an exact system or a composite map; with `parameter` and `values` a system
            or a function of the parameter's value, as of `bifurcation_diagram`.
        parameter: its name, of exponents over its values.
        values: of the parameter, shape (V,).
        starts: the states from which orbits start, also without a parameter: `lyapunov(system, starts=[0.8, 0.4])`. Phases in
            radians.
        n_returns: returns over which the exponents are averaged.
        transient: returns before these, in which the frame converges to the directions of the exponents.
        direction: as of `bifurcation_diagram`, "up" or "down".
        parallel: see `nsmaps.Parallel`; every value is a part, with `direction` all of them are one part.

    Raises:
        StateError: the state does not have the map's coordinates.
        NsmapsError: `n_returns` is below 32, the number of batches, `transient` is negative, there is no such parameter, or no
            value has a map; a parameter without values, or no starts.
    """
    if starts is None or (parameter is None) != (values is None):
        raise NsmapsError(
            "no starts, or a parameter without values; expected: `starts=` by name, and over a parameter its name and `values`"
        )
    if parameter is None:
        return exponents_of(system, starts, n_returns, transient)
    map_of, along = map_along(system, parameter), np.atleast_1d(np.asarray(values, float))
    check_values(along)
    now = starts_under(map_of, along, starts)
    order = np.argsort(-along if direction == "down" else along, kind="stable")
    cuts = [order] if direction else [order[cut] for cut in parallel.cuts(len(order))]
    parts = [(map_of, along[cut], now, n_returns, transient, bool(direction)) for cut in cuts]

    def sweep(found: Mapping[int, Arrays]) -> LyapunovSweep:
        tables = _over_all(along, [(cuts[k], part) for k, part in found.items()])
        return LyapunovSweep(n_returns=n_returns, parameter=parameter, values=along, units=units_of(system), **tables)

    return sweep(dict(enumerate(parallel.run(_exponents, parts, sweep))))


def _over_all(along: Floats, blocks: list[tuple[NDArray[np.int64], Arrays]]) -> dict[str, Any]:
    """The coordinates, and reasons and exponents at all values, from the arrays at some of them, by their indices."""
    reasons, known = reasons_over(along, blocks)
    tables: Arrays = {}
    for name in TABLES:
        own = known[name]
        tables[name] = np.full((len(along), *own.shape[1:]), Outcome.invalid if name == "outcome" else np.nan, own.dtype)
        for cut, part in blocks:
            if name in part:
                tables[name][cut[part["reasons"] == ""]] = part[name]
    return {"coordinates": names_among(known)[0], "reasons": tuple(reasons.tolist()), **tables}


def _exponents(
    map_of: Callable[[float], ReturnMap], values: Floats, starts: Floats, n_returns: int, transient: int, directed: bool
) -> Arrays:
    """The arrays of exponents at values, taken in this order, where there are maps."""
    found, reasons, _ = followed(
        map_of, values, starts, partial(exponents_of, n_returns=n_returns, transient=transient), directed
    )
    about = {"reasons": np.array(reasons, str)}
    if not found:
        return about
    return {
        **about,
        **names_as_arrays(found[0].coordinates),
        **{name: np.stack([getattr(each, name) for each in found]) for name in TABLES},
    }
