"""Bifurcation diagrams in words: motions with their intervals of the parameter, and coexisting motions."""

from collections.abc import Sequence
from itertools import groupby
from math import ceil, isfinite, isnan, log10
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.dynamics.continuation.events import HALVING
from nsmaps.dynamics.diagrams.borders import ACCUMULATION, LABEL, RANGE
from nsmaps.dynamics.motion import CHAOS, kind_of, kinds_explained
from nsmaps.study.conclusions.texts import percent, values_text
from nsmaps.study.sections.base import Finding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from nsmaps.dynamics.attractors.coexistence import Coexistence
    from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram, Window
    from nsmaps.study.result import StudyResult

NONE = "no attractor"  #: for an interval without a motion: there is no map, or the orbits end
MOTIONS = 6  #: of a diagram that a sentence lists
WIDEST = 2  #: windows whose intervals it states
UNNAMED = (RANGE, LABEL, "not located")  #: kinds of borders other than bifurcations
PAIRS = 5  #: of coexisting motions that a sentence names
Row = dict[str, Any]


def motions(diagram: "BifurcationDiagram") -> list[Row]:
    """The intervals of each motion of the first orbit, in the order of the values."""
    pairs = zip(diagram.labels[:, 0].tolist(), diagram.values.tolist(), strict=True)
    runs = [(label, [value for _, value in run]) for label, run in groupby(pairs, key=itemgetter(0))]
    return [{"label": label, "from": held[0], "to": held[-1]} for label, held in runs]


def attractors(diagram: "BifurcationDiagram") -> tuple[list[Row], list[Row]]:
    """The intervals of each attractor under each of its names, and of coexisting ones; both empty for a single orbit."""
    from nsmaps.dynamics.attractors.coexistence import match_attractors

    if diagram.held.shape[1] < 2:
        return [], []
    found = match_attractors([diagram])
    spans = [{"attractor": span.attractor, "label": span.label, "from": span.low, "to": span.high} for span in found.spans]
    return spans, _beside(found)


def _beside(found: "Coexistence") -> list[Row]:
    """The intervals of neighbouring values at which attractors of the same names coexist."""
    rows = []
    for names, run in groupby(zip(map(_names, found.attractor, found.labels), found.values.tolist(), strict=True), itemgetter(0)):
        values = [value for _, value in run]
        if len(names) > 1:
            row = {"motion": names[0], "beside": " and ".join(names[1:]), "from": values[0], "to": values[-1]}
            rows.append(row | {"values": len(values)})
    return rows


def _names(numbers: "NDArray[np.int64]", labels: "NDArray[np.str_]") -> list[str]:
    """The sorted names of the attractors at one value, one for each attractor."""
    named = dict(zip(numbers.tolist(), labels.tolist(), strict=True))
    return sorted(label or NONE for number, label in named.items() if number >= 0)


def widest(diagram: "BifurcationDiagram", max_rows: int) -> tuple[list[Row], int, int]:
    """The intervals with most values, with their number `values`; the number of omitted intervals.

    The third result is the largest number of values of an omitted interval.
    """
    rows = attractors(diagram)[0] or motions(diagram)
    counts = [
        int(((diagram.values >= min(ends)) & (diagram.values <= max(ends))).sum()) for ends in map(itemgetter("from", "to"), rows)
    ]
    order = sorted(range(len(rows)), key=lambda k: -counts[k])
    kept = [rows[k] | {"values": counts[k]} for k in sorted(order[:max_rows])]
    return kept, len(rows) - len(kept), max((counts[k] for k in order[max_rows:]), default=0)


def diagram_finding(diagram: "BifurcationDiagram", of: str) -> Finding:
    """The intervals of the widest windows, the bifurcations between windows, and where there is chaos."""
    name, labels = diagram.parameter, diagram.labels[:, 0].tolist()
    named = [window for window in diagram.windows if window.label and not kind_of(window.label)]
    widest = sorted(named, key=lambda window: window.seen[0] - window.seen[1])[:WIDEST]
    texts = [f"{window.label} {_held(window, name)}" for window in widest]
    events = _bifurcations(diagram, float(np.mean(widest[0].seen)) if widest else 0.0, [window.label for window in widest])
    texts += [f"{kind} at {name} = {values_text(values)}" for kind, values in events.items()]
    chaos = [value for value, label in zip(diagram.values.tolist(), labels, strict=True) if kind_of(label) == CHAOS]
    if chaos:
        where = f"from {min(chaos):.6g} to {max(chaos):.6g}" if len(chaos) > 1 else f"at {name} = {chaos[0]:.6g}"
        texts.append(f"chaos {where}, {len(chaos)} of {len(labels)} values")
    numbers = [(f"{name} = {value:.6g}", kind) for kind, values in events.items() for value in values]
    shares = [(window.label, labels.count(window.label)) for window in widest] + [("chaos", len(chaos))] * bool(chaos)
    numbers += [(percent(count / len(labels)), f"of the values of {name} have {label}") for label, count in shares]
    if not texts:
        texts = [f"{motions_of(diagram)} for {name} from {diagram.values.min():g} to {diagram.values.max():g}"]
        numbers = [(str(len(set(labels))), f"motions at {len(labels)} values of {name}")]
    return Finding(of, "; ".join(texts), tuple(numbers))


def _bifurcations(diagram: "BifurcationDiagram", of: float, motions: list[str]) -> dict[str, list[float]]:
    """The values of the bifurcations between windows by kind, those near one value first; a halving is named as the doubling.

    Of the accumulations of period doublings only those that begin with one of some motions are among them.
    """
    borders = {end.value: end.kind for window in diagram.windows for end in (window.low, window.high) if end.kind != HALVING}
    events: dict[str, list[float]] = {}
    for value, kind in sorted(borders.items(), key=lambda pair: abs(pair[0] - of)):
        minor = kind.startswith(ACCUMULATION) and not any(f" {motion} " in kind for motion in motions)
        if kind not in UNNAMED and not isnan(value) and not minor:
            events.setdefault(kind, []).append(value)
    return events


def _held(window: "Window", name: str) -> str:
    """Where a window lies: above a value, below one, between two, or over the range."""
    low, high = (
        f"{end.value if isfinite(end.value) else seen:.6g}"
        for end, seen in zip((window.low, window.high), window.seen, strict=True)
    )
    first, last = (end.kind == RANGE for end in (window.low, window.high))
    if first and last:
        return f"at every {name} from {low} to {high}"
    return f"for {name} < {high}" if first else f"for {name} > {low}" if last else f"for {name} from {low} to {high}"


def coexisting(result: "StudyResult") -> str:
    """A sentence for each map on its coexisting motions and their intervals; empty if there are none."""
    sentences = []
    for of, diagram in result.bifurcation_diagram.items():
        rows = sorted(attractors(diagram)[1], key=itemgetter("motion", "beside"))
        pairs = [list(alike) for _, alike in groupby(rows, itemgetter("motion", "beside"))]
        widest = sorted(pairs, key=lambda alike: -sum(row["values"] for row in alike))[:PAIRS]
        found = [_places(diagram, alike) for alike in pairs if alike in widest]
        found += [f"{len(pairs) - PAIRS} more pairs of motions"] if len(pairs) > PAIRS else []
        text = f"Attractors of the {result.map_title(of)} coexist: {'; '.join(found)}"
        explained = kinds_explained(name for row in rows for name in (row["motion"], row["beside"]))
        text += f" ({explained})" if explained else ""
        sentences += [f"{text}."] if rows else []
    return " ".join(sentences)


def _places(diagram: "BifurcationDiagram", rows: list[Row]) -> str:
    """The interval over which the same motions coexist, or the number of values and their range."""
    ends = {"from": min(row["from"] for row in rows), "to": max(row["to"] for row in rows)}
    where = interval(diagram, ends)
    if len(rows) > 1:
        where = f"at {sum(row['values'] for row in rows)} values {where}"
    return f"{rows[0]['motion']} beside {rows[0]['beside']} {where}"


def interval(diagram: "BifurcationDiagram", row: Row) -> str:
    """The ends of an interval, to the digits by which neighbouring values differ: `for d from 0.225 to 0.2275`."""
    name, (low, high) = diagram.parameter, digits([row["from"], row["to"]], diagram)
    return f"for {name} from {low} to {high}" if low != high else f"at {name} = {low}"


def digits(values: Sequence[float], diagram: "BifurcationDiagram") -> list[str]:
    """Values of the parameter to one digit beyond that by which neighbouring ones differ."""
    steps = np.diff(np.unique(diagram.values))
    places = max(ceil(-log10(steps.min())) + 1, 0) if len(steps) else 15
    return [f"{round(value, places):.12g}" for value in values]


def motions_of(diagram: "BifurcationDiagram") -> str:
    """The motions of the first orbit of a diagram, in the order of the values."""
    names = [name or NONE for name in dict.fromkeys(diagram.labels[:, 0].tolist())]
    more = f" and {len(names) - MOTIONS} more" if len(names) > MOTIONS else ""
    explained = kinds_explained(names)
    return f"the motion{'s' * (len(names) > 1)} {', '.join(names[:MOTIONS])}{more}{f' ({explained})' if explained else ''}"
