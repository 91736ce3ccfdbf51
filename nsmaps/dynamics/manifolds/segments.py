"""Manifolds of maps of affine pieces: straight segments, mapped by their ends and cut at borders, exact but for rounding.

From a saddle on, a manifold is straight up to where it meets a border, or where its images under the returns of the saddle do.
The last part of this segment, which the returns stretch over its images, is mapped again and again.
"""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.dynamics.manifolds.local import Saddle
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.exact.systems.piecewise import PiecewiseMap

MEETS = 1e-9  #: distance in the scale of the images of one state by two pieces that are one
ON = 1e-13  #: distance from a border, in the scale, of a state on it
POINT = 1e-9  #: arclength of an image, in units of the scale, below which it has shrunk to a point of an attractor


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """States in order, and whether each is joined to the next by a straight segment."""

    states: Floats  #: shape (M, 2)
    joined: Bools  #: shape (M,), False for the last


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """The affine pieces of a map, and the functions whose zeros are borders."""

    map: PiecewiseMap
    scale: Floats
    matrices: Floats  #: shape (P, 2, 2)
    shifts: Floats  #: shape (P, 2)
    gradients: Floats  #: shape (B, 2), of the borders
    constants: Floats  #: shape (B,)

    @classmethod
    def of(cls, return_map: PiecewiseMap, scale: Floats) -> "Pieces":
        """Those of a map."""
        zero = np.zeros((1, 2))
        own = return_map.prolongation((0,), zero).of
        images = [own.images(k, zero) for k in range(len(return_map.letters))]
        constants, gradients, _ = own.borders(zero)
        rows = np.array([slopes[0] for _, slopes, _ in images]), np.array([values[0] for values, *_ in images])
        return cls(return_map, scale, *rows, gradients[0], constants[0])

    def borders(self, states: Floats) -> Floats:
        """The functions at states, shape (N, B)."""
        return states @ self.gradients.T + self.constants

    def reach(self, orbit: PeriodicOrbit, k: int, slope: Floats, returns: int) -> float:
        """How far a segment from the state k of a cycle in a direction and its images by some returns do not pass a border."""
        found = np.inf
        for step in range(k, k + returns):
            here = step % len(orbit.states)
            values, rates = self.borders(orbit.states[here][None])[0], self.gradients @ slope
            towards = values * rates < 0
            found = min(found, float((-values[towards] / rates[towards]).min(initial=np.inf)))
            slope = orbit.returns.slopes[here] @ slope
        return found

    def mapped(self, lines: Lines) -> Lines:
        """The image, cut at borders; it ends at states without a piece."""
        cut = self._cut(lines)
        at = np.flatnonzero(cut.joined)
        found = self.map.first_return((cut.states[at] + cut.states[at + 1]) / 2)
        piece = np.array([self.map.letters.index(word) if word else -1 for word in found.words.tolist()], int)
        ends = np.stack([cut.states[at], cut.states[at + 1]], axis=1)[piece >= 0]
        at, piece = at[piece >= 0], piece[piece >= 0]
        images = np.einsum("mij,mkj->mki", self.matrices[piece], ends) + self.shifts[piece][:, None]
        follows = np.append(np.diff(at) == 1, False)
        near = (np.abs(images[:-1, 1] - images[1:, 0]) <= MEETS * self.scale).all(axis=1)
        meets = follows & np.append(near, False)
        kept = np.stack([np.ones(len(at), bool), ~meets], axis=1).ravel()  # an end that is the next beginning is left out
        return Lines(images.reshape(-1, 2)[kept], np.tile([True, False], len(at))[kept])

    def _cut(self, lines: Lines) -> Lines:
        """With a state wherever a segment passes a border."""
        values = self.borders(lines.states)
        values[np.abs(values) <= ON * np.linalg.norm(self.gradients * self.scale, axis=1)] = 0.0
        before, after = values[:-1], values[1:]
        at, border = np.nonzero((before * after < 0) & lines.joined[:-1, None])
        share = before[at, border] / (before[at, border] - after[at, border])
        new = lines.states[at] + share[:, None] * (lines.states[at + 1] - lines.states[at])
        place = np.append(np.arange(len(lines.states), dtype=float), at + share)
        order = np.argsort(place, kind="stable")
        states = np.concatenate([lines.states, new])[order]
        return Lines(states, np.append(lines.joined, np.ones(len(at), bool))[order])


def grown_exactly(
    pieces: Pieces, orbit: PeriodicOrbit, k: int, saddle: Saddle, length: float, max_points: int
) -> tuple[tuple[Floats, Floats, Ints, str], float]:
    """As `nsmaps.dynamics.manifolds.growth.grown` from the state k of a cycle, and how far the first image is off its segment."""
    state = orbit.states[k]
    along = saddle.slope * pieces.scale
    reach = min(pieces.reach(orbit, k, along, saddle.returns), length)
    ends = state + np.array([[reach / saddle.multiplier], [reach]]) * along
    image = Lines(ends, np.array([True, False]))
    whole = Lines(np.stack([state, ends[1]]), np.array([True, False]))
    error = np.inf
    while True:
        image = _returned(pieces, image, saddle.returns)
        if error == np.inf and len(image.states):
            error = float(np.linalg.norm((image.states[0] - ends[1]) / pieces.scale))
        arclength = _arclength(whole, pieces.scale)
        if arclength[-1] >= length or len(whole.states) >= max_points:
            return _until(whole, arclength, length, max_points), error
        if not len(image.states) or _arclength(image, pieces.scale)[-1] < POINT:
            why = "an attractor" if len(image.states) else "no state has an image"
            return (whole.states, arclength, _numbers(whole), why), error
        meets = (np.abs(image.states[0] - whole.states[-1]) <= MEETS * pieces.scale).all()
        joined = np.append(whole.joined[:-1], meets and image.joined[0]) if meets else whole.joined
        whole = Lines(np.concatenate([whole.states, image.states[int(meets) :]]), np.append(joined, image.joined[int(meets) :]))


def _returned(pieces: Pieces, lines: Lines, returns: int) -> Lines:
    for _ in range(returns):
        lines = pieces.mapped(lines)
    return lines


def _arclength(lines: Lines, scale: Floats) -> Floats:
    """Of each state from the first, shape (M,); gaps have no length."""
    steps = np.linalg.norm(np.diff(lines.states, axis=0) / scale, axis=1)
    return np.append(0.0, np.cumsum(np.where(lines.joined[:-1], steps, 0.0)))


def _numbers(lines: Lines) -> Ints:
    """The number of the line of each state."""
    return np.append(0, np.cumsum(~lines.joined[:-1])).astype(np.int64)


def _until(lines: Lines, arclength: Floats, length: float, max_points: int) -> tuple[Floats, Floats, Ints, str]:
    """The first states, to a length, which a segment may pass, or to a number."""
    numbers, last = _numbers(lines), int(np.searchsorted(arclength, length))
    if last >= max_points:
        return lines.states[:max_points], arclength[:max_points], numbers[:max_points], f"{max_points} states"
    states, kept = lines.states[: last + 1].copy(), arclength[: last + 1].copy()
    share = (length - arclength[last - 1]) / (arclength[last] - arclength[last - 1])
    states[-1], kept[-1] = states[-2] + share * (states[-1] - states[-2]), length
    return states, kept, numbers[: last + 1], f"length {length:g}"
