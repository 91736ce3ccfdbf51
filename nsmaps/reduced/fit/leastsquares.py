"""Least squares in products of Chebyshev polynomials, via polynomials orthogonal on the data where that is needed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.errors import FitError
from nsmaps.reduced.fit.polymap import design

WELL_CONDITIONED = 1e4  #: condition up to which the problem is solved in Chebyshev products directly
ALIKE = 1e-8  #: least share of a monomial that must be independent of the previous ones on the data


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """One output's least squares problem, solved."""

    coefficients: Floats  #: (m,), of the Chebyshev products
    condition: float  #: of the problem that was solved
    leverage: Floats  #: (N,), leverage of each datum: the weight of its own value in the fit there, 0 to 1
    loss: float = 0.0  #: largest change at the data by the transformation back to Chebyshev products


class Design:
    """The Chebyshev products of exponents (m, n) at scaled states (N, n), factorised once for all outputs fitted there."""

    def __init__(self, exponents: Ints, scaled: Floats) -> None:
        self.exponents, self.scaled = exponents, scaled
        self.columns = design(exponents, scaled)
        self.q, self.r = np.linalg.qr(self.columns)
        self.leverage = _leverage(self.q)

    @cached_property
    def orthonormal(self) -> tuple[Floats, float]:
        """As `orthonormal`."""
        return orthonormal(self.exponents, self.scaled, self.columns)

    def solve(self, what: str, y: Floats) -> Solved:
        """The least squares solution for data y (N,).

        Raises a FitError, which begins with `what`, for data that do not distinguish the products.
        """
        cut = len(self.columns) * np.finfo(float).eps
        coefficients, _, rank, singular = np.linalg.lstsq(self.r, self.q.T @ y, rcond=cut)
        condition = float(singular[0] / max(singular[-1], np.finfo(float).tiny))
        plain = Solved(np.asarray(coefficients, float), condition, self.leverage)
        if condition <= WELL_CONDITIONED:
            return plain
        basis, new = self.orthonormal
        if new > ALIKE:
            fitted = basis @ (basis.T @ y)
            coefficients = np.asarray(np.linalg.lstsq(self.columns, fitted, rcond=cut)[0], float)
            loss = float(np.abs(self.columns @ coefficients - fitted).max())
            return Solved(coefficients, float(np.linalg.cond(basis)), _leverage(basis), loss)
        if rank < len(self.exponents):
            raise FitError(
                f"{what}: {len(y)} data points distinguish only {rank} of {len(self.exponents)} terms (they may lie on a curve, "
                "or one term is a sum of others); expected: data that fill an area, or fewer terms"
            )
        return plain


def orthonormal(exponents: Ints, scaled: Floats, columns: Floats) -> tuple[Floats, float]:
    """Polynomials (N, m) orthonormal on scaled data (N, n) that span the Chebyshev products `columns` of exponents (m, n).

    Each is a coordinate times an earlier one, minus its projection on the previous ones (Arnoldi's process, twice against
    rounding: Brubeck, Nakatsukasa and Trefethen, Vandermonde with Arnoldi, SIAM Rev. 63, 2021), so that no monomial of high
    degree is formed; where that product leaves the span, the Chebyshev product takes its place. Also returns the least share
    that was independent; where it is not above ALIKE the data do not determine the coefficients, and the process stops.
    """
    order = np.argsort(exponents.sum(axis=1), kind="stable")
    factors = _factors(exponents[order])
    basis, least = np.zeros(columns.shape), 1.0
    for at, k in enumerate(order):
        j, earlier = factors.get(at, (0, None))
        column = columns[:, k] if earlier is None else scaled[:, j] * basis[:, earlier]
        size = np.linalg.norm(column)
        for _ in range(2):
            column = column - basis[:, :at] @ (basis[:, :at].T @ column)
        least = min(least, float(np.linalg.norm(column) / size)) if size else 0.0
        if least <= ALIKE:
            break
        basis[:, at] = column / np.linalg.norm(column)
    return basis, least


def _factors(exponents: Ints) -> dict[int, tuple[int, int]]:
    """The coordinate and the earlier monomial of which each monomial of (m, n) is the product.

    With that coordinate all monomials up to this one have products that are no later, so that any sum of them has.
    """
    place = {tuple(each): at for at, each in enumerate(exponents.tolist())}
    factors: dict[int, tuple[int, int]] = {}
    for j, unit in enumerate(np.eye(exponents.shape[1], dtype=int)):
        products = [place.get(tuple(each), len(place)) for each in (exponents + unit).tolist()]
        latest = np.maximum.accumulate(products).tolist()
        factors |= {at: (j, k) for k, at in enumerate(products) if at == latest[k] < len(place)}
    return factors


def left_out(error: Floats, leverage: Floats) -> float:
    """The largest error at a point that is left out, e / (1 - leverage); infinite where a point alone decides its fit."""
    free = 1 - leverage
    return float(np.max(np.divide(error, free, out=np.full(len(error), np.inf), where=free > ALIKE)))


def _leverage(basis: Floats) -> Floats:
    """The leverage of each datum, from an orthonormal basis (N, m): shape (N,)."""
    return np.asarray((basis**2).sum(axis=1), float)
