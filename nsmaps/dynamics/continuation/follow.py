"""Branches of periodic orbits in one parameter, around folds, with the events along them."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.continuation.core import Control, correct, follow, passes, tangent
from nsmaps.dynamics.continuation.border import GAP, PERSISTENCE
from nsmaps.dynamics.continuation.branch import Branch, GrowingBranch
from nsmaps.dynamics.continuation.crossing import other_tangent
from nsmaps.dynamics.continuation.ends import border_ahead, end_of
from nsmaps.dynamics.continuation.events import AT_INFINITY, BORDER, BRANCH_POINT, DOUBLING, HALVING, TESTS, TORUS, Event, between
from nsmaps.dynamics.continuation.infinity import infinity_met
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint, curve_from
from nsmaps.dynamics.continuation.shrinking import SMALLEST
from nsmaps.dynamics.periodic import PeriodicOrbit, dependent
from nsmaps.errors import NsmapsError, check_class
from nsmaps.exact.returnmap import ReturnMap
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
    map_of: Callable[[float], ReturnMap],
    orbit: PeriodicOrbit,
    value: float,
    bounds: tuple[float, float],
    direction: Literal["up", "down"] = "up",
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
        map_of: the return map at a value of the parameter; a ValueError means that there is none.
        orbit: at, or near, the value, with all its states.
        value: of the parameter.
        bounds: least and greatest value of the parameter; their difference is the unit of its arclength, in which
            coordinates count as shares of the orbit's `scale`, the extent of its motion, and phases in radians.
        direction: towards larger ("up") or smaller ("down") values at first.
        step: longest step, in arclength.
        max_points: greatest number of orbits.
        until: kinds of events at which the branch ends, see `Event`.
        tolerance: largest residual of an orbit, as a share of the same scale.
        kinds: kinds of events that are located. The event at which a branch ends is always reported.

    Raises:
        NsmapsError: invalid arguments. An orbit that does not converge gives a branch without orbits.
    """
    extent = _extent(bounds, value, step, max_points, until, kinds)
    curve = curve_from(map_of, orbit, value, bounds, tolerance)
    upward = np.zeros(orbit.states.size + 1)
    upward[-1] = 1.0 if direction == "up" else -1.0
    start = correct(curve, curve.y(orbit.states, value), upward)
    if why := _family(curve, orbit, value):
        return Branch.empty(orbit, f"no branch from the orbit at {value:.9g}: {why}")
    if start is None:
        why = curve.missing(value) or f"Newton's method does not converge{_lost(curve, orbit, value)}"
        return Branch.empty(orbit, f"no orbit at {value:.9g}: {why}")
    return _follow(curve, start, tangent(start, upward), extent, fresh=False)


@shows
def doubled_branch(
    map_of: Callable[[float], ReturnMap],
    event: Event,
    bounds: tuple[float, float],
    step: float = 0.02,
    max_points: int = 2000,
    until: Collection[str] = (),
    tolerance: float = 1e-10,
    kinds: Collection[str] = tuple(TESTS),
) -> Branch:
    """The branch of cycles of twice the period that begins at a period doubling; other arguments as `continue_branch`.

    It leaves in the direction (u, -u) of the eigenvector of the multiplier -1, at a fixed parameter; at a border with doubling
    of pieces given by formulas it makes the returns of one side and then of the other.

    Raises:
        NsmapsError: no branch of twice the period is known to begin at the event, or other arguments are invalid.
    """
    check_class(event, Event, "a branch of twice the period begins at an event of another branch")
    if not event.doubles:
        raise NsmapsError(f"the event is a {event.kind}; expected: a {DOUBLING}, or a border collision of formulas with doubling")
    extent = _extent(bounds, event.parameter, step, max_points, until, kinds)
    if event.kind != DOUBLING:
        return _beyond(map_of, event, bounds, tolerance, extent, 0, 1)
    orbit = event.orbit
    values, vectors = np.linalg.eig(orbit.derivative)
    u = [vectors[:, np.argmin(np.abs(values + 1))].real]
    assert orbit.returns.derivative is not None
    for derivative in [*orbit.returns.derivative, *orbit.returns.derivative][:-1]:
        u.append(derivative @ u[-1])
    curve = replace(curve_from(map_of, orbit, event.parameter, bounds, tolerance), period=2 * len(orbit.states))
    along = np.append(np.ravel(u / curve.scale), 0.0)
    along /= np.linalg.norm(along)
    start = curve.evaluate(curve.y(np.tile(orbit.states, (2, 1)), event.parameter))
    assert start is not None
    return _follow(curve, start, along, extent, fresh=True)


@shows
def switched_branch(
    map_of: Callable[[float], ReturnMap],
    event: Event,
    bounds: tuple[float, float],
    side: Literal[1, -1] = 1,
    step: float = 0.02,
    max_points: int = 2000,
    until: Collection[str] = (),
    tolerance: float = 1e-10,
    kinds: Collection[str] = tuple(TESTS),
) -> Branch:
    """The other branch at a branch point, such as that of the asymmetric orbits at a pitchfork, in one of its two directions.

    At a `border collision` of pieces given by formulas it is the branch of the orbits with the pieces beyond the border, which
    begins at a millionth of the scale from it: on the other side of the parameter at a `persistence`, on the same one at a fold.

    Args:
        side: 1 or -1, the direction. Both halves of a pitchfork are on the same side of the parameter, and mirror images.

    Raises:
        NsmapsError: the event is neither a branch point that was located nor such a border, no second branch is found there, or
            other arguments, which are as of `continue_branch`, are invalid.
    """
    check_class(event, Event, "a branch that crosses another one begins at an event of that one")
    extent = _extent(bounds, event.parameter, step, max_points, until, kinds)
    if event.at is not None:
        return _beyond(map_of, event, bounds, tolerance, extent, 1)
    if event.kind != BRANCH_POINT or event.towards is None:
        raise NsmapsError(f"the event is a {event.kind}; expected: a {BRANCH_POINT}, or a {BORDER} of pieces given by formulas")
    curve = curve_from(map_of, event.orbit, event.parameter, bounds, tolerance)
    start, own = curve.evaluate(curve.y(event.orbit.states, event.parameter)), curve.scaled(event.towards)
    along = None if start is None else other_tangent(curve, start, own / np.linalg.norm(own))
    if start is None or along is None:
        raise NsmapsError(f"no second branch is found at {event.parameter:.9g}; expected: a {BRANCH_POINT} that was located")
    return _follow(curve, start, side * along, extent, fresh=True)


def _beyond(
    map_of: Callable[[float], ReturnMap],
    event: Event,
    bounds: tuple[float, float],
    tolerance: float,
    extent: _Extent,
    *sides: int,
) -> Branch:
    """The branch that begins at a border, with the pieces of its sides one after the other."""
    assert event.at is not None
    curve = curve_from(map_of, event.orbit, event.parameter, bounds, tolerance)
    curve = replace(curve, period=len(sides) * curve.period)
    start = event.at.beyond(curve, event.parameter, event.orbit.states, *sides) if event.border != GAP else None
    if start is None:
        raise NsmapsError(
            f"no branch begins at {event.parameter:.9g} ({event.detail}); expected: a border at which the map is continuous"
        )
    border = curve.y(np.tile(event.orbit.states, (len(sides), 1)), event.parameter)
    return _follow(curve, start, tangent(start, curve.difference(start.y, border)), extent, fresh=False)


@shows
def cascade(
    map_of: Callable[[float], ReturnMap],
    orbit: PeriodicOrbit,
    value: float,
    bounds: tuple[float, float],
    direction: Literal["up", "down"] = "up",
    doublings: int = 4,
    step: float = 0.02,
) -> tuple[Branch, ...]:
    """The branches from an orbit to its first period doubling, from there to the next, and so on.

    There are as many as doublings, or fewer: the last one then states why it ended without one. A branch that ends at a border
    of pieces given by formulas, as a `persistence`, is continued by a further branch beyond it; there may be a doubling at the
    border too. Steps decrease with the period.
    Arguments and errors as `continue_branch`.
    """
    first = continue_branch(map_of, orbit, value, bounds, direction, step, until=(DOUBLING,))
    return first, *doublings_of(map_of, first, bounds, doublings - 1, step)


def doublings_of(
    map_of: Callable[[float], ReturnMap],
    branch: Branch,
    bounds: tuple[float, float],
    max_doublings: int,
    step: float = 0.02,
    kinds: Collection[str] = tuple(TESTS),
) -> tuple[Branch, ...]:
    """At most `max_doublings` branches of doubled cycles: from the first period doubling of a branch to the next, and so on.

    `step` is that of the given branch, and decreases with the period; other arguments as `doubled_branch`.
    """
    branches, doublings, passed = [branch], 0, 0
    while max_doublings >= 0:
        event, last = branches[-1].doubling, branches[-1].events[-1:]
        if event is not None and doublings == max_doublings:
            break
        if event is not None:
            step, doublings = step / 2, doublings + 1
            branches.append(doubled_branch(map_of, event, bounds, step, until=(DOUBLING,), kinds=kinds))
        elif passed < PASSED and last and last[0].at is not None and last[0].border in (PERSISTENCE, ""):
            passed += 1
            branches.append(switched_branch(map_of, last[0], bounds, step=step, until=(DOUBLING,), kinds=kinds))
        else:
            break
    return tuple(branches[1:])


def _follow(curve: OrbitCurve, start: OrbitPoint, along: Floats, extent: _Extent, fresh: bool) -> Branch:
    """The branch from a point in a direction; a fresh one starts where two branches cross, where tests are meaningless."""
    grown, last, ended = GrowingBranch(curve), along, ""
    grown.add(start, 0.0)
    control = Control(extent.step, SMALLEST, BEND, low=curve.low / curve.unit, high=curve.high / curve.unit)
    for step in follow(curve, start, along, control):
        events = [] if fresh else between(curve, step, extent.kinds)
        grown.events.extend(events)
        ended = next((event.kind for event in events if event.kind in (*extent.until, HALVING)), "")
        if ended != HALVING:  # beyond it lie the same cycles with their halves exchanged
            grown.add(step.end, step.length)
        if not ended and step.last:
            ended = f"the range ends at {step.end.value:g}"
        elif not ended and (far := infinity_met(curve, step.end, float(np.sign(step.turned[-1])), BEFORE)):
            grown.events.append(Event(AT_INFINITY, *far, step.end.orbit, "a multiplier tends to 1"))
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
    low, high = bounds
    if not low <= value <= high or not low < high:
        raise NsmapsError(f"the value {value:g} is not between {low:g} and {high:g}; expected: bounds that contain it")
    if not 10 * SMALLEST < step <= 1 or max_points < 1:
        raise NsmapsError(f"{max_points} orbits, step {step:g}; expected: at least one orbit, a step up to 1")
    if unknown := set(kinds) - set(TESTS):
        raise NsmapsError(f"unknown kinds of events {', '.join(sorted(unknown))!r}; expected: {', '.join(TESTS)}")
    return _Extent(step, max_points, until, {*kinds, *until})
