"""The numbers of a result that a reader looks for, as plain data for result.json."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.study.longsummary import long_run
from nsmaps.study.motions import attractors, motions
from nsmaps.study.result import OrbitPair, StudyResult

if TYPE_CHECKING:
    from nsmaps.auxiliary.cover import MorseCover
    from nsmaps.auxiliary.domain import AttractingDomain
    from nsmaps.auxiliary.twocycle import TwoCycle
    from nsmaps.dynamics.bifurcation import Bifurcation
    from nsmaps.dynamics.ending import Ending
    from nsmaps.reduced.accurate import AccurateResult
    from nsmaps.reduced.parametric import ParametricMap
    from nsmaps.reduced.partition import PartitionResult
    from nsmaps.reduced.polyfit import FitReport


def numbers(result: StudyResult) -> dict[str, Any]:
    """The numbers of each section that was computed, by section."""
    sections: dict[str, Any] = {}
    if result.returns is not None:
        words, counts = np.unique(result.returns.words, return_counts=True)
        sections["returns"] = {
            "states": len(result.returns),
            "outcomes": result.returns.counts(),
            "words": dict(zip(words.tolist(), counts.tolist(), strict=True)),
            "families": {name: len(surface.returns) for name, surface in result.surfaces.items()},
        }
    if result.diagonal is not None:
        box, states = result.diagonal.box.tolist(), len(result.diagonal.start)
        sections["diagonal"] = {"box": box, "states": states, "orders": _orders(result)}
    if result.composite is not None:
        fits = {piece.name: _report(piece.map.report) for piece in result.composite.pieces if piece.map.report}
        sections["composite"] = {"covered": result.coverage and float(result.coverage.fraction), "fits": fits}
    if result.parametric is not None:
        sections["parametric"] = _parametric(result.parametric)
    if result.partition is not None:
        sections["partition"] = _partition(result.partition)
    if result.accurate is not None:
        sections["partition"] = _accurate(result.accurate)
    if result.misleads is not None:
        sections["misleads"] = {name: _finite([value])[0] for name, value in asdict(result.misleads).items()}
    if result.speed is not None:
        sections["speed"] = asdict(result.speed) | {"faster": result.speed.faster}
    if result.orbits:
        sections["orbits"] = [_orbit(pair) for pair in result.orbits]
    if result.bifurcation:
        sections["bifurcation"] = {of: _bifurcation(made) for of, made in result.bifurcation.items()}
    sections |= long_run(result)
    if result.domains:
        sections["domains"] = {name: _domain(domain) for name, domain in result.domains.items()}
    sections |= _cells(result)
    if result.second_iterate is not None:
        alpha = [float(value) for value in result.second_iterate.alpha]
        sections["second_iterate"] = {"expr": str(result.second_iterate.expr), "alpha": alpha}
    return sections


def _orders(result: StudyResult) -> list[dict[str, Any]]:
    """The fits near the diagonals by delta and order; of a run that kept those of one delta alone, by order."""
    if not result.near:
        return [{"name": name} | _report(report) for name, report in result.orders]
    fits = [(near.delta, name, made.report) for near in result.near for name, made in near.maps.items()]
    return [{"delta": delta, "name": name} | _report(report) for delta, name, report in fits if report]


def _accurate(made: "AccurateResult") -> dict[str, Any]:
    """Whether the strips meet their tolerance, and their errors at held-out states."""
    errors = {"uniform": asdict(made.uniform), "beside": asdict(made.beside)}
    return {"met": made.met, **errors, "report": asdict(made.strips.report)}


def _cells(result: StudyResult) -> dict[str, Any]:
    """What is known by enclosure: of a window, of cycles, of transient regions."""
    sections: dict[str, Any] = {}
    if result.morse is not None:
        sections["morse"] = _morse(result.morse)
    if result.cycles is not None:
        cycles = [[_finite(state) for state in cycle.states] for cycle in result.cycles.cycles]
        sections["cycles"] = {"coverage": result.cycles.coverage, "states": cycles}
    if result.transient is not None:
        rows = [
            {name: _finite([value])[0] if isinstance(value, float) else value for name, value in asdict(row).items()}
            for row in result.transient.rows
        ]
        sections["transient"] = rows
    return sections


def _partition(made: "PartitionResult") -> dict[str, Any]:
    """What the general algorithm reached, and its log as a table."""
    rows = [asdict(row) | {key: _finite(getattr(row, key)) for key in ("r2", "sse", "max_error")} for row in made.log]
    error, right_next = _finite([made.max_error, made.right_next])
    return {
        "tolerance": made.spec.tolerance,
        "met": made.met,
        "attracting": list(made.attracting),
        "unmet": list(made.unmet),
        "max_error": error,
        "held_out": made.points,
        "covered": made.covered,
        "uncovered": made.uncovered,
        "right_next": right_next,
        "arrives": dict(zip(("exact", "composite"), made.arrives, strict=True)),
        "log": rows,
    }


def _orbit(pair: OrbitPair) -> dict[str, Any]:
    ends = {"start": _finite(pair.start), "exact": _finite(pair.exact.states[-1])}
    found = {"exact": pair.ends, "composite": pair.composite_ends}
    attractors = {of: _ending(made) for of, made in found.items() if made is not None}
    ends |= {"composite": _finite(pair.composite.states[-1])} if pair.composite else {}
    return ends | ({"attractor": attractors} if attractors else {})


def _ending(made: "Ending") -> dict[str, Any]:
    """What an orbit ends on: the states of a cycle, and the hull of all that it visits."""
    pairs = [[value.real, value.imag] for value in made.multipliers.tolist()]
    hull = np.stack([made.states.min(axis=0), made.states.max(axis=0)], axis=1)
    where = {
        "states": [_finite(state) for state in made.states] if made.period else None,
        "hull": [_finite(side) for side in hull],
    }
    about = {"period": made.period, "looked_to": made.looked, "label": made.label, "words": " ".join(made.words)}
    exponent, error = _finite([made.exponent, made.exponent_error])
    return about | where | {"multipliers": pairs, "stable": made.stable, "exponent": exponent, "exponent_error": error}


def _bifurcation(made: "Bifurcation") -> dict[str, Any]:
    """The intervals of one motion of the first orbit in the order of the values, how many orbits ended, what coexists."""
    spans, beside = attractors(made)
    found = {"attractors": spans, "coexisting": beside} if spans else {}
    return {"ended": int((~made.held).sum()), "motions": motions(made)} | found


def _finite(state: Any) -> list[float | None]:
    """A state as numbers that JSON knows: None where there is none."""
    return [float(x) if np.isfinite(x) else None for x in state]


def _domain(domain: "AttractingDomain") -> dict[str, Any]:
    return {
        "of": domain.of,
        "boxes": [[_finite(side) for side in box] for box in domain.boxes],
        "trapped": bool(domain.trapped),
        "settled": bool(domain.settled),
        "status": domain.status,
        "reason": domain.reason,
        "two_cycle": [_finite(pair) for pair in domain.two_cycle],
        "part": list(domain.part),
        "envelopes": [[envelope.kind for envelope in update.envelopes] for update in domain.updates],
        "cycles": [_cycle(cycle) for cycle in domain.cycles],
    }


def _morse(cover: "MorseCover") -> dict[str, Any]:
    """The hulls of the components, which may be reached from which, and which are minimal."""
    cells = {"cells": list(cover.cells.shape), "kept": len(cover.numbers), "finished": cover.finished}
    edges, minimal = cover.edges.tolist(), list(cover.minimal)
    return cells | {"hulls": cover.hulls.tolist(), "edges": edges, "minimal": minimal}


def _cycle(cycle: "TwoCycle") -> dict[str, Any]:
    """p and q of one coordinate, found twice, the largest difference, and within how much both are known."""
    apart, within = _finite([np.abs(cycle.iterated - cycle.roots).max(), cycle.accuracy])
    p_and_q = {"iterated": _finite(cycle.iterated), "roots": _finite(cycle.roots), "slope": _finite([cycle.slope])[0]}
    found = {"stable": cycle.stable, "agree": cycle.agree, "apart": apart, "within": within}
    return {"coordinate": str(cycle.coordinate), **p_and_q, **found}


def _parametric(made: "ParametricMap") -> dict[str, Any]:
    """Its largest errors over all values held out, one of each output, by piece."""
    report = made.report
    worst = {} if report is None else {key: getattr(report, key).max(axis=1) for key in ("refit", "error", "apart")}
    names = () if report is None else report.names
    pieces = {name: {key: _finite(errors[k]) for key, errors in worst.items()} for k, name in enumerate(names)}
    ends = {"parameter": made.parameter, "from": made.low, "to": made.high, "condition": made.condition}
    return ends | {"nodes": made.nodes.tolist(), "held_out": [] if report is None else report.values.tolist(), "pieces": pieces}


def _report(report: "FitReport") -> dict[str, Any]:
    """A fit's figures, one of each output."""
    kept = ("r2", "sse", "max_error", "condition", "points", "terms", "left_out", "loss")
    return {name: _finite(getattr(report, name)) for name in kept} | {"warnings": list(report.warnings)}
