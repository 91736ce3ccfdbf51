"""What attracts, in words: the limit sets of orbits, and the box in which orbits stay."""

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.auxiliary.bounds import ESTIMATED
from nsmaps.study.conclusions.diagnostics import inside
from nsmaps.study.conclusions.texts import COMPOSITE, EXACT, count_of, counted, cycle_of, intervals, point
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Finding

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.dynamics.attractors.limit_set import LimitSet

ONE = 1e-5  #: relative to the extent of the orbits: largest distance of cycles that are taken as one
STABLE = {True: "stable ", False: "unstable ", None: ""}
ALL = 0.99  #: smallest ratio of sides at which the last box is taken as the start box
DOUBTS = {ESTIMATED: "estimated by the held-out error of the fit: ", "sampled": "sampled on a grid of states: "}


def orbits_findings(result: StudyResult) -> Iterator[Finding]:
    """What the orbits of the exact map end on; nothing where none completes all returns."""
    found = [pair.ends for pair in result.orbits if pair.ends is not None]
    ends, total = [end for end in found if end.period or end.label], len(result.orbits)  # not of orbits that end when followed
    kinds = _kinds(result, ends)
    if not kinds:
        return
    each = [_kind(kind[0]) for kind in kinds]
    lost = f"; {counted(total - len(ends))} of the {total} orbits followed ends" if len(ends) < total else ""
    if len(kinds) == 1:
        which = {1: "the one orbit followed ends", 2: "both orbits followed end"}.get(total, f"all {total} orbits followed end")
        which = f"{counted(len(ends))} of the {total} orbits followed end{'s' * (len(ends) == 1)}" if lost else which
        text = f"{each[0]}, on which {which}{lost}"
    elif len(ends) == len(kinds):
        text = f"{' and '.join(each)}, on each of which one of the {counted(total)} orbits followed ends{lost}"
    else:
        shares = " and ".join(counted(len(kind)) for kind in kinds)
        text = f"{' and '.join(each)}, on which {shares} of the {total} orbits followed end{lost}"
    numbers = (number for kind in kinds for number in _numbers(result, kind[0]))
    yield Finding(result.system.map_name, text, tuple(numbers))


def _kinds(result: StudyResult, ends: "Sequence[LimitSet]") -> "list[list[LimitSet]]":
    """Limit sets in groups: cycles with the same states, and all sets without a period, which need not be the same set."""
    from nsmaps.dynamics.attractors.distance import extents, hausdorff

    kinds: list[list[LimitSet]] = []
    coordinates = result.system.coordinates
    states = np.concatenate([np.empty((0, len(coordinates))), *(pair.exact.states for pair in result.orbits)])
    scale = extents(states[np.isfinite(states).all(axis=1)], coordinates) if ends else np.ones(len(coordinates))
    for end in ends:
        for kind in kinds:
            same = not end.period or hausdorff(end.states, kind[0].states, coordinates, scale, np.inf) <= ONE
            if end.period == kind[0].period and same:
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


def _numbers(result: StudyResult, end: "LimitSet") -> Iterator[tuple[str, str]]:
    """A state of a cycle and the modulus of its largest multiplier, or the exponent of a motion without a period."""
    if not end.period:
        if isfinite(end.exponent):
            yield f"{end.exponent:.3g} +- {end.exponent_error:.1g}", f"largest Lyapunov exponent per return of {end.label}"
        return
    what = f"the {STABLE[end.stable]}{cycle_of(end.period)}"
    yield point(result.system.coordinates, end.states[0]).strip("()"), f"a state of {what}" if end.period > 1 else what
    if len(end.multipliers):
        factor = abs(complex(end.multipliers[0]))
        yield f"{factor:.4g}", f"factor by which deviations change in {count_of(end.period, 'return')}"


def domains_findings(result: StudyResult) -> Iterator[Finding]:
    """The box in which orbits stay: the smallest forward invariant one of the surest kind."""
    invariant = [domain for domain in result.domains.values() if domain.forward_invariant]
    exact = [domain for domain in invariant if domain.of == EXACT and domain.status not in DOUBTS]
    closed = result.forward_invariant_set
    if not invariant or (not exact and closed is not None and closed.forward_invariant):
        return
    domain = min(invariant, key=_rank)
    sides = " x ".join(f"{size:.3g}" for size in domain.sizes[-1])
    before = " x ".join(f"{size:.3g}" for size in domain.sizes[0])
    yield Finding(domain.of, _stays(result, domain), ((sides, f"sides of the box that keeps every orbit from one of {before}"),))


def _rank(domain: "AttractingDomain") -> tuple[bool, int, float]:
    """A key by which what is enclosed precedes the rest, the exact map, then the composite one others, small boxes large ones."""
    maps = [domain.of.startswith(EXACT), domain.of == COMPOSITE, True]
    return domain.status in DOUBTS, maps.index(True), float(np.prod(domain.sizes[-1] / domain.sizes[0]))


def _stays(result: StudyResult, domain: "AttractingDomain") -> str:
    """The statement that orbits from the start box enter the last box and stay, and whether that contains the attractors."""
    start, end = intervals(domain.coordinates, domain.boxes[0], inward=True), intervals(domain.coordinates, domain.boxes[-1])
    how = "" if domain.status in DOUBTS else " (enclosed)"
    goes = f"enters {end} and stays there" if (domain.sizes[-1] < ALL * domain.sizes[0]).any() else f"stays in {end}"
    return f"{DOUBTS.get(domain.status, '')}every orbit from {start} {goes}{how}{_holds(result, domain)}"


def _holds(result: StudyResult, domain: "AttractingDomain") -> str:
    """Whether a box of the exact map contains the limit sets of the orbits of that map."""
    ends = [pair.ends.states for pair in result.orbits if pair.ends is not None]
    if not ends or domain.of != EXACT:
        return ""
    held = [bool(inside(domain, states).all()) for states in ends]
    if all(held):
        return ", which contains the attractors of the orbits"
    return ", which contains no attractor of the orbits" if not any(held) else ""
