"""Multipliers along branches of periodic orbits: their moduli over the parameter, and their places beside the unit circle."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsmaps.dynamics.continuation.branch import Branch
from nsmaps.dynamics.continuation.events import AT_INFINITY
from nsmaps.figures.page import Sheet
from nsmaps.figures.parameters.events import MARKERS, Found, by_parameter, colours_of, event_handles, mark
from nsmaps.figures.style import dress

_LOGARITHMIC = 4.0  #: a modulus, from which on the axis is logarithmic
_NEAR, _FAR = 1.15, 2.5  #: from zero, the least and the greatest end of the axes of the plane


def sheets(found: Found) -> tuple[Sheet, ...]:
    """One sheet a parameter, of two panels; none of a parameter of which no branch has orbits."""
    along = by_parameter(found)
    return tuple(
        Sheet(
            "multipliers" if len(along) == 1 else f"multipliers-{parameter}",
            (partial(moduli, own), partial(plane, own)),
            2,
            0.9,
            legend=True,
        )
        for parameter, own in along.items()
        if own
    )


def moduli(shown: Sequence[Branch], ax: Axes) -> Axes:
    """The modulus of each multiplier of a period over the parameter; cycles are stable where all lie below the line at one."""
    colours = colours_of(shown)
    for branch in shown:
        ax.plot(branch.values, np.abs(branch.multipliers), color=colours[str(branch.labels[-1])], lw=1.0)
        for event in branch.events:
            if event.kind != AT_INFINITY:
                values = np.abs(event.orbit.multipliers)
                ax.plot(np.full(len(values), event.value), values, MARKERS[event.kind], **mark(0.8))
    ax.axhline(1.0, color="0.3", lw=0.6, ls=(0, (5, 3)))
    sizes = np.concatenate([np.abs(branch.multipliers).ravel() for branch in shown])
    if np.nanmax(sizes, initial=0.0) > _LOGARITHMIC:
        ax.set_yscale("log")
    else:
        ax.set_ylim(bottom=0.0)
    ax.margins(x=0.03)
    dress(ax, (shown[0].parameter, ""), (shown[0].coordinates[0], ""))
    ax.set_ylabel("modulus of multipliers")
    ax.legend(handles=[*(Line2D([], [], color=colour, label=name) for name, colour in colours.items()), *event_handles(shown)])
    return ax


def plane(shown: Sequence[Branch], ax: Axes) -> Axes:
    """The multipliers of all cycles as dots in the complex plane with the unit circle, up to 2.5 from zero."""
    colours, turn = colours_of(shown), np.linspace(0, 2 * np.pi, 361)
    ax.plot(np.cos(turn), np.sin(turn), color="0.3", lw=0.6)
    for branch in shown:
        values = branch.multipliers.ravel()
        ax.plot(values.real, values.imag, ".", ms=2.5, mew=0, color=colours[str(branch.labels[-1])])
        for event in (event for event in branch.events if event.kind != AT_INFINITY):
            at = event.orbit.multipliers
            ax.plot(at.real, at.imag, MARKERS[event.kind], **mark(0.8))
    largest = np.nanmax(np.concatenate([np.abs(branch.multipliers).ravel() for branch in shown]), initial=0.0)
    end = float(np.clip(1.05 * largest, _NEAR, _FAR))
    ax.set(xlim=(-end, end), ylim=(-end, end), aspect="equal", xlabel="real part", ylabel="imaginary part")
    return ax
