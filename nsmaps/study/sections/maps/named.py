"""The maps of a study by their names: `exact`, `composite`, `parametric`, and the pieces of the composite map."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from nsmaps.exact.surfaces.along import Along
from nsmaps.exact.systems.parameters import map_name
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.conditions.region import Where
from nsmaps.study.sections.maps.refits import refit

if TYPE_CHECKING:
    from nsmaps.exact.returnmap import ReturnMap
    from nsmaps.exact.systems.parameters import System
    from nsmaps.study.binding import Plan
    from nsmaps.study.result import StudyResult
    from nsmaps.study.study import Study


def pieces_with_a_map(study: "Study") -> list[str]:
    """The names of the pieces of the composite map that are fitted or printed."""
    return [piece.name for piece in study.composite if piece.reset is None]


def maps_along(study: "Study") -> list[str]:
    """The names of the maps of a study that there are at every value of a parameter."""
    named = ["composite", *pieces_with_a_map(study)] if study.composite else []
    return ["exact", *named, *(["parametric"] if study.parametric else [])]


def map_title(study: "Study", system: "System", of: str) -> str:
    """What a map is called in texts and figures: `exact map`, `composite map`, `parametric map`, `fitted map R1`."""
    if of not in pieces_with_a_map(study):
        return map_name(system, of)
    printed = any(piece.name == of and piece.polynomial for piece in study.composite)
    return f"{'printed' if printed else 'fitted'} map {of}"


def map_along(plan: "Plan", result: "StudyResult", of: str, parameter: str) -> "Callable[[float], ReturnMap]":
    """A map of a study as a function of a parameter, which can be pickled.

    The composite map is fitted at each value, and so is a piece, whose map then applies to all states.
    """
    system_at = Along(plan.system, parameter)
    if of == "exact":
        return system_at
    if of == "parametric":
        assert result.parametric is not None
        return result.parametric.at
    if of == "composite":
        return _Refitted(plan, system_at)
    (piece,) = (piece for piece in plan.bound["composite"] if piece.name == of)
    anywhere = replace(piece, region=Where(text="0 < 1", coordinates=plan.system.coordinates), data=piece.data or piece.region)
    return _Refitted(replace(plan, bound=plan.bound | {"composite": (anywhere,)}), system_at)


@dataclass(frozen=True, slots=True, eq=False)
class _Refitted:
    """The composite map over a parameter, fitted at each value."""

    plan: "Plan"
    system_at: "Along[System]"

    def __call__(self, value: float) -> CompositeMap:
        return refit(self.plan, self.system_at(value))[0]
