"""The section `domains`: attracting domains, each of one map from one start box."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.figures.parts import invariant_or_first
from nsmaps.progress import Progress
from nsmaps.reduced.conditions.region import Box
from nsmaps.reduced.fit.lifts import unwrapped
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.study.ahead import call_boxes
from nsmaps.study.conclusions.attraction import domains_findings
from nsmaps.study.conclusions.diagnostics import share_carried_out
from nsmaps.study.conclusions.phrases import at, part_of
from nsmaps.study.conclusions.texts import finite, intervals
from nsmaps.study.conclusions.titles import map_title, pieces_with_a_map
from nsmaps.study.estimates import UPDATE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.values import ATTRACTING, DIAGONAL
from nsmaps.study.sections.base import Entries, Finding, Need, Verdict, claimed
from nsmaps.study.sections.maps.diagonal import near_diagonals
from nsmaps.study.sections.maps.partition import attracting_of, is_of_partition
from nsmaps.study.sections.sets.domain import DomainSection, composite_verdict, settled_text, trapped_text
from nsmaps.study.sections.sets.morse import EXACT_ORBITS

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.auxiliary.worst_case_limits import TwoCycle
    from nsmaps.study.ahead import Call
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


def _with_values(result: "StudyResult") -> "Mapping[str, AttractingDomain]":
    """The domains whose auxiliary maps have values, by name."""
    found = {name: domain for name, domain in result.domains.items() if _has_values(domain)}
    if result.domains and not found:
        why = "; ".join(f"domain {name!r}: {domain.reason}" for name, domain in result.domains.items())
        raise NsmapsError(f"no auxiliary map has a value ({why}); expected: a domain in whose start box the map has images")
    return found


def _has_values(domain: "AttractingDomain") -> bool:
    """Whether both auxiliary maps of a coordinate are finite somewhere."""
    curves = [(each.lower, each.upper) for update in domain.updates for each in update.envelopes]
    return any(bool(np.isfinite(pair).all(axis=0).any()) for pair in curves)


ENVELOPED: "FigurePart[Mapping[str, AttractingDomain]]" = FigurePart("auxiliary maps", ("domains",), _with_values)
DOMAINS: "FigurePart[Mapping[str, AttractingDomain]]" = FigurePart("attracting domains", ("domains",))


class Domains(Entries[DomainSection]):
    """Attracting domains, each bounded by auxiliary maps (section 6)."""

    key: ClassVar[str] = "domains"
    results: ClassVar[Mapping[str, Any]] = {
        "domains": {},
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "domains.auxiliary",
            "Families of curves of the map between their upper and lower envelopes, above the first steps between these.",
            "The image of each coordinate for values of the other (grey), between the lower and the upper auxiliary map; "
            "below, the worst-case steps from the box (dotted), with the points at which the upper map is largest and the "
            "lower one least. If the box is forward invariant, the interval of the first step is green. The title has the "
            "width of the box to which the update leads.",
            (ENVELOPED,),
            by_domain=True,
        ),
        StudyFigure(
            "domains.envelopes",
            "The upper and lower auxiliary maps with the cobwebs between them.",
            "The lower and upper auxiliary map of each coordinate at the first, the second and the last update, with the "
            "worst-case steps from the box (dotted). If the box is forward invariant, they converge to the yellow interval "
            "from p to q, the next box. The thin line is an orbit of both maps in turn, omitted if it converges to no cycle.",
            (ENVELOPED,),
            by_domain=True,
        ),
        StudyFigure(
            "domains.domain_size",
            "The width of the attracting domain after each update, one coordinate a panel.",
            "The width of the box after each update of the auxiliary maps, for each domain that is forward invariant; the "
            "title names those that are not.",
            (DOMAINS,),
        ),
        StudyFigure(
            "domains.boxes",
            "The boxes of each attracting domain in the plane of states, with the states of orbits.",
            "The box of each domain that is forward invariant after each update, the darker the later, in the plane of two "
            "coordinates, with the states of exact orbits, over the cells of Morse sets if the study has them. No orbit leaves a "
            "box of an enclosed domain.",
            (DOMAINS, EXACT_ORBITS, optional("morse_sets")),
        ),
    )

    def needs(self) -> Iterator[Need]:
        for number, domain in enumerate(self):
            if domain.box == DIAGONAL:
                yield ("domains", number, "box"), f"the start box of the domain {domain.name!r}", "diagonal"

    def check(self, study: "Study") -> None:
        study.once("domains", [domain.name for domain in self])
        fitted = pieces_with_a_map(study)
        maps = ["composite"] if study.composite else ["composite", ATTRACTING] if study.partition else []
        for number, domain in enumerate(self):
            if not is_of_partition(study, domain.map):
                study.source.known(("domains", number, "map"), domain.map, ["exact", *maps, *fitted], "map")

    def bind(self, binding: "Binding") -> dict[str, Box]:
        """The given start boxes, by the name of the domain."""
        given = ((k, domain.name, domain.box) for k, domain in enumerate(self))
        return {name: binding.box(("domains", k, "box"), box) for k, name, box in given if not isinstance(box, str)}

    def calls(self) -> "tuple[Call, ...]":
        return (call_boxes,) if any(each.map == "exact" and each.bounds_kind in (None, "enclosed") for each in self) else ()

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The attracting domains, each of the map that the study names for it."""
        domains = {}
        for number, section in enumerate(self):
            with plan.study.source.located(("domains", number)):
                progress = plan.portion(number, len(self)).progress
                domains[section.name] = _domain_of(plan, result, section, progress)
        return {"domains": domains}

    def describe(self, study: "Study") -> str:
        return ", ".join(f"{each.name} (map {each.map}, {each.max_updates} updates)" for each in self)

    def size(self, study: "Study", system: "System") -> Size:
        """The size of all updates; most domains converge earlier."""
        of_pieces = {piece.name for piece in study.composite}
        each = [(UPDATE / 10 if d.map in of_pieces else UPDATE) * (3 if d.grow else 1) * d.max_updates for d in self]
        return Size(sum(each), 1e5 * float(sum(d.max_updates for d in self)))

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        return {"domains": {name: _domain(domain) for name, domain in result.domains.items()}}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        yield from domains_findings(result)

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        for section in result.study.domains:
            domain = result.domains.get(section.name)
            if domain is not None:
                yield _verdict(
                    section, domain, "forward_invariant", domain.forward_invariant, trapped_text(result, section, domain)
                )
                yield _verdict(section, domain, "converged", domain.converged, settled_text(domain))
                if (share := share_carried_out(result, section.map, domain)) is not None:
                    yield composite_verdict(section, share)

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The start box and the last box of a domain and whether they bound, or the sides of every domain."""
        if figure in ("domain_size", "boxes"):
            return _sides_of_all(result)
        domain = result.domains.get(name := part_of(result.domains if part else invariant_or_first(result.domains), part))
        if domain is None:
            return ""
        start = intervals(domain.coordinates, domain.boxes[0], inward=True)
        text = f"{at(result)}domain {name}, {domain.claim}. From {start}"
        if not domain.forward_invariant:
            return f"{text}; no domain: {domain.reason.rstrip('.')}."
        return f"{text} to {intervals(domain.coordinates, domain.box)} after {len(domain.updates)} updates."


def _sides_of_all(result: "StudyResult") -> str:
    """The sides of every domain that is forward invariant, and the names of the others."""
    bounded = {name: domain for name, domain in result.domains.items() if domain.forward_invariant}
    others = [name for name in result.domains if name not in bounded]
    lines = [f"{name} from {_sides(domain, 0)} to {_sides(domain, -1)}" for name, domain in bounded.items()]
    lines += [f"not forward invariant: {', '.join(others)}"] if others else []
    return f"{at(result)}{'; '.join(lines)}." if lines else ""


def _sides(domain: "AttractingDomain", update: int) -> str:
    return " x ".join(f"{side:.3g}" for side in domain.sizes[update])


def _domain_of(plan: "Plan", result: "StudyResult", section: DomainSection, progress: Progress | None) -> "AttractingDomain":
    """The attracting domain of an entry, of the map that it names."""
    pieces = {piece.name: piece for piece in result.composite.pieces} if result.composite else {}
    maps: dict[str, Any] = {name: piece.map for name, piece in pieces.items()}
    maps |= {"exact": plan.system, "composite": result.reduced}
    if plan.study.partition is not None:
        if result.partition is not None:
            maps[ATTRACTING] = attracting_of(result.partition)
        if section.map not in maps:
            raise NsmapsError(f"the partition has no piece {section.map!r}; expected: {', '.join(maps)}")
    of_partition = plan.study.partition is not None and section.map in pieces
    of = f"fitted map {section.map}" if of_partition else map_title(plan.study, plan.system, section.map)
    if section.map in pieces and (number := pieces[section.map].returns) > 1:
        of = f"{of} ({number} returns)"
    elif section.map == "composite" and result.composite is not None:
        of = result.composite.title
    return _bounded(plan, section, maps[section.map], _start_box(plan, result, section), of, progress)


def _start_box(plan: "Plan", result: "StudyResult", section: DomainSection) -> tuple[Floats, Floats | None]:
    """The start box of a domain, shape (n, 2): given, or the hull of the states near the diagonals, with the nearest state."""
    boxes: dict[str, Box] = plan.bound["domains"]
    if section.name in boxes:
        return boxes[section.name].array, None
    near, box = near_diagonals(plan, result.surfaces[plan.study.diagonal.family])
    (surface,) = near.values()
    start, image = unwrapped(surface)
    return box.array, start[np.argmin(np.abs((image - start) / np.ptp(box.array, axis=1)).max(axis=1))]


def _bounded(
    plan: "Plan",
    section: DomainSection,
    return_map: Any,
    start: tuple[Floats, Floats | None],
    of: str,
    progress: Progress | None,
) -> "AttractingDomain":
    """The domain; one whose bounds are inflated by the held-out error of its map is an estimate for the exact map."""
    from nsmaps.auxiliary.attracting_domain import attracting_domain
    from nsmaps.auxiliary.bounds import held_out_error

    box, around = start
    how: Any = {"grow": section.grow, "of": of, "bounds_kind": section.bounds_kind, "around": around, "progress": progress}
    if section.bounds_kind == "inflated" and isinstance(return_map, PolyMap):
        how |= {"error": held_out_error(return_map, plan.system, box), "of": f"exact map, by {of}"}
    return attracting_domain(return_map, box, max_updates=section.max_updates, **how)


def _domain(domain: "AttractingDomain") -> dict[str, Any]:
    return {
        "of": domain.of,
        "boxes": [[finite(side) for side in box] for box in domain.boxes],
        "forward_invariant": bool(domain.forward_invariant),
        "converged": bool(domain.converged),
        "status": domain.status,
        "reason": domain.reason,
        "two_cycle": [finite(pair) for pair in domain.two_cycle],
        "part": list(domain.part),
        "envelopes": [[envelope.kind for envelope in update.envelopes] for update in domain.updates],
        "cycles": [_cycle(cycle) for cycle in domain.cycles],
    }


def _cycle(cycle: "TwoCycle") -> dict[str, Any]:
    """p and q of one coordinate by both methods, their largest difference, and their accuracy."""
    difference, accuracy = finite([np.abs(cycle.iterated - cycle.roots).max(), cycle.accuracy])
    p_and_q = {"iterated": finite(cycle.iterated), "roots": finite(cycle.roots), "slope": finite([cycle.slope])[0]}
    found = {"stable": cycle.stable, "agree": cycle.agree, "difference": difference, "accuracy": accuracy}
    return {"coordinate": str(cycle.coordinate), **p_and_q, **found}


def _verdict(section: DomainSection, domain: "AttractingDomain", claim: str, holds: bool, text: str) -> Verdict:
    return claimed(section, claim, f"domain {section.name}: {claim.replace('_', ' ')}", domain.of, holds, text)
