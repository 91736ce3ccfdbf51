"""Branches of periodic orbits in one parameter, around folds, with the events along them."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Control, correct, follow, passes, tangent
from nsmaps.dynamics.continuation.border import GAP, PERSISTENCE
from nsmaps.dynamics.continuation.branch import Branch, GrowingBranch
from nsmaps.dynamics.continuation.crossing import other_tangent
from nsmaps.dynamics.continuation.ends import border_ahead, end_of
from nsmaps.dynamics.continuation.events import (
    AT_INFINITY,
    BORDER,
    BRANCH_POINT,
    DOUBLING,
    HALVING,
    TESTS,
    TORUS,
    BifurcationPoint,
    between,
)
from nsmaps.dynamics.continuation.infinity import infinity_met
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint, curve_from
from nsmaps.dynamics.continuation.shrinking import SMALLEST
from nsmaps.dynamics.periodic import PeriodicOrbit, dependent
from nsmaps.dynamics.returnmap import Model, check_range, check_steps, map_along
from nsmaps.errors import NsmapsError, check_choice, check_class
from nsmaps.progress import shows

BEND = 0.98  #: least cosine between the directions at both ends of a step
BEFORE = [TESTS[DOUBLING], TESTS[TORUS]]  #: of events that may take place on the way to infinity
PASSED = 8  #: greatest number of borders that a cascade passes without a doubling
CLOSED = "closed"  #: the reason of a branch that returns to its first orbit


@dataclass(frozen=True, slots=True)
class _Extent:
    """The resolution and the length of a branch."""

    step: float  #: longest step, in arclength
    max_points: int  #: greatest number of orbits
    until: Collection[str]  #: kinds of events at which the branch ends
    kinds: Collection[str]  #: kinds of events that are located


@shows
def continue_branch(
    system: Model,
    parameter: str,
    orbit: PeriodicOrbit,
    value: float,
    bounds: tuple[float, float],
    *,
    direction: Literal["up", "down", "both"] = "up",
    step: float = 0.02,
    max_points: int = 2000,
    until: Collection[str] = (),
    tolerance: float = 1e-10,
    kinds: Collection[str] = tuple(TESTS),
) -> Branch:
    """The branch of a periodic orbit by pseudo-arclength continuation, around folds, with its events located.

    All its orbits have the words of the first, by the map's own first returns, so that no earlier impact is overlooked. It
    ends at the end of the range, where the words change (`grazing`, `border collision`), where there is no map, after an event
    of `until`, where it closes, or is lost. Two events of one kind within a step are missed; a smaller `step` finds them.

    Args:
        system: a system, its `CompleteChatter`, or the map as a function of the parameter's value; a ValueError means that
            there is none.
        parameter: its name.
        orbit: at, or near, the value, with all its states.
        value: of the parameter.
        bounds: least and greatest value of the parameter; their difference is the unit of its arclength, in which
            coordinates count as shares of the orbit's `scale`, the extent of its motion, and phases in radians.
        direction: towards larger ("up") or smaller ("down") values at first, or one branch through the orbit of "both", from
            the end at smaller values on, in which the arclength of that part is negative.
        step: longest step, in arclength.
        max_points: greatest number of orbits.
        until: kinds of events at which the branch ends, see `BifurcationPoint`.
        tolerance: largest residual of an orbit, as a share of the same scale.
        kinds: kinds of events that are located. The event at which a branch ends is always reported.

    Raises:
        NsmapsError: invalid arguments. An orbit that does not converge gives a branch without orbits.
    """
    check_choice("direction", direction, ("up", "down", "both"))
    if direction == "both":
        how: Any = {"step": step, "max_points": max_points, "until": until, "tolerance": tolerance, "kinds": kinds}
        up = continue_branch(system, parameter, orbit, value, bounds, direction="up", **how)
        if not len(up.values) or up.ended == CLOSED:
            return up
        return up.after(continue_branch(system, parameter, orbit, value, bounds, direction="down", **how))
    extent = _extent(bounds, value, step, max_points, until, kinds)
    curve = curve_from(map_along(system, parameter), orbit, value, bounds, tolerance, parameter)
    upward = np.zeros(orbit.states.size + 1)
    upward[-1] = 1.0 if direction == "up" else -1.0
    start = correct(curve, curve.y(orbit.states, value), upward)
    if why := _family(curve, orbit, value):
        return Branch.empty(orbit, parameter, f"no branch from the orbit at {value:.9g}: {why}")
    if start is None:
        why = curve.missing(value) or f"Newton's method does not converge{_lost(curve, orbit, value)}"
        return Branch.empty(orbit, parameter, f"no orbit at {value:.9g}: {why}")
    return _follow(curve, start, tangent(start, upward), extent, fresh=False)


@shows
def switch_branch(
    system: Model,
    parameter: str,
    point: BifurcationPoint,
    bounds: tuple[float, float],
    *,
    side: Literal[1, -1] = 1,
    step: float = 0.02,
    max_points: int = 2000,
    until: Collection[str] = (),
    tolerance: float = 1e-10,
    kinds: Collection[str] = tuple(TESTS),
    doubled: bool = False,
) -> Branch:
    """The other branch at a bifurcation point of a branch; other arguments as `continue_branch`.

    At a `period doubling` it is that of twice the period, which leaves in the direction (u, -u) of the eigenvector of the
    multiplier -1, at a fixed parameter. At a `branch point`, such as a pitchfork, it is the other one, in one of its two
    directions. At a `border collision` of pieces given by formulas it is the branch of the orbits with the pieces beyond the
    border, which begins at a millionth of the scale from it: on the other side of the parameter at a `persistence`, on the same
    one at a fold; with `doubled` the branch of the cycles that make the returns of one side and then of the other.

    Args:
        side: 1 or -1, the direction at a branch point. Both halves of a pitchfork are on the same side of the parameter, and
            mirror images.

    Raises:
        NsmapsError: no other branch is known to begin at the point, none is found there, or other arguments are invalid.
    """
    check_class(point, BifurcationPoint, "another branch begins at an event of a branch")
    extent = _extent(bounds, point.value, step, max_points, until, kinds)
    curve = curve_from(map_along(system, parameter), point.orbit, point.value, bounds, tolerance, parameter)
    if doubled and not point.doubles:
        raise NsmapsError(f"the event is a {point.kind}; expected: a {DOUBLING}, or a border collision of formulas with doubling")
    if point.kind == DOUBLING:
        return _doubled(curve, point, extent)
    if point.at is not None:
        return _beyond(curve, point, extent, *((0, 1) if doubled else (1,)))
    if point.kind != BRANCH_POINT or point.towards is None:
        text = f"a {DOUBLING}, a {BRANCH_POINT}, or a {BORDER} of pieces given by formulas"
        raise NsmapsError(f"the event is a {point.kind}; expected: {text}")
    start, own = curve.evaluate(curve.y(point.orbit.states, point.value)), curve.scaled(point.towards)
    along = None if start is None else other_tangent(curve, start, own / np.linalg.norm(own))
    if start is None or along is None:
        raise NsmapsError(f"no second branch is found at {point.value:.9g}; expected: a {BRANCH_POINT} that was located")
    return _follow(curve, start, side * along, extent, fresh=True)


def _doubled(curve: OrbitCurve, point: BifurcationPoint, extent: _Extent) -> Branch:
    """The branch of cycles of twice the period that begins at a period doubling."""
    orbit = point.orbit
    values, vectors = np.linalg.eig(orbit.derivative)
    u = [vectors[:, np.argmin(np.abs(values + 1))].real]
    assert orbit.returns.derivative is not None
    for derivative in [*orbit.returns.derivative, *orbit.returns.derivative][:-1]:
        u.append(derivative @ u[-1])
    curve = replace(curve, period=2 * len(orbit.states))
    along = np.append(np.ravel(u / curve.scale), 0.0)
    along /= np.linalg.norm(along)
    start = curve.evaluate(curve.y(np.tile(orbit.states, (2, 1)), point.value))
    assert start is not None
    return _follow(curve, start, along, extent, fresh=True)


def _beyond(curve: OrbitCurve, point: BifurcationPoint, extent: _Extent, *sides: int) -> Branch:
    """The branch that begins at a border, with the pieces of its sides one after the other."""
    assert point.at is not None
    curve = replace(curve, period=len(sides) * curve.period)
    start = point.at.beyond(curve, point.value, point.orbit.states, *sides) if point.border != GAP else None
    if start is None:
        raise NsmapsError(
            f"no branch begins at {point.value:.9g} ({point.detail}); expected: a border at which the map is continuous"
        )
    border = curve.y(np.tile(point.orbit.states, (len(sides), 1)), point.value)
    return _follow(curve, start, tangent(start, curve.difference(start.y, border)), extent, fresh=False)


@shows
def period_doubling_cascade(
    system: Model,
    parameter: str,
    orbit: PeriodicOrbit,
    value: float,
    bounds: tuple[float, float],
    *,
    direction: Literal["up", "down"] = "up",
    n_doublings: int = 4,
    step: float = 0.02,
) -> tuple[Branch, ...]:
    """The branches from an orbit to its first period doubling, from there to the next, and so on.

    There are as many as doublings, or fewer: the last one then states why it ended without one. A branch that ends at a border
    of pieces given by formulas, as a `persistence`, is continued by a further branch beyond it; there may be a doubling at the
    border too. Steps decrease with the period.
    Arguments and errors as `continue_branch`.
    """
    first = continue_branch(system, parameter, orbit, value, bounds, direction=direction, step=step, until=(DOUBLING,))
    return first, *doublings_of(system, first, bounds, n_doublings - 1, step)


def doublings_of(
    system: Model,
    branch: Branch,
    bounds: tuple[float, float],
    max_doublings: int,
    step: float = 0.02,
    kinds: Collection[str] = tuple(TESTS),
) -> tuple[Branch, ...]:
    """At most `max_doublings` branches of doubled cycles: from the first period doubling of a branch to the next, and so on.

    `step` is that of the given branch, and decreases with the period; other arguments as `switch_branch`.
    """
    branches, doublings, passed = [branch], 0, 0
    how: Any = {"step": step, "until": (DOUBLING,), "kinds": kinds}
    while max_doublings >= 0:
        event, last = branches[-1].doubling, branches[-1].events[-1:]
        if event is not None and doublings == max_doublings:
            break
        if event is not None:
            how["step"], doublings = how["step"] / 2, doublings + 1
            branches.append(switch_branch(system, branch.parameter, event, bounds, doubled=True, **how))
        elif passed < PASSED and last and last[0].at is not None and last[0].border in (PERSISTENCE, ""):
            passed += 1
            branches.append(switch_branch(system, branch.parameter, last[0], bounds, **how))
        else:
            break
    return tuple(branches[1:])


def _follow(curve: OrbitCurve, start: OrbitPoint, along: Floats, extent: _Extent, fresh: bool) -> Branch:
    """The branch from a point in a direction; a fresh one starts where two branches cross, where tests are meaningless."""
    grown, last, ended = GrowingBranch(curve), along, ""
    grown.add(start, 0.0)
    control = Control(extent.step, SMALLEST, BEND, low=curve.low / curve.unit, high=curve.high / curve.unit, parameters=1)
    for step in follow(curve, start, along, control):
        events = [] if fresh else between(curve, step, extent.kinds)
        grown.events.extend(events)
        ended = next((event.kind for event in events if event.kind in (*extent.until, HALVING)), "")
        if ended != HALVING:  # beyond it lie the same cycles with their halves exchanged
            grown.add(step.end, step.length)
        if not ended and step.last:
            ended = f"the range ends at {step.end.value:g}"
        elif not ended and (far := infinity_met(curve, step.end, float(np.sign(step.turned[-1])), BEFORE)):
            grown.events.append(BifurcationPoint(AT_INFINITY, *far, step.end.orbit, "a multiplier tends to 1"))
            ended = AT_INFINITY
        elif not ended and len(grown.points) > 3 and passes(curve, step, start, along, BEND):
            ended = CLOSED
        elif not ended and len(grown.points) >= extent.max_points:
            ended = f"{extent.max_points} orbits, before the range was covered: followed to {step.end.value:.9g}"
        for event in () if ended else border_ahead(grown, step.turned, extent.step, extent.kinds):
            grown.events.append(event)
            ended = event.kind if event.kind in (*extent.until, HALVING, BORDER) else ""
            if ended:
                break
        if ended:
            break
        last, fresh = step.turned, False
    return grown.branch(ended or end_of(grown, last), extent.step / 50)


def _family(curve: OrbitCurve, orbit: PeriodicOrbit, value: float) -> str:
    """The reason why an orbit that is one of a family has no branch, or an empty string."""
    here = curve.evaluate(curve.y(orbit.states, value))
    if here is None or not curve.exists(here) or not dependent(here.jacobian):
        return ""
    return (
        "it is one of a family, as of motions that keep their energy, or two branches cross there: a multiplier is 1, and the "
        "parameter does not change that; expected: a map of one coordinate less, on which what is kept has a fixed value"
    )


def _lost(curve: OrbitCurve, orbit: PeriodicOrbit, value: float) -> str:
    """An addition to the reason for a guess that has no images."""
    return "" if orbit.returns.valid.all() else f", and the guess has no image: {curve.outcomes(orbit.states, value)}"


def _extent(
    bounds: tuple[float, float], value: float, step: float, max_points: int, until: Collection[str], kinds: Collection[str]
) -> _Extent:
    check_range(value, bounds)
    check_steps(step, SMALLEST, max_points)
    if unknown := set(kinds) - set(TESTS):
        raise NsmapsError(f"unknown kinds of events {', '.join(sorted(unknown))!r}; expected: {', '.join(TESTS)}")
    return _Extent(step, max_points, until, {*kinds, *until})
