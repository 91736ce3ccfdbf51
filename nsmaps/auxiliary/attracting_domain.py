"""Attracting domains by the worst-case and the generic iteration of the auxiliary maps, section 6.2, steps 1 to 3."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, ClassVar

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.auxiliary.bounds import ESTIMATED, ErrorBound, How, Maker, auxiliary_maps
from nsmaps.auxiliary.envelope import AnyMap, AuxiliaryMaps
from nsmaps.auxiliary.reasons import about_fixed_point, without_image
from nsmaps.auxiliary.smallest_box import found_box
from nsmaps.auxiliary.worst_case import SLACK, Part, Update, update, with_generic
from nsmaps.auxiliary.worst_case_limits import ROUNDED, TwoCycle, two_cycles
from nsmaps.coordinates import BoxLike, Coordinates, WithCoordinates, as_box
from nsmaps.enclosures.box_images import name_of
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.progress import Progress, Work, beat, working
from nsmaps.results import Result, array, array_property, units_of

MOST = 4.0  # times the sides of the start box, to which it may grow
GENERIC = 1e-6  # of the last box, by which generic and worst-case iteration may differ
REST = 1e-10  # largest move of a bound in an update, relative to the start box, at which the updates end


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AttractingDomain(WithCoordinates, Result):
    """A box to which the worst case of a map converges; `claim` states on what basis, and for which map."""

    of: str  #: the map that the bound, or the estimate, is for, such as "fitted map R1" or "exact map"
    coordinates: Coordinates
    boxes: Floats = field(metadata=array("update coordinate end", "the start box first, then one row for each update"))
    updates: tuple[Update, ...]
    forward_invariant: bool  #: the box of every update is forward invariant: one worst-case step carries it into itself
    converged: bool  #: all updates were forward invariant, and the last moved no bound by more than `tolerance` of the start box
    two_cycle: Floats = field(
        metadata=array("coordinate end", "p and q of each coordinate: eq. pvqv_modified, pphiqphi_modified, WCSsecond-CD")
    )
    generic_agrees: bool  #: the generic iteration ends on the same p and q as the worst case
    status: str  #: how it bounds: "outer", "inflated by ... error", "enclosed", or "sampled"; see `claim`
    reason: str  #: a sentence: the result, or why there is none
    cycles: tuple[
        TwoCycle, ...
    ]  #: p and q of each coordinate as roots of the second iterate; empty if no box is forward invariant
    units: Mapping[str, str] = field(default_factory=dict)
    picture: ClassVar[str] = "nsmaps.figures.domains.boxes"

    def summary(self) -> str:
        """The numbers that matter."""
        sides = " x ".join(f"{side:.4g}" for side in self.sizes[-1])
        return f"{self.claim}; {len(self.updates)} updates, sides {sides}; {self.reason}"

    @property
    def box(self) -> Floats:
        """The last box, shape (n, 2)."""
        return self.boxes[-1]

    @property
    def claim(self) -> str:
        """Whether the boxes are enclosed, estimated or sampled, for the map named in `of`, and by which method."""
        if self.status in ("enclosed", "sampled"):
            return f"{self.status} for the {self.of}"
        return f"{'estimated' if self.status == ESTIMATED else 'enclosed'} for the {self.of}: {self.status}"

    @property
    def part(self) -> tuple[Part, ...]:
        """Which part of the Statement on bounds applies to the last update, by coordinate; see `Update.part`."""
        return self.updates[-1].part

    @array_property("update coordinate", "sides of the boxes")
    def sizes(self) -> Floats:
        """The sides of the boxes, shape (U + 1, n)."""
        return self.boxes[:, :, 1] - self.boxes[:, :, 0]


@checked
def attracting_domain(
    system: AnyMap,
    box: BoxLike,
    *,
    max_updates: int = 11,
    grow: bool = False,
    n_samples: int = 201,
    tolerance: float = 0.01,
    of: str | None = None,
    bounds_kind: How | None = None,
    error: ErrorBound | None = None,
    around: ArrayLike | None = None,
    max_seconds: float = inf,
    progress: Progress | None = None,
) -> AttractingDomain:
    """Bound the attracting domain of a map from a start box R1+, eq. An and Bn.

    Each update finds the auxiliary maps on the box of the last one and iterates their worst case until it
    converges. The iteration stops after `max_updates`, at the first that moves no bound by more than 1e-10 of the start box,
    or at the first whose box is not carried into itself, as nothing is known of the envelopes beyond that box.

    An update takes milliseconds for polynomials, and a second or more for exact and composite maps, which are enclosed; growing
    the box may take a hundred times as long. On a terminal a line shows the progress.

    Args:
        system: an exact system, a composite map or a PolyMap.
        box: a mapping of names to (low, high), a `Box`, or an array of shape (n, 2); angles in radians, on any turn.
        max_updates: largest number N of updates.
        grow: start from the smallest box around the given one that is carried into itself (`smallest_box`), if there is one.
        around: with `grow`, a state, shape (n,), about which the given box is halved up to six times where it cannot be grown.
        n_samples: points an axis of the grids on which envelopes are sampled; fewer in more than two coordinates.
        tolerance: largest move of a bound in the last update, relative to the start box, that counts as converged.
        of: name of the map in the result.
        bounds_kind: `outer`, `inflated`, `enclosed` or `sampled`; the sharpest of the map if omitted, see `auxiliary_maps`.
        max_seconds: after this time no step of growing and no update is begun; finished updates are kept, and `reason` states it.
        error: distance of a PolyMap from the map that it approximates, for which the result then is a bound, or an estimate.
        progress: called after each update with the fraction of `max_updates` that is done, and with 1 at the end.

    Raises:
        NsmapsError: the box is empty or has other coordinates, a number is out of range, or the map has no such bounds.
    """
    start = as_box(box, system.coordinates)
    _check(max_updates, n_samples)
    if grow and error is not None:
        raise NsmapsError("grow is on and an error is given, which is valid on the given box only; expected: one of the two")
    make = auxiliary_maps(system, bounds_kind, error, n_samples)
    with working("attracting domain", progress, max_seconds) as work:
        found, why = found_box(make, system, start, around, MOST, work) if grow else (start, "")
        start = start if found is None else found
        done, boxes, maps = _updates(make, start, max_updates if found is not None else 0, work)
    invariant, moved = found is not None and all(each.forward_invariant for each in done), _moved(boxes)
    reason = why if found is None else _reason(system, done, moved, tolerance, maps.status)
    stopped = f"; stopped after {max_seconds:g} s, with update {len(done)} of {max_updates}"
    reason += stopped if invariant and len(done) < max_updates and moved > REST else ""
    return AttractingDomain(
        of=of or (error.of if error is not None else name_of(system)),
        coordinates=Coordinates(system.coordinates),
        boxes=np.array(boxes),
        updates=tuple(done),
        forward_invariant=invariant,
        converged=invariant and moved <= (tolerance if len(done) == max_updates else REST),
        status=maps.status,
        reason=reason if invariant else _why_not(system, reason, start, error),
        units=units_of(system),
        **_limits(done[-1], maps, _accuracy(maps, start, done[-1]), invariant),
    )


def _limits(last: Update, maps: AuxiliaryMaps, accuracy: Floats, invariant: bool) -> dict[str, Any]:
    """The fields of a domain on the limits of the last update: NaN and empty unless the box is forward invariant."""
    return {
        "two_cycle": last.worst[-1] if invariant else np.full_like(last.box, np.nan),
        "generic_agrees": invariant and _agree(last, accuracy),
        "cycles": two_cycles(maps, last, accuracy) if invariant else (),
    }


def _updates(make: Maker, start: Floats, max_updates: int, work: Work) -> tuple[list[Update], list[Floats], AuxiliaryMaps]:
    """The updates, the start box and theirs, and the last auxiliary maps; for `max_updates` 0 one update and no new box."""
    done, maps = list[Update](), list[AuxiliaryMaps]()
    boxes = [start]
    for number in range(1, max(max_updates, 1) + 1):
        maps.append(make(boxes[-1]))
        done.append(update(maps[-1], number, boxes[-1]))
        if not done[-1].forward_invariant or not max_updates:
            break
        boxes.append(done[-1].worst[-1])
        beat(number / max_updates, f"update {number} of {max_updates}")
        if _moved(boxes) <= REST or work.over:
            break
    return with_generic(done, maps), boxes, maps[-1]


def smallest_box(
    return_map: AnyMap,
    box: BoxLike,
    samples: int = 201,
    max_growth: float = MOST,
    bounds_kind: How | None = None,
    around: ArrayLike | None = None,
    max_seconds: float = inf,
) -> tuple[Floats | None, str]:
    """The smallest box around a given one, shape (n, 2), that one worst-case step carries into itself; or None, and why.

    The box is joined with its image repeatedly, and enlarged slightly each time. The iteration stops without a box where a side
    exceeds `max_growth` times the start's. `bounds_kind`, `around` and `max_seconds` as in `attracting_domain`.
    """
    centre = None if around is None else np.asarray(around, float)
    with working("smallest box", None, max_seconds) as work:
        return found_box(
            auxiliary_maps(return_map, bounds_kind, None, samples),
            return_map,
            as_box(box, return_map.coordinates),
            centre,
            max_growth,
            work,
        )


def _moved(boxes: list[Floats]) -> float:
    """The largest move of a bound in the last update, relative to the start box."""
    if len(boxes) < 2:
        return np.inf
    return float(np.max(np.abs(boxes[-1] - boxes[-2]) / np.ptp(boxes[0], axis=1)[:, None]))


def _accuracy(maps: AuxiliaryMaps, start: Floats, last: Update) -> Floats:
    """The accuracy to which the auxiliary maps of an update are known, shape (n,): rounding, relative to the start box.

    For an enclosure its tolerance is added twice, as its iteration stops within that tolerance, and the error of samples.
    """
    rounded = ROUNDED * np.ptp(start, axis=1)
    return rounded + (2 * maps.same + SLACK) * np.ptp(last.box, axis=1) if maps.status == "enclosed" else rounded


def _agree(last: Update, accuracy: Floats) -> bool:
    """Whether the generic iteration ends on the bounds of the worst case."""
    cycle = np.sort(last.generic[-2:], axis=0).T
    return bool(np.all(np.abs(cycle - last.worst[-1]) <= (GENERIC * np.ptp(last.box, axis=1) + accuracy)[:, None]))


def _check(max_updates: int, n_samples: int) -> None:
    if max_updates < 1 or n_samples < 3:
        raise NsmapsError(f"max_updates is {max_updates} and n_samples is {n_samples}; expected: at least 1 and at least 3")


def _distinct(value: float, limit: float) -> str:
    """A number with as many digits, two at least, as distinguish it from a limit."""
    texts = (f"{value:.{digits}g}" for digits in range(2, 18))
    return next((text for text in texts if float(text) != limit), f"{value:.17g}")


def _why_not(return_map: AnyMap, reason: str, start: Floats, error: ErrorBound | None) -> str:
    """The reason why a box is not forward invariant, with the criterion of the map's own derivative in the start box."""
    return "; ".join(filter(None, (reason, about_fixed_point(return_map, start) if error is None else "")))


def _reason(return_map: AnyMap, done: list[Update], moved: float, tolerance: float, status: str) -> str:
    last, names = done[-1], return_map.coordinates
    if last.forward_invariant:
        rests = "" if all(update.converged for update in done) else "; not every worst-case iteration converged"
        beside = f"{_distinct(100 * moved, 100 * tolerance)} % of the start box"
        verb, more = (
            ("converged", "")
            if moved <= tolerance
            else ("not yet converged", f", more than {100 * tolerance:g} %; raise `max_updates`")
        )
        return f"every box is carried into itself; {verb}: update {last.number} moved a bound by {beside}{more}{rests}"
    image = last.worst[1]
    if not np.isfinite(image).all():
        return f"update {last.number}: {without_image(return_map, last.box, status)}"
    leaves = [
        f"{name} {'down' if k == 0 else 'up'} to {image[i, k]:.6g} (box {last.box[i, k]:.6g})"
        for i, name in enumerate(names)
        for k in (0, 1)
        if (image[i, 0] < last.box[i, 0] if k == 0 else image[i, 1] > last.box[i, 1])
    ]
    return f"one worst-case step leaves the box of update {last.number}: {', '.join(leaves)}"
