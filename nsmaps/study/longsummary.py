"""The numbers that a reader looks for of the long run, of branches and of stability diagrams."""

from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.exact.impacts import Floats
from nsmaps.study.result import NoiseResult, StudyResult

if TYPE_CHECKING:
    from nsmaps.dynamics.basins import Basins, Boundary
    from nsmaps.dynamics.events import Event
    from nsmaps.dynamics.lyapunov import LyapunovSweep
    from nsmaps.dynamics.stability import EventCurve, StabilityDiagram
    from nsmaps.dynamics.trail import Branch


def long_run(result: StudyResult) -> dict[str, Any]:
    """The numbers of branches, stability, Lyapunov exponents, basins and noise, by section; of those that were computed."""
    sections: dict[str, Any] = {}
    if result.branches:
        sections["branches"] = {name: _branches(made) for name, made in result.branches.items()}
    if result.stability is not None:
        sections["stability"] = _stability(result.stability, result.curves)
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


def _branches(made: "Sequence[Branch]") -> dict[str, Any]:
    """Where each branch of an entry begins and ends and why, and the events on all of them."""
    parts, events = [], []
    for branch in made:
        low, high = branch.parameter[[0, -1]].tolist() if len(branch.parameter) else (None, None)
        parts.append({"period": branch.period, "orbits": len(branch.parameter), "from": low, "to": high, "ended": branch.ended})
        events += [_event(event) for event in branch.events]
    return {"parts": parts, "events": events}


def _event(event: "Event") -> dict[str, Any]:
    about = {name: getattr(event, name) for name in ("kind", "parameter", "precision", "detail")}
    return {"label": event.orbit.label, "value": known(event)} | about


def known(event: "Event") -> str:
    """The parameter of an event to the digits that are known."""
    return f"{event.parameter:.{min(max(-floor(log10(event.precision)), 0), 15)}f}"


def _stability(made: "StabilityDiagram", curves: "Mapping[str, EventCurve]") -> dict[str, Any]:
    """The share of the points that have each period, and the curves."""
    names = {0: "no period found", -1: "no attractor"}
    shares = {names.get(period, str(period)): made.share(period) for period in np.unique(made.period).tolist()}
    lines = {
        name: {"across": curve.across.tolist(), "values": _plain(curve.values), "precision": _plain(curve.precision)}
        for name, curve in curves.items()
    }
    return {"shares": shares, "curves": lines}


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
