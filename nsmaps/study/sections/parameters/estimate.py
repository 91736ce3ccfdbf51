"""The section `estimate`: parameters of the system from measured records, in the study or in CSV files beside it."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field

from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.estimates import POINT, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Bounds, Section, Seed
from nsmaps.study.sections.base import Analysis, Finding, Table, Verdict, verdict

if TYPE_CHECKING:
    from nsmaps.estimation.records import Record
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

POINTS = 400  #: of a start, for an estimate of the time
FOUND: FigurePart[Any] = FigurePart("an estimate from measured data", ("estimate",))


class RecordSection(Section):
    """A record: a CSV file beside the study, or times of impacts."""

    file: str = Field(
        "", description="a CSV file beside the study: a column `time`, perhaps `wall`, `speed`, `noise`, `speed_noise`, or states"
    )
    times: tuple[Number, ...] = Field((), description="times of impacts, in place of a file")
    walls: tuple[str, ...] | None = Field(None, description="the wall of each impact; unknown by default")
    noise: Number | None = Field(None, gt=0, description="standard deviation of the times; unknown by default")
    speed_noise: Number | None = Field(None, gt=0, description="standard deviation of speeds")
    sample_noise: Number | None = Field(None, gt=0, description="standard deviation of sampled states")
    phase: Number | None = Field(None, description="phase of the forcing at time zero, radians; unknown by default")
    time_unit: Number = Field(1.0, gt=0, description="the system's unit of time in that of the record")
    length_unit: Number = Field(1.0, gt=0, description="the system's unit of displacement in that of the record")

    def record(self, folder: Path) -> "Record":
        """The record, a file in the folder of the study or else in the current one. DataError if it cannot be used."""
        from nsmaps.estimation.records import Record

        given = self.model_dump(include={"noise", "speed_noise", "sample_noise", "phase"}, exclude_unset=True)
        units: dict[str, Any] = {"time_unit": self.time_unit, "length_unit": self.length_unit, "name": self.file}
        if self.file:
            beside = folder / self.file
            return Record.read(beside if beside.is_file() else self.file, **given, **units)
        return Record.of(self.times, self.walls, **given, **units)


class EstimateSection(Analysis):
    """Parameters estimated from measured records, with their errors, as by `nsmaps.estimate`."""

    key: ClassVar[str] = "estimate"
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "estimation.estimate",
            "Residuals of impact times within bands of one and two standard deviations, and the region of the parameters.",
            "Residuals of impact times in standard deviations, with missed and spurious impacts, and the parameters with their "
            "regions of 68 and 95 %.",
            (FOUND,),
        ),
    )

    data: tuple[RecordSection, ...] = Field(min_length=1, description="the records")
    free: Bounds = Field(min_length=1, description="the parameters to be estimated, with their bounds")
    guess: dict[str, Number] = Field(
        default_factory=dict,
        description="guesses of parameters and of coordinates of the section; by default the system's parameters",
    )
    n_guesses: int = Field(33, ge=1, description="points from which it is searched, the guess among them")
    loss: Literal["linear", "soft_l1", "huber", "cauchy", "arctan"] = Field(
        "linear", description="loss of the residuals; all but `linear` are robust against outliers"
    )
    n_returns: Number = Field(8.0, gt=0, description="returns of a segment, approximately")
    transient: Number = Field(0.0, ge=0, description="time omitted at the beginning of each record, in its unit")
    rng: Seed = 0

    def bind(self, binding: "Binding") -> "tuple[Record, ...]":
        from nsmaps.estimation.space import space_of

        source, records = binding.study.source, []
        for name in self.free:
            source.known(("estimate", "free", name), name, binding.system.parameters, "parameter", key=True)
        with source.located(("estimate", "guess")):
            space_of(binding.system, self.free, dict(self.guess))
        for number, spec in enumerate(self.data):
            with source.located(("estimate", "data", number)):
                records.append(spec.record(Path(source.name).parent))
        return tuple(records)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The estimate."""
        from nsmaps.estimation.estimate import estimate

        how: Any = {name: getattr(self, name) for name in ("free", "guess", "n_guesses", "loss", "transient", "n_returns", "rng")}
        return {"estimate": estimate(plan.system, plan.bound["estimate"], **how)}

    def describe(self, study: "Study") -> str:
        return f"{', '.join(self.free)} from {len(self.data)} records, {self.n_guesses} guesses"

    def size(self, study: "Study", system: "System") -> Size:
        return Size(POINT * POINTS * self.n_guesses)

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        found = result.estimate
        rows = {"values": found.parameters, "errors": dict(zip(found.names, found.errors.tolist(), strict=True))}
        fit = {"chi2": found.chi2, "dof": found.dof, "describes": found.describes, "undetermined": list(found.undetermined)}
        fit |= {"unit_factor": found.unit_factor} if found.unit_factor else {}
        return {"estimate": rows | fit | {"unpaired": int(found.minima.unpaired[0])}}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        found = result.estimate
        text = f"chi2 {found.chi2:.4g} of {found.dof} degrees of freedom{found.other_unit}"
        yield verdict("estimate: the model describes the data", result.system.map_name, found.describes, text)

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        from nsmaps.estimation.result import shown

        found = result.estimate
        each = [f"{name} = {shown(a, b)}" for name, a, b in zip(found.names, found.values, found.errors, strict=True)]
        yield Finding(result.system.map_name, f"the data give {', '.join(each)}", tuple((one, "estimate") for one in each))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The parameters with their intervals, and the minima."""
        found = result.estimate
        rows = [
            (name, f"{value:.6g}", f"{error:.2g}", f"{low:.6g} to {high:.6g}")
            for name, value, error, (low, high) in zip(
                found.names, found.values, found.errors, found.intervals[:, 1].tolist(), strict=True
            )
        ]
        yield Table("Estimates", ("parameter", "value", "standard error", "95 %"), tuple(rows))
        minima = found.minima
        each = zip(minima.values.tolist(), minima.chi2, minima.unpaired, minima.weights, strict=True)
        texts = tuple(
            (", ".join(f"{x:.5g}" for x in values), f"{chi2:.5g}", str(alone), f"{weight:.2g}")
            for values, chi2, alone, weight in each
        )
        yield Table("Minima", (", ".join(found.names), "chi2", "unpaired impacts", "weight"), texts)
