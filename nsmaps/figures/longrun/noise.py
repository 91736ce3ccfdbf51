"""What noise does: fig. comp_stoch redrawn, and how long orbits stay in which motion."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from nsmaps.dynamics.noise.impacts import ImpactDiagram
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, BLUE, GREEN, MAGENTA, ORANGE, RED, SKY, label, symbol, with_unit

if TYPE_CHECKING:
    from nsmaps.dynamics.noise.residence import NoiseResult, Residence

_COLOURS = (BLUE, ORANGE, GREEN, MAGENTA, SKY)


def sheets(result: "NoiseResult | ImpactDiagram") -> tuple[Sheet, ...]:
    """One sheet of panels: impacts with falling and growing parameter, if there are any, shares and rates; of impacts one."""
    if isinstance(result, ImpactDiagram):
        return (Sheet("noise", (partial(noise, result),), 1, legend=True),)
    ways = [[each for each in result.impacts if each.direction == way] for way in ("down", "up")]
    diagrams = [partial(impacts, way) for way in ways if way]
    return (Sheet("noise", (*diagrams, partial(noise, result), partial(rates, result)), 2, legend=True),)


def noise(result: "NoiseResult | ImpactDiagram", ax: Axes) -> Axes:
    """The share of the time in each motion against the size of the noise, or the impacts over a parameter."""
    return impacts([result], ax) if isinstance(result, ImpactDiagram) else shares(result, ax)


def impacts(diagrams: Sequence[ImpactDiagram], ax: Axes) -> Axes:
    """Velocities of impacts over a parameter, those on other walls than the base wall below zero.

    Open circles without noise, blue on the base wall and black on the other; dots with noise, green and red. Events of other
    letters of a system with modes have other colours.
    """
    for diagram in sorted(diagrams, key=lambda each: -each.noise.sigma):
        noisy = diagram.noise.sigma > 0
        for wall, name in enumerate(diagram.walls):
            colour = (GREEN, RED, MAGENTA)[wall % 3] if noisy else (BLUE, BLACK, SKY)[wall % 3]
            text = f"{name}, " + (rf"$\sigma = {diagram.noise.sigma:.3g}$" if noisy else "no noise")
            look = {"ms": 2.6, "mew": 0, "alpha": 0.5} if noisy else {"ms": 2.2, "mew": 0.4, "mfc": "none"}
            ax.plot(*_points(diagram, wall), "." if noisy else "o", color=colour, label=text, rasterized=True, **look)
    first = diagrams[0]
    ax.margins(x=0.02)
    ax.axhline(0, color="0.8", lw=0.4, zorder=0)
    ax.set_title(f"{symbol(first.parameter)} {'falling' if first.direction == 'down' else 'growing'}", loc="right")
    ax.set_xlabel(label(first.parameter))
    ax.set_ylabel(with_unit("velocity", "velocity"))
    for handle in ax.legend().get_lines():
        handle.set_markersize(4 if handle.get_marker() == "o" else 6)
        handle.set_alpha(1)
    return ax


def _points(diagram: ImpactDiagram, wall: int) -> tuple[list[float], list[float]]:
    """Values of the parameter and velocities of the impacts on one wall, each circle of a periodic motion once."""
    x, y = [], []
    for value, walls, speeds in zip(diagram.values.tolist(), diagram.wall, diagram.speed, strict=True):
        own = np.unique(np.round(speeds[walls == wall], 9))
        x += [value] * len(own)
        y += (own if wall == 0 else -own).tolist()
    return x, y


def shares(found: "NoiseResult", ax: Axes) -> Axes:
    """The share of the time in each motion against the size of the noise; of the returns where two maps are shown."""
    for stays, look, of in _maps(found):
        for k, name in enumerate(stays[0].modes):
            shown: dict[str, Any] = {
                "ms": 2.4,
                "color": _COLOURS[k % len(_COLOURS)],
                "mfc": look["mfc"] or _COLOURS[k % len(_COLOURS)],
            }
            ax.plot(found.sigma, [stay.share[k] for stay in stays], "o", ls=look["ls"], label=f"{of}{name}", **shown)
    ax.set_ylim(-0.03, 1.03)
    ax.set_ylabel("share of the returns" if found.in_returns else "share of the time")
    return _over_sizes(ax)


def _maps(found: "NoiseResult") -> "list[tuple[tuple[Residence, ...], dict[str, Any], str]]":
    """The residence of each map, its look, and its name before that of a motion."""
    full, open_ = {"ls": "-", "mfc": None}, {"ls": "--", "mfc": "white"}
    return (
        [(found.counted, full, "exact, "), (found.reduced, open_, "composite, ")]
        if found.reduced
        else [(found.stays, full, "share of ")]
    )


def rates(found: "NoiseResult", ax: Axes) -> Axes:
    """Changes from motion to motion per unit of time in the first, per return where two maps are shown, with standard errors.

    Sizes without a change are left out.
    """
    modes = found.stays[0].modes
    pairs = [(i, j) for i in range(len(modes)) for j in range(len(modes)) if i != j]
    for stays, style, of in _maps(found):
        for number, (i, j) in enumerate(pairs):
            kept = [(sigma, stay) for sigma, stay in zip(found.sigma, stays, strict=True) if stay.switches[i, j] > 0]
            x, y = [sigma for sigma, _ in kept], [stay.rates[i, j] for _, stay in kept]
            wide = [min(stay.rates_error[i, j], 0.99 * stay.rates[i, j]) for _, stay in kept]
            colour = _COLOURS[number % len(_COLOURS)]
            look: dict[str, Any] = {
                "color": colour,
                "ms": 2.4,
                "ls": style["ls"] if found.reduced else "--",
                "mfc": style["mfc"] or colour,
            }
            ax.errorbar(x, y, wide, fmt="s", capsize=1.5, **look)
            name = f"{of if found.reduced else ''}{modes[i]} to {modes[j]}"
            ax.plot([], [], "s", label=name, **look)
    ax.set_yscale("log")
    ax.set_ylabel("changes per return" if found.in_returns else "changes per unit of time")
    return _over_sizes(ax)


def _over_sizes(ax: Axes) -> Axes:
    ax.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    ax.set_xlabel(with_unit(r"noise $\sigma$", "sigma"))
    if ax.get_legend_handles_labels()[0]:
        ax.legend()
    else:
        ax.text(0.5, 0.5, "no changes", transform=ax.transAxes, ha="center")
    return ax
