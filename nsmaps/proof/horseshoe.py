"""The search for a horseshoe: parallelograms around the saddles of cycles, large enough to cover each other, in floats."""

from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from flint import ctx

from nsmaps.cells.periodic_points import find_cycles
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import ProofError
from nsmaps.progress import Progress, beat, shows
from nsmaps.proof.formula import balls_of, equation_of, provable
from nsmaps.verify.certificate import Certificate
from nsmaps.verify.formula import Doubtful
from nsmaps.verify.horseshoe import BITS, Parallelogram, covers, meeting

if TYPE_CHECKING:
    from nsmaps.arrays import Bools, Floats, Ints
    from nsmaps.coordinates import BoxLike
    from nsmaps.dynamics.periodic import PeriodicOrbit
    from nsmaps.exact.systems.system import ImpactSystem
    from nsmaps.verify.formula import System

NEAR = (0.2, 0.1, 0.06, 0.03, 0.02, 0.015)  #: distances of states of a set, and of the next: radians, shares of the largest speed
FIRST, LARGEST = 1e-5, 0.5  #: half-widths at first and at most, in the same units
MARGIN = 1.2  #: by how much more a set is to cover another one
ROUNDS = 100  #: in which sets are enlarged
GRID = np.stack(np.meshgrid(np.linspace(-1, 1, 65), np.linspace(-1, 1, 5), indexing="ij"), -1)  #: places of a set, (65, 5, 2)


class _Sets(NamedTuple):
    """Parallelograms in the coordinates phase and speed/scale."""

    centres: "Floats"  #: (n, 2)
    bases: "Floats"  #: (n, 2, 2), unit vectors as columns, the unstable direction first
    covers: "Bools"  #: (n, n), whether a set is to cover another one
    scale: "Floats"  #: (2,)
    returns: int  #: after which they cover others

    def only(self, which: "Bools | Ints") -> "_Sets":
        """Some of them."""
        return _Sets(self.centres[which], self.bases[which], self.covers[which][:, which], self.scale, self.returns)


@shows
def prove_horseshoe(
    system: "ImpactSystem",
    window: "BoxLike",
    period: int = 5,
    *,
    returns: int = 1,
    depth: int = 3,
    cells: int = 16,
    progress: Progress | None = None,
) -> Certificate:
    """A certificate of a horseshoe around the saddles that `find_cycles` finds; see `found_horseshoe`.

    Args:
        system: with flights of a linear equation under a harmonic force, and a constant restitution.
        window, period, depth, cells: of the search for cycles.
        returns: see `found_horseshoe`.
        progress: called now and then with the fraction that is done.
    """
    provable(system)
    return certificate_of(system, find_cycles(system, window, period, depth, cells).cycles, returns)


def certificate_of(system: "ImpactSystem", orbits: Sequence["PeriodicOrbit"], returns: int = 1) -> Certificate:
    """A certificate of a horseshoe alone; see `found_horseshoe`."""
    equation = equation_of(system)
    about = {"system": repr(system), "program": f"nsmaps {version('nsmaps')}"}
    return Certificate(about, equation, horseshoe=found_horseshoe(system, balls_of(equation), orbits, returns))


def found_horseshoe(
    system: "ImpactSystem", equation: "System", orbits: Sequence["PeriodicOrbit"], returns: int = 1
) -> dict[str, Any]:
    """A horseshoe around saddles, as a certificate states it.

    States of saddles that are near each other, and whose next ones are, share one set along the means of their unstable and
    stable directions. A set is to cover those of the next states; all are enlarged until they do, and given up where they meet or
    have states of different impacts. Of some distances that of the largest entropy is taken; what `covers` refuses is left out.

    Args:
        system: whose first return is considered.
        equation: the same system in balls.
        orbits: cycles, of which only the saddles count.
        returns: after which a set is to cover others; more than one where one stretches by less than about three.

    Raises:
        ProofError: the covering relations that were found do not show chaos.
    """
    saddles = [orbit for orbit in orbits if orbit.converged and orbit.stable is False]
    if not saddles:
        raise ProofError("no unstable cycle was found; expected: some saddles around which a horseshoe may be")
    tried = [_adjusted(system, _around(saddles, near, returns)) for near in NEAR]
    found = max((each for each in tried if each), key=lambda each: _radius(each[0].covers), default=None)
    if found is None:
        raise ProofError(f"no covering relations with chaos were found around the {len(saddles)} saddles; expected: more saddles")
    return _proved(equation, *found)


def _around(saddles: Sequence["PeriodicOrbit"], near: float, returns: int) -> _Sets:
    """Sets around states of saddles, with the relations that the cycles follow."""
    states, words = (
        np.concatenate([orbit.states[:, ::-1] for orbit in saddles]),
        [word for orbit in saddles for word in _words(orbit, returns)],
    )
    scale = np.array([1.0, states[:, 1].max()])
    states, following = states / scale, np.empty(len(states), int)
    bases, count = [], 0
    for orbit in saddles:
        size = len(orbit.states)
        following[count : count + size] = count + (np.arange(size) + returns) % size
        bases.append(_directions(orbit.returns.derivative[:, ::-1, ::-1] * scale / scale[:, None]))  # type: ignore[index]
        count += size
    group = _groups(states, np.array(words), following, near)
    return _hulls(states, np.concatenate(bases), group, group[following], scale, returns)


def _directions(derivatives: "Floats") -> "Floats":
    """The unstable and stable directions (q, 2, 2), as columns, along a cycle with derivatives (q, 2, 2)."""
    size, bases = len(derivatives), np.empty((len(derivatives), 2, 2))
    forth, back = np.array([1.0, 0.3]), np.array([1.0, -0.3])
    for k in range(20 * size):
        forth, back = derivatives[k % size] @ forth, np.linalg.solve(derivatives[-1 - k % size], back)
        forth, back = forth / np.hypot(*forth), back / np.hypot(*back)
        bases[(k + 1) % size, :, 0], bases[-1 - k % size, :, 1] = forth, back
    return bases


def _groups(states: "Floats", words: Any, following: "Ints", near: float) -> "Ints":
    """Numbers of groups of states (N, 2): each is near another of the same word, and so are the next ones."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    round = np.stack([np.cos(states[:, 0]), np.sin(states[:, 0]), states[:, 1]], 1)
    pairs = cKDTree(np.concatenate([round, round[following]], 1)).query_pairs(near, p=np.inf, output_type="ndarray")
    one, other = pairs[words[pairs[:, 0]] == words[pairs[:, 1]]].T
    graph = coo_array((np.ones(len(one)), (one, other)), shape=(len(states),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1])


def _hulls(states: "Floats", bases: "Floats", group: "Ints", target: "Ints", scale: "Floats", returns: int) -> _Sets:
    """Sets in the middle of groups of states, along the means of their directions; `target` is the group of the next state."""
    count = int(group.max()) + 1
    centres, means, covered = np.empty((count, 2)), np.empty((count, 2, 2)), np.zeros((count, count), bool)
    covered[group, target] = True
    for i in range(count):
        members = np.flatnonzero(group == i)
        first = members[0]
        signs = np.sign((bases[members] * bases[first]).sum(axis=1))
        mean = (bases[members] * signs[:, None]).sum(axis=0)
        means[i] = mean / np.hypot(*mean)
        way = states[members] - states[first]
        way[:, 0] -= TWO_PI * np.round(way[:, 0] / TWO_PI)
        places = way @ np.linalg.inv(means[i]).T
        centres[i] = states[first] + means[i] @ (places.max(axis=0) + places.min(axis=0)) / 2
    return _Sets(centres, means, covered, scale, returns)


def _adjusted(system: "ImpactSystem", sets: _Sets) -> tuple[_Sets, list[Parallelogram]] | None:
    """The sets that are kept, from each of which chains of relations lead to all; also as a certificate states them."""
    while True:
        sets = sets.only(_class(sets.covers))
        if sets.covers.sum() <= len(sets.covers):  # no more than one closed chain
            return None
        half, failed = _enlarged(system, sets)
        if not failed.any():
            stated = _stated(system, sets, half)
            failed = _superfluous(stated, sets.covers)
            if not failed.any():
                return sets, stated
        sets = sets.only(~failed)


def _class(covered: "Bools") -> "Ints":
    """The sets of the strong component of the largest spectral radius."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    if not len(covered):
        return np.arange(0)
    labels = connected_components(csr_array(covered), directed=True, connection="strong")[1]
    parts = [np.flatnonzero(labels == label) for label in range(labels.max() + 1)]
    return max(parts, key=lambda part: _radius(covered[part][:, part]))


def _radius(covered: "Bools") -> float:
    """The spectral radius of a matrix of relations."""
    return float(np.abs(np.linalg.eigvals(covered.astype(float))).max()) if len(covered) else 0.0


def _enlarged(system: "ImpactSystem", sets: _Sets) -> tuple["Floats", "Bools"]:
    """Half-widths (n, 2) with which the sets cover others, and the sets (n,) for which none are found."""
    half, inverses = np.full((len(sets.centres), 2), FIRST), np.asarray(np.linalg.inv(sets.bases), float)
    one, other = np.nonzero(sets.covers)
    for _ in range(ROUNDS):
        images, whole = _images(system, sets, half)
        if not whole.all() or (half > LARGEST).any():
            return half, ~whole | (half > LARGEST).any(axis=1)
        goal, needed, height = MARGIN * half[other, 0], np.ones(len(half)), np.zeros(len(half))
        reach, high = _crossing(_seen(images[one], sets.centres[other], inverses[other]), goal)
        np.maximum.at(needed, one, np.where(reach < goal, np.clip(1.02 * goal / np.maximum(reach, FIRST * goal), 1, 2), 1))
        np.maximum.at(height, other, MARGIN * high)
        raised = height > half[:, 1]
        half = half * np.stack([needed, np.ones(len(half))], 1)
        half[raised, 1] = 1.02 * height[raised]
        if not raised.any() and (needed == 1).all():
            return half, np.zeros(len(half), bool)
    return half, raised | (needed > 1)


def _images(system: "ImpactSystem", sets: _Sets, half: "Floats") -> tuple["Floats", "Bools"]:
    """Images (n, 65, 5, 2) of places of sets, and whether the places of a set have the same impacts."""
    shape = len(half), *GRID.shape
    places = sets.centres[:, None, None] + np.einsum("nij,nxyj->nxyi", sets.bases, GRID * half[:, None, None])
    found, words = _iterated(system, (places * sets.scale).reshape(-1, 2), sets.returns)
    images, words = found.reshape(shape) / sets.scale, words.reshape(len(half), -1)
    images[..., 0] = np.unwrap(np.unwrap(images[..., 0], axis=1), axis=2)
    return images, (words == words[:, :1]).all(axis=1) & np.isfinite(images).all(axis=(1, 2, 3))


def _iterated(system: "ImpactSystem", states: "Floats", returns: int) -> tuple["Floats", Any]:
    """Images of phases and speeds (N, 2) after some returns, NaN where there are none, and the words (N,) of these."""
    words, lost = np.zeros(len(states), object), np.zeros(len(states), bool)
    for k in range(returns):
        found = system.first_return(states[:, ::-1])
        lost |= ~np.isfinite(found.image).all(axis=1)
        words = words + [word[1:] for word in found.words] if k else found.words.astype(object)
        states = np.where(lost[:, None], states, found.image[:, ::-1])
    return np.where(lost[:, None], np.nan, states), words


def _words(orbit: "PeriodicOrbit", returns: int) -> list[str]:
    """The impacts of some returns from each state of a cycle."""
    size, words = len(orbit.words), orbit.words
    return [words[k] + "".join(words[(k + i) % size][1:] for i in range(1, returns)) for k in range(size)]


def _seen(images: "Floats", centres: "Floats", inverses: "Floats") -> "Floats":
    """Images (m, 65, 5, 2) in the coordinates of sets, on the turn on which their middles are nearest."""
    way = images - centres[:, None, None]
    way[..., 0] -= TWO_PI * np.round(way[:, 32, 2, 0] / TWO_PI)[:, None, None]
    return np.asarray(np.einsum("mij,mxyj->mxyi", inverses, way))


def _crossing(seen: "Floats", goal: "Floats") -> tuple["Floats", "Floats"]:
    """How far both ends of images reach to opposite sides (m,), and how high images are between -goal and goal (m,)."""
    along, across = seen[..., 0], seen[..., 1]
    sign, limit = np.sign(along[:, -1].mean(axis=1) - along[:, 0].mean(axis=1))[:, None], goal[:, None, None]
    reach = np.minimum((-sign * along[:, 0]).min(axis=1), (sign * along[:, -1]).min(axis=1))
    step = np.where(np.diff(along, axis=1) == 0, 1.0, np.diff(along, axis=1))
    between = (np.minimum(along[:, 1:], along[:, :-1]) <= limit) & (np.maximum(along[:, 1:], along[:, :-1]) >= -limit)
    ends = [across[:, :-1] + np.clip((side * limit - along[:, :-1]) / step, 0, 1) * np.diff(across, axis=1) for side in (-1, 1)]
    return reach, np.where(between, np.abs(ends).max(axis=0), 0).max(axis=(1, 2))


def _superfluous(stated: list[Parallelogram], covered: "Bools") -> "Bools":
    """Of each two sets that meet, the one with fewer chains of two relations through it."""
    gone, weight = np.zeros(len(stated), bool), covered.sum(axis=0) * covered.sum(axis=1)
    for i, j in sorted(meeting(stated), key=lambda pair: -max(weight[k] for k in pair)):
        if not (gone[i] or gone[j]):
            gone[i if weight[i] < weight[j] else j] = True
    return gone


def _stated(system: "ImpactSystem", sets: _Sets, half: "Floats") -> list[Parallelogram]:
    """The sets as a certificate states them."""
    letters, centres = list(system.walls()), sets.centres * sets.scale
    matrices, words = sets.scale[:, None] * sets.bases * half[:, None], _iterated(system, centres, sets.returns)[1]
    walls = [tuple(letters.index(letter) for letter in word[1:]) for word in words]
    return [
        Parallelogram(tuple(c), (tuple(m[0]), tuple(m[1])), w)
        for c, m, w in zip(centres.tolist(), matrices.tolist(), walls, strict=True)
    ]


def _proved(equation: "System", sets: _Sets, stated: list[Parallelogram]) -> dict[str, Any]:
    """The statement of those sets that are shown to cover theirs."""
    kept, why, wall = np.ones(len(stated), bool), "", stated[0].walls[-1]
    with ctx.workprec(BITS):
        for i, source in enumerate(stated):
            try:
                covers(equation, wall, source, [stated[j] for j in np.flatnonzero(sets.covers[i])])
            except Doubtful as error:
                kept[i], why = False, str(error)
            beat((i + 1) / len(stated), f"{kept[: i + 1].sum()} of {len(stated)} sets cover theirs")
    numbers = np.flatnonzero(kept)
    numbers = numbers[_class(sets.covers[kept][:, kept])]
    covered = sets.covers[numbers][:, numbers]
    if covered.sum() <= len(covered):
        raise ProofError(f"the covering relations that were found do not show chaos: {why}")
    parts = [{"centre": [*each.centre], "matrix": [[*row] for row in each.matrix], "walls": [*each.walls]} for each in stated]
    relations = np.argwhere(covered).tolist()
    return {"wall": wall, "returns": sets.returns, "sets": [parts[i] for i in numbers], "relations": relations}
