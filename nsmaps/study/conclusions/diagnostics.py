"""Possible reasons for a verdict that fails: poor fits, other words in the box, parameters that were changed."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.reduced.fit.reporting import POOR

if TYPE_CHECKING:
    from nsmaps.auxiliary.attracting_domain import AttractingDomain
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.study.result import StudyResult

SAMPLED = 100_000  #: states of the box of a piece that the composite map is asked for


def on_domain(result: "StudyResult", of: str, domain: "AttractingDomain", written: bool, required: bool) -> str:
    """Possible reasons why a box is not forward invariant, each after a semicolon; empty if there are none.

    Args:
        of: the name of the map.
        written: whether the start box is written in the study.
        required: whether the study requires a claim on the domain.
    """
    own = pieces_of_others(result) if of != "exact" and required else ""
    box = _before(result, "its start box is that of the study at") if written else ""
    return "".join(f"; {text}" for text in (_fit(result, of), _words(result, domain), box, own) if text)


def elsewhere(result: "StudyResult", domain: "AttractingDomain") -> str:
    """The statement that a domain contains no attractor of the study's exact orbits, where that is so; else empty."""
    ends = [pair.ends for pair in result.orbits if pair.ends is not None]
    if not (domain.forward_invariant and ends):
        return ""
    held = any(inside(domain, end.states).any() for end in ends)
    return "" if held else "; it contains no attractor of the study's orbits of the exact map"


def share_carried_out(result: "StudyResult", of: str, domain: "AttractingDomain") -> float | None:
    """The share of sampled states of the last box of a piece that the composite map carries out of it; None for other domains.

    A piece is bounded by itself; the composite map has its values only where the piece decides.
    """
    return_map = result.composite
    if return_map is None or not domain.forward_invariant or of not in {piece.name for piece in return_map.pieces}:
        return None
    low, high = domain.box.T
    states = np.random.default_rng(0).uniform(low, high, (SAMPLED, len(low)))
    return float(1 - inside(domain, return_map.first_return(states).image).mean())


def inside(domain: "AttractingDomain", states: Floats, number: int = -1) -> NDArray[np.bool_]:
    """True for states, shape (N, n), in a box of a domain, by default the last, angles modulo 2 pi."""
    box = domain.boxes[number]
    x = domain.coordinates.lift(states, box.mean(axis=1))
    return np.asarray(((box[:, 0] <= x) & (x <= box[:, 1])).all(axis=1))


def pieces_of_others(result: "StudyResult") -> str:
    """The statement that the pieces were given for other parameters, where parameters were changed; else empty."""
    origin = _before(result, "the pieces are those of the study at") if result.study.composite else ""
    anew = "`partition: {tolerance: 1e-3}` instead of `composite` determines them at these parameters"
    return origin and f"{origin}; {anew}; domains then need `map: composite`, `box: diagonal`"


def no_image(result: "StudyResult", orbit: "Orbit", last: int) -> str:
    """The reason why the reduced map has no image of the last state of an orbit, and the piece that mapped it there."""
    return_map = result.composite
    if return_map is None:
        return "That state lies outside the grid, which is the domain of the map of strips."
    names = [return_map.pieces[k].name if k >= 0 else "" for k in return_map.piece_of(orbit.states[: last + 1]).tolist()]
    if not names[last]:
        return f"That state lies in no piece{f'; piece {names[last - 1]} mapped it there' if last else ''}."
    out = _outside(result, orbit.states[: last + 1])
    first = int(np.argmax(out))
    left = f"; piece {names[first - 1]} mapped it out of the grid at return {first}" if out.any() and first else ""
    return f"The polynomial of piece {names[last]} overflows there{left}."


def beyond(result: "StudyResult", ends: "LimitSet") -> str:
    """The statement that the limit set of an orbit lies, in part or whole, outside the study's grid; else empty."""
    out = _outside(result, ends.states)
    return f"; {'' if out.all() else 'in part '}outside the study's grid" if out.any() else ""


def grid_ends(result: "StudyResult") -> Floats:
    """The ends of the study's grid in each coordinate, shape (n, 2); NaN without a grid, and of coordinates held at a value."""
    spans = [(result.study.grid or {}).get(name) for name in result.system.coordinates]
    return np.array([(np.nan, np.nan) if span is None or span.low == span.high else (span.low, span.high) for span in spans])


def _outside(result: "StudyResult", states: Floats) -> NDArray[np.bool_]:
    """True for the states (N, n) outside the study's grid, if it has one; angles are taken modulo 2 pi."""
    low, high = grid_ends(result).T
    x = result.system.coordinates.lift(states, (low + high) / 2)
    return np.asarray(((x < low) | (x > high)).any(axis=1))


def _before(result: "StudyResult", what: str) -> str:
    changed = result.study.source.changed
    before = ", ".join(f"{name} = {own}" for name, (own, _) in changed.items() if own is not None)
    return f"{what} {before or 'other parameters'}" if changed else ""


def _fit(result: "StudyResult", name: str) -> str:
    """The outputs of a piece whose fit is poor."""
    pieces = result.composite.pieces if result.composite else ()
    reports = [piece.map.report for piece in pieces if piece.name == name and piece.map.report]
    fits = [fit for report in reports for fit in zip(report.coordinates, report.r2, strict=True)]
    poor = [f"{r2:.3g} for {of}'" for of, r2 in fits if r2 < POOR]
    return f"the fit of {name} is poor: R2 = {' and '.join(poor)}" if poor else ""


def _words(result: "StudyResult", domain: "AttractingDomain") -> str:
    """The percentage of the grid's states in the start box whose word is not the most frequent one there."""
    if result.returns is None:
        return ""
    valid = inside(domain, result.returns.start, 0) & result.returns.valid
    words, counts = np.unique(result.returns.words[valid], return_counts=True)
    if len(words) < 2:
        return ""
    share = 1 - counts.max() / counts.sum()
    return f"{100 * share:.2g} % of the grid's states in its start box have another word than {words[np.argmax(counts)]}"
