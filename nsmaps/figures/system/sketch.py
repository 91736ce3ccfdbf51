"""The system drawn, by the package that gives it: fig. model:abc, panel (a)."""

from functools import partial
from typing import TYPE_CHECKING

from matplotlib.axes import Axes

from nsmaps.figures.page import Sheet
from nsmaps.plugins import sketch_of

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("sketch", (partial(sketch, result),), 1, 0.78, share=0.6),)


def sketch(result: "StudyResult", ax: Axes) -> Axes:
    """The drawing that a package offers of the study's system (`nsmaps.plugins.sketch_of`)."""
    return sketch_of(result.study.system)(ax)
