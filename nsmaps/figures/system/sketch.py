"""The system drawn, by the package that gives it: fig. model:abc, panel (a)."""

from collections.abc import Callable
from functools import partial

from matplotlib.axes import Axes

from nsmaps.figures.page import Sheet


def sheets(drawing: Callable[[Axes], Axes]) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("sketch", (partial(sketch, drawing),), 1, 0.78, share=0.6),)


def sketch(drawing: Callable[[Axes], Axes], ax: Axes) -> Axes:
    """The drawing that a package offers of the study's system (`nsmaps.plugins.sketch_of`)."""
    return drawing(ax)
