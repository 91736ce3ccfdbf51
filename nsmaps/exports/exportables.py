"""What a study's result holds of maps and closed forms: each with the name of its file, and what has no closed form."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nsmaps.auxiliary.attracting_domain import AttractingDomain
from nsmaps.exports.headers import of_domain, of_study
from nsmaps.exports.program import Exportable, identifiers
from nsmaps.reduced.composite.composite import Piece
from nsmaps.symbolic.curve_iterates import HELD, ClosedEnvelope, envelope_curves

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult


@dataclass(frozen=True, slots=True, eq=False)
class Named:
    """A map or closed form with the name of its file."""

    name: str
    map: Exportable
    about: Sequence[str]  #: lines on what it is of


@dataclass(frozen=True, slots=True, eq=False)
class Holding:
    """What is exported of a result, and why something is not."""

    files: tuple[Named, ...]
    skipped: tuple[str, ...]  #: a sentence each


def is_finished(result: object) -> bool:
    """True for the result of a study, which has its study and domains."""
    return hasattr(result, "study") and hasattr(result, "domains")


def held_by(result: "StudyResult") -> Holding:
    """The maps and closed forms of a study's result."""
    files, skipped, study = [], [], of_study(result)
    if result.composite is not None:
        files.append(Named("composite_map", result.composite, study))
    if result.parametric_map is not None:
        files.append(Named("parametric_map", result.parametric_map, of_study(result, result.parametric_map.parameter)))
    if result.second_iterate is not None:
        files.append(Named("second_iterate", result.second_iterate, [*study, *_of_second(result)]))
    pieces = {piece.name: piece for piece in result.composite.pieces} if result.composite is not None else {}
    for section in result.study.domains:
        if section.name not in result.domains:
            continue
        if section.map in pieces:
            found, without = _envelopes(section.name, pieces[section.map], result.domains[section.name], study)
            files += found
            skipped += without
        else:
            skipped.append(f"the envelopes of domain {section.name}: they are of the map {section.map!r}; expected: of one piece")
    return Holding(tuple(files), tuple(skipped))


def _of_second(result: "StudyResult") -> list[str]:
    """What the second iterate is of."""
    assert result.second_iterate is not None
    name = result.study.second_iterate.domain
    piece = next(section.map for section in result.study.domains if section.name == name)
    domain: AttractingDomain = result.domains[name]
    variable = str(result.second_iterate.variable)
    return of_domain(name, piece, domain, [str(each) for each in domain.coordinates if each != variable])


def _envelopes(name: str, piece: Piece, domain: AttractingDomain, study: Sequence[str]) -> tuple[list[Named], list[str]]:
    """The auxiliary maps of the last update that are curves in closed form, eq. auxv, and the reason for the others."""
    files, skipped = [], []
    for each in domain.updates[-1].envelopes:
        names = identifiers([f"{name} {each.coordinate} {side}" for side in ("lower", "upper")])
        if not isinstance(each, ClosedEnvelope) or each.kind != HELD:
            why = "its curves cross (eq. auxphi), or have an error added: it is numbers, those of updates[-1].envelopes"
        elif piece.map.variables is not None:
            why = f"it is of {', '.join(piece.map.variables)}; the piece itself is written"
        elif each.coordinate in piece.map.absolute:
            why = f"the absolute value of {each.coordinate} is taken, which is not a polynomial"
        else:
            others = [str(other) for other in domain.coordinates if other != each.coordinate]
            about = of_domain(name, piece.name, domain, others)
            for stem, curve, side in zip(names, envelope_curves(piece, each), ("lower", "upper"), strict=True):
                files.append(Named(stem, curve, [f"The {side} auxiliary map of {each.coordinate}.", *study, *about]))
            continue
        skipped.append(f"{' and '.join(names)}: the envelope of {each.coordinate} has no closed form; {why}")
    return files, skipped
