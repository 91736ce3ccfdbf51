"""The section `branches`: periodic orbits of the exact map followed in a parameter, with their events."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.dynamics.continuation.follow import CLOSED
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.progress import beat
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.phrases import MOST, at
from nsmaps.study.conclusions.texts import known, values_text
from nsmaps.study.estimates import COPIES, DERIVED, POINT, STORED, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Ends, Name, ParameterName, Period, Section
from nsmaps.study.sections.base import Entries, Finding, Table, Verdict, verdict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nsmaps.dynamics.chatter.complete import CompleteChatter
    from nsmaps.dynamics.continuation.branch import Branch
    from nsmaps.dynamics.continuation.events import BifurcationPoint
    from nsmaps.dynamics.periodic import PeriodicOrbit
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

Located = Literal["period doubling", "fold", "branch point", "Neimark-Sacker"]
Way = Literal["up", "down"]
REACHED = ("the range ends", CLOSED)  #: first words of `ended` of a branch that reached the end of its range


class BranchSection(Section):
    """A branch of periodic orbits of the exact map in one parameter, from the orbit near a state.

    A branch ends, with a report, at values that the system does not admit; one without orbits says why.
    """

    name: Name = Field(description="name of the branch")
    parameter: ParameterName
    start: dict[str, Number] = Field(description="a state near the orbit")
    period: Period = 1
    chatter: bool = Field(False, description="complete chatter at the section is one event, and counts as one return of `period`")
    value: Number | None = Field(None, description="the parameter at the start; the study's own by default")
    bounds: Ends = Field(description="range of the parameter")
    direction: Literal["up", "down", "both"] = Field("both", description="direction at first; folds turn a branch back")
    step: Number = Field(0.02, gt=1e-8, le=1, description="largest step in arclength: the range, and a state's unit, count one")
    kinds: tuple[Located, ...] = Field(
        ("period doubling", "fold", "branch point", "Neimark-Sacker"),
        description="events that are located; grazes and other ends are always reported",
    )
    n_doublings: int = Field(0, ge=0, le=12, description="period doublings that are followed one after another")

    @model_validator(mode="after")
    def _located(self) -> Self:
        if self.n_doublings and "period doubling" not in self.kinds:
            raise ValueError("'n_doublings' requires the event 'period doubling'; expected: 'period doubling' among 'kinds'")
        return self

    def value_in(self, parameters: Mapping[str, float]) -> float:
        """Start value of the parameter `parameter` in a system with the given parameters."""
        return parameters[self.parameter] if self.value is None else self.value

    @property
    def ways(self) -> tuple[Way, ...]:
        """The directions in which it is followed, one branch each."""
        return ("up", "down") if self.direction == "both" else (self.direction,)


BRANCHES: "FigurePart[Sequence[Branch]]" = FigurePart(
    "branches of periodic orbits", ("branches",), lambda result: [each for some in result.branches.values() for each in some]
)
GRAZES: "FigurePart[Sequence[BifurcationPoint]]" = FigurePart(
    "a grazing event of a branch",
    ("branches",),
    lambda result: [event for some in result.branches.values() for each in some for event in each.of_kind("grazing")],
)


class Branches(Entries[BranchSection]):
    """Periodic orbits of the exact map followed in a parameter, stable or not, with their events."""

    key: ClassVar[str] = "branches"
    results: ClassVar[Mapping[str, Any]] = {
        "branches": {},  #: by name: one per direction, then doubled cycles
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "parameters.branches",
            "The states of periodic orbits against the parameter, solid where stable and dashed where unstable, with events.",
            "Branches of periodic orbits, coloured by motion. Solid lines are stable, dashed lines unstable and dotted lines "
            "of unknown stability; marks are events.",
            (BRANCHES,),
        ),
        StudyFigure(
            "parameters.multipliers",
            "The moduli of the multipliers of periodic orbits against the parameter, and the multipliers beside the unit circle.",
            "Multipliers of a period along branches of periodic orbits: their moduli over the parameter, and the multipliers up "
            "to 2.5 from zero in the complex plane. Cycles are stable where all moduli are below one; marks are events.",
            (BRANCHES,),
        ),
        StudyFigure(
            "system.graze",
            "The motions just before, at and after a graze of a periodic orbit, and the square root of the map beside it.",
            "The first graze of a periodic orbit along the branches: the motions just before, at and after it, and the map along "
            "a coordinate through it, with the square root (dashed), whose coefficient is fitted to computed states.",
            (GRAZES, FigurePart("the system", (), lambda result: result.system)),
        ),
    )

    def check(self, study: "Study") -> None:
        study.once("branches", [branch.name for branch in self])

    def bind(self, binding: "Binding") -> tuple[Floats, ...]:
        """The starts, each of shape (n,)."""
        return tuple(_start(number, section, binding) for number, section in enumerate(self))

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The branches by name: one per direction, then those of doubled cycles."""
        found = {}
        for number, section in enumerate(self):
            with plan.study.source.located(("branches", number)):
                found[section.name] = _followed(plan, section, cycle_of(plan, number))
            beat((number + 1) / len(self))
        return {"branches": found}

    def describe(self, study: "Study") -> str:
        return ", ".join(f"{entry.name} ({entry.parameter} from {entry.bounds[0]:g} to {entry.bounds[1]:g})" for entry in self)

    def size(self, study: "Study", system: "System") -> Size:
        """Points per branch by its longest step; the cycles of a doubled one have twice the period."""
        found = Size()
        for section in self:
            points = len(section.ways) * 2 / section.step
            for doubled in range(section.n_doublings + 1):
                period = float(section.period) * 2**doubled
                found += Size(POINT + 20 * DERIVED * period, COPIES * STORED * period).times(points)
        return found

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        return {"branches": {name: _entry(entry) for name, entry in result.branches.items()}}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        """Whether each branch reached the ends of its range, and all requested doublings were found."""
        for section in self:
            entry = result.branches.get(section.name)
            if entry is None:
                continue
            first = [branch for branch in entry if branch.period == section.period]
            holds = all(branch.ended.startswith(REACHED) for branch in first)
            ends = "; ".join(f"{way}: {_end(branch)}" for way, branch in zip(section.ways, first, strict=False))
            text, name = ends if len(first[0].values) else first[0].ended, f"branch {section.name}"
            yield verdict(f"{name}: followed to the end of its range", result.system.map_name, holds, text)
            if section.n_doublings:
                yield verdict(f"{name}: doublings", result.system.map_name, *_doublings(section, entry))

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """Of each branch its range, and its bifurcations in the order of the branch."""
        for section in self:
            parts = [part for part in result.branches.get(section.name, ()) if len(part.values)]
            if not parts:
                continue
            first = [part for part in parts if part.period == section.period]
            ends = min(part.values.min() for part in first), max(part.values.max() for part in first)
            kinds: dict[str, list[BifurcationPoint]] = {}
            for event in (event for part in parts for event in part.events):
                kinds.setdefault(event.kind, []).append(event)
            name = first[0].orbits[0].label
            texts = [f"{name} followed for {section.parameter} from {ends[0]:.6g} to {ends[1]:.6g}"]
            texts += [f"{kind} at {values_text([one.value for one in some])}" for kind, some in kinds.items()]
            each = ((one, kind) for kind, some in kinds.items() for one in some)
            numbers = ((f"{section.parameter} = {one.value:.9g}", f"{kind} of {one.orbit.label}") for one, kind in each)
            yield Finding(result.system.map_name, ", ".join(texts), tuple(numbers))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The events on the branches, to the known digits."""
        names = {section.name: section.parameter for section in self}
        rows = [
            _row(name, names[name], event)
            for name, entry in result.branches.items()
            for branch in entry
            for event in branch.events
        ]
        yield Table("Events on branches", ("branch", "motion", "event", "parameter", "precision", ""), tuple(rows))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The events of every branch, each once."""
        lines = []
        for spec in self:
            events = [event for branch in result.branches.get(spec.name, ()) for event in branch.events]
            names = list(dict.fromkeys(f"{event.kind} at {spec.parameter} = {event.value:.6g}" for event in events))
            more = f" and {len(names) - MOST} more events" if len(names) > MOST else ""
            lines.append(f"{spec.name}, {', '.join(names[:MOST]) or 'no event'}{more}")
        varied = dict.fromkeys(branch.parameter for branch in self)
        return f"{at(result, varied)}{'; '.join(lines)}." if lines else ""


def _start(number: int, section: BranchSection, binding: "Binding") -> Floats:
    """The start of a branch; raises StudyError unless the parameter is in its range and valid."""
    source, loc, name = binding.study.source, ("branches", number), section.parameter
    source.known((*loc, "parameter"), name, binding.system.parameters, "parameter")
    value = section.value_in(binding.system.parameters)
    low, high = section.bounds
    if not low <= value <= high:
        text = f"{name} = {value:g} is not from {low:g} to {high:g}; expected: 'value' within 'bounds'"
        raise source.error(loc if section.value is None else (*loc, "value"), text)
    binding.check_value(loc, name, value, "value")
    if section.chatter:
        with source.located((*loc, "chatter")):
            FlowSystem.require(binding.system, "complete chatter")
    return binding.start((*loc, "start"), section.start)


def cycle_of(plan: "Plan", number: int) -> "PeriodicOrbit":
    """The cycle near the start of a branch, or the last iterate of Newton's method if it does not converge."""
    from nsmaps.dynamics.periodic import periodic_orbit

    section = plan.study.branches[number]
    there = map_of_branch(section, plan.system.at(**{section.parameter: section.value_in(plan.system.parameters)}))
    return periodic_orbit(there, plan.bound["branches"][number], section.period)


def map_of_branch(section: BranchSection, system: "System") -> "System | CompleteChatter":
    """The return map of a branch: that of the system, or with complete chatter as one event."""
    from nsmaps.dynamics.chatter.complete import CompleteChatter

    return CompleteChatter.of(system) if section.chatter else system


def _followed(plan: "Plan", section: BranchSection, orbit: "PeriodicOrbit") -> "tuple[Branch, ...]":
    """The branch of a cycle in each direction and those of its doublings; a branch without orbits if there is no cycle."""
    from nsmaps.dynamics.continuation.branch import Branch
    from nsmaps.dynamics.continuation.follow import continue_branch, doublings_of
    from nsmaps.dynamics.periodic import least_period

    value, model = section.value_in(plan.system.parameters), map_of_branch(section, plan.system)
    about: Any = {"bounds": section.bounds, "step": section.step, "kinds": section.kinds}
    branches: list[Branch] = []
    for way in section.ways:
        branches.append(continue_branch(model, section.parameter, orbit, value, direction=way, **about))
        if not len(branches[0].values):
            return (branches[0],)
        if branches[0].ended == CLOSED:  # the other direction has the same orbits
            break
    first = branches[0].orbits[0]
    least = least_period(first.states, first.coordinates, first.scale)
    if least < section.period:
        reason = f"no orbit of period {section.period} at {value:.9g}: Newton's method converges to one of period {least}"
        return (Branch.empty(orbit, section.parameter, reason),)
    doubled = [doublings_of(model, branch, max_doublings=section.n_doublings - 1, **about) for branch in branches]
    return tuple(branch for some in (branches, *doubled) for branch in some)


def _entry(entry: "Sequence[Branch]") -> dict[str, Any]:
    """The ends of each branch of an entry with their reasons, and the events on all of them."""
    parts, events = [], []
    for branch in entry:
        low, high = branch.values[[0, -1]].tolist() if len(branch.values) else (None, None)
        parts.append({"period": branch.period, "orbits": len(branch.values), "from": low, "to": high, "ended": branch.ended})
        events += [_event(event) for event in branch.events]
    return {"parts": parts, "events": events}


def _event(event: "BifurcationPoint") -> dict[str, Any]:
    about = {name: getattr(event, name) for name in ("kind", "parameter", "value", "precision", "detail")}
    return {"label": event.orbit.label, "digits": known(event.value, event.precision)} | about


def _end(branch: "Branch") -> str:
    """The reason why a branch ended, with its place if it is an event."""
    last = branch.events[-1] if branch.events else None
    if last is None or last.kind != branch.ended:
        return branch.ended
    return ", ".join(filter(None, (f"{last.kind} at {last.value:.9g}", _about(last))))


def _about(event: "BifurcationPoint") -> str:
    """What is known of an event beyond its kind."""
    return ", ".join(filter(None, (event.detail, event.border)))


def _doublings(section: BranchSection, branches: "tuple[Branch, ...]") -> tuple[bool, str]:
    """Whether all requested successive doublings were found, and where."""
    found = {branch: branch.doubling for branch in branches if branch.doubling is not None}
    asked = section.n_doublings * max(sum(branch.period == section.period for branch in found), 1)
    at = ", ".join(f"{event.value:.8g}" for event in found.values())
    if len(found) == asked:
        return True, f"at {at}"
    return False, f"{len(found)} of {asked}{at and f', at {at}'}; then: {branches[-1].ended}"


def _row(name: str, parameter: str, event: "BifurcationPoint") -> tuple[str, ...]:
    value = f"{parameter} = {known(event.value, event.precision)}"
    return name, event.orbit.label, event.kind, value, f"{event.precision:.1g}", _about(event)
