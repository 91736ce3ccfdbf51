"""The section `composite`: the pieces of the composite map, fitted, printed or reset."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

from nsmaps.errors import FitError
from nsmaps.exact.surfaces.family import ReturnFamily, WordFamily, is_pattern
from nsmaps.exact.surfaces.surface import Grid, Surface
from nsmaps.exact.surfaces.sweep import surfaces
from nsmaps.reduced.composite.composite import CompositeMap, Piece, build_composite
from nsmaps.reduced.composite.printed import TabulatedMap
from nsmaps.reduced.conditions.region import ConditionRegion, Region
from nsmaps.reduced.fit.polyfit import PolyFit
from nsmaps.reduced.validation.words import misleads
from nsmaps.results import units_of
from nsmaps.study.ahead import call_composite
from nsmaps.study.conclusions.diagnostics import pieces_of_others
from nsmaps.study.conclusions.phrases import at, part_of
from nsmaps.study.conclusions.texts import count_of, finite, intervals, percent, shares_text
from nsmaps.study.estimates import Size, states
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.locations import Loc
from nsmaps.study.reading.values import DIAGONAL, MAPS
from nsmaps.study.sections.base import Entries, Finding, Need, Verdict, claimed, verdict
from nsmaps.study.sections.maps.diagonal import near_diagonals
from nsmaps.study.sections.maps.fits import bind_fit, fit_size, report_numbers
from nsmaps.study.sections.maps.pieces import PieceSection, separable_pieces
from nsmaps.study.sections.maps.surfaces import GRID, MESH, SURFACES, surfaces_size

if TYPE_CHECKING:
    from nsmaps.figures.parts import SeparablePiece
    from nsmaps.reduced.composite.composite import Coverage
    from nsmaps.study.ahead import Call
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

MAP = "composite map"

COMPOSITE: "FigurePart[CompositeMap]" = FigurePart(
    "a composite map of pieces in closed form",
    ("composite",),
    entry="'composite' or a 'partition' of kind closed_form",
    asked=lambda study: study.partition is None or study.partition.kind != "accurate",
)
SEPARABLE: "FigurePart[Mapping[str, SeparablePiece]]" = FigurePart(
    "pieces with a separable fit",
    ("composite",),
    lambda result: separable_pieces(result.study.composite),
    "a piece of 'composite' with a 'separable' fit",
    lambda study: not (study.composite or study.partition) or bool(separable_pieces(study.composite)),
    planar=True,
)
TITLE: "FigurePart[str]" = FigurePart("the title of the map", (), lambda result: result.system.map_name)


class Pieces(Entries[PieceSection]):
    """Pieces of the composite map (steps iv to vii); the first piece that holds a state decides."""

    key: ClassVar[str] = "composite"
    claims: ClassVar[Mapping[str, tuple[str, ...]]] = {"covered": ("composite", "grid")}
    results: ClassVar[Mapping[str, Any]] = {
        "composite": None,
        "coverage": None,  #: of the study's grid
        "misleads": None,  #: words and images on the study's grid that differ from those of the exact map
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "composite.regions",
            "The plane of states divided into the named pieces of the composite map.",
            "The pieces of the composite map with their names, words and shares of the grid.",
            (COMPOSITE, GRID, optional("orbits")),
        ),
        StudyFigure(
            "fits.separable",
            "A separable map and the exact map in the phase planes, and both as curves on the surfaces.",
            "A separable approximation. The exact map along one line of the grid is green, the separable map orange, and all "
            "other states of the region are grey. Below, both are curves on the return surface.",
            (SEPARABLE, COMPOSITE, SURFACES, MESH, TITLE),
        ),
    )

    def needs(self) -> Iterator[Need]:
        for number, piece in enumerate(self):
            if piece.fit:
                yield ("composite", number), f"the fit of the piece {piece.name!r}", "families"
            if piece.data == DIAGONAL:
                yield ("composite", number, "data"), f"the data of the piece {piece.name!r}", "diagonal"

    def check(self, study: "Study") -> None:
        study.once("composite", [piece.name for piece in self])
        for number, piece in enumerate(self):
            if piece.name in MAPS:
                text = f"{piece.name!r} is the name of a map; expected: another name for the piece"
                raise study.source.error(("composite", number, "name"), text)
            if piece.family is not None:
                study.source.known(("composite", number, "family"), piece.family, study.families, "family")
            if piece.data == DIAGONAL and study.diagonal and piece.family != study.diagonal.family:
                text = f"'diagonal' has the family {study.diagonal.family!r}, the piece {piece.family!r}; expected: the same"
                raise study.source.error(("composite", number, "data"), text)

    def bind(self, binding: "Binding") -> "tuple[PiecePlan, ...]":
        return tuple(_bind_piece(("composite", number), piece, binding) for number, piece in enumerate(self))

    def calls(self) -> "tuple[Call, ...]":
        return (call_composite,)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """Steps iv to vi: every piece fitted, printed or reset."""
        composite = composite_of(plan, plan.system, result.surfaces)
        return {"composite": composite, **judged(plan, result, composite)}

    def describe(self, study: "Study") -> str:
        return ", ".join(f"{piece.name} ({_map_of(piece)})" for piece in self)

    def size(self, study: "Study", system: "System") -> Size:
        return pieces_size(study)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        sections: dict[str, Any] = {}
        if result.composite is not None:
            fits = {piece.name: report_numbers(piece.map.report) for piece in result.composite.pieces if piece.map.report}
            sections["composite"] = {"covered": result.coverage and float(result.coverage.fraction), "fits": fits}
        if result.misleads is not None:
            about = asdict(result.misleads)
            sections["misleads"] = dict(zip(about, finite(about.values()), strict=True))
        return sections

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The share of the grid that the pieces cover, and of the states with the words of the exact map."""
        cover, words = result.coverage, result.misleads
        if cover is None:
            return
        text = f"{count_of(len(result.composite.pieces), 'piece')} cover {percent(float(cover.fraction))} of the grid"
        numbers = [(percent(float(cover.fraction)), "of the grid lies in a piece of the composite map")]
        if words is not None:
            text += f"; {percent(1 - words.wrong_words)} of its states have the impacts that the exact map gives"
            numbers.append((percent(words.wrong_words), "of the grid's states get other impacts than under the exact map"))
        yield Finding(MAP, text, tuple(numbers))

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        cover, words = result.coverage, result.misleads
        if cover is not None:
            holds = bool(cover.fraction == 1.0)
            yield claimed(result.study, "covered", "covered", MAP, holds, _covered(result, cover))
        if words is not None:
            right = words.wrong_words == 0
            yield verdict("words agree with the exact map", MAP, right, words.text)

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The share of the grid of each piece, or the fit of one piece."""
        if figure == "separable":
            return _separable_fit(result, part_of(separable_pieces(self), part))
        if result.coverage is None:
            return ""
        shares = dict(zip(result.coverage.names, result.coverage.fractions.tolist(), strict=True))
        left = 1 - result.coverage.fraction
        none = f"; {100 * left:.2g} % in no piece" if left > 0 else ""
        return f"{at(result)}shares of the grid {shares_text(shares)}{none}."


def _separable_fit(result: "StudyResult", name: str) -> str:
    """The error of the fit of a piece, coordinate by coordinate."""
    fits = {piece.name: piece.map.report for piece in (result.composite.pieces if result.composite else ())}
    report = fits.get(name)
    if report is None:
        return ""
    each = zip(report.coordinates, report.r2, report.max_error, strict=True)
    return f"{at(result)}piece {name}; {'; '.join(f'{c}: R2 = {r2:.4g}, largest error {error:.2g}' for c, r2, error in each)}."


Surfaces = dict[str, Surface]  #: by family


@dataclass(frozen=True, slots=True, eq=False)
class PiecePlan:
    """The definition of one piece: its region, and the family and fit of its map, or its reset."""

    name: str
    region: Region
    family: str | None
    fit: PolyFit | None
    data: Region | None  #: data of the fit, a condition also on parameters; None for the region or the states near the diagonals
    near_diagonals: bool  #: True if the data of the fit are the states near the diagonals
    reset: dict[str, float] | None
    polynomial: TabulatedMap | None
    grid: Grid | None = None  #: of the states at which the data are computed; None for that of the study


def _bind_piece(loc: Loc, piece: PieceSection, binding: "Binding") -> PiecePlan:
    region = _region(loc, piece, binding)
    fit = bind_fit((*loc, "fit"), piece.fit, binding) if piece.fit else None
    reset = None if piece.reset is None else binding.some_coordinates((*loc, "reset"), piece.reset)
    near = piece.data == DIAGONAL
    data = None if piece.data is None or near else binding.region((*loc, "data"), piece.data, parameters=True)
    if piece.polynomial is not None:
        with binding.study.source.located((*loc, "polynomial"), TabulatedMap, bounds="over"):
            piece.polynomial.of(binding.system)
        if piece.family is not None and piece.family in binding.study.families:
            with binding.study.source.located((*loc, "family")):
                _returns_of(binding.family(piece.family))
    grid = None if piece.grid is None else binding.grid((*loc, "grid"), piece.grid)
    return PiecePlan(piece.name, region, piece.family, fit, data, near, reset, piece.polynomial, grid)


def _region(loc: Loc, piece: PieceSection, binding: "Binding") -> Region:
    if piece.box is not None:
        return binding.box((*loc, "box"), piece.box)
    if piece.region is not None:
        return binding.region((*loc, "region"), piece.region)
    return binding.where((*loc, "where"), piece.where or "")


def judged(plan: "Plan", result: "StudyResult", composite: CompositeMap) -> dict[str, Any]:
    """The part of the grid that the pieces of a composite map cover, and its comparison with the exact map."""
    if plan.grid is None or result.returns is None:
        return {}
    return {"coverage": composite.coverage(plan.grid), "misleads": misleads(composite, plan.grid, plan.system, result.returns)}


def composite_of(plan: "Plan", system: "System", known: Surfaces) -> CompositeMap:
    """The composite map at the parameters of a system; an error names the line of its piece."""
    pieces: list[Piece] = []
    for number, piece in enumerate(plan.bound["composite"]):
        with plan.study.source.located(("composite", number)):
            pieces.append(_piece(plan, system, known, piece))
    return CompositeMap(system.coordinates, system.letters, tuple(pieces), units_of(system))


def _piece(plan: "Plan", system: "System", known: Surfaces, piece: PiecePlan) -> Piece:
    """One piece, fitted to its own data if the study defines them, otherwise to all states in its region."""
    if piece.polynomial is not None:
        family = plan.families.get(piece.family or "")
        about = (_word_of(family), _returns_of(family)) if family else ()
        return Piece(piece.name, piece.region, piece.polynomial.of(system), *about)
    found, spec = data_and_spec(plan, system, known, piece)
    return build_composite(system.coordinates, system.letters, found, [spec]).pieces[0]


def _word_of(family: ReturnFamily) -> str:
    """The word of a printed piece, by its family; none if this is not of words."""
    return family.words[0] if isinstance(family, WordFamily) else ""


def _returns_of(family: ReturnFamily) -> int:
    """The number of returns of the image of a printed piece, by the word of its family."""
    words = family.words if isinstance(family, WordFamily) else ()
    if family.max_returns > 1 and (len(words) != 1 or is_pattern(words[0])):
        about = f" ({', '.join(words)})" if words else ""
        text = f"the family {family.name!r}{about} does not say of how many returns a printed image is"
        raise FitError(f"{text}; expected: words of one return, or one word of several, such as BBTB")
    return family.max_returns


def data_and_spec(plan: "Plan", system: "System", known: Surfaces, piece: PiecePlan) -> tuple[Surfaces, PiecePlan]:
    """The surfaces to which a piece is fitted, and the piece with the region of its data at the parameters of a system."""
    data = region_of_data(system, piece)
    if piece.near_diagonals:
        known, data = near_diagonals(plan, known[piece.family or ""])
    elif piece.grid is not None:
        known = surfaces(system, piece.grid, [plan.families[piece.family or ""]])
    return known, replace(piece, data=data)


def region_of_data(system: "System", piece: PiecePlan) -> Region:
    """The region of the data of a piece at the parameters of a system."""
    data = piece.data or piece.region
    others = {name: value for name, value in system.parameters.items() if name not in system.coordinates}
    return data.at(others) if isinstance(data, ConditionRegion) else data


def _map_of(piece: PieceSection) -> str:
    """The kind of map of a piece."""
    return f"fit of {piece.family}" if piece.fit else "printed" if piece.polynomial else "reset"


def pieces_size(study: "Study") -> Size:
    """The size of one fit of all pieces."""
    fits = [fit_size(piece.fit, states(piece.grid or study.grid)) for piece in study.composite if piece.fit]
    own = [surfaces_size(study, states(piece.grid), 1) for piece in study.composite if piece.grid]
    return sum([*fits, *own], Size())


def _covered(result: "StudyResult", cover: "Coverage") -> str:
    if cover.fraction == 1.0:
        return "every state of the grid lies in a piece"
    hull = " or ".join(intervals(result.system.coordinates, box) for box in cover.boxes)
    why = pieces_of_others(result)
    text = f"{100 * (1 - cover.fraction):.3g} % of the grid lies in no piece, within {hull}"
    return f"{text}; {why}" if why else text
