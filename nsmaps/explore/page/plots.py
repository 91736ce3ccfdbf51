"""Pictures of a run for plotly, with values under the pointer: diagrams, planes, basins, exponents, branches, orbits."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import is_angle
from nsmaps.explore.page.sweep import letter, shortened
from nsmaps.figures.style import BLACK, BLUE, GREY, MAGENTA, ORANGE, PIECES, SKY

if TYPE_CHECKING:
    from nsmaps.dynamics.continuation.branch import Branch
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.study.result import StudyResult

Plot = dict[str, Any]  #: title, traces (`data`) and `layout` of plotly, and which axes are angles
POINTS = 15_000  #: of a diagram, at most: plotly's WebGL needs what the page forbids to scripts
NOTHING = ("no attractor", "none reached", "the orbit ends")  #: names of areas that have no colour
CURVES = (BLACK, ORANGE, BLUE, MAGENTA, SKY)


def plots_of(result: "StudyResult", with_diagram: bool = True) -> list[Plot]:
    """The pictures of a result, in the order of a study; none where it has no part that is drawn here."""
    diagrams = _diagrams(result) if with_diagram else ()
    return [*diagrams, *_exponents(result), *_branches(result), *_planes(result), *_basins(result), *_orbits(result)]


def _plot(title: str, x: str, y: str, traces: Sequence[Plot]) -> Plot:
    return {
        "title": title,
        "data": list(traces),
        "layout": {"xaxis": {"title": {"text": letter(x)}}, "yaxis": {"title": {"text": letter(y)}}},
        "angles": [is_angle(x), is_angle(y)],
    }


def _diagrams(result: "StudyResult") -> Iterator[Plot]:
    """A picture a coordinate, with the diagrams of all maps."""
    for k, name in enumerate(result.system.coordinates):
        traces = [
            _diagram(result, of, diagram, k, number) for number, (of, diagram) in enumerate(result.bifurcation_diagram.items())
        ]
        if traces:
            parameter = next(iter(result.bifurcation_diagram.values())).parameter
            yield _plot(f"Bifurcation diagram: {name}", parameter, name, traces)


def _diagram(result: "StudyResult", of: str, diagram: "BifurcationDiagram", k: int, number: int) -> Plot:
    """The states of a diagram in one coordinate, every so many of them, with the motion at each value."""
    heights = diagram.states[..., k].reshape(len(diagram.values), -1)
    values, names = (np.repeat(each[:, None], heights.shape[1], axis=1) for each in (diagram.values, diagram.labels[:, 0]))
    there = np.isfinite(heights)
    step = max(1, -(-int(there.sum()) // POINTS))
    marker = {"size": 2.5, "color": CURVES[number % len(CURVES)], "opacity": 0.5}
    own = {"x": shortened(values[there][::step]), "y": shortened(heights[there][::step]), "text": names[there][::step].tolist()}
    return {"type": "scatter", "mode": "markers", "name": result.map_title(of), "marker": marker, **own}


def _exponents(result: "StudyResult") -> Iterator[Plot]:
    if (sweep := result.lyapunov) is not None:
        largest, error = (each.reshape(len(sweep.values), -1)[:, 0] for each in (sweep.exponents, sweep.error))
        trace = {"type": "scatter", "mode": "lines+markers", "marker": {"size": 3, "color": BLACK}, "line": {"width": 1}}
        own = {"x": shortened(sweep.values), "y": shortened(largest), "error_y": {"array": shortened(error), "width": 0}}
        parameter = result.study.lyapunov.parameter
        yield _plot("Largest Lyapunov exponent per return", parameter, "exponent", [{**trace, **own, "name": "exponent"}])


def _branches(result: "StudyResult") -> Iterator[Plot]:
    """The states of branches in the first coordinate: stable orbits drawn through, others dashed, events marked."""
    name = result.system.coordinates[0]
    for section in result.study.branches:
        parts = [part for part in result.branches.get(section.name, ()) if len(part.values)]
        lines = [line for number, part in enumerate(parts) for line in _lines(part, CURVES[number % len(CURVES)])]
        events = [event for part in parts for event in part.events]
        marks = {
            "type": "scatter",
            "mode": "markers",
            "name": "bifurcations",
            "marker": {"size": 9, "color": "white", "line": {"color": BLACK, "width": 1.5}},
            "x": [event.value for event in events],
            "y": [float(event.orbit.states[0, 0]) for event in events],
            "text": [f"{event.kind} of {event.orbit.label}" for event in events],
        }
        if lines:
            yield _plot(f"Branch {section.name}", section.parameter, name, [*lines, marks])


def _lines(part: "Branch", colour: str) -> Iterator[Plot]:
    """A line for each state of the orbits of a branch, stable ones and others apart."""
    stable = np.array([bool(each) for each in part.stable])
    for own, name, dash in ((stable, "stable", "solid"), (~stable, "unstable", "dash")):
        for k in range(part.points.shape[1]):
            heights = np.where(own, part.points[:, k, 0], np.nan)
            look = {"mode": "lines", "name": f"{name}, period {part.period}", "line": {"color": colour, "dash": dash}}
            points = {"x": shortened(part.values), "y": shortened(heights), "text": part.labels.tolist()}
            if own.any():
                yield {"type": "scatter", **look, **points, "showlegend": k == 0}


def _planes(result: "StudyResult") -> Iterator[Plot]:
    """The motions over two parameters, and the exponents of those of a plane."""
    if (plane := result.parameter_plane) is not None:
        first, second = plane.parameters
        names = np.array([*(motion.label for motion in plane.motions), ""])[plane.motion[..., 0]]
        areas = _areas(plane.along, plane.across, names)
        yield _plot("Attractors of the first start over two parameters", first, second, [areas])
        look: Plot = {"type": "heatmap", "name": "exponent", "zmid": 0, "colorscale": "RdBu"}
        exponents = {"x": areas["x"], "y": areas["y"], "z": shortened(plane.exponent[..., 0])}
        yield _plot("Largest Lyapunov exponent of the first start", first, second, [look | exponents])


def _basins(result: "StudyResult") -> Iterator[Plot]:
    """The attractor that each state of a grid of two coordinates reaches."""
    found = result.basins
    if found is None or found.grid is None or len(found.grid.varying) != 2:
        return
    first, second = (name for name in result.system.coordinates if name in found.grid.varying)
    names = np.array([*(f"{each.label} ({k})" for k, each in enumerate(found.attractors, 1)), *NOTHING[:0:-1]])
    axes = [found.grid.axes[name] for name in (first, second)]
    x, y = (np.linspace(axis.low, axis.high, axis.points) for axis in axes)
    shown = names[found.label].reshape(axes[0].points, axes[1].points).T
    plot = _plot("Basins of attraction", first, second, [_areas(x, y, shown), *_marks(result, first, second)])
    for side, axis in (("xaxis", x), ("yaxis", y)):
        plot["layout"][side]["range"] = [float(axis[0]), float(axis[-1])]
    yield plot


def _marks(result: "StudyResult", first: str, second: str) -> Iterator[Plot]:
    """The manifolds of saddles in a plane."""
    k, m = (list(result.system.coordinates).index(name) for name in (first, second))
    for name, some in result.manifolds.items():
        for each in some:
            lines = [np.append(line, np.full((1, line.shape[1]), np.nan), axis=0) for line in each.lines]
            x, y = (shortened(np.concatenate([line[:, c] for line in lines])) for c in (k, m))
            line = {"color": {"stable": BLACK, "unstable": MAGENTA}[each.which], "width": 1.2}
            yield {"type": "scatter", "mode": "lines", "name": f"{each.which} manifold of {name}", "line": line, "x": x, "y": y}


def _areas(x: Floats, y: Floats, names: NDArray[np.str_]) -> Plot:
    """Names over a plane, rows by the second axis, as coloured areas: the most frequent have colours, all others are grey."""
    kinds, number, count = np.unique(names, return_inverse=True, return_counts=True)
    rank = np.argsort(np.argsort(-count, kind="stable"))
    n_colours = min(len(kinds), len(PIECES) + 1)
    shown = [str(kinds[k]) or NOTHING[0] for k in np.argsort(rank)[:n_colours]]
    shown = [*shown[:-1], "others"] if len(kinds) > n_colours else shown
    colours = [
        "#FFFFFF" if name in NOTHING else colour for name, colour in zip(shown, [*PIECES[1:], PIECES[0], GREY], strict=False)
    ]
    scale = [[(k + side) / n_colours, colour] for k, colour in enumerate(colours) for side in (0, 1)]
    areas = np.minimum(rank[number.reshape(names.shape)], n_colours - 1)
    bar = {"tickvals": list(range(n_colours)), "ticktext": shown, "len": 1}
    look = {"colorscale": scale, "zmin": -0.5, "zmax": n_colours - 0.5, "colorbar": bar, "name": ""}
    text = np.where(names == "", NOTHING[0], names).tolist()
    return {"type": "heatmap", "x": shortened(x), "y": shortened(y), "z": areas.tolist(), "text": text, **look}


def _orbits(result: "StudyResult") -> Iterator[Plot]:
    """The states of the orbits of the exact map in the first two coordinates."""
    names = [*result.system.coordinates, "return"][:2]
    traces = []
    for number, pair in enumerate(result.orbits):
        states = pair.exact.states
        x, y = (states[:, 0], states[:, 1]) if states.shape[1] > 1 else (states[:, 0], np.arange(float(len(states))))
        look = {"mode": "markers", "marker": {"size": 4, "color": CURVES[number % len(CURVES)]}}
        text = [f"return {k}" for k in range(len(x))]
        traces.append(
            {"type": "scatter", **look, "name": f"orbit {number + 1}", "x": shortened(x), "y": shortened(y), "text": text}
        )
    if traces:
        yield _plot("Orbits", names[0], names[1], traces)
