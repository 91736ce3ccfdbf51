"""Polynomial maps in scaled Chebyshev products, and the report on their fit."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, Ints, brief
from nsmaps.coordinates import BoxLike, Coordinates, WithCoordinates, as_box, as_states
from nsmaps.errors import FitError, near_match

if TYPE_CHECKING:
    import sympy as sp

Exacts = NDArray[np.object_]  # of Fractions

ROWS, FLOATS = 2**14, 2**21  #: states evaluated at a time, to stay in the cache, and their number of floats


@dataclass(frozen=True, slots=True, eq=False)
class FitReport(WithCoordinates):
    """The errors of the polynomials of a map at the data of their fit; arrays have one entry per output."""

    coordinates: Coordinates
    r2: Floats  #: shape (n,), 1 - SSE/SST as in table TableDeltaErr; NaN where the data do not vary
    sse: Floats  #: shape (n,), the sum of squared errors
    max_error: Floats  #: shape (n,), the largest error at a data point
    condition: Floats  #: shape (n,), condition number of the least squares problem that was solved
    points: Ints  #: shape (n,), data points used
    terms: Ints  #: shape (n,), coefficients fitted
    left_out: Floats  #: shape (n,), the largest error at a data point when it alone is left out of the fit (PRESS residual)
    loss: Floats  #: shape (n,), the largest change at a data point by the change from orthogonal to Chebyshev products
    warnings: tuple[str, ...] = ()  #: limitations of the figures

    def rows(self) -> list[dict[str, Any]]:
        """One row per output for a table, as plain numbers by name."""
        columns = ("r2", "sse", "max_error", "condition", "points", "terms")
        arrays = [getattr(self, name).tolist() for name in columns]
        rows = zip(self.coordinates, *arrays, strict=True)
        return [dict(zip(("output", *columns), row, strict=True)) for row in rows]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PolyMap(WithCoordinates):
    """A map whose coordinates are polynomials: sums of products of Chebyshev polynomials of (x - centre) / scale.

    An angle's image is not wrapped. The map is that of its formula everywhere: outside of `domain` it extrapolates.
    """

    __repr__ = brief

    coordinates: Coordinates
    exponents: tuple[Ints, ...]  #: for each output, shape (m, n): the degree of each coordinate in each term
    coefficients: tuple[Floats, ...]  #: for each output, shape (m,), of the Chebyshev products
    centre: Floats  #: shape (n,)
    scale: Floats  #: shape (n,)
    domain: Floats  #: shape (n, 2), the box of the data; infinite for a reset
    absolute: tuple[str, ...] = ()  #: outputs of which the absolute value is taken, eq. R5eqn
    report: FitReport | None = None

    @classmethod
    def reset(cls, coordinates: Sequence[str], values: Mapping[str, float]) -> "PolyMap":
        """The map that sets some coordinates to constants and preserves the others (step vi of the general algorithm)."""
        names = Coordinates(coordinates)
        for name in values:
            _index(name, names, "reset")
        n = len(names)
        exponents = tuple(np.zeros((1, n), int) if name in values else np.eye(n, dtype=int)[[i]] for i, name in enumerate(names))
        coefficients = tuple(np.array([float(values.get(name, 1.0))]) for name in names)
        return cls(names, exponents, coefficients, np.zeros(n), np.ones(n), np.tile([-np.inf, np.inf], (n, 1)))

    @classmethod
    def of_monomials(
        cls,
        coordinates: Sequence[str],
        monomials: Mapping[str, Mapping[tuple[int, ...], Fraction]],
        box: BoxLike,
        absolute: tuple[str, ...] = (),
    ) -> "PolyMap":
        """The map of plain monomials, each output's coefficients by their exponents, in Chebyshev products of a box.

        Conversion is in exact rational arithmetic with one rounding, so that cancellation on the box costs no digits.
        """
        names, domain = Coordinates(coordinates), as_box(box, coordinates)
        centre, scale = domain.mean(axis=1), np.ptp(domain, axis=1) / 2
        terms = [_terms(_changed(_dense_exactly(monomials[name], len(names)), centre, scale, _in_chebyshev)) for name in names]
        terms = [each or {(0,) * len(names): Fraction(0)} for each in terms]
        exponents = tuple(np.array(list(each), int) for each in terms)
        coefficients = tuple(np.array([float(value) for value in each.values()]) for each in terms)
        return cls(names, exponents, coefficients, centre, scale, domain, absolute)

    def over(self, box: BoxLike) -> "PolyMap":
        """The same polynomials in Chebyshev products of another box, each coefficient rounded once; without report."""
        monomials = {name: self.exact_monomials(name) for name in self.coordinates}
        return PolyMap.of_monomials(self.coordinates, monomials, box, self.absolute)

    def __call__(self, states: ArrayLike) -> Floats:
        """The images of states (N, n), shape (N, n); angles are not wrapped. NaN goes to NaN."""
        image = _evaluate(self._tensor(), self._scaled(states))
        return np.where(self._is_absolute(), np.abs(image), image)

    def derivative(self, states: ArrayLike) -> Floats:
        """The derivative d image_i / d x_j at states (N, n), shape (N, n, n); zero where an absolute value has its kink."""
        x, tensor = self._scaled(states), self._tensor()
        slopes = [np.asarray(chebder(tensor, axis=1 + j), float) / self.scale[j] for j in range(x.shape[1])]
        derivative = np.stack([_evaluate(slope, x) for slope in slopes], axis=2)
        if not self.absolute:
            return derivative
        signs = np.where(self._is_absolute(), np.sign(_evaluate(tensor, x)), 1.0)
        return np.asarray(derivative * signs[:, :, None], float)

    def monomials(self, output: str) -> dict[tuple[int, ...], float]:
        """The coefficients of the plain monomials of one output by their exponents, in the order of eq. cubic2dv.

        They are converted exactly and rounded once; but over a small box far from zero plain monomials cancel, so evaluate the
        map itself. For an absolute value these are the coefficients of its argument.
        """
        return {key: float(value) for key, value in self.exact_monomials(output).items()}

    def exact_monomials(self, output: str) -> dict[tuple[int, ...], Fraction]:
        """As `monomials`, not rounded: for closed forms that must agree with the map where plain monomials cancel."""
        i = _index(output, self.coordinates, "monomials")
        tensor = np.vectorize(Fraction, otypes=[object])(dense([self.exponents[i]], [self.coefficients[i]])[0])
        tensor = _changed(tensor, self.centre, self.scale, _in_powers)
        asked = set(map(tuple, self.exponents[i].tolist()))
        return {key: tensor[key] for key in paper_order(asked | set(_terms(tensor)))}

    def monomial_error(self, output: str) -> float:
        """The largest difference over the domain between the map and its `monomials`, evaluated in floats as printed.

        It is taken on a grid of about 10,000 Chebyshev points, ends included; for a reset, over [-1, 1].
        """
        i, n = _index(output, self.coordinates, "monomials"), len(self.coordinates)
        ends = np.where(np.isfinite(self.domain), self.domain, self.centre[:, None] + np.outer(self.scale, [-1, 1]))
        nodes = np.cos(np.linspace(0, np.pi, round(10_000 ** (1 / n))))
        axes = [(low + high) / 2 + (high - low) / 2 * nodes for low, high in ends]
        x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, n)
        plain = np.sum([value * np.prod(x ** np.array(key), axis=1) for key, value in self.monomials(output).items()], axis=0)
        return float(np.abs((np.abs(plain) if output in self.absolute else plain) - self(x)[:, i]).max())

    def symbolic(self, output: str) -> "sp.Expr":
        """One output as a sympy expression in plain monomials, in real symbols of the coordinates."""
        import sympy as sp

        symbols = [sp.Symbol(str(name), real=True) for name in self.coordinates]
        terms = self.monomials(output).items()
        powers = [sp.Mul(*(x**e for x, e in zip(symbols, key, strict=True))) for key, _ in terms]
        total = sp.Add(*(sp.Float(value, 17) * power for (_, value), power in zip(terms, powers, strict=True)))
        return sp.Abs(total) if output in self.absolute else total

    def _tensor(self) -> Floats:
        return dense(self.exponents, self.coefficients)

    def _scaled(self, states: ArrayLike) -> Floats:
        return np.asarray((as_states(states, self.coordinates) - self.centre) / self.scale, float)

    def _is_absolute(self) -> NDArray[np.bool_]:
        return np.array([name in self.absolute for name in self.coordinates], bool)


def paper_order(exponents: Iterable[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Exponents by total degree, then falling degree of the last coordinate, as the paper writes them (eq. cubic2dv).

    >>> paper_order([(1, 0), (0, 0), (0, 1), (2, 0), (1, 1), (0, 2)])
    [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0)]
    """
    return sorted(exponents, key=lambda key: (sum(key), tuple(-e for e in reversed(key))))


def design(exponents: Ints, scaled: Floats) -> Floats:
    """The Chebyshev products of the exponents (m, n) at scaled states (N, n), shape (N, m)."""
    columns = np.ones((len(scaled), len(exponents)))
    for j, degrees in enumerate(exponents.T):
        if degrees.any():
            columns *= chebvander(scaled[:, j], int(degrees.max()))[:, degrees]
    return columns


def dense(exponents: Sequence[Ints], coefficients: Sequence[Floats]) -> Floats:
    """The coefficients of the outputs as one array, shape (outputs, degree + 1 of each coordinate)."""
    shape = np.max([each.max(axis=0) for each in exponents], axis=0) + 1
    tensor = np.zeros((len(exponents), *shape))
    for i, (each, values) in enumerate(zip(exponents, coefficients, strict=True)):
        np.add.at(tensor[i], tuple(each.T), values)
    return tensor


def _evaluate(tensor: Floats, scaled: Floats) -> Floats:
    """The sums of Chebyshev products at scaled states (N, n), shape (N, outputs); coordinate by coordinate, from the last."""
    out = np.empty((len(scaled), len(tensor)))
    block = min(ROWS, max(1, FLOATS // tensor[..., 0].size))
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, len(scaled), block):
            rows = scaled[start : start + block]
            bases = [chebvander(rows[:, j], size - 1).T for j, size in enumerate(tensor.shape[1:])]
            value = (tensor.reshape(-1, tensor.shape[-1]) @ bases[-1]).reshape(*tensor.shape[:-1], -1)
            for basis in reversed(bases[:-1]):
                value = np.multiply(value, basis, out=value).sum(axis=-2)
            out[start : start + block] = value.T
    return out


def _changed(tensor: Exacts, centre: Floats, scale: Floats, basis: Callable[[int, Fraction, Fraction], Exacts]) -> Exacts:
    """Coefficients by exponents in another basis, whose row k contains the k-th polynomial of the old one, exactly."""
    for j, size in enumerate(tensor.shape):
        rows = basis(size, Fraction(float(centre[j])), Fraction(float(scale[j])))
        tensor = np.moveaxis(np.tensordot(tensor, rows, axes=(j, 0)), -1, j)
    return tensor


def _in_powers(size: int, centre: Fraction, scale: Fraction) -> Exacts:
    """The plain coefficients of T_k((x - centre) / scale): shape (size, size), row k for T_k."""
    rows = np.full((size, size), Fraction(0), object)
    rows[0, 0] = Fraction(1)
    if size > 1:
        rows[1, 0], rows[1, 1] = -centre / scale, 1 / scale
    for k in range(2, size):
        shifted = np.concatenate([[Fraction(0)], rows[k - 1, :-1]])
        rows[k] = 2 * (shifted - centre * rows[k - 1]) / scale - rows[k - 2]
    return rows


def _in_chebyshev(size: int, centre: Fraction, scale: Fraction) -> Exacts:
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


def _dense_exactly(terms: Mapping[tuple[int, ...], Fraction], n: int) -> Exacts:
    """Coefficients by exponents as one array, shape (degree + 1 of each coordinate)."""
    tensor = np.full(np.max([(0,) * n, *terms], axis=0) + 1, Fraction(0), object)
    for key, value in terms.items():
        tensor[key] = value
    return tensor


def _terms(tensor: Exacts) -> dict[tuple[int, ...], Fraction]:
    """The coefficients that are not zero, in the paper's order."""
    return {key: tensor[key] for key in paper_order(k for k, value in np.ndenumerate(tensor) if value)}


def _index(name: str, names: Sequence[str], what: str) -> int:
    if name not in names:
        raise FitError(f"{what}: no coordinate {name!r}{near_match(name, names)}; expected: {', '.join(names)}")
    return list(names).index(name)
