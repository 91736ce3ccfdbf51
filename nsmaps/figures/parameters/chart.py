"""Planes of two parameters: the period, and the largest Lyapunov exponent, of what attracts at each pixel."""

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, TwoSlopeNorm
from matplotlib.patches import Patch

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.dynamics.motion import CHAOS, QUASI_PERIODIC, UNRESOLVED, kind_of
from nsmaps.errors import NsmapsError
from nsmaps.figures.page import Panel, Sheet
from nsmaps.figures.parameters.stability import draw_curves
from nsmaps.figures.style import BLACK, BLUE, BROWN, GREEN, GREY, MAGENTA, OLIVE, ORANGE, RED, SKY, YELLOW, dress

if TYPE_CHECKING:
    from nsmaps.dynamics.charts.chart import ParameterPlane
    from nsmaps.dynamics.design.optimum import Optimum
    from nsmaps.figures.parameters.stability import Curves

PERIODS = (SKY, ORANGE, GREEN, YELLOW, MAGENTA, BLUE, RED, OLIVE, BROWN)  #: of the periods 1, 2, ..., in every chart
LONGER, CHAOTIC, QUASI, OPEN, NOTHING, MISSING = (len(PERIODS) + k for k in range(1, 7))  #: numbers of further kinds
COLOURS = (*PERIODS, GREY, BLACK, "#7A3B8F", "#E6D2B0", "#FFFFFF", "0.88")  #: of the kinds from 1 on
WITHOUT = {CHAOS: CHAOTIC, QUASI_PERIODIC: QUASI, UNRESOLVED: OPEN}  #: the kinds of motions without a period
SEVERAL, REFUSED = "////", "xxxx"  #: hatches
MINUS_INFINITY, UNKNOWN = "#1B1145", "0.78"  #: of exponents, beside the colours of finite ones


def sheets(result: "ParameterPlane", curves: "Curves | None" = None, optimum: "Optimum | None" = None) -> tuple[Sheet, ...]:
    """One sheet: periods with bifurcation curves, exponents, observables and quantifiers that are numbers, with the optimum."""
    means = (partial(mean, result, name=name) for name in _means(result))
    panels: tuple[Panel, ...] = (partial(chart, result, curves=curves), partial(exponents, result), *means)
    if optimum is not None and set(result.parameters) <= set(optimum.parameters):
        place = optimum.parameters[result.first], optimum.parameters[result.second]
        panels = tuple(partial(_with_optimum, panel, place) for panel in panels)
    return (Sheet("chart", panels, 2, 0.85, legend=True),)


def _with_optimum(panel: Panel, place: tuple[float, float], ax: Axes) -> Axes:
    """A panel with a star at an optimum."""
    panel(ax)
    ax.plot(*([value] for value in place), "*", ms=9, color=RED, mec="#FFFFFF", mew=0.6, clip_on=False, label="optimum")
    return ax


def chart(
    result: "ParameterPlane",
    ax: Axes,
    by: str = "period",
    curves: "Curves | None" = None,
) -> Axes:
    """The period of the attractor of the first start at each pixel, a fixed colour for each from 1 to 9.

    Longer ones are grey, black is chaos, violet quasi-periodic motion, pale brown motion of which neither a period nor chaos was
    shown, white what has no attractor. Hatched are pixels with several attractors,
    and crossed those whose parameters the system refuses, whose number the legend states. Pixels that were not computed have
    the colour of a neighbour; the title then says what share was computed.

    Args:
        result: from `nsmaps.parameter_plane`.
        by: `period` in returns or `turns`, the period in periods of the forcing; or an observable or a quantifier, as by `mean`.
        curves: bifurcations in the same parameters by name, drawn over it.

    Raises:
        NsmapsError: `by` is something else.
    """
    if by not in ("period", "turns"):
        return mean(result, ax, by)
    kinds = _kinds(result, (result.period if by == "period" else result.turns)[..., 0])
    norm = BoundaryNorm(np.arange(len(COLOURS) + 1) + 0.5, len(COLOURS))
    ax.pcolormesh(result.along, result.across, kinds, cmap=ListedColormap(COLOURS), norm=norm, shading="nearest", rasterized=True)
    names = {number: str(number) for number in range(1, LONGER)}
    names |= {LONGER: f"above {len(PERIODS)}", CHAOTIC: "chaos", QUASI: "quasi-periodic", OPEN: "unresolved"}
    names |= {NOTHING: "no attractor", MISSING: "not computed"}
    shown = [number for number in names if (kinds[~result.refused] == number).any()]
    patches: list[Any] = [Patch(facecolor=COLOURS[number - 1], edgecolor="0.5", label=names[number]) for number in shown]
    patches += _hatched(ax, result)
    ax.legend(handles=[*patches, *draw_curves(ax, curves or {})])
    title = "period in returns" if by == "period" else "period in periods of the forcing"
    share = "" if result.computed.all() else f" ({100 * result.computed.mean():.2g} % computed)"
    ax.set_title(title + share)
    return _dressed(result, ax)


def exponents(result: "ParameterPlane", ax: Axes) -> Axes:
    """The largest Lyapunov exponent per return of the first start, blue where it is below zero, white at zero, red above.

    Minus infinity, as of motion that rests or chatters, has a colour of its own, and grey is where no exponent was computed.
    """
    values = result.exponent[..., 0]
    finite = values[np.isfinite(values)]
    limits = np.quantile(finite, (0.02, 0.98), method="nearest").tolist() if finite.size else (0.0, 0.0)
    norm = TwoSlopeNorm(0.0, min(limits[0], -1e-3), max(limits[1], 1e-3))
    shown = np.where(np.isfinite(values), values, np.nan)
    mesh = ax.pcolormesh(result.along, result.across, shown, cmap="RdBu_r", norm=norm, shading="nearest", rasterized=True)
    figure = ax.get_figure()
    assert figure is not None
    figure.colorbar(mesh, ax=ax, label="largest exponent per return", extend="both")
    kinds = ((np.isneginf(values), MINUS_INFINITY, "exponent minus infinity"), (np.isnan(values), UNKNOWN, "not computed"))
    ax.legend(handles=[_paint(ax, result, there, colour, name) for there, colour, name in kinds if there.any()])
    return _dressed(result, ax)


def _paint(ax: Axes, result: "ParameterPlane", there: Bools, colour: str, name: str) -> Patch:
    """Paint some pixels in one colour; the entry of the legend."""
    cells = np.ma.masked_array(np.ones(there.shape), ~there)
    ax.pcolormesh(result.along, result.across, cells, cmap=ListedColormap([colour]), shading="nearest", rasterized=True)
    return Patch(facecolor=colour, edgecolor="0.5", label=name)


def mean(result: "ParameterPlane", ax: Axes, name: str) -> Axes:
    """A quantifier of the attractor of the first start, or the mean of an observable along its orbit; grey if not computed.

    Means are per period of the forcing, without forcing per return.

    Raises:
        NsmapsError: the plane has none of this name.
    """
    known = _means(result)
    if name not in known:
        text = f"the plane has no observable or quantifier {name!r}"
        raise NsmapsError(f"{text}; expected: {', '.join(('period', 'turns', *known))}")
    values = known[name]
    shown = np.where(np.isfinite(values), values, np.nan)
    mesh = ax.pcolormesh(result.along, result.across, shown, cmap="cividis", shading="nearest", rasterized=True)
    figure = ax.get_figure()
    assert figure is not None
    figure.colorbar(mesh, ax=ax, label=name)
    if np.isnan(values).any():
        ax.legend(handles=[_paint(ax, result, np.isnan(values), UNKNOWN, "not computed")])
    return _dressed(result, ax)


def _means(result: "ParameterPlane") -> dict[str, Floats]:
    """What has a number at each pixel, of the orbits of the first start, by name, shapes (W, V)."""
    means = {name: result.means[..., 0, k] for k, name in enumerate(result.observables)}
    return means | {name: values[..., 0] for name, values in result.quantifiers.items() if values.ndim == 3}


def _kinds(result: "ParameterPlane", period: Ints) -> Ints:
    """The number of the colour of each pixel, shape (W, V)."""
    longer = np.where(period > len(PERIODS), LONGER, np.maximum(period, 1))
    ended = np.where(result.computed, NOTHING, MISSING)
    without = np.array([*(WITHOUT.get(kind_of(motion.label), 0) for motion in result.motions), 0])[result.motion[..., 0]]
    return np.where(result.motion[..., 0] < 0, ended, np.where(without > 0, without, longer))


def _hatched(ax: Axes, result: "ParameterPlane") -> Iterator[Any]:
    """Hatch what has several attractors and what is refused; the entries of the legend."""
    refused = f"refused parameters: {int(result.refused.sum())} pixels"
    for there, hatch, name in ((result.counts > 1, SEVERAL, "several attractors"), (result.refused, REFUSED, refused)):
        if there.any():
            _hatch(ax, result, there, hatch)
            yield Patch(facecolor="none", edgecolor="0.35", hatch=hatch, label=name)


def _hatch(ax: Axes, result: "ParameterPlane", there: Bools, hatch: str) -> None:
    """Hatch some pixels."""
    x, y = (_sides(axis) for axis in (result.along, result.across))
    with rc_context({"hatch.linewidth": 0.5, "hatch.color": "0.35"}):
        ax.contourf(x, y, there.repeat(2, axis=0).repeat(2, axis=1), levels=[0.5, 1.5], colors="none", hatches=[hatch])


def _sides(values: Floats) -> Floats:
    """Both sides of the pixels along an axis, shape (2 V,)."""
    middle = (values[1:] + values[:-1]) / 2
    outer = 2 * values[:1] - middle[:1], 2 * values[-1:] - middle[-1:]
    return np.concatenate([outer[0], middle, outer[1]]).repeat(2)[1:-1] if len(values) > 1 else values + np.array([-0.5, 0.5])


def _dressed(result: "ParameterPlane", ax: Axes) -> Axes:
    return dress(ax, (result.parameters[0], ""), (result.parameters[1], ""))
