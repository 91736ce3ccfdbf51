"""Verdicts on the orbits of a study: whether they keep returning, and whether both maps lead to the same attractor."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.exact.impacts import Floats, Outcome
from nsmaps.study.hints import astray, beyond
from nsmaps.study.result import OrbitPair, StudyResult, Verdict

if TYPE_CHECKING:
    from nsmaps.dynamics.ending import Ending
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.dynamics.returnmap import ReturnMap

SAME = 0.03  #: of the extent of the states in each coordinate, within which two attractors count as one


def orbit_verdicts(result: StudyResult) -> Iterator[Verdict]:
    """Of every orbit, what each map makes of it and, where there are two maps, whether they end on the same."""
    coordinates = result.system.coordinates
    for pair in result.orbits:
        name = f"orbit from {_point(coordinates, pair.start)}"
        yield Verdict(f"{name}: keeps returning", "exact map", *_returning(result, pair.exact, pair.ends))
        if pair.composite is not None:
            returning = _returning(result, pair.composite, pair.composite_ends, fitted=True)
            yield Verdict(f"{name}: keeps returning", "composite map", *returning)
            yield Verdict(f"{name}: same attractor as the exact map", "composite map", *_same(result, pair))


def _returning(result: StudyResult, orbit: "Orbit", ends: "Ending | None", fitted: bool = False) -> tuple[bool, bool, str]:
    """Whether an orbit has an image at every return, that nobody requires it, and what it ends on or where it ended."""
    coordinates = result.system.coordinates
    alive = np.isfinite(orbit.states).all(axis=-1)
    returns = len(orbit.states) - 1
    if alive.all():
        text = f"yes: after {returns} returns at {_point(coordinates, orbit.states[-1])}"
        return True, False, f"{text}; {ends.text}{beyond(result, ends)}" if ends else text
    last = int(np.argmin(alive)) - 1
    reason = astray(result, orbit, last) if fitted else Outcome(int(orbit.outcome[last])).advice
    return False, False, f"no: after {last} of {returns} returns at {_point(coordinates, orbit.states[last])}. {reason}"


def _same(result: StudyResult, pair: OrbitPair) -> tuple[bool, bool, str]:
    """Whether both orbits end on sets of one period that may be one, that nobody requires it, and by what."""
    from nsmaps.dynamics.distance import hausdorff

    exact, other = pair.ends, pair.composite_ends
    if exact is None or other is None:
        which = "neither map's" if exact is other else "the exact map's" if exact is None else "the composite map's"
        return False, False, f"no: {which} orbit {'keeps' if exact is other else 'does not keep'} returning"
    scale = _scale(result, pair)
    holds = _alike(exact, other, scale)
    apart = hausdorff(exact.states, other.states, exact.coordinates, scale, np.inf)
    text = f"{_short(exact)} of the exact map, {_short(other)} of the composite map, {apart:.2g} of the extents apart"
    return holds, False, f"yes: {text}" if holds else f"no: {text}; {_also(result, pair, scale)}"


def _alike(one: "Ending", other: "Ending", scale: Floats) -> bool:
    """Whether two sets on which orbits end have one period, and their states are near, or those of samples may be of one set."""
    from nsmaps.dynamics.attractor import kept, may_be_one

    sets = (kept(end.coordinates, end.states, end.period, end.label, SAME, scale) for end in (one, other))
    return one.period == other.period and may_be_one(*sets)


def _also(result: StudyResult, pair: OrbitPair, scale: Floats) -> str:
    """Which of the attractors of two orbits that end on different ones is also the other map's."""
    exact, other = pair.ends, pair.composite_ends
    assert exact is not None
    assert other is not None
    assert result.reduced is not None
    returns = len(pair.exact.states) - 1
    also = _stays(result.reduced, exact, returns, scale), _stays(result.system, other, returns, scale)
    if all(also):
        return "each map has both attractors"
    if not any(also):
        return "neither map stays on the other's attractor"
    ours, theirs = ("exact", "composite") if also[0] else ("composite", "exact")
    return f"the {ours} map's is an attractor of the {theirs} map too, the {theirs} map's is none of the {ours} map"


def _stays(map: "ReturnMap", ends: "Ending", returns: int, scale: Floats) -> bool:
    """Whether an orbit of a map from the last state of an attractor ends there, followed for some returns."""
    from nsmaps.dynamics.ending import ending
    from nsmaps.dynamics.orbit import orbit

    found = ending(map, orbit(map, ends.states[-1], returns))
    return found is not None and _alike(ends, found, scale)


def _short(ends: "Ending") -> str:
    if not ends.period:
        return f"no period up to {ends.looked} returns"
    return f"period {ends.period}{f' ({ends.name})' if ends.name else ''}"


def _scale(result: StudyResult, pair: OrbitPair) -> Floats:
    """The sides of the study's grid, or the extents of the exact orbit where there is none, shape (n,)."""
    from nsmaps.dynamics.distance import extents

    if result.study.grid:
        return np.array([span.high - span.low for span in result.study.grid.values()])
    return extents(pair.exact.states, result.system.coordinates)


def _point(coordinates: Sequence[str], state: Floats) -> str:
    return "(" + ", ".join(f"{name} = {x:.5g}" for name, x in zip(coordinates, state, strict=True)) + ")"
