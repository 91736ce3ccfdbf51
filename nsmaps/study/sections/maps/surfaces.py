"""The sections `grid` and `families`: first returns of all states of a grid, and return surfaces."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Discriminator, Field, Tag

from nsmaps.exact.surfaces.compose import returns_in_word
from nsmaps.exact.surfaces.family import LONG, ReturnFamily, WordFamily, is_pattern
from nsmaps.exact.surfaces.surface import Grid, Surface
from nsmaps.exact.surfaces.sweep import surfaces_among
from nsmaps.exact.words import LONGER
from nsmaps.plugins import FAMILY, class_of
from nsmaps.study.conclusions.texts import grid_text
from nsmaps.study.estimates import COPIES, MEMBER, RETURN, STATE, Size, states
from nsmaps.study.reading.classes import CLASS, OWN, Instance, form_of
from nsmaps.study.reading.values import Name, Side
from nsmaps.study.sections.base import Named, Need

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


class Spans(Named[Side]):
    """First returns of all states of a grid, and the surfaces of the families; a span for each coordinate."""

    key: ClassVar[str] = "grid"
    step_name: ClassVar[str] = "surfaces"
    results: ClassVar[Mapping[str, Any]] = {
        "returns": None,  #: the first returns of every state of the grid, of any word and outcome
        "surfaces": {},
    }

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
        if result.returns is None:
            return {}
        words, counts = np.unique(result.returns.words, return_counts=True)
        about = {
            "states": len(result.returns),
            "outcomes": result.returns.counts(),
            "words": dict(zip(words.tolist(), counts.tolist(), strict=True)),
            "families": {name: len(surface.returns) for name, surface in result.surfaces.items()},
        }
        return {"returns": about}


Family = Annotated[Annotated[tuple[str, ...], Tag(OWN)] | Annotated[Instance, Tag(CLASS)], Discriminator(form_of)]


class Families(Named[Family]):
    """Families of returns by name, each with the words of its members."""

    key: ClassVar[str] = "families"
    root: dict[Name, Family] = Field(default_factory=dict)

    def needs(self) -> Iterator[Need]:
        yield ("families",), "'families'", "grid"

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
