"""The section `lyapunov`: Lyapunov exponents of the exact map over a parameter."""

from collections.abc import Iterator
from itertools import groupby
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from nsmaps.arrays import Floats
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import each_text, percent, plain, range_text, returns_text, span_text
from nsmaps.study.estimates import COPIES, DERIVED, STATE, VALUE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Range, Starts, Transient
from nsmaps.study.sections.base import Analysis, Finding, Table, Verdict
from nsmaps.study.sections.parameters.bifurcation import missing_values
from nsmaps.study.sections.parameters.motions import Row

if TYPE_CHECKING:
    from nsmaps.dynamics.lyapunov import LyapunovSweep
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

ROWS = 12  #: largest number of intervals in a table
SURE = 2.0  #: standard errors from zero, beyond which an exponent has a sign
SIGNS = {1: "above zero", -1: "below zero", 0: "not distinguished from zero", None: "none: no map, or the orbit ends"}


class LyapunovSection(Range, Analysis):
    """Lyapunov exponents of the exact map over a parameter."""

    key: ClassVar[str] = "lyapunov"
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "parameters.lyapunov",
            "The Lyapunov exponents against the parameter with bands of two standard errors.",
            "The Lyapunov exponents over the parameter, per return and per unit of time, with bands of two standard errors. "
            "Neighbouring orbits diverge where an exponent is positive.",
            (FigurePart("Lyapunov exponents", ("lyapunov",)),),
        ),
    )

    starts: Starts = Field(description="the starts at each value; where values are followed, at the first of them")
    n_returns: int = Field(10_000, ge=32, description="returns over which is averaged, after the transient")
    transient: Transient = 1000
    direction: Literal["up", "down"] | None = Field(None, description="start each orbit where the one at the value before ended")

    def bind(self, binding: "Binding") -> Floats:
        binding.some_values(("lyapunov",), self)
        return binding.starts(("lyapunov", "starts"), self.starts)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        from nsmaps.dynamics.lyapunov import lyapunov

        values = np.linspace(self.low, self.high, self.points)
        how = self.model_dump(include={"n_returns", "transient", "direction"})
        return {"lyapunov": lyapunov(plan.system, self.parameter, values, plan.bound["lyapunov"], **how, parallel=plan.parallel)}

    def describe(self, study: "Study") -> str:
        returns = len(self.starts) * self.points * (self.transient + self.n_returns)
        return f"{each_text(self)}; {returns_text(returns)} with derivatives"

    def size(self, study: "Study", system: "System") -> Size:
        return Size(VALUE + DERIVED * (self.transient + self.n_returns), COPIES * STATE).times(self.points * len(self.starts))

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """Exponents and their errors at each value, per return and per unit of time."""
        sweep = result.lyapunov
        names = "exponents", "error", "per_time", "per_time_error"
        defect = sweep.defect[np.isfinite(sweep.defect)]
        worst = float(defect.max()) if defect.size else None
        rows = {name: plain(getattr(sweep, name)) for name in names}
        return {"lyapunov": {"values": sweep.values.tolist(), **rows, "largest_defect": worst}}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        yield from missing_values("lyapunov", result.system.map_name, result.lyapunov.reasons)

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """Where the largest exponent is positive, and its greatest value."""
        sweep = result.lyapunov
        if not np.isfinite(sweep.exponents[:, 0]).any():
            return
        largest, error, name = sweep.exponents[..., 0].ravel(), sweep.error[..., 0].ravel(), self.parameter
        with np.errstate(invalid="ignore"):
            chaos = largest > SURE * error
        where = f" from {sweep.values[chaos].min():.6g} to {sweep.values[chaos].max():.6g}" if chaos.any() else ""
        top = int(np.nanargmax(largest))
        text = f"the largest Lyapunov exponent is positive, as in chaos, at {chaos.sum()} of {len(chaos)} values of {name}{where}"
        value = f"{largest[top]:.3g} +- {error[top]:.1g}"
        meaning = f"the greatest exponent per return, at {name} = {sweep.values[top]:.6g}"
        shares = (percent(float(chaos.mean())), f"of the values of {name} have a positive exponent")
        yield Finding(result.system.map_name, text, ((value, meaning), shares))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The intervals over which the largest exponent has one sign, those with most values."""
        sweep = result.lyapunov
        rows = exponent_rows(sweep)
        widest = sorted(sorted(range(len(rows)), key=lambda k: -rows[k]["values"])[:ROWS])
        listed = [
            (row["sign"], f"{row['from']:.9g}", f"{row['to']:.9g}", str(row["values"]), row["exponent"])
            for row in (rows[k] for k in widest)
        ]
        more = f" There are {len(rows) - ROWS} more intervals, with fewer values." if len(rows) > ROWS else ""
        decided = f"Decided at two standard errors, of {sweep.n_returns} returns."
        note = f"Above zero: nearby orbits diverge, as in chaos. {decided}{more}"
        heads = "largest exponent", f"{self.parameter} from", "to", "values", "per return"
        yield Table(f"Lyapunov exponents of the {result.system.map_name}", heads, tuple(listed), (note,))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The range of the parameter, and at how many values an exponent is positive."""
        found = result.lyapunov
        positive = int(found.positive.reshape(len(found.values), -1).any(axis=1).sum())
        text = f"the largest exponent exceeds two standard errors at {positive} of them"
        return f"{at(result, (self.parameter,))}{range_text(self)}; {text}."


def exponent_rows(sweep: "LyapunovSweep") -> list[Row]:
    """The intervals over which the largest exponent has one sign, ascending: `sign`, `from`, `to`, `values`, `exponent`.

    A sign is that of more than two standard errors; `exponent` is the range of the largest one of all starts, per return.
    """
    order = np.argsort(sweep.values, kind="stable")
    values, exponents = sweep.values[order], sweep.exponents[order, ..., 0].reshape(len(order), -1)
    of = np.arange(len(order)), np.where(np.isnan(exponents), -np.inf, exponents).argmax(axis=1)
    largest, error = exponents[of], sweep.error[order, ..., 0].reshape(exponents.shape)[of]
    signs = [_sign(value, wide) for value, wide in zip(largest.tolist(), error.tolist(), strict=True)]
    rows = list[Row]()
    for sign, run in groupby(range(len(signs)), key=signs.__getitem__):
        own = list(run)
        about = {"sign": SIGNS[sign], "from": float(values[own[0]]), "to": float(values[own[-1]]), "values": len(own)}
        rows.append(about | {"exponent": span_text(largest[own], "")})
    return rows


def _sign(value: float, error: float) -> int | None:
    if np.isnan(value):
        return None
    return 0 if abs(value) <= SURE * error else 1 if value > 0 else -1
