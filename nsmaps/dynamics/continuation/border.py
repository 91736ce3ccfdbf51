"""The other side of a border that a periodic orbit meets: the pieces of the map there, and their orbits on either side.

A piece is known by returns of other words, or by a derivative or an image that jumps where words do not change. The orbits that
it has a little before the border and beyond it are found by Newton's method and decide. Where none is found, as at some grazes,
the signs of det(1 - J) and det(1 + J) on either side state what becomes of the orbit. They are those of (-1)^n with the number n
of real multipliers above 1, and below -1: M. di Bernardo, M. I. Feigin, S. J. Hogan, M. E. Homer, Chaos Solitons Fractals 10
(1999) 1881.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.exponents.growth import product_of
from nsmaps.dynamics.motion import rotations
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.dynamics.returnmap import map_or_reason
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

PERSISTENCE, NONSMOOTH_FOLD, WITH_DOUBLING = "persistence", "non-smooth fold", " with doubling"
GAP = "end at a gap"
DIRECTIONS = 64  #: in which states beside the orbit are tried
BESIDE = (1e-7, 1e-6, 1e-5, 1e-8, 1e-9)  #: their distances, in scales of the coordinates, until another piece is found
NEAR = 30.0  #: times the root of their distance: images that are those of a continuous map
KINK = 0.01  #: share of the largest entry, by which a derivative jumps from one piece to another of the same words
REAL = 1e-9  #: share of a multiplier that the imaginary part of a real one does not exceed
AWAY = 1e-6  #: distance from a border, in the parameter's range, at which orbits of the other pieces are looked for
GUESSES, PIECES = 4, 8  #: starts of Newton's method for each piece; greatest number of pieces

Multipliers = NDArray[np.complex128]


@dataclass(slots=True, eq=False)
class Piece:
    """A piece of the map next to an orbit: cycles with a return of it, as guesses, the multipliers of these, and its jump."""

    guesses: list[Floats] = field(default_factory=list)  #: each of shape (p, n)
    mirrored: list[Floats] = field(default_factory=list)  #: own orbits on the other side of the border, each of shape (q, n)
    multipliers: list[Multipliers] = field(default_factory=list)
    jump: float = 0.0  #: largest difference of the derivatives of a cycle


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """What is next to an orbit: the pieces to which the map passes continuously, and whether it jumps, or words change."""

    pieces: tuple[Piece, ...] = ()
    jumps: bool = False
    words: bool = False
    passes: bool = False  #: whether an event passes the instant of the section, by which a state jumps, and the motion does not

    def __bool__(self) -> bool:
        return self.jumps or bool(self.pieces)


def border_beside(curve: OrbitCurve, point: OrbitPoint, graze: bool, beyond: float = 0.0) -> Border:
    """The border next to an orbit, by states at the first of some distances at which there is another piece.

    At a graze pieces are known by words alone: the derivative of the own one is not bounded.

    Args:
        beyond: 1 or -1, to try states at values of the parameter at these distances in this direction: there is the border of all
            states at once, as where a threshold passes the section; 0 for the value of the orbit alone.
    """
    maps = ((distance, map_or_reason(curve.map_of, point.value + beyond * distance * curve.unit)[0]) for distance in BESIDE)
    found = (beside(curve, point, there, distance, kinks=not graze) for distance, there in maps if there is not None)
    return next(filter(None, found), Border())


def border_type(curve: OrbitCurve, found: Border, point: OrbitPoint, value: float, beyond: float, graze: bool) -> str:
    """What becomes of an orbit at the border next to it, "" where that is not known, as where a motion leaves the section.

    `persistence`: one orbit becomes the other as the parameter passes; `non-smooth fold`: both are on the same side and end on
    one another; either `with doubling` where a cycle of twice the period, with both words, begins there; `end at a gap`: the map
    jumps, and no orbit takes over. Doubling is not stated at a `graze`, where the derivative need not have a limit, nor is a gap.

    Args:
        value: of the parameter at the border.
        beyond: 1 or -1, the direction of the parameter in which the orbit does not exist.
    """
    before, after = (_orbits(curve, found, point, value + sign * AWAY * curve.unit, not graze) for sign in (-beyond, beyond))
    only = {words for words in before if words not in after}, {words for words in after if words not in before}
    if any(only):
        doubles = not graze and any(_doubles(curve, found, value + sign * AWAY * curve.unit) for sign in (-1, 1))
        return (NONSMOOTH_FOLD if only[0] else PERSISTENCE) + WITH_DOUBLING * doubles
    if found.jumps and not graze:
        return GAP
    return _by_signs(found, point, graze)


def _by_signs(border: Border, point: OrbitPoint, graze: bool) -> str:
    """The type by the multipliers on either side, "" where those of the other side do not agree."""
    largest = max((piece.jump for piece in border.pieces), default=0.0)
    jumping = [piece for piece in border.pieces if piece.jump >= largest / 2]
    signs = {tuple(number % 2 for number in counts(values)) for piece in jumping for values in piece.multipliers}
    if len(signs if not graze else {above for above, _ in signs}) != 1:
        return ""
    (above, below), (own_above, own_below) = next(iter(signs)), counts(point.orbit.multipliers)
    doubles = not graze and (below + own_below) % 2 == 1
    return (NONSMOOTH_FOLD if (above + own_above) % 2 else PERSISTENCE) + WITH_DOUBLING * doubles


def counts(multipliers: Multipliers) -> tuple[int, int]:
    """The number of real multipliers above 1, and of those below -1."""
    real = multipliers[np.abs(multipliers.imag) <= REAL * np.abs(multipliers)].real
    return int((real > 1).sum()), int((real < -1).sum())


def _orbits(curve: OrbitCurve, border: Border, point: OrbitPoint, value: float, kinks: bool) -> set[tuple[str, ...]]:
    """The words of orbits beside a border, at a value of the parameter, that have a return of another piece."""
    return_map, found, own = map_or_reason(curve.map_of, value)[0], set[tuple[str, ...]](), _cyclic(point.orbit)
    if return_map is None:
        return found
    for piece in border.pieces:
        for guess in piece.guesses:
            orbit = _near(curve, return_map, guess)
            if orbit is not None and (_cyclic(orbit) != own or (kinks and _kinked(curve, orbit, point.orbit))):
                found.add(_cyclic(orbit))
                break
    return found


def _doubles(curve: OrbitCurve, border: Border, value: float) -> bool:
    """True if there is a cycle, at a value of the parameter, that makes once the own returns and once those of another piece."""
    return_map, q = map_or_reason(curve.map_of, value)[0], curve.period
    if return_map is None:
        return False
    for piece in border.pieces:
        for guess, own in zip(piece.guesses, piece.mirrored, strict=True):
            orbit = _near(curve, return_map, np.concatenate([own, guess]))
            if orbit is not None and not (len(guess) == q and _same(curve, orbit.states[:q], orbit.states[q:])):
                return True
    return False


def _same(curve: OrbitCurve, one: Floats, other: Floats) -> bool:
    """True for two cycles of states that agree as far as their residuals allow."""
    return bool(curve.coordinates.near(one, other, max(curve.tolerance, 1e-3 * AWAY), curve.scale).all())


def _near(curve: OrbitCurve, return_map: ReturnMap, guess: Floats) -> PeriodicOrbit | None:
    """The orbit to which Newton's method leads from a guess, if it is one and near."""
    orbit = periodic_orbit(return_map, guess, len(guess), tolerance=curve.tolerance, scale=curve.scale)
    near = curve.coordinates.near(orbit.states, guess, NEAR * np.sqrt(AWAY), curve.scale).all()
    return orbit if orbit.converged and orbit.exists and near else None


def _cyclic(orbit: PeriodicOrbit) -> tuple[str, ...]:
    """The words of an orbit, from the return on with which they are first in the alphabet."""
    return min(rotations(orbit.words))


def _kinked(curve: OrbitCurve, orbit: PeriodicOrbit, own: PeriodicOrbit) -> bool:
    """True if the derivative along an orbit differs from that along another one as from piece to piece."""
    one, other = (scaled(curve, each.derivative) for each in (orbit, own))
    return bool(np.abs(one - other).max() > KINK * (1 + np.abs(other).max()))


def scaled(curve: OrbitCurve, derivatives: Floats) -> Floats:
    """Derivatives in units of the scale of the coordinates."""
    return derivatives * curve.scale / curve.scale[:, None]


def beside(curve: OrbitCurve, point: OrbitPoint, return_map: ReturnMap, distance: float, kinks: bool) -> Border:
    """The pieces of the map to which states at this distance beside an orbit belong.

    Where only the letter differs with which a return arrives, the derivative is that of the orbit: no other piece is entered.
    """
    returns, q = point.orbit.returns, curve.period
    assert returns.derivative is not None
    steps = np.random.default_rng(0).normal(size=(DIRECTIONS, returns.start.shape[1]))
    steps *= distance * curve.scale / np.linalg.norm(steps, axis=1)[:, None]
    pieces, jumps, words, passes = dict[tuple[int, ...], Piece](), False, False, False
    for k in range(q):
        tried = return_map.first_return(curve.coordinates.wrap(returns.start[k] + steps), derivative=True)
        own = product_of([returns.derivative[j % q] for j in range(k, k + q)])
        joining = _Joining(curve, return_map, returns, k, tried, NEAR * np.sqrt(distance), kinks)
        jumps, words = jumps or joining.jumps, words or bool((tried.codes != returns.codes[k])[tried.valid].any())
        passes = passes or bool(joining.passed.any())
        for row, states, derivative, ahead in joining.rows():
            whole = product_of([derivative, *(returns.derivative[j % q] for j in range(k + ahead, k + q))])
            kind = k, ahead, len(states), int(tried.codes[row])
            if kind not in pieces and len(pieces) == PIECES:
                continue
            piece = pieces.setdefault(kind, Piece())
            piece.jump = max(piece.jump, float(np.abs(whole - own).max()))
            piece.multipliers.append(np.linalg.eigvals(whole).astype(complex))
            if len(piece.guesses) < GUESSES:
                others = returns.start[[j % q for j in range(k + ahead, k + q)]]
                piece.guesses.append(np.concatenate([states, others]))
                mirror = returns.start[[j % q for j in range(k, k + q)]]
                mirror[0] -= steps[row]
                piece.mirrored.append(mirror)
    return Border(tuple(pieces.values()), jumps, words, passes)


class _Joining:
    """How returns from beside the state k of an orbit come back to it by another piece: at once, late, or by two returns.

    They are one return in place of one, of two where an impact at the section is missed, or two in place of one; of two they
    take the time, which a jump to another state does not. Or they are two in place of two, as where an event passes the instant
    at which the section is: the state between jumps, to one on the same motion.
    """

    def __init__(
        self, curve: OrbitCurve, return_map: ReturnMap, orbit: Returns, k: int, tried: Returns, near: float, kinks: bool
    ) -> None:
        q, n = len(orbit), orbit.start.shape[1]
        self.tried, self.second = tried, return_map.first_return(tried.image, derivative=True)
        assert orbit.derivative is not None
        assert tried.derivative is not None

        def close(images: Floats, ahead: int) -> Bools:
            return agree(images, orbit.start[(k + ahead) % q], near)

        def agree(images: Floats, others: Floats, near: float) -> Bools:
            return np.asarray((np.abs(curve.coordinates.difference(images, others) / curve.scale) <= near).all(axis=1))

        def takes(times: Floats, ahead: int) -> Bools:
            off = times - orbit.time[[(k + j) % q for j in range(ahead)]].sum()
            return np.asarray(~(np.abs(off) > near * orbit.time.sum()))

        with np.errstate(invalid="ignore"):
            off = np.abs(scaled(curve, tried.derivative - orbit.derivative[k])).reshape(len(tried), n * n).max(axis=1)
            kinked = off > KINK * (1 + np.abs(scaled(curve, orbit.derivative[k])).max())
            other, one = (tried.codes != orbit.codes[k]) | (kinked & kinks), close(tried.image, 1)
            self.one = one & other
            self.two = ~one & close(tried.image, 2) & takes(tried.time, 2) if q > 1 else np.zeros_like(one)
            self.more = ~one & ~self.two & self.second.valid & close(self.second.image, 1)
            self.more &= takes(tried.time + self.second.time, 1)
            self.passed = ~one & ~self.two & ~self.more & self.second.valid & takes(tried.time + self.second.time, 2)
            slopes = [np.abs(scaled(curve, orbit.derivative[(k + j) % q])).sum(axis=1).max() for j in (0, 1)]
            others = tried.image if q == 1 else orbit.start[(k + 2) % q]
            self.passed &= agree(self.second.image, others, near**2 / NEAR * (1 + slopes[0]) * (1 + slopes[1]))
        self.jumps = bool((tried.valid & ~one & ~self.two & ~self.more & ~self.passed).any())
        self.alone = q == 1

    def rows(self) -> Iterator[tuple[int, Floats, Floats, int]]:
        """Their numbers, the states up to there, the derivatives, and by how many returns of the orbit they come back to it."""
        tried, slopes, further = self.tried, self.tried.derivative, self.second.derivative
        assert slopes is not None
        assert further is not None
        for rows, ahead in ((self.one, 1), (self.two, 2)):
            yield from ((int(row), tried.start[row][None], slopes[row], ahead) for row in np.flatnonzero(rows))
        for rows, ahead in ((self.more, 1), (self.passed, 2)):
            for row in np.flatnonzero(rows).tolist():
                if ahead == 2 and self.alone:
                    yield row, tried.image[row][None], further[row], 1
                else:
                    yield row, np.array([tried.start[row], tried.image[row]]), further[row] @ slopes[row], ahead
