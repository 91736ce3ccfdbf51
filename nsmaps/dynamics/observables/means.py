"""Means of observables, and the mean of a correlated series with its standard error."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.observables.spec import Observable
from nsmaps.results import NONE, Result, array, array_property, range_text

WINDOW = 5.0  #: autocorrelation times over which correlations are added


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Mean(Result):
    """Means of K observables along orbits, `...` the shape of the orbits."""

    value: Floats = field(metadata=array("... observable", "mean; NaN where an orbit ended"))
    error: Floats = field(metadata=array("... observable", "standard error; NaN where unknown, as of the largest values"))


@dataclass(frozen=True, slots=True, eq=False, repr=False, kw_only=True)
class Means(Result):
    """Means of observables per return, per period of the forcing and per unit of time, maybe over a parameter."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.observe"

    observables: tuple[Observable, ...] = field(kw_only=False)
    parameter: str = ""  #: empty where they are of one system
    values: Floats | None = field(default=None, metadata=array("value", "values of the parameter", name="parameter"))
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates and the parameter, by name

    def summary(self) -> str:
        """The numbers that matter."""
        names = ", ".join(each.name for each in self.observables)
        return f"{names}: {range_text(self.parameter, self.values)}" if self.values is not None else f"means of {names}"

    @property
    def leading(self) -> tuple[str, ...]:  # type: ignore[override]
        """The axes of the means before that of the observables."""
        return (("value", "start") if self.parameter else ("attractor",))[: np.ndim(self.shown[1].value) - 1]

    @array_property("observable", "names of the observables", NONE)
    def names(self) -> tuple[str, ...]:
        """The names of the observables."""
        return tuple(one.name for one in self.observables)

    @array_property("... observable", "means per period of the forcing, or per return where there is none")
    def means(self) -> Floats:
        """The means by which the observables are shown."""
        return self.shown[1].value

    @property
    def shown(self) -> tuple[str, Any]:
        """The means per period of the forcing, or per return where there is none, after what they are called."""
        forced = self.per_period  # type: ignore[attr-defined]
        known = forced is not None and bool(np.isfinite(forced.value).any())
        return ("per period", forced) if known else ("per return", self.per_return)  # type: ignore[attr-defined]


def ratio(parts: Floats, sizes: Floats) -> Mean:
    """The sum of some parts over the sum of their sizes, shape (B, ...) each, such as the totals of batches and their times.

    The error is that of a ratio of means, from the remainders parts - ratio sizes of the batches; correlation between
    batches is counted by the integrated autocorrelation time (A. Sokal, in: Functional Integration, Plenum 1997, p. 131).
    """
    batches = len(parts)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = parts.sum(axis=0) / sizes.sum(axis=0)
        if batches < 2:
            return Mean(value, np.full(value.shape, np.nan))
        residue = parts - value * sizes
        variance = (residue**2).sum(axis=0) / (batches - 1) / batches
        times = np.maximum(2 * autocorrelation_time(residue), 1.0)
        return Mean(value, np.sqrt(times * variance) / np.abs(sizes.mean(axis=0)))


def autocorrelation_time(series: Floats) -> Floats:
    """The integrated autocorrelation time 1/2 + sum of the autocorrelations of series of mean zero, shape (B, ...).

    Sokal's window: correlations are added up to the first lag that is `WINDOW` times the sum. It is 1/2 without correlation
    and of a constant series. The bias of a series whose mean was subtracted is corrected to first order in 1/B (U. Wolff, Comput.
    Phys. Commun. 156 (2004) 143).
    """
    square = (series**2).sum(axis=0)
    time = np.full(square.shape, 0.5)
    is_open, lags = square > 0, np.zeros(square.shape)
    for lag in range(1, len(series)):
        correlation = (series[lag:] * series[:-lag]).sum(axis=0) / np.where(is_open, square, 1.0)
        time = np.where(is_open, time + correlation, time)
        lags = np.where(is_open, lag, lags)
        is_open = is_open & (lag < WINDOW * time)
        if not np.any(is_open):
            break
    return np.where(square > 0, time * (1 + (2 * lags + 1) / len(series)), time)
