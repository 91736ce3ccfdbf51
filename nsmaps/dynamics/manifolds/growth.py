"""The growth of a manifold from its start: images of one piece of it, with states inserted until neighbours are close.

The piece of the local curve that n returns stretch over themselves is mapped again and again; its k-th images are the next
piece of the manifold (D. Hobson, J. Comput. Phys. 104 (1993) 14). States between neighbours are inserted on the local curve
and mapped from there: no state is interpolated. Where labels of two neighbours differ, the change is bisected to rounding.
"""

from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.continuation.bisection import bisect_change
from nsmaps.dynamics.manifolds.local import LocalCurve, several
from nsmaps.exact.returnmap import ReturnMap

OPEN, CUT, MET = 0, 1, 2  #: between a state and the next: a curve, a jump, or a change of words at which both sides meet
MEETS = 1e-2  #: distance of the sides of a change, as a share of the gap, at which the curve is continuous there
ROUNDS = 200  #: of insertions into one image
POINT = 1e-9  #: arclength of an image, in units of the scale, below which it has shrunk to a point of an attractor
FOLDED = 300  #: images after which a curve that stays within the gap, where a straight one would be long, is folded in it


@dataclass(frozen=True, slots=True)
class Image:
    """One image of the piece: its states in order, and what lies between them."""

    share: Floats  #: shape (M,), of the piece, from 0 to 1: increasing
    states: Floats  #: shape (M, 2)
    labels: Ints  #: shape (M, c), of the last n returns
    after: Ints  #: shape (M,), OPEN, CUT or MET: between this state and the next

    def inserted(self, share: Floats, states: Floats, labels: Ints, after: Ints) -> "Image":
        """With more states; of equal shares one is kept, with what is known of them."""
        shares, first, all_of = np.unique(np.append(self.share, share), return_index=True, return_inverse=True)
        known = np.zeros(len(shares), np.int64)
        np.maximum.at(known, all_of, np.append(self.after, after))
        return Image(shares, np.concatenate([self.states, states])[first], np.concatenate([self.labels, labels])[first], known)

    def moving(self) -> "Image":
        """Without the states that have no image; a cut stands where they were."""
        there: Bools = np.asarray(np.isfinite(self.states).all(axis=1))
        after = np.where(there, np.where(np.append(there[1:], True), self.after, CUT), CUT)
        return Image(self.share[there], self.states[there], self.labels[there], after[there])


@dataclass(frozen=True, slots=True)
class Growth:
    """How a manifold is grown."""

    map: ReturnMap
    local: LocalCurve
    length: float  #: arclength at which it ends, in units of the scale
    gap: float  #: largest distance of neighbours
    max_points: int

    def distances(self, one: Floats, other: Floats) -> Floats:
        """The distances of states, shape (N,), in units of the scale, with angles the shorter way round."""
        return np.linalg.norm(self.local.coordinates.difference(one, other) / self.local.scale, axis=1)

    def mapped(self, share: Floats, times: int) -> tuple[Floats, Ints]:
        """The images of shares of the piece, and the labels of the last of them."""
        states = self.local.at(share)
        labels = np.full((len(share), 2 * self.local.returns), -1, np.int64)
        for _ in range(times):
            states, labels, _ = several(self.map, states, self.local.returns)
        return states, labels

    def next_image(self, image: Image, times: int) -> Image:
        """The image of an image, before insertions."""
        states, labels, _ = several(self.map, image.states, self.local.returns)
        return self.filled(self._thinned(Image(image.share, states, labels, image.after)), times)

    def lengths(self, image: Image) -> Floats:
        """The distance of each state from the next along the curve, shape (M - 1,); none across a jump."""
        return np.where(image.after[:-1] == CUT, 0.0, self.distances(image.states[1:], image.states[:-1]))

    def _thinned(self, image: Image) -> Image:
        """Without states that are closer than half of the gap; those beside jumps and changes of labels are kept."""
        steps = np.nan_to_num(self.distances(image.states[1:], image.states[:-1]))
        place = np.floor(np.append(0.0, np.cumsum(steps)) / (self.gap / 2))
        beside = (image.after[:-1] != OPEN) | (image.labels[1:] != image.labels[:-1]).any(axis=1)
        kept = np.append(True, np.diff(place) > 0) | np.append(beside, True) | np.append(True, beside)
        return Image(image.share[kept], image.states[kept], image.labels[kept], image.after[kept])

    def filled(self, image: Image, times: int) -> Image:
        """An image with states inserted until neighbours are close; jumps are cut."""
        for _ in range(ROUNDS):
            uncertain = image.after[:-1] == OPEN
            changes = uncertain & (image.labels[1:] != image.labels[:-1]).any(axis=1)
            wide = uncertain & ~changes & (self.distances(image.states[1:], image.states[:-1]) > self.gap)
            if not (changes | wide).any() or len(image.share) > self.max_points:
                break
            image = self._halved(self._split(image, changes, times), wide, image, times)
        return image.moving()

    def _split(self, image: Image, changes: Bools, times: int) -> Image:
        """With both sides of a change of labels between neighbours."""
        at = np.flatnonzero(changes)
        if not len(at):
            return image
        ends = image.share[at], image.share[at + 1]
        near, far, _ = bisect_change(lambda t: self.mapped(t, times)[1], *ends, image.labels[at], image.labels[at + 1])
        (here, own), (there, other) = self.mapped(near, times), self.mapped(far, times)
        with np.errstate(invalid="ignore"):
            meets = self.distances(here, there) <= MEETS * self.gap
        image = image.inserted(near, here, own, np.where(meets, MET, CUT))
        return image.inserted(far, there, other, np.zeros(len(at), np.int64))

    def _halved(self, image: Image, wide: Bools, before: Image, times: int) -> Image:
        """With a state between neighbours that are far from each other; a cut where no number lies between their shares."""
        at = np.flatnonzero(wide)
        if not len(at):
            return image
        low, high = before.share[at], before.share[at + 1]
        middle = (low + high) / 2
        ends = (middle <= low) | (middle >= high)
        cuts = np.searchsorted(image.share, low[ends])
        after = image.after.copy()
        after[cuts] = CUT
        states, labels = self.mapped(middle[~ends], times)
        return replace(image, after=after).inserted(middle[~ends], states, labels, np.zeros(len(states), np.int64))


def grown(growth: Growth) -> tuple[Floats, Floats, Ints, str]:
    """The states (N, 2) of a side of a manifold from the saddle on, their arclength, the numbers of their pieces, why it ends."""
    local, times = growth.local, 0
    ends = np.array([0.0, 1.0])
    image = growth.filled(Image(ends, *growth.mapped(ends, 0), np.zeros(2, np.int64)), 0)
    parts = [Image(np.full(1, -1.0), local.state[None], image.labels[:1], np.zeros(1, np.int64)), image]
    while True:
        whole = _joined(parts)
        arclength = np.append(0.0, np.cumsum(growth.lengths(whole)))
        if why := _end(growth, image, times, float(arclength[-1]), len(whole.share)):
            kept = arclength <= growth.length
            kept[growth.max_points :] = False
            piece = np.append(0, np.cumsum(whole.after[:-1] == CUT))
            return whole.states[kept], arclength[kept], piece[kept], why
        times += 1
        image = growth.next_image(image, times)
        parts.append(image)


def _end(growth: Growth, image: Image, times: int, length: float, states: int) -> str:
    """The reason why a side ends with this image, or no text."""
    local, size = growth.local, growth.lengths(image).sum()
    if length >= growth.length:
        return f"length {growth.length:g}"
    if states >= growth.max_points:
        return f"{growth.max_points} states"
    if not len(image.share):
        return "no state has an image"
    if size < POINT:
        return "an attractor"
    straight = times * np.log(local.multiplier) > np.log(growth.length / local.length)
    return "images shorter than the gap" if times >= FOLDED and straight and size < growth.gap else ""


def _joined(parts: list[Image]) -> Image:
    """Images one after the other; the last state of each is the first of the next, if both are there."""
    share, states, labels, after = ([getattr(part, name) for part in parts] for name in ("share", "states", "labels", "after"))
    for k in range(2, len(parts)):
        before, now = parts[k - 1], parts[k]
        meet = len(before.share) and len(now.share) and before.share[-1] == 1.0 and now.share[0] == 0.0
        if meet:
            share[k], states[k], labels[k], after[k] = now.share[1:], now.states[1:], now.labels[1:], now.after[1:]
        if (meet and now.after[0] == CUT) or (not meet and len(before.share)):
            after[k - 1] = np.append(before.after[:-1], CUT)
    return Image(*(np.concatenate(part) for part in (share, states, labels, after)))
