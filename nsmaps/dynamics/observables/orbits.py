"""Means of observables along orbits of systems: summed in the compiled loop, with errors by batches."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates, StateLike, WithCoordinates, as_starts
from nsmaps.dynamics.observables.means import Mean, ratio
from nsmaps.errors import NsmapsError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.observables.spec import Observable, ObservableLike
from nsmaps.exact.outcome import OUTCOMES
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.progress import beat
from nsmaps.results import NONE, TIME, Result, array, array_property

if TYPE_CHECKING:
    from nsmaps.exact.observables.formulas import Plan
    from nsmaps.exact.observables.totals import Totals

BATCHES = 32  #: of returns, whose means are compared for an error
BLOCK = 100_000  #: returns of a compiled loop between calls of `progress`


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ObservableMeans(WithCoordinates, Result):
    """Totals of K observables over B batches of returns of one or more orbits; `...` is the shape of the starts."""

    coordinates: Coordinates
    observables: tuple[Observable, ...]
    period: float | None  #: of the forcing, in the system's time; None without forcing
    length: int  #: of a batch, in returns
    totals: Floats = field(
        metadata=array("batch ... observable", "sums, largest values of those that are `largest`; NaN where an orbit ended")
    )
    weights: Floats = field(
        metadata=array("batch ... observable", "by which those with `per` are divided; NaN of the others", NONE)
    )
    time: Floats = field(metadata=array("batch ...", "of each batch", TIME))
    final: Floats = field(metadata=array("... coordinate", "last states"))
    outcome: NDArray[np.int8] = field(metadata=array("...", f"of the last return: {OUTCOMES}", NONE))

    def summary(self) -> str:
        """The numbers that matter."""
        mean = self.per_return
        if mean.value.ndim > 1:
            return f"{', '.join(each.name for each in self.observables)} of {mean.value[..., 0].size} orbits"
        texts = []
        for each, value, error in zip(self.observables, mean.value, mean.error, strict=True):
            known = f" +- {error:.1g}" if np.isfinite(error) else ""
            texts.append(f"{'largest ' * each.largest}{each.name} {value:.6g}{known}")
        return f"per return: {', '.join(texts)}"

    @array_property("observable", "names of the observables", NONE)
    def names(self) -> tuple[str, ...]:
        """The names of the observables."""
        return tuple(one.name for one in self.observables)

    @property
    def per_return(self) -> Mean:
        """Means a return; of observables with `per` their quotients, of those that are `largest` the largest values."""
        return self._over(np.full(self.time.shape, float(self.length)))

    @property
    def per_period(self) -> Mean:
        """Means a period of the forcing, as `per_return`. NsmapsError without forcing."""
        if self.period is None:
            raise NsmapsError("the system has no forcing, and therefore no mean per period; expected: `per_return` or `per_time`")
        return self._over(self.time / self.period)

    @property
    def per_time(self) -> Mean:
        """Means a unit of the system's time, as `per_return`."""
        return self._over(self.time)

    def _over(self, sizes: Floats) -> Mean:
        divided = np.array([bool(one.per) for one in self.observables])
        largest = np.array([one.largest for one in self.observables])
        mean = ratio(self.totals, np.where(divided, self.weights, sizes[..., None]))
        return Mean(np.where(largest, self.totals.max(axis=0), mean.value), np.where(largest, np.nan, mean.error))


def orbit_means(
    system: System,
    starts: StateLike,
    n_returns: int,
    observables: Sequence[ObservableLike],
    transient: int = 0,
    n_batches: int = BATCHES,
    chatter: float = SUMMED_SPEED,
) -> ObservableMeans:
    """Means of observables over n returns of one state, shape (dim,) or by name, or of many, shape (..., dim)."""
    from nsmaps.exact.observables.formulas import plan_of, resolve_observables

    system = System.require(system, "observables")
    start, n = as_starts(starts, system.coordinates), n_returns
    if n < 1 or transient < 0 or n_batches < 1 or not chatter >= 0:
        raise NsmapsError(
            f"{n} returns after {transient} in {n_batches} batches, chatter {chatter:g}; expected: at least 1 after at least 0 "
            "in at least 1, chatter >= 0"
        )
    found = resolve_observables(system, observables)
    plan, states = plan_of(system, found), start.reshape(-1, start.shape[-1])
    count, m = min(n_batches, n), max(len(states), 1)
    length, group = n // count, max(1, BLOCK // (n // count * m))
    parts, done = [], 0
    while done < count:
        parts.append(_totals(system, plan, states, length, min(group, count - done), 0 if done else transient, chatter))
        states, done = parts[-1].final, min(done + group, count)
        beat(done / count)
    totals, time = (np.concatenate([getattr(part, name) for part in parts]) for name in ("totals", "time"))
    return _observed(system, found, plan.columns, length, start, totals, time, parts[-1])


def _totals(system: System, plan: "Plan", states: Floats, length: int, batches: int, discard: int, chatter: float) -> "Totals":
    if isinstance(system, FlowSystem):
        from nsmaps.exact.observables.totals import totals_of

        return totals_of(system, plan, states, length, batches, discard, chatter)
    from nsmaps.dynamics.observables.maps import map_totals

    return map_totals(system, plan, states, length, batches, discard)


def _observed(
    system: System,
    found: tuple[Observable, ...],
    columns: tuple[tuple[int, int], ...],
    length: int,
    start: Floats,
    totals: Floats,
    time: Floats,
    last: Any,
) -> ObservableMeans:
    """Totals in the shape of the starts, a column for each observable."""
    shape, each = (len(totals), *start.shape[:-1]), np.full((2, *totals.shape[:2], len(found)), np.nan)
    for column, (k, part) in enumerate(columns):
        each[part, :, :, k] = totals[..., column]
    parts = each.reshape(2, *shape, len(found))
    period = system.period()
    end = last.final.reshape(start.shape), last.outcome.reshape(start.shape[:-1])
    rows = parts[0], parts[1], time.reshape(shape), *end
    return ObservableMeans(system.coordinates, found, None if period is None else float(period), length, *rows)
