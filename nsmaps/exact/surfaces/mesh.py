"""Return surfaces as triangles, which end at the edges of the map's smooth pieces."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints, brief
from nsmaps.continuation.bisection import bisect_changes
from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.family import members
from nsmaps.exact.surfaces.refine import refine_triangles
from nsmaps.exact.surfaces.surface import Grid, Surface

if TYPE_CHECKING:
    from nsmaps.exact.surfaces.family import ReturnFamily
    from nsmaps.exact.systems.parameters import System

Part = Callable[[Returns], NDArray[np.integer]]  #: a number for each of N returns, shape (N,), negative to leave one out
CORNERS, QUADRILATERAL = 3, 4  #: corners of triangles and of cells
HALVES = [0, 1, 2], [0, 2, 3]  #: corners of the triangles of a cell
FINER = 2  #: parts of each side of a divided cell
CHANGES = 6  #: of the smooth piece on such a part, at most
HALVINGS, DRAWN = 26, 12  #: of such a part, to find one; where only the place in a picture counts
JOINED = 1e-3  #: radians, or share of the largest image: where images on both sides differ by less, the map is continuous


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Mesh:
    """A return surface over a plane of states: T triangles between P vertices, none of which joins two sheets of the surface.

    Sheets end where the word changes, where the map jumps at a graze within one word, and where an angle of the image is wrapped.
    There are vertices on both sides of such an edge.
    """

    __repr__ = brief

    name: str  #: of the family
    returns: Returns  #: of the P vertices: states, images, words
    part: Ints  #: shape (P,), see `mesh`; zero without parts
    triangles: Ints  #: shape (T, 3), numbers of vertices

    @property
    def coordinates(self) -> Coordinates:
        """The names of the coordinates."""
        return self.returns.coordinates

    def cut(self, k: int, value: float) -> Floats:
        """The surface where coordinate k of states has a value: segments by state and image of both ends, shape (S, 2, 2, n)."""
        points, at = np.stack([self.returns.start, self.returns.image], axis=1), self.returns.start[:, k]
        above = at >= (value if value > at.min() else np.nextafter(at.min(), np.inf))
        count = np.sum([above[corner] for corner in self.triangles.T], axis=0)
        corners, count = (rows[(count > 0) & (count < CORNERS)] for rows in (self.triangles, count))
        alone = np.argmax(above[corners] == (count == 1)[:, None], axis=1)
        turned = np.take_along_axis(corners, (alone[:, None] + np.arange(CORNERS)) % CORNERS, axis=1)
        tip, *ends = turned.T
        shares = [((value - at[tip]) / (at[end] - at[tip]))[:, None, None] for end in ends]
        found = [points[tip] + share * (points[end] - points[tip]) for share, end in zip(shares, ends, strict=True)]
        return np.stack(found, axis=1)


def grid_mesh(surface: Surface) -> Mesh:
    """The surface as triangles between states of its grid alone: cells, or three corners, of one word and one number of turns.

    Raises NsmapsError unless the grid varies along two coordinates.
    """
    _check_plane(surface.grid)
    returns, number = surface.returns, np.full(surface.grid.size, -1)
    number[surface.member] = np.arange(len(returns))
    cells = _around(number.reshape([axis.points for axis in surface.grid.varying.values()]))
    _, kinds = np.unique(np.column_stack([returns.codes, returns.turns]), axis=0, return_inverse=True)
    kind = np.where(cells >= 0, np.append(kinds.reshape(-1), -1)[cells], -1)
    whole = (kind == kind[:, :1]).all(axis=1) & (kind >= 0).all(axis=1)
    triangles = [cells[whole][:, corners] for corners in HALVES]
    for corner in range(4):  # which is beyond an edge
        others = np.delete(np.arange(4), corner)
        cut = ~whole & (kind[:, others] == kind[:, others[:1]]).all(axis=1) & (kind[:, others] >= 0).all(axis=1)
        triangles.append(cells[cut][:, others])
    return Mesh(surface.name, returns, np.zeros(len(returns), np.int64), np.concatenate(triangles))


def mesh(system: "System", surface: Surface, family: "ReturnFamily", part: Part | None = None, flat: bool = False) -> Mesh:
    """The surface of a family as triangles between the states of its grid and states on its edges.

    Cells whose corners lie on several smooth pieces of the map (`ImpactSystem.itineraries`) are divided into four. Between the
    corners of these the places where the piece changes are found by bisection, up to six on a side. If the image is continuous
    there, as at births of turning points, both sides are one vertex. Triangles are divided where the surface bends, and left out
    where it jumps between neighbours on one piece (`refine_triangles`); what else lies between these is not found.

    Args:
        surface: that of the family, over a plane of states; see `Axis.at`.
        part: triangles end also where the number changes that it gives.
        flat: whether the place of triangles alone counts, not their images: none is divided or left out.

    Raises:
        NsmapsError: the grid does not vary along two coordinates.
    """
    _check_plane(surface.grid)
    pieces = _Pieces(system, family, part or (lambda returns: np.zeros(len(returns), np.int64)))
    lattice = _refined_lattice(pieces, surface)
    pairs, outlines = _piece_changes(pieces, lattice, DRAWN if flat else HALVINGS)
    states = np.concatenate([lattice.states, pairs])
    same = np.concatenate([np.arange(len(lattice.states)), len(lattice.states) + _shared_vertices(pieces, pairs)])
    label, key, named = np.full(len(states), -1), np.concatenate([lattice.key, pieces(pairs)]), np.unique(outlines[outlines >= 0])
    _, number = np.unique(key[named], axis=0, return_inverse=True)
    label[named] = number.ravel()
    label[~key.any(axis=1)] = -1  # not on the surface
    fans = _fans(outlines, label), _fans(lattice.beside, np.zeros(len(states), int))
    triangles = same[np.concatenate([*(lattice.whole[:, corners] for corners in HALVES), *fans])]
    if not flat:
        edge = np.arange(len(states)) >= len(lattice.states)
        states, triangles = refine_triangles(pieces.members, pieces, states, triangles, edge)
    used = np.zeros(len(states), bool)
    used[triangles] = True
    used[used], own = pieces.members(states[used])
    triangles = (np.cumsum(used) - 1)[triangles[used[triangles].all(axis=1)]]
    return Mesh(surface.name, own, np.asarray(pieces.part(own), np.int64), triangles)


def _check_plane(grid: Grid) -> None:
    if len(grid.varying) != 2:
        raise NsmapsError(f"the grid varies along {', '.join(grid.varying) or 'no coordinate'}; expected: two coordinates")


@dataclass(frozen=True, slots=True)
class _Pieces:
    """The smooth pieces of a family's returns, distinguished by keys."""

    system: "System"
    family: "ReturnFamily"
    part: Part

    def __call__(self, states: Floats) -> Ints:
        """The keys of states (N, n), shape (N, c): the same on one smooth piece, zero for one that is not on the surface."""
        member, own = self.members(states)
        keys = np.zeros((len(states), self.columns), np.int64)
        keys[member] = self.keys(own)
        return keys

    @property
    def columns(self) -> int:
        """The length c of a key."""
        return 2 + len(self.system.coordinates) + self.family.max_returns

    def members(self, states: Floats) -> tuple[Bools, Returns]:
        """The states on the surface, shape (N,), and their returns."""
        member, own = members(self.system, self.system.first_return(states), self.family)
        kept = np.asarray(self.part(own)) >= 0
        member[member] = kept
        return member, own.select(kept)

    def keys(self, own: Returns) -> Ints:
        """The keys of the surface's returns: 1, the part, turns, and the itinerary of each consecutive return."""
        part = np.asarray(self.part(own))
        keys = np.column_stack([np.ones(len(own), np.int64), part, own.turns, self._itineraries(own)])
        return np.where(part[:, None] >= 0, keys, 0)

    def _itineraries(self, own: Returns) -> Ints:
        """Of each of the consecutive returns of members, shape (M, max_returns), zero after the last."""
        if self.family.max_returns == 1:
            return self.system.itineraries(own.start).codes[:, None]
        found, states = np.zeros((len(own), self.family.max_returns), np.int64), own.start.copy()
        for k in range(self.family.max_returns):
            on = own.numbers > k
            found[on, k] = self.system.itineraries(states[on]).codes
            states[on] = self.system.first_return(states[on]).image
        return found


@dataclass(frozen=True, slots=True, eq=False)
class _Lattice:
    """The states of a grid and some between them; cells, as the numbers of the states around each, in turn."""

    states: Floats  #: (L, n), of all places between those of the grid
    key: Ints  #: (L, c), of the states that cells name
    whole: Ints  #: (W, 4), the cells on one smooth piece
    beside: Ints  #: (E, S), those of them next to a cell that is divided, with the states on their sides, -1 for none
    divided: Ints  #: (D, 4), the parts of all others


def _refined_lattice(pieces: _Pieces, surface: Surface) -> _Lattice:
    """The lattice of a surface."""
    axes = surface.grid.axes
    fine = Grid(axes={name: axis.model_copy(update={"points": FINER * (axis.points - 1) + 1}) for name, axis in axes.items()})
    lattice = np.arange(fine.size).reshape([axis.points for axis in fine.varying.values()])
    coarse = lattice[::FINER, ::FINER]
    states, key = fine.states(), np.zeros((fine.size, pieces.columns), np.int64)
    states[coarse.ravel()] = surface.grid.states()
    key[coarse.ravel()[surface.member]] = pieces.keys(surface.returns)
    cells = _around(coarse)
    first, *others = cells.T
    alike = np.logical_and.reduce([(key[other] == key[first]).all(axis=1) for other in others])
    parts = lattice[:FINER, :FINER].reshape(-1, 1) + _around(lattice[:2, :2])
    divided = (cells[~alike, :1, None] + parts).reshape(-1, 4)
    new = np.zeros(fine.size, bool)
    new[divided], new[coarse] = True, False
    key[new] = pieces(states[new])
    whole = cells[alike & key[first].any(axis=1)]
    corners = _around(lattice[: FINER + 1 : FINER, : FINER + 1 : FINER])
    walk = np.linspace(corners, np.roll(corners, -1), FINER, endpoint=False, dtype=np.int64, axis=-1).ravel()
    rims = whole[:, :1] + walk
    named = new[rims] | (np.arange(len(walk)) % FINER == 0)
    beside = named.sum(axis=1) > QUADRILATERAL
    return _Lattice(states, key, whole[~beside], np.where(named, rims, -1)[beside], divided)


def _around(lattice: Ints) -> Ints:
    """The points around each cell of a lattice, in turn, shape (C, 4)."""
    return np.stack([lattice[:-1, :-1], lattice[1:, :-1], lattice[1:, 1:], lattice[:-1, 1:]], axis=-1).reshape(-1, 4)


def _piece_changes(pieces: _Pieces, lattice: _Lattice, halvings: int) -> tuple[Floats, Ints]:
    """States (2 B, n) on both sides of each change of piece between corners of divided cells, in pairs, and the cells' outlines.

    An outline, of shape (D, S), has the number of each corner, then those of the states on the side to the next, which are
    counted from L on, and -1 in between.
    """
    cells, states, key = lattice.divided, lattice.states, lattice.key
    lower, upper = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)]), axis=0)
    sides, of_side = np.unique(lower * len(states) + upper, return_inverse=True)
    first, second = np.divmod(sides, len(states))
    crossed = np.flatnonzero((key[first] != key[second]).any(axis=1))
    first, second = first[crossed], second[crossed]
    number, near, far = bisect_changes(pieces, states[first], states[second], key[first], key[second], CHANGES, halvings)
    order = np.argsort(number, kind="stable")
    number, pairs = crossed[number[order]], np.stack([near[order], far[order]], axis=1).reshape(-1, states.shape[1])
    place = np.arange(len(number)) - np.searchsorted(number, number)
    slots = np.full((len(sides), CHANGES, 2), -1)
    slots[number, place] = len(states) + np.arange(len(pairs)).reshape(-1, 2)
    on_side = slots.reshape(len(sides), 2 * CHANGES)[of_side.reshape(cells.shape)]
    back = cells > np.roll(cells, -1, axis=1)
    on_side[back] = on_side[back][:, ::-1]
    return pairs, np.concatenate([cells[..., None], on_side], axis=-1).reshape(len(cells), 4 + 8 * CHANGES)


def _shared_vertices(pieces: _Pieces, pairs: Floats) -> Ints:
    """The vertices of the states (2 B, n) on both sides of changes, by number: one for both if the map is continuous there."""
    member, own = pieces.members(pairs)
    there = member[::2] & member[1::2]
    near, far = (np.cumsum(member) - 1)[::2][there], (np.cumsum(member) - 1)[1::2][there]
    kinds = np.column_stack([own.codes, pieces.part(own), own.turns])
    size = np.where(own.coordinates.angles, 1.0, np.abs(own.image).max(axis=0, initial=0.0))
    close = (np.abs(own.image[near] - own.image[far]) <= JOINED * size).all(axis=1)
    number = np.arange(len(pairs))
    number[1::2][there] -= close & (kinds[near] == kinds[far]).all(axis=1)
    return number


def _fans(outlines: Ints, label: Ints) -> Ints:
    """The triangles between points of one label on each of the outlines (D, S), shape (T, 3); none where the label is negative.

    A label that comes twice in turn with others belongs to a strip through the cell. Where two labels do, that of a corner is
    parted.
    """
    cell, slot = np.nonzero(outlines >= 0)
    point = outlines[cell, slot]
    own = label[point]
    run = _runs(cell, own)
    pairs, of_pair = np.unique(np.column_stack([cell, own]), axis=0, return_inverse=True)  # of cells and labels
    of_pair = of_pair.ravel()
    _, begin = np.unique(run, return_index=True)
    several = np.bincount(of_pair[begin], minlength=len(pairs)) > 1
    with_corner = np.bincount(of_pair, slot % (1 + 2 * CHANGES) == 0, len(pairs)) > 0
    cell_of_pair, _ = pairs.T
    parted = several & with_corner & (np.bincount(cell_of_pair, several)[cell_of_pair] > 1)
    group = np.where(parted[of_pair], len(pairs) + run, of_pair)
    order = np.argsort(group, kind="stable")
    group, point, own = group[order], point[order], own[order]
    head = point[np.searchsorted(group, group)]
    kept = (group[1:] == group[:-1]) & (point[:-1] != head[:-1]) & (own[:-1] >= 0)
    return np.column_stack([head[:-1], point[:-1], point[1:]])[kept]


def _runs(cell: Ints, label: Ints) -> Ints:
    """A number for each run of a label on the outline of a cell, which has no beginning; cells are sorted."""
    begins = np.r_[True, (cell[1:] != cell[:-1]) | (label[1:] != label[:-1])]
    run = np.cumsum(begins) - 1
    first = np.searchsorted(cell, cell)
    last = np.searchsorted(cell, cell, side="right") - 1
    return np.where((run == run[last]) & (label[first] == label[last]), run[first], run)
