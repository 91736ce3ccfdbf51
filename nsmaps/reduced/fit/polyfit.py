"""Polynomials fitted to return surfaces by least squares: step iv of the general algorithm, table TableDeltaErr."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from nsmaps.arrays import Bools, Floats, Ints, finite_rows
from nsmaps.coordinates import Coordinates, is_angle, nearest_turn
from nsmaps.errors import ConditionError, FitError, check_known
from nsmaps.errors.arguments import checked
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.exact.systems.files import Transferable
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.fit.leastsquares import Design
from nsmaps.reduced.fit.lifts import Wound, unwrapped, with_windings
from nsmaps.reduced.fit.monomials import has_lower, paper_order
from nsmaps.reduced.fit.polymap import FitReport as FitReport
from nsmaps.reduced.fit.polymap import PolyMap as PolyMap
from nsmaps.reduced.fit.reporting import FitData, report_on
from nsmaps.reduced.fit.variables import values_of

if TYPE_CHECKING:
    import sympy as sp

Degree = Annotated[int, Field(ge=0, le=40)]

FULL = 0.9  #: of half the width of [-1, 1] that the values of a variable take to be left unscaled


class PolyFit(BaseModel, Transferable, ABC):
    """The monomials that approximate each coordinate of a map, and the data they are fitted to.

    They are monomials in the coordinates, or in the `variables`, other functions of these. `BasisFit` takes any functions.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    absolute: tuple[str, ...] = Field((), description="coordinates of which the absolute value is taken, eq. R5eqn")

    @abstractmethod
    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The monomials of one output: the degree of each coordinate or variable, shape (m, k). FitError for a bad name."""

    @abstractmethod
    def data(self, surface: Surface, output: str) -> Bools:
        """A mask of the surface's states to which an output is fitted, shape (M,). FitError where there are none."""

    def variables(self, coordinates: Sequence[str]) -> "Sequence[sp.Expr] | None":
        """What the exponents are of, k formulas in real sympy symbols of the coordinates; None for the coordinates themselves."""
        return None

    def winding(self, coordinates: Sequence[str], output: str) -> int | None:
        """How often an angle's image goes round as the angle itself does, of a fit to maps of the whole circle; None of others.

        That many times the angle is added to what is fitted, which then is a periodic function.
        """
        return None

    def fit(self, surface: Surface) -> PolyMap:
        """The least squares polynomials of the surface, with a report.

        The data are scaled to [-1, 1] and the monomials are Chebyshev products, in which the map is stored; where the data
        fill their box so badly that these are ill-conditioned, the problem is solved in polynomials orthogonal on the data.
        Angles are unwrapped: a region over phi = 0 is fitted on one interval, images are continued from their starts, minus one
        common number of turns. With a `winding` the circle is not cut: the image less so many times the angle is fitted.

        Raises:
            FitError: the data are not finite, too few, or do not determine the monomials.
        """
        names = surface.coordinates
        for name in self.absolute:
            known(name, names, "absolute")
        rows = [self.data(surface, name) for name in names]
        start, target = unwrapped(surface)
        wound = Wound.of(surface, start, target, self.windings(names))
        texts = self.texts(names)
        x = start if texts is None else values_of(texts, names, start)
        exponents = tuple(self.exponents(names, name) for name in names)
        problems = list(zip(names, exponents, rows, wound.periodic.T, strict=True))
        for name, each, use, y in problems:
            _check(f"{name}'", start[use], x[use], y[use], each, texts or names)
        used = np.logical_or.reduce(rows)
        centre, scale = scaling(x[used], None if texts is None else exponents)
        scaled = (x - centre) / scale
        designs: dict[tuple[bytes, bytes], Design] = {}
        solved = []
        for name, each, use, y in problems:
            key = each.tobytes(), use.tobytes()
            if key not in designs:
                designs[key] = Design(each, scaled[use])
            solved.append(designs[key].solve(f"{name}'", y[use]))
        domain = np.stack([start[used].min(axis=0), start[used].max(axis=0)], axis=1)
        coefficients = tuple(s.coefficients for s in solved)
        periodic = PolyMap(names, exponents, coefficients, centre, scale, domain, self.absolute, None, texts)
        polymap = with_windings(periodic, wound.winding)
        data = FitData(start, wound.target, tuple(rows), tuple(solved), tuple(wound.winding))
        return replace(polymap, report=report_on(polymap, data))

    def texts(self, names: Coordinates) -> tuple[str, ...] | None:
        """The variables as text; FitError for what has none."""
        given = self.variables(names)
        if given is None:
            return None
        from nsmaps.reduced.conditions.text import text_of

        try:
            return tuple(text_of(each, names) for each in given)
        except ConditionError as error:
            raise FitError(f"a variable of {type(self).__name__}: {error}") from error

    def windings(self, names: Coordinates) -> dict[int, int]:
        """The windings of outputs that are angles and have one, by number."""
        found = {i: self.winding(names, name) for i, name in enumerate(names) if is_angle(name)}
        return {i: times for i, times in found.items() if times is not None}


class PolynomialFit(PolyFit):
    """Polynomials in all coordinates, by MATLAB's rule of polyNM.

    The degree is in each coordinate at most its own and in total at most the largest of them; `{"v": 3, "phi": 2}` is the paper's
    poly23 (eq. cubic2dv).

    `degrees` are the same for every output, or by output: `{"v": {"v": 5, "phi": 3}, "phi": {"v": 5, "phi": 4}}` (eq. Apr3eqn).
    """

    degrees: dict[str, Degree] | dict[str, dict[str, Degree]]

    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The monomials of poly23 and its like, in the paper's order, shape (m, n)."""
        nested = {name: each for name, each in self.degrees.items() if isinstance(each, dict)}
        for name in self.degrees:
            known(name, coordinates, "degrees")
        if nested and output not in nested:
            raise FitError(f"degrees: none for the output {output!r}; expected: degrees of {', '.join(coordinates)}")
        plain = nested[output] if nested else {name: e for name, e in self.degrees.items() if isinstance(e, int)}
        for name in plain:
            known(name, coordinates, f"degrees of {output}'")
        highest = [plain.get(name, 0) for name in coordinates]
        return np.array(paper_order(up_to(highest, max(highest))), int).reshape(-1, len(coordinates))

    def data(self, surface: Surface, output: str) -> Bools:
        """All of the surface."""
        return np.ones(len(surface.start), bool)


class SeparableFit(PolyFit):
    """Polynomials of one coordinate each, its own: v' = f(v), phi' = g(phi) (remark separable)."""

    degrees: dict[str, Degree]
    lines: dict[str, Number] | None = Field(
        None,
        description="fit each coordinate on the grid line where the others are nearest to these values, the paper's "
        "representative curves (fig. r2approx); on all data if omitted",
    )

    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The powers of the output's own coordinate from zero on, shape (m, n)."""
        for name in self.degrees:
            known(name, coordinates, "degrees")
        if output not in self.degrees:
            raise FitError(f"degrees: none for {output!r}; expected: degrees of {', '.join(coordinates)}")
        powers = np.arange(self.degrees[output] + 1)[:, None]
        return np.asarray(powers * (np.array(coordinates) == output), int)

    def data(self, surface: Surface, output: str) -> Bools:
        """The grid line at `lines`, or all of the surface."""
        rows = np.ones(len(surface.start), bool)
        names = surface.coordinates
        for name in self.lines or {}:
            known(name, names, "lines")
        for j, name in enumerate(names):
            if self.lines is not None and name != output:
                if name not in self.lines:
                    raise FitError(f"lines: no value of {name!r} to fit {output}' at; expected: {', '.join(names)}")
                rows &= _line(surface, j, self.lines[name])
        return rows


@checked
def compare_orders(surface: Surface, fits: Mapping[str, PolyFit]) -> list[tuple[str, FitReport]]:
    """The reports of several fits to one surface, by name, as in table TableDeltaErr. FitError names the fit."""
    return [(name, formulas.report) for name, formulas in fit_orders(surface, fits).items() if formulas.report]


def fit_orders(surface: Surface, fits: Mapping[str, PolyFit]) -> dict[str, PolyMap]:
    """The maps of several fits to one surface, by name. FitError names the fit."""
    maps = {}
    for name, fit in fits.items():
        try:
            maps[name] = fit.fit(surface)
        except FitError as error:
            raise FitError(f"fit {name!r}: {error}") from error
    return maps


def _line(surface: Surface, j: int, value: float) -> Bools:
    """The states on the grid line of coordinate j nearest to a value, shape (M,)."""
    name = surface.coordinates[j]
    axis = surface.grid.axes[name]
    x = surface.start[:, j]
    away = np.abs((nearest_turn(x, value) if surface.coordinates.angles[j] else x) - value)
    if not len(x) or away.min() > 1.001 * axis.step:
        where = f"lie in [{x.min():.6g}, {x.max():.6g}]" if len(x) else "are empty"
        raise FitError(f"lines: no data within a grid step of {name} = {value!r}; the data {where}")
    return np.abs(x - x[np.argmin(away)]) <= 1e-6 * axis.step


def up_to(highest: Sequence[int], total: int) -> list[tuple[int, ...]]:
    """Exponents of at most `highest` in each coordinate and `total` in all."""
    if not highest:
        return [()]
    heads = range(min(highest[0], total) + 1)
    return [(head, *tail) for head in heads for tail in up_to(highest[1:], total - head)]


def known(name: str, names: Sequence[str], what: str) -> None:
    """Raise a FitError about `what` unless a name is one of some."""
    check_known(f"{what}: no coordinate", name, names, FitError)


def _check(what: str, start: Floats, x: Floats, y: Floats, exponents: Ints, names: Sequence[str]) -> None:
    """Raise a FitError if the data (M, n), (M,) and variables (M, k) do not determine the coefficients of the terms (m, k)."""
    good = finite_rows(start) & np.isfinite(y)
    if not good.all():
        raise FitError(f"{what}: {np.sum(~good)} of {len(y)} data points are NaN or infinite; expected: returns with an image")
    for name, values in zip(names, x.T, strict=True):
        if lost := int(np.sum(~np.isfinite(values))):
            where = f"at {lost} of {len(y)} data points"
            raise FitError(f"{what}: the variable {name} is NaN or infinite {where}; expected: a variable that is real there")
    if len(y) < len(exponents):
        raise FitError(f"{what}: {len(y)} data points for {len(exponents)} terms; expected: at least as many points")
    for name, values, degree in zip(names, x.T, exponents.max(axis=0), strict=True):
        distinct = len(np.unique(values)) if degree else 1
        if distinct <= degree:
            here = f"all at {float(values[0])!r}" if distinct == 1 else f"at {distinct} values"
            raise FitError(f"{what}: the data are {here} of {name}; expected: {degree + 1} values or more")


def scaling(x: Floats, exponents: Sequence[Ints] | None) -> tuple[Floats, Floats]:
    """Centres and scales, shape (k,) each, that bring values (N, k) to [-1, 1]; with exponents those of variables.

    A variable that nearly fills [-1, 1] itself, as the cosine of a whole turn, is left alone, so that its Chebyshev polynomials
    are harmonics. One of which a lower power is missing is not shifted, since the span of its powers would be another.
    """
    low, high = x.min(axis=0), x.max(axis=0)
    centre, half = (low + high) / 2, (high - low) / 2
    if exponents is not None:
        alone = (np.maximum(-low, high) <= 1) & (half > FULL)
        fixed = ~np.logical_and.reduce([has_lower(each) for each in exponents])
        centre = np.where(alone | fixed, 0.0, centre)
        half = np.where(alone, 1.0, np.where(fixed, np.maximum(-low, high), half))
    return centre, np.where(half > 0, half, 1.0)
