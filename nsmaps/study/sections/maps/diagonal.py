"""The section `diagonal`: the states near their images, and a comparison of polynomial orders there."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from nsmaps.errors import FitError, NsmapsError
from nsmaps.exact.surfaces.surface import Grid, Surface
from nsmaps.exact.surfaces.sweep import sweep
from nsmaps.figures.parts import section
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.conditions.region import Box, ConditionRegion
from nsmaps.reduced.fit.filter import Attracting, NearDiagonal, diagonal_region
from nsmaps.reduced.fit.filter_errors import compare_deltas
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import intervals, range_text
from nsmaps.study.estimates import Size, states
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.classes import Condition
from nsmaps.study.reading.values import Name, Side, Sweep
from nsmaps.study.sections.base import Analysis, Finding
from nsmaps.study.sections.maps.fits import Fit, bind_fit, fit_size, report_numbers
from nsmaps.study.sections.maps.surfaces import SURFACES, surfaces_size

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from nsmaps.exact.surfaces.mesh import Mesh
    from nsmaps.reduced.fit.filter import DiagonalRegion
    from nsmaps.reduced.fit.filter_errors import NearDiagonals
    from nsmaps.reduced.fit.polyfit import PolyFit
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System


def _region(result: "StudyResult") -> "DiagonalRegion | None":
    """The region with the images of its states."""
    region = result.diagonal
    if region is None or not region.images:
        return None
    _check_some(len(region.start))
    return region


def _near(result: "StudyResult") -> "Sequence[NearDiagonals]":
    """The states for each delta."""
    if result.near:
        _check_some(len(result.near[0].surface.start))
    return result.near


def _fits(result: "StudyResult") -> "Sequence[NearDiagonals]":
    """The states for each delta, if polynomials were fitted to them."""
    found = _near(result)
    return found if found and found[0].maps else ()


def _parameter(result: "StudyResult") -> str:
    """The parameter over whose values states are near the diagonals; empty without one."""
    spec = section(result.study.diagonal, "diagonal")
    return "" if spec.sweep is None else spec.sweep.parameter


def _near_mesh(result: "StudyResult") -> "Callable[[Surface], Mesh]":
    """The surface as triangles, of which part 1 passes the filter of the study at its own parameters."""
    asked = section(result.study.diagonal, "diagonal")
    region = None if asked.region is None else ConditionRegion(coordinates=result.system.coordinates, text=asked.region)
    criterion = NearDiagonal(delta=_near(result)[0].delta, slope=asked.slope, region=region)
    attracting = Attracting(criterion, result.system, result.family(asked.family))
    return lambda surface: result.mesh(surface.name, attracting)


def _check_some(states: int) -> None:
    """An error where no state is near the diagonals."""
    if not states:
        raise NsmapsError("no state is near the diagonals; expected: a larger 'delta', or a wider 'region'")


DIAGONAL: "FigurePart[DiagonalRegion]" = FigurePart("the region near the diagonals with its images", ("diagonal",), _region)
SWEPT: "FigurePart[str]" = FigurePart("a parameter", (), _parameter, optional=True)
SHOWN: "FigurePart[Sequence[float]]" = FigurePart(
    "values", (), lambda result: section(result.study.diagonal, "diagonal").shown, optional=True
)
NEAR: "FigurePart[NearDiagonals]" = FigurePart(
    "the states near the diagonals", ("diagonal",), lambda result: next(iter(_near(result)), None), planar=True
)
NEAR_MESH: "FigurePart[Callable[[Surface], Mesh]]" = FigurePart("triangles by the filter", (), _near_mesh)
ORDERS: "FigurePart[Sequence[NearDiagonals]]" = FigurePart(
    "fits near the diagonals",
    ("diagonal",),
    _fits,
    "'orders' in 'diagonal'",
    lambda study: not study.diagonal or bool(study.diagonal.orders),
    planar=True,
)


class DiagonalSection(Analysis):
    """States near their images, united over a parameter (step iii, eq. r1uniond); needs `families`."""

    key: ClassVar[str] = "diagonal"
    needed: ClassVar[tuple[str, ...]] = ("families",)
    results: ClassVar[Mapping[str, Any]] = {
        "diagonal": None,
        "orders": (),  #: fits compared near the diagonals, table TableDeltaErr
        "near": (),  #: at the study's own parameters, for `delta` and each of `deltas`
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "fits.diagonal",
            "States near the diagonals in the phase planes, for some values of a parameter and for all of them.",
            "States near both diagonals (eq. r1uniond): green for one value of the parameter, blue for all values of the "
            "sweep. Dotted lines are the ratios delta and 1/delta.",
            (DIAGONAL, SWEPT, SHOWN),
        ),
        StudyFigure(
            "returns.diagonal_surface",
            "Surfaces of the images over the plane of states; the part near both diagonals is blue.",
            "The return surfaces of one family, blue where a state is near the diagonals of all coordinates (eq. r1uniond).",
            (NEAR, SURFACES, NEAR_MESH),
        ),
        StudyFigure(
            "fits.orders",
            "Logarithmic plots of 1 - R2 and of the sum of squared errors against the order of the polynomial.",
            "Polynomials of several orders fitted near the diagonals (table TableDeltaErr): 1 - R2 and the sum of squared "
            "errors (SSE), a line for each delta.",
            (ORDERS,),
        ),
        StudyFigure(
            "fits.fit_error",
            "The states near the diagonals coloured by the error of the fitted polynomials.",
            "The error of the polynomials fitted near the diagonals at each state of the grid, a row for each delta (fig. "
            "comparert).",
            (ORDERS,),
        ),
    )

    family: str = Field(description="the family that is filtered")
    delta: Number = Field(gt=1, description="largest ratio between a coordinate and its image, either way")
    slope: Number | None = Field(None, gt=0, description="largest slope of each image in its coordinate, by differences")
    region: Condition | None = Field(None, description="where to look, a condition or a region of a class; everywhere by default")
    sweep: Sweep | None = Field(None, description="values over which the region is united; the study's own by default")
    shown: tuple[Number, ...] = Field(
        (),
        description="values of the sweep shown in the figure `diagonal`; by default three",
    )
    orders: dict[Name, Fit] = Field(
        default_factory=dict, description="fits that are compared on the states near the diagonals, at the study's own parameters"
    )
    deltas: tuple[Annotated[Number, Field(gt=1)], ...] = Field(
        (), description="further values of `delta` at which `orders` are compared"
    )
    grid: dict[str, Side] | None = Field(None, description="a grid of its own; the study's by default")

    @model_validator(mode="after")
    def _orders_at_deltas(self) -> Self:
        if self.deltas and not self.orders:
            raise ValueError("'deltas' without 'orders' to compare; expected: beside 'orders' only")
        return self

    @model_validator(mode="after")
    def _shown_are_swept(self) -> Self:
        values = np.linspace(self.sweep.low, self.sweep.high, self.sweep.points) if self.sweep else np.empty(0)
        for value in self.shown:
            near = np.abs(values - value)
            if not len(values) or near.min() > 1e-6 * np.ptp(values):
                some = f"one of its {len(values)}, such as {values[near.argmin()]:.6g}" if len(values) else "none without 'sweep'"
                raise ValueError(f"'shown' has {value:g}, which the sweep lacks; expected: {some}")
        return self

    def check(self, study: "Study") -> None:
        study.source.known(("diagonal", "family"), self.family, study.families, "family")

    def bind(self, binding: "Binding") -> "Near":
        study, source = binding.study, binding.study.source
        if self.grid is None and study.grid is None:
            raise source.error(("diagonal",), "'diagonal' has no grid; expected: 'grid' in this section, or the section 'grid'")
        if self.sweep:
            binding.swept_values(("diagonal", "sweep"), self.sweep.parameter, (self.sweep.low, self.sweep.high))
        region = None if self.region is None else binding.region(("diagonal", "region"), self.region)
        with source.located(("diagonal",), NearDiagonal):
            criterion = NearDiagonal(delta=self.delta, slope=self.slope, region=region)
        loc = ("grid",) if self.grid is None else ("diagonal", "grid")
        grid = binding.grid(loc, study.grid if self.grid is None else self.grid)
        orders = {name: bind_fit(("diagonal", "orders", name), order, binding) for name, order in self.orders.items()}
        return Near(criterion, grid, self.grid is not None, orders)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """Step ii: the region near the diagonals, united over a parameter, and the orders of polynomials compared.

        Orders are compared on the states near the diagonals at the study's own parameters (fig. comparert, table TableDeltaErr).
        """
        bound: Near = plan.bound["diagonal"]
        region = diagonal_region(bound.filter, _swept(self, plan, bound.grid))
        own = plan.families[self.family].surface(plan.system, bound.grid) if bound.own else result.surfaces[self.family]
        with plan.study.source.located(("diagonal", "orders")):
            near = compare_deltas(bound.filter, own, self.deltas, bound.orders)
        orders = tuple((name, fitted.report) for name, fitted in near[0].maps.items())
        return {"diagonal": region, "near": near, "orders": orders}

    def describe(self, study: "Study") -> str:
        over = f" over {self.sweep.points} values of {self.sweep.parameter}" if self.sweep else ""
        return f"{self.family} within a factor {self.delta:g} of the diagonals{over}"

    def size(self, study: "Study", system: "System") -> Size:
        values, count = self.sweep.points if self.sweep else 1, states(self.grid or study.grid)
        fits = sum((fit_size(fit, count) for fit in self.orders.values()), Size())
        return surfaces_size(study, count, 1).times(values) + fits.times(1 + len(self.deltas))

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The states near the diagonals, and the box that holds them."""
        region = result.diagonal
        box = intervals(result.system.coordinates, region.box)
        text = f"{len(region.start):,} states of {self.family} are mapped near to themselves, within {box}"
        numbers = ((f"{len(region.start):,}", f"states of {self.family} near the diagonals"),)
        yield Finding(result.system.map_name, text, numbers)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        region = result.diagonal
        return {"diagonal": {"box": region.box.tolist(), "states": len(region.start), "orders": _orders(result)}}

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The number of states near the diagonals and their hull, or the order with the smallest of the largest errors."""
        if figure in ("orders", "fit_error"):
            return _best_orders(result)
        if figure == "diagonal_surface":
            if not result.near or result.returns is None:
                return ""
            count, delta = len(result.near[0].surface.start), result.near[0].delta
            return f"{at(result)}delta = {delta:g}, {count:,} of {len(result.returns):,} states near both diagonals."
        region = result.diagonal
        if not len(region.start):
            return ""
        over = f" over {range_text(self.sweep)}" if self.sweep else ""
        hull = intervals(region.coordinates, region.box)
        varied = (self.sweep.parameter,) if self.sweep else ()
        return f"{at(result, varied)}delta = {region.delta:g}, {len(region.start):,} states{over}, all in {hull}."


def _best_orders(result: "StudyResult") -> str:
    """The order with the smallest of the largest errors, for each delta."""
    lines = []
    for near in result.near:
        errors = {name: float(np.max(each.report.max_error)) for name, each in near.maps.items() if each.report is not None}
        if errors:
            best = min(errors, key=errors.__getitem__)
            lines.append(f"{best} for delta = {near.delta:g} (largest error {errors[best]:.2g})")
    return f"{at(result)}the best order is {', '.join(lines)}." if lines else ""


@dataclass(frozen=True, slots=True, eq=False)
class Near:
    """The filter, its grid, and the fits that are compared."""

    filter: NearDiagonal
    grid: Grid
    own: bool  #: True if the section defines the grid
    orders: "dict[str, PolyFit]"


def _swept(spec: DiagonalSection, plan: "Plan", grid: Grid) -> list[tuple[float, Surface]]:
    """The family's surface for each value of the swept parameter."""
    family = plan.families[spec.family]
    if spec.sweep is None:
        return [(float("nan"), family.surface(plan.system, grid))]
    values = np.linspace(spec.sweep.low, spec.sweep.high, spec.sweep.points)
    swept = sweep(plan.system, spec.sweep.parameter, values, grid, [family], parallel=plan.parallel)
    return [(value, found[spec.family]) for value, found in swept]


def near_diagonals(plan: "Plan", surface: Surface) -> tuple[dict[str, Surface], Box]:
    """The part of a surface that is near the diagonals at the study's own parameters, and its hull."""
    near = plan.bound["diagonal"].filter.near(surface)
    if len(near.start) < 2:
        raise FitError(
            f"the family {surface.name!r} has {len(near.start)} states near the diagonals on the grid; expected: 2 or more"
        )
    hull = np.stack([near.start.min(axis=0), near.start.max(axis=0)], axis=1)
    return {surface.name: near}, Box.of(surface.coordinates, hull)


def _orders(result: "StudyResult") -> list[dict[str, Any]]:
    """The fits near the diagonals by delta and order; by order for an earlier run with a single delta."""
    if not result.near:
        return [{"name": name} | report_numbers(report) for name, report in result.orders]
    fits = [(near.delta, name, fitted.report) for near in result.near for name, fitted in near.maps.items()]
    return [{"delta": delta, "name": name} | report_numbers(report) for delta, name, report in fits if report]
