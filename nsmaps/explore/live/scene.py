"""What is explored: a system at parameters, the axes of a diagram and of a plane of states, and a start; a frozen description."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, Coordinates, is_angle
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.surface import Axis, Grid

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System
    from nsmaps.study.study import Study

Range = tuple[float, float]
_BOUNDS = (("gt", "low"), ("ge", "low"), ("lt", "high"), ("le", "high"))  #: of a parameter, as pydantic names them
_NEAR = 0.5  #: of a parameter's size, to either side of its value, where a slider has no bound of the system
_INSIDE = 1e-6  #: of a slider's length, which it keeps from a bound that is excluded
_VALUES_SEEN, _RETURNS_SEEN, _DISCARDED = 40, 50, 200  #: of the diagram that shows how wide the axes have to be
_WIDER = 0.1  #: of the extent of its states, to either side
_POINTS, _VALUES = 200, 600  #: of a saved study: points along an axis and returns of an orbit, values of the parameter


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A system, the parameter and coordinate of its diagram, two coordinates of its plane of states, and a start."""

    system: "System"
    name: str  #: of the system, as a study gives it
    start: Floats  #: shape (n,)
    parameter: str  #: on the horizontal axis of the diagram
    coordinate: str  #: on its vertical axis
    values: Range  #: of the parameter
    heights: Range  #: of the coordinate
    plane: Mapping[str, Range]  #: two coordinates and their ranges; all others are held as at the start
    title: str = ""

    @property
    def coordinates(self) -> Coordinates:
        """The names of the coordinates."""
        return Coordinates(self.system.coordinates)

    def at(self, **values: float) -> Self:
        """The same with other parameters; ParameterError for one that is not valid."""
        return replace(self, system=self.system.at(**values))

    def grid(self, points: int) -> Grid:
        """So many points along either axis of the plane, cell by cell in its middle, the other coordinates held."""
        axes = {name: Axis.at(float(value)) for name, value in zip(self.coordinates, self.start, strict=True)}
        for name, (low, high) in self.plane.items():
            half = (high - low) / points / 2
            axes[name] = Axis(low=low + half, high=high - half, points=points)
        return Grid(axes=axes)

    def placed(self, x: float, y: float) -> Self:
        """The same with the start at a point of the plane."""
        start = self.start.copy()
        start[[list(self.coordinates).index(name) for name in self.plane]] = x, y
        return replace(self, start=start)


def scene_of(study: "Study") -> Scene:
    """The scene of a study: its system and parameters, the axes of its diagram and grid, and its first start where it has them.

    Raises:
        NsmapsError: the system has fewer than two coordinates, or no numerical parameter.
    """
    system = study.system_object()
    coordinates = Coordinates(system.coordinates)
    if len(coordinates) < 2 or not system.parameters:
        raise NsmapsError(
            f"{type(system).__name__} has {len(coordinates)} coordinates and {len(system.parameters)} numerical parameters; "
            "expected: two coordinates or more, and a parameter"
        )
    diagram = study.bifurcation_diagram
    start = next(_starts(study), None)
    middle = np.array([start[name] for name in coordinates] if start else [1.0] * len(coordinates), float)
    name = diagram.parameter if diagram else next(iter(system.parameters))
    values = (diagram.low, diagram.high) if diagram else span(system, name)
    wide = extents(system, middle, name, values)
    spans = {each: (side.low, side.high) for each, side in (study.grid or {}).items() if side.points > 1}
    shown = [*spans, *(each for each in coordinates if each not in spans)][:2]
    plane = {each: spans.get(each, extent) for each, extent in zip(coordinates, wide, strict=True) if each in shown}
    return Scene(system, study.system, middle, name, coordinates[0], values, wide[0], plane, study.title or study.name)


def _starts(study: "Study") -> Iterator[dict[str, float]]:
    """The starts that a study names, those of its orbits before that of its diagram."""
    yield from (orbit.start for orbit in study.orbits)
    if study.bifurcation_diagram:
        yield from study.bifurcation_diagram.starts


def extents(system: "System", start: Floats, parameter: str, values: Range) -> list[Range]:
    """A range for each coordinate that holds the attractors over a parameter with room around them; of an angle the circle."""
    from nsmaps.dynamics.diagrams.bifurcation import bifurcation_diagram

    how: Any = {"n_returns": _RETURNS_SEEN, "transient": _DISCARDED}
    found = bifurcation_diagram(system, parameter, np.linspace(*values, _VALUES_SEEN), start, **how)
    states = np.concatenate([found.states.reshape(-1, len(start)), start[np.newaxis]])
    low, high = np.nanmin(states, axis=0), np.nanmax(states, axis=0)
    room = _WIDER * np.maximum(high - low, 0.1 * np.abs(states[-1])) + np.finfo(float).tiny
    return [
        (0.0, TWO_PI) if is_angle(each) else (float(low[k] - room[k]), float(high[k] + room[k]))
        for k, each in enumerate(system.coordinates)
    ]


def span(system: "System", name: str) -> Range:
    """The range of a parameter's slider: between the bounds of the system where it has them, else around the value."""
    value = system.parameters[name]
    room = _NEAR * (abs(value) or 1.0)
    ends: dict[str, float] = {"low": value - room, "high": value + room}
    for bound in type(system).model_fields[name].metadata:
        for key, end in _BOUNDS:
            limit = getattr(bound, key, None)
            if limit is not None:
                inside = _INSIDE * (2 * room) * (key in ("gt", "lt"))
                ends[end] = max(ends[end], limit + inside) if end == "low" else min(ends[end], limit - inside)
    return ends["low"], ends["high"]


def study_of(scene: Scene, name: str, direction: str | None = None) -> "Study":
    """The scene as a study: system, parameters, diagram, plane, and the orbit of its start. ValueError for a name not valid."""
    from nsmaps.study.study import Study

    start = dict(zip(scene.coordinates, scene.start.tolist(), strict=True))
    axes = {each: scene.plane.get(each, (value, value)) for each, value in start.items()}
    low, high = scene.values
    diagram = {
        "parameter": scene.parameter,
        "from": low,
        "to": high,
        "points": _VALUES,
        "starts": [start],
        "direction": direction,
    }
    given = ", ".join(f"{name} = {value:.6g}" for name, value in scene.system.parameters.items())
    return Study.model_validate(
        {
            "name": name,
            "title": f"{scene.name} at {given}, explored by hand",
            "system": scene.name,
            "parameters": scene.system.model_dump(),
            "grid": {each: {"from": a, "to": b, "points": _POINTS if a < b else 1} for each, (a, b) in axes.items()},
            "bifurcation_diagram": diagram,
            "orbits": [{"start": start, "n_returns": _POINTS}],
            "basins": {},
            "figures": ["bifurcation_diagram", "basins"],
        }
    )
