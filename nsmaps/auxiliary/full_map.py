"""The full auxiliary map, eq. auxM: in some regions the worst case of each coordinate separately, elsewhere the map."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.auxiliary.envelope import Envelope
from nsmaps.coordinates import TWO_PI, BoxLike, Coordinates, StateLike, WithCoordinates, as_box, as_starts, nearest_turn
from nsmaps.enclosures.box_images import Boxed, Parts, box_map, moved
from nsmaps.errors import NsmapsError
from nsmaps.exact.enclosure.images import BoxImages, BoxMap, as_boxes
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.results import NONE, Result, array

SLICES = 32  #: of a region along each other coordinate, over which the images of a value are enclosed one by one
SAMPLES, OTHERS = 201, 1000  #: values at which the curves of a piece are given, and states of its region tried at each
MAP = -1  #: the region of a state from which the map itself leads on


@dataclass(frozen=True, eq=False)
class FullAuxiliaryMap:
    """The set-valued map M_A of eq. auxM, as a map of boxes, for which `morse_sets` and `exit_times` hold as for any other.

    From a state in a box A_n each coordinate may go to all that lies between its auxiliary maps (eq. auxv, auxphi): to its
    images over all values that the other coordinates have in A_n. From a state in the region of one of the `pieces` it may
    go to all images by that piece over the region. From other states it goes where the map goes.
    What is true of all orbits of M_A is true of the map's, for these are among them.
    """

    map: Boxed
    boxes: ArrayLike  #: shape (R, n, 2), the boxes A_n, angles on any turn; a state may lie in several of them
    pieces: tuple[tuple[Piece, ArrayLike], ...] = ()  #: those whose region is not a box, each with a box that holds it

    @property
    def coordinates(self) -> Coordinates:
        """The names of the n coordinates."""
        return Coordinates(self.map.coordinates)

    @cached_property
    def _own(self) -> BoxMap:
        return box_map(self.map)

    @cached_property
    def _alone(self) -> list[tuple[BoxMap, Floats]]:
        """The maps of the pieces, each with the box that holds its region."""
        at = self.coordinates
        return [(box_map(CompositeMap(at, (), (piece,))), as_box(box, at)) for piece, box in self.pieces]

    def image_boxes(self, boxes: ArrayLike) -> BoxImages:
        """Outer images of boxes of shape (N, n, 2), angles on any turn."""
        given = as_boxes(boxes, self.coordinates)
        return_map, inside = self._own, np.zeros(len(given), bool)
        parts = []
        for region in as_boxes(self.boxes, self.coordinates):
            common, is_inside = self._common(given, region)
            inside |= is_inside
            parts.append(_products(return_map, common, region))
        for own, region in self._alone:
            common, _ = self._common(given, region)
            met = np.zeros(len(common.source), bool)
            met[own.image_boxes(common.boxes).source] = True
            parts.append(_products(own, common.of(met), region, is_whole=False))
        others = np.flatnonzero(~inside)
        plain = return_map.image_boxes(given[others])
        parts.append((others[plain.source], plain.images, plain.words, others[~plain.bounded], others[plain.empty]))
        source, images, words, unknown, empty = (np.concatenate(part) for part in zip(*parts, strict=True))
        order, products = np.argsort(source, kind="stable"), len(source) - len(plain.source)
        bounded, lost = np.ones(len(given), bool), np.zeros(len(given), bool)
        bounded[unknown], lost[empty] = False, True
        return BoxImages(source[order], images[order], words[order], bounded, lost, order < products)

    def _common(self, boxes: Floats, region: Floats) -> tuple[Parts, Bools]:
        """What boxes have in common with a region, on its turn and rounded outwards, and which of them lie within it.

        A box that goes round the circle may meet a region at both of its ends: in a part for each.
        """
        whole = Parts(np.arange(len(boxes)), boxes, np.zeros(boxes.shape[:2], np.int64))
        parts = whole.near(np.where(self.coordinates.angles, region.mean(axis=1), np.nan))
        low, high = np.maximum(parts.boxes[:, :, 0], region[:, 0]), np.minimum(parts.boxes[:, :, 1], region[:, 1])
        beyond = ((low > parts.boxes[:, :, 0]) | (high < parts.boxes[:, :, 1])).any(axis=1)
        is_inside = np.ones(len(boxes), bool)
        is_inside[parts.source[beyond]] = False
        meets = np.asarray((low <= high).all(axis=1))
        return Parts(parts.source, np.stack([low, high], axis=2), parts.turns).of(meets), is_inside


def _products(
    return_map: BoxMap, parts: Parts, region: Floats, is_whole: bool = True
) -> tuple[Ints, Floats, np.ndarray, Ints, Ints]:
    """The products of each coordinate's images, over its own interval and all of the region in the others.

    With `is_whole` every state of the region must have an image; otherwise the map holds in a part of it alone.
    """
    cut, source = parts.boxes, parts.source
    images, unknown, empty = np.empty_like(cut), np.zeros(len(cut), bool), np.zeros(len(cut), bool)
    for k in range(len(region) if len(cut) else 0):
        intervals, of = np.unique(cut[:, k], axis=0, return_inverse=True)
        ends, is_unknown, is_empty = over_others(return_map, k, intervals, region)
        images[:, k] = ends[of.ravel()]
        unknown |= is_unknown[of.ravel()]
        empty |= is_empty[of.ravel()] & is_whole
    known = np.isfinite(images).all(axis=(1, 2)) & ~unknown
    return source[known], images[known], np.full(int(known.sum()), ""), source[unknown], source[empty]


def over_others(return_map: BoxMap, index: int, intervals: Floats, region: Floats) -> tuple[Floats, Bools, Bools]:
    """Outer bounds, shape (M, 2), of the images of one coordinate over intervals of its own, shape (M, 2), and all of a region.

    Also, of each interval, whether the images over a part of the region are not known, and whether a state may have none.
    Without any image the bounds are infinite, the lower one above.
    """
    n, count = len(region), len(intervals)
    cuts = np.linspace(region[:, 0], region[:, 1], SLICES + 1, axis=-1)
    axes = [np.stack([cuts[k, :-1], cuts[k, 1:]], axis=1) for k in range(n)]
    axes[index] = intervals
    place = np.indices([len(axis) for axis in axes]).reshape(n, -1)
    found = return_map.image_boxes(np.stack([axis[at] for axis, at in zip(axes, place, strict=True)], axis=1))
    images, owner = found.images[:, index], place[index]
    if Coordinates(return_map.coordinates).angles[index]:
        images = _on_one_turn(images, owner[found.source], count)
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, owner[found.source], images[:, 0])
    np.maximum.at(high, owner[found.source], images[:, 1])
    unknown, empty = np.zeros((2, count), bool)
    unknown[owner[~found.bounded]], empty[owner[found.empty]] = True, True
    return np.stack([low, high], axis=1), unknown, empty


def _on_one_turn(images: Floats, owner: Ints, count: int) -> Floats:
    """Intervals of an angle, shape (R, 2), moved by whole turns to where the others of the same owner are, around their mean."""
    middle = np.where(np.isfinite(images).all(axis=1), images.mean(axis=1), 0.0)
    first, total = np.zeros(count), np.zeros(count, complex)
    first[owner[::-1]] = middle[::-1]
    np.add.at(total, owner, np.exp(1j * middle))
    mean = nearest_turn(np.angle(total), first)[owner]
    turns = np.round((nearest_turn(middle, mean) - middle) / TWO_PI).astype(np.int64)
    return moved(images[:, None], turns[:, None])[:, 0]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AuxiliaryRegion(Result):
    """The auxiliary maps of one region, which a box holds; outside of the region they are NaN."""

    name: str
    box: Floats = field(metadata=array("component end", "that holds the region"))
    envelopes: tuple[Envelope, ...]  #: one a coordinate

    @classmethod
    def of_piece(cls, piece: Piece, box: BoxLike, coordinates: Coordinates) -> "AuxiliaryRegion":
        """Of a piece over all of its region that lies in a box, by samples: their extremes, where there are some."""
        region, n, curves = as_box(box, coordinates), len(coordinates), []
        for k, name in enumerate(coordinates):
            points = [SAMPLES if i == k else 1 + round(OTHERS ** (1 / max(n - 1, 1))) for i in range(n)]
            axes = [np.linspace(low, high, count) for (low, high), count in zip(region.tolist(), points, strict=True)]
            states = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
            images = piece.map(states.reshape(-1, n))[:, k].reshape(states.shape[:-1])
            rows = np.moveaxis(images, k, 0).reshape(SAMPLES, -1)
            held = np.moveaxis(piece.region.contains(states.reshape(-1, n)).reshape(images.shape), k, 0).reshape(rows.shape)
            lower, upper = (
                np.where(held.any(axis=1), sign * np.where(held, sign * rows, np.inf).min(axis=1), np.nan) for sign in (1, -1)
            )
            curves.append(Envelope(name, axes[k], lower, upper, np.empty((0, SAMPLES)), np.empty((0, n))))
        return cls(piece.name, region, tuple(curves))

    def step(self, state: Floats, side: int) -> Floats:
        """The lower (side 0) or upper (1) map of every coordinate at a state, shape (n,), on the turn of the box."""
        curves = [(each.x, each.upper if side else each.lower) for each in self.envelopes]
        return np.array([np.interp(value, *curve) for value, curve in zip(state, curves, strict=True)])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AuxiliaryOrbit(WithCoordinates, Result):
    """An orbit of the full auxiliary map by its generic iteration, upper and lower maps alternately; see `auxiliary_orbit`."""

    picture: ClassVar[str] = "nsmaps.figures.domains.auxiliary_map"

    coordinates: Coordinates
    regions: tuple[AuxiliaryRegion, ...]
    states: Floats = field(metadata=array("step coordinate", "the start and its images"))
    region: Ints = field(
        metadata=array(
            "return", "the number of the region whose auxiliary maps led on from each state; -1 of the map itself", NONE
        )
    )

    def summary(self) -> str:
        """The numbers that matter."""
        inside = int((self.region >= 0).sum())
        last = self.states[-1].round(6).tolist()
        return f"{len(self.region)} returns in ({self.coordinates}), {inside} by auxiliary maps, last state {last}"


def auxiliary_orbit(
    return_map: CompositeMap,
    box: AuxiliaryRegion,
    pieces: Sequence[tuple[Piece, AuxiliaryRegion]],
    start: StateLike,
    n_returns: int = 400,
) -> AuxiliaryOrbit:
    """Iterate the full auxiliary map: in a box A_1 and in the regions of some pieces by auxiliary maps, elsewhere by the map.

    In a region every coordinate is led on by its upper map at even returns and by its lower map at odd ones (eq. auxv, auxphi);
    in the end, in A_1, such an orbit alternates between p and q. It is one of the orbits of M_A, and bounds nothing by itself.

    Args:
        start: a state, shape (n,) or a mapping.

    Raises:
        NsmapsError: `n_returns` is not positive, or the state is not one of the map's coordinates.
    """
    if n_returns < 1:
        raise NsmapsError(f"n_returns is {n_returns}; expected: at least 1")
    coordinates, numbers = return_map.coordinates, [list(return_map.pieces).index(piece) for piece, _ in pieces]
    states, region, regions = [as_starts(start, coordinates)], [], (box, *(each for _, each in pieces))
    for step in range(n_returns):
        own = int(return_map.piece_of(states[-1][None])[0])
        near = coordinates.lift(states[-1], box.box.mean(axis=1))
        if ((box.box[:, 0] <= near) & (near <= box.box[:, 1])).all():
            region.append(0)
        else:
            region.append(numbers.index(own) + 1 if own in numbers else MAP)
        if region[-1] == MAP:
            states.append(return_map.first_return(states[-1][None]).image[0])
        else:
            led = regions[region[-1]]
            states.append(led.step(coordinates.lift(states[-1], led.box.mean(axis=1)), 1 - step % 2))
    return AuxiliaryOrbit(coordinates, regions, np.array(states), np.array(region))
