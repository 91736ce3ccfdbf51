"""The report on a fit: errors at its data and warnings."""

from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.reduced.fit.leastsquares import Solved, left_out
from nsmaps.reduced.fit.polymap import FitReport, PolyMap

ILL_CONDITIONED = 1e8  #: condition above which half of a float's digits are lost in the fit
POOR = 0.9  #: a fit with R2 below this gives a warning
UNBOUND = 10.0  #: a point whose error grows by this factor when it is left out indicates an order that is too high


@dataclass(frozen=True, slots=True, eq=False)
class FitData:
    """The data of a fit."""

    start: Floats  # (M, n)
    target: Floats  # (M, n)
    rows: tuple[Bools, ...]  # the states used, for each output
    solved: tuple[Solved, ...]  # for each output
    wound: tuple[int, ...] = ()  # outputs of maps of the whole circle


def report_on(polymap: PolyMap, data: FitData) -> FitReport:
    """The errors of a fitted map at its data, with warnings."""
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
        terms=np.array([len(solved.coefficients) for solved in data.solved]),
        left_out=np.array(alone),
        loss=np.array([solved.loss for solved in data.solved]),
    )
    warnings = [text for i in range(len(used)) for text in _warnings(report, data, error[:, i], i)]
    return replace(report, warnings=tuple(warnings))


def _warnings(report: FitReport, data: FitData, error: Floats, i: int) -> list[str]:
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
    if report.coordinates.angles[i] and outside > 0 and i not in data.wound:
        where = f"{name}' reaches from {y.min():.4g} to {y.max():.4g}, {100 * outside:.3g} % of it outside [0, 2 pi)"
        more = "; flights of different numbers of periods may be mixed in it" if np.ptp(y) > TWO_PI else ""
        texts.append(f"{where}{more}")
    return texts
