"""Observables over a parameter: on the attractors of a bifurcation diagram, and along branches of periodic orbits."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TypeAlias

import numpy as np
from matplotlib.axes import Axes

from nsmaps.arrays import Bools, Floats
from nsmaps.dynamics.observables.cycles import CycleMeans
from nsmaps.dynamics.observables.means import Means
from nsmaps.errors import NsmapsError
from nsmaps.figures.lines import neighbours
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, ORANGE, label

Found: TypeAlias = Means | Mapping[str, Means | Sequence[Means]]  #: means, or those of a diagram and of branches by name


def sheets(found: Found) -> tuple[Sheet, ...]:
    """One sheet a parameter, a panel an observable; NsmapsError for means without a parameter."""
    parameters = list(dict.fromkeys(each.parameter for each in _along(found)))
    several = len(parameters) > 1
    return tuple(_sheet(found, parameter, f"observe-{parameter}" if several else "observe") for parameter in parameters)


def _sheet(found: Found, parameter: str, name: str) -> Sheet:
    count = len(_along(found, parameter)[0].names)
    panels = tuple(partial(observe, found, parameter=parameter, number=k) for k in range(count))
    return Sheet(name, panels, min(count, 2), legend=True)


def _along(found: Found, parameter: str = "") -> list[Means]:
    """The means over a parameter, or over any."""
    parts = [found] if isinstance(found, Means) else list(found.values())
    every = [each for part in parts for each in ([part] if isinstance(part, Means) else part)]
    kept = [each for each in every if each.values is not None and parameter in ("", each.parameter)]
    if not kept:
        raise NsmapsError("these means are not over a parameter; expected: those of a bifurcation diagram or of a branch")
    return kept


def observe(found: Found, ax: Axes, parameter: str = "", number: int = 0) -> Axes:
    """The means of one observable over a parameter: dots with bars of two standard errors, and lines along branches.

    Lines are dashed where the periodic orbits are not stable.
    """
    kept = _along(found, parameter)
    for each in kept:
        values, (_, mean) = np.asarray(each.values), each.shown
        if isinstance(each, CycleMeans):
            _lines(ax, values, mean.value[:, number], np.asarray(each.stable))
            continue
        for y, error in zip(mean.value[..., number].T, mean.error[..., number].T, strict=True):
            ax.errorbar(values, y, 2 * np.nan_to_num(error), fmt=".", ms=2.5, mew=0, elinewidth=0.6, color=BLUE)
        ax.plot([], [], ".", color=BLUE, label="attractors")
    observable, per = kept[0].observables[number], kept[0].shown[0]
    unit, how = f" ({observable.unit})" * bool(observable.unit), "" if observable.per or observable.largest else f" {per}"
    ax.set_xlabel(label(kept[0].parameter))
    ax.set_ylabel(f"{observable.name}{unit}{how}")
    handles, names = ax.get_legend_handles_labels()
    ax.legend(*zip(*{name: (handle, name) for handle, name in zip(handles, names, strict=True)}.values(), strict=True))
    return ax


def _lines(ax: Axes, values: Floats, means: Floats, stable: Bools) -> None:
    """The means along a branch, dashed where its orbits are not stable."""
    beside = neighbours(~stable)
    for own, dashes, name in ((stable, "-", "stable"), (beside, (0, (3, 1.6)), "unstable")):
        if own.any():
            ax.plot(values, np.where(own, means, np.nan), ls=dashes, color=ORANGE, lw=0.8, zorder=1, label=name)
