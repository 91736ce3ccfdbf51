"""Attractors along a parameter: the shares of their basins as bands, their distances to the boundary and return times."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsmaps.arrays import Floats
from nsmaps.dynamics.attractors.continued import GlobalContinuation
from nsmaps.dynamics.motion import MEANING
from nsmaps.errors import NsmapsError
from nsmaps.figures.longrun.basins import COLOURS, basin_colour
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, label

QUANTITIES = ("share", "distance", "return_time")
AXES = {"share": "share", "distance": "distance to\nboundary", "return_time": "return time\n(returns)"}
OTHER, UNRESOLVED, ENDED = "0.75", "0.6", "0.15"
NAMES = 2  #: labels of an attractor that the legend names
_DECADE = 10  #: quantities that differ by more than this factor are shown on a logarithmic scale


def sheets(found: GlobalContinuation) -> tuple[Sheet, ...]:
    """One sheet of three panels, and one for each quantifier that is a number, one below the other, over the same values."""
    panels = tuple(partial(global_continuation, found, quantity=quantity) for quantity in _quantities(found))
    return (Sheet("global_continuation", panels, 1, 0.34, legend=True),)


def global_continuation(found: GlobalContinuation, ax: Axes, quantity: str = "share") -> Axes:
    """A quantity or a quantifier of each attractor over the parameter, a colour for each of the six with the largest shares.

    Shares are bands, each value as wide as up to the middle of its neighbours; others are dots, return times with two
    standard errors, joined where the attractor is found at neighbouring values. An arrow at one is a distance beyond the kicks
    that were tried. Values without a map are blank.

    Raises:
        NsmapsError: there is no such quantity.
    """
    known = _quantities(found)
    if quantity not in known:
        raise NsmapsError(f"the quantity is {quantity!r}; expected: {', '.join(known)}")
    sides = _sides(found.values)
    if quantity == "share":
        _bands(found, ax, sides)
    else:
        _dots(found, ax, quantity)
    ax.set_xlim(sides[0], sides[-1])
    ax.set_xlabel(label(found.parameter))
    ax.set_ylabel(AXES.get(quantity, quantity))
    if quantity != known[-1]:  # the axis is that of the lowest panel
        ax.xaxis.label.set_visible(False)
        ax.tick_params(labelbottom=False)
    return ax


def _quantities(found: GlobalContinuation) -> tuple[str, ...]:
    """What has a number for each attractor at each value."""
    return *QUANTITIES, *(name for name, values in found.quantifiers.items() if values.ndim == 2)


def _bands(found: GlobalContinuation, ax: Axes, sides: Floats) -> None:
    """The shares at each value on top of each other, in the order of the numbers."""
    edges, low, entries = np.repeat(sides, 2)[1:-1], np.zeros(len(found.values)), dict[str, Patch]()
    layers = [(np.nan_to_num(found.share[:, k]), colour, name) for k, colour, name in _looks(found)]
    layers += [(found.unresolved, UNRESOLVED, "unresolved"), (found.ended, ENDED, "ended")]
    for share, colour, name in layers:
        top, fill = low + share, basin_colour(colour) if colour.startswith("#") else colour
        if np.nansum(share):
            ax.fill_between(edges, np.repeat(low, 2), np.repeat(top, 2), color=fill, lw=0)
            entries.setdefault(name, Patch(fc=fill, ec="0.3", label=name))
        low = top
    ax.set(ylim=(0, 1), yticks=(0, 0.5, 1))
    ax.legend(handles=list(entries.values()))


def _dots(found: GlobalContinuation, ax: Axes, quantity: str) -> None:
    """The distances, the return times with two standard errors, or a quantifier."""
    values = found.quantifiers[quantity] if quantity in found.quantifiers else getattr(found, quantity)
    for k, colour, _ in _looks(found):
        own = np.where(np.isfinite(values[:, k]), values[:, k], np.nan)
        error = 2 * np.nan_to_num(found.return_error[:, k]) if quantity == "return_time" else None
        ax.errorbar(found.values, own, error, color=colour, marker="o", ms=2.2, mew=0, lw=0.8, elinewidth=0.6)
        beyond = np.isposinf(values[:, k])
        ax.plot(found.values[beyond], np.ones(beyond.sum()), "^", color=colour, ms=3.5, mew=0)
    if quantity in found.quantifiers:
        return
    marks = [Line2D([], [], color=BLACK, marker="^", ms=3.5, mew=0, ls="", label="no smaller kick found")]
    if quantity == "return_time":
        marks = [Line2D([], [], color=BLACK, marker="|", ms=8, ls="", label="two standard errors")]
    if quantity == "return_time" or np.isposinf(values).any():
        ax.legend(handles=marks)
    shown = np.where(np.isposinf(values), 1.0, values)[values > 0]
    if len(shown) and shown.max() > _DECADE * shown.min():
        ax.set_yscale("log")
        ax.set_ylim(shown.min() / 2, shown.max() * 2)


def _looks(found: GlobalContinuation) -> Iterator[tuple[int, str, str]]:
    """The number, colour and name of each attractor; those beyond the colours are grey."""
    total = np.nansum(found.share, axis=0)
    largest = np.sort(np.argsort(-total, kind="stable")[: len(COLOURS)]).tolist()
    for k in range(len(total)):
        own = k in largest
        yield k, COLOURS[largest.index(k)] if own else OTHER, _name(found, k) if own else "other attractors"


def _name(found: GlobalContinuation, number: int) -> str:
    """The motions of one attractor, in the order of the values."""
    names = list(dict.fromkeys(MEANING.get(name, name) for name in found.labels[:, number].tolist() if name))
    return ", ".join(names[:NAMES]) + (", ..." if len(names) > NAMES else "")


def _sides(values: Floats) -> Floats:
    """The ends of the bands, shape (V + 1,): the middles of neighbouring values."""
    if len(values) == 1:
        return np.asarray(values + np.array([-0.5, 0.5]))
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([2 * values[:1] - middle[:1], middle, 2 * values[-1:] - middle[-1:]])
