"""The numbers of the long run that a reader looks for."""

from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.exact.impacts import Floats
from nsmaps.study.result import NoiseResult, StudyResult

if TYPE_CHECKING:
    from nsmaps.dynamics.basins import Basins, Boundary
    from nsmaps.dynamics.lyapunov import LyapunovSweep


def long_run(result: StudyResult) -> dict[str, Any]:
    """The numbers of Lyapunov exponents, basins and noise, by section; of those that were computed."""
    sections: dict[str, Any] = {}
    if result.lyapunov is not None:
        sections["lyapunov"] = _lyapunov(result.lyapunov)
    if result.basins is not None:
        sections["basins"] = _basins(result.basins, result.boundary)
    if result.noise is not None:
        sections["noise"] = _noise(result.noise)
    return sections


def _plain(table: Floats) -> Any:
    """An array as lists of numbers that JSON knows: None where there is none."""
    kept = np.asarray(table, float).astype(object)
    kept[~np.isfinite(table)] = None
    return kept.tolist()


def _lyapunov(made: "LyapunovSweep") -> dict[str, Any]:
    """A row a value: exponents and their errors, a return and a unit of time."""
    names = "exponents", "error", "per_time", "per_time_error"
    defect = made.at.defect[np.isfinite(made.at.defect)]
    worst = float(defect.max()) if defect.size else None
    return {"values": made.values.tolist(), **{name: _plain(getattr(made.at, name)) for name in names}, "largest_defect": worst}


def _basins(made: "Basins", line: "Boundary | None") -> dict[str, Any]:
    """Each attractor with its share of the grid, its slowest start and its distance from the boundary of its basin."""
    rows = []
    for k, attractor in enumerate(made.attractors):
        row = {"label": attractor.label, "period": attractor.period, "words": list(attractor.words)}
        row |= {"fraction": float(made.fractions[k]), "error": float(made.fraction_error[k])}
        arrival = made.arrival[made.label == k]
        row |= {"most_returns": int(arrival.max()) if arrival.size else None}
        rows.append(row | ({} if line is None else {"distance": _plain(np.array([line.distance(k)]))[0]}))
    kinds = dict(zip(("unresolved", "ended"), made.fractions[-2:].tolist(), strict=True))
    return {"attractors": rows, **kinds, "stuck_on_the_way": float(made.stuck.mean())}


def _noise(made: NoiseResult) -> list[dict[str, Any]]:
    """A row a size of the noise."""
    rows: list[dict[str, Any]] = []
    for sigma, stay, ended in zip(made.sigma, made.stays, made.ended, strict=True):
        row = {"sigma": sigma, "modes": list(stay.modes), "time": stay.time.tolist(), "switches": stay.switches.tolist()}
        tables = {name: _plain(getattr(stay, name)) for name in ("share", "mean", "rates", "rates_error")}
        rows.append(row | tables | {"unknown": stay.unknown, "ended": ended})
    return rows
