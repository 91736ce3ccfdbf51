"""What the words of a run's verdicts mean: those that occur in it, and its domains by what the study says of them."""

from nsmaps.study.needs import DIAGONAL
from nsmaps.study.result import StudyResult

TERMS = {
    "covered": "every state of the study's grid lies in a piece of the composite map",
    "keeps returning": "the orbit has an image at every return asked for, wherever that is; other starts are not spoken of",
    "same attractor": "the orbits of both maps end on sets of the same period that are within 3 % of the grid's side in each "
    "coordinate (without a grid, of the exact orbit's extent); without a period, on samples that may be of one set",
    "trapped": "the worst case of one return leads the box of every update into itself, so that no orbit of the map named leaves "
    "it, if what is said of the box is a bound",
    "settled": "all updates were made and trapped, and the last one moved no bound by more than 1 % of the start box",
    "outer": "bounds of a polynomial in Bernstein form: they hold for that polynomial, rounding included",
    "inflated": "bounds of a polynomial, moved out by the error of its fit: an estimate where that was held out, taken at states",
    "enclosed": "images of boxes, computed so that they hold the images of all their states: bounds for the map that is named",
    "sampled": "taken from grids of states: no bound",
    "spectral radius": "the largest size of an eigenvalue: of the absolute derivatives at a fixed point that by which small "
    "boxes about it grow under the worst case of one return",
    "part of the Statement": "by coordinate, which part of the paper's statement on auxiliary maps applies: 1 where its "
    "condition holds at every step, 2 where it does not and the worst case still comes to rest, 0 where neither",
}


def legend(result: StudyResult) -> list[tuple[str, str]]:
    """The terms that the verdicts of a result use, and its domains, each with what it means."""
    said = " ".join(f"{verdict.name} {verdict.text}" for verdict in result.verdicts)
    return [(term, text) for term, text in TERMS.items() if term in said] + _domains(result)


def _domains(result: StudyResult) -> list[tuple[str, str]]:
    """Each domain by its name in the study: of which map, and from which start box."""
    rows = []
    for section in result.study.domains:
        if (made := result.domains.get(section.name)) is not None:
            box = "the hull of the states near the diagonals" if section.box == DIAGONAL else "the study's box"
            grown = ", made larger or smaller until it is carried into itself" if section.grow else ""
            rows.append((f"domain {section.name}", f"of the {made.of}, from {box}{grown}"))
    return rows
