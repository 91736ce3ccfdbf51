"""Polynomial maps in scaled Chebyshev products of the coordinates, or of other functions of them, and the report on their fit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import BoxLike, Coordinates, WithCoordinates, as_box, as_states
from nsmaps.errors import FitError, check_known
from nsmaps.reduced.fit.monomials import changed, dense_exactly, in_chebyshev, in_powers, paper_order, terms_of
from nsmaps.reduced.fit.variables import expression, jacobian_of, sum_of_products, values_of
from nsmaps.results import NONE, Result, array

if TYPE_CHECKING:
    import sympy as sp

ROWS, FLOATS = 2**14, 2**21  #: states evaluated at a time, to stay in the cache, and their number of floats


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FitReport(WithCoordinates, Result):
    """The errors of the polynomials of a map at the data of their fit; arrays have one entry per output."""

    coordinates: Coordinates
    r2: Floats = field(
        metadata=array("coordinate", "1 - SSE/SST as in table TableDeltaErr; NaN where the data do not vary", NONE)
    )
    sse: Floats = field(metadata=array("coordinate", "the sum of squared errors"))
    max_error: Floats = field(metadata=array("coordinate", "the largest error at a data point"))
    condition: Floats = field(metadata=array("coordinate", "condition number of the least squares problem that was solved", NONE))
    points: Ints = field(metadata=array("coordinate", "data points used", NONE))
    terms: Ints = field(metadata=array("coordinate", "coefficients fitted", NONE))
    left_out: Floats = field(
        metadata=array("coordinate", "the largest error at a data point when it alone is left out of the fit (PRESS residual)")
    )
    loss: Floats = field(
        metadata=array("coordinate", "the largest change at a data point by the change from orthogonal to Chebyshev products")
    )
    warnings: tuple[str, ...] = ()  #: limitations of the figures

    def summary(self) -> str:
        """The numbers that matter."""
        rows = zip(self.coordinates, self.r2, self.max_error, self.points, strict=True)
        return "; ".join(
            f"{name}: R2 = {r2:.6g}, largest error {error:.2g} at {points} states" for name, r2, error, points in rows
        )

    def rows(self) -> list[dict[str, Any]]:
        """One row per output for a table, as plain numbers by name."""
        columns = ("r2", "sse", "max_error", "condition", "points", "terms")
        arrays = [getattr(self, name).tolist() for name in columns]
        rows = zip(self.coordinates, *arrays, strict=True)
        return [dict(zip(("output", *columns), row, strict=True)) for row in rows]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PolyMap(WithCoordinates, Result):
    """A map whose coordinates are polynomials: sums of products of Chebyshev polynomials of (x - centre) / scale.

    They are polynomials in the n coordinates, or in k `variables`, which are formulas of these, such as cos(phi). An angle's
    image is not wrapped. The map is that of its formula everywhere: outside of `domain` it extrapolates.
    """

    coordinates: Coordinates
    exponents: tuple[Ints, ...] = field(
        metadata=array("term input", "the degree of each variable, or coordinate, in each term", NONE)
    )
    coefficients: tuple[Floats, ...] = field(metadata=array("term", "of the Chebyshev products"))
    centre: Floats = field(metadata=array("input", "subtracted from each variable"))
    scale: Floats = field(metadata=array("input", "by which the difference is divided"))
    domain: Floats = field(metadata=array("coordinate end", "the box of the data; infinite for a reset"))
    absolute: tuple[str, ...] = ()  #: outputs of which the absolute value is taken, eq. R5eqn
    report: FitReport | None = None
    variables: tuple[str, ...] | None = None  #: k formulas of the coordinates, see `read_number`; None for the coordinates

    def summary(self) -> str:
        """The numbers that matter."""
        terms = ", ".join(f"{name} {len(each)}" for name, each in zip(self.coordinates, self.coefficients, strict=True))
        return f"polynomials with coefficients {terms}{f'; {self.report}' if self.report else ''}"

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
        terms = [terms_of(changed(dense_exactly(monomials[name], len(names)), centre, scale, in_chebyshev)) for name in names]
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
        image = self._image(self._scaled(as_states(states, self.coordinates)))
        return np.where(self._is_absolute(), np.abs(image), image)

    def derivative(self, states: ArrayLike) -> Floats:
        """The derivative d image_i / d x_j at states (N, n), shape (N, n, n); zero where an absolute value has its kink."""
        x = as_states(states, self.coordinates)
        scaled = self._scaled(x)
        derivative = self._slopes(scaled) if self.variables is None else self._slopes_of_variables(x, scaled)
        if not self.absolute:
            return derivative
        signs = np.where(self._is_absolute(), np.sign(self._image(scaled)), 1.0)
        return np.asarray(derivative * signs[:, :, None], float)

    @property
    def middle(self) -> Floats:
        """The middle of the data of each angle, on whose turn it is evaluated, shape (n,); NaN where the turn does not matter."""
        fitted = self.coordinates.angles & np.isfinite(self.domain).all(axis=1)
        middle = self.centre if self.variables is None else np.where(fitted[:, None], self.domain, np.nan).mean(axis=1)
        return np.where(fitted, middle, np.nan)

    def depends(self, output: str) -> Bools:
        """Which coordinates an output is a function of, shape (n,)."""
        used = np.atleast_1d(self.exponents[_index(output, self.coordinates, "depends")].any(axis=0))
        if self.variables is None:
            return used
        free = [expression(text, self.coordinates).free_symbols for text, j in zip(self.variables, used, strict=True) if j]
        names = {symbol.name for each in free for symbol in each}
        return np.array([str(name) in names for name in self.coordinates], bool)

    def monomials(self, output: str) -> dict[tuple[int, ...], float]:
        """The coefficients of the plain monomials of one output by their exponents, in the order of eq. cubic2dv.

        They are converted exactly and rounded once; but over a small box far from zero plain monomials cancel, so evaluate the
        map itself. For an absolute value these are the coefficients of its argument.
        """
        return {key: float(value) for key, value in self.exact_monomials(output).items()}

    def exact_monomials(self, output: str) -> dict[tuple[int, ...], Fraction]:
        """As `monomials`, not rounded: for closed forms that must agree with the map where plain monomials cancel.

        FitError for a map with variables.
        """
        i = _index(output, self.coordinates, "monomials")
        if self.variables is not None:
            terms = f"its terms are products of {', '.join(self.variables)}"
            raise FitError(f"{output}' is not a polynomial in {self.coordinates}: {terms}; expected: `symbolic`, its formula")
        tensor = np.vectorize(Fraction, otypes=[object])(dense([self.exponents[i]], [self.coefficients[i]])[0])
        tensor = changed(tensor, self.centre, self.scale, in_powers)
        asked = set(map(tuple, self.exponents[i].tolist()))
        return {key: tensor[key] for key in paper_order(asked | set(terms_of(tensor)))}

    def monomial_error(self, output: str) -> float:
        """The largest difference over the domain between the map and its `monomials`, evaluated in floats as printed.

        It is taken on a grid of about 10,000 Chebyshev points, ends included; for a reset, over [-1, 1].
        """
        i, n, terms = _index(output, self.coordinates, "monomials"), len(self.coordinates), self.monomials(output)
        ends = np.where(np.isfinite(self.domain), self.domain, self.centre[:, None] + np.outer(self.scale, [-1, 1]))
        nodes = np.cos(np.linspace(0, np.pi, round(10_000 ** (1 / n))))
        axes = [(low + high) / 2 + (high - low) / 2 * nodes for low, high in ends]
        x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, n)
        plain = np.sum([value * np.prod(x ** np.array(key), axis=1) for key, value in terms.items()], axis=0)
        return float(np.abs((np.abs(plain) if output in self.absolute else plain) - self(x)[:, i]).max())

    def symbolic(self, output: str) -> "sp.Expr":
        """One output as a sympy expression in real symbols of the coordinates: in plain monomials of these, or of the variables.

        Of a variable cos(x) that is not scaled, harmonics cos(k*x) and sin(k*x) stand in their place.
        """
        import sympy as sp

        if self.variables is None:
            symbols = [sp.Symbol(str(name), real=True) for name in self.coordinates]
            terms = self.monomials(output).items()
            powers = [sp.Mul(*(x**e for x, e in zip(symbols, key, strict=True))) for key, _ in terms]
            total = sp.Add(*(sp.Float(value, 17) * power for (_, value), power in zip(terms, powers, strict=True)))
        else:
            i = _index(output, self.coordinates, "symbolic")
            of = [expression(text, self.coordinates) for text in self.variables]
            total = sum_of_products(of, self.exponents[i], self.coefficients[i], self.centre, self.scale)
        return sp.Abs(total) if output in self.absolute else total

    def _image(self, scaled: Floats) -> Floats:
        """The outputs at scaled variables (N, k) without absolute values, shape (N, outputs)."""
        if self.variables is None:
            return _evaluate(self._tensor(), scaled)
        return _sums(self.exponents, self.coefficients, scaled)

    def _slopes(self, scaled: Floats) -> Floats:
        tensor = self._tensor()
        slopes = [np.asarray(chebder(tensor, axis=1 + j), float) / self.scale[j] for j in range(scaled.shape[1])]
        return np.stack([_evaluate(slope, scaled) for slope in slopes], axis=2)

    def _slopes_of_variables(self, states: Floats, scaled: Floats) -> Floats:
        """The same by the chain rule, for states (N, n) and scaled variables (N, k) there."""
        inner = jacobian_of(self.variables or (), self.coordinates, states) / self.scale[:, None]
        slopes = np.zeros((len(states), len(self.exponents), states.shape[1]))
        for i, (each, values) in enumerate(zip(self.exponents, self.coefficients, strict=True)):
            for j, degrees in enumerate(each.T):
                if degrees.any():
                    slope = design(each[degrees > 0], scaled, j) @ values[degrees > 0]
                    slopes[:, i] += slope[:, None] * inner[:, j]
        return slopes

    def _tensor(self) -> Floats:
        return dense(self.exponents, self.coefficients)

    def _scaled(self, states: Floats) -> Floats:
        x = states if self.variables is None else values_of(self.variables, self.coordinates, states)
        return np.asarray((x - self.centre) / self.scale, float)

    def _is_absolute(self) -> Bools:
        return np.array([name in self.absolute for name in self.coordinates], bool)


def design(exponents: Ints, scaled: Floats, by: int | None = None) -> Floats:
    """The Chebyshev products of exponents (m, k) at scaled variables (N, k), or their derivatives by one of these: (N, m)."""
    columns = np.ones((len(scaled), len(exponents)))
    for j, degrees in enumerate(exponents.T):
        if degrees.any():
            factors = chebvander(scaled[:, j], highest := int(degrees.max()))
            if j == by:
                factors = factors[:, :-1] @ chebder(np.eye(highest + 1))
            columns *= factors[:, degrees]
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


def _sums(exponents: Sequence[Ints], coefficients: Sequence[Floats], scaled: Floats) -> Floats:
    """The sums of Chebyshev products at scaled variables (N, k), shape (N, outputs); term by term."""
    out, highest = np.empty((len(scaled), len(exponents))), np.max([each.max(axis=0) for each in exponents], axis=0)
    for start in range(0, len(scaled), ROWS):
        rows = slice(start, start + ROWS)
        bases = [chebvander(x, int(d)).T for x, d in zip(scaled[rows].T, highest, strict=True)]
        for i, (each, values) in enumerate(zip(exponents, coefficients, strict=True)):
            products = np.ones((len(values), len(scaled[rows])))
            for basis, degrees in zip(bases, each.T, strict=True):
                if degrees.any():
                    products *= basis[degrees]
            out[rows, i] = values @ products
    return out


def _index(name: str, names: Sequence[str], what: str) -> int:
    check_known(f"{what}: no coordinate", name, names, FitError)
    return list(names).index(name)
