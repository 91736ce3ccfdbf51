"""Attracting domains by the worst-case and the generic iteration of the auxiliary maps, section 6.2, steps 1 to 3."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import ArrayLike, brief
from nsmaps.auxiliary.bounds import ESTIMATED, ErrorBound, How, Maker, auxiliary_maps
from nsmaps.auxiliary.envelope import AnyMap, AuxiliaryMaps
from nsmaps.auxiliary.fittedboxes import name_of
from nsmaps.auxiliary.reasons import about_fixed_point, without_image
from nsmaps.auxiliary.startbox import found_box
from nsmaps.auxiliary.twocycle import ROUNDED, TwoCycle, two_cycles
from nsmaps.auxiliary.update import SLACK, Part, Update, update, with_generic
from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Floats
from nsmaps.progress import Work, beat, working

if TYPE_CHECKING:
    from xarray import Dataset

MOST = 4.0  # times the sides of the start box, to which it may grow
GENERIC = 1e-6  # of the last box, by which generic and worst-case iteration may differ
REST = 1e-10  # largest move of a bound in an update, relative to the start box, after which there are no more


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AttractingDomain:
    """A box into which the worst case of a map settles, with what is known of it; `claim` says what that is worth."""

    __repr__ = brief

    of: str  #: the map that the bound, or the estimate, is for, such as "fitted map R1" or "exact map"
    coordinates: tuple[str, ...]
    boxes: Floats  #: shape (U + 1, n, 2), the start box first, then one row an update made
    updates: tuple[Update, ...]
    trapped: bool  #: one worst-case step carries the box of every update into itself
    settled: bool  #: all updates were trapped, and the last one moved no bound by more than `settle` of the start box
    two_cycle: Floats  #: shape (n, 2), p and q of each coordinate: eq. pvqv_modified, pphiqphi_modified, WCSsecond-CD
    generic_agrees: bool  #: the generic iteration ends on the same p and q as the worst case
    status: str  #: how it bounds: "outer", "inflated by ... error", "enclosed", or "sampled"; see `claim`
    reason: str  #: a sentence: what holds, or why not
    cycles: tuple[TwoCycle, ...]  #: p and q of each coordinate as roots of the second-iterate map; none if not trapped

    @property
    def box(self) -> Floats:
        """The last box, shape (n, 2)."""
        return self.boxes[-1]

    @property
    def claim(self) -> str:
        """What the boxes are for the map named in `of`, and how that is known: a bound, an estimate, or no bound."""
        if self.status == "sampled":
            return f"no bound for the {self.of}: sampled"
        return f"{'an estimate' if self.status == ESTIMATED else 'a bound'} for the {self.of}: {self.status}"

    @property
    def part(self) -> tuple[Part, ...]:
        """Which part of the Statement on bounds applies to the last update, by coordinate; see `Update.part`."""
        return self.updates[-1].part

    @property
    def sizes(self) -> Floats:
        """The sides of the boxes, shape (U + 1, n)."""
        return self.boxes[:, :, 1] - self.boxes[:, :, 0]

    def to_xarray(self) -> "Dataset":
        """The boxes and the auxiliary maps of every update as an xarray dataset. NsmapsError without xarray.

        Dimensions `update` (0 is the start box), `made` (the updates, by number), `coordinate`, `end`, `sample`.
        """
        from nsmaps.exact.data import EACH, dataset

        rows = {
            "box": ("update coordinate end", self.boxes, EACH, "the box after each update"),
            "two_cycle": ("coordinate end", self.two_cycle, EACH, "p and q of each coordinate; NaN if not trapped"),
        }
        texts = {"x": "where the auxiliary maps are", "lower": "the lower auxiliary map", "upper": "the upper auxiliary map"}
        for name, text in texts.items():
            drawn = np.array([[getattr(envelope, name) for envelope in update.envelopes] for update in self.updates])
            rows[name] = ("made coordinate sample", drawn, EACH, text)
        along = {"update": np.arange(len(self.boxes)), "made": [update.number for update in self.updates], "end": ["low", "high"]}
        about = {"of": self.of, "trapped": self.trapped, "settled": self.settled, "status": self.status, "reason": self.reason}
        return dataset(self.coordinates, rows, along, **about)


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
    bounds: How | None = None,
    error: ErrorBound | None = None,
    around: ArrayLike | None = None,
    max_seconds: float = inf,
) -> AttractingDomain:
    """Bound the attracting domain of a map from a start box R1+, eq. An and Bn.

    Each update finds the auxiliary maps on the box of the last one and iterates their worst case until it rests. It stops after
    `updates`, or at the first that moves no bound by more than 1e-10 of the start box, or at the first whose box is not carried
    into itself: beyond it the envelopes say nothing.

    An update takes milliseconds for polynomials, a second or more where it is enclosed, as of exact and composite maps; growing
    may take a hundred times as long. On a terminal a line shows how far it is.

    Args:
        map: an exact system, a composite map or a PolyMap; the same code serves all.
        box: shape (n, 2), lower and upper end of each coordinate; angles in radians, on any turn.
        updates: most updates N made.
        grow: start from the smallest box around the given one that is carried into itself (`smallest_box`), if there is one.
        around: with `grow`, a state, shape (n,), about which the given box is halved up to six times where it cannot be grown.
        samples: points an axis of the grids on which envelopes are sampled.
        settle: largest move of a bound in the last update, relative to the start box, that counts as settled.
        of: what to call the map in the result.
        progress: called with the number of updates made, after each.
        bounds: `outer`, `inflated`, `enclosed` or `sampled`; the best that the map allows if omitted, see `auxiliary_maps`.
        max_seconds: after so many seconds no step of growing and no update is begun; what was finished is kept, `reason` says so.
        error: how far a PolyMap is from the map that it stands for: the bound is then for that map, an estimate if the error is.

    Raises:
        NsmapsError: the box has not the map's coordinates, is empty, or a number is out of range; the map cannot be bounded so.
    """
    start = np.array(getattr(box, "array", box), float)
    _check(map, start, updates, samples)
    if grow and error is not None:
        raise NsmapsError("grow is on and an error is given, which is that of the given box; accepted: one of the two")
    make = auxiliary_maps(map, bounds, error, samples)
    centre = None if around is None else np.asarray(around, float)
    with working("attracting domain", progress, max_seconds) as work:
        found, why = found_box(make, map, start, centre, MOST, work) if grow else (start, "")
        start = start if found is None else found
        made, boxes, maps = _updates(make, start, updates if found is not None else 0, progress, work)
    trapped, moved = found is not None and all(each.trapped for each in made), _moved(boxes)
    reason = why if found is None else _reason(map, made, moved, settle, maps.status)
    if trapped and len(made) < updates and moved > REST:
        reason += f"; stopped after {max_seconds:g} s, with update {len(made)} of {updates}"
    accuracy = _accuracy(maps, start, made[-1])
    return AttractingDomain(
        of or (error.of if error is not None else name_of(map)),
        map.coordinates,
        np.array(boxes),
        tuple(made),
        trapped,
        trapped and moved <= (settle if len(made) == updates else REST),
        boxes[-1] if trapped else np.full_like(start, np.nan),
        trapped and _agree(made[-1], accuracy),
        maps.status,
        reason if trapped else _why_not(map, reason, start, error),
        two_cycles(_drawn(map, maps, made[-1].box, samples), made[-1], accuracy) if trapped else (),
    )


def _updates(
    make: Maker, start: Floats, most: int, progress: Callable[[int], None] | None, work: Work
) -> tuple[list[Update], list[Floats], AuxiliaryMaps]:
    """The updates made, the start box with theirs, and the last auxiliary maps; with `most` 0 one update and the start alone."""
    made, maps = list[Update](), list[AuxiliaryMaps]()
    boxes = [start]
    for number in range(1, max(most, 1) + 1):
        maps.append(make(boxes[-1]))
        made.append(update(maps[-1], number, boxes[-1]))
        if not made[-1].trapped or not most:
            break
        boxes.append(made[-1].worst[-1])
        beat(number / most, f"update {number} of {most}")
        if progress is not None:
            progress(number)
        if _moved(boxes) <= REST or work.over:
            break
    return with_generic(made, maps), boxes, maps[-1]


def smallest_box(
    map: AnyMap,
    box: ArrayLike,
    samples: int = 201,
    most: float = MOST,
    bounds: How | None = None,
    around: ArrayLike | None = None,
    max_seconds: float = inf,
) -> tuple[Floats | None, str]:
    """The smallest box around a given one, shape (n, 2), that one worst-case step carries into itself; or None, and why.

    The box is joined with its image again and again, a trifle more each time. It is given up where a side exceeds `most` times
    the start's: such a box bounds nothing of use. `bounds`, `around` and `max_seconds` as in `attracting_domain`.
    """
    centre = None if around is None else np.asarray(around, float)
    with working("smallest box", None, max_seconds) as work:
        return found_box(auxiliary_maps(map, bounds, None, samples), map, np.array(box, float), centre, most, work)


def _moved(boxes: list[Floats]) -> float:
    """The largest move of a bound in the last update, relative to the start box."""
    if len(boxes) < 2:
        return np.inf
    return float(np.max(np.abs(boxes[-1] - boxes[-2]) / np.ptp(boxes[0], axis=1)[:, None]))


def _drawn(map: AnyMap, maps: AuxiliaryMaps, box: Floats, samples: int) -> AuxiliaryMaps:
    """The auxiliary maps whose curves are smooth enough for roots: of an enclosure, those of samples."""
    return auxiliary_maps(map, "sampled", None, samples)(box) if maps.status == "enclosed" else maps


def _accuracy(maps: AuxiliaryMaps, start: Floats, last: Update) -> Floats:
    """To which the auxiliary maps of an update are known, shape (n,): to rounding, a share of the start box.

    Of an enclosure what it leaves open is added, twice, as its iteration rests by as much, and what samples may be off by.
    """
    rounded = ROUNDED * np.ptp(start, axis=1)
    return rounded + (2 * maps.same + SLACK) * np.ptp(last.box, axis=1) if maps.status == "enclosed" else rounded


def _agree(last: Update, accuracy: Floats) -> bool:
    """Does the generic iteration end on the bounds of the worst case."""
    cycle = np.sort(last.generic[-2:], axis=0).T
    return bool(np.all(np.abs(cycle - last.worst[-1]) <= (GENERIC * np.ptp(last.box, axis=1) + accuracy)[:, None]))


def _check(map: AnyMap, box: Floats, updates: int, samples: int) -> None:
    n = len(map.coordinates)
    if box.shape != (n, 2) or not (box[:, 0] < box[:, 1]).all():
        raise NsmapsError(
            f"the box is {box.tolist()}; accepted: one row (low, high), low < high, for each of {', '.join(map.coordinates)}"
        )
    if updates < 1 or samples < 3:
        raise NsmapsError(f"updates is {updates} and samples is {samples}; at least 1 and 3 are accepted")


def _apart(value: float, limit: float) -> str:
    """A number with as many digits, two at least, as tell it from a limit."""
    told = (f"{value:.{digits}g}" for digits in range(2, 18))
    return next((text for text in told if float(text) != limit), f"{value:.17g}")


def _why_not(map: AnyMap, reason: str, start: Floats, error: ErrorBound | None) -> str:
    """The reason why a box is not trapped, with what the map's own derivative in the start box says of it."""
    return "; ".join(filter(None, (reason, about_fixed_point(map, start) if error is None else "")))


def _reason(map: AnyMap, made: list[Update], moved: float, settle: float, status: str) -> str:
    last, names = made[-1], map.coordinates
    if last.trapped:
        rests = "" if all(update.converged for update in made) else "; not every worst-case iteration came to rest"
        beside = f"{_apart(100 * moved, 100 * settle)} % of the start box"
        verb, more = ("settled", "") if moved <= settle else ("still moving", f", more than {100 * settle:g} %; raise `updates`")
        return f"every box is carried into itself; {verb}: update {last.number} moved a bound by {beside}{more}{rests}"
    image = last.worst[1]
    if not np.isfinite(image).all():
        return f"update {last.number}: {without_image(map, last.box, status)}"
    leaves = [
        f"{name} {'down' if k == 0 else 'up'} to {image[i, k]:.6g} (box {last.box[i, k]:.6g})"
        for i, name in enumerate(names)
        for k in (0, 1)
        if (image[i, 0] < last.box[i, 0] if k == 0 else image[i, 1] > last.box[i, 1])
    ]
    return f"one worst-case step leaves the box of update {last.number}: {', '.join(leaves)}"
