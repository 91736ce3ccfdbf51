"""What the page of a run is given: its map as JavaScript, diagrams, events, exact flights, surfaces, as plain data."""

from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.dynamics.orbit import orbit
from nsmaps.errors import NsmapsError
from nsmaps.exact.events import ModeTrack
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.exact.trajectory import track
from nsmaps.explore.page.sweep import events_of, letter, shortened, sweep_of
from nsmaps.exports.write import export
from nsmaps.figures.composite.areas import colours_over
from nsmaps.figures.style import family_colours, piece_colours
from nsmaps.reduced.composite.formulas import composite_of
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.maps.surfaces import GRID

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

FLIGHTS = 61  #: values of the parameter at which the exact motion is computed
STATES = 19  #: along either side of the grid, of the states from which first flights are computed
_FIRST = 4  #: impacts or events of these
_SETTLED = 400  #: returns before that motion begins, so that it is on an attractor
_EVENTS, _SAMPLES = 13, 24  #: impacts or events of a motion, and instants between two of them


def has_map(result: "StudyResult") -> bool:
    """Whether a page can move the map of a result: a composite one of two coordinates, or a map by formulas, over a grid."""
    reduced = result.composite is not None or isinstance(result.system, PiecewiseMap)
    return reduced and bool(result.study.grid) and len(result.system.coordinates) == 2


def data_of(result: "StudyResult") -> dict[str, Any]:
    """What the page shows of a result.

    Raises:
        NsmapsError: the result has no composite map of two coordinates, nor a system that is a map by formulas.
    """
    composite = result.composite
    if composite is None and isinstance(result.system, PiecewiseMap):
        composite = composite_of(result.system)
    if composite is None or len(composite.coordinates) != 2:
        raise NsmapsError(
            "the page shows a composite map of two coordinates; expected: a study with 'composite' and, to move its parameter, "
            "'parametric', or `nsmaps explore STUDY --live`, which shows the exact map of any study"
        )
    moved, reduced, names = result.parametric_map, result.parametric_map or composite, [piece.name for piece in composite.pieces]
    starts = [pair.start.tolist() for pair in result.orbits] or [composite.coordinates.wrap(_middle(result)).tolist()]
    return {
        "system": result.study.system,
        "shown": "flight" if isinstance(result.system, FlowSystem) else "orbit",
        "parameters": dict(result.system.parameters),
        "labels": [letter(name) for name in composite.coordinates],
        "angles": composite.coordinates.angles.tolist(),
        "window": _window(result),
        "pieces": [{"name": piece.name, "word": piece.word} for piece in composite.pieces],
        "colours": colours_over(composite, GRID.of(result, "explore"), result.orbits)
        if result.composite
        else piece_colours(names, [False] * len(names)),
        "parameter": None
        if moved is None
        else {"name": moved.parameter, "label": letter(moved.parameter), "low": moved.low, "high": moved.high},
        "start": starts[0],
        "sweep": sweep_of(result),
        "events": events_of(result),
        "motion": _motions(result, np.array(starts[0])),
        "surfaces": _surfaces(result),
        "flights": _flights(result) if len(result.surfaces) else [],
        "maps": _maps(result),
        "script": _script(reduced),
    }


def _script(reduced: Any) -> str:
    """The map as JavaScript, called `map`."""
    text = export(reduced, "javascript", name="nsmaps_map")
    assert isinstance(text, str)
    return text


def _maps(result: "StudyResult") -> str:
    """Which map is drawn where."""
    if result.composite is None:
        return "The map of this page is that of the formulas, in JavaScript."
    return "Pieces, orbit and cobwebs are of the composite map in JavaScript, motion and sheets with edges of the exact map."


def _window(result: "StudyResult") -> list[list[float]]:
    """The ranges of the grid."""
    if not result.study.grid:
        raise NsmapsError("the page shows the pieces over a grid, which the study lacks; expected: 'grid'")
    return [[float(side.low), float(side.high)] for side in result.study.grid.values()]


def _middle(result: "StudyResult") -> Floats:
    return np.mean(_window(result), axis=1)


def _motions(result: "StudyResult", start: Floats) -> list[dict[str, Any]]:
    """The exact motion on the attractor of a start, at values of the parameter of the map or at that of the study alone."""
    moved = result.parametric_map
    if moved is None:
        return [_motion(result.system, start, None)]
    values = np.linspace(moved.low, moved.high, FLIGHTS).tolist()
    return [_motion(result.system.at(**{moved.parameter: value}), start, value) for value in values]


def _motion(system: "System", start: Floats, value: float | None) -> dict[str, Any]:
    """The exact motion on the attractor of a start, at a value of the parameter of the map."""
    last = orbit(system, start, _SETTLED).final
    return {"value": value, **_bodies(system, last if np.isfinite(last).all() else start, _EVENTS)}


def _flights(result: "StudyResult") -> list[dict[str, Any]]:
    """The exact motion from the states of a coarse grid through the first impacts or events, for the surfaces."""
    edges = [np.linspace(low, high, STATES + 2)[1:-1] for low, high in _window(result)]
    states = np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1).reshape(-1, 2)
    own = states[result.system.first_return(states).valid]
    return [{"state": state.tolist(), **_bodies(result.system, state, _FIRST)} for state in own]


def _bodies(system: "System", start: Floats, count: int) -> dict[str, Any]:
    """The exact motion through so many impacts or events: places over time, letters, and which bodies are walls.

    Of a map these are its coordinates, each held from one return to the next.
    """
    if not isinstance(system, FlowSystem):
        path = orbit(system, start, count)
        ends = np.repeat(np.arange(count + 1.0), 2)[1:]
        lines = {name: shortened(np.repeat(line, 2)[:-1]) for name, line in zip(system.coordinates, path.states.T, strict=True)}
        letters, at = path.words.tolist(), list(range(1, count + 1))
        return {"time": shortened(ends), "bodies": lines, "walls": [], "letters": letters, "at": at}
    found = track(system, start, count, _SAMPLES)
    if isinstance(found, ModeTrack):
        bodies = dict(zip(found.names, np.moveaxis(found.states, -1, 0), strict=True))
        letters, times, walls = found.events.letter.tolist(), found.events.time, list[str]()
    else:
        walls = list(found.impacts.walls)
        bodies = {"ball": found.ball, **dict(zip(walls, found.walls, strict=True))}
        letters, times = [found.impacts.walls[k] for k in found.impacts.wall], found.impacts.time
    lines = {name: shortened(line.ravel()) for name, line in bodies.items()}
    return {
        "time": shortened(found.time.ravel()),
        "bodies": lines,
        "walls": walls,
        "letters": letters,
        "at": shortened(np.asarray(times)),
    }


def _surfaces(result: "StudyResult") -> list[dict[str, Any]]:
    """The sheets of every family over a plane, as triangles, with the word of each vertex."""
    colours = family_colours(list(result.surfaces))
    found = []
    for name, surface in result.surfaces.items():
        if len(surface.grid.varying) == 2 and len(surface.start):
            sheets = result.mesh(name)
            found.append(
                {
                    "name": name,
                    "colour": colours[name],
                    "states": shortened(sheets.returns.start.T),
                    "images": shortened(sheets.returns.image.T),
                    "words": sheets.returns.words.tolist(),
                    "triangles": sheets.triangles.T.tolist(),
                }
            )
    return found
