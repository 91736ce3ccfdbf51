"""The general algorithm as a flow chart: fig. flochart, with what of a study and of nsmaps does each step."""

import re
from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREEN, GREY, ORANGE, tint

if TYPE_CHECKING:
    from nsmaps.reduced.partition.result import PartitionResult
    from nsmaps.study.result import StudyResult

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
)  #: the activities and their steps (section 4.1); docs/algorithm.md says more
_KEY: Step = ("step", "what is done", "section of a study", "function of nsmaps")
_WIDE, _HIGH, _GAP, _ROW = 2.85, 1.36, 0.36, 2.34  #: of a box, between boxes, from row to row


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("algorithm", (partial(algorithm, result),), 1, 0.47),)


def algorithm(result: "StudyResult", ax: Axes) -> Axes:
    """Boxes for the steps, a row an activity: what is done, the section of a study for it, the function that does it.

    If the study has a partition, the counts of its log are shown beside the loop.
    """
    for row, (name, colour, steps) in enumerate(STEPS):
        y = -row * _ROW
        ax.text(-0.25, y + _HIGH / 2, name, rotation=90, ha="right", va="center", fontsize=13, fontweight="bold", color=colour)
        for k, step in enumerate(steps):
            _box(ax, _x(k), y, step, colour)
            if k:
                _arrow(ax, [(_x(k) - _GAP, y + _HIGH / 2), (_x(k), y + _HIGH / 2)])
    _box(ax, _x(3), 0, _KEY, GREY)
    _between(ax)
    _loop(ax)
    text = "The section partition of a study does steps ii to vii by itself."
    if result.partition is not None:
        text += f"\n{_counts(result.partition)}"
    ax.text(_x(1) + 0.1, -2 * _ROW + _HIGH / 2, text, ha="left", va="center", fontsize=10, color="0.2", linespacing=1.5)
    ax.set(xlim=(-0.75, _x(4) + 0.15), ylim=(-2 * _ROW - 0.15, _HIGH + 0.15), aspect="equal")
    ax.set_axis_off()
    return ax


def _x(step: int) -> float:
    """The left edge of the box of this number in its row."""
    return step * (_WIDE + _GAP)


def _box(ax: Axes, x: float, y: float, step: Step, colour: str) -> None:
    """One step: its number and what is done, below a line the section of a study and the function."""
    number, text, section, function = step
    look: dict[str, Any] = {"boxstyle": "round,pad=0,rounding_size=0.1", "fc": tint(colour, 0.85), "ec": colour, "lw": 1.4}
    ax.add_patch(FancyBboxPatch((x, y), _WIDE, _HIGH, **look))
    ax.text(x + 0.1, y + _HIGH - 0.09, number, ha="left", va="top", fontsize=12, fontweight="bold", color=colour)
    ax.text(x + 0.44 + 0.25 * (step is _KEY), y + _HIGH - 0.12, text, ha="left", va="top", fontsize=9.5, linespacing=1.25)
    ax.plot([x + 0.1, x + _WIDE - 0.1], [y + 0.68] * 2, color=colour, lw=0.4)
    ax.text(x + 0.1, y + 0.47, section, ha="left", va="center", fontsize=9, family="monospace")
    ax.text(x + 0.1, y + 0.19, function, ha="left", va="center", fontsize=9, family="monospace", color="0.35")


def _arrow(ax: Axes, points: list[tuple[float, float]]) -> None:
    """A broken line through the points, with a head at the last."""
    ax.plot(*zip(*points[:-1], strict=True), color="0.25", lw=0.8, solid_joinstyle="miter")
    look = {"arrowstyle": "-|>", "color": "0.25", "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", points[-1], points[-2], arrowprops=look)


def _between(ax: Axes) -> None:
    """From each activity to the next: down from its last box, along, and into the first box of the next."""
    for row, last in ((0, 2), (1, 3)):
        middle, low, first = _x(last) + 0.65 * _WIDE, -row * _ROW, 0.35 * _WIDE
        turn = low - 0.36 * (_ROW - _HIGH) if row == 0 else low - 0.68 * (_ROW - _HIGH)
        _arrow(ax, [(middle, low), (middle, turn), (first, turn), (first, low - _ROW + _HIGH)])
    text = "every fit is good enough"
    ax.text(_x(2), -_ROW - 0.71 * (_ROW - _HIGH), text, ha="center", va="top", fontsize=10, color="0.25")


def _loop(ax: Axes) -> None:
    """From the last step of the iteration back to its first."""
    y, right, left = -_ROW, _x(3) + 0.35 * _WIDE, 0.65 * _WIDE
    turn = y - 0.3 * (_ROW - _HIGH)
    _arrow(ax, [(right, y), (right, turn), (left, turn), (left, y)])
    text = "else the next iteration, $m \\to m + 1$"
    ax.text((left + right) / 2, turn + 0.03, text, ha="center", va="bottom", fontsize=10, color="0.25")


def _counts(partition: "PartitionResult") -> str:
    """What the log of the partition counts."""
    became = Counter(re.findall(r"given up|\w+", row.became)[0] for row in partition.log)
    counts = ", ".join(f"{count} {word}" for word, count in became.items())
    regions = f"{len(partition.log)} regions $\\mathcal{{R}}_{{n.m}}$ ({counts})"
    return f"Its log of this run: {regions},\n{len(partition.composite.pieces)} pieces, {len(partition.attracting)} attracting"
