"""Attracting domains by the worst-case and the generic iteration of the auxiliary maps, section 6.2, steps 1 to 3."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nsmaps.auxiliary.envelope import AnyMap, Envelope, envelopes, extremes, image_function, vertex_gain
from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Floats
from nsmaps.exact.system import ImpactSystem

Function = Callable[[Floats], Floats]
MOST_STEPS = 400  # of one update, as in the paper
SAME = 1e-10  # a change of an interval, relative to its size, that counts as none
TRIFLE = 1e-5  # of its side, by which a growing box exceeds its image
SLACK = 1e-5  # of a box's size: what the sampling of envelopes may be off by


@dataclass(frozen=True, slots=True, eq=False)
class Update:
    """One update of the auxiliary maps: their envelopes on a box, and both iterations of them."""

    number: int
    box: Floats  #: shape (n, 2), A^(N)
    envelopes: tuple[Envelope, ...]  #: one a coordinate
    worst: Floats  #: shape (K + 1, n, 2), intervals of eq. WCScobweb-v and -phi, the box first
    generic: Floats  #: shape (L, n), iterates of eq. auxv and auxphi, upper and lower map in turn
    trapped: bool  #: does one worst-case step carry the box into itself
    converged: bool  #: did the worst-case intervals come to rest


@dataclass(frozen=True, slots=True, eq=False)
class AttractingDomain:
    """A box into which the worst case of a map settles, with what is known of it: a bound for the map named in `of`."""

    of: str  #: the map that the bound is for, such as "fitted map R1" or "exact map"
    coordinates: tuple[str, ...]
    boxes: Floats  #: shape (U + 1, n, 2), the start box first, then one row an update made
    updates: tuple[Update, ...]
    trapped: bool  #: one worst-case step carries the box of every update into itself
    settled: bool  #: all updates were trapped and the last moved no bound by more than `settle` of the start box
    two_cycle: Floats  #: shape (n, 2), p and q of each coordinate: eq. pvqv_modified, pphiqphi_modified, WCSsecond-CD
    generic_agrees: bool  #: the generic iteration ends on the same p and q as the worst case
    status: str  #: how the envelopes were found: "sampled"
    reason: str  #: a sentence: what holds, or why not

    @property
    def box(self) -> Floats:
        """The last box, shape (n, 2)."""
        return self.boxes[-1]

    @property
    def sizes(self) -> Floats:
        """The sides of the boxes, shape (U + 1, n)."""
        return self.boxes[:, :, 1] - self.boxes[:, :, 0]


def attracting_domain(
    map: AnyMap,
    box: ArrayLike,
    updates: int = 11,
    *,
    grow: bool = False,
    samples: int = 201,
    settle: float = 0.01,
    of: str | None = None,
    progress: Callable[[int], None] | None = None,
) -> AttractingDomain:
    """Bound the attracting domain of a map from a start box R1+, eq. An and Bn.

    Each update finds the auxiliary maps on the box of the last one and iterates their worst case until it rests. It stops at the
    first update whose box is not carried into itself: beyond it the envelopes say nothing.

    Args:
        map: an exact system, a composite map or a PolyMap; the same code serves all.
        box: shape (n, 2), lower and upper end of each coordinate; angles in radians, on any turn.
        updates: most updates N made.
        grow: start from the smallest box around the given one that is carried into itself (`smallest_box`), if there is one.
        samples: points an axis of the grids on which envelopes are sampled.
        settle: largest move of a bound in the last update, relative to the start box, that counts as settled.
        of: what to call the map in the result.
        progress: called with the number of updates made, after each.

    Raises:
        NsmapsError: the box has not the map's coordinates, is empty, or a number is out of range.
    """
    start = np.array(getattr(box, "array", box), float)
    _check(map, start, updates, samples)
    found, why = smallest_box(map, start, samples) if grow else (start, "")
    start = start if found is None else found
    made: list[Update] = []
    boxes = [start]
    for number in range(1, updates + 1):
        made.append(_update(map, number, boxes[-1], samples))
        if not made[-1].trapped or found is None:
            break
        boxes.append(made[-1].worst[-1])
        if progress is not None:
            progress(number)
    trapped = found is not None and all(update.trapped for update in made)
    moved = float(np.max(np.abs(boxes[-1] - boxes[-2]) / np.ptp(start, axis=1)[:, None])) if len(boxes) > 1 else np.inf
    settled = trapped and len(boxes) == updates + 1 and moved <= settle
    return AttractingDomain(
        of or _name(map),
        map.coordinates,
        np.array(boxes),
        tuple(made),
        trapped,
        settled,
        boxes[-1] if trapped else np.full_like(start, np.nan),
        trapped and _agree(made[-1]),
        "sampled",
        why if found is None else _reason(map.coordinates, made, moved, settle),
    )


def _agree(update: Update) -> bool:
    """Does the generic iteration end on the bounds of the worst case."""
    cycle = np.sort(update.generic[-2:], axis=0).T
    return bool(np.all(np.abs(cycle - update.worst[-1]) <= 1e-6 * np.ptp(update.box, axis=1)[:, None]))


def smallest_box(map: AnyMap, box: ArrayLike, samples: int = 201, most: float = 4.0) -> tuple[Floats | None, str]:
    """The smallest box around a given one, shape (n, 2), that one worst-case step carries into itself; or None, and why.

    The box is joined with its image again and again, a trifle more each time. It is given up where a side exceeds `most` times
    the start's: such a box bounds nothing of use.
    """
    start = np.array(box, float)
    grown = start.copy()
    names = map.coordinates
    for step in range(MOST_STEPS):
        update = _update(map, 0, grown, samples, steps=1)
        image, size = update.worst[1], np.ptp(grown, axis=1)
        if not np.isfinite(image).all():
            return None, f"grown {step} times to {_text(names, grown)}, the box holds states without an image"
        below, above = image[:, 0] < grown[:, 0], image[:, 1] > grown[:, 1]
        if not (below | above).any():
            return grown, f"grown {step} times"
        grown[below, 0] = (image[:, 0] - TRIFLE * size)[below]
        grown[above, 1] = (image[:, 1] + TRIFLE * size)[above]
        if (np.ptp(grown, axis=1) > most * np.ptp(start, axis=1)).any():
            break
    return None, f"no useful box: {_text(names, start)} grows under its own image to {_text(names, grown)} and further"


def _name(map: AnyMap) -> str:
    return "exact map" if isinstance(map, ImpactSystem) else "fitted map"


def _check(map: AnyMap, box: Floats, updates: int, samples: int) -> None:
    n = len(map.coordinates)
    if box.shape != (n, 2) or not (box[:, 0] < box[:, 1]).all():
        raise NsmapsError(
            f"the box is {box.tolist()}; accepted: one row (low, high), low < high, for each of {', '.join(map.coordinates)}"
        )
    if updates < 1 or samples < 3:
        raise NsmapsError(f"updates is {updates} and samples is {samples}; at least 1 and 3 are accepted")


def _update(map: AnyMap, number: int, box: Floats, samples: int, steps: int = MOST_STEPS) -> Update:
    """One update: the envelopes on the box, at most `steps` worst-case intervals, the generic iterates of a trapped one."""
    function = image_function(map, box)
    curves = envelopes(map, box, samples)
    worst = [box]
    size = np.ptp(box, axis=1)[:, None]
    trapped = converged = False
    for step in range(steps):
        worst.append(np.array([_worst_step(function, e, k, worst[-1][k], box, samples) for k, e in enumerate(curves)]))
        if step == 0:
            below, above = box[:, 0] - worst[1][:, 0], worst[1][:, 1] - box[:, 1]
            trapped = bool((np.maximum(below, above) <= SLACK * size[:, 0]).all())
        if not trapped:
            break
        if np.all(np.abs(worst[-1] - worst[-2]) <= SAME * size):
            converged = True
            break
    generic = _generic(function, box, samples) if trapped and steps > 1 else box.mean(axis=1)[None, :].repeat(2, axis=0)
    return Update(number, box, curves, np.array(worst), generic, trapped, converged)


def _worst_step(function: Function, e: Envelope, index: int, interval: Floats, box: Floats, samples: int) -> tuple[float, float]:
    """One step of eq. WCScobweb: least lower and largest upper image over an interval of the coordinate.

    The interval's own ends are evaluated, what lies between them is read off the envelope.
    """
    lower, upper = extremes(function, index, interval, box, samples)
    between = (e.x > interval[0]) & (e.x < interval[1])
    return -_peak(-e.lower, between, -lower), _peak(e.upper, between, upper)


def _peak(curve: Floats, between: NDArray[np.bool_], ends: Floats) -> float:
    """The maximum of a sampled curve over the samples in `between`, its vertex refined, and over the values at the two ends."""
    best = float(ends.max())
    if between.any():
        k = int(np.argmax(np.where(between, curve, -np.inf)))
        inner = 0 < k < len(curve) - 1 and between[k - 1] and between[k + 1]
        gain = float(vertex_gain(curve[k - 1], curve[k], curve[k + 1])) if inner else 0.0
        best = max(best, float(curve[k]) + gain)
    return best if np.isfinite(curve).all() else np.nan


def _generic(function: Function, box: Floats, samples: int) -> Floats:
    """The generic iterates of every coordinate from the box's centre: upper and lower map in turn, until a two-cycle."""
    values = [box.mean(axis=1)]
    size = np.ptp(box, axis=1)
    for step in range(MOST_STEPS):
        side = 1 - step % 2
        values.append(np.array([extremes(function, k, [values[-1][k]], box, samples)[side][0] for k in range(len(box))]))
        if step > 2 and side == 0 and np.all(np.abs(values[-1] - values[-3]) <= SAME * size):
            break
    return np.array(values)


def _text(names: tuple[str, ...], box: Floats) -> str:
    return " x ".join(f"{name} in [{low:.4g}, {high:.4g}]" for name, (low, high) in zip(names, box, strict=True))


def _reason(names: tuple[str, ...], made: list[Update], moved: float, settle: float) -> str:
    last = made[-1]
    if last.trapped:
        rests = "" if all(update.converged for update in made) else "; not every worst-case iteration came to rest"
        verb = "settled" if moved <= settle else "still moving"
        return (
            f"every box is carried into itself; {verb}: update {last.number} moved a bound by {moved:.2g} of the start box{rests}"
        )
    image = last.worst[1]
    if not np.isfinite(image).all():
        return f"update {last.number}: some states of the box have no image"
    leaves = [
        f"{name} {'down' if k == 0 else 'up'} to {image[i, k]:.6g} (box {last.box[i, k]:.6g})"
        for i, name in enumerate(names)
        for k in (0, 1)
        if (image[i, 0] < last.box[i, 0] if k == 0 else image[i, 1] > last.box[i, 1])
    ]
    return f"one worst-case step leaves the box of update {last.number}: {', '.join(leaves)}"
