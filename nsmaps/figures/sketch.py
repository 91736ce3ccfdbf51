"""The system drawn, by the package that gives it: fig. model:abc, panel (a)."""

from functools import partial

from matplotlib.axes import Axes

from nsmaps.figures.needs import Drawable
from nsmaps.figures.sheet import Sheet
from nsmaps.plugins import sketch_of


def sheets(result: Drawable) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    sketch_of(result.study.system)
    return (Sheet("sketch", (partial(sketch, result),), 1, (6.4, 5.0)),)


def sketch(result: Drawable, ax: Axes) -> Axes:
    """The drawing that a package offers of the study's system (`nsmaps.plugins.sketch_of`)."""
    return sketch_of(result.study.system)(ax)
