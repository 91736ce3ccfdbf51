"""An estimate: residuals of impact times with what was missed, and parameters with their region or profile."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Floats
from nsmaps.estimation.result import Estimate
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, BLUE, GREY, ORANGE, RED, label

LEVELS = (1.515, 2.486)  #: radii of the regions of 68.27 and 95.45 % of two parameters, in standard errors
POINTS = 181
REACH = 3.0  #: standard errors on either side of one parameter


def sheets(found: Estimate) -> tuple[Sheet, ...]:
    """One sheet: the residuals, then each parameter, or each pair of neighbours."""
    count = len(found.names)
    panels = [partial(region, found, number=k) for k in range(count - 1)] or [partial(parameter, found)]
    return (Sheet("estimate", (partial(estimate, found), *panels), 2),)


def estimate(found: Estimate, ax: Axes) -> Axes:
    """Residuals of impact times over time, in standard deviations, missed and spurious ones on the edge; or those of samples."""
    pairs = found.pairs
    if not len(pairs.time):
        return samples(found, ax)
    residual, both = pairs.residual, np.isfinite(pairs.residual)
    edge = bands(residual[both], ax)
    for letter, colour in zip(dict.fromkeys(pairs.model_wall[both].tolist()), (BLACK, BLUE, ORANGE, GREY), strict=False):
        mine = both & (pairs.model_wall == letter)
        ax.plot(pairs.model_time[mine], residual[mine], "o", ms=3, mew=0, color=colour, label=letter)
    missed, spurious = np.isnan(pairs.time), np.isnan(pairs.model_time)
    for mine, times, marker, name in ((missed, pairs.model_time, "v", "missed"), (spurious, pairs.time, "x", "spurious")):
        if mine.any():
            ax.plot(times[mine], np.full(mine.sum(), edge), marker, ms=4, color=RED, label=name, ls="")
    ax.set_xlabel("time of the record")
    ax.legend(ncols=2)
    return ax


def samples(found: Estimate, ax: Axes) -> Axes:
    """Residuals of samples in their order, in standard deviations."""
    bands(found.sample_residuals, ax)
    ax.plot(found.sample_residuals, "o", ms=3, mew=0, color=BLACK)
    ax.set_xlabel("number of the sample")
    return ax


def bands(residuals: Floats, ax: Axes) -> float:
    """Bands of one and two standard deviations; where unpaired impacts are drawn, beyond all residuals."""
    edge = max(3.0, 1.1 * float(np.abs(residuals).max(initial=0.0)))
    ax.axhspan(-2, 2, color=GREY, alpha=0.12, lw=0)
    ax.axhspan(-1, 1, color=GREY, alpha=0.18, lw=0)
    ax.set_ylim(-edge * 1.1, edge * 1.1)
    ax.set_ylabel("residual, in standard deviations")
    return edge


def parameter(found: Estimate, ax: Axes, number: int = 0) -> Axes:
    """The rise of chi2 over one parameter: the parabola, and the profile where it was computed."""
    center, error, name = found.values[number], found.errors[number], found.names[number]
    values = center + error * np.linspace(-REACH, REACH, POINTS)
    ax.plot(values, ((values - center) / error) ** 2, color=BLUE, lw=1.0, label="quadratic")
    if name in found.profiles:
        ax.plot(found.profiles[name].values, found.profiles[name].chi2, "o-", ms=3, color=ORANGE, lw=0.8, label="profile")
    for level in (1.0, 4.0):
        ax.axhline(level, color=GREY, lw=0.5, ls=":")
    ax.set_ylim(0, REACH**2)
    ax.set_xlabel(label(name))
    ax.set_ylabel(r"$\chi^2$ above its minimum")
    ax.legend()
    return ax


def region(found: Estimate, ax: Axes, number: int = 0) -> Axes:
    """The regions of 68 and 95 % of two neighbouring parameters, and further minima near them."""
    k = [number, number + 1]
    values, vectors = np.linalg.eigh(found.covariance[np.ix_(k, k)])
    angle = np.linspace(0, 2 * np.pi, POINTS)
    for level, dashes in zip(LEVELS, ("-", "--"), strict=True):
        x, y = found.values[k, None] + level * (vectors * np.sqrt(np.maximum(values, 0))) @ np.array(
            [np.cos(angle), np.sin(angle)]
        )
        ax.plot(x, y, color=BLUE, lw=1.0, ls=dashes, label=f"{100 * (1 - np.exp(-(level**2) / 2)):.0f} %")
    ax.plot(*found.values[k], "+", color=BLACK, ms=6)
    ax.set_xlabel(label(found.names[number]))
    ax.set_ylabel(label(found.names[number + 1]))
    ax.legend()
    return ax
