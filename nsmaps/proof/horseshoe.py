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
from nsmaps.proof.formula import equation_of
from nsmaps.verify.certificate import Certificate
from nsmaps.verify.flights import Doubtful
from nsmaps.verify.formula import system_of
from nsmaps.verify.horseshoe import BITS, Parallelogram, covers

if TYPE_CHECKING:
    from nsmaps.arrays import Bools, Floats, Ints
    from nsmaps.coordinates import BoxLike
    from nsmaps.dynamics.periodic import PeriodicOrbit
    from nsmaps.exact.systems.system import ImpactSystem
    from nsmaps.verify.formula import System

NEAR = (0.06, 0.03, 0.02, 0.015)  #: distances of states of one set, now and later: radians, shares of the largest speed
WINDOWS = ((0, 1), (1, 1))  #: returns back and ahead in which they are near
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

    def only(self, which: "Bools | Ints") -> "_Sets":
        """Some of them."""
        return _Sets(self.centres[which], self.bases[which], self.covers[which][:, which], self.scale)


@shows
def prove_horseshoe(
    system: "ImpactSystem",
    window: "BoxLike",
    period: int = 5,
    *,
    depth: int = 3,
    cells: int = 16,
    progress: Progress | None = None,
) -> Certificate:
    """A certificate of a horseshoe around the saddles that `find_cycles` finds; see `found_horseshoe`.

    Args:
        system: with flights of a linear equation under a harmonic force, and a constant restitution.
        window, period, depth, cells: of the search for cycles.
        progress: called now and then with the fraction that is done.
    """
    return certificate_of(system, find_cycles(system, window, period, depth, cells).cycles)


def certificate_of(system: "ImpactSystem", orbits: Sequence["PeriodicOrbit"]) -> Certificate:
    """A certificate of a horseshoe alone; see `found_horseshoe`."""
    equation = equation_of(system)
    about = {"system": repr(system), "program": f"nsmaps {version('nsmaps')}"}
    return Certificate(about, equation, horseshoe=found_horseshoe(system, system_of(equation), orbits))


def found_horseshoe(system: "ImpactSystem", equation: "System", orbits: Sequence["PeriodicOrbit"]) -> dict[str, Any]:
    """A horseshoe around saddles, as a certificate states it.

    States of saddles that stay near each other for some returns share one set, aligned with the means of their unstable and
    stable directions. A set is to cover those of the next states; all are enlarged until they do, and given up where they meet
    or have states of different impacts. Of some distances that of the largest entropy is taken; what
    `covers` refuses is left out.

    Raises:
        ProofError: the covering relations that were found do not show chaos.
    """
    saddles = [orbit for orbit in orbits if orbit.converged and orbit.stable is False]
    if not saddles:
        raise ProofError("no unstable cycle was found; expected: some saddles around which a horseshoe may be")
    found: tuple[_Sets, Floats] | None = None
    for near in NEAR:
        for back, ahead in WINDOWS:
            tried = _adjusted(system, _around(saddles, near, back, ahead))
            if tried is not None and (found is None or _radius(tried[0].covers) > _radius(found[0].covers)):
                found = tried
    if found is None:
        raise ProofError(f"no covering relations with chaos were found around the {len(saddles)} saddles; expected: more saddles")
    return _proved(system, equation, *found)


def _around(saddles: Sequence["PeriodicOrbit"], near: float, back: int, ahead: int) -> _Sets:
    """Sets around states of saddles, with the relations that the cycles follow."""
    states, words = (
        np.concatenate([orbit.states[:, ::-1] for orbit in saddles]),
        np.concatenate([orbit.words for orbit in saddles]),
    )
    scale = np.array([1.0, states[:, 1].max()])
    states, following = states / scale, np.empty(len(states), int)
    bases, count = [], 0
    for orbit in saddles:
        size = len(orbit.states)
        following[count : count + size] = count + (np.arange(size) + 1) % size
        bases.append(_directions(orbit.returns.derivative[:, ::-1, ::-1] * scale / scale[:, None]))  # type: ignore[index]
        count += size
    group = _groups(states, words, following, near, back, ahead)
    return _hulls(states, np.concatenate(bases), group, group[following], scale)


def _directions(derivatives: "Floats") -> "Floats":
    """The unstable and stable directions (q, 2, 2), as columns, along a cycle with derivatives (q, 2, 2)."""
    size, bases = len(derivatives), np.empty((len(derivatives), 2, 2))
    forth, back = np.array([1.0, 0.3]), np.array([1.0, -0.3])
    for k in range(20 * size):
        forth, back = derivatives[k % size] @ forth, np.linalg.solve(derivatives[-1 - k % size], back)
        forth, back = forth / np.hypot(*forth), back / np.hypot(*back)
        bases[(k + 1) % size, :, 0], bases[-1 - k % size, :, 1] = forth, back
    return bases


def _groups(states: "Floats", words: Any, following: "Ints", near: float, back: int, ahead: int) -> "Ints":
    """Numbers of groups of states (N, 2): each is near another of the same word, as are those of some returns back and ahead."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    before, index, columns = np.argsort(following), np.arange(len(states)), []
    for _ in range(back):
        index = before[index]
    for _ in range(back + 1 + ahead):
        phase, speed = states[index].T
        columns += [np.cos(phase), np.sin(phase), speed]
        index = following[index]
    pairs = cKDTree(np.stack(columns, 1)).query_pairs(near, p=np.inf, output_type="ndarray")
    one, other = pairs[words[pairs[:, 0]] == words[pairs[:, 1]]].T
    graph = coo_array((np.ones(len(one)), (one, other)), shape=(len(states),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1])


def _hulls(states: "Floats", bases: "Floats", group: "Ints", target: "Ints", scale: "Floats") -> _Sets:
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
        places = _turned(states[members] - states[first]) @ np.linalg.inv(means[i]).T
        centres[i] = states[first] + means[i] @ (places.max(axis=0) + places.min(axis=0)) / 2
    return _Sets(centres, means, covered, scale)


def _adjusted(system: "ImpactSystem", sets: _Sets) -> tuple[_Sets, "Floats"] | None:
    """The sets that are kept, with half-widths (n, 2); from each of them chains of relations lead to all."""
    while True:
        sets = sets.only(_class(sets.covers))
        if _radius(sets.covers) <= 1:
            return None
        half, failed = _enlarged(system, sets)
        if not failed.any():
            failed = _superfluous(sets, half)
        if not failed.any():
            return sets, half
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
    returns = system.first_return((places * sets.scale).reshape(-1, 2)[:, ::-1])
    images, words = returns.image[:, ::-1].reshape(shape) / sets.scale, returns.words.reshape(len(half), -1)
    images[..., 0] = np.unwrap(np.unwrap(images[..., 0], axis=1), axis=2)
    return images, (words == words[:, :1]).all(axis=1) & np.isfinite(images).all(axis=(1, 2, 3))


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


def _superfluous(sets: _Sets, half: "Floats") -> "Bools":
    """Of each two sets that meet, the one that adds less to the spectral radius."""
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
    matrices = sets.bases * half[:, None]
    inverses, size = np.linalg.inv(matrices), np.abs(matrices).sum(axis=2)
    way = _turned(sets.centres - sets.centres[:, None])
    gone, weight = np.zeros(len(half), bool), _weights(sets.covers)
    pairs = np.argwhere(np.triu((np.abs(way) <= size + size[:, None]).all(axis=2), 1))
    for i, j in sorted(pairs, key=lambda pair: -weight[pair].max()):
        seen = np.concatenate(
            [(sign * way[i, j] + corners @ matrices[b].T) @ inverses[a].T for sign, a, b in ((1, i, j), (-1, j, i))]
        ).reshape(2, 4, 2)
        if not ((seen > 1).all(axis=1) | (seen < -1).all(axis=1)).any() and not (gone[i] or gone[j]):
            gone[i if weight[i] < weight[j] else j] = True
    return gone


def _weights(covered: "Bools") -> "Floats":
    """What each set adds to the spectral radius, by eigenvectors from the left and the right."""
    vectors = []
    for matrix in (covered.astype(float), covered.T.astype(float)):
        values, columns = np.linalg.eig(matrix)
        vectors.append(np.abs(columns[:, np.abs(values).argmax()]))
    return np.asarray(vectors[0] * vectors[1])


def _turned(way: "Floats") -> "Floats":
    """Differences of states with the phase the shorter way round."""
    return np.stack([(way[..., 0] + np.pi) % TWO_PI - np.pi, way[..., 1]], axis=-1)


def _proved(system: "ImpactSystem", equation: "System", sets: _Sets, half: "Floats") -> dict[str, Any]:
    """The statement of those sets that are shown to cover theirs."""
    letters = list(system.walls())
    words = system.first_return((sets.centres * sets.scale)[:, ::-1]).words
    matrices, centres = sets.scale[:, None] * sets.bases * half[:, None], sets.centres * sets.scale
    walls = [tuple(letters.index(letter) for letter in word[1:]) for word in words]
    stated = [
        Parallelogram(tuple(c.tolist()), (tuple(m[0].tolist()), tuple(m[1].tolist())), w)
        for c, m, w in zip(centres, matrices, walls, strict=True)
    ]
    kept, why = np.ones(len(stated), bool), ""
    with ctx.workprec(BITS):
        for i, source in enumerate(stated):
            try:
                covers(equation, walls[i][-1], source, [stated[j] for j in np.flatnonzero(sets.covers[i])])
            except Doubtful as error:
                kept[i], why = False, str(error)
            beat((i + 1) / len(stated), f"{kept[: i + 1].sum()} of {len(stated)} sets cover theirs")
    numbers = np.flatnonzero(kept)
    numbers = numbers[_class(sets.covers[kept][:, kept])]
    covered = sets.covers[numbers][:, numbers]
    if _radius(covered) <= 1:
        raise ProofError(f"the covering relations that were found do not show chaos: {why}")
    parts = [
        {"centre": list(each.centre), "matrix": [list(row) for row in each.matrix], "walls": list(each.walls)} for each in stated
    ]
    return {"wall": walls[0][-1], "sets": [parts[i] for i in numbers], "relations": np.argwhere(covered).tolist()}
