"""What is at hand about a verdict that fails: fits that do not follow their data, other words, parameters set otherwise."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.reduced.fit.polyfit import POOR
from nsmaps.study.reading.values import DIAGONAL

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.study.result import StudyResult
    from nsmaps.study.sections.domains import DomainSection


def on_domain(result: "StudyResult", section: "DomainSection", domain: "AttractingDomain") -> str:
    """What may be why a domain is not trapped, each part after a semicolon; empty where nothing is at hand."""
    own = pieces_of_others(result) if section.map != "exact" and section.require else ""
    box = "" if section.box == DIAGONAL else _before(result, "its start box is that of the study at")
    return "".join(f"; {text}" for text in (_fit(result, section.map), _words(result, domain), box, own) if text)


def elsewhere(result: "StudyResult", domain: "AttractingDomain") -> str:
    """That a trapped domain holds nothing of what the study's orbits of the exact map end on, or empty."""
    ends = [pair.ends for pair in result.orbits if pair.ends is not None]
    if not (domain.trapped and ends):
        return ""
    held = any(inside(domain, end.states).any() for end in ends)
    return "" if held else "; it holds nothing of what the study's orbits of the exact map end on"


def inside(domain: "AttractingDomain", states: Floats) -> NDArray[np.bool_]:
    """Which states, shape (N, n), lie in the last box of a domain, angles on any turn."""
    box = domain.box
    x = domain.coordinates.lift(states, box.mean(axis=1))
    return np.asarray(((box[:, 0] <= x) & (x <= box[:, 1])).all(axis=1))


def pieces_of_others(result: "StudyResult") -> str:
    """That the pieces were given for other parameters, where parameters were set otherwise than the study's own."""
    told = _before(result, "the pieces are those of the study at") if result.study.composite else ""
    anew = "`partition: {tolerance: 1e-3}` in place of `composite` finds them anew"
    return told and f"{told}; {anew}, and domains then ask for `map: composite`, `box: diagonal`"


def astray(result: "StudyResult", orbit: "Orbit", last: int) -> str:
    """Why the map in place of the exact one has no image of the last state of an orbit, and which piece led astray."""
    map = result.composite
    if map is None:
        return "That state lies outside the grid, which is all that the map of strips holds for."
    names = [map.pieces[k].name if k >= 0 else "" for k in map.piece_of(orbit.states[: last + 1]).tolist()]
    if not names[last]:
        return f"That state lies in no piece{f'; piece {names[last - 1]} led there' if last else ''}."
    out = _outside(result, orbit.states[: last + 1])
    first = int(np.argmax(out))
    left = f"; piece {names[first - 1]} led out of the grid at return {first}" if out.any() and first else ""
    return f"The polynomial of piece {names[last]} overflows there{left}."


def beyond(result: "StudyResult", ends: "LimitSet") -> str:
    """That what an orbit ends on, or a part of it, lies outside the study's grid, or empty."""
    out = _outside(result, ends.states)
    return f"; {'' if out.all() else 'in part '}outside the study's grid" if out.any() else ""


def _outside(result: "StudyResult", states: Floats) -> NDArray[np.bool_]:
    """Which of the states (N, n) lie outside the study's grid, if it has one; angles are taken on the turn nearest to it."""
    if not result.study.grid:
        return np.zeros(len(states), bool)
    low, high = np.array([(span.low, span.high) for span in result.study.grid.values()]).T
    x = result.system.coordinates.lift(states, (low + high) / 2)
    return np.asarray(((x < low) | (x > high)).any(axis=1))


def _before(result: "StudyResult", what: str) -> str:
    changed = result.study.source.changed
    before = ", ".join(f"{name} = {own}" for name, (own, _) in changed.items() if own is not None)
    return f"{what} {before or 'other parameters'}" if changed else ""


def _fit(result: "StudyResult", name: str) -> str:
    """The outputs of a piece whose fit does not follow its data."""
    pieces = result.composite.pieces if result.composite else ()
    reports = [piece.map.report for piece in pieces if piece.name == name and piece.map.report]
    fits = [fit for report in reports for fit in zip(report.coordinates, report.r2, strict=True)]
    poor = [f"{r2:.3g} for {of}'" for of, r2 in fits if r2 < POOR]
    return f"the fit of {name} follows its data badly: R2 = {' and '.join(poor)}" if poor else ""


def _words(result: "StudyResult", domain: "AttractingDomain") -> str:
    """The share of the grid's states in the start box whose word is not the commonest there."""
    if result.returns is None:
        return ""
    box, names = domain.boxes[0], domain.coordinates
    x = result.returns.start
    x = names.lift(x, box.mean(axis=1))
    inside = ((box[:, 0] <= x) & (x <= box[:, 1])).all(axis=1) & result.returns.valid
    words, counts = np.unique(result.returns.words[inside], return_counts=True)
    if len(words) < 2:
        return ""
    share = 1 - counts.max() / counts.sum()
    return f"{100 * share:.2g} % of the grid's states in its start box have another word than {words[np.argmax(counts)]}"
