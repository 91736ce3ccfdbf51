"""A system at a glance: its drawing, a diagram, the motion on an attractor and basins on one page, small enough for a list."""

from collections.abc import Sequence
from functools import partial

from matplotlib.axes import Axes

from nsmaps.figures.page import Panel, Sheet


def sheets(panels: Sequence[Panel]) -> tuple[Sheet, ...]:
    """One sheet of the panels in two columns, such as `[diagram.plot, portrait.plot, basins.plot]` of results."""
    return (Sheet("summary", tuple(partial(summary, panel) for panel in panels), 2, 0.85, legend=True),)


def summary(panel: Panel, ax: Axes) -> Axes:
    """One panel with a label of its parameter."""
    panel(ax)
    ax.xaxis.label.set_visible(True)
    ax.tick_params(labelbottom=True)
    return ax
