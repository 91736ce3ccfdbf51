"""The sections `grid` and `families`: first returns of all states of a grid, and return surfaces."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Discriminator, Tag

from nsmaps.exact.surfaces.compose import most_returns
from nsmaps.exact.surfaces.family import LONG, ReturnFamily, WordFamily, is_pattern, letters_of
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.exact.surfaces.sweep import surfaces_among
from nsmaps.exact.words import LONGER, encode
from nsmaps.plugins import FAMILY, class_of
from nsmaps.study.conclusions.texts import grid_text
from nsmaps.study.estimates import COPIES, MEMBER, RETURN, STATE, Size, states
from nsmaps.study.reading.classes import CLASS, OWN, Instance, created, form_of
from nsmaps.study.reading.values import Name, Side
from nsmaps.study.sections.base import Need, Section

if TYPE_CHECKING:
    from nsmaps.exact.returns import Returns
    from nsmaps.exact.surfaces.surface import Surface
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

Spans = dict[str, Side]
Family = Annotated[Annotated[tuple[str, ...], Tag(OWN)] | Annotated[Instance, Tag(CLASS)], Discriminator(form_of)]
Families = dict[Name, Family]


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored:
    """The fields of a result for grid."""

    returns: "Returns | None" = None  #: the first returns of every state of the grid, of any word and outcome
    surfaces: "dict[str, Surface]" = field(default_factory=dict)


def _grid(spans: Spans, binding: "Binding") -> Grid:
    return binding.grid(("grid",), spans)


def _compute(spans: Spans, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
    """Step i: the first return of every state of the grid, and the surfaces of the families."""
    grid: Grid = plan.bound["grid"]
    returns = plan.system.first_return(grid.states())
    families = list(plan.families.values())
    if plan.study.partition and not families:
        words = [word for word in np.unique(returns.words[returns.valid]).tolist() if LONGER not in word]
        families = [WordFamily(name=word, words=(word,)) for word in words]
    return {"returns": returns, "surfaces": surfaces_among(plan.system, returns, grid, families)}


def _describe(spans: Spans, study: "Study") -> str:
    return f"{', '.join(study.families) or 'words'} over {grid_text(spans)}"


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
    return max(LONG if is_pattern(word) else most_returns(word) for word in family)


def grid_size(study: "Study") -> Size:
    """The size of the surfaces of all families of a study over its grid."""
    return surfaces_size(study, states(study.grid), max(1, len(study.families)))


def _size(spans: Spans, study: "Study", system: "System") -> Size:
    return grid_size(study)


def _numbers(result: "StudyResult") -> dict[str, Any]:
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


def bind_family(name: str, words: Sequence[str] | Instance, binding: "Binding | StudyResult") -> ReturnFamily:
    """A family; raises StudyError unless its words are returns of the system."""
    walls, first, source = binding.system.letters, binding.system.section_letters, binding.study.source
    if isinstance(words, Instance):
        family: ReturnFamily = created(source, ("families", name), words, FAMILY, name=name)
        return family
    for number, word in enumerate(words):
        loc = ("families", name, number)
        with source.located(loc):
            encode(letters_of(word), walls)
        if not (letters_of(word).startswith(first) and len(word) > len(min(first))):
            raise source.error(loc, f"the word {word!r} is not a return; expected: words that {_ends(binding.system, first)}")
    ends = {} if len(first) == 1 and first[0] else {"max_returns": max(_needed(word, first) for word in words)}
    with source.located(("families", name), WordFamily, words=""):
        return WordFamily(name=name, words=tuple(words), **ends)


def _ends(system: "System", first: tuple[str, ...]) -> str:
    """Where returns begin and end."""
    from nsmaps.exact.systems.system import ImpactSystem

    if isinstance(system, ImpactSystem):
        return f"begin on the base wall {first[0]!r} and end on it or in its release"
    return f"begin with a letter of the section, {' or '.join(map(repr, first))}, and end with one or in its release"


def _needed(word: str, first: tuple[str, ...]) -> int:
    """The number of returns that a word may need, of which each begins with one of several letters, or with none."""
    if "" in first:
        return 1
    return LONG if is_pattern(word) else max(sum(word.count(letter) for letter in first) - 1, 1)


def _families(families: Families, binding: "Binding") -> dict[str, ReturnFamily]:
    return {name: bind_family(name, words, binding) for name, words in families.items()}


def _needs(families: Families) -> Iterator[Need]:
    yield ("families",), "'families'", "grid"


GRID = Section[Spans](
    key="grid",
    type=Spans | None,
    step="surfaces",
    stored=Stored,
    holds={"exact.surfaces.surface": ("Axis", "Grid", "Surface")},
    bind=_grid,
    compute=_compute,
    describe=_describe,
    size=_size,
    numbers=_numbers,
)
FAMILIES = Section[Families](key="families", type=Families, default={}, needs=_needs, bind=_families)
