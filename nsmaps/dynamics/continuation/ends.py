"""The ends of branches: at a graze, a border, the end of complete chatter, or where there is no map."""

from typing import Protocol, runtime_checkable

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats
from nsmaps.continuation.bisection import bisect_change
from nsmaps.continuation.zeros import extrapolated
from nsmaps.dynamics.continuation.border import GAP, border_beside, border_type
from nsmaps.dynamics.continuation.branch import GrowingBranch
from nsmaps.dynamics.continuation.events import BORDER, CHATTER_ENDS, COARSEST, DOMAIN, GRAZING, Event
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.exact.words import CHATTER, REST

SMALLEST = 1e-9  #: step, as a share of the parameter's range, at which a branch is abandoned
CLOSE = 1e-3  #: a margin from a graze, in the curve's units, within which a branch that ends while it falls is taken to end there
SHORTEST = {REST: 2e-13 * np.pi, CHATTER: 1e-5}  #: radians of phase: rests that are not resolved, after one impact and after many
MARGINS = ("a clearance", "an impact speed")


@runtime_checkable
class Resting(Protocol):
    """A return map in which complete chatter is one event."""

    def rests(self, states: ArrayLike) -> Floats:
        """How long the ball rests before its release, in radians of phase, shape (N,); NaN without complete chatter."""


def end_of(grown: GrowingBranch, along: Floats) -> str:
    """The reason why a branch cannot be continued beyond its last point; if it is an event, it is added to the branch."""
    last, unit, beyond = grown.points[-1], grown.curve.unit, float(np.sign(along[-1]))
    for end in (_domain_ends, _chatter_ends, _grazes, _meets_a_border):
        if event := end(grown, beyond):
            grown.events.append(event)
            return event.kind
    return f"lost at {last.value:.9g}: {grown.curve.outcomes(last.orbit.states, last.value + SMALLEST * unit * along[-1])}"


def _domain_ends(grown: GrowingBranch, beyond: float) -> Event | None:
    """The end of the valid domain next to the last point."""
    last, unit = grown.points[-1], grown.curve.unit
    reason = grown.curve.missing(last.value + 10 * SMALLEST * unit * beyond)
    return Event(DOMAIN, last.value, SMALLEST * unit, last.orbit, reason) if reason else None


def _grazes(grown: GrowingBranch, beyond: float) -> Event | None:
    """A graze next to the last point, where a margin that falls from point to point is zero."""
    last, unit = grown.points[-1], grown.curve.unit
    for k, margin in enumerate(MARGINS):
        m, values = _spaced(grown, k)
        if m[0] > CLOSE or len(m) < 3 or m[0] >= min(m[1:]) or not np.isfinite(m).all():
            continue
        value, precision = extrapolated(m, np.array(values))
        if precision <= COARSEST * unit:
            border = border_type(grown.curve, border_beside(grown.curve, last), last, value, beyond, graze=True)
            return Event(GRAZING, value, precision + SMALLEST * unit, last.orbit, f"{margin} is zero", border)
    return None


def _meets_a_border(grown: GrowingBranch, beyond: float) -> Event | None:
    """A border next to the last point, where the map is not smooth, or jumps."""
    last, unit = grown.points[-1], grown.curve.unit
    found = border_beside(grown.curve, last)
    border = border_type(grown.curve, found, last, last.value, beyond, graze=False)
    detail = "the map jumps" if border == GAP else "the words change" if found.words else "the derivative jumps"
    return Event(BORDER, last.value, 10 * SMALLEST * unit, last.orbit, detail, border) if border else None


def _spaced(grown: GrowingBranch, margin: int) -> tuple[list[float], list[float]]:
    """A margin and the parameter at the last point and at up to three well-separated points before it."""
    rows, least = [(len(grown.points) - 1)], 1e-6
    for k in range(len(grown.points) - 2, -1, -1):
        if len(rows) < 4 and grown.arclength[-1] - grown.arclength[k] >= least:
            rows.append(k)
            least *= 10
    points, curve = [grown.points[k] for k in rows], grown.curve
    margins = [curve.margins(curve.map_of(point.value), point.orbit.states)[margin] for point in points]
    return list(map(float, margins)), [point.value for point in points]


def _chatter_ends(grown: GrowingBranch, beyond: float) -> Event | None:
    """The end of complete chatter next to the last point, where the impacts accumulate at the release, by bisection.

    Near the release flights of many impacts are so low that rounding of the displacement counts. The precision is the distance
    at which the rest is one that is not resolved, by linear interpolation, which overestimates it: the rest falls ever faster.
    """
    curve, last = grown.curve, grown.points[-1]
    map, q = curve.map_of(last.value), curve.period
    if not (isinstance(map, Resting) and bool((map.rests(last.orbit.states) < CLOSE).any())):
        return None

    def same(values: Floats) -> Bools:
        there, _ = map_or_reason(curve.map_of, float(values[0]))
        states, holds = last.orbit.states, there is not None
        for _ in range(q + 1):  # after complete chatter the orbit is known from any state of it
            if there is None or not holds:
                break
            returns = there.first_return(states)
            holds = np.array_equal(returns.codes, last.orbit.returns.codes) and bool(returns.valid.all())
            states = np.roll(returns.image, 1, axis=0)
        return np.array([holds])

    own, off = np.array([last.value]), 10 * SMALLEST * curve.unit
    for far in (own + off, own - off):
        if same(own)[0] and not same(far)[0]:
            low = bisect_change(same, own, far, np.array([True]), np.array([False]))[0]
            least = float(np.nanmin(map.rests(last.orbit.states)))
            share = SHORTEST[CHATTER if any(CHATTER in word for word in last.orbit.words) else REST] / least
            precision = share * abs(float(low[0]) - last.value) + 4 * float(np.spacing(abs(low[0])))
            return Event(CHATTER_ENDS, float(low[0]), precision, last.orbit, "the rest before the release is zero")
    return None
