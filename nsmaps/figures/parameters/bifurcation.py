"""Bifurcation diagrams: figs. bifexact and bifapprox, a panel for each coordinate, the maps beside each other."""

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

from nsmaps.arrays import Floats, Ints
from nsmaps.dynamics.motion import CHAOS, kind_of
from nsmaps.exact.words import CHATTER, LONGER, REST, words_of
from nsmaps.figures.lines import window
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import GREY, dress, family_colours

if TYPE_CHECKING:
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, Border

    Diagrams = Mapping[str, BifurcationDiagram]

Named = tuple[str, float, float]  #: a motion, and the interval of the parameter over which it attracts
ROWS = 400  #: of a raster
MOST = 4096  #: columns of a raster, where values are not equidistant
_LETTER, _LINE = 0.065, 0.15  #: inches that a letter and a line of the name of a motion need
_REACH = 1  #: rows on either side to which a state belongs: lines of half a point
_FAINTEST = 0.45  #: opacity of a place that one state of an orbit visits
_TICK = 0.2  #: inches from one tick to the next at least
_UPRIGHT = 8  #: letters of the longest name that is written upwards
_MARGIN = 0.04  #: of the height of the states that is left free above and below them


def sheets(result: "BifurcationDiagram | Diagrams") -> tuple[Sheet, ...]:
    """One sheet: a row a map, a column a coordinate; `result` as of `bifurcation`."""
    diagrams = _by_title(result)
    coordinates = range(len(next(iter(diagrams.values())).coordinates))
    panels = tuple(partial(bifurcation, diagrams, of=of, coordinate=i) for of in diagrams for i in coordinates)
    return (Sheet("bifurcation", panels, min(len(coordinates), 2), 0.8, legend=True),)


def bifurcation(result: "BifurcationDiagram | Diagrams", ax: Axes, of: str = "", coordinate: int = 0) -> Axes:
    """One coordinate of the attractors over the parameter: a colour for the word of the return to each state, further words grey.

    The darker a place, the more of the states kept at a value lie there. The widest windows of the first orbit are named above,
    between lines at their computed borders, where these are known to the distance of neighbouring values; grey bands: values
    without an attractor. All maps have the same limits, and a motion of a fitted map has the name of that of the exact one
    with the same impacts and period in returns.

    Args:
        result: one diagram, or those of several maps by the titles of these.
        of: the title of the map, the first one if empty.
    """
    diagrams = _by_title(result)
    of = of or next(iter(diagrams))
    diagram, ends = diagrams[of], _range(diagrams, coordinate)
    colours = _colours(diagrams)
    ax.set_xlim(float(diagram.values.min()), float(diagram.values.max()))
    if ends is None:
        ax.text(0.5, 0.5, "no attractor", transform=ax.transAxes, ha="center")
    else:
        image, beside = raster(diagram, coordinate, ends, colours)
        ax.imshow(image, extent=(*beside, *ends), origin="lower", aspect="auto", interpolation="antialiased", zorder=0)
        ax.set_xlim(float(diagram.values.min()), float(diagram.values.max()))
        ax.set_ylim(ends)
        _legend(ax, colours)
    for low, high in _gaps(diagram):
        ax.axvspan(low, high, color="0.92", lw=0)
    ax.set_title(of, loc="right")
    dress(ax, (diagram.parameter, ""), (diagram.coordinates[coordinate], "k"))
    if ends is not None:
        borders = [end for each in diagram.windows for end in (each.low, each.high)]
        for border in dict.fromkeys(end.value for end in borders if is_sharp(end, diagram)):
            ax.axvline(border, color="0.6", lw=0.4)
        named = {each: _motions(diagrams, each) for each in diagrams}
        tall = max(_height(ax, each) for each in named.values())  # the same for all maps, so that their states are comparable
        _name_motions(ax, named[of])
        ticks = [tick for tick in ax.get_yticks() if ends[0] <= tick <= ends[1]]  # none beside the names
        many = len(ticks) * _TICK * (1 + tall) * ax.figure.dpi / ax.bbox.height
        ax.set_yticks(ticks[:: max(ceil(many), 1)])
        ax.set_ylim(ends[0], ends[1] + tall * (ends[1] - ends[0]))
    return ax


def _by_title(result: "BifurcationDiagram | Diagrams") -> "Diagrams":
    return result if isinstance(result, Mapping) else {"": result}


def _motions(diagrams: "Diagrams", of: str) -> list[Named]:
    """The windows of a map and its chaotic regions between them."""
    windows = _named(diagrams, of)
    return [*windows, *_chaotic(diagrams[of], windows)]


def _named(diagrams: "Diagrams", of: str) -> list[Named]:
    """The windows of a map, each to its borders or, where these are not sharp, to the values at which it was seen."""
    diagram = diagrams[of]
    all_windows = [window for each in diagrams.values() for window in each.windows]
    names = {window.by_returns: window.label for window in all_windows if window.label != window.by_returns}
    found = []
    for each in diagram.windows:
        borders = zip((each.low, each.high), each.seen, strict=True)
        low, high = (border.value if is_sharp(border, diagram) else seen for border, seen in borders)
        name = each.label if each.label != each.by_returns else names.get(each.by_returns, each.label)
        found.append((name, low, high))
    return found


def is_sharp(border: "Border", diagram: "BifurcationDiagram") -> bool:
    """True if a border is known to the mean distance of neighbouring values; others say less than the states that are drawn."""
    return bool(border.precision <= np.ptp(diagram.values) / (len(diagram.values) - 1))


def _chaotic(diagram: "BifurcationDiagram", windows: Sequence[Named]) -> list[Named]:
    """The intervals between windows at most of whose values the first orbit is chaotic, with the name that most of these have.

    They are chaotic regions that are cut by windows too narrow to have borders.
    """
    ends = [float(diagram.values.min()), *(end for _, *window in windows for end in window), float(diagram.values.max())]
    found = []
    for low, high in zip(ends[::2], ends[1::2], strict=True):
        names = diagram.labels[(diagram.values >= low) & (diagram.values <= high), 0].tolist()
        (name, count), *_ = [*Counter(name for name in names if kind_of(name) == CHAOS).most_common(1), ("", 0)]
        if high > low and 2 * count > len(names):
            found.append((name, low, high))
    return found


def raster(
    diagram: "BifurcationDiagram", coordinate: int, ends: tuple[float, float], colours: Mapping[str, str]
) -> tuple[Floats, tuple[float, float]]:
    """The states of one coordinate as an image on white (ROWS, columns, 3), the lowest row first, and its left and right end.

    A column has the orbits at the value next to its middle: all V values, where they are equidistant. Opacity grows with the
    logarithm of the share of an orbit's states that lie within a row of a place, and is full where all of them do.

    Args:
        ends: the least and the greatest value of the coordinate in the image.
        colours: by word.
    """
    near, beside = _columns(diagram.values)
    states, codes = diagram.states[near, ..., coordinate], diagram.codes[near]
    with np.errstate(invalid="ignore"):
        places = (states - ends[0]) / (ends[1] - ends[0]) * (ROWS - 1)
        shown = (places > -0.5) & (places < ROWS - 0.5)
    column = np.broadcast_to(np.arange(len(near))[:, None, None], states.shape)[shown]
    cells, codes = np.rint(places[shown]).astype(np.int64) * len(near) + column, codes[shown]
    layers, total = np.zeros((ROWS, len(near), 3)), np.zeros((ROWS, len(near)))
    for code in np.unique(codes):
        word = str(words_of(code, diagram.walls))
        count = np.bincount(cells[codes == code], minlength=total.size).reshape(total.shape)
        rows = np.pad(count, ((_REACH, _REACH), (0, 0)))
        wide = np.lib.stride_tricks.sliding_window_view(rows, 2 * _REACH + 1, axis=0).sum(axis=-1)
        layers += wide[..., None] * np.array(to_rgb(colours[word]))
        total += wide
    kept, seen = diagram.states.shape[2], np.maximum(total, 1)
    share = np.clip(1 + np.log(seen / kept) / np.log(max(kept, 2)), 0, 1)
    opacity = np.where(total > 0, _FAINTEST + (1 - _FAINTEST) * share, 0.0)[..., None]
    return np.asarray(1 - opacity * (1 - layers / seen[..., None])), beside


def _columns(values: Floats) -> tuple[Ints, tuple[float, float]]:
    """The index of the value that each column of a raster shows, and the left and right end of all columns."""
    order = np.argsort(values, kind="stable")
    along, steps = values[order], np.diff(np.unique(values))
    if not len(steps):
        return order[:1], (float(along[0]) - 0.5, float(along[0]) + 0.5)
    equal = np.allclose(steps, steps[0], rtol=1e-6) and len(steps) + 1 == len(values)
    count = len(values) if equal else int(min(max(np.ptp(values) / steps.min() + 1, len(values)), MOST))
    middles, half = np.linspace(along[0], along[-1], count), np.ptp(values) / (count - 1) / 2
    return order[np.searchsorted((along[1:] + along[:-1]) / 2, middles)], (along[0] - half, along[-1] + half)


def _colours(diagrams: "Diagrams") -> dict[str, str]:
    """A colour for each word of all maps."""
    words = {word for each in diagrams.values() for word in words_of(np.unique(each.codes), each.walls).tolist() if word}
    ordered = sorted(words, key=lambda word: (any(mark in word for mark in (CHATTER, REST, LONGER)), len(word), word))
    own = family_colours([word for word in ordered if LONGER not in word])
    return {word: own.get(word, GREY) for word in ordered}


def _range(diagrams: "Diagrams", coordinate: int) -> tuple[float, float] | None:
    """The limits of the states of all maps with a margin; those of the first map, where another map's are far beyond them."""
    all_states = [each.states[..., coordinate] for each in diagrams.values()]
    finite = [states[np.isfinite(states)] for states in all_states if np.isfinite(states).any()]
    if not finite:
        return None
    low, high = window(float(finite[0].min()), float(finite[0].max()), np.concatenate(finite))
    margin = _MARGIN * (high - low) or 0.1
    return low - margin, high + margin


def _legend(ax: Axes, colours: Mapping[str, str]) -> None:
    """A dot for each word with a colour of its own, and one for all others."""
    named = {word: colour for word, colour in colours.items() if colour != GREY}
    if len(colours) > len(named):
        named[f"{len(colours) - len(named)} more words"] = GREY
    dots = [Line2D([], [], marker="o", ms=4, ls="", color=colour, label=word) for word, colour in named.items()]
    ax.legend(handles=dots, handletextpad=0.0)


def _gaps(diagram: "BifurcationDiagram") -> list[tuple[float, float]]:
    """The intervals over which the first orbit has no attractor, from half a step before them to half a step behind them."""
    order = np.argsort(diagram.values)
    values, none = diagram.values[order], ~diagram.held[order, 0]
    middles = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])
    starts, stops = (np.flatnonzero(np.diff(np.pad(none.astype(int), 1)) == sign) for sign in (1, -1))
    return list(zip(middles[starts].tolist(), middles[stops].tolist(), strict=True))


def _name_motions(ax: Axes, named: Sequence[Named]) -> None:
    """The names of intervals along the upper edge."""
    for name, low, high, upright in _fitting(ax, named):
        look: dict[str, Any] = {"ha": "center", "va": "top", "rotation": 90 * upright}
        ax.text((low + high) / 2, 0.985, name, transform=ax.get_xaxis_transform(), **look)


def _height(ax: Axes, named: Sequence[Named]) -> float:
    """The height that names need, as a share of that of the states below them."""
    height = float(ax.bbox.height) / ax.figure.dpi
    tall = max([0.0, *((len(name) + 1) * _LETTER if upright else _LINE for name, *_, upright in _fitting(ax, named))]) / height
    return tall / max(1 - tall, 0.5)


def _fitting(ax: Axes, named: Sequence[Named]) -> list[tuple[str, float, float, bool]]:
    """The intervals wide enough for their names, and whether these are written upwards."""
    (left, right), width = ax.get_xlim(), float(ax.bbox.width) / ax.figure.dpi
    found = []
    for name, low, high in named:
        share = (high - low) / (right - left) * width
        upright = share < _LETTER * (len(name) + 1)
        if name and share >= _LINE and not (upright and len(name) > _UPRIGHT):
            found.append((name, low, high, upright))
    return found
