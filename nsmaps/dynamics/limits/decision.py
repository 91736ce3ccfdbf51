"""What orbits end on: a cycle, chaos, quasi-periodic motion, escape, or nothing that was shown. It is decided here alone."""

from dataclasses import replace
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.distance import extents
from nsmaps.dynamics.limits.cycles import (
    LONGEST,
    SHORT,
    approached,
    cycle_in,
    departs,
    largest_distances,
    near_periods,
)
from nsmaps.dynamics.limits.limit import Limit
from nsmaps.dynamics.limits.path import Path, diverges, escapes, exponent_of, followed, growth_on
from nsmaps.dynamics.limits.releases import between_releases, comes_to_rest, is_determined, until_release
from nsmaps.dynamics.motion import CHAOS, ESCAPE, QUASI_PERIODIC, UNRESOLVED
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap

FOLLOWED = 1024, 4096  #: returns over which orbits without a period are followed, one after the other
ENOUGH = 512  #: returns from whose growth of tangent vectors chaos is decided
ERRORS = 4.0  #: standard errors by which the exponent of chaos exceeds zero
BOUNDED, STEADY = 12.0, 1.0  #: largest changes of the logarithm of growth of a quasi-periodic orbit, and of its mean by quarters
RECURS = 0.05  #: share of the extents within which a quasi-periodic orbit comes back to where it was
LEAVES = 40.0  #: largest growth of a difference, as a logarithm, on the way from rounding to the extent of the motion
RESONANT = 1e-3  #: of the scale: repetition that is taken for the slow approach of a cycle, not for quasi-periodic motion
ASIDE = 1e-3  #: of the scale: how far from an unstable cycle an orbit starts again


def limits(
    return_map: ReturnMap, states: Floats, scale: Floats, tolerance: float = 1e-6, starts: Floats | None = None
) -> list[Limit]:
    """What the orbits of states (M, n) end on, which are followed for up to 5120 returns.

    A cycle is one to which Newton's method leads, or one that is seen to repeat where the map has no derivative, as in chatter;
    an orbit on an unstable cycle starts again from beside it, once.
    Chaos is shown by a largest Lyapunov exponent above four times its standard error and growth by more than a factor of e^12,
    quasi-periodic motion by growth that stays within this factor and has no trend, of an orbit that comes back to where it was,
    an escape by coordinates that grow without end. Cycles with chatter or rest last from one release to the next at this phase.

    Args:
        scale: shape (n,), of each coordinate, or (M, n), of each orbit, see `nsmaps.dynamics.scale.scale_of`.
        tolerance: share of it within which the states of a cycle repeat.
        starts: shape (M, n), before a transient, beside which the states of orbits that escape are vast; the states if omitted.
    """
    each, begun = np.broadcast_to(scale, states.shape), states if starts is None else starts
    found: dict[int, Limit] = {}
    open_, now, done = list(range(len(states))), states, 0
    for count in FOLLOWED:
        if not open_:
            break
        path, done = followed(return_map, now, count, begun[open_]), done + count
        for place, k in enumerate(open_):
            found[k] = replace(limit_of(return_map, path.of_one(place), each[k], tolerance), more=done)
        open_ = [k for k in open_ if found[k].is_open]
        now = np.array([_onward(return_map, found[k], each[k]) for k in open_])
    return [found[k] for k in range(len(states))]


def limits_on(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float = 1e-6) -> list[Limit]:
    """As `limits`, of the M orbits whose last returns are known, which are followed only where these do not show it."""
    each, grows = np.broadcast_to(scale, path.begun.shape), path.slopes is not None and len(path.codes) >= ENOUGH
    found = [limit_of(return_map, path.of_one(k), each[k], tolerance, grows) for k in range(len(each))]
    if not (open_ := [k for k, one in enumerate(found) if one.is_open]):
        return found
    states = np.array([_onward(return_map, found[k], each[k]) for k in open_])
    for k, one in zip(open_, limits(return_map, states, each[open_], tolerance, path.begun[open_]), strict=True):
        found[k] = one
    return found


def limit_of(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float, with_growth: bool = True) -> Limit:
    """What the orbit of one path ends on, as far as this path shows it, without the growth of tangent vectors if so wanted."""
    found = seen(return_map, path, scale, tolerance)
    if not found.is_open or found.unstable:
        return found
    found = _by_growth(return_map, path, scale, tolerance) if with_growth else _cycle(return_map, path, scale, tolerance) or found
    if found.kind != CHAOS or comes_to_rest(path) or not return_map.has_orbits:
        return found
    later = followed(return_map, path.states[-1], FOLLOWED[-1], path.begun)  # rare rests make an orbit periodic
    if not comes_to_rest(later):
        return found
    return _between_rests(return_map, later, scale, tolerance) or Limit(UNRESOLVED, until_release(later))


def seen(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float) -> Limit:
    """What the orbit of one path is on up to rounding, or between rests; unresolved otherwise."""
    if not np.isfinite(path.states[-1]).all():
        gone = path.outcome[-1, 0] in (Outcome.returned, Outcome.escaped)  # a formula that has overflowed
        return Limit(ESCAPE if gone else "", path)
    if escapes(path, scale) or diverges(path):
        return Limit(ESCAPE, path)
    found = _between_rests(return_map, path, scale, tolerance) if comes_to_rest(path) else None
    if found is not None:
        return found
    short = path.last(min(SHORT, len(path.codes)))
    found = cycle_in(return_map, short, scale, tolerance, by_newton=False)
    return Limit(UNRESOLVED, path) if found is None else replace(found, path=path)


def beside(return_map: ReturnMap, state: Floats, scale: Floats) -> Floats:
    """A state beside an unstable cycle, on the side on which it has an image."""
    step = ASIDE * scale * np.random.default_rng(0).uniform(0.5, 1, len(state))
    both = Coordinates(return_map.coordinates).wrap(np.array([state + step, state - step]))
    valid = return_map.first_return(both).valid
    return np.asarray(both[0] if valid[0] or not valid[1] else both[1])


def _onward(return_map: ReturnMap, found: Limit, scale: Floats) -> Floats:
    """The state from which an orbit is followed on: its last one, or one beside the unstable cycle that it is on."""
    last = found.path.states[-1, 0]
    return beside(return_map, last, scale) if found.unstable else last


def _between_rests(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float) -> Limit | None:
    """The cycle of one path from a release to the next one at its phase, unresolved if rounding decides when it rests again.

    None if no two releases have one phase.
    """
    path = until_release(path)
    period = between_releases(path, tolerance * scale)
    if period and is_determined(return_map, path, period, scale):
        return Limit("", path, period)
    return Limit(UNRESOLVED, path, rests=True) if period else None


def _cycle(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float) -> Limit | None:
    """The cycle on which the orbit of one path repeats within the tolerance, or that it comes nearer and nearer to."""
    return cycle_in(return_map, path, scale, tolerance) or approached(return_map, path, scale)


def _by_growth(return_map: ReturnMap, path: Path, scale: Floats, tolerance: float) -> Limit:
    """The cycle of one path that repeats within the tolerance, or what the growth of a tangent vector shows."""
    short = path.last(min(SHORT, len(path.codes)))
    cycle = cycle_in(return_map, short, scale, tolerance)
    if cycle is not None:
        return replace(cycle, path=path)
    growth = growth_on(return_map, path, scale)
    exponent, error = exponent_of(growth, float(path.numbers[:, 0].mean()))
    about: Any = {"exponent": exponent, "error": error}
    grows = bool(np.isfinite(exponent) and exponent > ERRORS * error)
    if grows and growth.sum() > LEAVES and not short.repeats(tolerance * scale):
        return Limit(CHAOS, path, **about)
    cycle = _cycle(return_map, path, scale, tolerance)
    if cycle is not None:
        return cycle
    if grows:
        return Limit(UNRESOLVED if growth.sum() <= BOUNDED or departs(path, scale) else CHAOS, path, **about)
    return Limit(QUASI_PERIODIC if _is_quasi_periodic(path, growth, scale) else UNRESOLVED, path, **about)


def _is_quasi_periodic(path: Path, growth: Floats, unit: Floats) -> bool:
    """True if growth stays bounded and the orbit comes back to where it was, without a period."""
    if len(growth) < FOLLOWED[-1] // 2 or not np.isfinite(growth).all():
        return False
    total = growth.cumsum()
    if np.ptp(total) > BOUNDED or np.ptp([part.mean() for part in np.array_split(total, 4)]) > STEADY:
        return False
    if min(near_periods(path, unit, RESONANT), default=LONGEST) < SHORT:
        return False
    first, *_, last = np.array_split(path.coordinates.wrap(path.states[1:, 0]), 4)
    scale = extents(np.concatenate([first, last]), path.coordinates, unit)
    return bool(largest_distances(last, first, path.coordinates, scale).max() <= RECURS)
