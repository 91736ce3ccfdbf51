"""The section `observe`: means of quantities on the orbits, diagrams, branches and basins of the exact map."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.arrays import Floats
from nsmaps.exact.observables.spec import Observable
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import LISTED, plain, returns_text
from nsmaps.study.estimates import DERIVED, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.sections.base import Analysis, Finding, Table
from nsmaps.study.sections.parameters.branches import map_of_branch

if TYPE_CHECKING:
    from nsmaps.dynamics.observables.cycles import CycleMeans
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

OF = ("orbits", "bifurcation_diagram", "branches", "basins")  #: sections whose results have observables


def _along_parameters(result: "StudyResult") -> Mapping[str, Any]:
    """The means along parameters: of a bifurcation diagram and of branches, by name."""
    diagram = {name: means for name, means in result.observe.items() if name == "bifurcation_diagram"}
    return {**diagram, **{name: parts for name, parts in result.branch_observables.items() if parts}}


OBSERVABLES: "FigurePart[Mapping[str, Any]]" = FigurePart(
    "observables along a parameter",
    ("observe",),
    _along_parameters,
    "'observe', and a 'bifurcation_diagram' of the exact map or 'branches'",
    lambda study: bool(study.bifurcation_diagram or study.branches),
)


class ObservablesSection(Analysis):
    """Means of quantities of impacts, flights and returns.

    They are taken on the last states of `orbits`, at every value of the exact `bifurcation_diagram`, on `branches` with their
    derivatives, and on the attractors of `basins`; one of these is needed. Names that systems have: `impacts`; of an impact
    system `speed`, `loss`, `momentum`, `displacement`, `work`, `damping`; of a map without motions its coordinates, and of an
    angle `phi` its turns `phi_turns`.
    """

    key: ClassVar[str] = "observe"
    results: ClassVar[Mapping[str, Any]] = {
        "observe": {},  #: by section: of orbits, the diagram, the basins
        "branch_observables": {},  #: by branch, of parts with orbits
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "longrun.observe",
            "Means of quantities such as the energy lost at impacts, over a parameter.",
            "Means of the study's observables per period of the forcing, or per return without forcing: on the attractors of "
            "the bifurcation diagram, with two standard errors, and along branches of periodic orbits, dashed where they are "
            "not stable.",
            (OBSERVABLES,),
        ),
    )

    observables: tuple[str | Observable, ...] = Field(
        min_length=1,
        description="names that the system has, such as `loss` or a coordinate of a map without motions, or formulas",
    )
    n_returns: int = Field(1000, ge=1, description="returns of each orbit over which is averaged")

    def check(self, study: "Study") -> None:
        if not any(study.names(section) for section in OF):
            raise study.source.error(("observe",), f"there is nothing to observe; expected: one of the sections {', '.join(OF)}")

    def bind(self, binding: "Binding") -> tuple[Observable, ...]:
        from nsmaps.exact.observables.formulas import resolve_observables, vocabulary_of

        source = binding.study.source
        vocabulary = vocabulary_of(binding.system)
        for number, given in enumerate(self.observables):
            loc = ("observe", "observables", number)
            with source.located(loc):
                if isinstance(given, str):
                    resolve_observables(binding.system, [given])
                    continue
                one = vocabulary.whole(given)
            if one.of not in vocabulary.inputs:
                with source.located((*loc, "of")):
                    vocabulary.rows(one)
            for key, text in (("formula", one.formula), ("per", one.per)):
                if text:
                    with source.located((*loc, key)):
                        vocabulary.read(text, str(one.of))
            with source.located((*loc, *["at"] * bool(one.at))):
                vocabulary.rows(one)
        return resolve_observables(binding.system, self.observables)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """Means on the last states of orbits, at every value of the diagram, on branches, and on the attractors of basins."""
        from nsmaps.dynamics.observables.attractors import attractor_means
        from nsmaps.dynamics.observables.observe import observe

        chosen, system, study = plan.bound["observe"], plan.system, plan.study
        means, branches = {}, {}
        if result.orbits:
            last = np.stack([pair.exact.final for pair in result.orbits])
            periods = [pair.ends.period if pair.ends else 0 for pair in result.orbits]
            means["orbits"] = attractor_means(system, last, periods, chosen, self.n_returns)
        if study.bifurcation_diagram is not None and "exact" in result.bifurcation_diagram:
            means["bifurcation_diagram"] = observe(system, result.bifurcation_diagram["exact"], chosen, n_returns=self.n_returns)
        for section in study.branches:
            model, parts = map_of_branch(section, system), result.branches.get(section.name, ())
            branches[section.name] = tuple(observe(model, part, chosen) for part in parts if len(part.values))
        if result.basins is not None:
            means["basins"] = observe(system, result.basins, chosen, n_returns=self.n_returns)
        return {"observe": means, "branch_observables": branches}

    def describe(self, study: "Study") -> str:
        names = ", ".join(one if isinstance(one, str) else one.name for one in self.observables)
        return f"{names}; {returns_text(self.n_returns)} of each orbit"

    def size(self, study: "Study", system: "System") -> Size:
        values = study.bifurcation_diagram.points * study.bifurcation_diagram.ways if study.bifurcation_diagram is not None else 0
        return Size(DERIVED * self.n_returns).times(float(len(study.orbits) + values + 2 * bool(study.basins)))

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """Means and errors by section and observable, and on branches the least and largest with the derivatives at both ends."""
        found: dict[str, Any] = {}
        for section, means in result.observe.items():
            per, mean = means.shown
            rows = {
                name: {"unit": one.unit, "value": plain(mean.value[..., k].ravel()), "error": plain(mean.error[..., k].ravel())}
                for k, (name, one) in enumerate(zip(means.names, means.observables, strict=True))
            }
            found[section] = {"per": per} | rows
        for branch, parts in result.branch_observables.items():
            found.setdefault("branches", {})[branch] = [_part(part) for part in parts]
        return {"observe": found}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The mean of each observable, or the range of its means, on each section's motions."""
        rows = [row for table in self.tables(result) for row in table.rows]
        if rows:
            texts = [f"{name} of the {of.replace('_', ' ')}: {value}" for of, name, value in rows]
            numbers = tuple((value, f"mean {name} of the {of.replace('_', ' ')}") for of, name, value in rows)
            yield Finding(result.system.map_name, f"means of {', '.join(texts[:LISTED])}", numbers)

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """Each observable on each section's motions: a value with its error, or the range of values."""
        rows = list[tuple[str, ...]]()
        for section, means in result.observe.items():
            per, mean = means.shown
            for k, one in enumerate(means.observables):
                flat = mean.value.reshape(-1, len(means.observables))[:, k]
                rows.append((section, " ".join(filter(None, (one.name, _unit(one, per)))), _values(flat)))
        for branch, parts in result.branch_observables.items():
            for k, one in enumerate(parts[0].observables if parts else ()):
                per = parts[0].shown[0]
                flat = np.concatenate([part.shown[1].value[:, k] for part in parts])
                rows.append((f"branch {branch}", " ".join(filter(None, (one.name, _unit(one, per)))), _values(flat)))
        if rows:
            yield Table(f"Observables of the {result.system.map_name}", ("of", "observable", "mean"), tuple(rows))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The names of the observables, and the number of returns over which is averaged."""
        study = result.study
        varied = [sweep.parameter for sweep in (study.bifurcation_diagram, *study.branches) if sweep is not None]
        names = ", ".join(one if isinstance(one, str) else one.name for one in self.observables)
        return f"{at(result, varied)}{names}; {returns_text(self.n_returns)} of each orbit."


def _part(part: "CycleMeans") -> dict[str, Any]:
    per, slope = part.shown
    ends = {
        name: {"value": plain(slope.value[:, k]), "derivative": plain(slope.derivative[:, k])}
        for k, name in enumerate(part.names)
    }
    return {"per": per} | ends


def _unit(one: Observable, per: str) -> str:
    """The unit of a mean: none of a quotient, and of a largest value that of the values."""
    parts = [one.unit, "" if one.per or one.largest else per]
    return " ".join(filter(None, parts))


def _values(values: Floats) -> str:
    """A few values, or the range of many; those of orbits that ended are left out."""
    known = values[np.isfinite(values)]
    if not len(known):
        return "none"
    if len(known) <= 3:
        return ", ".join(f"{value:.6g}" for value in known)
    return f"{known.min():.6g} to {known.max():.6g}"
