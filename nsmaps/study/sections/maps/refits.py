"""The maps of a study at other values of the parameters, the composite map fitted there."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.errors import FitError, NsmapsError
from nsmaps.exact.surfaces.along import Along
from nsmaps.exact.surfaces.sweep import surfaces, surfaces_among
from nsmaps.progress import beat
from nsmaps.reduced.composite.composite import CompositeMap, data_of
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.study.sections.maps.composite import Surfaces, composite_of, data_and_spec, region_of_data

if TYPE_CHECKING:
    from nsmaps.arrays import Floats, Ints
    from nsmaps.exact.returnmap import ReturnMap
    from nsmaps.study.sections.base import Plan, StudyResult, System


def refits(
    plan: "Plan", parameter: str, values: "Floats", begin: float, end: float
) -> list[tuple[float, CompositeMap, Surfaces]]:
    """The composite map at each value of a parameter, with the data of its fitted pieces: a step from one share to another."""
    found = []
    for value in values.tolist():
        try:
            found.append((value, *refit(plan, plan.system.at(**{parameter: value}))))
        except NsmapsError as error:
            raise FitError(f"at {parameter} = {value:.6g}: {error}") from error
        beat(begin + (end - begin) * len(found) / len(values))
    return found


def refit(plan: "Plan", system: "System") -> tuple[CompositeMap, Surfaces]:
    """The composite map of a system with other parameters than the study's, and the data of its fitted pieces, by name."""
    try:
        found = _surfaces_in(plan, system, _used(plan, system))
        composite = composite_of(plan, system, found)
    except FitError:  # whose message speaks of all of the grid
        found = surfaces(system, plan.grid, list(plan.families.values())) if plan.grid else {}
        composite = composite_of(plan, system, found)
    fitted = [(piece.name, *data_and_spec(plan, system, found, piece)) for piece in plan.bound["composite"] if piece.fit]
    return composite, {name: data_of(system.coordinates, own, spec) for name, own, spec in fitted}


def _used(plan: "Plan", system: "System") -> "Ints":
    """The numbers of the grid's states to which a piece is fitted at the parameters of a system."""
    pieces = [piece for piece in plan.bound["composite"] if piece.fit and piece.grid is None]
    if plan.grid is None or any(piece.near_diagonals for piece in pieces):
        return np.arange(plan.grid.size if plan.grid else 0)
    coordinates = system.coordinates
    states = coordinates.wrap(plan.grid.states())
    regions = [region_of_data(system, piece).over(coordinates) for piece in pieces]
    return np.flatnonzero(np.logical_or.reduce([np.zeros(len(states), bool), *(each.contains(states) for each in regions)]))


def _surfaces_in(plan: "Plan", system: "System", numbers: "Ints") -> Surfaces:
    """The surfaces of all families over some states of the grid, those with these numbers."""
    if plan.grid is None:
        return {}
    returns = system.first_return(plan.grid.states()[numbers])
    found = surfaces_among(system, returns, plan.grid, plan.families.values())
    masks = {name: np.isin(np.arange(plan.grid.size), numbers[surface.member]) for name, surface in found.items()}
    return {name: replace(surface, member=masks[name]) for name, surface in found.items()}


def map_along(plan: "Plan", result: "StudyResult", of: str, parameter: str) -> "Callable[[float], ReturnMap]":
    """A map of a study as a function of a parameter, which can be pickled.

    The composite map is fitted at each value, and so is a piece, whose map then applies to all states.
    """
    system_at = Along(plan.system, parameter)
    if of == "exact":
        return system_at
    if of == "parametric":
        assert result.parametric_map is not None
        return result.parametric_map.at
    if of == "composite":
        return _Refitted(plan, system_at)
    (piece,) = (piece for piece in plan.bound["composite"] if piece.name == of)
    anywhere = replace(
        piece, region=ConditionRegion(text="0 < 1", coordinates=plan.system.coordinates), data=piece.data or piece.region
    )
    return _Refitted(replace(plan, bound=plan.bound | {"composite": (anywhere,)}), system_at)


@dataclass(frozen=True, slots=True, eq=False)
class _Refitted:
    """The composite map over a parameter, fitted at each value."""

    plan: "Plan"
    system_at: "Along[System]"

    def __call__(self, value: float) -> CompositeMap:
        return refit(self.plan, self.system_at(value))[0]
