"""A sheet: panels that are laid out on one page and saved as one file, without pyplot and so without global state."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text

from nsmaps.figures.style import STYLE

LONG = 40  #: letters of a panel's title in a line, beside its letter
Panel = Callable[[Axes], Axes]


@dataclass(frozen=True, slots=True)
class Sheet:
    """Panels of one figure in rows, each drawn by a function on an Axes of its own."""

    name: str  #: of the file, without suffix
    panels: tuple[Panel, ...]
    columns: int
    panel: tuple[float, float] = (5.0, 4.0)  #: width and height of a panel, inches
    projection: str | tuple[str | None, ...] | None = None  #: "3d" for surfaces; a tuple gives one a panel
    title: str = ""

    def figure(self) -> Figure:
        """The figure with every panel drawn and lettered (a), (b), ... where there are several."""
        rows = -(-len(self.panels) // self.columns)
        size = self.panel[0] * self.columns, self.panel[1] * rows
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        for number, panel in enumerate(self.panels):
            projection = self.projection[number] if isinstance(self.projection, tuple) else self.projection
            ax = figure.add_subplot(rows, self.columns, number + 1, projection=projection)
            panel(ax)
            ax.set_title(fill(ax.get_title(), LONG))
            if len(self.panels) > 1:
                ax.set_title(f"({_letter(number)})", loc="left", fontweight="bold")
        if self.title:
            figure.suptitle(self.title, fontsize=12)
        for text in figure.findobj(Text):
            if not all(map(_is_readable, text.get_text().splitlines())):
                text.set_parse_math(False)
        return figure

    def save(self, folder: Path, formats: Sequence[str], dpi: float) -> list[Path]:
        """The files written, one a format; the figure is drawn in the style of the package and then let go."""
        paths = [folder / f"{self.name}.{suffix}" for suffix in formats]
        with matplotlib.rc_context(STYLE):  # type: ignore[arg-type]
            figure = self.figure()
            for path in paths:
                figure.savefig(path, dpi=dpi)
            figure.clear()
        return paths


def _is_readable(line: str) -> bool:
    """Whether a line of text can be set: a name such as `$\\frac{`, which is no mathematics, is drawn as it stands."""
    if not is_math_text(line):
        return True
    try:
        MathTextParser("path").parse(line)
    except (ValueError, RuntimeError):  # too deep, too
        return False
    return True


def file_of(figure: str, part: str = "") -> str:
    """The name of a sheet that shows one part of a result: of the figure alone, or with a part that is not the first.

    >>> file_of("envelopes"), file_of("envelopes", "exact from R1+")
    ('envelopes', 'envelopes-exact-from-R1+')
    """
    return f"{figure}-" + re.sub(r"[^\w.+]+", "-", part) if part else figure


def _letter(number: int) -> str:
    """a ... z, then aa, ab, ..."""
    high, low = divmod(number, 26)
    return (_letter(high - 1) if high else "") + chr(ord("a") + low)
