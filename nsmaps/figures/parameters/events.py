"""What figures of branches share: the colours of motions, the marks of events, and the branches with orbits by parameter."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from matplotlib.lines import Line2D

from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.continuation.events import AT_INFINITY
from nsmaps.figures.style import BLACK, BLUE, GREEN, MAGENTA, ORANGE, RED, SKY

COLOURS = (BLUE, ORANGE, GREEN, MAGENTA, SKY, RED, BLACK)  #: of motions
ASYMPTOTE: Mapping[str, Any] = {"color": BLACK, "ls": ":", "lw": 0.8}  #: of the lines to a cycle at infinity
MARKERS = {
    "period doubling": "o",
    "period halving": "o",
    "fold": "s",
    "branch point": "P",
    "Neimark-Sacker": "^",
    "grazing": "X",
    "border collision": "D",
    "end of complete chatter": "*",
    "detachment": "v",
    "homoclinic bifurcation": "h",
    "Hopf bifurcation": "p",
    "end of the valid domain": "|",
}

Found = Branch | Sequence[Branch]


def by_parameter(found: Found) -> dict[str, list[Branch]]:
    """The branches with orbits by their parameter; an empty list where none has any."""
    along: dict[str, list[Branch]] = {}
    for branch in [found] if isinstance(found, Branch) else found:
        along.setdefault(branch.parameter, []).extend([branch] if len(branch.values) else [])
    return along


def colours_of(shown: Iterable[Branch]) -> dict[str, str]:
    """The colour of each motion."""
    motions = dict.fromkeys(str(branch.labels[-1]) for branch in shown)
    return {motion: COLOURS[k % len(COLOURS)] for k, motion in enumerate(motions)}


def mark(size: float = 1.0) -> dict[str, Any]:
    """The look of an event's mark."""
    return {"color": BLACK, "mfc": "white", "ms": 4.6 * size, "mew": 0.8 * size, "ls": "", "zorder": 4}


def event_handles(shown: Iterable[Branch]) -> list[Line2D]:
    """The entries of the legend for the kinds of events."""
    kinds = dict.fromkeys(event.kind for branch in shown for event in branch.events)
    looks = {kind: ASYMPTOTE if kind == AT_INFINITY else {"marker": MARKERS[kind], **mark()} for kind in kinds}
    return [Line2D([], [], label=kind, **look) for kind, look in looks.items()]
