"""What bifurcation diagrams say in words: which motion over which interval of the parameter, and which motions coexist."""

from collections.abc import Sequence
from itertools import groupby
from math import ceil, log10
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from nsmaps.dynamics.attractors.coexistence import Coexistence
    from nsmaps.dynamics.diagrams.bifurcation import Bifurcation
    from nsmaps.study.result import StudyResult

NONE = "no attractor"  #: what the orbits of an interval without a motion come to: there is no map, or the orbit ends
Row = dict[str, Any]


def motions(made: "Bifurcation") -> list[Row]:
    """The intervals of one motion of the first orbit in the order of the values."""
    pairs = zip(made.labels[:, 0].tolist(), made.values.tolist(), strict=True)
    runs = [(label, [value for _, value in run]) for label, run in groupby(pairs, key=itemgetter(0))]
    return [{"label": label, "from": held[0], "to": held[-1]} for label, held in runs]


def attractors(made: "Bifurcation") -> tuple[list[Row], list[Row]]:
    """The intervals of each attractor under each of its names, and those over which some coexist; none of one orbit alone."""
    from nsmaps.dynamics.attractors.coexistence import coexistence

    if made.held.shape[1] < 2:
        return [], []
    found = coexistence([made])
    spans = [{"attractor": span.attractor, "label": span.label, "from": span.low, "to": span.high} for span in found.spans]
    return spans, _beside(found)


def _beside(found: "Coexistence") -> list[Row]:
    """Neighbouring values at which attractors of the same names were found beside each other."""
    rows = []
    for names, run in groupby(zip(map(_names, found.attractor, found.labels), found.values.tolist(), strict=True), itemgetter(0)):
        values = [value for _, value in run]
        if len(names) > 1:
            row = {"motion": names[0], "beside": " and ".join(names[1:]), "from": values[0], "to": values[-1]}
            rows.append(row | {"values": len(values)})
    return rows


def _names(numbers: "NDArray[np.int64]", labels: "NDArray[np.str_]") -> list[str]:
    """The names of the attractors at one value, in order; one for each, of two orbits or more on the same one too."""
    named = dict(zip(numbers.tolist(), labels.tolist(), strict=True))
    return sorted(label or NONE for number, label in named.items() if number >= 0)


def widest(made: "Bifurcation", most: int) -> tuple[list[Row], int, int]:
    """At most so many intervals, those with most values of all orbits' or the one's, with `values`; how many more there are.

    The third number is how many values the largest of those has that are left out.
    """
    rows = attractors(made)[0] or motions(made)
    counts = [
        int(((made.values >= min(ends)) & (made.values <= max(ends))).sum()) for ends in map(itemgetter("from", "to"), rows)
    ]
    order = sorted(range(len(rows)), key=lambda k: -counts[k])
    kept = [rows[k] | {"values": counts[k]} for k in sorted(order[:most])]
    return kept, len(rows) - len(kept), max((counts[k] for k in order[most:]), default=0)


def coexisting(result: "StudyResult") -> str:
    """Which motions were found beside which, and where, in a sentence for each map; empty where none were."""
    told = []
    for of, made in result.bifurcation.items():
        rows = sorted(attractors(made)[1], key=itemgetter("motion", "beside"))
        found = [_places(result, made, list(alike)) for _, alike in groupby(rows, itemgetter("motion", "beside"))]
        text = f"Attractors of the {of} map coexist: {'; '.join(found)}"
        if any(name.endswith("C") for row in rows for name in (row["motion"], row["beside"])):
            text += f" (C: no period up to {made.states.shape[2] // 2} returns, chaos or still a transient)"
        told += [f"{text}."] if rows else []
    return " ".join(told)


def _places(result: "StudyResult", made: "Bifurcation", rows: list[Row]) -> str:
    """Where the same motions were found beside each other: the interval, or at how many values between which."""
    ends = {"from": min(row["from"] for row in rows), "to": max(row["to"] for row in rows)}
    where = interval(result, made, ends)
    if len(rows) > 1:
        where = f"at {sum(row['values'] for row in rows)} values {where}"
    return f"{rows[0]['motion']} beside {rows[0]['beside']} {where}"


def interval(result: "StudyResult", made: "Bifurcation", row: Row) -> str:
    """Where an interval lies, to the digits by which neighbouring values differ: `for d from 0.225 to 0.2275`."""
    name = result.study.bifurcation.parameter if result.study.bifurcation else ""
    low, high = digits([row["from"], row["to"]], made)
    return f"for {name} from {low} to {high}" if low != high else f"at {name} = {low}"


def digits(values: Sequence[float], made: "Bifurcation") -> list[str]:
    """Values of the parameter to one digit beyond that by which neighbouring ones differ."""
    steps = np.diff(np.unique(made.values))
    places = max(ceil(-log10(steps.min())) + 1, 0) if len(steps) else 15
    return [f"{round(value, places):.12g}" for value in values]
