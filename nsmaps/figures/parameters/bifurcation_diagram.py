"""Bifurcation diagrams: figs. bifexact and bifapprox, a panel for each coordinate, the exponents below."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.errors import NsmapsError
from nsmaps.exact.words import CHATTER, LONGER, REST, words_of
from nsmaps.figures.lines import window
from nsmaps.figures.page import Panel, Sheet
from nsmaps.figures.parameters.branches import overlay
from nsmaps.figures.parameters.lyapunov import lyapunov as draw_exponents
from nsmaps.figures.parameters.motions import ROW, intervals, is_sharp, orbit_names, strip
from nsmaps.figures.parameters.raster import raster
from nsmaps.figures.style import INK, INKS, dress, family_colours

if TYPE_CHECKING:
    from nsmaps.dynamics.continuation.branch import Branch
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.dynamics.lyapunov import LyapunovSweep

    Diagrams = Mapping[str, BifurcationDiagram]

_MARGIN = 0.04  #: of the height of the states that is left free above and below them
_GAP = 0.25  #: radians without a state, from which on the circle of an angle is cut there
_FEW = 0.05  #: share of the states with another word than most, from which on colours are by word, if attractors coexist
_NEAR = 0.01  #: of the scale: distance from the cycle of another orbit within which a state is on it
_FAR = 1.0  #: heights of the states within which states of branches are shown
_HIGH = 1.2  #: widths of the page, the height of all panels together
BY = ("density", "word", "start")


def sheets(
    result: "BifurcationDiagram | Diagrams",
    branches: "Sequence[Branch] | None" = None,
    lyapunov: "LyapunovSweep | None" = None,
    by: str = "",
) -> tuple[Sheet, ...]:
    """One sheet: a row a coordinate and one of exponents, a column a map.

    Args:
        result: as of `bifurcation_diagram`.
        branches: drawn over the states, if they are over the same parameter.
        lyapunov: exponents over the same parameter, drawn below.
        by: as of `bifurcation_diagram`.
    """
    diagrams = _by_title(result)
    first = next(iter(diagrams.values()))
    over = [each for each in branches or () if each.parameter == first.parameter and len(each.values)]
    columns = 2 if len(diagrams) == 2 else 1
    panels: list[Panel] = [
        partial(bifurcation_diagram, diagrams, of=of, coordinate=i, by=by, branches=over, named=i == 0)
        for i in range(len(first.coordinates))
        for of in diagrams
    ]
    if lyapunov is not None and lyapunov.parameter == first.parameter:
        panels.append(partial(_exponents, lyapunov, first))
    inner = len(panels) - columns
    panels = [partial(_without_label, panel) if k < inner else panel for k, panel in enumerate(panels)]
    ratio = min(0.4, _HIGH * columns / len(panels)) * columns
    return (Sheet("bifurcation_diagram", tuple(panels), columns, ratio, legend=True),)


def _without_label(panel: Panel, ax: Axes) -> Axes:
    """A panel above another one with the same parameter along."""
    panel(ax).xaxis.label.set_visible(False)
    ax.tick_params(labelbottom=False)
    return ax


def _exponents(result: "LyapunovSweep", diagram: "BifurcationDiagram", ax: Axes) -> Axes:
    """The exponents over the range of a diagram."""
    draw_exponents(result, ax).set_xlim(float(diagram.values.min()), float(diagram.values.max()))
    return ax


def bifurcation_diagram(
    result: "BifurcationDiagram | Diagrams",
    ax: Axes,
    of: str = "",
    coordinate: int = 0,
    by: str = "",
    branches: "Sequence[Branch]" = (),
    named: bool = True,
) -> Axes:
    """One coordinate of the attractors over the parameter: the darker a place, the more of the states kept at a value lie there.

    The motions of each orbit that differ are named in a strip above, between ticks at their borders; names that do not fit are
    numbers, which the legend explains. Grey bands are values without an attractor. An angle is cut where no state lies. All maps
    have the same limits, and a motion of a fitted map has the name of that of the exact one with the same impacts and period.

    Args:
        result: one diagram, or those of several maps by the titles of these.
        of: the title of the map, the first one if empty.
        by: `density` draws all states black; `word` has a colour for the word of the return to each state, the most frequent
            ones, `start` one for each orbit where it is on another attractor than the first. If empty it is by word, where there
            are two or more, but by start where attractors coexist and nearly all states have one word.
        branches: of cycles over the same parameter, drawn as lines with their events, dashed where they are not stable.
        named: whether there is a strip of names.

    Raises:
        NsmapsError: `by` is something else.
    """
    diagrams = _by_title(result)
    of = of or next(iter(diagrams))
    diagram, cut = diagrams[of], _cut(diagrams, coordinate, branches)
    ends = _range(diagrams, coordinate, branches, cut)
    limits = float(diagram.values.min()), float(diagram.values.max())
    handles: list[Line2D] = []
    if ends is None:
        ax.text(0.5, 0.5, "no attractor", transform=ax.transAxes, ha="center")
    else:
        groups, colours = _groups(diagrams, of, by)
        states = _cut_at(cut, diagram.states[..., coordinate])
        image, beside = raster(diagram.values, states, groups, list(colours.values()), ends)
        ax.imshow(image, extent=(*beside, *ends), origin="lower", aspect="auto", interpolation="antialiased", zorder=0)
        ax.set_ylim(ends)
        look = {"ls": "", "marker": "o", "ms": 4}
        handles += [Line2D([], [], color=colour, label=name, **look) for name, colour in colours.items() if len(colours) > 1]  # type: ignore[arg-type]
        handles += overlay(branches, ax, coordinate, partial(_cut_at, cut))
    ax.set_xlim(limits)
    for low, high in _gaps(diagram):
        ax.axvspan(low, high, color="0.92", lw=0)
    dress(ax, (diagram.parameter, ""), (diagram.coordinates[coordinate], "k"))
    rows = intervals(diagrams, of) if named and ends is not None else {}
    ax.set_title(of if named else "", loc="right", pad=4 + ROW * len(rows))
    borders = [end for each in diagram.windows for end in (each.low, each.high)]
    before = [row for each in list(diagrams)[: list(diagrams).index(of)] for row in intervals(diagrams, each).values()]
    handles += strip(ax, rows, [end.value for end in borders if is_sharp(end, diagram)], before)
    if handles:
        ax.legend(handles=handles)
    return ax


def _by_title(result: "BifurcationDiagram | Diagrams") -> "Diagrams":
    return result if isinstance(result, Mapping) else {"": result}


def _groups(diagrams: "Diagrams", of: str, by: str) -> tuple[Ints, dict[str, str]]:
    """The index of the colour of each state of a map, shape (V, S, K), and the colours of all maps by their names."""
    if by not in ("", *BY):
        raise NsmapsError(f"the colours are by {by!r}; expected: {', '.join(BY)}, or nothing")
    diagram = diagrams[of]
    counts = _words(diagrams)
    if not by:
        other = any(_elsewhere(each).any() for each in diagrams.values())
        many = sum(counts.values()) - max(counts.values(), default=0) >= _FEW * sum(counts.values())
        by = "word" if len(counts) > 1 and (many or not other) else "start" if other else "density"
    if by == "density":
        return np.zeros(diagram.codes.shape, int), {"": INKS[0]}
    if by == "start":
        arrows = {"→": "→ followed upwards", "←": "← followed downwards"}
        names = [" ".join(arrows.get(part, part) for part in name.split()) for name in orbit_names(diagram)]
        colours = {name: INKS[k] if k < len(INKS) else INK for k, name in enumerate(names)}
        own = np.where(_elsewhere(diagram), np.arange(len(names)), 0)
        return np.broadcast_to(own[..., None], diagram.codes.shape), colours
    frequent = sorted(counts, key=lambda word: -counts[word])[: len(INKS)]
    ordered = sorted(frequent, key=lambda word: (any(mark in word for mark in (CHATTER, REST, LONGER)), len(word), word))
    colours = family_colours(ordered, INKS)
    if len(counts) > len(colours):
        colours[f"{len(counts) - len(colours)} more words"] = INK
    position = {word: k for k, word in enumerate(colours)}
    codes, places = np.unique(diagram.codes, return_inverse=True)
    index = np.array([position.get(word, len(colours) - 1) for word in words_of(codes, diagram.walls).tolist()])
    return index[places.reshape(diagram.codes.shape)], colours


def _words(diagrams: "Diagrams") -> dict[str, int]:
    """The number of states of each word of all maps."""
    found = dict[str, int]()
    for each in diagrams.values():
        codes, counts = np.unique(each.codes[np.isfinite(each.states).all(axis=-1)], return_counts=True)
        for word, count in zip(words_of(codes, each.walls).tolist(), counts.tolist(), strict=True):
            if word:
                found[word] = found.get(word, 0) + count
    return found


def _elsewhere(diagram: "BifurcationDiagram") -> Bools:
    """Where an orbit is on another attractor than the first one, shape (V, S): another motion, or a cycle apart from it."""
    settled, first = diagram.settled, diagram.settled[:, :1]
    other = diagram.labels != diagram.labels[:, :1]
    for s in range(1, settled.shape[1]):
        near = diagram.coordinates.near(settled[:, s, -1:], first[:, 0], _NEAR, diagram.scale).any(axis=1)
        other[:, s] |= (diagram.period[:, s] > 0) & ~near
    return np.asarray(other & diagram.held)


def _all_states(diagrams: "Diagrams", coordinate: int) -> list[Floats]:
    """The finite states of each map that has any."""
    states = [each.states[..., coordinate] for each in diagrams.values()]
    return [each[np.isfinite(each)] for each in states if np.isfinite(each).any()]


def _cut(diagrams: "Diagrams", coordinate: int, branches: "Sequence[Branch]") -> float | None:
    """The least angle that is shown: in the middle of the widest gap of all states; 0 without one, None for others."""
    if not next(iter(diagrams.values())).coordinates.angles[coordinate]:
        return None
    every = [*_all_states(diagrams, coordinate), *(branch.points[..., coordinate].ravel() for branch in branches), np.zeros(0)]
    angles = np.unique(np.mod(np.concatenate(every), 2 * np.pi))
    gaps = np.diff(angles, append=angles[:1] + 2 * np.pi)
    if not len(gaps) or gaps.max() < _GAP:
        return 0.0
    middle = angles[gaps.argmax()] + gaps.max() / 2
    return float(np.mod(middle + 1.5 * np.pi, 2 * np.pi) - 1.5 * np.pi)  # so that the middle of what is shown is nearest to pi/2


def _cut_at(cut: float | None, values: Floats) -> Floats:
    """Angles from where the circle is cut; other values as they are."""
    return values if cut is None else cut + np.mod(values - cut, 2 * np.pi)


def _range(diagrams: "Diagrams", coordinate: int, branches: "Sequence[Branch]", cut: float | None) -> tuple[float, float] | None:
    """The limits of the states of all maps with a margin; those of the first map, where another map's are far beyond them."""
    finite = [_cut_at(cut, states) for states in _all_states(diagrams, coordinate)]
    if not finite:
        return None
    if cut == 0.0:
        return 0.0, 2 * np.pi
    low, high = window(float(finite[0].min()), float(finite[0].max()), np.concatenate(finite))
    cycles = [_cut_at(cut, branch.points[..., coordinate].ravel()) for branch in branches]
    low, high = window(low, high, np.concatenate([*cycles, finite[0][:1]]), _FAR)
    margin = _MARGIN * (high - low) or 0.1
    return low - margin, high + margin


def _gaps(diagram: "BifurcationDiagram") -> list[tuple[float, float]]:
    """The intervals over which the first orbit has no attractor, from half a step before them to half a step behind them."""
    order = np.argsort(diagram.values)
    values, none = diagram.values[order], ~diagram.held[order, 0]
    middles = np.concatenate([values[:1], (values[1:] + values[:-1]) / 2, values[-1:]])
    starts, stops = (np.flatnonzero(np.diff(np.pad(none.astype(int), 1)) == sign) for sign in (1, -1))
    return list(zip(middles[starts].tolist(), middles[stops].tolist(), strict=True))
