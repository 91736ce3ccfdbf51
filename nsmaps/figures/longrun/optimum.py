"""The search for an optimum: where its starts led, and the value of the observable there."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsmaps.dynamics.design.optimum import Optimum
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, BLUE, GREY, YELLOW, dress, label


def sheets(found: Optimum) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("optimum", (partial(optimum, found),), 1, 0.75, legend=True, share=0.75),)


def optimum(found: Optimum, ax: Axes) -> Axes:
    """The starts of the search and its ends in the plane of two parameters, or by parameter and value; a star is the optimum.

    Full dots are local optima at which all conditions are met; of more than two parameters the first two are shown.
    """
    names = list(found.parameters)
    pairs = names[:2]

    def place(parameters: dict[str, float], value: float) -> tuple[float, float]:
        return parameters[pairs[0]], (parameters[pairs[1]] if len(pairs) > 1 else value)

    ends = np.array([place(each.end, each.value) for each in found.attempts]).reshape(-1, 2)
    optimal = np.array([each.optimal for each in found.attempts], bool)
    if len(pairs) > 1:
        for each in found.attempts:
            ax.annotate(
                "", place(each.end, 0.0), place(each.start, 0.0), arrowprops={"arrowstyle": "->", "color": GREY, "lw": 0.7}
            )
            ax.plot(*place(each.start, 0.0), ".", color=GREY, ms=3)
    for own, face, text in ((optimal, BLUE, "local optimum"), (~optimal, "white", "end of a search elsewhere")):
        if own.any():
            ax.plot(*ends[own].T, "o", mfc=face, mec=BLUE, mew=0.8, ms=4.5, label=text)
    best = f"optimum, {found.observable.name} = {found.value:.5g}"
    ax.plot(*place(found.parameters, found.value), "*", color=YELLOW, mec=BLACK, mew=0.7, ms=10, zorder=5, label=best)
    ax.margins(0.1)
    ax.legend()
    dress(ax, (names[0], ""), (pairs[-1], ""))
    ax.set_ylabel(label(pairs[1]) if len(pairs) > 1 else found.observable.name)
    return ax
