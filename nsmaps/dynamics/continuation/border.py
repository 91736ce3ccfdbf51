"""The other side of a border that a periodic orbit meets, where its words change: Feigin's classification.

Where the derivative of the map jumps, the signs of det(1 - J) and det(1 + J) on either side state what becomes of the orbit. They
are those of (-1)^n with the number n of real multipliers above 1, and below -1: M. di Bernardo, M. I. Feigin, S. J. Hogan, M. E.
Homer, Chaos Solitons Fractals 10 (1999) 1881.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

PERSISTENCE, NONSMOOTH_FOLD, WITH_DOUBLING = "persistence", "non-smooth fold", " with doubling"
DIRECTIONS = 64  #: in which states beside the orbit are tried
BESIDE = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5)  #: their distances, in scales of the coordinates
NEAR = 30.0  #: times the root of their distance: images that are those of a continuous map
REAL = 1e-9  #: share of a multiplier that the imaginary part of a real one does not exceed

Multipliers = NDArray[np.complex128]


def border_type(curve: OrbitCurve, point: OrbitPoint, graze: bool) -> str:
    """What becomes of an orbit at the border next to it, "" where no orbit of other words is found beside it.

    `persistence`: one orbit becomes the other as the parameter passes; `non-smooth fold`: both are on the same side and end on
    one another; either `with doubling` where a cycle of twice the period, with both words, begins there. The last is not stated
    at a `graze`, where the derivative need not have a limit.
    """
    there = curve.map_of(point.value)
    found = next(filter(None, (beside(curve, point, there, distance) for distance in BESIDE)), None)
    if found is None:
        return ""
    (above, below), _ = Counter(map(counts, found)).most_common(1)[0]
    own_above, own_below = counts(point.orbit.multipliers)
    doubles = not graze and (below + own_below) % 2 == 1
    return (NONSMOOTH_FOLD if (above + own_above) % 2 else PERSISTENCE) + WITH_DOUBLING * doubles


def counts(multipliers: Multipliers) -> tuple[int, int]:
    """The number of real multipliers above 1, and of those below -1."""
    real = multipliers[np.abs(multipliers.imag) <= REAL * np.abs(multipliers)].real
    return int((real > 1).sum()), int((real < -1).sum())


def beside(curve: OrbitCurve, point: OrbitPoint, map: ReturnMap, distance: float) -> list[Multipliers]:
    """The multipliers of the orbit with one return replaced by one with other words, of states at this distance beside.

    Where only the letter differs with which a return arrives, its derivative is that of the orbit: those that jump most are kept.
    """
    returns, q = point.orbit.returns, curve.period
    assert returns.derivative is not None
    steps = np.random.default_rng(0).normal(size=(DIRECTIONS, returns.start.shape[1]))
    steps *= distance * curve.scale / np.linalg.norm(steps, axis=1)[:, None]
    found: list[tuple[float, Multipliers]] = []
    for k in range(q):
        tried = map.first_return(curve.coordinates.wrap(returns.start[k] + steps), derivative=True)
        own = _product([returns.derivative[j % q] for j in range(k, k + q)])
        for derivative, ahead in _rejoining(curve, map, returns, k, tried, NEAR * np.sqrt(distance)):
            whole = _product([derivative, *(returns.derivative[j % q] for j in range(k + ahead, k + q))])
            found.append((float(np.abs(whole - own).max()), np.linalg.eigvals(whole).astype(complex)))
    largest = max((jump for jump, _ in found), default=0.0)
    return [values for jump, values in found if jump >= largest / 2]


def _product(derivatives: Sequence[Floats]) -> Floats:
    """The derivative of successive returns."""
    return reduce(lambda so_far, each: each @ so_far, derivatives)


def _rejoining(
    curve: OrbitCurve, map: ReturnMap, orbit: Returns, k: int, tried: Returns, near: float
) -> Iterator[tuple[Floats, int]]:
    """Derivatives of returns from beside the state k that come back to the orbit by other words, and by how many returns of it.

    They are one return in place of one, of two where an impact at the section is missed, or two in place of one.
    """
    q, tried = len(orbit), tried.select(tried.valid)
    second = map.first_return(tried.image, derivative=True)
    assert tried.derivative is not None
    assert second.derivative is not None

    def close(images: Floats, ahead: int) -> Bools:
        off = curve.coordinates.difference(images, orbit.start[(k + ahead) % q]) / curve.scale
        return np.asarray((np.abs(off) <= near).all(axis=1))

    one = close(tried.image, 1)
    two = ~one & close(tried.image, 2) if q > 1 else np.zeros_like(one)
    more = ~one & ~two & second.valid & close(second.image, 1)
    yield from ((each, 1) for each in tried.derivative[one & (tried.codes != orbit.codes[k])])
    yield from ((each, 2) for each in tried.derivative[two])
    yield from ((each, 1) for each in second.derivative[more] @ tried.derivative[more])
