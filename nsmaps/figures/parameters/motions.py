"""The motions of a bifurcation diagram: intervals of the parameter, and their names in a strip above a panel."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.markers import TICKUP
from matplotlib.transforms import ScaledTranslation

from nsmaps.dynamics.motion import CHAOS, MEANING, UNRESOLVED, kind_of
from nsmaps.figures.style import BLACK

if TYPE_CHECKING:
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, Border

    Diagrams = Mapping[str, BifurcationDiagram]

ROW = 11.0  #: points, the height of a row of names
_LETTER, _NUMERAL = 0.065, 0.07  #: inches that a letter of a name takes, and the width of an interval with a number
_ROWS = 3  #: orbits whose motions are named, at most
_ALIKE = 0.02  #: share of the values at which orbits with one row of names differ, at most
_FEWEST = 0.01  #: share of the values of an interval, at least
_APART = 0.02  #: inches between two ticks, at least
_NUMBERS = 9  #: intervals with a number, at most


class Interval(NamedTuple):
    """A motion, and the interval of the parameter over which it attracts."""

    name: str
    low: float
    high: float


def intervals(diagrams: "Diagrams", of: str) -> dict[str, list[Interval]]:
    """The intervals of each orbit of one map that moves otherwise than those before it, by the names of the orbits."""
    diagram = diagrams[of]
    rows, seen = dict[str, list[Interval]](), list[int]()
    for s, name in enumerate(orbit_names(diagram)):
        same = any((diagram.labels[:, s] != diagram.labels[:, other]).mean() <= _ALIKE for other in seen)
        if not same and len(rows) < _ROWS:
            found = _windows(diagrams, of) if s == 0 and diagram.windows else _runs(diagram, s)
            rows[name] = sorted([*found, *_chaotic(diagram, found, s)], key=lambda each: each.low)
            seen.append(s)
    return rows


def orbit_names(diagram: "BifurcationDiagram") -> list[str]:
    """The name of each orbit: an arrow for the way it was followed, the number of its start if there are several."""
    count = diagram.states.shape[1]
    ways = {"both": "→←", "up": "→", "down": "←"}.get(diagram.direction, " ")
    starts = [f" start {k + 1}" if count > len(ways) else "" for k in range(count // len(ways))]
    return [f"{way}{start}".strip() for way in ways for start in starts]


def is_sharp(border: "Border", diagram: "BifurcationDiagram") -> bool:
    """True if a border is known to the mean distance of neighbouring values; others say less than the states that are drawn."""
    return bool(border.precision <= np.ptp(diagram.values) / (len(diagram.values) - 1))


def _windows(diagrams: "Diagrams", of: str) -> list[Interval]:
    """The windows of the first orbit, each to its borders or, where these are not sharp, to the values at which it was seen.

    A motion of a fitted map has the name of that of the exact one with the same impacts and period in returns.
    """
    diagram = diagrams[of]
    all_windows = [window for each in diagrams.values() for window in each.windows]
    names = {window.by_returns: window.label for window in all_windows if window.label != window.by_returns}
    found = []
    for each in diagram.windows:
        borders = zip((each.low, each.high), each.seen, strict=True)
        low, high = (border.value if is_sharp(border, diagram) else seen for border, seen in borders)
        name = each.label if each.label != each.by_returns else names.get(each.by_returns, each.label)
        found.append(Interval(name, low, high))
    return found


def _runs(diagram: "BifurcationDiagram", s: int) -> list[Interval]:
    """The intervals over which one orbit has one motion other than chaos, from half a step before to half a step behind."""
    order = np.argsort(diagram.values, kind="stable")
    values, labels = diagram.values[order], diagram.labels[order, s]
    middles = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])
    cuts = np.flatnonzero(np.concatenate([[True], labels[1:] != labels[:-1], [True]]))
    runs = zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True)
    wide = [(a, b) for a, b in runs if b - a >= _fewest(len(values)) and labels[a] and kind_of(labels[a]) != CHAOS]
    return [Interval(str(labels[a]), float(middles[a]), float(middles[b])) for a, b in wide]


def _chaotic(diagram: "BifurcationDiagram", windows: Sequence[Interval], s: int) -> list[Interval]:
    """The intervals between windows over which one orbit is chaotic, with the name that it has at most of their values.

    They are chaotic regions that are cut by windows too narrow to have borders: where fewer values than an interval has follow
    each other without chaos.
    """
    order = np.argsort(diagram.values, kind="stable")
    values, labels = diagram.values[order], diagram.labels[order, s]
    chaos = np.array([kind_of(name) == CHAOS for name in labels.tolist()])
    fewest = _fewest(len(values))
    inner = (end for each in sorted(windows, key=lambda each: each.low) for end in each[1:])
    ends = [float(values[0]), *inner, float(values[-1])]
    found = []
    for low, high in zip(ends[::2], ends[1::2], strict=True):
        first, stop = np.searchsorted(values, low, "left"), np.searchsorted(values, high, "right")
        places = first + np.flatnonzero(chaos[first:stop])
        for part in np.split(places, np.flatnonzero(np.diff(places) > fewest) + 1):
            if len(part) > 1 and 2 * len(part) > part[-1] - part[0] + 1:
                name = Counter(labels[part].tolist()).most_common(1)[0][0]
                left = low if part[0] - first < fewest else float(values[part[0]])
                right = high if stop - 1 - part[-1] < fewest else float(values[part[-1]])
                found.append(Interval(name, left, right))
    return found


def _fewest(count: int) -> float:
    """The fewest of so many values that make an interval."""
    return max(_FEWEST * count, 2)


def strip(
    ax: Axes, rows: Mapping[str, Sequence[Interval]], borders: Sequence[float], others: Sequence[Sequence[Interval]] = ()
) -> list[Line2D]:
    """The names of motions above a panel, between ticks at their borders, a row an orbit, the first one lowest.

    Names that do not fit have a number instead; the entries of the legend that explain these, and letters such as C.

    Args:
        borders: of the first orbit.
        others: rows of panels of the same width that have their numbers before these.
    """
    width, (left, right) = float(ax.bbox.width) / ax.figure.dpi, ax.get_xlim()
    numbers, shown = dict[str, int](), set[str]()

    def short(name: str, low: float, high: float) -> str:
        """A name, or what fits in its place."""
        room = (min(high, right) - max(low, left)) / (right - left) * width
        if room >= (_LETTER * (len(name) + 1) if len(name) > 1 else _NUMERAL):
            return name
        fits = room >= _NUMERAL and (name in numbers or len(numbers) < _NUMBERS)
        return str(numbers.setdefault(name, len(numbers) + 1)) if fits else ""

    for row in others:
        for each in row:
            short(*each)
    for k, (orbit, row) in enumerate(rows.items()):
        above = ax.get_xaxis_transform() + ScaledTranslation(0, (k * ROW + 1) / 72, ax.figure.dpi_scale_trans)
        for name, low, high in row:
            if text := short(name, low, high):
                shown.add(name)
                ax.text((low + high) / 2, 1, text, transform=above, ha="center", va="bottom")
        ends = [*(borders if k == 0 else ()), *(end for each in row for end in each[1:])]
        inner = np.unique([end for end in ends if left < end < right])
        inner = inner[np.diff(inner, prepend=-np.inf) > _APART / width * (right - left)]
        if len(inner):
            look: dict[str, Any] = {"ls": "", "marker": TICKUP, "ms": ROW - 2, "mew": 0.6, "color": "0.35", "clip_on": False}
            ax.plot(inner, np.ones(len(inner)), transform=above, **look)
        if len(rows) > 1:
            ax.annotate(orbit, (0, 1), (-3, k * ROW + 1), "axes fraction", "offset points", ha="right", va="bottom")
    entries = [(str(numbers[name]), name) for name in numbers if name in shown]
    meanings = {**MEANING, UNRESOLVED: "unresolved"}  # as in planes
    entries += [(kind, meaning) for kind, meaning in meanings.items() if len(kind) == 1 and kind in map(kind_of, shown)]
    return [
        Line2D([], [], ls="", marker=rf"$\mathrm{{{sign}}}$", ms=5, mew=0.3, color=BLACK, label=text) for sign, text in entries
    ]
