"""Ticks of axes: fractions of pi on angles, and as many decimal numbers as have room."""

from fractions import Fraction

import numpy as np
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

_PI_STEPS = (np.pi, np.pi / 2, np.pi / 4)
_DIGIT = 0.07  #: inches of an axis that a digit takes
_FRACTION = 0.32  #: inches of an axis that a fraction of pi takes
_DIGITS = 8  #: of a tick, beyond which what all have in common stands in the label of the axis


def _in_pi(value: float, _: object = None) -> str:
    part = Fraction(value / np.pi).limit_denominator(24)
    top, bottom = part.numerator, part.denominator
    if not top:
        return "0"
    sign, head = "-" if top < 0 else "", r"\pi" if abs(top) == 1 else rf"{abs(top)}\pi"
    return f"${sign}{head}$" if bottom == 1 else f"${sign}{head}/{bottom}$"


def _inches(axis: Axis) -> float:
    """The length of a horizontal axis; infinite of a vertical one, beside which ticks always have room."""
    ax = axis.axes
    return ax.bbox.width / ax.figure.dpi if axis is ax.xaxis else np.inf


def angle_ticks(axis: Axis, span: float) -> None:
    """Ticks at fractions of pi where two or more fall on an axis that spans so many radians; plain radians on a shorter one.

    On a horizontal axis they are only as many as have room.
    """
    fine = next((s for s in _PI_STEPS if span / s >= 2.5), None)
    room = _inches(axis) / _FRACTION
    step = fine and next((s for s in reversed(_PI_STEPS) if s >= fine and span / s <= room), _PI_STEPS[0])
    if step is not None:
        axis.set_major_locator(MultipleLocator(step))
        axis.set_major_formatter(FuncFormatter(_in_pi))


def decimal_ticks(axis: Axis) -> None:
    """At most six ticks; on a horizontal axis only as many as have room for their digits, which are many of a small domain."""
    room = _inches(axis) / _DIGIT
    formatter = axis.get_major_formatter()
    formatter.set_useOffset(False)  # type: ignore[attr-defined]
    for count in (6, 5, 4, 3, 2):
        axis.set_major_locator(MaxNLocator(count, steps=[1, 2, 5, 10]))
        low, high = axis.get_view_interval()
        names = formatter.format_ticks([tick for tick in axis.get_majorticklocs() if low <= tick <= high])
        if max(map(len, names), default=0) > _DIGITS:
            formatter.set_useOffset(True)  # type: ignore[attr-defined]
            names = formatter.format_ticks(list(axis.get_majorticklocs()))
        if sum(len(name) + 1 for name in names) <= room:
            break
    if common := formatter.get_offset():
        axis.set_label_text(f"{axis.get_label_text()}\nticks: {common}")
        axis.get_offset_text().set_visible(False)
