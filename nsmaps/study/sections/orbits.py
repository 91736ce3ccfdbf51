"""The section `orbits`: starts followed under the exact map and the map in its place, and what they end on."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, Field

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.trajectory import track
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.diagnostics import astray, beyond
from nsmaps.study.estimates import COPIES, RETURN, STORED, Size
from nsmaps.study.reading.values import SPEC
from nsmaps.study.sections.base import Section, Verdict
from nsmaps.study.texts import EXACT, finite, point

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.limit_set import LimitSet
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.dynamics.returnmap import ReturnMap
    from nsmaps.exact.system import ImpactSystem
    from nsmaps.exact.trajectory import Track
    from nsmaps.study.binding import Binding, Plan
    from nsmaps.study.result import StudyResult
    from nsmaps.study.study import Study

SAME = 0.03  #: of the extent of the states in each coordinate, within which two attractors count as one


class OrbitSection(BaseModel):
    """A start and how many returns to follow it, under the exact map and the composite map."""

    model_config = SPEC
    start: dict[str, Number]
    returns: int = Field(ge=1)
    track: int | None = Field(None, ge=2, le=10_000)  #: impacts on all walls that are kept, with the motion between them


Orbits = tuple[OrbitSection, ...]


@dataclass(frozen=True, slots=True, eq=False)
class OrbitPair:
    """The orbits of one start: of the exact map and, if the study has one, of the composite map."""

    start: Floats  #: shape (n,)
    exact: "Orbit"
    composite: "Orbit | None"
    track: "Track | None" = None  #: the exact motion at and between its first impacts, if the study asks for it
    ends: "LimitSet | None" = None  #: what the exact map's orbit ends on; None where it has no image
    composite_ends: "LimitSet | None" = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored:
    """What a run keeps of its orbits."""

    orbits: tuple[OrbitPair, ...] = ()


def _bind(spec: Orbits, binding: "Binding") -> tuple[Floats, ...]:
    return tuple(binding.start(("orbits", number, "start"), orbit.start) for number, orbit in enumerate(spec))


def _compute(spec: Orbits, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
    """The orbits of every start under the exact map and under the composite map, and what they end on."""
    from nsmaps.dynamics.attractors.limit_set import limit_set
    from nsmaps.dynamics.orbit import orbit

    pairs, count = [], 2 * len(spec)
    for k, (section, start) in enumerate(zip(spec, plan.bound["orbits"], strict=True)):
        first, then = (plan.portion(half, count).progress for half in (2 * k, 2 * k + 1))
        reduced = orbit(result.reduced, start, section.returns, progress=first) if result.reduced else None
        exact = orbit(plan.system, start, section.returns, progress=then)
        reduced_ends = limit_set(result.reduced, reduced) if result.reduced and reduced else None
        kept = track(plan.system, start, section.track) if section.track else None
        pairs.append(OrbitPair(start, exact, reduced, kept, limit_set(plan.system, exact), reduced_ends))
    return {"orbits": tuple(pairs)}


def _describe(spec: Orbits, study: "Study") -> str:
    return ", ".join(f"{orbit.returns} returns" for orbit in spec)


def _size(spec: Orbits, study: "Study", system: "ImpactSystem") -> Size:
    return sum((Size(3 * RETURN, 2 * COPIES * STORED).times(orbit.returns) for orbit in spec), Size())


def _numbers(result: "StudyResult") -> dict[str, Any]:
    return {"orbits": [_pair(pair) for pair in result.orbits]} if result.orbits else {}


def _pair(pair: OrbitPair) -> dict[str, Any]:
    ends = {"start": finite(pair.start), "exact": finite(pair.exact.states[-1])}
    found = {"exact": pair.ends, "composite": pair.composite_ends}
    attractors = {of: _ending(made) for of, made in found.items() if made is not None}
    ends |= {"composite": finite(pair.composite.states[-1])} if pair.composite else {}
    return ends | ({"attractor": attractors} if attractors else {})


def _ending(made: "LimitSet") -> dict[str, Any]:
    """What an orbit ends on: the states of a cycle, and the hull of all that it visits."""
    pairs = [[value.real, value.imag] for value in made.multipliers.tolist()]
    hull = np.stack([made.states.min(axis=0), made.states.max(axis=0)], axis=1)
    where = {
        "states": [finite(state) for state in made.states] if made.period else None,
        "hull": [finite(side) for side in hull],
    }
    about = {"period": made.period, "looked_to": made.looked, "label": made.label, "words": " ".join(made.words)}
    exponent, error = finite([made.exponent, made.exponent_error])
    return about | where | {"multipliers": pairs, "stable": made.stable, "exponent": exponent, "exponent_error": error}


def _verdicts(result: "StudyResult") -> Iterator[Verdict]:
    """Of every orbit, what each map makes of it and, where there are two maps, whether they end on the same."""
    coordinates = result.system.coordinates
    for pair in result.orbits:
        name = f"orbit from {point(coordinates, pair.start)}"
        yield Verdict(f"{name}: keeps returning", EXACT, *_returning(result, pair.exact, pair.ends))
        if pair.composite is not None:
            returning = _returning(result, pair.composite, pair.composite_ends, fitted=True)
            yield Verdict(f"{name}: keeps returning", "composite map", *returning)
            yield Verdict(f"{name}: same attractor as the exact map", "composite map", *_same(result, pair))


def _returning(result: "StudyResult", orbit: "Orbit", ends: "LimitSet | None", fitted: bool = False) -> tuple[bool, bool, str]:
    """Whether an orbit has an image at every return, that nobody requires it, and what it ends on or where it ended."""
    coordinates = result.system.coordinates
    alive = np.isfinite(orbit.states).all(axis=-1)
    returns = len(orbit.states) - 1
    if alive.all():
        text = f"yes: after {returns} returns at {point(coordinates, orbit.states[-1])}"
        return True, False, f"{text}; {ends.text}{beyond(result, ends)}" if ends else text
    last = int(np.argmin(alive)) - 1
    reason = astray(result, orbit, last) if fitted else Outcome(int(orbit.outcome[last])).advice
    return False, False, f"no: after {last} of {returns} returns at {point(coordinates, orbit.states[last])}. {reason}"


def _same(result: "StudyResult", pair: OrbitPair) -> tuple[bool, bool, str]:
    """Whether both orbits end on sets of one period that may be one, that nobody requires it, and by what."""
    from nsmaps.dynamics.attractors.distance import hausdorff

    exact, other = pair.ends, pair.composite_ends
    if exact is None or other is None:
        which = "neither map's" if exact is other else "the exact map's" if exact is None else "the composite map's"
        return False, False, f"no: {which} orbit {'keeps' if exact is other else 'does not keep'} returning"
    scale = _scale(result, pair)
    apart = hausdorff(exact.states, other.states, exact.coordinates, scale, np.inf)
    text = f"{_short(exact)} of the exact map, {_short(other)} of the composite map, {apart:.2g} of the extents apart"
    if _alike(exact, other, scale):
        return True, False, f"yes: {text}"
    return False, False, f"no: {text}; {_also(result, len(pair.exact.states) - 1, (exact, other), scale)}"


def _alike(one: "LimitSet", other: "LimitSet", scale: Floats) -> bool:
    """Whether two sets on which orbits end have one period, and their states are near, or those of samples may be of one set."""
    from nsmaps.dynamics.attractors.attractor import kept, may_be_one

    sets = (kept(end.coordinates, end.states, end.period, end.label, SAME, scale) for end in (one, other))
    return one.period == other.period and may_be_one(*sets)


def _also(result: "StudyResult", returns: int, ends: "tuple[LimitSet, LimitSet]", scale: Floats) -> str:
    """Which of the attractors of two orbits that end on different ones, exact first, is also the other map's."""
    reduced, (exact, other) = result.reduced, ends
    also = reduced is not None and _stays(reduced, exact, returns, scale), _stays(result.system, other, returns, scale)
    if all(also):
        return "each map has both attractors"
    if not any(also):
        return "neither map stays on the other's attractor"
    ours, theirs = ("exact", "composite") if also[0] else ("composite", "exact")
    return f"the {ours} map's is an attractor of the {theirs} map too, the {theirs} map's is none of the {ours} map"


def _stays(map: "ReturnMap", ends: "LimitSet", returns: int, scale: Floats) -> bool:
    """Whether an orbit of a map from the last state of an attractor ends there, followed for some returns."""
    from nsmaps.dynamics.attractors.limit_set import limit_set
    from nsmaps.dynamics.orbit import orbit

    found = limit_set(map, orbit(map, ends.states[-1], returns))
    return found is not None and _alike(ends, found, scale)


def _short(ends: "LimitSet") -> str:
    if not ends.period:
        return f"no period up to {ends.looked} returns"
    return f"period {ends.period}{f' ({ends.name})' if ends.name else ''}"


def _scale(result: "StudyResult", pair: OrbitPair) -> Floats:
    """The sides of the study's grid, or the extents of the exact orbit where there is none, shape (n,)."""
    from nsmaps.dynamics.attractors.distance import extents

    if result.study.grid:
        return np.array([span.high - span.low for span in result.study.grid.values()])
    return extents(pair.exact.states, result.system.coordinates)


ORBITS = Section[Orbits](
    key="orbits",
    type=Orbits,
    default=(),
    stored=Stored,
    bind=_bind,
    compute=_compute,
    describe=_describe,
    size=_size,
    numbers=_numbers,
    verdicts=_verdicts,
)
