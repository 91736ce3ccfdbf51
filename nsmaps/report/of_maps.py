"""Captions of surfaces, fits, composite maps and domains; each is empty where the result has no numbers for it."""

from collections.abc import Mapping
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.figures.parts import invariant_or_first
from nsmaps.report.phrases import MOST, at, listed, part_of
from nsmaps.study.conclusions.headline import cycle_of
from nsmaps.study.conclusions.texts import intervals, point, range_text
from nsmaps.study.result import StudyResult

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.dynamics.attractors.limit_set import LimitSet, OrbitPair


def returns(result: StudyResult, part: str) -> str:
    """The grid, and the shares of the words of its first returns."""
    found = result.returns
    if found is None or not len(found):
        return ""
    words, counts = np.unique(found.words[found.valid], return_counts=True)
    shares = dict(zip(words.tolist(), (counts / len(found)).tolist(), strict=True))
    lost = 1 - float(found.valid.mean())
    none = f"; {100 * lost:.2g} % do not return" if lost else ""
    return f"{at(result)}{len(found):,} states in {_hull(result, found.start)}, by word {listed(shares)}{none}."


def _hull(result: StudyResult, states: Floats) -> str:
    """The intervals of coordinates that vary, and the values of the others."""
    box, names = np.stack([states.min(axis=0), states.max(axis=0)], axis=1), result.system.coordinates
    free = np.ptp(box, axis=1) > 0
    inside = intervals([name for name, varies in zip(names, free, strict=True) if varies], box[free])
    held = "".join(f", {name} = {low:.5g}" for name, low, varies in zip(names, box[:, 0], free, strict=True) if not varies)
    return inside + held


def family(result: StudyResult, part: str) -> str:
    """The states of one family."""
    family = part_of(result.surfaces, part)
    surface, found = result.surfaces.get(family), result.returns
    if surface is None or found is None or not part:
        return returns(result, part)
    share = 100 * len(surface.start) / len(found)
    return f"{at(result)}{len(surface.start):,} states of the family {family}, {share:.3g} % of the grid."


def pieces(result: StudyResult, part: str) -> str:
    """The share of the grid of each piece."""
    if result.coverage is None:
        return ""
    shares = dict(zip(result.coverage.names, result.coverage.fractions.tolist(), strict=True))
    left = 1 - result.coverage.fraction
    none = f"; {100 * left:.2g} % in no piece" if left > 0 else ""
    return f"{at(result)}shares of the grid {listed(shares)}{none}."


def orbits(result: StudyResult, part: str) -> str:
    """Where the orbits end, under each map."""
    ends = []
    for pair in result.orbits:
        other = f" and {_end(result, pair.composite_ends)} under the composite map" if pair.composite is not None else ""
        ends.append((pair, f"{_end(result, pair.ends)} under the exact map{other}"))
    return _from_to(result, ends)


def cobweb(result: StudyResult, part: str) -> str:
    """Where the orbit of the composite map ends that a sheet shows."""
    pair = result.orbits[int(part) - 1 if part.isdecimal() and 0 < int(part) <= len(result.orbits) else 0]
    return _from_to(result, [(pair, _end(result, pair.composite_ends))] if pair.composite is not None else [])


def _from_to(result: StudyResult, ends: "Sequence[tuple[OrbitPair, str]]") -> str:
    """The starts of orbits by where they end."""
    starts: dict[str, list[str]] = {}
    for pair, end in ends:
        starts.setdefault(end, []).append(point(result.system.coordinates, pair.start))
    lines = [f"from {' and '.join(each[:MOST])}{' and others' * (len(each) > MOST)} to {end}" for end, each in starts.items()]
    more = f"; {len(lines) - MOST} more" if len(lines) > MOST else ""
    return f"{at(result)}{'; '.join(lines[:MOST])}{more}." if lines else ""


def _end(result: StudyResult, end: "LimitSet | None") -> str:
    if end is None:
        return "no limit, as it ends"
    if end.period == 1:
        return f"the fixed point {point(result.system.coordinates, end.states[0])}"
    name = f" ({end.name})" if end.name else ""
    return f"a {cycle_of(end.period)}{name}" if end.period else f"{end.meaning}{name}"


def domain(result: StudyResult, part: str) -> str:
    """The start box and the last box of a domain, and whether they bound."""
    domain = result.domains.get(name := part_of(result.domains if part else invariant_or_first(result.domains), part))
    if domain is None:
        return ""
    start = intervals(domain.coordinates, domain.boxes[0], inward=True)
    text = f"{at(result)}domain {name}, {domain.claim}. From {start}"
    if not domain.forward_invariant:
        return f"{text}; no domain: {domain.reason.rstrip('.')}."
    return f"{text} to {intervals(domain.coordinates, domain.box)} after {len(domain.updates)} updates."


def sizes(result: StudyResult, part: str) -> str:
    """The sides of every domain that is forward invariant, and the names of the others."""
    bounded = {name: domain for name, domain in result.domains.items() if domain.forward_invariant}
    others = [name for name in result.domains if name not in bounded]
    lines = [f"{name} from {_sides(domain, 0)} to {_sides(domain, -1)}" for name, domain in bounded.items()]
    lines += [f"not forward invariant: {', '.join(others)}"] if others else []
    return f"{at(result)}{'; '.join(lines)}." if lines else ""


def _sides(domain: "AttractingDomain", update: int) -> str:
    return " x ".join(f"{side:.3g}" for side in domain.sizes[update])


def second(result: StudyResult, part: str) -> str:
    """The domain of the second iterate, and the ends p and q of its box."""
    spec = result.study.second_iterate
    domain = result.domains.get(spec.domain) if spec else None
    if domain is None or not domain.forward_invariant:
        return ""
    ends = zip(domain.coordinates, domain.two_cycle, strict=True)
    return f"{at(result)}domain {spec.domain}; {'; '.join(f'p = {p:.5g} and q = {q:.5g} of {name}' for name, (p, q) in ends)}."


def partition(result: StudyResult, part: str) -> str:
    """The tolerance, the number of pieces, and those that attract."""
    found = result.partition
    if found is None:
        return ""
    error = f", largest error in them {found.max_error:.2g}" if isfinite(found.max_error) else ""
    pieces = f"{len(found.composite.pieces)} pieces, attracting: {', '.join(found.attracting) or 'none'}"
    return f"{at(result)}tolerance {found.spec.tolerance:g}; {pieces}{error}."


def strips(result: StudyResult, part: str) -> str:
    """The number of cells and of coefficients, and the largest error."""
    if result.accurate is None:
        return ""
    report, error = result.accurate.strips.report, max(result.accurate.uniform.largest, result.accurate.beside.largest)
    return f"{at(result)}{report.leaves:,} cells with {report.coefficients:,} coefficients; largest held-out error {error:.2g}."


def speed(result: StudyResult, part: str) -> str:
    """The time of the reduced map beside that of the exact one."""
    return f"{at(result)}{result.speed.text}." if result.speed else ""


def motion(result: StudyResult, part: str) -> str:
    """The starts of the motions."""
    starts = [point(result.system.coordinates, pair.start) for pair in result.orbits if pair.track is not None]
    return f"{at(result)}from {'; '.join(starts[:MOST])}." if starts else ""


def slices(result: StudyResult, part: str) -> str:
    """The values at which coordinates are held."""
    lines = [f"{len(each.returns):,} states along {each.along} with {_held(each.at)}" for each in result.slices]
    return f"{at(result)}{'; '.join(lines)}." if lines else ""


def _held(at: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.5g}" for name, value in at.items())


def diagonal(result: StudyResult, part: str) -> str:
    """The number of states near the diagonals, and their hull."""
    region, spec = result.diagonal, result.study.diagonal
    if region is None or spec is None or not len(region.start):
        return ""
    varied = (spec.sweep.parameter,) if spec.sweep else ()
    over = f" over {range_text(spec.sweep)}" if spec.sweep else ""
    hull = intervals(region.coordinates, region.box)
    return f"{at(result, varied)}delta = {region.delta:g}, {len(region.start):,} states{over}, all in {hull}."


def near(result: StudyResult, part: str) -> str:
    """The number of states near the diagonals at the parameters of the study."""
    if not result.near or result.returns is None:
        return ""
    states = len(result.near[0].surface.start)
    return f"{at(result)}delta = {result.near[0].delta:g}, {states:,} of {len(result.returns):,} states near both diagonals."


def orders(result: StudyResult, part: str) -> str:
    """The order with the smallest of the largest errors, for each delta."""
    lines = []
    for near in result.near:
        errors = {name: float(np.max(each.report.max_error)) for name, each in near.maps.items() if each.report is not None}
        if errors:
            best = min(errors, key=errors.__getitem__)
            lines.append(f"{best} for delta = {near.delta:g} (largest error {errors[best]:.2g})")
    return f"{at(result)}the best order is {', '.join(lines)}." if lines else ""


def separable(result: StudyResult, part: str) -> str:
    """The fit of one piece."""
    names = [piece.name for piece in result.study.composite if piece.separable]
    fits = {piece.name: piece.map.report for piece in (result.composite.pieces if result.composite else ())}
    report = fits.get(name := part_of(names, part))
    if report is None:
        return ""
    each = zip(report.coordinates, report.r2, report.max_error, strict=True)
    return f"{at(result)}piece {name}; {'; '.join(f'{c}: R2 = {r2:.4g}, largest error {error:.2g}' for c, r2, error in each)}."
