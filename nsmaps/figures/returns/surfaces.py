"""The return surfaces over the plane of states, a picture a coordinate: fig. 3d."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from nsmaps.arrays import Floats
from nsmaps.coordinates import is_angle
from nsmaps.errors import NsmapsError
from nsmaps.figures.data import PLANES, plane, position
from nsmaps.figures.lines import jumps
from nsmaps.figures.page import Sheet
from nsmaps.figures.returns.dots import Dots
from nsmaps.figures.style import angle_ticks, dress, family_colours, label, tint

if TYPE_CHECKING:
    from nsmaps.exact.surfaces.surface import Surface
    from nsmaps.study.result import StudyResult

Colour = str | tuple[float, float, float]

_LIGHT = np.array([-0.40, -0.50, 0.77])  #: where the light comes from
_STEEP = 1.5  #: cells' share of the whole height, beyond which points are put between those of the grid
_JUMP = 0.02  #: of a surface's height, below which a step is not a jump
ELEVATION, AZIMUTH = 24, -128  #: from where they are seen, degrees


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with a panel for every coordinate of the image."""
    coordinates = next(iter(PLANES.of(result, "surfaces").values())).coordinates
    panels = tuple(partial(surfaces, result, coordinate=name) for name in coordinates)
    return (Sheet("surfaces", panels, len(panels), 0.83, "3d"),)


def surfaces(result: "StudyResult", ax: Axes, coordinate: str = "") -> Axes:
    """One coordinate of the image over the states, a shaded point a state, coloured by family.

    It is the first coordinate unless another is named. The axes must be three-dimensional (`projection="3d"`).
    """
    named = PLANES.of(result, "surfaces")
    first = next(iter(named.values()))
    i = position(first.coordinates, coordinate or first.coordinates[0])
    colours = family_colours(list(named))
    parts = [(surface, surface.image[:, i], colours[name]) for name, surface in named.items()]
    raised(ax, "surfaces", parts, first.coordinates[i])
    handles = [Patch(color=tint(colour, 0.15), label=name) for name, colour in colours.items()]
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.08, 0.98))
    return ax


def raised(ax: Axes, figure: str, parts: Sequence[tuple["Surface", Floats, Colour]], image: str) -> None:
    """Surfaces, each with the heights of its M members and a colour, as shaded points on dressed axes."""
    if ax.name != "3d":
        raise NsmapsError(f"the figure {figure!r} needs axes made with projection='3d'; these are {ax.name!r}")
    space = cast(Any, ax)
    grid, seen = parts[0][0].grid, plane(parts[0][0].grid)
    names = [parts[0][0].coordinates[k] for k in seen]
    drawn = [np.column_stack([surface.start[:, seen], height, _shaded(surface, height, c)]) for surface, height, c in parts]
    low, high = np.min([height.min() for _, height, _ in parts]), np.max([height.max() for _, height, _ in parts])
    steep = _STEEP * max(float(high - low), 1e-300) / max(grid.shape)
    drawn += [_between(part[0], rows, axis, steep) for part, rows in zip(parts, drawn, strict=True) for axis in (0, 1)]
    points, shades = np.split(np.concatenate(drawn), [3], axis=1)
    # one collection of all families, so that each point is sorted by depth among all others; drawn as wide as its cell
    Dots(space, points, shades, float(np.clip(450 / max(grid.shape), 1.3, 6)))
    space.set_zmargin(0.05)
    space.auto_scale_xyz(*points.T)
    for set_limits, starts in zip((space.set_xlim, space.set_ylim), points.T[:2], strict=True):
        set_limits(starts.min(), starts.max())
    space.set_zlim(bottom=min(0.0, float(points[:, 2].min())))
    space.view_init(elev=ELEVATION, azim=AZIMUTH)
    space.set_box_aspect((1, 1, 0.8), zoom=1.05)
    dress(ax, (names[0], "k"), (names[1], "k"))
    space.zaxis.set_rotate_label(False)  # else it reads downwards from some sides
    space.set_zlabel(label(image, "k+1"), rotation=90)
    if is_angle(image):
        angle_ticks(space.zaxis, float(np.ptp(space.get_zlim())))


def _between(surface: "Surface", rows: Floats, axis: int, steep: float) -> Floats:
    """Points between neighbours along an axis that are farther apart in height than `steep`, but for jumps, so that no gap shows.

    Of members as rows (M, 6), place, height and colour; as many such rows between two as leave steps of less than `steep`.
    """
    table = np.moveaxis(np.stack([_over_plane(surface, column) for column in rows.T], axis=-1), axis, -2)
    height = table[..., 2]
    size = np.where(jumps(height, _JUMP * float(np.ptp(rows[:, 2]))), 0.0, np.abs(np.diff(height)))
    count = np.floor(size / steep).astype(int).ravel()
    before, after = (np.repeat(part.reshape(-1, 6), count, axis=0) for part in (table[..., :-1, :], table[..., 1:, :]))
    number = np.arange(len(before)) - np.repeat(np.cumsum(count) - count, count)
    share = ((number + 1) / (np.repeat(count, count) + 1))[:, np.newaxis]
    return np.asarray((1 - share) * before + share * after)


def _over_plane(surface: "Surface", values: Floats) -> Floats:
    """Values of the members over the two axes along which the grid varies, with NaN elsewhere."""
    return np.squeeze(surface.on_grid(values))


def _shaded(surface: "Surface", values: Floats, colour: Colour) -> Floats:
    """A colour a member, lighter where the surface faces the light, shape (M, 3)."""
    height = _over_plane(surface, values) / max(float(np.ptp(values)), 1e-300)
    slopes = [slope * (points - 1) for slope, points in zip(np.gradient(height), height.shape, strict=True)]
    normal = np.stack([-slopes[0], -slopes[1], np.ones(height.shape)], axis=-1)
    light = np.abs(normal @ _LIGHT) / np.linalg.norm(normal, axis=-1)
    light = np.where(np.isfinite(light), light, 0.5).ravel()[surface.member, np.newaxis]
    base = np.array(to_rgb(colour))
    return np.clip(base * (0.45 + 0.55 * light) + 0.38 * light**2 * (1 - base), 0, 1)
