"""Figures of the attractors of a study, whichever analysis found them, and the page of its pictures at a glance."""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.coordinates import as_starts
from nsmaps.study.pictures.figure import FigurePart, StudyFigure

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.attractor import Attractor
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.portraits.portrait import PhasePortrait
    from nsmaps.study.result import StudyResult

_DIGITS = 3  #: of states, by which the ends of several orbits are one


def _portrait_of(result: "StudyResult") -> "Callable[[], PhasePortrait] | None":
    """What computes the portrait of the attractors of a study when it is drawn; None where it has none."""
    sections = result.study.basins, result.study.bifurcation_diagram
    return partial(_portrait, result) if result.basins or any(pair.ends for pair in result.orbits) or any(sections) else None


@lru_cache(maxsize=4)
def _portrait(result: "StudyResult") -> "PhasePortrait":
    from nsmaps.dynamics.portraits.portrait import phase_portrait

    return phase_portrait(result.system, _attractors(result))


def _attractors(result: "StudyResult") -> "list[Attractor | LimitSet]":
    """The attractors of the basins, else those on which the orbits end, else that of the start of the bifurcation diagram."""
    from nsmaps.dynamics.attractors.attractor import find_attractors

    if result.basins is not None:
        return list(result.basins.attractors)
    ends = [pair.ends for pair in result.orbits if pair.ends is not None]
    if ends:
        return list({(each.label, each.period, tuple(np.round(each.states[0], _DIGITS))): each for each in ends}.values())
    given = result.study.bifurcation_diagram.starts
    starts = np.stack([as_starts(start, result.system.coordinates) for start in given])
    return [*find_attractors(result.system, starts)]


ATTRACTORS: "FigurePart[Callable[[], PhasePortrait]]" = FigurePart(
    "attractors",
    (),
    _portrait_of,
    "'basins', 'orbits' or 'bifurcation_diagram'",
    lambda study: bool(study.basins or study.orbits or study.bifurcation_diagram),
)
FIGURES = (
    StudyFigure(
        "attractors.portrait",
        "The motion on each attractor over a period, in the phase plane and over time.",
        "The motion on each attractor over one period, without the transient, in the phase plane and over time; without a period "
        "over twenty returns. Marks are impacts or events, grey lines the places of walls.",
        (ATTRACTORS,),
    ),
    StudyFigure(
        "attractors.poincare",
        "The Poincare section of each attractor: its states, or their density, with a part enlarged.",
        "The Poincare section of each attractor. States without a period are 100,000, the darker the more of them lie at a "
        "place; the part in the frame is enlarged.",
        (ATTRACTORS,),
    ),
)
