"""The legend of a sheet: those of its panels as one, with what signs in the names of motions mean."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, cast

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from nsmaps.exact.words import CHATTER, REST

_FREE = 0.98  #: of the width of a page that a legend takes at most
_BELOW_SPACE = 0.1  #: sizes of type by which a legend is lifted from the lower edge below panels in space
_SIGNS = {CHATTER: "chatter", REST: "rest"}  #: behind the letters of walls in words, and what they stand for
_GLYPHS = {CHATTER: r"$\sim$", REST: r"$\_$"}
_WORD = re.compile(rf"[A-Z{CHATTER}{REST}]*[A-Z][{CHATTER}{REST}][A-Z{CHATTER}{REST}]*(?![\w.])")


def one_legend(figure: Figure, free: Bbox | None) -> None:
    """The legends of all panels as one: in what is left free of the figure, if it fits, else below all panels.

    It has as many columns as there is room for; below the panels the figure grows by its height.
    """
    entries: dict[str, Any] = {}
    for ax in figure.axes:
        own = ax.get_legend()
        if own is not None:
            place = len(entries)
            for text, handle in zip(own.get_texts(), own.legend_handles, strict=True):
                name = text.get_text()
                if name not in entries:  # behind what it follows in its own panel
                    kept = list(entries.items())
                    entries = dict([*kept[:place], (name, handle), *kept[place:]])
                place = list(entries).index(name) + 1
            own.remove()
    entries |= {
        text: _sign(sign, text) for sign, text in _SIGNS.items() if any(_has(sign, each) for each in _texts(figure, entries))
    }
    if not entries:
        return
    if free is not None:
        inside = _widest(figure, entries, free.width, loc="center", bbox_to_anchor=free)
        if inside.height <= free.height * figure.bbox.height:
            return
        figure.legends.pop()
    width, height = figure.get_size_inches()
    pad = _BELOW_SPACE if any(ax.name == "3d" for ax in figure.axes) else None  # whose names move while they are drawn
    below = _widest(figure, entries, 1.0, loc="outside lower center", borderaxespad=pad)
    figure.set_size_inches(width, height + below.height / figure.dpi)


def _widest(figure: Figure, entries: Mapping[str, Any], share: float, **place: Any) -> Bbox:
    """A legend in as many columns as fit into a share of the width of the figure; its box in pixels."""
    renderer, names = cast(Any, figure.canvas).get_renderer(), list(entries)
    for columns in range(len(entries), 0, -1):
        ordered = [name for column in range(columns) for name in names[column::columns]]  # to be read row by row
        handles = [entries[name] for name in ordered]
        legend = figure.legend(handles, ordered, ncols=columns, frameon=False, columnspacing=1.4, **place)
        box: Bbox = legend.get_window_extent(renderer)
        if box.width <= _FREE * share * figure.bbox.width or columns == 1:
            break
        legend.remove()
    return box


def _texts(figure: Figure, entries: Mapping[str, Any]) -> Iterator[str]:
    """What is written in panels, above them, and in the legend."""
    yield from entries
    for ax in figure.axes:
        yield from (text.get_text() for text in (*ax.texts, ax.title))


def _has(sign: str, text: str) -> bool:
    """Whether a text begins with a word, or a name of a motion, that has this sign."""
    found = _WORD.match(text)
    return found is not None and sign in found[0]


def _sign(sign: str, text: str) -> Line2D:
    """The entry of the legend for a sign."""
    return Line2D([], [], ls="", marker=_GLYPHS[sign], ms=5, mew=0.3, color="black", label=text)
