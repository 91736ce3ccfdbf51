"""Observables over a parameter: on the attractors of a bifurcation diagram, and along branches of periodic orbits."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Bools, Floats
from nsmaps.figures.data import OBSERVABLES
from nsmaps.figures.lines import neighbours
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, ORANGE, label

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet a parameter, a panel an observable."""
    found, study = OBSERVABLES.of(result, "observables"), result.study
    swept = [study.bifurcation.parameter] if "bifurcation" in found and study.bifurcation is not None else []
    followed = [each.parameter for each in study.branches if each.name in found]
    parameters = list(dict.fromkeys([*swept, *followed]))
    several = len(parameters) > 1
    return tuple(_sheet(result, parameter, f"observables-{parameter}" if several else "observables") for parameter in parameters)


def _sheet(result: "StudyResult", parameter: str, name: str) -> Sheet:
    first = next(iter(OBSERVABLES.of(result, "observables").values()))
    names = (first[0] if isinstance(first, tuple) else first).names
    panels = tuple(partial(observables, result, parameter=parameter, number=k) for k in range(len(names)))
    return Sheet(name, panels, min(len(names), 2), legend=True)


def observables(result: "StudyResult", ax: Axes, parameter: str = "", number: int = 0) -> Axes:
    """The means of one observable over a parameter: dots with bars of two standard errors, and lines along branches.

    Lines are dashed where the periodic orbits are not stable.
    """
    found, study = OBSERVABLES.of(result, "observables"), result.study
    observable, forced = None, result.system.period() is not None
    if "bifurcation" in found and study.bifurcation is not None and study.bifurcation.parameter == parameter:
        means = found["bifurcation"]
        observable, values = means.observables[number], result.bifurcation["exact"].values
        mean = means.per_period if forced else means.per_return
        for y, error in zip(mean.value[..., number].T, mean.error[..., number].T, strict=True):
            ax.errorbar(values, y, 2 * np.nan_to_num(error), fmt=".", ms=2.5, mew=0, elinewidth=0.6, color=BLUE)
        ax.plot([], [], ".", color=BLUE, label="attractors")
    for section in [each for each in study.branches if each.name in found and each.parameter == parameter]:
        branches = [branch for branch in result.branches[section.name] if len(branch.values)]
        for part, branch in zip(found[section.name], branches, strict=True):
            observable, slope = part.observables[number], part.per_period if forced else part.per_return
            _lines(ax, branch.values, slope.value[:, number], np.array([stable is True for stable in branch.stable]))
    ax.set_xlabel(label(parameter))
    if observable is not None:
        per = "" if observable.per or observable.largest else f" per {'period' if forced else 'return'}"
        ax.set_ylabel(f"{observable.name}{f' ({observable.unit})' * bool(observable.unit)}{per}")
    handles, names = ax.get_legend_handles_labels()
    ax.legend(*zip(*{name: (handle, name) for handle, name in zip(handles, names, strict=True)}.values(), strict=True))
    return ax


def _lines(ax: Axes, values: Floats, means: Floats, stable: Bools) -> None:
    """The means along a branch, dashed where its orbits are not stable."""
    beside = neighbours(~stable)
    for own, dashes, name in ((stable, "-", "stable"), (beside, (0, (3, 1.6)), "unstable")):
        if own.any():
            ax.plot(values, np.where(own, means, np.nan), ls=dashes, color=ORANGE, lw=0.8, zorder=1, label=name)
