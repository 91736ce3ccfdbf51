"""Observables over a parameter: on the attractors of a bifurcation diagram, and along branches of periodic orbits."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.figures.data import OBSERVABLES
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
    """The means of one observable over a parameter: dots with bars of two standard errors, and lines along branches."""
    found, study = OBSERVABLES.of(result, "observables"), result.study
    observable, forced = None, result.system.period() is not None
    if "bifurcation" in found and study.bifurcation is not None and study.bifurcation.parameter == parameter:
        means = found["bifurcation"]
        observable, values = means.observables[number], result.bifurcation["exact"].values
        mean = means.per_period if forced else means.per_return
        for y, error in zip(mean.value[..., number].T, mean.error[..., number].T, strict=True):
            ax.errorbar(values, y, 2 * np.nan_to_num(error), fmt=".", ms=2.5, mew=0, elinewidth=0.6, color=BLUE)
        ax.plot([], [], ".", color=BLUE, label="attractors")
    for section in study.branches:
        parts = found.get(section.name, ()) if section.parameter == parameter else ()
        branches = [branch for branch in result.branches.get(section.name, ()) if len(branch.parameter)]
        for part, branch in zip(parts, branches, strict=True):
            observable, mean = part.observables[number], part.per_period if forced else part.per_return
            ax.plot(branch.parameter, mean.value[:, number], color=ORANGE, lw=0.8, zorder=1)
    if any(section.name in found for section in study.branches):
        ax.plot([], [], color=ORANGE, label="branches")
    ax.set_xlabel(label(parameter))
    if observable is not None:
        per = "" if observable.per or observable.largest else f" per {'period' if forced else 'return'}"
        ax.set_ylabel(f"{observable.name}{f' ({observable.unit})' * bool(observable.unit)}{per}")
    ax.legend()
    return ax
