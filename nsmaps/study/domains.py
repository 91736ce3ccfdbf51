"""The attracting domains of a study: of which map, from which box, bounded how; and the second iterate of one of them."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.errors import FitError, NsmapsError
from nsmaps.exact.surface import Surface
from nsmaps.reduced.composite import CompositeMap
from nsmaps.reduced.diagonal import attracting
from nsmaps.reduced.partition import PartitionResult
from nsmaps.reduced.polyfit import unwrapped
from nsmaps.reduced.polymap import PolyMap
from nsmaps.reduced.region import Box
from nsmaps.study.needs import ATTRACTING
from nsmaps.study.plan import Plan
from nsmaps.study.result import StudyResult
from nsmaps.study.spec import DomainSection

if TYPE_CHECKING:
    from nsmaps.auxiliary.domain import AttractingDomain
    from nsmaps.auxiliary.iterate import SecondIterate
    from nsmaps.exact.impacts import Floats


def domain_of(plan: Plan, result: StudyResult, section: DomainSection, progress: Callable[[int], None]) -> "AttractingDomain":
    """The attracting domain that a section asks for, of the map that it names."""
    pieces = {piece.name: piece.map for piece in result.composite.pieces} if result.composite else {}
    maps: dict[str, Any] = {**pieces, "exact": plan.system, "composite": result.reduced}
    if plan.study.partition is not None:
        if result.partition is not None:
            maps[ATTRACTING] = _attracting(result.partition)
        if section.map not in maps:
            raise NsmapsError(f"the partition made no piece {section.map!r}; accepted: {', '.join(maps)}")
    printed = [piece.name for piece in plan.pieces if piece.polynomial]
    kind = "printed" if section.map in printed else "fitted"
    of = f"{kind} map {section.map}" if section.map in pieces else f"{section.map} map"
    return _bounded(plan, section, maps[section.map], _start_box(plan, result, section), of, progress)


def near_diagonals(plan: Plan, surface: Surface) -> tuple[dict[str, Surface], Box]:
    """The part of a surface that is near the diagonals at the study's own parameters, and its hull."""
    assert plan.diagonal is not None
    near = surface.restricted(attracting(plan.diagonal, surface))
    if len(near.start) < 2:
        raise FitError(f"the family {surface.name!r} has {len(near.start)} states near the diagonals on the grid")
    hull = np.stack([near.start.min(axis=0), near.start.max(axis=0)], axis=1)
    return {surface.name: near}, Box.of(surface.coordinates, hull)


def _start_box(plan: Plan, result: StudyResult, section: DomainSection) -> "tuple[Floats, Floats | None]":
    """The start box of a domain, shape (n, 2): as given, or around the states near the diagonals, with the nearest of them."""
    if section.name in plan.boxes:
        return plan.boxes[section.name].array, None
    assert plan.study.diagonal is not None
    near, box = near_diagonals(plan, result.surfaces[plan.study.diagonal.family])
    (surface,) = near.values()
    start, image = unwrapped(surface)
    return box.array, start[np.argmin(np.abs((image - start) / np.ptp(box.array, axis=1)).max(axis=1))]


def _bounded(
    plan: Plan,
    section: DomainSection,
    map: Any,
    start: "tuple[Floats, Floats | None]",
    of: str,
    progress: Callable[[int], None],
) -> "AttractingDomain":
    """The domain; one whose bounds are inflated by the held-out error of its map is an estimate for the exact map."""
    from nsmaps.auxiliary.bounds import held_out_error
    from nsmaps.auxiliary.domain import attracting_domain

    box, around = start
    how: Any = {"grow": section.grow, "of": of, "bounds": section.bounds, "around": around, "progress": progress}
    if section.bounds == "inflated" and isinstance(map, PolyMap):
        how |= {"error": held_out_error(map, plan.system, box), "of": f"exact map, by {of}"}
    return attracting_domain(map, box, section.updates, **how)


def _attracting(made: PartitionResult) -> PolyMap | CompositeMap:
    """The polynomials of the attracting piece, or the composite map of several."""
    attracting = made.attracting_map
    return attracting.pieces[0].map if len(attracting.pieces) == 1 else attracting


def second_iterate_of(result: StudyResult) -> "SecondIterate":
    """The second iterate of the first coordinate, between the last bounds of the second (eq. seconditerativev)."""
    from nsmaps.auxiliary.iterate import second_iterate

    section = result.study.second_iterate
    assert section is not None
    assert result.composite is not None
    piece = next(domain.map for domain in result.study.domains if domain.name == section.domain)
    attracting = _attracting(result.partition) if result.partition and piece == ATTRACTING else None
    if isinstance(attracting, CompositeMap):
        count = len(attracting.pieces)
        raise NsmapsError(f"the second iterate is of one piece, and {count} are attracting; accepted: a domain of one of them")
    polymap = attracting or result.composite.piece(piece).map
    low, high = result.domains[section.domain].updates[-1].box[1]  # of the last auxiliary maps, whose two-cycle is (p, q)
    return second_iterate(polymap, float(low), float(high))
