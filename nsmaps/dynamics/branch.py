"""Branches of periodic orbits in one parameter, around folds, with what happens to them on the way."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nsmaps.dynamics.arclength import Curve, Place
from nsmaps.dynamics.events import COARSEST, DOMAIN, DOUBLING, GRAZING, HALVING, TESTS, Event, at_zero, between
from nsmaps.dynamics.motion import magnitudes
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.dynamics.trail import Branch, Trail
from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Floats
from nsmaps.progress import shows

BEND = 0.98  #: least cosine between the directions at both ends of a step
SMALLEST = 1e-9  #: step, of the range of the parameter, at which a branch is given up
CLOSE = 1e-3  #: a margin from a graze, in the curve's units, within which a branch that ends as it falls is taken to end there
CLOSED = "closed"  #: how a branch ends that comes back to its first orbit
MARGINS = ("a clearance", "an impact speed")


@dataclass(frozen=True, slots=True)
class _Extent:
    """How finely and how long a branch is followed."""

    step: float  #: longest, in arclength
    most: int  #: orbits
    until: Collection[str]  #: kinds of events at which the branch is left
    kinds: Collection[str]  #: those that are looked for


@shows
def continue_branch(
    map_of: Callable[[float], ReturnMap],
    orbit: PeriodicOrbit,
    value: float,
    within: tuple[float, float],
    toward: Literal["up", "down"] = "up",
    step: float = 0.02,
    most: int = 2000,
    until: Collection[str] = (),
    tolerance: float = 1e-10,
    kinds: Collection[str] = tuple(TESTS),
) -> Branch:
    """The branch of a periodic orbit by pseudo-arclength continuation, around folds, with its events located.

    All its orbits make the words of the first, by the map's own first returns: none has an earlier impact that is overlooked. It
    ends at the end of the range, where the words change (`grazing`), where there is no map, after an event of `until`, where it
    closes, or is lost. Two events of one kind within a step escape notice: a smaller `step` finds them.

    Args:
        map_of: the return map at a value of the parameter; a ValueError says that there is none.
        orbit: at, or near, the value, with all its states.
        value: of the parameter.
        within: least and greatest value of the parameter; their difference is the unit of its arclength, in which speeds
            count as shares of the largest on the orbit (or its guess) and phases in radians.
        toward: larger or smaller values at first.
        step: longest, in arclength.
        most: orbits.
        until: kinds of events, see `Event`.
        tolerance: largest residual of an orbit, as a share of the same.
        kinds: of the events that are located. What a branch ends at is always told.

    Raises:
        NsmapsError: arguments that are not accepted. An orbit that does not converge makes a branch without orbits.
    """
    extent = _extent(within, value, step, most, until, kinds)
    curve = Curve(map_of, len(orbit.states), *within, tolerance, _scale(orbit))
    upward = np.zeros(orbit.states.size + 1)
    upward[-1] = 1.0 if toward == "up" else -1.0
    start = curve.solve(curve.y(orbit.states, value), upward)
    if start is None:
        why = curve.missing(value) or f"Newton's method does not converge{_lost(curve, orbit, value)}"
        return Branch.empty(orbit, f"no orbit at {value:.9g}: {why}")
    return _follow(curve, start, start.tangent * np.copysign(1.0, start.tangent @ upward), extent, fresh=False)


@shows
def doubled_branch(
    map_of: Callable[[float], ReturnMap],
    event: Event,
    within: tuple[float, float],
    step: float = 0.02,
    most: int = 2000,
    until: Collection[str] = (),
    tolerance: float = 1e-10,
    kinds: Collection[str] = tuple(TESTS),
) -> Branch:
    """The branch of cycles of twice the period that begins at a period doubling; other arguments as `continue_branch`.

    It leaves in the direction (u, -u) of the eigenvector of the multiplier -1, with the parameter at rest.

    Raises:
        NsmapsError: the event is no period doubling, or other arguments are not accepted.
    """
    if event.kind != DOUBLING:
        raise NsmapsError(f"the event is a {event.kind}; accepted: a {DOUBLING}")
    extent = _extent(within, event.parameter, step, most, until, kinds)
    orbit = event.orbit
    values, vectors = np.linalg.eig(orbit.derivative)
    u = [vectors[:, np.argmin(np.abs(values + 1))].real]
    assert orbit.returns.derivative is not None
    for derivative in [*orbit.returns.derivative, *orbit.returns.derivative][:-1]:
        u.append(derivative @ u[-1])
    curve = Curve(map_of, 2 * len(orbit.states), *within, tolerance, _scale(orbit))
    along = np.append(np.ravel(u / curve.scale), 0.0)
    along /= np.linalg.norm(along)
    start = curve.place(curve.y(np.tile(orbit.states, (2, 1)), event.parameter))
    assert start is not None
    return _follow(curve, start, along, extent, fresh=True)


@shows
def cascade(
    map_of: Callable[[float], ReturnMap],
    orbit: PeriodicOrbit,
    value: float,
    within: tuple[float, float],
    toward: Literal["up", "down"] = "up",
    doublings: int = 4,
    step: float = 0.02,
) -> tuple[Branch, ...]:
    """The branches from an orbit to its first period doubling, from there to the next, and so on.

    As many as there are doublings, or fewer: the last one then says why it ended without one. Steps shrink with the period.
    Arguments and errors as `continue_branch`.
    """
    first = continue_branch(map_of, orbit, value, within, toward, step, until=(DOUBLING,))
    return first, *doublings_of(map_of, first, within, doublings - 1, step)


def doublings_of(
    map_of: Callable[[float], ReturnMap],
    branch: Branch,
    within: tuple[float, float],
    most: int,
    step: float = 0.02,
    kinds: Collection[str] = tuple(TESTS),
) -> tuple[Branch, ...]:
    """At most so many branches of doubled cycles: from the first period doubling of a branch to the next, and so on.

    `step` is that of the branch given, and shrinks with the period; others as `doubled_branch`.
    """
    branches = [branch]
    while len(branches) <= most and (found := branches[-1].of_kind(DOUBLING)):
        step /= 2
        branches.append(doubled_branch(map_of, found[0], within, step, until=(DOUBLING,), kinds=kinds))
    return tuple(branches[1:])


def _scale(orbit: PeriodicOrbit) -> Floats:
    """What the coordinates of a branch are shares of, shape (n,): as in the residual of its first orbit."""
    return magnitudes(orbit.returns.coordinates, orbit.states) if orbit.scale is None else orbit.scale


def _follow(curve: Curve, start: Place, along: Floats, extent: _Extent, fresh: bool) -> Branch:
    """The branch from a place in a direction; a fresh one starts where two branches cross and tests mean nothing."""
    trail = Trail(curve)
    trail.add(start, 0.0)
    at, first, h, ended = start, along, extent.step, ""
    while not ended:
        h = _to_the_end(curve, at, along, h)
        new = _step(curve, at, along, h)
        if new is None:
            h /= 2
            if h < SMALLEST:
                ended = _end(trail, along)
            continue
        turned = new.tangent * np.copysign(1.0, new.tangent @ along)
        events = [] if fresh else between(curve, at, along, new, turned, h, extent.kinds)
        trail.events.extend(events)
        ended = next((event.kind for event in events if event.kind in (*extent.until, HALVING)), "")
        if ended != HALVING:  # beyond it lie the same cycles, their halves swapped
            trail.add(new, h)
        if not ended and new.value in (curve.low, curve.high):
            ended = f"the range ends at {new.value:g}"
        elif not ended and turned @ first > BEND and _closed(curve, start, at, new, h, len(trail.places)):
            ended = CLOSED
        elif not ended and len(trail.places) >= extent.most:
            ended = f"{extent.most} orbits"
        h = min(1.5 * h, extent.step) if turned @ along > 1 - (1 - BEND) / 4 else h
        at, along, fresh = new, turned, False
    return trail.branch(ended, extent.step / 50)


def _to_the_end(curve: Curve, at: Place, along: Floats, h: float) -> float:
    """The step, or as much of it as leads to the end of the range."""
    end = (curve.high if along[-1] > 0 else curve.low) / curve.unit
    left = (end - at.y[-1]) / along[-1] if along[-1] else np.inf
    return float(left) if 0 < left < h else h


def _step(curve: Curve, at: Place, along: Floats, h: float) -> Place | None:
    """The next place on the branch, within the range; None where there is none or it lies too far from the line."""
    y, plane = at.y + h * along, along
    if not curve.low < y[-1] * curve.unit < curve.high:  # the last step: to the end of the range itself
        y[-1] = (curve.high if along[-1] > 0 else curve.low) / curve.unit
        plane = np.append(np.zeros(len(y) - 1), 1.0)
    new = curve.solve(y, plane)
    if new is None or not np.array_equal(new.orbit.returns.codes, at.orbit.returns.codes) or curve.apart(new, at) > 2 * h:
        return None
    return new if abs(new.tangent @ along) > BEND and curve.low <= new.value <= curve.high else None


def _closed(curve: Curve, start: Place, at: Place, new: Place, h: float, reached: int) -> bool:
    """Whether a step in the direction of the first one passes the place where the branch began."""
    return reached > 3 and max(curve.apart(start, place) for place in (at, new)) <= h * 1.01


def _end(trail: Trail, along: Floats) -> str:
    """Why a branch cannot be followed beyond its last place; if it is an event, that is added to it."""
    last, unit = trail.places[-1], trail.curve.unit
    if told := trail.curve.missing(last.value + 10 * SMALLEST * unit * float(np.sign(along[-1]))):
        trail.events.append(Event(DOMAIN, last.value, SMALLEST * unit, last.orbit, told))
        return DOMAIN
    for k, margin in enumerate(MARGINS):
        m, values = _spaced(trail, k)
        if m[0] > CLOSE or len(m) < 3 or m[0] >= min(m[1:]):
            continue
        value, precision = at_zero(m, values)
        if precision <= COARSEST * unit:
            trail.events.append(Event(GRAZING, value, precision + SMALLEST * unit, last.orbit, f"{margin} is zero"))
            return GRAZING
    return f"lost at {last.value:.9g}: {trail.curve.outcomes(last.orbit.states, last.value + SMALLEST * unit * along[-1])}"


def _lost(curve: Curve, orbit: PeriodicOrbit, value: float) -> str:
    """What to add of a guess that has no images."""
    return "" if orbit.returns.valid.all() else f", and the guess has no image: {curve.outcomes(orbit.states, value)}"


def _spaced(trail: Trail, margin: int) -> tuple[list[float], list[float]]:
    """A margin and the parameter at the last place and at two before it that are not crowded."""
    rows, least = [(len(trail.places) - 1)], 1e-6
    for k in range(len(trail.places) - 2, -1, -1):
        if len(rows) < 3 and trail.arclength[-1] - trail.arclength[k] >= least:
            rows.append(k)
            least *= 10
    return [float(trail.places[k].margins[margin]) for k in rows], [trail.places[k].value for k in rows]


def _extent(
    within: tuple[float, float], value: float, step: float, most: int, until: Collection[str], kinds: Collection[str]
) -> _Extent:
    low, high = within
    if not low <= value <= high or not low < high:
        raise NsmapsError(f"the value {value:g} is not within {low:g} and {high:g}; accepted: a range that holds it")
    if not 10 * SMALLEST < step <= 1 or most < 1:
        raise NsmapsError(f"{most} orbits, step {step:g}; accepted: at least one orbit, a step up to 1")
    if unknown := set(kinds) - set(TESTS):
        raise NsmapsError(f"there are no events {', '.join(sorted(unknown))!r} to be located; accepted: {', '.join(TESTS)}")
    return _Extent(step, most, until, {*kinds, *until})
