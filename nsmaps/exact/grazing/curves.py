"""Grazing curves: the states whose first return touches a wall with speed zero, followed as curves.

Start points come from a scan of itineraries, the curves from `equations.py`.
"""

from collections import Counter
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, brief
from nsmaps.continuation.bisection import bisect_changes
from nsmaps.coordinates import TWO_PI, BoxLike, Coordinates, WithCoordinates, as_box, nearest_turn
from nsmaps.errors import StateError
from nsmaps.exact.engine.itinerary import itinerary
from nsmaps.exact.engine.kernel import SpectralKernel
from nsmaps.exact.grazing.equations import NEAR_CURVE, PHASE, SPEED, TIME, Frame, Touch
from nsmaps.exact.systems.walls import ImpactFormulas
from nsmaps.exact.words import HIGHEST, LOWEST

NO_TURNS = str.maketrans("", "", HIGHEST + LOWEST)  # removes turning points from itineraries
BESIDE = 1e-11  # distance from a curve at which its two sides are examined, as a share of the highest speed and in radians
HALVINGS = 36  # as a share of the distance of two neighbours of the scan
SLOWEST = 1e-9  # speed of the scan, as a share of the highest
BESIDE_REST = 0.1  # of the speed of a point, by which the sides of a curve are apart at most
CHORD = 0.02  # of the distance of two points of a curve, by which it may bend away from their chord
STEPPED, FARTHER = 0.3, 1e4  # an image jumps if it does not shrink to this share where its sides are as much nearer
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
        pairs = [(hit.translate(NO_TURNS), missed.translate(NO_TURNS)) for hit, missed in zip(self.hit, self.missed, strict=True)]
        inner = Counter(pairs[1:-1] or pairs)
        return tuple(pair for pair, number in inner.items() if 100 * number > len(pairs))


def grazing_curves(system: ImpactFormulas, box: BoxLike, n_lines: int, spacing: float) -> tuple[GrazingCurve, ...]:
    """The grazing curves in a box, as described in `ImpactSystem.grazing_curves`."""
    low, high = as_box(box, system.coordinates, whole_turn=True).T
    if not low[SPEED] >= 0:
        raise StateError(f"the speeds are from {low[SPEED]:g} to {high[SPEED]:g}; expected: none below zero")
    kernel: SpectralKernel = system._kernel().closed_form("grazing curves")
    frame = Frame(kernel.flow, kernel.base_up, low, high, np.append(high - low, TWO_PI / system.phase_rate()))
    if not (n_lines >= 2 and spacing > 0):
        raise StateError(f"n_lines is {n_lines} and spacing {spacing}; expected: at least two lines and a positive spacing")
    curves = []
    for (hits, upper), seeds in _seeds(kernel, frame, n_lines).items():
        kind = Touch(frame, hits, upper)
        while len(seeds):
            seed, seeds = next(iter(seeds)), seeds[1:]
            if (traced := kind.curve(seed, spacing)) is not None:
                places, ends = traced
                curves.append(_curve(system, kind, places, ends))
                seeds = seeds[~_on(frame, places, seeds)]
    return tuple(curves)


def _seeds(kernel: SpectralKernel, frame: Frame, lines: int) -> dict[tuple[int, bool], Floats]:
    """Places next to grazing curves, by the kind of touch (impacts before it, upper wall), from a scan of the box."""
    found: dict[tuple[int, bool], list[Floats]] = {}
    for one, other in _changes(kernel, frame, lines):
        (_, nearer), (_, farther) = itinerary(frame.p, *one, 0.0), itinerary(frame.p, *other, 0.0)
        state = one if nearer.gap <= farther.gap else other
        seen = min(nearer, farther, key=attrgetter("gap"))
        if seen.gap_time > 0:
            place = np.array([*state, seen.gap_time]) / frame.scale
            point = Touch(frame, seen.gap_flight, seen.gap_up).evaluate(place)
            if point is not None and point.near:
                found.setdefault((seen.gap_flight, seen.gap_up), []).append(place)
    return {kind: np.array(places) for kind, places in found.items()}


def _changes(kernel: SpectralKernel, frame: Frame, lines: int) -> Floats:
    """Pairs of states on either side of a change of itinerary, along both directions of a scan, shape (K, 2, 2)."""
    low, high = np.maximum(frame.low, [SLOWEST * frame.high[SPEED], -np.inf]), frame.high
    mesh = np.stack(np.meshgrid(*np.linspace(low, high, lines).T, indexing="ij"), axis=-1)
    codes = _codes(kernel, mesh)
    pairs: list[tuple[Any, Any]] = [(np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])]  # neighbours in v, in phi
    ends = [
        [values[side][codes[one] != codes[other]] for values in (mesh, codes) for side in (one, other)] for one, other in pairs
    ]
    low, high, before, beyond = map(np.concatenate, zip(*ends, strict=True))
    _, *sides = bisect_changes(lambda states: _codes(kernel, states), low, high, before, beyond, CHANGES, HALVINGS)
    return np.stack(sides, axis=1)


def _codes(kernel: SpectralKernel, states: Floats) -> NDArray[np.int64]:
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
        on[k] = (np.linalg.norm(back - share[:, None] * step, axis=1) < CHORD * length + NEAR_CURVE).any()
    return on


def _curve(system: ImpactFormulas, kind: Touch, places: Floats, ends: tuple[str, str]) -> GrazingCurve:
    """A curve with the itineraries and images on both of its sides."""
    frame, (base_letter, *others) = kind.frame, system.letters
    *_, other_letter = base_letter, *others
    points = places[:, :TIME] * frame.scale[:TIME]
    speeds, phases = points.T
    if frame.circle:
        phases -= TWO_PI * np.floor((next(iter(phases)) - frame.low[PHASE]) / TWO_PI)
    unit = np.array([frame.high[SPEED], 1.0])
    known = [point for place in places if (point := kind.evaluate(place)) is not None]
    across = np.array([point.by_gap[:TIME] for point in known]) / frame.scale[:TIME] * unit
    across *= unit / np.linalg.norm(across, axis=1)[:, None]

    def beside(distance: float) -> tuple[Floats, Floats]:
        least = np.minimum(distance, BESIDE_REST * speeds / frame.high[SPEED])[:, None]
        return points - least * across, points + least * across

    def jump(distance: float) -> Floats:
        hit, missed = (system.first_return(side).image for side in beside(distance))
        missed[:, PHASE] = nearest_turn(missed[:, PHASE], hit[:, PHASE])
        return np.linalg.norm((hit - missed) / unit, axis=1)

    hit, missed = (system.itineraries(side).words for side in beside(BESIDE))
    near = jump(BESIDE)
    first, _ = ends
    return GrazingCurve(
        coordinates=system.coordinates,
        wall=base_letter if kind.upper == frame.base_up else other_letter,
        word=base_letter + other_letter * kind.hits,
        points=points,
        touch=places[:, TIME] * frame.scale[TIME],
        length=np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0) / unit, axis=1))),
        closed=first == "closed",
        ends=ends,
        hit=hit,
        missed=missed,
        jump=near,
        jumps=bool(np.mean(near > STEPPED * jump(FARTHER * BESIDE)) > 0.5),
    )
