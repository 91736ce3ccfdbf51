"""Polynomials fitted to return surfaces by least squares: step iv of the general algorithm, table TableDeltaErr."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import TWO_PI, nearest_turn, wrap
from nsmaps.errors import FitError, near_match
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.exact.systems.files import Transferable
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.fit.leastsquares import Design, Solved, left_out
from nsmaps.reduced.fit.polymap import FitReport as FitReport
from nsmaps.reduced.fit.polymap import PolyMap as PolyMap
from nsmaps.reduced.fit.polymap import paper_order

Degree = Annotated[int, Field(ge=0, le=40)]

ILL_CONDITIONED = 1e8  #: condition above which half of a float's digits are lost in the fit
POOR = 0.9  #: a fit with R2 below this gives a warning
UNBOUND = 10.0  #: a point whose error grows by this factor when it is left out indicates an order that is too high
SEAM = 0.5  #: radians that another cut of the circle must gain before the data are moved there


class PolyFit(BaseModel, Transferable, ABC):
    """The monomials that approximate each coordinate of a map, and the data they are fitted to."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    absolute: tuple[str, ...] = Field((), description="coordinates of which the absolute value is taken, eq. R5eqn")

    @abstractmethod
    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The monomials of one output: the degree of each coordinate in each, shape (m, n). FitError for a bad name."""

    @abstractmethod
    def data(self, surface: Surface, output: str) -> Bools:
        """A mask of the surface's states to which an output is fitted, shape (M,). FitError where there are none."""

    def fit(self, surface: Surface) -> PolyMap:
        """The least squares polynomials of the surface, with a report.

        The data are scaled to [-1, 1] and the monomials are Chebyshev products, in which the map is stored; where the data
        fill their box so badly that these are ill-conditioned, the problem is solved in polynomials orthogonal on the data.
        Angles
        are unwrapped: a region over phi = 0 is fitted on one interval, images are continued from their starts, minus one
        common number of turns.

        Raises:
            FitError: the data are not finite, too few, or do not determine the monomials.
        """
        names = surface.coordinates
        for name in self.absolute:
            _known(name, names, "absolute")
        start, target = unwrapped(surface)
        exponents = tuple(self.exponents(names, name) for name in names)
        rows = [self.data(surface, name) for name in names]
        problems = list(zip(names, exponents, rows, target.T, strict=True))
        for name, each, use, y in problems:
            _check(f"{name}'", start[use], y[use], each, names)
        used = start[np.logical_or.reduce(rows)]
        domain = np.stack([used.min(axis=0), used.max(axis=0)], axis=1)
        centre, half = domain.mean(axis=1), (domain[:, 1] - domain[:, 0]) / 2
        scale = np.where(half > 0, half, 1.0)
        scaled = (start - centre) / scale
        designs: dict[tuple[bytes, bytes], Design] = {}
        solved = []
        for name, each, use, y in problems:
            key = each.tobytes(), use.tobytes()
            if key not in designs:
                designs[key] = Design(each, scaled[use])
            solved.append(designs[key].solve(f"{name}'", y[use]))
        polymap = PolyMap(names, exponents, tuple(s.coefficients for s in solved), centre, scale, domain, self.absolute)
        data = _Data(start, target, tuple(rows), tuple(solved))
        return replace(polymap, report=_report(polymap, data))


class Full(PolyFit):
    """Polynomials in all coordinates, by MATLAB's rule of polyNM: in each coordinate at most its own degree, and in total
    at most the largest of them; `{"v": 3, "phi": 2}` is the paper's poly23 (eq. cubic2dv).

    `degrees` are the same for every output, or by output: `{"v": {"v": 5, "phi": 3}, "phi": {"v": 5, "phi": 4}}` (eq. Apr3eqn).
    """

    degrees: dict[str, Degree] | dict[str, dict[str, Degree]]

    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The monomials of poly23 and its like, in the paper's order, shape (m, n)."""
        nested = {name: each for name, each in self.degrees.items() if isinstance(each, dict)}
        for name in self.degrees:
            _known(name, coordinates, "degrees")
        if nested and output not in nested:
            raise FitError(f"degrees: none for the output {output!r}; expected: degrees of {', '.join(coordinates)}")
        plain = nested[output] if nested else {name: e for name, e in self.degrees.items() if isinstance(e, int)}
        for name in plain:
            _known(name, coordinates, f"degrees of {output}'")
        highest = [plain.get(name, 0) for name in coordinates]
        return np.array(paper_order(_up_to(highest, max(highest))), int).reshape(-1, len(coordinates))

    def data(self, surface: Surface, output: str) -> Bools:
        """All of the surface."""
        return np.ones(len(surface.start), bool)


class Separable(PolyFit):
    """Polynomials of one coordinate each, its own: v' = f(v), phi' = g(phi) (remark separable)."""

    was: ClassVar = {"along": "lines"}
    degrees: dict[str, Degree]
    lines: dict[str, Number] | None = Field(
        None,
        description="fit each coordinate on the grid line where the others are nearest to these values, the paper's "
        "representative curves (fig. r2approx); on all data if omitted",
    )

    def exponents(self, coordinates: Sequence[str], output: str) -> Ints:
        """The powers of the output's own coordinate from zero on, shape (m, n)."""
        for name in self.degrees:
            _known(name, coordinates, "degrees")
        if output not in self.degrees:
            raise FitError(f"degrees: none for {output!r}; expected: degrees of {', '.join(coordinates)}")
        powers = np.arange(self.degrees[output] + 1)[:, None]
        return np.asarray(powers * (np.array(coordinates) == output), int)

    def data(self, surface: Surface, output: str) -> Bools:
        """The grid line at `lines`, or all of the surface."""
        rows = np.ones(len(surface.start), bool)
        names = surface.coordinates
        for name in self.lines or {}:
            _known(name, names, "lines")
        for j, name in enumerate(names):
            if self.lines is not None and name != output:
                if name not in self.lines:
                    raise FitError(f"lines: no value of {name!r} to fit {output}' at; expected: {', '.join(names)}")
                rows &= _line(surface, j, self.lines[name])
        return rows


def compare_orders(surface: Surface, fits: Mapping[str, PolyFit]) -> list[tuple[str, FitReport]]:
    """The reports of several fits to one surface, by name, as in table TableDeltaErr. FitError names the fit."""
    return [(name, map.report) for name, map in fit_orders(surface, fits).items() if map.report]


def fit_orders(surface: Surface, fits: Mapping[str, PolyFit]) -> dict[str, PolyMap]:
    """The maps of several fits to one surface, by name. FitError names the fit."""
    maps = {}
    for name, fit in fits.items():
        try:
            maps[name] = fit.fit(surface)
        except FitError as error:
            raise FitError(f"fit {name!r}: {error}") from error
    return maps


@dataclass(frozen=True, slots=True, eq=False)
class _Data:
    """The data of a fit."""

    start: Floats  # (M, n)
    target: Floats  # (M, n)
    rows: tuple[Bools, ...]  # the states used, for each output
    solved: tuple[Solved, ...]  # for each output


def unwrapped(surface: Surface | Returns) -> tuple[Floats, Floats]:
    """Starts and images of a surface or of M returns, each (M, n), with angles as real numbers that a polynomial can follow.

    Starts lie on one interval of the circle, which leaves [0, 2 pi) only where it would be cut there. Images are
    continued from their starts, minus one common number of turns that brings their median to [0, 2 pi).
    """
    start, lifted = np.array(surface.start, float), np.array(surface.lifted, float)
    for i in np.flatnonzero(surface.coordinates.angles):
        if len(start) and np.isfinite(lifted[:, i]).all() and np.isfinite(start[:, i]).all():
            stretch = stretch_of(start[:, i])
            lifted[:, i] += stretch - start[:, i]
            lifted[:, i] -= TWO_PI * np.floor(np.median(lifted[:, i]) / TWO_PI)
            start[:, i] = stretch
    return start, lifted


def stretch_of(angles: Floats) -> Floats:
    """The angles, plus whole turns, on the interval that omits the widest gap of the circle; unchanged if they fit."""
    wrapped = wrap(angles)
    around = np.sort(wrapped)
    gaps = np.diff(around, append=around[0] + TWO_PI)
    if np.ptp(angles) <= TWO_PI - gaps.max() + SEAM:
        return angles
    first = around[(np.argmax(gaps) + 1) % len(around)]
    return np.asarray(wrapped - TWO_PI * (wrapped >= first), float)


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


def _up_to(highest: Sequence[int], total: int) -> list[tuple[int, ...]]:
    """Exponents of at most `highest` in each coordinate and `total` in all."""
    if not highest:
        return [()]
    heads = range(min(highest[0], total) + 1)
    return [(head, *tail) for head in heads for tail in _up_to(highest[1:], total - head)]


def _known(name: str, names: Sequence[str], what: str) -> None:
    if name not in names:
        raise FitError(f"{what}: no coordinate {name!r}{near_match(name, names)}; expected: {', '.join(names)}")


def _check(what: str, x: Floats, y: Floats, exponents: Ints, names: Sequence[str]) -> None:
    """Raise a FitError if the data (M, n), (M,) do not determine the coefficients of the monomials (m, n)."""
    good = np.isfinite(x).all(axis=1) & np.isfinite(y)
    if not good.all():
        raise FitError(f"{what}: {np.sum(~good)} of {len(y)} data points are NaN or infinite; expected: returns with an image")
    if len(y) < len(exponents):
        raise FitError(f"{what}: {len(y)} data points for {len(exponents)} monomials; expected: at least as many points")
    for name, values, degree in zip(names, x.T, exponents.max(axis=0), strict=True):
        distinct = len(np.unique(values)) if degree else 1
        if distinct <= degree:
            here = f"all at {float(values[0])!r}" if distinct == 1 else f"at {distinct} values"
            raise FitError(f"{what}: the data are {here} of {name}; degree {degree} needs {degree + 1} distinct values")


def _report(polymap: PolyMap, data: _Data) -> FitReport:
    predicted = polymap(data.start)
    error = np.abs(predicted - data.target)
    used = [(data.target[rows, i], error[rows, i]) for i, rows in enumerate(data.rows)]
    sse = np.array([e @ e for _, e in used])
    sst = np.array([np.sum((y - y.mean()) ** 2) if np.ptp(y) else np.nan for y, _ in used])
    alone = [left_out(e, solved.leverage) for (_, e), solved in zip(used, data.solved, strict=True)]
    report = FitReport(
        coordinates=polymap.coordinates,
        r2=1 - sse / sst,
        sse=sse,
        max_error=np.array([e.max() for _, e in used]),
        condition=np.array([solved.condition for solved in data.solved]),
        points=np.array([len(y) for y, _ in used]),
        terms=np.array([len(each) for each in polymap.exponents]),
        left_out=np.array(alone),
        loss=np.array([solved.loss for solved in data.solved]),
    )
    warnings = [text for i in range(len(used)) for text in _warnings(report, data, error[:, i], i)]
    return replace(report, warnings=tuple(warnings))


def _warnings(report: FitReport, data: _Data, error: Floats, i: int) -> list[str]:
    """Warnings on the fit of output i."""
    name, rows, y = report.coordinates[i], data.rows[i], data.target[:, i]
    reach = np.ptp(y[rows])
    texts = []
    if not rows.all():
        worst = f"over all {len(rows)} points the largest error is {error.max():.3g}"
        texts.append(f"{name}' is fitted to {rows.sum()} points on a line; {worst}")
    if report.terms[i] == report.points[i]:
        texts.append(f"{name}' passes through its {rows.sum()} points, as many as terms; its errors say nothing")
    elif report.left_out[i] > max(UNBOUND * report.max_error[i], reach):
        missed = f"a point left out of the fit would be missed by {report.left_out[i]:.2g}, and the data span {reach:.2g}"
        alone = missed if np.isfinite(report.left_out[i]) else "a single point determines the fit there"
        texts.append(f"{name}': {alone}; the data do not determine polynomials of this order")
    if report.loss[i] > reach / ILL_CONDITIONED:
        texts.append(f"{name}': the representation in Chebyshev products of its box changes the fit by {report.loss[i]:.2g}")
    if report.condition[i] > ILL_CONDITIONED:
        texts.append(f"{name}': the least squares problem has condition {report.condition[i]:.2g}; few digits are correct")
    if report.r2[i] < POOR:
        largest = f"its largest error is {report.max_error[i]:.2g}, and the data span {reach:.2g}"
        texts.append(f"{name}': R2 is {report.r2[i]:.3g}, below {POOR:g}: the polynomial does not follow the data; {largest}")
    outside = np.mean((y < 0) | (y >= TWO_PI))
    if report.coordinates.angles[i] and outside > 0:
        where = f"{name}' reaches from {y.min():.4g} to {y.max():.4g}, {100 * outside:.3g} % of it outside [0, 2 pi)"
        more = "; flights of different numbers of periods may be mixed in it" if np.ptp(y) > TWO_PI else ""
        texts.append(f"{where}{more}")
    return texts
