"""Branches of periodic orbits over a parameter: stable and unstable parts, with the events on them."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.continuation.events import AT_INFINITY
from nsmaps.errors import NsmapsError
from nsmaps.figures.lines import cut, neighbours
from nsmaps.figures.page import Sheet
from nsmaps.figures.parameters.events import ASYMPTOTE, MARKERS, Found, by_parameter, colours_of, event_handles, mark
from nsmaps.figures.parameters.multipliers import sheets as multiplier_sheets
from nsmaps.figures.style import RED, darker, dress

_LOOKS = {True: ("-", "stable"), False: ((0, (3, 1.6)), "unstable"), None: (":", "of unknown stability")}  #: line, legend
_WIDE, _HIGH, _GAP = 5.6, 9.0, 2.5  #: points: a letter's width, a line's height, and the distance of a name from its line
_SIDES = np.array([[x, y] for x in (0, 1, -1) for y in (1, -1)])  #: of a line, where its name may stand
_CORNERS = np.array([[x, y] for x in (-1, -0.5, 0, 0.5, 1) for y in (-1, 0, 1)])  #: of a name, and points between them
_WEIGHT = {True: 1.5, False: 1.0, None: 1.0}  #: points, of lines
_TRIED, _BETWEEN = 300, 8  #: places along the lines of a motion; points between two of a line
_NARROW = 0.08  #: share of the range of the parameter, below which a branch is enlarged
_REACH, _MARGIN = 0.35, 0.1  #: of the extent of a line that is enlarged, in which others are too; around them
_FLAT = 1e-6  #: of the scale of a coordinate: least height of a panel


def sheets(found: Found, multipliers: bool = False) -> tuple[Sheet, ...]:
    """One sheet a parameter, a panel a coordinate, or their multipliers; none of a parameter of which no branch has orbits.

    Where branches are narrow, as in a cascade of doublings, a second row of panels enlarges them.
    """
    if multipliers:
        return multiplier_sheets(found)
    along, sheets = by_parameter(found), []
    for parameter, own in along.items():
        count = len(own[0].coordinates) if own else 0
        panels = tuple(partial(branches, own, coordinate=i) for i in range(count))
        if own and _narrow(own):
            panels = (
                *(partial(_framed, own, i) for i in range(count)),
                *(partial(enlarged, own, coordinate=i) for i in range(count)),
            )
        name = "branches" if len(along) == 1 else f"branches-{parameter}"
        sheets += [Sheet(name, panels, min(count, 2), 0.9, legend=True)] if own else []
    return tuple(sheets)


def _with_orbits(found: Found) -> list[Branch]:
    return [branch for some in by_parameter(found).values() for branch in some]


def branches(found: Found, ax: Axes, coordinate: int = 0) -> Axes:
    """One coordinate of all states of cycles over the parameter: a colour a motion, lines dashed where it is unstable.

    Lines and marks are finer for longer periods. The name of a motion stands beside its lines where there is room, else it is in
    the legend, as are the kinds of events.

    Raises:
        NsmapsError: there is no branch with orbits.
    """
    shown = _with_orbits(found)
    if not shown:
        raise NsmapsError("there is no branch with orbits; expected: at least one")
    ax.margins(0.03, 0.09)
    return _panel(shown, ax, coordinate)


def enlarged(found: Found, ax: Axes, coordinate: int = 0) -> Axes:
    """As `branches`, enlarged about one state of the first of the branches that are narrow, with the events there.

    Raises:
        NsmapsError: no branch is narrow.
    """
    shown = _with_orbits(found)
    if not shown or not _narrow(shown):
        raise NsmapsError(f"no branch takes less than {_NARROW:g} of the range of the parameter; expected: at least one")
    return _panel(shown, ax, coordinate, _window(shown, coordinate))


def _framed(shown: Sequence[Branch], coordinate: int, ax: Axes) -> Axes:
    """A panel with a frame about what is enlarged."""
    branches(shown, ax, coordinate)
    low, high = _window(shown, coordinate)
    ax.add_patch(Rectangle(low.tolist(), *(high - low), fill=False, ec="0.2", lw=0.5, label="_"))
    return ax


def _narrow(shown: Sequence[Branch]) -> list[Branch]:
    """The branches of motions that have stable orbits, all in a small part of the range of the parameter."""
    of = dict[str, list[Branch]]()
    for branch in shown:
        of.setdefault(str(branch.labels[-1]), []).append(branch)
    values = {name: np.concatenate([branch.values for branch in own]) for name, own in of.items()}
    least = _NARROW * np.ptp(np.concatenate([*values.values()]))
    small = [name for name, own in values.items() if 0 < np.ptp(own) < least]
    return [branch for name in small for branch in of[name] if True in branch.stable]


def _window(shown: Sequence[Branch], coordinate: int) -> Floats:
    """The least and the greatest parameter and state of narrow branches about one state of the first of them, shape (2, 2)."""
    own = _narrow(shown)
    paths = own[0].points[..., coordinate]
    path = paths[:, int(np.ptp(paths, axis=0).argmax())]
    every = [np.column_stack([np.repeat(each.values, each.period), each.points[..., coordinate].ravel()]) for each in own]
    points = np.concatenate(every)
    points = points[(points[:, 1] >= path.min() - _REACH * np.ptp(path)) & (points[:, 1] <= path.max() + _REACH * np.ptp(path))]
    margin = _MARGIN * np.ptp(points, axis=0)
    return np.array([points.min(axis=0) - margin, points.max(axis=0) + margin])


def _panel(shown: Sequence[Branch], ax: Axes, coordinate: int, window: Floats | None = None) -> Axes:
    """The lines and events of branches with their names, in a window or with room around them."""
    colours = colours_of(shown)
    for branch in shown:
        _lines(branch, ax, coordinate, colours[str(branch.labels[-1])])
    _events(shown, ax, coordinate)
    if window is not None:
        ax.set(xlim=window[:, 0], ylim=window[:, 1])
    low, high = ax.get_ylim()
    least = _FLAT * max(branch.scale[coordinate] for branch in shown)
    if high - low < least:  # constant but for rounding
        ax.set_ylim((low + high - least) / 2, (low + high + least) / 2)
    dress(ax, (shown[0].parameter, ""), (shown[0].coordinates[coordinate], "k"))
    left = _name_lines(ax, shown, coordinate, colours)
    inside = shown if window is None else _narrow(shown)
    ax.legend(
        handles=_handles(
            inside, {str(each.labels[-1]): colours[str(each.labels[-1])] for each in inside if each.labels[-1] in left}
        )
    )
    return ax


def overlay(found: Found, ax: Axes, coordinate: int, onto: Callable[[Floats], Floats]) -> list[Line2D]:
    """The cycles of branches over a picture of attractors in one colour, with their events; the entries of the legend.

    Args:
        onto: from the states of the coordinate to what is drawn, as where the circle of an angle is cut.
    """
    shown = _with_orbits(found)
    for branch in shown:
        _lines(branch, ax, coordinate, RED, onto, slim=0.6)
    _events(shown, ax, coordinate, onto)
    return _handles(shown, {}, RED, " cycle")


def _events(shown: Sequence[Branch], ax: Axes, coordinate: int, onto: Callable[[Floats], Floats] = np.asarray) -> None:
    """A mark at each state of the orbit of each event, a line where there is none."""
    for event in (event for branch in shown for event in branch.events):
        if event.kind == AT_INFINITY:
            ax.axvline(event.value, **ASYMPTOTE)
            continue
        places = onto(event.orbit.states[:, coordinate])
        ax.plot(np.full(len(places), event.value), places, MARKERS[event.kind], **mark(_fineness(len(places))))


def _handles(shown: Sequence[Branch], colours: Mapping[str, str], plain: str = "0.3", of: str = "") -> list[Line2D]:
    """The entries of the legend: motions without a name beside their lines, kinds of events, and kinds of lines."""
    present = {stable for branch in shown for stable in branch.stable}
    motions = [Line2D([], [], color=colour, label=motion) for motion, colour in colours.items()]
    looks = [look for stable, look in _LOOKS.items() if stable in present]
    lines = [Line2D([], [], color=plain, ls=ls, label=label + of) for ls, label in looks]
    return [*motions, *lines, *event_handles(shown)]


def _name_lines(ax: Axes, shown: Sequence[Branch], coordinate: int, colours: Mapping[str, str]) -> list[str]:
    """Write the name of each motion beside a line of its own, as far as possible from other lines; those without room."""
    point = ax.figure.dpi / 72
    of = {name: [branch for branch in shown if branch.labels[-1] == name] for name in colours}
    every = {
        name: [path for branch in own for path in _on_page(ax, branch, coordinate, with_unstable=True)]
        for name, own in of.items()
    }
    left, named = list[str](), np.full((1, 2), -np.inf)
    for name, colour in colours.items():
        half = np.array([_WIDE * len(name), _HIGH]) * point / 2
        own = [path for branch in of[name] for path in _on_page(ax, branch, coordinate)] or every[name]
        places = _beside(np.concatenate(own), half + _GAP * point)
        inside = ((places > half + _GAP * point) & (places < ax.bbox.size - half - _GAP * point)).all(axis=1)
        room = np.where(
            inside, _room(places, np.concatenate([named, *(path for paths in every.values() for path in paths)]), half), 0.0
        )
        others = np.concatenate([named, *(path for other in every if other != name for path in every[other])])
        if (room > 1).any() and max(np.ptp(path, axis=0).max() for path in own) > half[0]:
            best = places[np.where(room > 1, _room(places, others, half), 0.0).argmax()]
            x, y = ax.transData.inverted().transform(best + ax.bbox.min).tolist()
            ax.text(x, y, name, color=darker(colour), ha="center", va="center", fontweight="bold")
            named = np.concatenate([named, best + half * _CORNERS])
        else:
            left.append(name)
    return left


def _on_page(ax: Axes, branch: Branch, coordinate: int, with_unstable: bool = False) -> list[Floats]:
    """Points on each line of a branch, in pixels from the corner of the panel, shape (m, 2): of stable orbits, or of all."""
    kept = [with_unstable or stable is True for stable in branch.stable]
    paths = [np.column_stack([branch.values, path])[kept] for path in branch.points[..., coordinate].T]
    return [_dense(ax.transData.transform(path)) - ax.bbox.min for path in paths if len(path)]


def _beside(points: Floats, far: Floats) -> Floats:
    """Places for names beside some points of lines (m, 2), shape (k, 2)."""
    some = points[:: max(len(points) // _TRIED, 1)]
    return np.asarray((some[:, None] + _SIDES * far).reshape(-1, 2))


def _room(places: Floats, taken: Floats, half: Floats) -> Floats:
    """How many times as large a name at each place could be, half its size given, before it meets a point that is taken."""
    columns, room = np.ascontiguousarray(taken.T), np.empty(len(places))
    for k, place in enumerate(places):  # one at a time, so that what is in between stays small
        dx, dy = (np.abs(x - other) / size for x, other, size in zip(place, columns, half, strict=True))
        room[k] = np.maximum(dx, dy).min()
    return room


def _dense(path: Floats) -> Floats:
    """Points of a line (m, 2), in pixels, and points between them."""
    share = np.linspace(0, 1, _BETWEEN, endpoint=False)[:, None]
    return np.concatenate([(path[:-1, None] + share * np.diff(path, axis=0)[:, None]).reshape(-1, 2), path[-1:]])


def _lines(
    branch: Branch, ax: Axes, coordinate: int, colour: str, onto: Callable[[Floats], Floats] = np.asarray, slim: float = 1.0
) -> None:
    """A line for each state of the cycle, solid where it is stable, dashed where it is not, dotted where that is unknown."""
    for path in onto(branch.points[..., coordinate]).T:
        for stable, (dashes, _) in _LOOKS.items():
            own = np.array([each is stable for each in branch.stable], bool)
            chosen = own if stable else neighbours(own)
            line = np.where(chosen, path, np.nan)
            line = cut(line, np.pi) if branch.returns.coordinates.angles[coordinate] else line
            ax.plot(branch.values, line, ls=dashes, color=colour, lw=slim * _WEIGHT[stable] * _fineness(branch.period))


def _fineness(period: int) -> float:
    """How much of its size a line or mark has that stands beside so many others."""
    return float(period**-0.4)
