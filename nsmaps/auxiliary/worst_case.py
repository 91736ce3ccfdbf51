"""One update of the auxiliary maps: their worst case and their generic iteration on one box, section 6.2, steps 1 and 2."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.auxiliary.envelope import AuxiliaryMaps, Envelope, Extremes
from nsmaps.results import NONE, Result, array

MOST_STEPS = 400  # of one update, as in the paper
SLACK = 1e-5  # error of sampled envelopes, relative to the box's size

Part = Literal[0, 1, 2]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Update(Result):
    """One update of the auxiliary maps: their envelopes on a box, and both iterations of them."""

    number: int
    box: Floats = field(metadata=array("component end", "A^(N)"))
    envelopes: tuple[Envelope, ...]  #: one a coordinate
    worst: Floats = field(metadata=array("step component end", "intervals of eq. WCScobweb-v and -phi, the box first"))
    at: Floats = field(
        metadata=array("interval component side end", "where in each interval the lower map is least and the upper one largest")
    )
    conditions: Bools = field(metadata=array("interval component", "eq. part1-v and part1-phi at each worst-case iterate", NONE))
    generic: Floats = field(
        metadata=array("generic_step component", "iterates of eq. auxv and auxphi, upper and lower map alternately")
    )
    forward_invariant: bool  #: True if one worst-case step carries the box into itself
    converged: bool  #: True if the worst-case intervals converged

    @property
    def part(self) -> tuple[Part, ...]:
        """Which part of the Statement on bounds applies, by coordinate: 1 where eq. part1 holds at every iterate, else 2.

        Part 2 requires that the intervals converge; 0 where neither applies, as for a box that is not forward invariant. For
        increasing curves part 1 holds too, although the generic iteration ends elsewhere: see `AttractingDomain.generic_agrees`.
        """
        rests: Part = 2 if self.converged else 0
        return tuple(1 if self.forward_invariant and holds else rests for holds in np.all(self.conditions, axis=0).tolist())


def update(maps: AuxiliaryMaps, number: int, box: Floats) -> Update:
    """The worst-case intervals on a box until they converge; `with_generic` adds the generic iterates.

    A start box (number 1) must contain its image; a sampled image may exceed it by the error of sampling. Where the start box
    is forward invariant by bounds, orbits stay in the intersection of every interval with its image, so later boxes are too.
    """
    worst, places = [box], []
    size = np.ptp(box, axis=1)[:, None]
    found: Extremes | None = None
    forward_invariant = converged = False
    for step in range(MOST_STEPS):
        found = _next(maps, found, worst[-1])
        if step == 0:
            sampled = maps.status == "sampled"
            forward_invariant = (number > 1 and not sampled) or is_inside(found.bounds, box, SLACK if sampled else 0.0)
        worst.append(_common(found.bounds, worst[-1]) if forward_invariant else found.bounds)
        places.append(found.at)
        if not forward_invariant:
            break
        if np.all(np.abs(worst[-1] - worst[-2]) <= maps.same * size):
            converged = True
            break
    intervals = np.array(worst)
    at = maps.places(intervals[:-1], np.array(places))
    conditions = left(at, intervals[1:], maps.same * size)
    generic = box.mean(axis=1)[None, :].repeat(2, axis=0)
    return Update(number, box, maps.envelopes(), intervals, at, conditions, generic, forward_invariant, converged)


def with_generic(updates: Sequence[Update], maps: Sequence[AuxiliaryMaps]) -> list[Update]:
    """Updates with the generic iterates of those that are forward invariant, computed together.

    Every coordinate is iterated from the box's centre by the upper and the lower map alternately, until a two-cycle.
    """
    values = [[update.box.mean(axis=1)] for update in updates]
    size = np.array([np.ptp(update.box, axis=1) for update in updates])
    going = [k for k, update in enumerate(updates) if update.forward_invariant]
    for step in range(MOST_STEPS):
        if not going:
            break
        side = 1 - step % 2
        found = type(maps[0]).at([maps[k] for k in going], np.array([values[k][-1] for k in going]), side)
        for k, value in zip(going, found, strict=True):
            values[k].append(value)
        if step > 2 and side == 0:
            going = [k for k in going if not np.all(np.abs(values[k][-1] - values[k][-3]) <= maps[k].same * size[k])]
    return [
        replace(update, generic=np.array(value)) if update.forward_invariant else update
        for update, value in zip(updates, values, strict=True)
    ]


def is_inside(image: Floats, box: Floats, slack: float = 0.0) -> bool:
    """Whether an image lies in a box, both (n, 2), up to a share of the box's size; False if it contains NaN."""
    beyond = np.maximum(box[:, 0] - image[:, 0], image[:, 1] - box[:, 1])
    return bool((beyond <= slack * np.ptp(box, axis=1)).all())


def left(at: Floats, intervals: Floats, slack: Floats) -> Bools:
    """Eq. part1-v and -phi: whether the places of both extremes, shape (K, n, 2, 2), lie outside of the next intervals (K, n, 2).

    At rest the place is an end of the next interval, which counts as outside: it was outside at every step before.
    """
    low, high = intervals[:, :, None, 0], intervals[:, :, None, 1]
    return np.asarray(((at[..., 1] <= low + slack) | (at[..., 0] >= high - slack)).all(axis=2))


def _next(maps: AuxiliaryMaps, found: Extremes | None, intervals: Floats) -> Extremes:
    """The worst case over the next intervals: extremes that are still among them are not computed again."""
    if found is not None:
        kept = (found.at[..., 0] >= intervals[:, None, 0]) & (found.at[..., 1] <= intervals[:, None, 1])
        if kept.all():
            return found
    return maps.worst(intervals, found)


def _common(image: Floats, interval: Floats) -> Floats:
    """The intersection of the image with the interval: orbits stay in both if the box is forward invariant."""
    return np.stack([np.maximum(image[:, 0], interval[:, 0]), np.minimum(image[:, 1], interval[:, 1])], axis=1)
