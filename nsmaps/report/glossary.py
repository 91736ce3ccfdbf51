"""Definitions of the terms in a run's verdicts, and of its domains as the study names them."""

from nsmaps.study.reading.values import DIAGONAL
from nsmaps.study.result import StudyResult

TERMS = {
    "covered": "every state of the study's grid lies in a piece of the composite map",
    "completes all returns": "the orbit has an image at every return of the study, anywhere; nothing follows for other starts",
    "same attractor": "the orbits of both maps end on sets of the same period that are within 3 % of the grid's side in each "
    "coordinate (without a grid, of the exact orbit's extent); without a period, on samples that may be of one set",
    "forward invariant": "the worst case of one return leads the box of every update into itself, so that the box is "
    "invariant under the map named, if the status of the box is a bound",
    "converged": "all updates are forward invariant, and the last one moved no bound by more than 1 % of the start box",
    "outer": "bounds of a polynomial in Bernstein form: they hold for that polynomial, rounding included",
    "inflated": "bounds of a polynomial, moved out by the error of its fit: an estimate if the error was sampled",
    "enclosed": "boxes that contain the images of all states of a box: bounds for the map named",
    "sampled": "sampled on grids of states: not a bound",
    "spectral radius": "the largest modulus of an eigenvalue; for the absolute derivatives at a fixed point the factor by which "
    "small boxes about it grow under the worst case of one return",
    "part of the Statement": "the paper's statement on auxiliary maps (section 6) has two parts; by coordinate, which applies: 1 "
    "where its condition holds at every step, 2 where it does not and the worst case still converges, 0 where neither",
}


def legend(result: StudyResult) -> list[tuple[str, str]]:
    """The terms in the verdicts of a result, and its domains, each with its definition."""
    said = " ".join(f"{verdict.name} {verdict.text}" for verdict in result.verdicts)
    return [(term, text) for term, text in TERMS.items() if term in said] + _domains(result)


def _domains(result: StudyResult) -> list[tuple[str, str]]:
    """Each domain by its name in the study: of which map, and from which start box."""
    rows = []
    for section in result.study.domains:
        if (domain := result.domains.get(section.name)) is not None:
            box = "the hull of the states near the diagonals" if section.box == DIAGONAL else "the study's box"
            grown = ", made larger or smaller until it is carried into itself" if section.grow else ""
            rows.append((f"domain {section.name}", f"of the {domain.of}, from {box}{grown}"))
    return rows
