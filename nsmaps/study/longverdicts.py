"""What a run says of its sweeps and branches: where there was no map, how far each branch goes; reported, never required."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.dynamics.branch import CLOSED
from nsmaps.dynamics.events import DOUBLING
from nsmaps.exact.impacts import Outcome
from nsmaps.study.result import StudyResult, Verdict

if TYPE_CHECKING:
    from nsmaps.dynamics.trail import Branch
    from nsmaps.study.branchspec import BranchSection

REACHED = ("the range ends", CLOSED)  #: how the reason begins why a branch ends that was followed as far as it was to be


def missing(result: StudyResult) -> Iterator[Verdict]:
    """A verdict that fails for each sweep with values at which there is no map; none for a sweep without such."""
    diagrams = [(f"bifurcation {of}", f"{of} map", made.reasons) for of, made in result.bifurcation.items()]
    exponents = [] if result.lyapunov is None else [("lyapunov", "exact map", result.lyapunov.reasons)]
    for name, of, reasons in (*diagrams, *exponents):
        told = [reason for reason in reasons if reason]
        if told:
            yield _missing(name, of, len(told), f"{len(reasons)} values", told[0])
    made = result.stability
    if made is not None and (made.outcome == Outcome.invalid).any() and any(made.reasons):
        none, why = int((made.outcome == Outcome.invalid).sum()), next(filter(None, made.reasons))
        yield _missing("stability", "exact map", none, f"{made.outcome.size} points", why)


def ended(result: StudyResult) -> Iterator[Verdict]:
    """A verdict that fails for each diagram with values at which an orbit ends, and how most of them do."""
    for of, made in result.bifurcation.items():
        lost = ~made.held & np.array([[not reason] for reason in made.reasons])
        if lost.any():
            most = Outcome(int(np.bincount(made.outcome[lost]).argmax()))
            why = "A polynomial overflows." if of == "composite" and most == Outcome.escaped else most.advice
            text = f"no: one ends at {lost.any(axis=1).sum()} of {len(lost)} values, most often so: {why}"
            yield Verdict(f"bifurcation {of}: orbits go on at every value", f"{of} map", False, False, text)


def _missing(name: str, of: str, count: int, all: str, reason: str) -> Verdict:
    return Verdict(f"{name}: a map at every value", of, False, False, f"no: none at {count} of {all}, as {reason}")


def branches(result: StudyResult) -> Iterator[Verdict]:
    """Whether each branch was followed to the ends of its range, and as many doublings found as were looked for."""
    for section in result.study.branches:
        made = result.branches.get(section.name)
        if made is None:
            continue
        first = [branch for branch in made if branch.period == section.period]
        holds = all(branch.ended.startswith(REACHED) for branch in first)
        told = "; ".join(f"{way}: {_end(branch)}" for way, branch in zip(section.ways, first, strict=False))
        text = f"{'yes' if holds else 'no'}: {told if len(first[0].parameter) else first[0].ended}"
        name = f"branch {section.name}"
        yield Verdict(f"{name}: followed to the end of its range", "exact map", holds, False, text)
        if section.doublings:
            yield Verdict(f"{name}: doublings", "exact map", *_doublings(section, made))


def _end(branch: "Branch") -> str:
    """Why a branch ended, and where, if at an event."""
    last = branch.events[-1] if branch.events else None
    if last is None or last.kind != branch.ended:
        return branch.ended
    return f"{last.kind} at {last.parameter:.9g}{last.detail and ', '}{last.detail}"


def _doublings(section: "BranchSection", made: "tuple[Branch, ...]") -> tuple[bool, bool, str]:
    """Whether every direction with a period doubling has as many one after another as asked for, that nobody requires it, why."""
    found = {branch: branch.of_kind(DOUBLING)[0] for branch in made if branch.of_kind(DOUBLING)}
    asked = section.doublings * max(sum(branch.period == section.period for branch in found), 1)
    at = ", ".join(f"{event.parameter:.8g}" for event in found.values())
    if len(found) == asked:
        return True, False, f"yes: at {at}"
    return False, False, f"no: {len(found)} of {asked}{at and f', at {at}'}; then: {made[-1].ended}"
