"""Triangles of a surface divided where it bends between their corners, and left out where it jumps there."""

from collections.abc import Callable

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.exact.returns import Returns

Members = Callable[[Floats], tuple[Bools, Returns]]  #: which of states (N, n) are on the surface, shape (N,), and their returns
Keys = Callable[[Floats], Ints]
Images = Callable[[Floats], Floats]
FLAT = 0.01  #: share of the extent of an image by which the middle of a side may be beside that of its ends
STEEP = 4  #: times that: the least difference of the images of the ends of such a side; a square root has it
ROUNDS = 4  #: in which sides are halved, at most
HALVINGS = 26  #: of a side, to find a jump
JUMP = 0.005  #: share of the extent of an image; a square root changes by less over the last of the halves


def refine_triangles(members: Members, keys: Keys, states: Floats, triangles: Ints, edge: Bools) -> tuple[Floats, Ints]:
    """Triangles (T, 3) between states (P, n) of a surface, so that sides follow it, and none that passes a jump of the image.

    A side is halved, in four rounds, where the image of its middle is beside the middle of those of its ends by more than 1/100
    of the extent of all; beside an edge only if it is on the smooth piece of an end. So walls beside grazes, where images are
    square roots, are resolved. What jumps between ends on one smooth piece, which goes around the end of the jump, is found by
    bisection.

    Args:
        keys: of states, shape (N, c), the same on one smooth piece.
        edge: which states lie on edges of the surface, shape (P,); no jump is looked for between two of them.

    Returns:
        the states with those in between, and the triangles.
    """
    flat, used = np.zeros((0, 3), np.int64), np.unique(triangles)
    image = np.full(states.shape, np.nan)
    image[used] = _images(members, states[used])
    size = np.asarray(np.ptp(image[used], axis=0) if len(used) else np.ones(states.shape[1]))
    size[size == 0] = 1
    image /= size

    def scaled_images(at: Floats) -> Floats:
        return _images(members, at) / size

    for _ in range(ROUNDS):
        a, b, c = (image[corner] for corner in triangles.T)
        extent = np.maximum(np.maximum(a, b), c) - np.minimum(np.minimum(a, b), c)
        wide = (extent > STEEP * FLAT).any(axis=1)
        flat, triangles = np.concatenate([flat, triangles[~wide]]), triangles[wide]
        states, image, triangles = _halve_sides(scaled_images, keys, states, image, triangles, edge)
        edge = np.pad(edge, (0, len(states) - len(edge)))
    sides, of_side = _sides(triangles, len(states))
    torn = np.asarray(~edge[sides].all(axis=1))
    torn[torn] = _jumps(scaled_images, states[sides[torn]], image[sides[torn]])
    return states, np.concatenate([flat, triangles[~torn[of_side].any(axis=1)]])


def _halve_sides(
    images: Images, keys: Keys, states: Floats, image: Floats, triangles: Ints, edge: Bools
) -> tuple[Floats, Floats, Ints]:
    """One round: the states and images with those of the middles of bent sides, and the triangles between them."""
    sides, of_side = _sides(triangles, len(states))
    asked = np.flatnonzero((np.abs(np.subtract(*image[sides.T])) > STEEP * FLAT).any(axis=1))
    ends = sides[asked].T
    middle = np.add(*states[ends]) / 2
    between = images(middle)
    bent = (np.abs(between - np.add(*image[ends]) / 2) > FLAT).any(axis=1)
    beside = np.flatnonzero(bent & edge[ends].any(axis=0))  # of an edge, which a side may cut across
    corners, of_point = np.unique(ends[:, beside], return_inverse=True)
    of_ends = keys(states[corners])[of_point.reshape(2, -1)]
    bent[beside] = (keys(middle[beside]) == of_ends).all(axis=2).any(axis=0)
    number = np.full(len(sides), -1)
    number[asked[bent]] = np.arange(len(states), len(states) + bent.sum())
    points = np.concatenate([states, middle[bent]]), np.concatenate([image, between[bent]])
    return *points, _divide_triangles(triangles, number[of_side])


def _images(members: Members, states: Floats) -> Floats:
    """The images of states (N, n), shape (N, n), NaN of those that are not on the surface."""
    member, own = members(states)
    image = np.full(states.shape, np.nan)
    image[member] = own.image
    return image


def _sides(triangles: Ints, points: int) -> tuple[Ints, Ints]:
    """The sides of triangles (T, 3) between so many points, each once, shape (S, 2), and the numbers of those of each, (T, 3).

    The k-th side is opposite to the k-th corner.
    """
    ends = np.sort(np.stack([np.roll(triangles, -1, axis=1), np.roll(triangles, -2, axis=1)]), axis=0)
    lower, upper = ends
    codes, number = np.unique(lower * points + upper, return_inverse=True)
    return np.stack(np.divmod(codes, points), axis=1), number.reshape(triangles.shape)


def _divide_triangles(triangles: Ints, middle: Ints) -> Ints:
    """Triangles (T, 3) whose sides are halved at points (T, 3), by the side, -1 where one is not."""
    count = (middle >= 0).sum(axis=1)
    turn = np.where(count == 1, middle.argmax(axis=1), middle.argmin(axis=1))  # the one that is unlike the others comes first
    order = (turn[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, order, axis=1).T
    x, y, z = np.take_along_axis(middle, order, axis=1).T
    parts = {
        0: ((a, b, c),),
        1: ((a, b, x), (a, x, c)),
        2: ((a, z, y), (z, b, c), (z, c, y)),
        3: ((a, z, y), (b, x, z), (c, y, x), (x, y, z)),
    }
    return np.concatenate([np.stack(corners, axis=1)[count == k] for k, each in parts.items() for corners in each])


def _jumps(images: Images, ends: Floats, values: Floats) -> Bools:
    """Whether the image jumps between ends (S, 2, n) with values (S, 2, n), shape (S,)."""
    below, above = values.swapaxes(0, 1)
    asked = np.flatnonzero((np.abs(above - below) > STEEP * FLAT).any(axis=1))
    (low, high), (below, above) = ends[asked].swapaxes(0, 1), values[asked].swapaxes(0, 1)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        between = images(middle)
        first = (np.abs(between - below).max(axis=1) >= np.abs(above - between).max(axis=1))[:, None]
        low, below = np.where(first, low, middle), np.where(first, below, between)
        high, above = np.where(first, middle, high), np.where(first, between, above)
        left = (np.abs(above - below) > JUMP).any(axis=1)
        asked, low, high, below, above = (part[left] for part in (asked, low, high, below, above))
    torn = np.zeros(len(ends), bool)
    torn[asked] = True
    return torn
