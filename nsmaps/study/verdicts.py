"""The claims that a result supports or refutes, each with the map it speaks of and the numbers it rests on."""

from collections.abc import Iterator, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from math import floor, log10
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.exact.impacts import Floats
from nsmaps.study.expected import as_expected
from nsmaps.study.hints import elsewhere, on_domain, pieces_of_others
from nsmaps.study.longverdicts import branches, ended, missing
from nsmaps.study.orbitverdicts import orbit_verdicts
from nsmaps.study.result import StudyResult, Verdict

if TYPE_CHECKING:
    from nsmaps.auxiliary.domain import AttractingDomain
    from nsmaps.study.spec import DomainSection


def verdicts(result: StudyResult) -> tuple[Verdict, ...]:
    """Every verdict on what a result holds, coverage first, then the partition, the parametric map, orbits, sweeps, domains."""
    long = (orbit_verdicts, missing, ended, branches)
    sections = (_coverage, _words, _partition, _accurate, _speed, _parametric, *long, _domains, _morse)
    return as_expected(result, tuple(verdict for section in sections for verdict in section(result)))


def _coverage(result: StudyResult) -> Iterator[Verdict]:
    cover = result.coverage
    if cover is None:
        return
    holds = bool(cover.fraction == 1.0)
    text = "yes: every state of the grid lies in a piece"
    if not holds:
        hull = " or ".join(intervals(result.system.coordinates, box) for box in cover.boxes)
        text = f"no: {100 * (1 - cover.fraction):.3g} % of the grid lies in no piece, within {hull}"
        why = pieces_of_others(result)
        text += f"; {why}" if why else ""
    yield Verdict("covered", "composite map", holds, "covered" in result.study.require, text)


def _words(result: StudyResult) -> Iterator[Verdict]:
    made = result.misleads
    if made is not None:
        right = made.wrong_words == 0
        yield Verdict("words are the exact map's", "composite map", right, False, f"{'yes' if right else 'no'}: {made.text}")


def _accurate(result: StudyResult) -> Iterator[Verdict]:
    made = result.accurate
    if made is None:
        return
    where = zip(("over the box", "beside edges"), (made.uniform, made.beside), strict=True)
    errors = [
        f"{e.largest:.2g} at {e.points - e.by_exact_map} states {place} ({e.over or 'none'} over the tolerance)"
        for place, e in where
    ]
    share = f"the exact map answers for {made.strips.report.exact_share:.2g} of the area"
    text = f"{'yes' if made.met else 'no'}: largest error {' and '.join(errors)}; {share}"
    required = "tolerance" in result.study.require
    yield Verdict("partition: tolerance met everywhere (held out)", "composite map", made.met, required, text)


def _speed(result: StudyResult) -> Iterator[Verdict]:
    if result.speed is not None:
        text = f"{'yes' if result.speed.faster else 'no'}: {result.speed.text}"
        yield Verdict("partition: clearly faster than the exact map", "composite map", result.speed.faster, False, text)


def _partition(result: StudyResult) -> Iterator[Verdict]:
    made = result.partition
    if made is None:
        return
    required = "tolerance" in result.study.require
    text = f"{'yes' if made.met else 'no'}: {made.reason}"
    yield Verdict("partition: tolerance met in the attracting regions", "composite map", made.met, required, text)
    exact, composite = made.arrives
    holds = bool(made.attracting) and composite >= exact
    text = (
        f"{'yes' if holds else 'no'}: {100 * composite:.3g} % of random starts end there, under the exact map {100 * exact:.3g} %"
    )
    yield Verdict("partition: orbits arrive in the attracting regions", "composite map", holds, False, text)


def _parametric(result: StudyResult) -> Iterator[Verdict]:
    made, section = result.parametric, result.study.parametric
    if made is None or section is None or made.report is None or not made.report.names:
        return
    report = made.report
    share = report.apart / report.refit
    k, h, i = np.unravel_index(np.argmax(share), share.shape)
    apart = f"{report.apart[k, h, i]:.2g} from the map fitted there, which is {report.refit[k, h, i]:.2g} from the exact one"
    where = f"at worst ({made.coordinates[i]} of {report.names[k]} at {made.parameter} = {report.values[h]:.4g})"
    text = f"{'yes' if report.follows else 'no'}: {where} {apart}; {len(report.values)} values held out"
    yield Verdict("parametric: follows", "parametric map", report.follows, "follows" in section.require, text)


def _domains(result: StudyResult) -> Iterator[Verdict]:
    for section in result.study.domains:
        domain = result.domains.get(section.name)
        if domain is not None:
            yield _verdict(section, domain, "trapped", domain.trapped, _trapped(result, section, domain))
            yield _verdict(section, domain, "settled", domain.settled, _settled(domain))


def _morse(result: StudyResult) -> Iterator[Verdict]:
    section, cover = result.study.morse, result.morse
    if section is None or cover is None:
        return
    held, hull = result.trap, "no orbit stays in the window"
    if held is not None:
        hull = f"{held.reason}; their hull {intervals(cover.cells.coordinates, held.hull)} (certified by enclosure)"
    holds = held is not None and held.trapped
    text = f"{'yes' if holds else 'no'}: {hull if held is None or holds else held.reason}"
    yield Verdict("morse: trapped", cover.of, holds, "trapped" in section.require, text)


def _verdict(section: "DomainSection", domain: "AttractingDomain", claim: str, holds: bool, text: str) -> Verdict:
    return Verdict(f"domain {section.name}: {claim}", domain.of, bool(holds), claim in section.require, text)


def _trapped(result: StudyResult, section: "DomainSection", domain: "AttractingDomain") -> str:
    if domain.trapped:
        held = f"no worst-case step leaves its box, in {len(domain.updates)} updates ({domain.claim})"
        return f"yes: {held}{elsewhere(result, domain)}"
    return f"no: {domain.reason} ({domain.status}){on_domain(result, section, domain)}"


def _settled(domain: "AttractingDomain") -> str:
    if not domain.trapped:
        return f"no: a box that is not trapped cannot settle ({domain.status})"
    if not domain.settled:
        return f"no: {domain.reason} ({domain.status})"
    sizes = " x ".join(f"{size:.4g}" for size in domain.sizes[-1])
    box = intervals(domain.coordinates, domain.boxes[-1])
    parts = ", ".join(f"{part} for {name}" for name, part in zip(domain.coordinates, domain.part, strict=True))
    return f"yes: {sizes} after {len(domain.updates)} updates, {box}; part of the Statement: {parts} ({domain.status})"


def intervals(coordinates: Sequence[str], box: Floats, inward: bool = False) -> str:
    """Intervals, one a coordinate, rounded to a hundredth of their width or finer: a claim that is printed holds.

    Outwards for what orbits stay in, inwards for what they start in.
    """
    parts, ways = [], (ROUND_CEILING, ROUND_FLOOR) if inward else (ROUND_FLOOR, ROUND_CEILING)
    for name, (low, high) in zip(coordinates, box, strict=True):
        wide, large = high - low, max(abs(low), abs(high))
        places = 3 - floor(log10(min(wide * 10, large) if wide > 0 else large)) if large > 0 else 0
        unit = Decimal(1).scaleb(-min(places, 17))
        ends = (Decimal(str(x)).quantize(unit, way) for x, way in zip((low, high), ways, strict=True))
        parts.append(f"{name} in [{', '.join(f'{float(end):.15g}' for end in ends)}]")
    return " x ".join(parts)
