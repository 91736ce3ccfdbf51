"""What a run found in a sentence or two of plain words: of which map, and how it is known."""

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.auxiliary.bounds import ESTIMATED
from nsmaps.study.diagnostics import inside
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.motions import NONE
from nsmaps.study.texts import EXACT, intervals

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.dynamics.attractors.basins import Basins
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.diagrams.bifurcation import Bifurcation
    from nsmaps.study.sections.bifurcation import BifurcationSection

NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
SAME = 1e-5  #: of the extent of the orbits, within which two of their cycles are one
STABLE = {True: "stable ", False: "unstable ", None: ""}
MOTIONS = 6  #: of a diagram that are told
ALL = 0.99  #: of the sides of a start box, from which on the last box is all of it
FAR = 2  #: standard errors from which an exponent is above zero
DOUBTS = {ESTIMATED: "as far as the held-out error of the fit tells, ", "sampled": "as far as a grid of states tells, "}


def headline(result: StudyResult) -> str:
    """What attracts, and what stays in which box, each of the map that it was computed of; empty where neither was.

    What attracts is what basins, else orbits, else a diagram found of the exact map: there may be more. What stays is of the
    smallest trapped box: of the exact map if it has one that is a bound, else of another map, which is then named.
    """
    said: dict[str, list[str]] = {}
    for of, text in (*_attracts(result), *_stays(result)):
        said.setdefault(of, []).append(text)
    return " ".join(f"{of[0].upper()}{of[1:]}: {'; '.join(texts)}." for of, texts in said.items())


def counted(number: int) -> str:
    """A number in words, from ten on in digits."""
    return NUMBERS[number] if number < len(NUMBERS) else str(number)


def cycle_of(period: int) -> str:
    """The name of a cycle of some returns, as two-cycle."""
    return "fixed point" if period == 1 else f"{counted(period)}-cycle" if period < len(NUMBERS) else f"cycle of {period} returns"


def _attracts(result: StudyResult) -> Iterator[tuple[str, str]]:
    if result.basins is not None and result.study.basins is not None:
        yield EXACT, _basins(result.basins, result.study.basins.max_period)
    elif text := _orbits(result):
        yield EXACT, text
    elif "exact" in result.bifurcation and result.study.bifurcation is not None:
        yield EXACT, _diagram(result.bifurcation["exact"], result.study.bifurcation)


def _diagram(made: "Bifurcation", section: "BifurcationSection") -> str:
    """The motions of a diagram's first orbit, in the order of the values."""
    names = [name or NONE for name in dict.fromkeys(made.labels[:, 0].tolist())]
    more = f" and {len(names) - MOTIONS} more" if len(names) > MOTIONS else ""
    told = " (C: none with a period was found)" if any(name.endswith("C") for name in names) else ""
    over = f"for {section.parameter} from {section.low:g} to {section.high:g}"
    return f"{over} the motion{'s' * (len(names) > 1)} {', '.join(names[:MOTIONS])}{more}{told}"


def _basins(made: "Basins", longest: int) -> str:
    """How many attractors were found from how many starts, and which share comes to each."""
    none = f"motion without a period up to {longest} returns"
    shares = [f"{100 * share:.3g} %" for share in made.fractions]
    found = [
        f"{share} to {'a ' + cycle_of(each.period) if each.period else none}{f' ({each.label})' if each.label else ''}"
        for each, share in zip(made.attractors, shares, strict=False)
    ]
    more = zip(shares[-2:], made.fractions[-2:], ("to none in time", "end before"), strict=True)
    rest = [f"{told} {what}" for told, share, what in more if share > 0]
    number = f"{counted(len(found))} attractor{'' if len(found) == 1 else 's'} found"
    return f"{number} from {len(made.label)} states of the grid: {', '.join(found + rest)}"


def _orbits(result: StudyResult) -> str:
    """What the orbits of the exact map end on; empty where none keeps returning."""
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
    """The endings that are one: cycles at the same states, and all without a period, of which nobody says that they are one."""
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
    """One cycle, or motion without a period."""
    name = f" ({end.name})" if end.name else ""
    if end.period:
        return f"one {STABLE[end.stable]}{cycle_of(end.period)}{name}"
    exponent = f"largest Lyapunov exponent {end.exponent:.2g} +- {end.exponent_error:.1g}" if isfinite(end.exponent) else ""
    chaos = exponent and end.exponent > FAR * end.exponent_error
    return f"motion without a period up to {end.looked} returns{name}{f', chaotic by its {exponent}' if chaos else ''}"


def _stays(result: StudyResult) -> Iterator[tuple[str, str]]:
    """What stays where: in the smallest trapped box of the surest kind, or in the cells of a closed set."""
    trapped = [domain for domain in result.domains.values() if domain.trapped]
    exact = [domain for domain in trapped if domain.of == EXACT and domain.status not in DOUBTS]
    if not exact and result.trap is not None and result.trap.trapped:
        cells, hull = result.trap.numbers, intervals(result.trap.cells.coordinates, result.trap.hull)
        yield result.trap.of, f"every orbit from {len(cells)} cells within {hull} stays in them (by enclosure)"
    elif trapped:
        domain = min(trapped, key=_rank)
        yield domain.of, _domain(result, domain)


def _rank(domain: "AttractingDomain") -> tuple[bool, bool, float]:
    """Bounds before what is none, the exact map before others, small boxes before large ones."""
    return domain.status in DOUBTS, not domain.of.startswith(EXACT), float(np.prod(domain.sizes[-1] / domain.sizes[0]))


def _domain(result: StudyResult, domain: "AttractingDomain") -> str:
    """That every orbit from the start box comes into the last box and stays, and whether that holds what was found."""
    start, end = intervals(domain.coordinates, domain.boxes[0], inward=True), intervals(domain.coordinates, domain.boxes[-1])
    how = f" ({domain.status})" if domain.status not in DOUBTS else ""
    goes = f"comes into {end} and stays there" if (domain.sizes[-1] < ALL * domain.sizes[0]).any() else f"stays in {end}"
    stays = f"every orbit from {start} {goes}{how}"
    return f"{DOUBTS.get(domain.status, '')}{stays}{_holds(result, domain)}"


def _holds(result: StudyResult, domain: "AttractingDomain") -> str:
    """Whether a box of the exact map holds what the orbits of that map end on."""
    ends: list[Floats] = [pair.ends.states for pair in result.orbits if pair.ends is not None]
    if not ends or domain.of != EXACT:
        return ""
    held = [bool(inside(domain, states).all()) for states in ends]
    return ", where what the orbits end on is" if all(held) else ", away from what the orbits end on" if not any(held) else ""
