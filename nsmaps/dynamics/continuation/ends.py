"""The ends of branches: at a graze, a border, the end of complete chatter, or where there is no map."""

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.continuation.bisection import bisect_change
from nsmaps.continuation.core import Step, tangent
from nsmaps.dynamics.continuation.border import GAP, border_beside, border_type
from nsmaps.dynamics.continuation.branch import GrowingBranch
from nsmaps.dynamics.continuation.events import (
    AFFINE,
    BORDER,
    CHATTER_ENDS,
    DETACHMENT,
    DOMAIN,
    GRAZING,
    HALVING,
    HOMOCLINIC,
    BifurcationPoint,
    between,
)
from nsmaps.dynamics.continuation.pieces import Met, border_met
from nsmaps.dynamics.continuation.shrinking import (
    ALIKE,
    CLOSE,
    SMALLEST,
    WORST,
    at_zero,
    becomes_equilibrium,
    doubling_rows,
    points_from_end,
    vanishes,
)
from nsmaps.dynamics.motion import has_rest
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ExactMap, ReturnMap
from nsmaps.exact.words import CHATTER, REST

SHORTEST = {REST: 2e-13 * np.pi, CHATTER: 1e-5}  #: radians of phase: rests that are not resolved, after one impact and after many
MARGINS = ("a clearance", "an impact speed")
DECADES = 1e-3, 1e-5, 1e-7  #: distances along a branch from its last point, in whose logarithm times may grow
FURTHER = np.geomspace(1e-8, 1e-2, 13)  #: distances, in the parameter's range, within which contact may last for all times
FAR = 2.0  #: times as long as one that is not resolved, a rest to whose place the precision of its end is the distance
NEAR = 1e-4  #: share of a speed, within which the sum of chatter may begin with another impact
LAST_POINTS = 60  #: of a branch, whose states are released again at other values of the parameter
RELEASE_EVERY = 6  #: of these points
IMPACTS = 500  #: returns within which impacts that accumulate are summed
RELEASE = 1e-12  #: share of the parameter, to which the release from a contact is known


def end_of(grown: GrowingBranch, along: Floats) -> str:
    """The reason why a branch cannot be continued beyond its last point; if it is an event, it is added to the branch."""
    last, unit, beyond = grown.points[-1], grown.curve.unit, float(np.sign(along[-1]))
    event = _domain_ends(grown, beyond) or _chatter_ends(grown, beyond) or _stays_in_contact(grown, beyond)
    if event is None and _summation_changes(grown):
        return (
            f"lost at {last.value:.9g}, where the number of impacts before chatter is summed changes; expected: complete chatter "
            "as one event, by nsmaps.dynamics.CompleteChatter, or, with modes, a section at a clock"
        )
    event = event or _leaves_its_pieces(grown, along)
    for end in (becomes_equilibrium, _grazes, _never_returns, vanishes, _meets_a_border, _has_no_image):
        event = event or end(grown, beyond)
    if event is not None:
        grown.events.append(event)
        return event.kind
    return f"lost at {last.value:.9g}: {grown.curve.outcomes(last.orbit.states, last.value + SMALLEST * unit * along[-1])}"


def _leaves_its_pieces(grown: GrowingBranch, along: Floats) -> BifurcationPoint | None:
    """The border of a piece given by a formula next to the last point; a cycle there of finite slopes ends the branch."""
    met = border_met(grown.curve, grown.points[-1], along)
    return None if met is None else _at_border(grown, met, along)


def border_ahead(grown: GrowingBranch, along: Floats, reach: float, kinds: Collection[str]) -> list[BifurcationPoint]:
    """The events up to a border of a piece given by a formula within an arclength, at which a branch ends; none without one."""
    last, met = grown.points[-1], border_met(grown.curve, grown.points[-1], along, reach)
    if met is None:
        return []
    way = float(along @ grown.curve.difference(met.point.y, last.y))
    smooth = replace(grown.curve, map_of=met.at.along(grown.curve.map_of))
    before = between(smooth, Step(last, along, met.point, tangent(met.point, along), way, False), kinds) if way > 0 else []
    return [*before, _at_border(grown, met, along)]


def _at_border(grown: GrowingBranch, met: Met, along: Floats) -> BifurcationPoint:
    """The event at a border; a cycle there of finite slopes is added to the branch."""
    last, point = grown.points[-1], met.point if met.side == 0 else grown.points[-1]
    border, detail = met.at.outcome(grown.curve, met.point.value, met.point.orbit.states)
    if met.side == 0:
        grown.add(point, max(float(along @ grown.curve.difference(point.y, last.y)), 0.0))
        if met.at.halves(grown.curve, point):
            return BifurcationPoint(HALVING, point.value, met.precision, point.orbit, AFFINE, at=met.at)
    return BifurcationPoint(BORDER, met.point.value, met.precision, point.orbit, detail, border, at=met.at)


def _domain_ends(grown: GrowingBranch, beyond: float) -> BifurcationPoint | None:
    """The end of the valid domain next to the last point."""
    last, unit = grown.points[-1], grown.curve.unit
    reason = grown.curve.missing(last.value + 10 * SMALLEST * unit * beyond)
    return BifurcationPoint(DOMAIN, last.value, SMALLEST * unit, last.orbit, reason) if reason else None


def _grazes(grown: GrowingBranch, beyond: float) -> BifurcationPoint | None:
    """A graze next to the last point, where a margin that falls from point to point is zero."""
    last, unit, points = grown.points[-1], grown.curve.unit, points_from_end(grown)
    margins = np.array([grown.curve.margins(grown.curve.map_of(point.value), point.orbit.states) for point in points])
    for margin, found in zip(MARGINS, margins.T, strict=True):
        rows = doubling_rows(found)
        if not found[0] <= CLOSE or len(rows) < 3:
            continue
        value, precision = at_zero(found[rows].tolist(), np.array([points[k].value for k in rows]))
        if precision <= WORST * unit:
            border = border_type(grown.curve, border_beside(grown.curve, last, graze=True), last, value, beyond, graze=True)
            return BifurcationPoint(GRAZING, value, precision + SMALLEST * unit, last.orbit, f"{margin} is zero", border)
    return None


def _never_returns(grown: GrowingBranch, _: float) -> BifurcationPoint | None:
    """A homoclinic bifurcation next to the last point: the time of the orbit grows with the logarithm of the distance.

    The precision is that of the last step; the time of the orbits before it, as they are spaced, must grow by the same amount a
    decade on both halves of the way.
    """
    last, unit = grown.points[-1], grown.curve.unit
    off = grown.arclength[-1] - np.array(grown.arclength)
    times = np.array([point.orbit.returns.time.sum() for point in grown.points])
    rows = [int(np.abs(np.log(np.maximum(off, SMALLEST) / distance)).argmin()) for distance in DECADES]
    if len(set(rows)) < len(DECADES) or not np.isfinite(times[rows]).all():
        return None
    rates = np.diff(times[rows]) / -np.diff(np.log(off[rows]))
    if not (rates.min() > ALIKE * rates.max() and times[rows[-1]] - times[rows[0]] > CLOSE * times[rows[0]]):
        return None
    return BifurcationPoint(HOMOCLINIC, last.value, 10 * SMALLEST * unit, last.orbit, "the time of the orbit grows without bound")


def _summation_changes(grown: GrowingBranch) -> bool:
    """True if the last point has chatter, and speeds are next to those at which its sum is taken: no border of the motion."""
    last, curve = grown.points[-1], grown.curve
    returns = last.orbit.returns
    if not any(CHATTER in word for word in last.orbit.words):
        return False
    shares = np.where(curve.coordinates.angles, 0.0, NEAR)
    return_map = curve.map_of(last.value)
    tried = [return_map.first_return(returns.start * (1 + sign * shares)).words for sign in (-1, 1)]
    return any((CHATTER in one) != (CHATTER in own) for words in tried for one, own in zip(words, returns.words, strict=True))


def _has_no_image(grown: GrowingBranch, beyond: float) -> BifurcationPoint | None:
    """The place next to the last point beyond which motions from the orbit have no image, as where a mode begins at its end."""
    last, unit = grown.points[-1], grown.curve.unit
    value = last.value + 10 * SMALLEST * unit * beyond
    return_map, _ = map_or_reason(grown.curve.map_of, value)
    if return_map is None or return_map.first_return(last.orbit.states).valid.all():
        return None
    detail = f"beyond it there is no image: {grown.curve.outcomes(last.orbit.states, value)}"
    return BifurcationPoint(BORDER, last.value, 10 * SMALLEST * unit, last.orbit, detail)


def _stays_in_contact(grown: GrowingBranch, beyond: float) -> BifurcationPoint | None:
    """The place next to the last point from which on a body that rests, and is released in each period, is so no longer."""
    curve, last = grown.curve, grown.points[-1]
    if not any(map(has_rest, last.orbit.words)):
        return None

    def rests(values: Floats) -> Bools:
        return np.array([rests_for_good(map_or_reason(curve.map_of, float(value))[0], last.orbit.states) for value in values])

    near = np.array([last.value])
    for share in FURTHER:
        far = np.clip(near + beyond * share * curve.unit, curve.low, curve.high)
        if rests(far)[0]:
            low, high, _ = bisect_change(rests, near, far, np.array([False]), np.array([True]))
            precision = float(np.abs(high - low)[0]) + RELEASE * abs(float(high[0]))
            return BifurcationPoint(
                DETACHMENT, float(high[0]), precision, last.orbit, "the force at the contact no longer falls to zero"
            )
    return None


def rests_for_good(return_map: ReturnMap | None, states: Floats) -> bool:
    """True if there is a map, and the motion from the first state of an orbit (q, n) ends in contact for all times."""
    if return_map is None:
        return False
    now = states[:1]
    for _ in range(IMPACTS):
        returns = return_map.first_return(now)
        if returns.outcome[0] == Outcome.rests:
            return True
        if not returns.valid[0] or has_rest(str(returns.words[0])):  # released, as before
            return False
        now = returns.image
    return False


def _meets_a_border(grown: GrowingBranch, beyond: float) -> BifurcationPoint | None:
    """A border next to the last point, where the map is not smooth, or jumps."""
    last, unit = grown.points[-1], grown.curve.unit
    found = border_beside(grown.curve, last, graze=False)
    if not found and (passed := border_beside(grown.curve, last, graze=False, beyond=beyond)).words:
        found = passed
    border = border_type(grown.curve, found, last, last.value, beyond, graze=False)
    detail = "the map jumps" if border == GAP else "the words change" if found.words else "the derivative jumps"
    detail = "an event passes the instant of the section: its state jumps, the motion continues" if found.passes else detail
    return BifurcationPoint(BORDER, last.value, 10 * SMALLEST * unit, last.orbit, detail, border) if border else None


def _chatter_ends(grown: GrowingBranch, beyond: float) -> BifurcationPoint | None:
    """The end of complete chatter next to the last point, where the impacts accumulate at the release, by bisection.

    Near the release flights of many impacts are so low that rounding of the displacement counts. The precision is the distance
    from where the rest is twice as long as one that is not resolved: it falls ever faster, so that this overestimates it.
    """
    curve, last = grown.curve, grown.points[-1]
    if not curve.resting or not _rest_time(grown, last.value) < CLOSE:
        return None
    shortest = SHORTEST[CHATTER if any(CHATTER in word for word in last.orbit.words) else REST]

    def longer(least: float) -> Callable[[Floats], Bools]:
        return lambda values: np.array([_rest_time(grown, float(values[0])) > least])

    own, off, yes, no = np.array([last.value]), 10 * SMALLEST * curve.unit, np.array([True]), np.array([False])
    for far in (own + off, own - off):
        if not longer(0.0)(far)[0]:
            end = bisect_change(longer(0.0), own, far, yes, no)[0]
            values = [point.value for point in grown.points[::-1]]
            resolved = next((value for value in values if _rest_time(grown, value) > FAR * shortest), values[-1])
            near = bisect_change(longer(FAR * shortest), np.array([resolved]), end, yes, no)[0]
            precision = float(np.abs(end - near)[0]) + 4 * float(np.spacing(abs(end[0])))
            return BifurcationPoint(CHATTER_ENDS, float(end[0]), precision, last.orbit, "the rest before the release is zero")
    return None


def _rest_time(grown: GrowingBranch, value: float) -> float:
    """How long a body rests at a value of the parameter, after a motion from a release on with the words of the last orbit.

    NaN where the words are others. All states that come to rest are released at one instant: those of earlier orbits rest for
    longer, and so at other values too.
    """
    return_map, _ = map_or_reason(grown.curve.map_of, value)
    codes, k = grown.points[-1].orbit.returns.codes, grown.curve.resting[0]
    if not isinstance(return_map, ExactMap):
        return np.nan
    points = grown.points[: -LAST_POINTS - 1 : -RELEASE_EVERY]
    rested = return_map.first_return(np.array([point.orbit.states[k] for point in points]))
    now = rested.select(np.flatnonzero(rested.valid & (rested.codes == codes[k]))[:1])
    for code in np.roll(codes, -k - 1):
        now = return_map.first_return(now.image)
        if not (now.valid & (now.codes == code)).any():
            return np.nan
    return float(return_map.rests(now.start)[0])
