"""Captions of what orbits do in the long run, and of cells; each is empty where the result has no numbers for it."""

import numpy as np

from nsmaps.report.phrases import MOST, at, listed
from nsmaps.study.conclusions.headline import motions_of
from nsmaps.study.conclusions.texts import computed_text, range_text, returns_text
from nsmaps.study.result import StudyResult


def bifurcation(result: StudyResult, part: str) -> str:
    """The range of the parameter, and the motions of the exact map."""
    spec, exact = result.study.bifurcation, result.bifurcation.get("exact")
    if spec is None:
        return ""
    seen = motions_of(exact) if exact is not None else ""
    ratio = ": n:m/pT has n impacts on the base wall and m on others in p periods of the forcing" if "/" in seen else ""
    return f"{at(result, (spec.parameter,))}{range_text(spec)}{f'; of the exact map {seen}' if seen else ''}{ratio}."


def branches(result: StudyResult, part: str) -> str:
    """The events of every branch, each once."""
    varied = dict.fromkeys(branch.parameter for branch in result.study.branches)
    lines = []
    for spec in result.study.branches:
        events = [event for branch in result.branches.get(spec.name, ()) for event in branch.events]
        names = list(dict.fromkeys(f"{event.kind} at {spec.parameter} = {event.value:.6g}" for event in events))
        more = f" and {len(names) - MOST} more events" if len(names) > MOST else ""
        lines.append(f"{spec.name}, {', '.join(names[:MOST]) or 'no event'}{more}")
    return f"{at(result, varied)}{'; '.join(lines)}." if lines else ""


def stability(result: StudyResult, part: str) -> str:
    """The ranges of both parameters, and the share of each motion."""
    spec, found = result.study.stability, result.stability
    if spec is None or found is None:
        return ""
    labels = found.labels.ravel().tolist()
    shares = {label or "none": labels.count(label) / len(labels) for label in dict.fromkeys(labels)}
    over = f"{range_text(spec.sweep)}, {range_text(spec.across)}"
    return f"{at(result, (spec.sweep.parameter, spec.across.parameter))}{over}; motions {listed(shares)}."


def chart(result: StudyResult, part: str) -> str:
    """The ranges of both parameters, the share of each motion, and of what coexists or is refused."""
    spec, found = result.study.chart, result.chart
    if spec is None or found is None:
        return ""
    refused = f"; the system refuses the parameters of {int(found.refused.sum()):,} pixels" if found.refused.any() else ""
    filled = "" if found.computed.all() else f" {computed_text(found)}"
    over = f"{range_text(spec.sweep)}, {range_text(spec.across)}"
    motions = {label or "none": share for label, share in found.shares().items()}
    text = f"{over}; motions {listed(motions)}; several at {100 * (found.counts > 1).mean():.3g} % of the pixels{refused}."
    return f"{at(result, (spec.sweep.parameter, spec.across.parameter))}{text}{filled}{_optimum(result)}"


def _optimum(result: StudyResult) -> str:
    """A sentence on the optimum that a chart shows."""
    found, spec = result.optimum, result.study.chart
    if found is None or spec is None or not {spec.sweep.parameter, spec.across.parameter} <= set(found.parameters):
        return ""
    where = ", ".join(f"{name} = {value:.5g}" for name, value in found.parameters.items())
    value = " ".join(filter(None, (f"{found.value:.5g}", found.observable.unit, f"per {found.per}")))
    return f" The star is the {found.sense}imum of {found.observable.name} of {found.orbit.label}: {value} at {where}."


def observables(result: StudyResult, part: str) -> str:
    """The names of the observables, and the number of returns over which is averaged."""
    study, spec = result.study, result.study.observables
    if spec is None:
        return ""
    varied = [sweep.parameter for sweep in (study.bifurcation, *study.branches) if sweep is not None]
    names = ", ".join([*spec.quantities, *(one.name for one in spec.formulas)])
    return f"{at(result, varied)}{names}; {returns_text(spec.returns)} of each orbit."


def lyapunov(result: StudyResult, part: str) -> str:
    """The range of the parameter, and at how many values an exponent is positive."""
    spec, found = result.study.lyapunov, result.lyapunov
    if spec is None or found is None:
        return ""
    with np.errstate(invalid="ignore"):
        positive = int((found.exponents[:, 0] > 2 * found.error[:, 0]).sum())
    text = f"the largest exponent exceeds two standard errors at {positive} of them"
    return f"{at(result, (spec.parameter,))}{range_text(spec)}; {text}."


def basins(result: StudyResult, part: str) -> str:
    """The share of each basin."""
    found = result.basins
    if found is None:
        return ""
    names = [f"{each.label or 'attractor'} ({number})" for number, each in enumerate(found.attractors, 1)]
    shares = dict(zip([*names, "no attractor", "the orbit ends"], found.fractions.tolist(), strict=True))
    return f"{at(result)}{len(found.label):,} states, of which reach {listed(shares)}."


def global_continuation(result: StudyResult, part: str) -> str:
    """The range of the parameter, the starts, and the numbers of attractors, births and deaths."""
    spec, found = result.study.global_continuation, result.global_continuation
    if spec is None or found is None:
        return ""
    kinds = [change.kind for change in found.changes]
    text = f"attractors {found.share.shape[1]}, births {kinds.count('birth')}, deaths {kinds.count('death')}"
    return f"{at(result, (spec.parameter,))}{range_text(spec)}, {found.samples:,} random starts each; {text}."


def manifolds(result: StudyResult, part: str) -> str:
    """The saddles, with the states and pieces of each of their manifolds."""
    rows = [
        f"{name}, {each.which}: {len(each.states):,} states in {len(each.lines)} pieces"
        for name, some in result.manifolds.items()
        for each in some
    ]
    return f"{at(result)}{'; '.join(rows)}." if rows else ""


def noise(result: StudyResult, part: str) -> str:
    """The sizes of the noise, and the motions."""
    spec = result.study.noise
    if spec is None:
        return ""
    sizes = f"sigma from {min(spec.sigma):g} to {max(spec.sigma):g}" if len(spec.sigma) > 1 else f"sigma = {spec.sigma[0]:g}"
    kind = "of independent noise on the images" if spec.tau is None else f"correlation time {spec.tau:g}"
    return f"{at(result)}{sizes}, {kind}, {spec.realisations} realisations of {spec.returns:,} returns each."


def morse(result: StudyResult, part: str) -> str:
    """The number of cells, and of recurrent components."""
    cover = result.morse
    if cover is None:
        return ""
    shape, trap = " x ".join(map(str, cover.cells.shape)), result.trap
    text = f"{at(result)}{len(cover.numbers):,} of {shape} cells kept, recurrent components: {len(cover.hulls)}"
    held = trap is not None and trap.forward_invariant
    stays = f"; every orbit of the {trap.of} from {len(trap.numbers):,} of the cells stays in them" if trap and held else ""
    return f"{text}{stays}."


def exit_times(result: StudyResult, part: str) -> str:
    """The number of cells, and after how many returns they have been left."""
    found = result.exit_times
    if found is None or not (found.region >= 0).any():
        return ""
    inside = found.region >= 0
    left = float((found.left[inside] >= 0).mean())
    shape = " x ".join(map(str, found.cells.shape))
    return f"{at(result)}{shape} cells; of those in a region {100 * left:.4g} % are left by all their orbits of the {found.of}."
