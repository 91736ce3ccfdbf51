"""The stable or unstable manifold of a saddle of a planar return map, grown to an arclength."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.exponents.growth import product_of
from nsmaps.dynamics.manifolds.growth import Growth, grown
from nsmaps.dynamics.manifolds.local import Saddle, local_curve
from nsmaps.dynamics.manifolds.segments import Pieces, grown_exactly
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.progress import shows
from nsmaps.results import NONE, Result, array, units_of

REAL = 1e-9  #: share of a multiplier that the imaginary part of a real one does not exceed
INVERSE = 1e-6  #: largest difference, in units of the scale, of a saddle from its image by the map and then by its inverse
Which = Literal["unstable", "stable"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Manifold(WithCoordinates, Result):
    """One manifold of a saddle of q returns: two sides at each of its q states, N states in all, side after side."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.manifolds"

    coordinates: Coordinates
    which: Which
    saddle: Floats = field(metadata=array("return coordinate", "states of the saddle, of which one returns to the next"))
    multiplier: float  #: of the saddle along the manifold, of q returns
    states: Floats = field(metadata=array("state coordinate", "states of the manifold, side after side; angles in [0, 2 pi)"))
    arclength: Floats = field(
        metadata=array("state", "length from the saddle along the side, in units of the scale; jumps have no length", NONE)
    )
    side: Ints = field(
        metadata=array("state", "number of the side, from 0: sides 2 k and 2 k + 1 begin at state k of the saddle", NONE)
    )
    piece: Ints = field(metadata=array("state", "number of the piece of the side, from 0: a curve without a jump", NONE))
    scale: Floats = field(metadata=array("coordinate", "units of arclength and gap: those of the saddle, a radian of an angle"))
    gap: float  #: largest distance of neighbours on a piece; infinity where pieces are polygons, with these as corners
    error: float  #: the largest distance of the ends of the local curves from their images: an estimate of their error
    ended: tuple[str, ...]  #: the reason why each side ends
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates, by name

    def summary(self) -> str:
        """The saddle, and how much was grown from it."""
        about = f"{self.which} manifold of a saddle of {len(self.saddle)} returns, multiplier {self.multiplier:.6g}"
        return f"{about}: {len(self.states)} states, {len(self.lines)} pieces"

    @property
    def lines(self) -> list[Floats]:
        """The states of each piece, shape (K, 2), those of a side in order; angles continued, not wrapped."""
        starts = np.flatnonzero((np.diff(self.side) != 0) | (np.diff(self.piece) != 0)) + 1
        return [self._continued(part) for part in np.split(self.states, starts) if len(part)]

    def _continued(self, states: Floats) -> Floats:
        steps = self.coordinates.difference(states[1:], states[:-1])
        return np.concatenate([states[:1], states[:1] + np.cumsum(steps, axis=0)])


@shows
def manifold(
    system: ReturnMap,
    orbit: PeriodicOrbit,
    which: Which = "unstable",
    *,
    length: float = 10.0,
    gap: float = 0.02,
    inverse: ReturnMap | None = None,
    max_points: int = 100_000,
) -> Manifold:
    """The stable or unstable manifold of a saddle of a planar map, both sides at each state, to an arclength.

    Neighbours on a piece are at most `gap` from each other. A manifold is cut where the map jumps: the word of a return changes
    between two neighbours and both sides of the change, bisected to rounding, differ by more than a hundredth of the gap; or
    neighbours of one word remain at a larger distance than `gap`. It is cut too where there is no image, and at states that
    stick, of which all images are one. A jump and back between two neighbours of one word is missed.

    Of a map whose pieces and borders are affine a manifold is a polygon, found exactly but for rounding: its segments are mapped
    by their ends and cut at borders, and `gap` is not used.

    The stable manifold is the unstable one of the inverse. An impact system with a restitution above zero on every wall has one:
    the same system in reversed time; so has a system with modes that do not slide, whose resets are affine and can be inverted.
    States that reach the saddle after a chatter or rest are not on it. A map given by formulas
    has that of `PiecewiseMap.inverse`, of several preimages the one in the first piece. Other maps need an `inverse`.

    Args:
        system: with two coordinates.
        orbit: a saddle: one multiplier within the unit circle, one beyond it.
        which: "unstable" or "stable".
        length: of each side, in units of the manifold's `scale`.
        gap: largest distance of neighbours, in the same units.
        inverse: the inverse of the map, for the stable manifold of a map that is neither a system's nor given by formulas.
        max_points: largest number of states of a side.

    Raises:
        NsmapsError: not two coordinates, an orbit that is not a saddle, no inverse, or lengths that are not positive.
    """
    _check(system, orbit, which, length, gap, max_points)
    scale = orbit.scale
    grow = (length, gap, max_points)
    if which == "unstable":
        return _unstable(system, orbit, scale, *grow)
    inverse = system.inverse() if inverse is None else inverse
    if inverse is None:
        raise NsmapsError(
            f"the stable manifold of a {type(system).__name__} needs its inverse, which is not known; expected: `inverse`"
        )
    return _stable(_unstable(inverse, _reversed_orbit(inverse, orbit, scale), scale, *grow), orbit)


def _unstable(return_map: ReturnMap, orbit: PeriodicOrbit, scale: Floats, length: float, gap: float, max_points: int) -> Manifold:
    """The unstable manifold, in a scale."""
    sides = [(k, sign) for k in range(len(orbit.states)) for sign in (1.0, -1.0)]
    saddles = [_saddle(orbit, k, sign, scale) for k, sign in sides]
    starts = [(k, saddle) for (k, _), saddle in zip(sides, saddles, strict=True)]
    if return_map.is_affine:
        pieces, gap = Pieces.of(PiecewiseMap.require(return_map, "affine pieces"), scale), np.inf
        found = [grown_exactly(pieces, orbit, k, saddle, length, max_points) for k, saddle in starts]
        parts, errors = [part for part, _ in found], [off for _, off in found]
    else:
        curves = [local_curve(return_map, orbit.states[k], saddle, scale) for k, saddle in starts]
        parts = [grown(Growth(return_map, curve, length, gap, max_points)) for curve in curves]
        errors = [curve.error for curve in curves]
    states, arclength, piece = (np.concatenate([part[k] for part in parts]) for k in range(3))
    side = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
    error, ended = max(errors), tuple(part[3] for part in parts)
    multiplier, coordinates = float(orbit.multipliers[0].real), orbit.returns.coordinates
    about = states, arclength, side, piece, scale, gap, error, ended, units_of(return_map)
    return Manifold(coordinates, "unstable", orbit.states, multiplier, *about)


def _saddle(orbit: PeriodicOrbit, k: int, sign: float, scale: Floats) -> Saddle:
    """The start of one side at the state k."""
    assert orbit.returns.derivative is not None
    product = product_of(np.roll(orbit.returns.derivative, -k, axis=0))
    values, vectors = np.linalg.eig(product * scale / scale[:, None])
    at = int(np.abs(values).argmax())
    value, slope = float(values[at].real), vectors[:, at].real
    slope = sign * slope / np.linalg.norm(slope) * np.copysign(1.0, slope[np.abs(slope).argmax()])
    if value > 0:
        return Saddle(slope, value, len(orbit.states), product)
    return Saddle(slope, value**2, 2 * len(orbit.states), product @ product)


def _reversed_orbit(inverse: ReturnMap, orbit: PeriodicOrbit, scale: Floats) -> PeriodicOrbit:
    """The saddle of the inverse; NsmapsError where it has none there."""
    guess = np.roll(orbit.states[::-1], 1, axis=0)
    found = periodic_orbit(inverse, Coordinates(inverse.coordinates).wrap(guess), len(orbit.states), scale=scale)
    off = np.abs(found.returns.coordinates.difference(found.states, guess) / scale).max()
    if not (found.converged and off <= INVERSE):
        raise NsmapsError(f"the inverse does not lead back along the saddle {orbit.states.tolist()}; expected: the map's inverse")
    return found


def _stable(found: Manifold, orbit: PeriodicOrbit) -> Manifold:
    """The unstable manifold of the inverse as the stable one of the map, whose states k follow one another the other way."""
    q = len(orbit.states)
    names = found.side // 2, found.side % 2
    side = 2 * ((q - names[0]) % q) + names[1]
    order = np.argsort(side, kind="stable")
    return replace(
        found,
        which="stable",
        saddle=orbit.states,
        multiplier=float(orbit.multipliers[-1].real),
        states=found.states[order],
        arclength=found.arclength[order],
        side=side[order],
        piece=found.piece[order],
        ended=tuple(found.ended[2 * ((q - k // 2) % q) + k % 2] for k in range(2 * q)),
    )


def _check(return_map: ReturnMap, orbit: PeriodicOrbit, which: str, length: float, gap: float, max_points: int) -> None:
    """Refuse what has no such manifold."""
    n = len(ReturnMap.require(return_map, "a manifold").coordinates)
    if n != 2:
        raise NsmapsError(f"the map has {n} coordinates; expected: two, in which a manifold of a saddle is a curve")
    if not (0 < gap < np.inf and 0 < length < np.inf and max_points >= 2):
        raise NsmapsError(f"length {length:g}, gap {gap:g}, {max_points} states; expected: positive lengths, two states or more")
    values = orbit.multipliers
    real = (np.abs(values.imag) <= REAL * np.abs(values)).all()
    if not (orbit.converged and real and abs(values[1]) < 1 - REAL < 1 + REAL < abs(values[0])):
        shown = ", ".join(f"{value:.6g}" for value in values)
        state = "" if orbit.converged else ", and it has not converged"
        raise NsmapsError(
            f"the orbit has the multipliers {shown}{state}; expected: a saddle, one below 1 and one above 1 in size"
        )
