"""The figures of a study: those that its analyses declare, by name; importing them loads no matplotlib, drawing does."""

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from nsmaps.plugins import sketch_of
from nsmaps.results import units_of
from nsmaps.study.conclusions.phrases import parameters
from nsmaps.study.conclusions.texts import as_computed
from nsmaps.study.pictures.attractors import FIGURES
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.sections.base import concluding

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nsmaps.study.result import StudyResult
    from nsmaps.study.sections.base import Steps

SKETCH = StudyFigure(
    "system.sketch",
    "A drawing of the system with the names of its parts.",
    "The system: its parts, the forcing, and the walls whose impacts are counted.",
    (
        FigurePart(
            "a drawing of the system",
            (),
            lambda result: sketch_of(result.study.system),
            "a system whose package offers one",
            lambda study: bool(sketch_of(study.system)),
        ),
    ),
)
SUMMARY = StudyFigure(
    "attractors.summary",
    "The system at a glance: its drawing, a diagram over a parameter, a motion, and a plane of states.",
    "The system at a glance, with what the study has of these: a drawing of the system, a diagram over a parameter, the motion "
    "on the first attractor, and basins, an attracting domain or words in the plane of states.",
    (
        FigurePart(
            "two pictures or more of the study", (), lambda result: _panels(result), "two or more sections that have pictures"
        ),
    ),
)
_AT_A_GLANCE = (
    ("sketch",),
    ("bifurcation_diagram", "branches", "parameter_plane"),
    ("portrait",),
    ("basins", "boxes", "morse_sets", "words"),
)


def _panels(result: "StudyResult") -> "list[Callable[[Axes], Axes]]":
    """The first panels of the figures that a summary has, computed when they are drawn; none of less than two."""
    known = figures_of(result.study.kinds())
    found = [next((known[name] for name in group if known[name].has_data(result)), None) for group in _AT_A_GLANCE]
    panels: list[Callable[[Axes], Axes]] = [partial(_first_panel, figure, result) for figure in found if figure is not None]
    return panels if len(panels) > 1 else []


def _first_panel(figure: StudyFigure, result: "StudyResult", ax: "Axes") -> "Axes":
    return figure.sheets(result)[0].panels[0](ax)


def figures_of(kinds: "Mapping[str, type[Steps]]") -> dict[str, StudyFigure]:
    """The figures that analyses declare by name; an analysis of another package or file that declares none has its `plot`."""
    declared = (figure for key, kind in kinds.items() for figure in kind.figures or _own(key, kind))
    return {figure.name: figure for figure in (SKETCH, *declared, *FIGURES, SUMMARY)}


def _own(key: str, kind: "type[Steps]") -> Iterator[StudyFigure]:
    """The figure of the result of an analysis of another package or file, under the key of its section."""
    if not kind.__module__.startswith("nsmaps."):
        text = " ".join((kind.__doc__ or f"The analysis {key}.").split("\n\n")[0].split())
        part: FigurePart[Any] = FigurePart(f"the result of {key!r}", (key,))
        yield StudyFigure(key, text, text, (part,), draws_itself=True)


def named_by(result: "StudyResult") -> list[str]:
    """The figures that the study names, and that of speed and error wherever both were measured."""
    return [*result.study.figures, *(["speed_error"] if result.speed else [])]


def drawable(result: "StudyResult", without: Collection[str] = ()) -> list[str]:
    """The figures that a result has the data for, apart from some."""
    found = figures_of(result.study.kinds())
    return [name for name, figure in found.items() if name not in without and figure.has_data(result)]


def caption(result: "StudyResult", name: str, part: str = "") -> str:
    """The sentences below a figure: the numbers of the run, then what is drawn. `part` names one sheet, as its file does."""
    kinds = result.study.kinds()
    key = next((key for key, kind in kinds.items() if name in {figure.name for figure in kind.figures}), "")
    given = parameters(result) if name != SKETCH.name else ""
    analysis = next((each for each in concluding(result) if each.key == key), None)
    numbers = analysis.caption(result, name, part) if analysis is not None else f"At {given}." if given else ""
    text = f"{numbers} {figures_of(kinds)[name].caption}".lstrip()
    if "" in units_of(result.system):
        text += " All quantities but angles are dimensionless."
    return as_computed(result, text)
