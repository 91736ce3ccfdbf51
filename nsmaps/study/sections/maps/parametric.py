"""The section `parametric`: the composite map as a function of a parameter."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from nsmaps.reduced.composite.parametric import ParametricMap, chebyshev_nodes, parametric_map, report_on
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.texts import finite, yes
from nsmaps.study.estimates import Size
from nsmaps.study.reading.values import SPEC, in_order
from nsmaps.study.sections.base import Need, Section, Verdict, claimed
from nsmaps.study.sections.maps.composite import pieces_size, refits
from nsmaps.study.sections.maps.surfaces import grid_size

if TYPE_CHECKING:
    from nsmaps.study.sections.base import Binding, ImpactSystem, Plan, Study, StudyResult


class ParametricSection(BaseModel):
    """The composite map with coefficients that are polynomials of a parameter, from its values at Chebyshev nodes."""

    model_config = SPEC
    parameter: str
    low: Number = Field(alias="from")
    high: Number = Field(alias="to")
    order: int = Field(4, ge=0, le=20)
    nodes: int | None = Field(None, ge=1, le=100)  #: one more than twice the order if omitted
    require: tuple[Literal["follows"], ...] = ()
    _in_order = model_validator(mode="after")(in_order)

    @model_validator(mode="after")
    def _enough(self) -> Self:
        if self.nodes is not None and self.nodes <= self.order:
            raise ValueError(f"{self.nodes} nodes for order {self.order}; expected: more nodes than the order")
        return self


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored:
    """The fields of a result for parametric map."""

    parametric: "ParametricMap | None" = None


def _needs(spec: ParametricSection) -> Iterator[Need]:
    yield ("parametric",), "'parametric'", "composite"


def _bind(spec: ParametricSection, binding: "Binding") -> None:
    binding.swept_values(("parametric",), spec.parameter, (spec.low, spec.high))


def _compute(spec: ParametricSection, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
    """The parametric map from the maps at its nodes, compared with refits between them."""
    ends = (spec.low, spec.high)
    nodes = chebyshev_nodes(*ends, spec.nodes or 2 * spec.order + 1)
    with plan.study.source.located(("parametric",)):
        at_nodes = {value: composite for value, composite, _ in refits(plan, spec.parameter, nodes, 0)}
        map = parametric_map(at_nodes, spec.parameter, *ends, spec.order)
        held = refits(plan, spec.parameter, np.array([ends[0], *(nodes[1:] + nodes[:-1]) / 2, ends[1]]), 1)
        return {"parametric": replace(map, report=report_on(map, held) if held[0][2] else None)}


def _describe(spec: ParametricSection, study: "Study") -> str:
    return f"order {spec.order} in {spec.parameter} from {spec.low:g} to {spec.high:g}"


def _size(spec: ParametricSection, study: "Study", system: "ImpactSystem") -> Size:
    nodes, pieces = spec.nodes or 2 * spec.order + 1, pieces_size(study)
    return (grid_size(study) + Size(seconds=pieces.seconds)).times(2 * nodes + 1) + Size(memory=pieces.memory)


def _numbers(result: "StudyResult") -> dict[str, Any]:
    """The largest errors over all held-out values, one per output, by piece."""
    map = result.parametric
    if map is None:
        return {}
    report = map.report
    worst = {} if report is None else {key: getattr(report, key).max(axis=1) for key in ("refit", "error", "difference")}
    names = () if report is None else report.names
    pieces = {name: {key: finite(errors[k]) for key, errors in worst.items()} for k, name in enumerate(names)}
    ends = {"parameter": map.parameter, "from": map.low, "to": map.high, "condition": map.condition}
    held = [] if report is None else report.values.tolist()
    return {"parametric": ends | {"nodes": map.nodes.tolist(), "held_out": held, "pieces": pieces}}


def _verdicts(result: "StudyResult") -> Iterator[Verdict]:
    map, section = result.parametric, result.study.parametric
    if map is None or section is None or map.report is None or not map.report.names:
        return
    report = map.report
    share = report.difference / report.refit
    k, h, i = np.unravel_index(np.argmax(share), share.shape)
    difference = (
        f"{report.difference[k, h, i]:.2g} from the map fitted there, which is {report.refit[k, h, i]:.2g} from the exact one"
    )
    where = f"at worst ({map.coordinates.names[i]} of {report.names[k]} at {map.parameter} = {report.values[h]:.4g})"
    text = f"{yes(report.follows)}: {where} {difference}; {len(report.values)} values held out"
    yield claimed(section, "follows", "parametric: follows", "parametric map", report.follows, text)


PARAMETRIC = Section[ParametricSection](
    key="parametric",
    type=ParametricSection | None,
    stored=Stored,
    holds={"reduced.composite.parametric": ("ParametricMap", "ParametricReport")},
    needs=_needs,
    bind=_bind,
    compute=_compute,
    describe=_describe,
    size=_size,
    numbers=_numbers,
    verdicts=_verdicts,
)
