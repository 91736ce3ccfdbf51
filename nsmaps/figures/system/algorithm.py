"""The general algorithm as a flow chart: fig. flochart, with what of a study and of nsmaps does each step."""

import re
from collections import Counter
from functools import partial
from textwrap import fill
from typing import TYPE_CHECKING, Any, cast

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREEN, GREY, ORANGE, tint

if TYPE_CHECKING:
    from nsmaps.reduced.partition.result import PartitionResult

Step = tuple[str, str, str, str]  #: number, what is done, section of a study, function

STEPS: tuple[tuple[str, str, tuple[Step, ...]], ...] = (
    (
        "Initialize",
        BLUE,
        (
            ("0", "choose the state that\nreturns are returns to", "system, parameters", "ImpactSystem.walls"),
            ("i", "surfaces of the\nfirst returns", "grid", "first_return"),
            ("ii", "regions by family of\nreturns, $\\mathcal{R}_{n.1}$", "families", "WordFamily"),
        ),
    ),
    (
        "Iterate",
        ORANGE,
        (
            ("iii", "attracting or transient:\ncompare with the diagonals", "diagonal", "diagonal_region"),
            ("iv", "choose orders of\npolynomials, $f_n$ and $g_n$", "composite: fit", "compare_orders"),
            ("v", "poor fit: adjust regions\nor add some, $\\mathcal{R}_{n.m}$", "composite: box, where", "FitReport, Coverage"),
            ("vi", "optional: replace immediate\ntransitions by resets", "composite: reset", "PolyMap.reset"),
        ),
    ),
    (
        "Finalize",
        GREEN,
        (("vii", "regions $\\mathcal{R}_n$, maps $f_n$, $g_n$:\nthe composite map", "composite, require", "build_composite"),),
    ),
)  #: the activities and their steps (section 4.1); docs/explanation/algorithm.md says more
_KEY: Step = ("step", "what is done", "section of a study", "function of nsmaps")
_LEFT, _WIDE, _HIGH, _ROW = 0.3, 3.95, 0.42, 0.58  #: inches: left edge, width and height of boxes, from box to box
_NARROW, _LETTERS = 2.4, 17  #: inches, the width of boxes without a right half; letters of text in an inch
_BESIDE = 2.35  #: inches, from a box's left edge to the section and the function


def sheets(partition: "PartitionResult | None" = None) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("algorithm", (partial(algorithm, partition),), 1, tall=5.6 if partition is None else 6.0),)


def algorithm(partition: "PartitionResult | None", ax: Axes) -> Axes:
    """Boxes for the steps, one below the other: what is done, the section of a study for it, the function that does it.

    If the study has a partition, the counts of its log are shown below. On a narrow page boxes have what is done alone.
    """
    wide = _WIDE if cast(Figure, ax.get_figure(root=True)).get_figwidth() >= _LEFT + _WIDE else _NARROW
    _box(ax, 0.0, _KEY, GREY, wide)
    row = 0
    for name, colour, steps in STEPS:
        middle = -_ROW * (row + (len(steps) + 1) / 2) + _HIGH / 2
        ax.text(_LEFT - 0.1, middle, name, rotation=90, ha="right", va="center", fontweight="bold", color=colour)
        for step in steps:
            row += 1
            _box(ax, -row * _ROW, step, colour, wide)
            if row > 1:
                x = _LEFT + wide / 2
                _arrow(ax, [(x, -(row - 1) * _ROW), (x, -row * _ROW + _HIGH)])
    _loop(ax, wide)
    text = "The section partition of a study does steps ii to vii by itself."
    if partition is not None:
        text += f" {_counts(partition)}"
    text = fill(text, int(_LETTERS * wide))
    ax.text(_LEFT, -row * _ROW - 0.12, text, ha="left", va="top", color="0.2", linespacing=1.4)
    ax.set(xlim=(0, wide + 0.95), ylim=(-row * _ROW - 0.14 - 0.17 * (1 + text.count("\n")), _HIGH + 0.05), aspect="equal")
    ax.set_axis_off()
    return ax


def _box(ax: Axes, y: float, step: Step, colour: str, wide: float) -> None:
    """One step: its number and what is done, on the right the section of a study and the function, if there is room."""
    number, text, section, function = step
    look: dict[str, Any] = {"boxstyle": "round,pad=0,rounding_size=0.05", "fc": tint(colour, 0.85), "ec": colour, "lw": 1.0}
    ax.add_patch(FancyBboxPatch((_LEFT, y), wide, _HIGH, **look))
    middle = y + _HIGH / 2
    ax.text(_LEFT + 0.08, middle, number, ha="left", va="center", fontweight="bold", color=colour)
    ax.text(_LEFT + 0.45, middle, text, ha="left", va="center", linespacing=1.2)
    if wide < _WIDE:
        return
    beside = _LEFT + _BESIDE
    ax.text(beside, y + 0.73 * _HIGH, section, ha="left", va="center", family="monospace")
    ax.text(beside, y + 0.28 * _HIGH, function, ha="left", va="center", family="monospace", color="0.35")


def _arrow(ax: Axes, points: list[tuple[float, float]]) -> None:
    """A broken line through the points, with a head at the last."""
    ax.plot(*zip(*points[:-1], strict=True), color="0.25", lw=0.8, solid_joinstyle="miter")
    look = {"arrowstyle": "-|>", "color": "0.25", "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", points[-1], points[-2], arrowprops=look)


def _loop(ax: Axes, wide: float) -> None:
    """From the last step of the iteration back to its first, and when it is left."""
    first = 1 + len(STEPS[0][2])
    last = first + len(STEPS[1][2]) - 1
    top, bottom, right = (-first * _ROW + _HIGH / 2, -last * _ROW + _HIGH / 2, _LEFT + wide)
    _arrow(ax, [(right, bottom), (right + 0.2, bottom), (right + 0.2, top), (right, top)])
    text = "else the next iteration, $m \\to m + 1$"
    ax.text(right + 0.26, (top + bottom) / 2, text, rotation=90, ha="left", va="center", color="0.25")
    between = -last * _ROW - (_ROW - _HIGH) / 2
    ax.text(_LEFT + wide / 2 + 0.08, between, "every fit is good enough", ha="left", va="center", color="0.25")


def _counts(partition: "PartitionResult") -> str:
    """What the log of the partition counts."""
    became = Counter(re.findall(r"given up|\w+", row.became)[0] for row in partition.log)
    counts = ", ".join(f"{count} {word}" for word, count in became.items())
    regions = f"{len(partition.log)} regions $\\mathcal{{R}}_{{n.m}}$ ({counts})"
    return f"Its log of this run: {regions}, {len(partition.composite.pieces)} pieces, {len(partition.attracting)} attracting"
