"""The sections `grid` and `families`: first returns of all states of a grid, and return surfaces."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.exact.surfaces.compose import returns_in_word
from nsmaps.exact.surfaces.family import LONG, ReturnFamily, WordFamily, is_pattern
from nsmaps.exact.surfaces.surface import Grid, Surface
from nsmaps.exact.surfaces.sweep import surfaces_among
from nsmaps.exact.words import LONGER
from nsmaps.figures.parts import plane
from nsmaps.plugins import FAMILY, class_of
from nsmaps.study.conclusions.phrases import at, part_of
from nsmaps.study.conclusions.texts import grid_text, intervals, percent, shares_text
from nsmaps.study.estimates import COPIES, MEMBER, RETURN, STATE, Size, states
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.classes import Instance, OrInstance
from nsmaps.study.reading.values import Name, Side
from nsmaps.study.sections.base import Finding, Named

if TYPE_CHECKING:
    from collections.abc import Callable

    from nsmaps.exact.surfaces.mesh import Mesh
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

COLOURED = 8  #: families that have a colour of their own


def families_on_grid(result: "StudyResult") -> Mapping[str, Surface]:
    """The families with states on the grid; the most frequent ones first where they are more than there are colours."""
    found = {name: surface for name, surface in result.surfaces.items() if len(surface.start)}
    if result.surfaces and not found:
        raise NsmapsError(
            f"no state of the grid is in {' or '.join(map(repr, result.surfaces))}; expected: families of words that occur on "
            "the grid"
        )
    if len(found) > COLOURED:
        return dict(sorted(found.items(), key=lambda pair: -len(pair[1].start)))
    return found


def _grid(result: "StudyResult") -> Grid | None:
    """The grid of the return surfaces."""
    return next((surface.grid for surface in families_on_grid(result).values()), None)


def over_plane(result: "StudyResult") -> Mapping[str, Surface]:
    """The families over a plane through the states."""
    shown = families_on_grid(result)
    if shown:
        plane(next(iter(shown.values())).grid)
    return shown


def mesh_by_surface(result: "StudyResult") -> "Callable[..., Mesh]":
    """The function that gives the triangles of a surface of the result, up to its edges."""
    return lambda surface, part=None: result.mesh(surface.name, part)


def areas_by_surface(result: "StudyResult") -> "Callable[..., Mesh]":
    """The same in the plane of states alone, where surfaces need not be followed."""
    return lambda surface: result.mesh(surface.name, flat=True)


FAMILIES = ("grid", "families")
SURFACES: "FigurePart[Mapping[str, Surface]]" = FigurePart("return surfaces", FAMILIES, families_on_grid, planar=True)
PLANES: "FigurePart[Mapping[str, Surface]]" = FigurePart("return surfaces over a plane", FAMILIES, over_plane)
MESH: "FigurePart[Callable[..., Mesh]]" = FigurePart("triangles", (), mesh_by_surface)
AREAS: "FigurePart[Callable[..., Mesh]]" = FigurePart("areas", (), areas_by_surface)
GRID: "FigurePart[Grid]" = FigurePart("return surfaces", FAMILIES, _grid, planar=True)


class Spans(Named[Side]):
    """The grid of states from which first returns and the surfaces of families are computed (step i)."""

    key: ClassVar[str] = "grid"
    step_name: ClassVar[str] = "surfaces"
    results: ClassVar[Mapping[str, Any]] = {
        "returns": None,  #: the first returns of every state of the grid, of any word and outcome
        "surfaces": {},
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "returns.words",
            "The plane of states coloured by word.",
            "The word or family of the first return from every state of the grid, and the pieces of any composite map. The "
            "blue frame, if any, bounds the states near the diagonals of all coordinates, over all values of a swept parameter.",
            (PLANES, AREAS, optional("diagonal"), optional("composite"), optional("orbits")),
        ),
        StudyFigure(
            "returns.surfaces",
            "Surfaces of the images over the plane of states, seen in perspective.",
            "The return surfaces: each coordinate of the image over the initial states, coloured by family. They end where the "
            "map jumps or an angle is wrapped.",
            (PLANES, MESH),
            animated=True,
        ),
        StudyFigure(
            "returns.projections",
            "Images against initial states with the diagonals, one coordinate a panel.",
            "The return surfaces projected along one coordinate, which each line holds fixed; its colour is the value held. On "
            "the dashed diagonal a coordinate is mapped to itself. Stars, if any, are states near the diagonals of all "
            "coordinates, filled where no slope exceeds the bound of the study (1 unless it sets one), else hollow.",
            (SURFACES, MESH, optional("diagonal")),
        ),
    )

    def bind(self, binding: "Binding") -> Grid:
        return binding.grid(("grid",), self.root)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """Step i: the first return of every state of the grid, and the surfaces of the families."""
        grid: Grid = plan.bound["grid"]
        returns = plan.system.first_return(grid.states())
        families = list(plan.families.values())
        if plan.study.partition and not families:
            words = [word for word in np.unique(returns.words[returns.valid]).tolist() if LONGER not in word]
            families = [WordFamily(name=word, words=(word,)) for word in words]
        found: dict[str, Surface] = {}
        for family in families:
            with plan.study.source.located(("families", family.name)):
                found |= surfaces_among(plan.system, returns, grid, [family])
        return {"returns": returns, "surfaces": found}

    def describe(self, study: "Study") -> str:
        return f"{', '.join(study.families) or 'words'} over {grid_text(self.root)}"

    def size(self, study: "Study", system: "System") -> Size:
        return grid_size(study)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        words, counts = np.unique(result.returns.words, return_counts=True)
        about = {
            "states": len(result.returns),
            "outcomes": result.returns.counts(),
            "words": dict(zip(words.tolist(), counts.tolist(), strict=True)),
            "families": {name: len(surface.returns) for name, surface in result.surfaces.items()},
        }
        return {"returns": about}

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The grid and the shares of the words of its first returns, or the states of one family."""
        found = result.returns
        if not len(found):
            return ""
        family = part_of(result.surfaces, part)
        if figure == "projections" and part and family in result.surfaces:
            states_of = len(result.surfaces[family].start)
            return f"{at(result)}{states_of:,} states of the family {family}, {100 * states_of / len(found):.3g} % of the grid."
        words, counts = np.unique(found.words[found.valid], return_counts=True)
        shares = dict(zip(words.tolist(), (counts / len(found)).tolist(), strict=True))
        lost = 1 - float(found.valid.mean())
        none = f"; {100 * lost:.2g} % do not return" if lost else ""
        return f"{at(result)}{len(found):,} states in {_hull(result, found.start)}, by word {shares_text(shares)}{none}."

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The impacts of the first returns, and the share of the grid with each."""
        words, counts = np.unique(result.returns.words[result.returns.valid], return_counts=True)
        shares = dict(zip(words.tolist(), (counts / len(result.returns)).tolist(), strict=True))
        text = f"first returns from {len(result.returns):,} states have the impacts {shares_text(shares)}"
        ranked = sorted(shares.items(), key=lambda pair: -pair[1])
        yield Finding(
            result.system.map_name,
            text,
            tuple((percent(share), f"of the grid returns with the impacts {word}") for word, share in ranked),
        )


def _hull(result: "StudyResult", states: Floats) -> str:
    """The intervals of coordinates that vary, and the values of the others."""
    box, names = np.stack([states.min(axis=0), states.max(axis=0)], axis=1), result.system.coordinates
    free = np.ptp(box, axis=1) > 0
    inside = intervals([name for name, varies in zip(names, free, strict=True) if varies], box[free])
    held = "".join(f", {name} = {low:.5g}" for name, low, varies in zip(names, box[:, 0], free, strict=True) if not varies)
    return inside + held


Family = OrInstance[tuple[str, ...]]


class Families(Named[Family]):
    """Families of returns by name, each a list of words or an object of a class (step ii); needs `grid`."""

    key: ClassVar[str] = "families"
    needed: ClassVar[tuple[str, ...]] = ("grid",)
    root: dict[Name, Family] = Field(default_factory=dict)

    def bind(self, binding: "Binding") -> dict[str, ReturnFamily]:
        return {name: binding.family(name) for name in self}


def surfaces_size(study: "Study", count: float, families: int) -> Size:
    """The size of the surfaces of some families over so many states."""
    max_length = max(map(_length, study.families.values()), default=1)
    return Size(RETURN * count * max_length, count * (STATE + COPIES * MEMBER * families))


def _length(family: tuple[str, ...] | Instance) -> int:
    """The number of returns that a family may need, for estimates."""
    if isinstance(family, Instance):
        return int(
            (family.model_extra or {}).get("max_returns") or class_of(FAMILY, family.of).model_fields["max_returns"].default
        )
    return max(LONG if is_pattern(word) else returns_in_word(word) for word in family)


def grid_size(study: "Study") -> Size:
    """The size of the surfaces of all families of a study over its grid."""
    return surfaces_size(study, states(study.grid), max(1, len(study.families)))
