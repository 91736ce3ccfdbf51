"""Sets around saddles, enlarged until each covers those of the next states."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import ctx

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import ProofError
from nsmaps.progress import beat
from nsmaps.proof.chaos.sets import Sets, View, around
from nsmaps.verify.formula import UnprovedError
from nsmaps.verify.horseshoe import BITS

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit

NEAR = (0.2, 0.1, 0.06, 0.03, 0.02, 0.015)  #: distances of states of a set, and of the next: radians, shares of the largest value
FIRST, LARGEST = 1e-5, 0.5  #: half-widths at first and at most, in the same units
MARGIN = 1.2  #: by how much more a set is to cover another one
ROUNDS = 100  #: in which sets are enlarged
ALONG, ACROSS = 65, 5  #: places of a set along its unstable direction, and along each other one


def found_horseshoe(view: View, orbits: Sequence["PeriodicOrbit"], returns: int = 1) -> dict[str, Any]:
    """A horseshoe around saddles, as a certificate states it.

    States of saddles that are near each other, and whose next ones are, share one set along the means of their unstable and
    stable directions. A set is to cover those of the next states; all are enlarged until they do, and given up where they meet or
    have states of different words. Of some distances that of the largest entropy is taken; what `covers` refuses is left out.

    Args:
        view: of the map.
        orbits: cycles, of which only the unstable ones count.
        returns: after which a set is to cover others; more than one where one stretches by less than about three.

    Raises:
        ProofError: the covering relations that were found do not show chaos.
    """
    saddles = [orbit for orbit in orbits if orbit.converged and orbit.stable is False]
    if not saddles:
        raise ProofError("no unstable cycle was found; expected: some saddles around which a horseshoe may be")
    tried = [_adjusted(view, around(view, saddles, near, returns)) for near in NEAR]
    found = max((each for each in tried if each), key=lambda each: _radius(each[0].covers), default=None)
    if found is None:
        raise ProofError(f"no covering relations with chaos were found around the {len(saddles)} saddles; expected: more saddles")
    return _proved(view, *found)


def _adjusted(view: View, sets: Sets) -> tuple[Sets, list[Any]] | None:
    """The sets that are kept, from each of which chains of relations lead to all; also as a certificate states them."""
    while True:
        sets = sets.only(_class(sets.covers))
        if sets.covers.sum() <= len(sets.covers):  # no more than one closed chain
            return None
        half, failed = _enlarged(view, sets)
        if not failed.any():
            centres = sets.centres * sets.scale
            words = view.iterated(centres, sets.returns)[1]
            stated = view.stated(centres, sets.scale[:, None] * sets.bases * half[:, None], words)
            failed = _superfluous(view, stated, sets.covers)
            if not failed.any():
                return sets, stated
        sets = sets.only(~failed)


def _class(covered: Bools) -> Ints:
    """The sets of the strong component of the largest spectral radius."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    if not len(covered):
        return np.arange(0)
    labels = connected_components(csr_array(covered), directed=True, connection="strong")[1]
    parts = [np.flatnonzero(labels == label) for label in range(labels.max() + 1)]
    return max(parts, key=lambda part: _radius(covered[part][:, part]))


def _radius(covered: Bools) -> float:
    """The spectral radius of a matrix of relations."""
    return float(np.abs(np.linalg.eigvals(covered.astype(float))).max()) if len(covered) else 0.0


def _enlarged(view: View, sets: Sets) -> tuple[Floats, Bools]:
    """Half-widths (m, n) with which the sets cover others, and the sets (m,) for which none are found."""
    half, inverses = np.full(sets.centres.shape, FIRST), np.asarray(np.linalg.inv(sets.bases), float)
    one, other = np.nonzero(sets.covers)
    for _ in range(ROUNDS):
        images, whole = _images(view, sets, half)
        if not whole.all() or (half > LARGEST).any():
            return half, ~whole | (half > LARGEST).any(axis=1)
        goal, needed, height = MARGIN * half[other, 0], np.ones(len(half)), np.zeros_like(half[:, 1:])
        reach, high = _crossing(_seen(view, images[one], sets.centres[other], inverses[other]), goal)
        np.maximum.at(needed, one, np.where(reach < goal, np.clip(1.02 * goal / np.maximum(reach, FIRST * goal), 1, 2), 1))
        np.maximum.at(height, other, MARGIN * high)
        raised = height > half[:, 1:]
        half[:, 0] *= needed
        half[:, 1:] = np.where(raised, 1.02 * height, half[:, 1:])
        if not raised.any() and (needed == 1).all():
            return half, np.zeros(len(half), bool)
    return half, raised.any(axis=1) | (needed > 1)


def _places(n: int) -> Floats:
    """Places of a set, shape (ALONG, ACROSS^(n - 1), n)."""
    axes = [np.linspace(-1, 1, ALONG), *[np.linspace(-1, 1, ACROSS)] * (n - 1)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(ALONG, -1, n)


def _images(view: View, sets: Sets, half: Floats) -> tuple[Floats, Bools]:
    """Images (m, ALONG, A, n) of places of sets, and whether the places of a set have the same words."""
    places = _places(half.shape[1])
    shape: tuple[int, ...] = (len(half), *places.shape)
    moved = sets.centres[:, None, None] + np.einsum("nij,nxyj->nxyi", sets.bases, places * half[:, None, None])
    found, words = view.iterated((moved * sets.scale).reshape(-1, half.shape[1]), sets.returns)
    images, words = found.reshape(shape) / sets.scale, words.reshape(len(half), -1)
    for k in np.flatnonzero(view.angles):
        images[..., k] = np.unwrap(np.unwrap(images[..., k], axis=1), axis=2)
    return images, (words == words[:, :1]).all(axis=1) & np.isfinite(images).all(axis=(1, 2, 3))


def _seen(view: View, images: Floats, centres: Floats, inverses: Floats) -> Floats:
    """Images (m, ALONG, A, n) in the coordinates of sets, on the turn on which their middles are nearest."""
    way = images - centres[:, None, None]
    middle = way[:, ALONG // 2, way.shape[2] // 2]
    turns = np.where(view.angles, np.round(middle / TWO_PI), 0)
    return np.asarray(np.einsum("mij,mxyj->mxyi", inverses, way - TWO_PI * turns[:, None, None]))


def _crossing(seen: Floats, goal: Floats) -> tuple[Floats, Floats]:
    """How far both ends of images reach to opposite sides (m,), and how high images are between -goal and goal (m, n - 1)."""
    along, across = seen[..., 0], seen[..., 1:]
    sign, limit = np.sign(along[:, -1].mean(axis=1) - along[:, 0].mean(axis=1))[:, None], goal[:, None, None]
    reach = np.minimum((-sign * along[:, 0]).min(axis=1), (sign * along[:, -1]).min(axis=1))
    step = np.where(np.diff(along, axis=1) == 0, 1.0, np.diff(along, axis=1))
    between = (np.minimum(along[:, 1:], along[:, :-1]) <= limit) & (np.maximum(along[:, 1:], along[:, :-1]) >= -limit)
    shares = [np.clip((side * limit - along[:, :-1]) / step, 0, 1)[..., None] for side in (-1, 1)]
    ends = [across[:, :-1] + share * np.diff(across, axis=1) for share in shares]
    return reach, np.where(between[..., None], np.abs(ends).max(axis=0), 0).max(axis=(1, 2))


def _superfluous(view: View, stated: list[Any], covered: Bools) -> Bools:
    """Of each two sets that meet, the one with fewer chains of two relations through it."""
    gone, weight = np.zeros(len(stated), bool), covered.sum(axis=0) * covered.sum(axis=1)
    for i, j in sorted(view.meeting(stated), key=lambda pair: -max(weight[k] for k in pair)):
        if not (gone[i] or gone[j]):
            gone[i if weight[i] < weight[j] else j] = True
    return gone


def _proved(view: View, sets: Sets, stated: list[Any]) -> dict[str, Any]:
    """The statement of those sets that are shown to cover theirs."""
    kept, why = np.ones(len(stated), bool), ""
    with ctx.workprec(BITS):
        for i, source in enumerate(stated):
            try:
                view.covers(source, [stated[j] for j in np.flatnonzero(sets.covers[i])])
            except UnprovedError as error:
                kept[i], why = False, str(error)
            beat((i + 1) / len(stated), f"{kept[: i + 1].sum()} of {len(stated)} sets cover theirs")
    numbers = np.flatnonzero(kept)
    numbers = numbers[_class(sets.covers[kept][:, kept])]
    covered = sets.covers[numbers][:, numbers]
    if covered.sum() <= len(covered):
        raise ProofError(f"the covering relations that were found do not show chaos: {why}")
    return view.written([stated[i] for i in numbers], np.argwhere(covered).tolist(), sets.returns)
