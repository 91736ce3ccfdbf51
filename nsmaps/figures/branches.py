"""Branches of periodic orbits over a parameter: stable and unstable parts, with the events on them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Angle
from nsmaps.figures.lines import cut
from nsmaps.figures.style import BLACK, BLUE, GREEN, MAGENTA, ORANGE, RED, SKY, dress

if TYPE_CHECKING:
    from nsmaps.dynamics.branch import Branch

_COLOURS = (BLUE, ORANGE, GREEN, MAGENTA, SKY, RED, BLACK)
_MARKERS = {
    "period doubling": "o",
    "period halving": "o",
    "fold": "s",
    "branch point": "P",
    "Neimark-Sacker": "^",
    "grazing": "X",
    "end of the valid domain": "|",
}


def branches(made: "Sequence[Branch]", ax: Axes, coordinate: int = 0, parameter: str = "") -> Axes:
    """One coordinate of all states of cycles over the parameter: a colour a motion, lines dashed where it is unstable.

    Raises:
        NsmapsError: there is no branch with orbits.
    """
    shown = [branch for branch in made if len(branch.orbits)]
    if not shown:
        raise NsmapsError("there is no branch with orbits; accepted: at least one")
    name = shown[0].orbits[0].returns.coordinates[coordinate]
    motions = list(dict.fromkeys(str(branch.labels[-1]) for branch in shown))
    colours = {motion: _COLOURS[k % len(_COLOURS)] for k, motion in enumerate(motions)}
    for branch in shown:
        for k in range(branch.points.shape[1]):
            path = branch.points[:, k, coordinate]
            for keep, dashes in ((branch.stable, "-"), (_neighbours(~branch.stable), "--")):
                line = np.where(keep, path, np.nan)
                line = cut(line, np.pi) if isinstance(name, Angle) else line
                ax.plot(branch.parameter, line, dashes, color=colours[str(branch.labels[-1])])
        for event in branch.events:
            places = event.orbit.states[:, coordinate]
            ax.plot(np.full(len(places), event.parameter), places, _MARKERS[event.kind], color=BLACK, mfc="white", ms=6)
    kinds = dict.fromkeys(event.kind for branch in shown for event in branch.events)
    handles = [Line2D([], [], color=colours[motion], label=motion) for motion in motions]
    handles += [Line2D([], [], color=BLACK, marker=_MARKERS[kind], mfc="white", ls="", label=kind) for kind in kinds]
    handles.append(Line2D([], [], color="0.4", ls="--", label="unstable"))
    ax.legend(handles=handles, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return dress(ax, (parameter, ""), (name, "k"))


def _neighbours(keep: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A mask with the places next to those it keeps."""
    return np.convolve(keep, np.ones(3), "same") > 0
