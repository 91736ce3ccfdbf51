"""The result of a run in one or two sentences: attractors and attracting domains, the map, and the kind of evidence."""

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.auxiliary.bounds import ESTIMATED
from nsmaps.dynamics.motion import MEANING, kind_of
from nsmaps.study.conclusions.diagnostics import inside
from nsmaps.study.conclusions.phrases import counted, cycle_of
from nsmaps.study.conclusions.texts import COMPOSITE, EXACT, as_computed, intervals
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.parameters.motions import motions_of

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.dynamics.attractors.basins import Basins
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
    from nsmaps.study.sections.parameters.bifurcation import BifurcationSection

SAME = 1e-5  #: relative to the extent of the orbits: largest distance of cycles that are taken as one
STABLE = {True: "stable ", False: "unstable ", None: ""}
ALL = 0.99  #: smallest ratio of sides at which the last box is taken as the start box
DOUBTS = {ESTIMATED: "estimated by the held-out error of the fit: ", "sampled": "sampled on a grid of states: "}


def headline(result: StudyResult) -> str:
    """The attractors, and the box in which orbits stay, with the map to which each statement applies; empty without either.

    Attractors are those of the exact map that were found by basins, otherwise by orbits, otherwise by a diagram: there may be
    others. The box is the smallest forward invariant one: of the exact map if that has an enclosed one, otherwise of another map.
    """
    texts: dict[str, list[str]] = {}
    for of, text in (*_attracts(result), *_stays(result)):
        texts.setdefault(as_computed(result, of), []).append(as_computed(result, text))
    return " ".join(f"{of[0].upper()}{of[1:]}: {'; '.join(parts)}." for of, parts in texts.items())


def _attracts(result: StudyResult) -> Iterator[tuple[str, str]]:
    if result.basins is not None and result.study.basins is not None:
        yield result.system.map_name, _basins(result.basins)
    elif text := _orbits(result):
        yield result.system.map_name, text
    elif "exact" in result.bifurcation and result.study.bifurcation is not None:
        yield result.system.map_name, _diagram(result.bifurcation["exact"], result.study.bifurcation)


def _diagram(diagram: "BifurcationDiagram", section: "BifurcationSection") -> str:
    """The motions of the first orbit of a diagram, and the values."""
    return f"for {section.parameter} from {section.low:g} to {section.high:g} {motions_of(diagram)}"


def _basins(found: "Basins") -> str:
    """The number of attractors and of starts, and the percentage of the starts that reach each."""
    shares = [f"{100 * share:.3g} %" for share in found.fractions]
    listed = [
        f"{share} to {'a ' + cycle_of(each.period) if each.period else MEANING[kind_of(each.label)]} ({each.label})"
        for each, share in zip(found.attractors, shares, strict=False)
    ]
    more = zip(shares[-2:], found.fractions[-2:], ("to none", "ended"), strict=True)
    others = [f"{percent} {what}" for percent, share, what in more if share > 0]
    number = f"{counted(len(listed))} attractor{'' if len(listed) == 1 else 's'} found"
    return f"{number} from {len(found.label)} states of the grid: {', '.join(listed + others)}"


def _orbits(result: StudyResult) -> str:
    """What the orbits of the exact map end on; empty where none completes all returns."""
    ends, total = [pair.ends for pair in result.orbits if pair.ends is not None], len(result.orbits)
    kinds = _kinds(result, ends)
    if not kinds:
        return ""
    each = [_kind(kind[0]) for kind in kinds]
    lost = f"; {counted(total - len(ends))} of the {total} orbits followed ends" if len(ends) < total else ""
    if len(kinds) == 1:
        which = {1: "the one orbit followed ends", 2: "both orbits followed end"}.get(total, f"all {total} orbits followed end")
        which = f"{counted(len(ends))} of the {total} orbits followed end{'s' * (len(ends) == 1)}" if lost else which
        return f"{each[0]}, on which {which}{lost}"
    if len(ends) == len(kinds):
        return f"{' and '.join(each)}, on each of which one of the {counted(total)} orbits followed ends{lost}"
    shares = " and ".join(counted(len(kind)) for kind in kinds)
    return f"{' and '.join(each)}, on which {shares} of the {total} orbits followed end{lost}"


def _kinds(result: StudyResult, ends: "Sequence[LimitSet]") -> "list[list[LimitSet]]":
    """Limit sets in groups: cycles with the same states, and all sets without a period, which need not be the same set."""
    from nsmaps.dynamics.attractors.distance import hausdorff

    kinds: list[list[LimitSet]] = []
    states = np.concatenate([np.empty((0, len(result.system.coordinates))), *(pair.exact.states for pair in result.orbits)])
    near = SAME * float(np.linalg.norm(np.ptp(states[np.isfinite(states).all(axis=1)], axis=0))) if ends else 0.0
    for end in ends:
        for kind in kinds:
            first = kind[0]
            if end.period == first.period and (
                not end.period or hausdorff(end.states, first.states, result.system.coordinates) <= near
            ):
                kind.append(end)
                break
        else:
            kinds.append([end])
    return kinds


def _kind(end: "LimitSet") -> str:
    """The name of a cycle or of a motion without a period."""
    name = f" ({end.name})" if end.name else ""
    if end.period:
        return f"one {STABLE[end.stable]}{cycle_of(end.period)}{name}"
    exponent = f", largest Lyapunov exponent {end.exponent:.2g} +- {end.exponent_error:.1g}" if isfinite(end.exponent) else ""
    return f"{end.meaning}{name}{exponent}"


def _stays(result: StudyResult) -> Iterator[tuple[str, str]]:
    """The set in which orbits stay: the smallest forward invariant box of the surest kind, or the cells of a closed set."""
    invariant = [domain for domain in result.domains.values() if domain.forward_invariant]
    exact = [domain for domain in invariant if domain.of == EXACT and domain.status not in DOUBTS]
    if not exact and result.trap is not None and result.trap.forward_invariant:
        cells, hull = result.trap.numbers, intervals(result.trap.cells.coordinates, result.trap.hull)
        yield result.trap.of, f"every orbit from {len(cells)} cells within {hull} stays in them (enclosed)"
    elif invariant:
        domain = min(invariant, key=_rank)
        yield domain.of, _domain(result, domain)


def _rank(domain: "AttractingDomain") -> tuple[bool, int, float]:
    """A key by which what is enclosed precedes the rest, the exact map, then the composite one others, small boxes large ones."""
    maps = [domain.of.startswith(EXACT), domain.of == COMPOSITE, True]
    return domain.status in DOUBTS, maps.index(True), float(np.prod(domain.sizes[-1] / domain.sizes[0]))


def _domain(result: StudyResult, domain: "AttractingDomain") -> str:
    """The statement that orbits from the start box enter the last box and stay, and whether that contains the attractors."""
    start, end = intervals(domain.coordinates, domain.boxes[0], inward=True), intervals(domain.coordinates, domain.boxes[-1])
    how = "" if domain.status in DOUBTS else " (enclosed)"
    goes = f"enters {end} and stays there" if (domain.sizes[-1] < ALL * domain.sizes[0]).any() else f"stays in {end}"
    stays = f"every orbit from {start} {goes}{how}"
    return f"{DOUBTS.get(domain.status, '')}{stays}{_holds(result, domain)}"


def _holds(result: StudyResult, domain: "AttractingDomain") -> str:
    """Whether a box of the exact map contains the limit sets of the orbits of that map."""
    ends: list[Floats] = [pair.ends.states for pair in result.orbits if pair.ends is not None]
    if not ends or domain.of != EXACT:
        return ""
    held = [bool(inside(domain, states).all()) for states in ends]
    if all(held):
        return ", which contains the attractors of the orbits"
    return ", which contains no attractor of the orbits" if not any(held) else ""
