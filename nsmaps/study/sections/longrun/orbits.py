"""The section `orbits`: orbits of starts under the exact and the reduced map, and their limit sets."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.arrays import Floats
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.trajectory import track
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.validation.counterpart import counterpart
from nsmaps.study.conclusions.attraction import orbits_findings
from nsmaps.study.conclusions.diagnostics import beyond, grid_ends, no_image
from nsmaps.study.conclusions.phrases import MOST, at
from nsmaps.study.conclusions.texts import cycle_of, finite, point
from nsmaps.study.estimates import COPIES, RETURN, STORED, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Section
from nsmaps.study.sections.base import Entries, Finding, Verdict, verdict
from nsmaps.study.sections.maps.composite import COMPOSITE
from nsmaps.study.sections.maps.surfaces import GRID

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nsmaps.dynamics.attractors.limit_set import LimitSet, OrbitPair
    from nsmaps.dynamics.orbit import Orbit
    from nsmaps.exact.events import ModeTrack, Track
    from nsmaps.exact.returnmap import ReturnMap
    from nsmaps.exact.surfaces.surface import Grid
    from nsmaps.reduced.composite.composite import CompositeMap
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

SAME = 0.03  #: largest distance, relative to the extent of the states, at which two attractors are taken as one


class OrbitSection(Section):
    """A start, and the number of returns of its orbits under the exact map and the composite map."""

    start: dict[str, Number] = Field(description="the first state, by coordinate, as {v: 0.5, phi: pi/2}")
    n_returns: int = Field(ge=1, description="number of returns")
    track: int | None = Field(
        None,
        ge=2,
        le=10_000,
        description="impacts, or events of a system with modes, kept with the motion between them for `motion` and `impacts`",
    )


def _over(result: "StudyResult") -> "tuple[Grid, CompositeMap | None] | None":
    """The grid of the return surfaces, with the composite map over it."""
    return (next(iter(result.surfaces.values())).grid, result.composite) if result.surfaces else None


ORBITS: "FigurePart[Sequence[OrbitPair]]" = FigurePart("orbits", ("orbits",))
OVER: "FigurePart[tuple[Grid, CompositeMap | None]]" = FigurePart("pieces over a grid", (), _over, optional=True)
TRACKS: "FigurePart[Sequence[Track | ModeTrack]]" = FigurePart(
    "the motion between impacts",
    ("orbits",),
    lambda result: [pair.track for pair in result.orbits if pair.track is not None],
    "'track' in an entry of 'orbits'",
    lambda study: not study.orbits or any(orbit.track for orbit in study.orbits),
)


class Orbits(Entries[OrbitSection]):
    """Orbits of the exact map, and of the composite map if there is one."""

    key: ClassVar[str] = "orbits"
    results: ClassVar[Mapping[str, Any]] = {
        "orbits": (),
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "system.motion",
            "The displacements of ball and walls over time, beside the phase plane of relative displacement and velocity.",
            "The exact motion at and between impacts, over time and in the phase plane. Stars are impacts on the base wall. "
            "With modes it is that of all states, coloured by mode, with the events.",
            (TRACKS,),
        ),
        StudyFigure(
            "system.impacts",
            "The phase against the relative velocity at every impact, joined in order by dotted lines.",
            "All impacts of the orbit by phase and by velocity just before the impact, whose sign distinguishes the walls, or "
            "all events of a system with modes. Dotted lines give their order.",
            (TRACKS,),
        ),
        StudyFigure(
            "composite.orbits",
            "Orbits of the exact map and of the composite map in the plane of states.",
            "Orbits from the initial states of the study with their last tenth marked: of the exact map, and of the composite "
            "map if there is one. Lines join a state to its image. A cross, if any, is the last state of an orbit that ends, "
            "or its last state within the picture. No piece holds the hatched states.",
            (ORBITS, FigurePart("the plane of states", (), lambda result: result.system, planar=True), OVER),
        ),
        StudyFigure(
            "composite.cobweb",
            "Cobweb diagrams of the orbits over the projected surfaces.",
            "A cobweb of the composite map in the phase planes, with its last tenth marked, over the pieces: a line where the "
            "image depends on one coordinate alone, else the range of its values over the other, pale where the orbit does not "
            "come. A cross, if any, is the end of an orbit that leaves the domain of the map.",
            (COMPOSITE, GRID, ORBITS),
            animated=True,
        ),
    )

    def bind(self, binding: "Binding") -> tuple[Floats, ...]:
        for number, orbit in enumerate(self):
            if orbit.track is not None:
                with binding.study.source.located(("orbits", number, "track")):
                    FlowSystem.require(binding.system, "a trajectory")
        return tuple(binding.start(("orbits", number, "start"), orbit.start) for number, orbit in enumerate(self))

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The orbits of every start under the exact map and under the composite map, and their limit sets."""
        from nsmaps.dynamics.attractors.limit_set import OrbitPair, limit_set
        from nsmaps.dynamics.orbit import orbit

        pairs, count = [], 2 * len(self)
        for k, (section, start) in enumerate(zip(self, plan.bound["orbits"], strict=True)):
            first, then = (plan.portion(half, count).progress for half in (2 * k, 2 * k + 1))
            reduced = orbit(result.reduced, start, section.n_returns, progress=first) if result.reduced else None
            exact = orbit(plan.system, start, section.n_returns, progress=then)
            reduced_ends = limit_set(result.reduced, reduced) if result.reduced and reduced else None
            kept = track(plan.system, start, section.track) if section.track else None
            there = counterpart(plan.system, result.composite)
            same = None if there is plan.system else limit_set(there, orbit(there, start, section.n_returns))
            pairs.append(OrbitPair(start, exact, reduced, kept, limit_set(plan.system, exact), reduced_ends, same))
        return {"orbits": tuple(pairs)}

    def describe(self, study: "Study") -> str:
        return ", ".join(f"{orbit.n_returns} returns" for orbit in self)

    def size(self, study: "Study", system: "System") -> Size:
        return sum((Size(3 * RETURN, 2 * COPIES * STORED).times(orbit.n_returns) for orbit in self), Size())

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        return {"orbits": [_pair(pair) for pair in result.orbits]}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        """For every orbit, whether it completes all returns under each map, and whether both have the same attractor."""
        coordinates = result.system.coordinates
        for pair in result.orbits:
            name = f"orbit from {point(coordinates, pair.start)}"
            yield verdict(f"{name}: completes all returns", result.system.map_name, *_returning(result, pair.exact, pair.ends))
            if pair.composite is not None:
                returning = _returning(result, pair.composite, pair.composite_ends, fitted=True)
                yield verdict(f"{name}: completes all returns", "composite map", *returning)
                yield verdict(f"{name}: same attractor as the exact map", "composite map", *_same(result, pair))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The starts of the motions, or where the orbits end under each map."""
        if figure in ("motion", "impacts"):
            starts = [point(result.system.coordinates, pair.start) for pair in result.orbits if pair.track is not None]
            return f"{at(result)}from {'; '.join(starts[:MOST])}." if starts else ""
        if figure == "cobweb":
            pair = result.orbits[int(part) - 1 if part.isdecimal() and 0 < int(part) <= len(result.orbits) else 0]
            return _from_to(result, [(pair, _end(result, pair.composite_ends))] if pair.composite is not None else [])
        ends = []
        for pair in result.orbits:
            other = f" and {_end(result, pair.composite_ends)} under the composite map" if pair.composite is not None else ""
            ends.append((pair, f"{_end(result, pair.ends)} under the exact map{other}"))
        return _from_to(result, ends)

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        yield from orbits_findings(result)


def _from_to(result: "StudyResult", ends: "Sequence[tuple[OrbitPair, str]]") -> str:
    """The starts of orbits by where they end."""
    starts: dict[str, list[str]] = {}
    for pair, end in ends:
        starts.setdefault(end, []).append(point(result.system.coordinates, pair.start))
    lines = [f"from {' and '.join(each[:MOST])}{' and others' * (len(each) > MOST)} to {end}" for end, each in starts.items()]
    more = f"; {len(lines) - MOST} more" if len(lines) > MOST else ""
    return f"{at(result)}{'; '.join(lines[:MOST])}{more}." if lines else ""


def _end(result: "StudyResult", end: "LimitSet | None") -> str:
    if end is None:
        return "no limit, as it ends"
    if end.period == 1:
        return f"the fixed point {point(result.system.coordinates, end.states[0])}"
    name = f" ({end.name})" if end.name else ""
    return f"a {cycle_of(end.period)}{name}" if end.period else f"{end.meaning}{name}"


def _pair(pair: "OrbitPair") -> dict[str, Any]:
    ends = {"start": finite(pair.start), "exact": finite(pair.exact.states[-1])}
    found = {"exact": pair.ends, "composite": pair.composite_ends}
    attractors = {of: _limit_set(limit_set) for of, limit_set in found.items() if limit_set is not None}
    ends |= {"composite": finite(pair.composite.states[-1])} if pair.composite else {}
    return ends | ({"attractor": attractors} if attractors else {})


def _limit_set(limit_set: "LimitSet") -> dict[str, Any]:
    """The numbers of a limit set: the states of a cycle, the hull of all states, stability."""
    pairs = [[value.real, value.imag] for value in limit_set.multipliers.tolist()]
    hull = np.stack([limit_set.states.min(axis=0), limit_set.states.max(axis=0)], axis=1)
    where = {
        "states": [finite(state) for state in limit_set.states] if limit_set.period else None,
        "hull": [finite(side) for side in hull],
    }
    about = {
        "period": limit_set.period,
        "looked_to": limit_set.looked,
        "label": limit_set.label,
        "words": " ".join(limit_set.words),
    }
    exponent, error = finite([limit_set.exponent, limit_set.exponent_error])
    return about | where | {"multipliers": pairs, "stable": limit_set.stable, "exponent": exponent, "exponent_error": error}


def _returning(result: "StudyResult", orbit: "Orbit", ends: "LimitSet | None", fitted: bool = False) -> tuple[bool, str]:
    """Whether an orbit completes all returns, and its limit set or its last state in words."""
    coordinates = result.system.coordinates
    alive = np.isfinite(orbit.states).all(axis=-1)
    returns = len(orbit.states) - 1
    if alive.all():
        text = f"after {returns} returns at {point(coordinates, orbit.states[-1])}"
        return True, f"{text}; {ends.text}{beyond(result, ends)}" if ends else text
    last = int(np.argmin(alive)) - 1
    reason = no_image(result, orbit, last) if fitted else Outcome(int(orbit.outcome[last])).advice
    return False, f"after {last} of {returns} returns at {point(coordinates, orbit.states[last])}. {reason}"


def _same(result: "StudyResult", pair: "OrbitPair") -> tuple[bool, str]:
    """Whether both orbits have the same attractor, and their distance in words."""
    from nsmaps.dynamics.attractors.distance import hausdorff

    exact, other = pair.counterpart_ends or pair.ends, pair.composite_ends
    if exact is None or other is None:
        which = "neither map's" if exact is other else "the exact map's" if exact is None else "the composite map's"
        return False, f"{which} orbit {'completes' if exact is other else 'does not complete'} all returns"
    scale = _scale(result, pair)
    distance = hausdorff(exact.states, other.states, exact.coordinates, scale, np.inf)
    text = f"{_short(exact)} of the exact map, {_short(other)} of the composite map"
    text = f"{text}, at a distance of {distance:.2g} relative to the extents"
    text += ", after as many returns as the pieces have" if pair.counterpart_ends else ""
    if _alike(exact, other, scale):
        return True, text
    return False, f"{text}; {_also(result, len(pair.exact.states) - 1, (exact, other), scale)}"


def _alike(one: "LimitSet", other: "LimitSet", scale: Floats) -> bool:
    """Whether two limit sets have the same period and close states, or samples that may be of the same set."""
    from nsmaps.dynamics.attractors.attractor import kept, may_be_one

    sets = (kept(end.coordinates, end.states, len(end.states) * bool(end.period), end.label, SAME, scale) for end in (one, other))
    return one.period == other.period and may_be_one(*sets)


def _also(result: "StudyResult", returns: int, ends: "tuple[LimitSet, LimitSet]", scale: Floats) -> str:
    """A statement on which of two different attractors, exact first, is also one of the other map."""
    reduced, (exact, other) = result.reduced, ends
    there = counterpart(result.system, result.composite)
    also = reduced is not None and _stays(reduced, exact, returns, scale), _stays(there, other, returns, scale)
    if all(also):
        return "each map has both attractors"
    if not any(also):
        return "neither map stays on the other's attractor"
    ours, theirs = ("exact", "composite") if also[0] else ("composite", "exact")
    return f"the {ours} map's is also an attractor of the {theirs} map, the {theirs} map's is not one of the {ours} map"


def _stays(return_map: "ReturnMap", ends: "LimitSet", returns: int, scale: Floats) -> bool:
    """Whether an orbit of a map from the last state of an attractor stays on it for some returns."""
    from nsmaps.dynamics.attractors.limit_set import limit_set
    from nsmaps.dynamics.orbit import orbit

    found = limit_set(return_map, orbit(return_map, ends.states[-1], returns))
    return found is not None and _alike(ends, found, scale)


def _short(ends: "LimitSet") -> str:
    if not ends.period:
        return ends.meaning
    return f"period {ends.period}{f' ({ends.name})' if ends.name else ''}"


def _scale(result: "StudyResult", pair: "OrbitPair") -> Floats:
    """The sides of the study's grid, or, of coordinates without one, the extents of the exact orbit, shape (n,)."""
    from nsmaps.dynamics.attractors.distance import extents

    sides = np.diff(grid_ends(result), axis=1)[:, 0]
    return np.where(np.isnan(sides), extents(pair.exact.states, result.system.coordinates), sides)
