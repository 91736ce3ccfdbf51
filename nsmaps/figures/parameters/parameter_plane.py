"""Planes of two parameters: the period, the motion, and the largest Lyapunov exponent, of what attracts at each pixel."""

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize, TwoSlopeNorm, to_rgb
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.dynamics.motion import CHAOS, QUASI_PERIODIC, UNRESOLVED, kind_of
from nsmaps.errors import NsmapsError
from nsmaps.figures.page import Panel, Sheet
from nsmaps.figures.parameters.curves import draw_curves
from nsmaps.figures.style import BLACK, MOTIONS, OPEN, OTHERS, QUASI, RED, dress, with_unit

if TYPE_CHECKING:
    from nsmaps.dynamics.design.optimum import Optimum
    from nsmaps.dynamics.planes.plane import ParameterPlane
    from nsmaps.figures.parameters.curves import Curves

LONGER, CHAOTIC, RING, SLOW, NOTHING, MISSING = (len(MOTIONS) + k for k in range(1, 7))  #: numbers of kinds after the periods
COLOURS = (*MOTIONS, OTHERS, BLACK, QUASI, OPEN, "#FFFFFF", "0.88")  #: of the kinds from period 1 on, in every plane
WITHOUT = {CHAOS: CHAOTIC, QUASI_PERIODIC: RING, UNRESOLVED: SLOW}  #: the kinds of motions without a period
SEVERAL, REFUSED, UNKNOWN = "////", "xxxx", "....."  #: hatches; what is unknown is grey beneath
EXPONENTS = "RdYlBu_r"  #: colours from below zero, which is pale yellow, to above it; white and grey mean something else
MINUS_INFINITY = "#3B0A45"  #: of exponents, beside the colours of finite ones
_ROUNDING = 1e-9  #: share of the range of exponents within which two are one
TRIMMED = 0.02  #: share of the exponents beyond each end of their colours
_LEAST, _LETTER, _MOST_NAMES = 0.11, 0.045, 16  #: inches, the least radius of an area with a name, and a letter's; names at most


def sheets(
    result: "ParameterPlane", curves: "Curves | None" = None, optimum: "Optimum | None" = None, by: str = ""
) -> tuple[Sheet, ...]:
    """A sheet of periods with bifurcation curves, exponents, observables and quantifiers that are numbers, with the optimum.

    A second one shows the motions, unless their names are their periods. `by` asks for a sheet with one panel alone, coloured as
    by `parameter_plane`.
    """
    means = (partial(mean, result, name=name) for name in _means(result))
    panels: list[Panel] = [partial(parameter_plane, result, curves=curves), partial(exponents, result), *means]
    panels.append(partial(parameter_plane, result, by=by or "motion", curves=curves))
    if optimum is not None and set(result.parameters) <= set(optimum.parameters):
        place = optimum.parameters[result.first], optimum.parameters[result.second]
        panels = [partial(_with_optimum, panel, place) for panel in panels]
    every = Sheet("parameter_plane", tuple(panels[:-1]), 2, 0.85, legend=True)
    one = Sheet("parameter_plane-motions", (panels[-1],), 1, 0.6, legend=True)
    if by:
        return (one,)
    return (every, one) if any(each.label != f"period {each.period}" for each in result.motions if each.period) else (every,)


def _with_optimum(panel: Panel, place: tuple[float, float], ax: Axes) -> Axes:
    """A panel with a star at an optimum."""
    panel(ax)
    (star,) = ax.plot(*([value] for value in place), "*", ms=9, color=RED, mec="#FFFFFF", mew=0.6, clip_on=False)
    if before := ax.get_legend():
        texts, handles = [text.get_text() for text in before.get_texts()], before.legend_handles
    else:
        texts, handles = [], []
    ax.legend(handles=[*handles, star], labels=[*texts, "optimum"])
    return ax


def parameter_plane(
    result: "ParameterPlane",
    ax: Axes,
    by: str = "period",
    curves: "Curves | None" = None,
) -> Axes:
    """The period of the attractor of the first start at each pixel, from 1 to 6 in a fixed colour, in wide areas by name.

    By motions, n:m/pT, the six most frequent have colours. Longer periods and other motions are grey, black is chaos, violet
    quasi-periodic motion, pale brown motion of which neither a period nor chaos was shown, white what has no attractor, dotted
    what was not computed. Hatched are pixels with several attractors, and crossed those whose parameters the system refuses,
    whose number the legend states. Where attractors are those of a neighbour, continued, the title says at what share of the
    pixels orbits of the starts were computed.

    Args:
        result: from `nsmaps.parameter_plane`.
        by: `period` in returns or `turns`, the period in periods of the forcing; `motion`, its name; or an observable or a
            quantifier, as by `mean`.
        curves: bifurcations in the same parameters by name, drawn over it.

    Raises:
        NsmapsError: `by` is something else.
    """
    if by not in ("period", "turns", "motion"):
        return mean(result, ax, by)
    numbers, names = _motions(result) if by == "motion" else _periods(result, by)
    kinds = _kinds(result, numbers)
    norm = BoundaryNorm(np.arange(len(COLOURS) + 1) + 0.5, len(COLOURS))
    ax.pcolormesh(result.along, result.across, kinds, cmap=ListedColormap(COLOURS), norm=norm, shading="nearest", rasterized=True)
    names |= {CHAOTIC: "chaos", RING: "quasi-periodic", SLOW: "unresolved", NOTHING: "no attractor"}
    shown = [number for number in names if (kinds[~result.refused] == number).any()]
    patches: list[Any] = [Patch(facecolor=COLOURS[number - 1], edgecolor="0.5", label=names[number]) for number in shown]
    patches += _unknown(ax, result, kinds == MISSING)
    patches += _hatched(ax, result)
    _names(ax, result, kinds, names)
    ax.legend(handles=[*patches, *draw_curves(ax, curves or {})])
    title = {"period": "period in returns", "turns": "period in periods of the forcing", "motion": "motion"}[by]
    share = f"{title.split()[0]}, {100 * result.computed.mean():.2g} % computed"
    ax.set_title(title if result.computed.all() else share)
    return _dressed(result, ax)


def exponents(result: "ParameterPlane", ax: Axes) -> Axes:
    """The largest Lyapunov exponent per return of the first start, blue where it is below zero, yellow at zero, red above.

    The ends of the colours, which have ticks, leave 2 % of the exponents beyond each. Minus infinity, as of motion that rests or
    chatters, has a colour of its own, white is where nothing attracts, and dotted grey where no exponent was computed.
    """
    values = result.exponent[..., 0]
    finite = values[np.isfinite(values)]
    low, high = np.quantile(finite, (TRIMMED, 1 - TRIMMED), method="nearest").tolist() if finite.size else (-1.0, 0.0)
    size = max(high, 0.0) - min(low, 0.0)
    low, high = (0.0 if abs(end) <= _ROUNDING * size else end for end in (min(low, 0.0), max(high, 0.0)))
    colours, norm = _about_zero(low, high)
    shown = np.where(np.isfinite(values), np.where(np.abs(values) <= _ROUNDING * size, 0.0, values), np.nan)
    mesh = ax.pcolormesh(result.along, result.across, shown, cmap=colours, norm=norm, shading="nearest", rasterized=True)
    beyond = _ROUNDING * size
    extend = ("neither", "min", "max", "both")[int((finite < low - beyond).any()) + 2 * int((finite > high + beyond).any())]
    bar = ax.figure.colorbar(mesh, ax=ax, label="largest exponent per return", extend=extend)
    bar.set_ticks(
        ends := [*dict.fromkeys((low, low / 2, 0.0, high / 2, high))],
        labels=[f"{end:.2g}".replace("-", "\N{MINUS SIGN}") for end in ends],
    )
    patches = []
    if (lowest := np.isneginf(values)).any():
        patches.append(_paint(ax, result, lowest, MINUS_INFINITY, "exponent minus infinity"))
    ax.legend(handles=[*patches, *_without(ax, result, np.isnan(values))])
    return _dressed(result, ax)


def _about_zero(low: float, high: float) -> tuple[Colormap, Normalize]:
    """Colours from blue over yellow at zero to red between two ends; one side alone where the other has no room."""
    both = colormaps[EXPONENTS]
    if low < 0 < high:
        return both, TwoSlopeNorm(0.0, low, high)
    side = both(np.linspace(0.5, 1.0, 256) if high > 0 else np.linspace(0.0, 0.5, 256))
    one = ListedColormap(side).with_extremes(under=both(0.0), over=both(1.0))
    return one, Normalize(low, high if high > low else low + 1.0)


def _without(ax: Axes, result: "ParameterPlane", there: Bools) -> list[Patch]:
    """Paint pixels without a number, white where it was shown that nothing attracts; the entries of the legend."""
    none = there & result.computed & (result.motion[..., 0] < 0)
    patches = _unknown(ax, result, there & ~none)
    if (none & ~result.refused).any():
        patches.append(Patch(facecolor=COLOURS[NOTHING - 1], edgecolor="0.5", label="no attractor"))
    return patches


def _unknown(ax: Axes, result: "ParameterPlane", there: Bools) -> list[Patch]:
    """Paint what was not computed, or was without a result; the entry of the legend."""
    if not there.any():
        return []
    _paint(ax, result, there, COLOURS[MISSING - 1], "")
    _hatch(ax, result, there, UNKNOWN)
    name = "unknown" if (there & result.computed).any() else "not computed"
    return [Patch(facecolor=COLOURS[MISSING - 1], edgecolor="0.35", hatch=UNKNOWN, label=name)]


def _names(ax: Axes, result: "ParameterPlane", kinds: Ints, names: dict[int, str]) -> None:
    """The names of periods or motions in the widest areas of one, where each is widest."""
    from scipy.ndimage import distance_transform_edt, label

    inches = ax.bbox.height / kinds.shape[0] / ax.figure.dpi, ax.bbox.width / kinds.shape[1] / ax.figure.dpi
    found = []
    for kind in np.unique(kinds[kinds <= len(MOTIONS)]).tolist():
        areas, count = label(kinds == kind)
        radii = distance_transform_edt(np.pad(kinds == kind, 1), sampling=inches)[1:-1, 1:-1]
        for area in range(1, count + 1):
            row, column = divmod(int(np.where(areas == area, radii, 0.0).argmax()), kinds.shape[1])
            found.append((float(radii[row, column]), kind, row, column))
    for radius, kind, row, column in sorted(found, reverse=True)[:_MOST_NAMES]:
        if radius >= max(_LEAST, _LETTER * len(names[kind])):
            fill = COLOURS[kind - 1]
            dark = np.dot(to_rgb(fill), (0.3, 0.59, 0.11)) < 0.5
            look: dict[str, Any] = {"color": "white" if dark else "black", "fontweight": "bold", "ha": "center", "va": "center"}
            stroke = [withStroke(linewidth=2.0, foreground=fill)]
            ax.text(result.along[column], result.across[row], names[kind], path_effects=stroke, **look)


def _paint(ax: Axes, result: "ParameterPlane", there: Bools, colour: str, name: str) -> Patch:
    """Paint some pixels in one colour; the entry of the legend."""
    cells = np.ma.masked_array(np.ones(there.shape), ~there)
    ax.pcolormesh(result.along, result.across, cells, cmap=ListedColormap([colour]), shading="nearest", rasterized=True)
    return Patch(facecolor=colour, edgecolor="0.5", label=name)


def mean(result: "ParameterPlane", ax: Axes, name: str) -> Axes:
    """A quantifier of the attractor of the first start, or the mean of an observable along its orbit; dotted if not computed.

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
    ax.figure.colorbar(mesh, ax=ax, label=with_unit(name, unit=result.units.get(name, "")))
    if patches := _without(ax, result, np.isnan(values)):
        ax.legend(handles=patches)
    return _dressed(result, ax)


def _means(result: "ParameterPlane") -> dict[str, Floats]:
    """What has a number at each pixel, of the orbits of the first start, by name, shapes (W, V)."""
    means = {name: result.means[..., 0, k] for k, name in enumerate(result.observables)}
    return means | {name: values[..., 0] for name, values in result.quantifiers.items() if values.ndim == 3}


def _periods(result: "ParameterPlane", by: str) -> tuple[Ints, dict[int, str]]:
    """The period of each pixel, shape (W, V), and the names of the colours of periods."""
    period = (result.period if by == "period" else result.turns)[..., 0]
    return period, {number: str(number) for number in range(1, LONGER)} | {LONGER: f"above {len(MOTIONS)}"}


def _motions(result: "ParameterPlane") -> tuple[Ints, dict[int, str]]:
    """The number of the motion of each pixel, shape (W, V), and the names of the colours: of the most frequent, and of others."""
    labels = np.where(result.period[..., 0] > 0, result.labels[..., 0], "")
    kinds, counts = np.unique(labels[labels != ""], return_counts=True)
    frequent = kinds[np.argsort(-counts, kind="stable")][: len(MOTIONS)].tolist()
    names = dict(enumerate(sorted(frequent, key=lambda name: (len(name), name)), 1))
    numbers = np.select([labels == name for name in names.values()], [*names], LONGER) if names else np.full(labels.shape, LONGER)
    return numbers, names | {LONGER: "other motions"}


def _kinds(result: "ParameterPlane", numbers: Ints) -> Ints:
    """The number of the colour of each pixel, shape (W, V), by the numbers of periods or motions."""
    longer = np.where(numbers > len(MOTIONS), LONGER, np.maximum(numbers, 1))
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
