"""A sheet: panels that are laid out on one page and saved as one file, without pyplot and so without global state."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any, Literal, cast

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Text
from matplotlib.ticker import AutoLocator, MaxNLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from nsmaps.figures.grey import alike_in_grey, in_grey
from nsmaps.figures.legend import one_legend
from nsmaps.figures.png import write_png
from nsmaps.figures.style import SIZE, extent_of, noted, settings
from nsmaps.files.storage import file_part

_PARSER = RendererAgg(1, 1, 72).mathtext_parser  # type: ignore[no-untyped-call]  # as renderers of pixels have it
_TALL = 1.5  #: times the height of a panel: what stands around it is then higher than it, such as a legend
_NARROW = 2.2  #: inches, the least width of a panel on a page that is narrower
_FLATTER = 0.75  #: of the height of panels that stand one below the other for want of width
COLUMN = 5.1  #: inches, the width of a page's text in a journal of applied mathematics
_TITLE = 13  #: letters of the title of a sheet in an inch of its width
_BESIDE, _APART = 0.5, 0.2  #: inches, beside a panel, and of its letter with the space behind it
_AFTER = 0.06  #: inches between a letter and a title behind it
_TICKS = 6  #: of an axis that has no ticks of its own, at most
GREY = "grey-"  #: before the names of files without colour
Panel = Callable[[Axes], Axes]


@dataclass(frozen=True, slots=True)
class Sheet:
    """Panels of one figure in rows, each drawn by a function on an Axes of its own."""

    name: str  #: of the file, without suffix
    panels: tuple[Panel, ...]
    columns: int
    ratio: float = 0.8  #: the height of a panel with all around it, as a share of its width
    projection: str | tuple[str | None, ...] | None = None  #: "3d" for surfaces; a tuple gives one a panel
    title: str = ""
    legend: bool = False  #: whether the legends of all panels are drawn as one, below them
    share: float = 1.0  #: of the width of a page that the figure takes
    tall: float = 0.0  #: inches, the least height of a panel with all around it
    letters: str = ""  #: one a panel, a blank for none; a, b, c, ... of several panels, if empty

    def figure(self, dpi: float | None = None, width: float = COLUMN, kind: type[Figure] = Figure) -> Figure:
        """The figure with every panel drawn and lettered; `width` in inches.

        Type has the same size at every width, and panels take what it leaves; on a narrow page they stand one below the other.
        """
        columns = self.columns if width >= COLUMN else max(1, min(self.columns, int(width / _NARROW)))
        rows, each = -(-len(self.panels) // columns), self.share * width / columns
        high = max(self.ratio * each * (_FLATTER if columns < self.columns else 1.0), self.tall)
        figure = kind(figsize=(columns * each, rows * high), dpi=dpi, layout="constrained")
        FigureCanvasAgg(figure)
        for number, panel in enumerate(self.panels):
            projection = self.projection[number] if isinstance(self.projection, tuple) else self.projection
            ax = figure.add_subplot(rows, columns, number + 1, projection=projection)
            panel(ax)
            letter, raised = self._letter(number), cast(Any, ax).titleOffsetTrans.transform((0.0, 0.0))[1]
            pad = raised * 72 / figure.dpi  # as the panel set it
            _entitle(ax, letter, each, pad)
            ax.title.set_y(1.0)  # which axes in space lower, into the picture
        if self.title and not noted(self.title):
            figure.suptitle(fill(self.title, int(_TITLE * self.share * width)) or " ")
        _as_it_stands(figure)
        if self.legend:
            one_legend(figure, Bbox([[1 - 1 / columns, 0], [1, 1 / rows]]) if len(self.panels) < rows * columns else None)
            _renderer(figure)  # another one, if the size is new
        return figure

    def _letter(self, number: int) -> str:
        """The letter of a panel, empty for none."""
        if self.letters:
            return self.letters[number].strip()
        return _letter(number) if len(self.panels) > 1 else ""

    def save(self, folder: Path, formats: Sequence[str], dpi: float, width: float = COLUMN, grey: bool = False) -> list[Path]:
        """The files written, one a format, `width` inches wide; the figure is drawn in the style of the package, and let go.

        With `grey` also a PNG without colour, and a text with the entries of the legend that then look alike, if there are any.
        """
        paths = [folder / f"{self.name}.{suffix}" for suffix in formats]
        with matplotlib.rc_context(settings()):  # type: ignore[arg-type]
            figure = self.figure(dpi, width)
            lay_out(figure)
            for path in paths:
                if path.suffix == ".png":
                    write_png(path, _pixels(figure), dpi)
                else:
                    figure.savefig(path, dpi=dpi)
            return [*paths, *_without_colour(figure, folder / f"{GREY}{self.name}", dpi)] if grey else paths


def _without_colour(figure: Figure, stem: Path, dpi: float) -> Iterator[Path]:
    """The files of a figure in grey."""
    write_png(stem.with_name(f"{stem.name}.png"), in_grey(_pixels(figure)), dpi)
    yield stem.with_name(f"{stem.name}.png")
    if pairs := alike_in_grey(figure):
        lines = [f"{pair.one!r} and {pair.other!r} differ by {pair.difference:.1f} of 100 in lightness" for pair in pairs]
        stem.with_name(f"{stem.name}.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
        yield stem.with_name(f"{stem.name}.txt")


def _entitle(ax: Axes, letter: str, width: float, pad: float) -> None:
    """The letter of a panel, `width` inches wide with all around it, and its title, in the middle or, if it fits there, right.

    A title that is longer is broken into lines.
    """
    sides: tuple[Literal["center", "right"], ...] = ("center", "right")
    for side in sides:
        title, place = ax.get_title(side), side
        if title and noted(f"({letter}) {title}" if letter else title):
            title = ""
        if title:
            own, free = _inches(title), width - _BESIDE - (_inches(letter) + _APART if letter else 0.0)
            place = "right" if letter and own > free - _inches(letter) - _APART else side
            parts = title.replace(": ", ":\n", 1)
            title = title if own <= free else parts if _inches(parts) <= free else fill(title, int(len(title) * free / own))
        ax.set_title("", loc=side)
        ax.set_title(title, loc=place, pad=pad)
    if letter:
        ax.set_title(f"({letter})", loc="left", fontweight="bold", pad=pad)


def _inches(text: str) -> float:
    """The width of a text; of one that is not mathematics, as many letters as it has."""
    try:
        return extent_of(text)[0] / 72
    except (ValueError, RecursionError):
        return len(text) * SIZE / 100


def _renderer(figure: Figure) -> Any:
    """What draws the figure at its size, with the one parser of mathematics."""
    renderer = cast(Any, figure.canvas).get_renderer()
    renderer.mathtext_parser = _PARSER
    return renderer


def _pixels(figure: Figure) -> NDArray[np.uint8]:
    """The figure drawn, shape (height, width, 4)."""
    canvas = cast(Any, figure.canvas)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


def lay_out(figure: Figure) -> None:
    """Place the panels, once: with an engine in it every save would measure, place and draw all of the figure before it draws."""
    engine = figure.get_layout_engine()
    if engine is not None:
        for ax in figure.axes:
            if ax.name == "3d":  # it places its names while it is drawn, and only then can measure them
                renderer = cast(Any, figure.canvas).get_renderer()
                with renderer._draw_disabled(), _hidden([each for each in ax.collections if each.get_visible()]):
                    ax.draw(renderer)
        with _measured_once(figure):
            engine.execute(figure)
        figure.set_layout_engine(None)
        _separate_titles(figure)


def _separate_titles(figure: Figure) -> None:
    """Move a title that would touch the letter of its panel, which is as narrow as it is placed, to behind the letter."""
    renderer, gap = cast(Any, figure.canvas).get_renderer(), _AFTER * figure.dpi
    for ax in figure.axes:
        letter, title = cast(Any, ax)._left_title, ax.title
        if letter.get_text() and title.get_text():
            end = letter.get_window_extent(renderer).x1 + gap
            if title.get_window_extent(renderer).x0 < end:
                title.set_horizontalalignment("left")
                title.set_x(ax.transAxes.inverted().transform((end, 0.0))[0])


@contextmanager
def _hidden(artists: Sequence[Artist]) -> Iterator[None]:
    """While names are placed, which surfaces do not move, these are not projected and sorted."""
    for each in artists:
        each.set_visible(False)
    try:
        yield
    finally:
        for each in artists:
            each.set_visible(True)


@contextmanager
def _measured_once(figure: Figure) -> Iterator[None]:
    """While the panels are placed, in two rounds, those are measured in the first alone whose surroundings keep their size.

    Outside of a panel only the marks of ticks pass its frame, and they end before the names of the ticks.
    """
    plain = [ax for ax in figure.axes if ax.name == "rectilinear" and ax.get_aspect() == "auto" and not ax.child_axes]
    free = [ax for ax in plain if ax.get_box_aspect() is None]  # as bars of colours have, narrower than their place
    for ax in free:
        for spine in ax.spines.values():
            spine.set_in_layout(False)
        for axis in (ax.xaxis, ax.yaxis):
            if isinstance(axis.get_major_locator(), AutoLocator):  # with the panel its ticks, and their names, become others
                axis.set_major_locator(MaxNLocator(_TICKS, steps=[1, 2, 5, 10]))
        vars(ax)["get_tightbbox"] = _remembered(ax)
    try:
        yield
    finally:
        for ax in free:
            del vars(ax)["get_tightbbox"]


def _remembered(ax: Axes) -> Callable[..., Bbox | None]:
    """The function that measures an Axes with all around it, which later adds what it found around it to where it is then."""
    measure, around = ax.get_tightbbox, list[NDArray[np.float64]]()

    def measured(renderer: Any, **options: Any) -> Bbox | None:
        """The box of the panel and of all around it, pixels."""
        place = ax.get_position(original=True).transformed(cast(Figure, ax.figure).transFigure).extents
        if not around:
            whole = measure(renderer, **options)
            if whole is None or whole.height > _TALL * ax.bbox.height:
                return whole
            around.append(np.subtract(whole.extents, place))
        return Bbox.from_extents(*(place + around[0]))

    return measured


def _as_it_stands(figure: Figure) -> None:
    r"""Draw a name such as `$\frac{`, which is not mathematics, literally.

    What is parsed here is what will be drawn, by one parser for all figures, which remembers it.
    """
    _renderer(figure)
    for text in figure.findobj(Text):
        font = text.get_fontproperties()
        if not all(_is_readable(line, figure.dpi, font) for line in text.get_text().splitlines()):
            text.set_parse_math(False)


def _is_readable(line: str, dpi: float, font: FontProperties) -> bool:
    """Whether a line of text can be set."""
    if not is_math_text(line):
        return True
    try:
        _PARSER.parse(line, dpi, font)
    except (ValueError, RuntimeError):  # too deep, too
        return False
    return True


def file_of(figure: str, part: str = "") -> str:
    """The name of a sheet that shows one part of a result: of the figure alone, or with a part that is not the first.

    >>> file_of("envelopes"), file_of("envelopes", "exact from R1+")
    ('envelopes', 'envelopes-exact-from-R1+')
    """
    return f"{figure}-{file_part(part)}" if part else figure


def _letter(number: int) -> str:
    """a ... z, then aa, ab, ..."""
    high, low = divmod(number, 26)
    return (_letter(high - 1) if high else "") + chr(ord("a") + low)
