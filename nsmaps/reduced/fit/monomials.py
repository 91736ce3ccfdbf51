"""Plain monomials and Chebyshev products of scaled coordinates, from one to the other in exact arithmetic."""

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints

Exacts = NDArray[np.object_]  # of Fractions


def paper_order(exponents: Iterable[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Exponents by total degree, then falling degree of the last coordinate, as the paper writes them (eq. cubic2dv).

    >>> paper_order([(1, 0), (0, 0), (0, 1), (2, 0), (1, 1), (0, 2)])
    [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0)]
    """
    return sorted(exponents, key=lambda key: (sum(key), tuple(-e for e in reversed(key))))


def has_lower(exponents: Ints) -> Bools:
    """For each of k variables, whether with each row of exponents (m, k) there is that of one degree less in it: shape (k,)."""
    rows = {tuple(row) for row in exponents.tolist()}
    lower = [(exponents - step)[exponents @ step > 0].tolist() for step in np.eye(exponents.shape[1], dtype=int)]
    return np.array([all(tuple(row) in rows for row in each) for each in lower], bool)


def changed(tensor: Exacts, centre: Floats, scale: Floats, basis: Callable[[int, Fraction, Fraction], Exacts]) -> Exacts:
    """Coefficients by exponents in another basis, whose row k contains the k-th polynomial of the old one, exactly."""
    for j, size in enumerate(tensor.shape):
        rows = basis(size, Fraction(float(centre[j])), Fraction(float(scale[j])))
        tensor = np.moveaxis(np.tensordot(tensor, rows, axes=(j, 0)), -1, j)
    return tensor


def in_powers(size: int, centre: Fraction, scale: Fraction) -> Exacts:
    """The plain coefficients of T_k((x - centre) / scale): shape (size, size), row k for T_k."""
    rows = np.full((size, size), Fraction(0), object)
    rows[0, 0] = Fraction(1)
    if size > 1:
        rows[1, 0], rows[1, 1] = -centre / scale, 1 / scale
    for k in range(2, size):
        shifted = np.concatenate([[Fraction(0)], rows[k - 1, :-1]])
        rows[k] = 2 * (shifted - centre * rows[k - 1]) / scale - rows[k - 2]
    return rows


def in_chebyshev(size: int, centre: Fraction, scale: Fraction) -> Exacts:
    """The Chebyshev coefficients of x^k = (centre + scale s)^k: shape (size, size), row k for x^k, by 2 s T_j = T_j+1 + T_j-1."""
    rows = np.full((size, size), Fraction(0), object)
    rows[0, 0] = Fraction(1)
    for k in range(1, size):
        half = scale * rows[k - 1] / 2
        rows[k] = centre * rows[k - 1]
        rows[k, 1:] += half[:-1]
        rows[k, :-1] += half[1:]
        rows[k, 1] += half[0]  # s T_0 is T_1 whole
    return rows


def dense_exactly(terms: Mapping[tuple[int, ...], Fraction], n: int) -> Exacts:
    """Coefficients by exponents as one array, shape (degree + 1 of each coordinate)."""
    tensor = np.full(np.max([(0,) * n, *terms], axis=0) + 1, Fraction(0), object)
    for key, value in terms.items():
        tensor[key] = value
    return tensor


def terms_of(tensor: Exacts) -> dict[tuple[int, ...], Fraction]:
    """The coefficients that are not zero, in the paper's order."""
    return {key: tensor[key] for key in paper_order(k for k, value in np.ndenumerate(tensor) if value)}
