"""The steps of a study's run that follow periodic orbits in a parameter, and attractors over two."""

from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.exact.parts import Along
from nsmaps.study.branchspec import BranchSection, CurveSection
from nsmaps.study.plan import Plan
from nsmaps.study.result import StudyResult

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit
    from nsmaps.dynamics.stability import EventCurve
    from nsmaps.dynamics.trail import Branch
    from nsmaps.exact.impacts import Floats

REPEATS = 1e-6  #: largest difference of states, as a share of their magnitudes, of a cycle that is one of a shorter period


def branches(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """The branches by name: one a direction, then those of doubled cycles."""
    made = {}
    for number, section in enumerate(plan.study.branches):
        with plan.study.source.located(("branches", number)):
            made[section.name] = _followed(plan, section, _orbit(plan, section, plan.cycles[number]))
        plan.told((number + 1) / len(plan.study.branches))
    return {"branches": made}


def stability(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """What attracts over two parameters, and the curves of events over it."""
    from nsmaps.dynamics.stability import stability_diagram

    section = plan.study.stability
    assert section is not None
    spans = section.along, section.across
    along, across = (np.linspace(span.low, span.high, span.points) for span in spans)
    count = 1 + len(section.curves)
    how: Any = {"longest": section.longest, "transient": section.transient, "follow": section.follow}
    how |= {"progress": plan.part(0, count, len(across)), "keep": plan.keep}
    map_of = Along(plan.system, *(span.parameter for span in spans))
    curves = {}
    with plan.study.source.located(("stability",)):
        made = stability_diagram(map_of, along, across, plan.begin["stability"], **how)
        for number, each in enumerate(section.curves, 1):
            curves[f"{each.event} of {each.branch}"] = _curve(plan, result, each, map_of, across)
            plan.told((number + 1) / count)
    return {"stability": made, "curves": curves}


def _orbit(plan: Plan, section: BranchSection, start: "Floats") -> "PeriodicOrbit":
    """The cycle near the start of a branch, or as near to one as Newton's method came."""
    from nsmaps.dynamics.periodic import periodic_orbit

    there = plan.system.at(**{section.parameter: section.value(plan.system.parameters)})
    return periodic_orbit(there, start, section.period)


def _followed(plan: Plan, section: BranchSection, orbit: "PeriodicOrbit") -> "tuple[Branch, ...]":
    """The branch of a cycle in each direction and those of its doublings; one without orbits where there is no such cycle."""
    from nsmaps.dynamics.branch import CLOSED, continue_branch, doublings_of
    from nsmaps.dynamics.motion import magnitudes, periods
    from nsmaps.dynamics.trail import Branch

    value, map_of = section.value(plan.system.parameters), Along(plan.system, section.parameter)
    about: Any = {"within": section.within, "step": section.step, "kinds": section.events}
    made: list[Branch] = []
    for way in section.ways:
        made.append(continue_branch(map_of, orbit, value, toward=way, **about))
        if not len(made[0].parameter):
            return (made[0],)
        if made[0].ended == CLOSED:  # the other way round are the same orbits
            break
    first = made[0].orbits[0]
    twice = np.tile(first.states, (2, 1)), np.tile(first.returns.codes, 2)
    least = int(periods(*twice, plan.system.coordinates, REPEATS * magnitudes(plan.system.coordinates, first.states)))
    if least < section.period:
        told = f"no orbit of period {section.period} at {value:.9g}: Newton's method arrives at one of period {least}"
        return (Branch.empty(orbit, told),)
    doubled = [doublings_of(map_of, branch, most=section.doublings - 1, **about) for branch in made]
    return tuple(branch for some in (made, *doubled) for branch in some)


def _curve(plan: Plan, result: StudyResult, curve: CurveSection, map_of: Along, across: "Floats") -> "EventCurve":
    """An event of a branch over the second parameter: from the value next to the study's own on, to both ends."""
    from nsmaps.dynamics.stability import EventCurve, event_curve

    number = [section.name for section in plan.study.branches].index(curve.branch)
    section = plan.study.branches[number]
    orbit, value = _orbit(plan, section, plan.cycles[number]), section.value(plan.system.parameters)
    known = zip(section.ways, result.branches[curve.branch], strict=False)
    way = next((way for way, branch in known if branch.of_kind(curve.event)), section.ways[0])
    assert map_of.second is not None
    own = int(np.abs(across - plan.system.parameters[map_of.second]).argmin())
    ends = across[:own][::-1], across[own:]
    down, up = (event_curve(map_of, orbit, value, end, curve.event, section.within, way, section.step) for end in ends)
    values, precision = (np.concatenate([getattr(down, name)[::-1], getattr(up, name)]) for name in ("values", "precision"))
    return EventCurve(curve.event, values, across, precision, down.reasons[::-1] + up.reasons)
