"""Grazing curves: the states whose first return touches a wall with speed zero, followed as curves.

Start points come from a scan of itineraries, the curves from `equations.py`.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, brief
from nsmaps.continuation.bisection import bisect_changes
from nsmaps.coordinates import TWO_PI, BoxLike, Coordinates, WithCoordinates, as_box, nearest_turn
from nsmaps.errors import StateError
from nsmaps.exact.engine.itinerary import itinerary as itinerary_of
from nsmaps.exact.grazing.equations import NEAR, Frame, Touch
from nsmaps.exact.kernel import Kernel, closed_form_of
from nsmaps.exact.systems.walls import ImpactFormulas
from nsmaps.exact.words import HIGHEST, LOWEST

BESIDE = 1e-11  # distance from a curve at which its two sides are examined, as a share of the highest speed and in radians
HALVINGS = 36  # as a share of the distance of two neighbours of the scan
CHANGES = 8  # changes of itinerary that are sought between two neighbours of the scan


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GrazingCurve(WithCoordinates):
    """States whose first return touches a wall with speed zero; M points along the curve, exact to rounding."""

    __repr__ = brief

    coordinates: Coordinates
    wall: str  #: the wall touched
    word: str  #: the impacts up to the touch, the start on the base wall included: `B`, `BT`
    points: Floats  #: shape (M, 2), states (v, phi); phi is continued along the curve, not wrapped
    touch: Floats  #: shape (M,), time from the last impact of `word` to the touch
    length: Floats  #: shape (M,), arc length from the first point, the sum of chords, speeds as shares of the box's highest
    closed: bool  #: True if the last point equals the first, modulo whole turns
    ends: tuple[str, str]  #: why the curve ends at its first and its last point, see `ImpactSystem.grazing_curves`
    hit: NDArray[np.str_]  #: shape (M,), itinerary where the wall is hit, 1e-11 radians or of the highest speed beside the point
    missed: NDArray[np.str_]  #: shape (M,), itinerary where the wall is missed, on the other side
    jump: Floats  #: shape (M,), distance of the images on both sides, in shares of the box's highest speed and radians
    jumps: bool  #: True if `jump` is that of a jump, and not of a square root, at most points

    @property
    def words(self) -> tuple[tuple[str, str], ...]:
        """The pairs of words (hit, missed) on both sides, in their order along the curve.

        Pairs at the ends or at less than a hundredth of the points are omitted: where curves meet, a side may be too narrow to
        resolve.
        """
        pairs = [(_word(hit), _word(missed)) for hit, missed in zip(self.hit, self.missed, strict=True)]
        inner = Counter(pairs[1:-1] or pairs)
        return tuple(pair for pair, number in inner.items() if 100 * number > len(pairs))


def _word(itinerary: str) -> str:
    return itinerary.replace(HIGHEST, "").replace(LOWEST, "")


def grazing_curves(system: ImpactFormulas, box: BoxLike, lines: int = 400, spacing: float = 0.005) -> tuple[GrazingCurve, ...]:
    """The grazing curves in a box, as described in `ImpactSystem.grazing_curves`."""
    frame, kernel = _frame(system, box)
    if not (lines >= 2 and spacing > 0):
        raise StateError(f"lines is {lines} and spacing {spacing}; expected: at least two lines and a positive spacing")
    curves = []
    for (hits, upper), seeds in _seeds(kernel, frame, lines).items():
        kind = Touch(frame, hits, upper)
        while len(seeds):
            traced = kind.curve(seeds[0], spacing)
            seeds = seeds[1:]
            if traced is not None:
                curves.append(_described(system, kind, *traced))
                seeds = seeds[~_on(frame, traced[0], seeds)]
    return tuple(curves)


def _frame(system: ImpactFormulas, box: BoxLike) -> tuple[Frame, Kernel]:
    """The box, checked, and the kernel of the system."""
    low, high = as_box(box, system.coordinates, whole_turn=True).T
    if not low[0] >= 0:
        raise StateError(f"the speeds are from {low[0]:g} to {high[0]:g}; expected: none below zero")
    kernel = closed_form_of(system, "grazing curves")
    return Frame(kernel.flow, kernel.base_up, low, high, np.append(high - low, TWO_PI / system.phase_rate())), kernel


def _seeds(kernel: Kernel, frame: Frame, lines: int) -> dict[tuple[int, bool], Floats]:
    """Places next to grazing curves, by the kind of touch (impacts before it, upper wall), from a scan of the box."""
    found: dict[tuple[int, bool], list[Floats]] = {}
    for ends in _changes(kernel, frame, lines):
        seen = [itinerary_of(frame.p, *state, 0.0)[1] for state in ends]
        one, state = min(zip(seen, ends, strict=True), key=lambda pair: pair[0].gap)
        if one.gap_time > 0:
            place = np.array([*state, one.gap_time]) / frame.scale
            point = Touch(frame, one.gap_flight, one.gap_up).evaluate(place)
            if point is not None and one.gap < NEAR * np.linalg.norm(point.jacobian[0]):
                found.setdefault((one.gap_flight, one.gap_up), []).append(place)
    return {kind: np.array(places) for kind, places in found.items()}


def _changes(kernel: Kernel, frame: Frame, lines: int) -> Floats:
    """Pairs of states on either side of a change of itinerary, along both directions of a scan, shape (K, 2, 2)."""
    low, high = np.maximum(frame.low, [1e-9 * frame.high[0], -np.inf]), frame.high
    mesh = np.stack(np.meshgrid(*np.linspace(low, high, lines).T, indexing="ij"), axis=-1)
    codes = _codes(kernel, mesh)
    pairs: list[tuple[Any, Any]] = [(np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])]  # neighbours in v, in phi
    differ = [codes[one] != codes[other] for one, other in pairs]
    (a, before), (b, beyond) = (
        [np.concatenate([of[pair[k]][change] for pair, change in zip(pairs, differ, strict=True)]) for of in (mesh, codes)]
        for k in (0, 1)
    )
    _, *sides = bisect_changes(lambda states: _codes(kernel, states), a, b, before, beyond, CHANGES, HALVINGS)
    return np.stack(sides, axis=1)


def _codes(kernel: Kernel, states: Floats) -> NDArray[np.int64]:
    """The itineraries of states (..., 2), as numbers; every impact on the base wall is a return."""
    return kernel.itineraries(np.ascontiguousarray(states.reshape(-1, 2)), 0.0).codes.reshape(states.shape[:-1])


def _on(frame: Frame, curve: Floats, places: Floats) -> NDArray[np.bool_]:
    """A mask of the places (K, 3) that lie on a curve of places (M, 3), within the error of its chords."""
    step = np.diff(curve, axis=0)
    length = np.linalg.norm(step, axis=1)
    on = np.zeros(len(places), bool)
    for k, place in enumerate(places):
        back = frame.difference_of(place - curve[:-1])
        share = np.clip(np.einsum("ij,ij->i", back, step) / length**2, 0, 1)
        on[k] = (np.linalg.norm(back - share[:, None] * step, axis=1) < 0.02 * length + NEAR).any()
    return on


def _described(system: ImpactFormulas, kind: Touch, places: Floats, ends: tuple[str, str]) -> GrazingCurve:
    """A curve with the itineraries and images on both of its sides."""
    frame, names = kind.frame, system.letters
    points = places[:, :2] * frame.scale[:2]
    if frame.circle:
        points[:, 1] -= TWO_PI * np.floor((points[0, 1] - frame.low[1]) / TWO_PI)
    unit = np.array([frame.high[0], 1.0])
    known = [point for place in places if (point := kind.evaluate(place)) is not None]
    across = np.array([point.jacobian[0, :2] for point in known]) / frame.scale[:2] * unit
    across *= unit / np.linalg.norm(across, axis=1)[:, None]

    def beside(distance: float) -> tuple[Floats, Floats]:
        least = np.minimum(distance, 0.1 * points[:, :1] / unit[0])
        return points - least * across, points + least * across

    def jump(distance: float) -> Floats:
        hit, missed = (system.first_return(side).image for side in beside(distance))
        missed[:, 1] = nearest_turn(missed[:, 1], hit[:, 1])
        return np.linalg.norm((hit - missed) / unit, axis=1)

    hit, missed = (system.itineraries(side).words for side in beside(BESIDE))
    near = jump(BESIDE)
    base = frame.base_up
    return GrazingCurve(
        coordinates=system.coordinates,
        wall=names[0] if kind.upper == base else names[1],
        word=names[0] + names[-1] * kind.hits,
        points=points,
        touch=places[:, 2] * frame.scale[2],
        length=np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0) / unit, axis=1))),
        closed=ends[0] == "closed",
        ends=ends,
        hit=hit,
        missed=missed,
        jump=near,
        jumps=bool(np.mean(near > 0.3 * jump(1e4 * BESIDE)) > 0.5),
    )
