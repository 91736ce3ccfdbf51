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

SAME = 0.03  #: of the extent of the states, within which two attractors count as one


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
    """Whether both orbits end on sets of one period that are near to each other, that nobody requires it, and by what."""
    from nsmaps.dynamics.distance import hausdorff

    exact, other = pair.ends, pair.composite_ends
    if exact is None or other is None:
        which = "neither map's" if exact is other else "the exact map's" if exact is None else "the composite map's"
        return False, False, f"no: {which} orbit {'keeps' if exact is other else 'does not keep'} returning"
    apart, near = hausdorff(exact.states, other.states, result.system.coordinates), SAME * _extent(result, pair)
    holds = exact.period == other.period and apart <= near
    maps = f"{_short(exact)} of the exact map, {_short(other)} of the composite map"
    within = f"{'within' if apart <= near else 'beyond'} {near:.2g}, {SAME:.0%} of the extent of the states"
    return holds, False, f"{'yes' if holds else 'no'}: {maps}, {apart:.2g} apart ({within})"


def _short(ends: "Ending") -> str:
    if not ends.period:
        return f"no period up to {ends.looked} returns"
    return f"period {ends.period}{f' ({ends.name})' if ends.name else ''}"


def _extent(result: StudyResult, pair: OrbitPair) -> float:
    """The diagonal of the study's grid, or of the box around the exact orbit where there is none."""
    if result.study.grid:
        return float(np.linalg.norm([span.high - span.low for span in result.study.grid.values()]))
    return float(np.linalg.norm(np.ptp(pair.exact.states, axis=0)))


def _point(coordinates: Sequence[str], state: Floats) -> str:
    return "(" + ", ".join(f"{name} = {x:.5g}" for name, x in zip(coordinates, state, strict=True)) + ")"
