"""Branches of periodic orbits over a parameter: stable and unstable parts, with the events on them."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from nsmaps.errors import NsmapsError
from nsmaps.figures.data import BRANCHES
from nsmaps.figures.lines import cut
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, BLUE, GREEN, MAGENTA, ORANGE, RED, SKY, dress

if TYPE_CHECKING:
    from nsmaps.dynamics.continuation.branch import Branch
    from nsmaps.study.result import StudyResult

_COLOURS = (BLUE, ORANGE, GREEN, MAGENTA, SKY, RED, BLACK)
_LOOKS = {True: ("-", ""), False: ("--", "unstable"), None: (":", "of unknown stability")}  #: line and legend, by stability
_MARKERS = {
    "period doubling": "o",
    "period halving": "o",
    "fold": "s",
    "branch point": "P",
    "Neimark-Sacker": "^",
    "grazing": "X",
    "border collision": "D",
    "end of the valid domain": "|",
}


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet a parameter, a panel a coordinate; none of a parameter in which no start led to an orbit."""
    found = BRANCHES.of(result, "branches")
    along: dict[str, list[Branch]] = {}
    for each in result.study.branches:
        along.setdefault(each.parameter, []).extend(branch for branch in found[each.name] if len(branch.parameter))
    sheets = []
    for parameter, own in along.items():
        last = len(own[0].returns.coordinates) - 1 if own else -1
        panels = tuple(partial(branches, own, coordinate=i, parameter=parameter, legend=i == last) for i in range(last + 1))
        name = "branches" if len(along) == 1 else f"branches-{parameter}"
        sheets += [Sheet(name, panels, len(panels), 0.81)] if own else []
    return tuple(sheets)


def branches(found: "Sequence[Branch]", ax: Axes, coordinate: int = 0, parameter: str = "", legend: bool = True) -> Axes:
    """One coordinate of all states of cycles over the parameter: a colour a motion, lines dashed where it is unstable.

    Lines and marks are finer for longer periods. `legend` is False if a neighbouring panel has it.

    Raises:
        NsmapsError: there is no branch with orbits.
    """
    shown = [branch for branch in found if len(branch.parameter)]
    if not shown:
        raise NsmapsError("there is no branch with orbits; expected: at least one")
    motions = list(dict.fromkeys(str(branch.labels[-1]) for branch in shown))
    colours = {motion: _COLOURS[k % len(_COLOURS)] for k, motion in enumerate(motions)}
    for branch in shown:
        _lines(branch, ax, coordinate, colours[str(branch.labels[-1])])
    for branch in shown:
        for event in branch.events:
            places = event.orbit.states[:, coordinate]
            look = {"color": BLACK, "mfc": "white", "ms": 6.5 * _fineness(len(places)), "mew": 1.1 * _fineness(len(places))}
            ax.plot(np.full(len(places), event.parameter), places, _MARKERS[event.kind], **look)  # type: ignore[arg-type]
    if legend:
        kinds = dict.fromkeys(event.kind for branch in shown for event in branch.events)
        handles = [Line2D([], [], color=colours[motion], label=motion) for motion in motions]
        handles += [Line2D([], [], color=BLACK, marker=_MARKERS[kind], mfc="white", ls="", label=kind) for kind in kinds]
        stability = {False, *(stable for branch in shown for stable in branch.stable)}
        handles += [
            Line2D([], [], color="0.4", ls=ls, label=label)
            for stable, (ls, label) in _LOOKS.items()
            if label and stable in stability
        ]
        ax.legend(handles=handles, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return dress(ax, (parameter, ""), (shown[0].returns.coordinates[coordinate], "k"))


def _lines(branch: "Branch", ax: Axes, coordinate: int, colour: str) -> None:
    """A line for each state of the cycle, solid where it is stable, dashed where it is not, dotted where that is unknown."""
    for path in branch.points[..., coordinate].T:
        for stable, (dashes, _) in _LOOKS.items():
            own = np.array([each is stable for each in branch.stable], bool)
            chosen = own if stable else _neighbours(own)
            line = np.where(chosen, path, np.nan)
            line = cut(line, np.pi) if branch.returns.coordinates.angles[coordinate] else line
            ax.plot(branch.parameter, line, dashes, color=colour, lw=1.1 * _fineness(branch.period))


def _fineness(period: int) -> float:
    """How much of its size a line or mark has that stands beside so many others."""
    return float(period**-0.4)


def _neighbours(chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A mask with the places next to those it keeps."""
    return np.convolve(chosen, np.ones(3), "same") > 0
