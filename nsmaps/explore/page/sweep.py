"""The bifurcation diagram of a page: the points of the run, and the exact map as JavaScript, which follows the parameter."""

import re
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.exports.programs.moving import moving_script
from nsmaps.exports.write import export
from nsmaps.report.html import GREEK

if TYPE_CHECKING:
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.exact.systems.parameters import System
    from nsmaps.study.result import StudyResult

POINTS = 40_000  #: of a diagram, at most
EXACT = "nsmaps_exact"  #: what the page calls the exact map
_DIGITS = 7  #: of numbers that are drawn only
_COLOURS = {"exact": "points", "composite": "composite"}  #: of the style sheet, by map; all others have one


def sweep_of(result: "StudyResult") -> dict[str, Any] | None:
    """The diagrams of a study with what a page needs to compute them anew; None without one."""
    section, moved = result.study.bifurcation_diagram, result.parametric_map
    if section is None:
        return None
    coordinates = Coordinates(result.system.coordinates)
    start = next(iter(section.starts), None) or dict(zip(coordinates, np.ones(len(coordinates)), strict=True))
    return {
        "parameter": {"label": letter(section.parameter), "low": section.low, "high": section.high},
        "labels": [letter(name) for name in coordinates],
        "angles": coordinates.angles.tolist(),
        "start": [float(start[name]) for name in coordinates],
        "exact": result.map_title("exact"),
        "moves": moved is not None and moved.parameter == section.parameter,
        "stored": {
            of: {"title": result.map_title(of), "colour": _COLOURS.get(of, "event"), **_points(diagram)}
            for of, diagram in result.bifurcation_diagram.items()
        },
        "events": events_of(result),
    }


def exact_script(result: "StudyResult") -> str:
    """The exact map of a study that has a diagram as JavaScript, at every value of its parameter; empty where it has none."""

    def written(system: "System") -> str:
        text = export(system, "javascript", name=EXACT)
        assert isinstance(text, str)
        return text

    section = result.study.bifurcation_diagram
    try:
        return (section and moving_script(result.system, section.parameter, section.low, section.high, EXACT, written)) or ""
    except NsmapsError:  # the map has no text: flights that are integrated, or a part without a counterpart
        return ""


def letter(name: str) -> str:
    """A name with its Greek letter."""
    return GREEK.get(name, name)


def lettered(text: str, system: "System") -> str:
    """A text with Greek letters for the names of parameters and coordinates."""
    names = "|".join(map(re.escape, [*system.parameters, *map(str, system.coordinates)]))
    return re.sub(rf"\b({names})\b", lambda found: letter(found[1]), text)


def _points(diagram: "BifurcationDiagram") -> dict[str, Any]:
    """The states of a diagram, every so many of them, each with its value."""
    states = diagram.states.reshape(len(diagram.values), -1, diagram.states.shape[-1])
    step = max(1, -(-states.shape[0] * states.shape[1] // POINTS))
    values = np.repeat(diagram.values[:, None], states.shape[1], axis=1)
    own = np.isfinite(states).all(axis=2)
    return {"values": shortened(values[own][::step]), "states": shortened(states[own][::step].T)}


def events_of(result: "StudyResult") -> list[dict[str, Any]]:
    """The events of all branches, each once, in ascending order of the parameter."""
    branches = [branch for found in result.branches.values() for branch in found]
    seen = {(event.kind, float(event.value)) for branch in branches for event in branch.events}
    return [{"kind": kind, "value": value} for kind, value in sorted(seen, key=lambda pair: pair[1])]


def shortened(values: NDArray[Any]) -> list[Any]:
    """Numbers with the digits that a picture needs; null for those that are not finite."""
    if values.ndim > 1:
        return [shortened(row) for row in values]
    printed = (f"%.{_DIGITS}g " * values.size % tuple(values.tolist())).split()
    return [value if np.isfinite(value) else None for value in map(float, printed)]
