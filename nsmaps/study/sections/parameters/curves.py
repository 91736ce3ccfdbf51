"""Bifurcation curves over the plane of the section `parameter_plane`, by events of branches."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import Field

from nsmaps.dynamics.curves.problem import Kind
from nsmaps.dynamics.motion import MEANING, kind_of
from nsmaps.errors import NsmapsError
from nsmaps.study.conclusions.texts import percent, plain, shares_text
from nsmaps.study.reading.values import Range, Section
from nsmaps.study.sections.base import Finding, Verdict, verdict
from nsmaps.study.sections.parameters.branches import map_of_branch

if TYPE_CHECKING:
    from nsmaps.dynamics.curves.curve import BifurcationCurve
    from nsmaps.study.sections.base import Plan, Study, StudyResult


class CurveSection(Section):
    """A bifurcation curve in two parameters, from the first event of a kind on a branch.

    It is followed within the bounds of the branch and the values of the second parameter, with the step of the branch.
    """

    branch: str = Field(description="an entry of `branches` in the first parameter of `plane`")
    event: Kind = Field(description="the first of this kind on the branch or its doublings")


def check_curves(key: str, name: str, curves: tuple[CurveSection, ...], study: "Study") -> None:
    """Raise StudyError at the first curve of a section without its event on a branch in a parameter, or given twice."""
    branches = {branch.name: branch for branch in study.branches if branch.parameter == name}
    for number, curve in enumerate(curves):
        loc = (key, "bifurcation_curves", number)
        study.source.known((*loc, "branch"), curve.branch, list(branches), f"branch in {name!r}")
        located = (*branches[curve.branch].kinds, "grazing", "border collision", "detachment")
        if curve.event not in located:
            text = f"the branch {curve.branch!r} locates no {curve.event}; expected: one of its 'kinds', {', '.join(located)}"
            raise study.source.error((*loc, "event"), text)
        if curve in curves[:number]:
            text = f"the curve of {curve.branch!r} and {curve.event!r} is given twice; expected: each once"
            raise study.source.error(loc, text)


def curve_of(plan: "Plan", result: "StudyResult", curve: CurveSection, across: Range) -> "BifurcationCurve":
    """The first event of its kind on a branch, followed in both parameters; without orbits where there is none."""
    from nsmaps.dynamics.curves.curve import BifurcationCurve, bifurcation_curve

    section = next(branch for branch in plan.study.branches if branch.name == curve.branch)
    branches = result.branches[curve.branch]
    event = next((event for branch in branches for event in branch.of_kind(curve.event)), None)
    if event is None:
        ends = "; ".join(dict.fromkeys(branch.ended for branch in branches))
        return BifurcationCurve.empty(curve.event, f"the branch has none: {ends}")
    own = plan.system.parameters[across.parameter]
    bounds = {section.parameter: section.bounds, across.parameter: (min(own, across.low), max(own, across.high))}
    try:
        return bifurcation_curve(map_of_branch(section, plan.system), event, bounds, step=section.step)
    except NsmapsError as error:
        return BifurcationCurve.empty(curve.event, str(error))


def plain_curves(curves: "Mapping[str, BifurcationCurve]") -> dict[str, Any]:
    """Curves for JSON: the parameters along each, the reasons of its ends, and its points of codimension two."""
    return {
        name: {
            "parameters": plain(curve.parameters),
            "ended": list(curve.ended),
            "special": [
                {"kind": point.kind, "parameters": list(point.parameters), "precision": list(point.precision)}
                for point in curve.special
            ],
            "everywhere": list(curve.everywhere),
        }
        for name, curve in curves.items()
    }


def plane_finding(
    of: str,
    spans: Sequence[Range],
    shares: Mapping[str, float],
    curves: "Mapping[str, BifurcationCurve]",
    more: tuple[tuple[str, str], ...] = (),
) -> Finding:
    """The shares of the motions in a plane of two parameters, its curves, and their points of codimension two.

    Args:
        of: the name of the map.
        spans: the ranges of both parameters.
        shares: of the points of the plane, by motion.
        curves: by event and branch.
        more: further numbers with their meanings.
    """
    names = {_in_words(name): share for name, share in shares.items()}
    plane = " and ".join(f"{span.parameter} from {span.low:g} to {span.high:g}" for span in spans)
    traced = [name for name, curve in curves.items() if len(curve.parameters)]
    texts = [f"{shares_text(names)} of the plane of {plane}", *([f"curves of {', '.join(traced)}"] if traced else [])]
    special = [point for curve in curves.values() for point in curve.special]
    both = " and ".join(span.parameter for span in spans)
    numbers = [(percent(share), f"of the points of the plane have {name}") for name, share in _largest(names)]
    numbers += [*more]
    numbers += [(", ".join(f"{x:.6g}" for x in point.parameters), f"{both} of a {point.kind}") for point in special]
    return Finding(of, "; ".join(texts), tuple(numbers))


def _in_words(name: str) -> str:
    """The name of a motion, with its kind where it has no period."""
    kind = kind_of(name)
    return f"{MEANING[kind]} ({name})" if kind else name or "no attractor"


def _largest(shares: Mapping[str, float]) -> list[tuple[str, float]]:
    """The largest shares."""
    return sorted(shares.items(), key=lambda pair: -pair[1])[:3]


def missing_curves(of: str, curves: "Mapping[str, BifurcationCurve]") -> Iterator[Verdict]:
    """The failed verdicts on curves without orbits."""
    for name, curve in curves.items():
        if not len(curve.parameters):
            yield verdict(f"parameter_plane: curve of the {name}", of, False, curve.ended[0])
