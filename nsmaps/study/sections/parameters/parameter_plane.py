"""The section `parameter_plane`: the attractors at every pixel of the plane of two parameters."""

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from nsmaps.arrays import Floats
from nsmaps.dynamics.motion import kinds_explained
from nsmaps.exact.observables.spec import Observable
from nsmaps.progress import beat
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import computed_text, percent, range_text, returns_text, shares_text
from nsmaps.study.estimates import COPIES, RETURN, STATE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.values import MaxPeriod, Range, Span, Starts, Tolerance, Transient
from nsmaps.study.sections.base import Finding, Quantified, Quantifiers, Table, Verdict
from nsmaps.study.sections.parameters.bifurcation import missing
from nsmaps.study.sections.parameters.curves import (
    CurveSection,
    check_curves,
    curve_of,
    missing_curves,
    plain_curves,
    plane_finding,
)
from nsmaps.study.sections.parameters.motions import NONE

if TYPE_CHECKING:
    from nsmaps.dynamics.design.optimum import Optimum
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

ROWS = 12  #: largest number of motions in a table


class ParameterPlaneSection(Quantified):
    """Attractors of the exact map at every pixel of two parameters, from one start or several, with bifurcation curves.

    With `refine` the attractors of a neighbour are continued to pixels not computed from the starts; random pixels are computed
    too, and bound the share at which the starts reach others. Pixels that the system refuses are counted in a verdict.
    """

    key: ClassVar[str] = "parameter_plane"
    quantified: ClassVar[str] = "nsmaps.dynamics.planes.plane:ParameterPlane"
    results: ClassVar[Mapping[str, Any]] = {
        "parameter_plane": None,
        "plane_curves": {},  #: by event and branch
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "parameters.parameter_plane",
            "The plane of two parameters coloured by what attracts: its period or motion, and its largest Lyapunov exponent.",
            "The attractor of the first start at each pixel of two parameters: its period in returns, each complete chatter with "
            "the release after it one, or its motion, black where it is chaotic, and its largest Lyapunov exponent per return, "
            "of which 2 % lie beyond each end of the colours, with bifurcation curves of branches. Another initial state may "
            "converge to another motion. Hatched are pixels with several attractors, crossed those whose parameters the system "
            "refuses, dotted what was not computed.",
            (FigurePart("a plane of two parameters", ("parameter_plane",)), optional("plane_curves"), optional("optimize")),
        ),
    )

    axes: dict[str, Span] = Field(
        min_length=2, max_length=2, description="values of two parameters; orbits are followed along the first"
    )
    starts: Starts = Field(description="the starts of the orbits of each pixel")
    n_returns: int = Field(
        1000, ge=2, description="returns after the transient of which exponents are means, at least 2 `max_period`"
    )
    transient: Transient = 1000
    max_period: MaxPeriod = 32
    direction: Literal["up", "down", "both"] | None = Field(
        None, description="start each orbit of a row where the one before it ended, in this order of the first parameter"
    )
    tolerance: Tolerance = 1e-6
    refine: Literal[2, 4, 8, 16, 32, 64, 128] | None = Field(
        None,
        description="spacing of the pixels computed first; others where motions differ or have no period; not with `direction`",
    )
    observables: tuple[str | Observable, ...] = Field(
        (), description="names or formulas whose means are taken along each orbit, per period of the forcing"
    )
    quantifiers: Quantifiers = Field(default_factory=dict)
    bifurcation_curves: tuple[CurveSection, ...] = Field((), description="events of branches followed in both parameters")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.n_returns < 2 * self.max_period:
            text = f"{self.n_returns} 'n_returns' hold no period up to {self.max_period} twice"
            raise ValueError(f"{text}; expected: 2 'max_period'")
        if self.refine and self.direction:
            raise ValueError("orbits that are followed need every pixel; expected: no 'direction', or no 'refine'")
        return self

    @property
    def ranges(self) -> list[Range]:
        """The values of both parameters with their names."""
        return [Range(parameter=name, **span.model_dump()) for name, span in self.axes.items()]

    @property
    def values(self) -> dict[str, Floats]:
        """The values of both parameters, shapes (V,) and (W,)."""
        return {name: np.linspace(span.low, span.high, span.points) for name, span in self.axes.items()}

    @property
    def pixels(self) -> int:
        """The number of points of the plane."""
        return math.prod(span.points for span in self.axes.values())

    def check(self, study: "Study") -> None:
        check_curves(self.key, next(iter(self.axes)), self.bifurcation_curves, study)

    @property
    def orbits(self) -> int:
        """The number of orbits of a pixel."""
        return len(self.starts) * (2 if self.direction == "both" else 1)

    def bind(self, binding: "Binding") -> Floats:
        self.functions(binding.study)
        for axis in self.ranges:
            loc = ("parameter_plane", "axes", axis.parameter)
            binding.study.source.known(loc, axis.parameter, binding.system.parameters, "parameter", key=True)
            binding.some_values(loc, axis)
        if self.observables:
            from nsmaps.exact.observables.formulas import resolve_observables

            with binding.study.source.located(("parameter_plane", "observables")):
                resolve_observables(binding.system, self.observables)
        return binding.starts(("parameter_plane", "starts"), self.starts)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The plane, and the curves of bifurcations."""
        from nsmaps.dynamics.planes.parameter_plane import parameter_plane

        how = self.model_dump(include={"n_returns", "transient", "max_period", "direction", "tolerance", "refine"})
        how |= {"observables": self.observables, "quantifiers": self.functions(plan.study)}
        parallel = plan.portion(0, 1 + len(self.bifurcation_curves))
        diagram = parameter_plane(plan.system, self.values, plan.bound["parameter_plane"], **how, parallel=parallel)
        curves = {}
        for number, each in enumerate(self.bifurcation_curves, 2):
            curves[f"{each.event} of {each.branch}"] = curve_of(plan, result, each, self.ranges[1])
            beat(number / (1 + len(self.bifurcation_curves)))
        return {"parameter_plane": diagram, "plane_curves": curves}

    def describe(self, study: "Study") -> str:
        values = " x ".join(f"{axis.points} values of {axis.parameter}" for axis in self.ranges)
        some = ", at most" if self.refine else ""
        return f"{values}{some}; {returns_text(self.pixels * self.orbits * (self.transient + self.n_returns))}"

    def size(self, study: "Study", system: "System") -> Size:
        return Size(RETURN * (self.transient + self.n_returns), COPIES * STATE).times(float(self.pixels) * self.orbits)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """The fraction of the pixels with each motion, with several attractors and without a map, and the curves."""
        found = result.parameter_plane
        shares = {name or NONE: share for name, share in found.shares().items()}
        about: dict[str, Any] = {"coexisting": float((found.counts > 1).mean()), "refused": int(found.refused.sum())}
        work: dict[str, float] = {"computed": int(found.computed.sum()), "returns": found.n_returns}
        work |= {"probes": found.probes, "differing": found.differing, "most_differing": found.most_differing}
        ranges = {name: _range(found.means[..., k]) for k, name in enumerate(found.observables)}
        if found.quantifiers:
            about["quantifiers"] = {name: _range(values) for name, values in found.quantifiers.items()}
        return {
            "parameter_plane": {
                "shares": shares,
                "observables": ranges,
                **about,
                **work,
                "curves": plain_curves(result.plane_curves),
            }
        }

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The share of each motion, where several coexist, and the bifurcation curves."""
        found = result.parameter_plane
        several = float((found.counts > 1).mean())
        more = ((percent(several), "of the pixels have several attractors"),) if several else ()
        yield plane_finding(result.system.map_name, self.ranges, found.shares(), result.plane_curves, more)

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        found = result.parameter_plane
        if found.refused.any():
            of, none = result.system.map_name, int(found.refused.sum())
            yield missing("parameter_plane", of, none, f"{found.refused.size} pixels", found.reason)
        yield from missing_curves(result.system.map_name, result.plane_curves)

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The motions and the share of the pixels in which each attracts."""
        found = result.parameter_plane
        shares = found.shares()
        rows = tuple((name or NONE, f"{100 * share:.3g} %") for name, share in list(shares.items())[:ROWS])
        notes = [f"Several motions attract at {100 * (found.counts > 1).mean():.3g} % of the pixels."]
        notes += [computed_text(found)] if not found.computed.all() else []
        notes += [f"There are {len(shares) - ROWS} more motions."] if len(shares) > ROWS else []
        explained = kinds_explained(name for name, _ in rows)
        notes += [f"{explained}."] if explained else []
        yield Table("Motions over two parameters", ("motion", "pixels"), rows, tuple(notes))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The ranges of both parameters, the share of each motion, and of what coexists or is refused."""
        found = result.parameter_plane
        refused = f"; the system refuses the parameters of {int(found.refused.sum()):,} pixels" if found.refused.any() else ""
        filled = "" if found.computed.all() else f" {computed_text(found)}"
        over = ", ".join(map(range_text, self.ranges))
        motions = {label or "none": share for label, share in found.shares().items()}
        text = (
            f"{over}; motions {shares_text(motions)}; several at {100 * (found.counts > 1).mean():.3g} % of the pixels{refused}."
        )
        return f"{at(result, tuple(self.axes))}{text}{filled}{self._star(result.optimize)}"

    def _star(self, found: "Optimum | None") -> str:
        """A sentence on the optimum that the figure shows."""
        if found is None or not set(self.axes) <= set(found.parameters):
            return ""
        where = ", ".join(f"{name} = {value:.5g}" for name, value in found.parameters.items())
        value = " ".join(filter(None, (f"{found.value:.5g}", found.observable.unit, f"per {found.per}")))
        return f" The star is the {found.sense}imum of {found.observable.name} of {found.orbit.label}: {value} at {where}."


def _range(values: Floats) -> list[float | None]:
    """The least and the greatest finite value."""
    some = values[np.isfinite(values)]
    return [float(some.min()), float(some.max())] if some.size else [None, None]
