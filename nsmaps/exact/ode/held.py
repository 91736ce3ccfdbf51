"""When the force of a wall lets a ball go that is held at it: the phases at which it begins and ceases to press."""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
from numpy.polynomial.chebyshev import Chebyshev

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import TWO_PI

DEGREE = 32
ROUNDING = 1e-14  #: of a series, relative to its terms
RESIDUAL = 1e-12  #: of a series between its nodes, likewise
REAL = 1e-7  #: of a root, in units of the piece: a double one is lost to rounding by its root
NEAR = 1e-12  #: of a root to an end of a piece, in units of the piece
FIRST_PIECES = 16  #: of a turn, of which each is looked at: a pulse of the force that is shorter than their nodes is not seen
PIECES = 2**12  #: at most, of a turn: finer forces are rounding


def pressing(force: Callable[[Floats], Floats]) -> Floats:
    """The phases between which a force, a smooth function of the phase, is positive, shape (K, 2).

    Intervals begin in [0, 2 pi) and may end on the next turn; one from 0 to infinity stands for all phases.
    """
    ends = np.linspace(0.0, TWO_PI, FIRST_PIECES + 1).tolist()
    found = np.array(sorted(root for part in pairwise(ends) for piece in _pieces(force, *part) for root in _roots(piece)))
    found = found[np.diff(found, prepend=-np.inf) > NEAR * TWO_PI]  # one at an end of a piece is found in both neighbours
    if not len(found):
        return np.array([[0.0, np.inf]])[: int(force(np.zeros(1))[0] > 0)]
    ends = np.append(found, found[0] + TWO_PI)
    positive = force((ends[:-1] + ends[1:]) / 2) > 0
    if positive.all():
        return np.array([[0.0, np.inf]])
    begins = positive & ~np.roll(positive, 1)
    return np.array([(ends[k], _end(ends, positive, k)) for k in np.flatnonzero(begins).tolist()]).reshape(-1, 2)


def _end(ends: Floats, positive: Bools, k: int) -> float:
    """The end of the pressing that begins with interval k."""
    n = len(positive)
    while positive[k % n]:
        k += 1
    return float(ends[k % n] + TWO_PI * (k // n))


def _pieces(force: Callable[[Floats], Floats], low: float, high: float) -> Iterator[Chebyshev]:
    """Series of the force over parts of an interval, each exact to rounding."""
    series = Chebyshev.interpolate(force, DEGREE, domain=[low, high])
    size = np.abs(series.coef).sum()
    between = low + (high - low) * (np.arange(DEGREE) + 0.5) / DEGREE
    seen = np.abs(force(between) - series(between)).max() <= RESIDUAL * size
    if (seen and np.abs(series.coef[-3:]).max() <= ROUNDING * size) or high - low < TWO_PI / PIECES:
        yield series
    else:
        yield from _pieces(force, low, (low + high) / 2)
        yield from _pieces(force, (low + high) / 2, high)


def _roots(series: Chebyshev) -> Floats:
    """The real roots of a series in its domain, ends included."""
    low, high = series.domain
    if 2 * abs(series.coef[0]) > np.abs(series.coef).sum():
        return np.empty(0)
    roots = series.trim(ROUNDING * np.abs(series.coef).sum()).roots()
    real = roots.real[np.abs(roots.imag) <= REAL * (high - low)]
    slack = NEAR * (high - low)
    return real[(real >= low - slack) & (real <= high + slack)]
