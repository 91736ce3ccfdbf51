"""The mean of a correlated series, with its standard error."""

from dataclasses import dataclass, field

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.results import Result, array

WINDOW = 5.0  #: autocorrelation times over which correlations are added


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Mean(Result):
    """Means of K observables along orbits, `...` the shape of the orbits."""

    value: Floats = field(metadata=array("... observable", "mean; NaN where an orbit ended"))
    error: Floats = field(metadata=array("... observable", "standard error; NaN where unknown, as of the largest values"))


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
