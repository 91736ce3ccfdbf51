"""The picture of one result: the whole figure, or one panel on an Axes of the caller's."""

from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from nsmaps.errors import NsmapsError
from nsmaps.figures.page import COLUMN, lay_out
from nsmaps.figures.style import drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nsmaps.figures.page import Sheet
    from nsmaps.results import Result

SCREEN = 150.0  #: dots per inch in a notebook


class Picture(Figure):
    """A figure that belongs to no window, and that a notebook displays."""

    def _repr_png_(self) -> bytes:
        """The picture as a notebook shows it."""
        content = BytesIO()
        self.savefig(content, format="png", dpi=SCREEN)
        return content.getvalue()


def plot(
    result: "Result", ax: "Axes | None" = None, *, width: float = COLUMN, style: str = "", **options: Any
) -> "Axes | Figure":
    """The picture of a result of a class with a `picture`; see `nsmaps.results.Result.plot`."""
    cells = getattr(result, "cells", None)
    if cells is not None and len(cells.shape) != 2:
        raise NsmapsError(f"cells in {len(cells.shape)} coordinates have no picture; expected: those of a map of two coordinates")
    module = import_module(result.picture)
    with drawing(getattr(result, "units", {}), style):
        if ax is not None:
            panel = getattr(module, result.picture.rpartition(".")[2])
            return panel(result, ax, **options)
        sheets: tuple[Sheet, ...] = module.sheets(result, **options)
        if not sheets:
            raise NsmapsError(f"this {type(result).__name__} has nothing that can be drawn; expected: a result that is not empty")
        figure = sheets[0].figure(width=width, kind=Picture)
        lay_out(figure)
        return figure
