"""A separable map beside the exact one, along the lines that represent a surface: fig. r2approx and r5approx."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.exact.surfaces.mesh import Mesh
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.figures.lines import diagonal, window
from nsmaps.figures.page import Sheet, file_of
from nsmaps.figures.parts import SeparablePiece, position
from nsmaps.figures.returns.facets import flat
from nsmaps.figures.returns.surfaces import raised
from nsmaps.figures.style import BLUE, GREEN, ORANGE, dress, family_colours, piece_label, symbol
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.fit.lifts import unwrapped
from nsmaps.reduced.fit.polyfit import SeparableFit
from nsmaps.reduced.fit.polymap import PolyMap

_POINTS = 200  #: of a curve of the separable map


def sheets(
    pieces: Mapping[str, SeparablePiece],
    composite: CompositeMap,
    surfaces: Mapping[str, Surface],
    mesh: Callable[..., Mesh],
    title: str = "exact map",
) -> tuple[Sheet, ...]:
    """A sheet a piece, the first's named `separable`: the phase planes above the surfaces, coordinates as columns."""
    drawn, names, colours = [], composite.coordinates, family_colours(list(surfaces))
    for k, piece in enumerate(pieces.values()):
        file, part = file_of("separable", piece.name if k else ""), _part(piece, composite, surfaces, mesh)
        views = partial(separable, part, title=title), partial(separable_surface, part, colour=colours[part.surface.name])
        panels = [partial(view, coordinate=name) for view in views for name in names]
        kinds = (*(None for _ in names), *("3d" for _ in names))
        drawn.append(Sheet(file, tuple(panels), len(names), 0.84, kinds, legend=True))
    return tuple(drawn)


def separable(part: "SeparablePart", ax: Axes, coordinate: str = "", title: str = "exact map") -> Axes:
    """The phase plane of one coordinate: the exact map along one line of the grid, and the separable map.

    The line is the one at the fit's `lines`, or else through the median of the states. Grey: all other states of the
    region, of which a separable map knows nothing.
    """
    i = position(part.names, coordinate or part.names[0])
    exact, fitted = part.exact(i), part.fitted(i)
    start, target = unwrapped(part.mesh.returns)
    flat(ax, np.column_stack([start[:, i], target[:, i]]), part.mesh.triangles, to_rgb("0.8"))
    area = Patch(color="0.8", label=f"{part.surface.name} in {piece_label(part.name)}")
    ax.plot(exact[:, i], exact[:, -1], color=GREEN, lw=1.6, label=title, zorder=3)
    ax.plot(fitted[:, i], fitted[:, -1], color=ORANGE, lw=1.1, ls=(0, (4, 1.5)), label="separable map", zorder=4)
    ends = start[:, i].min(), start[:, i].max()
    low, high = window(target[:, i].min(), max(target[:, i].max(), ends[1]), fitted[:, -1])
    margin = 0.03 * (high - low)
    diagonal(ax, *ends).set_label("_")
    ax.set(xlim=ends, ylim=(low - margin, high + margin))
    ax.set_title(part.held(i))
    ax.legend(handles=[area, *ax.get_legend_handles_labels()[0]])
    return dress(ax, (part.names[i], "k"), (part.names[i], "k+1"))


def separable_surface(part: "SeparablePart", ax: Axes, coordinate: str = "", colour: str = BLUE) -> Axes:
    """The surface of one coordinate over the region of a piece, with the curves of `separable` on it.

    The axes must be three-dimensional (`projection="3d"`).
    """
    i = position(part.names, coordinate or part.names[0])
    start, target = unwrapped(part.mesh.returns)
    raised(ax, "separable", [(np.column_stack([start, target[:, i]]), part.mesh.triangles, colour)], part.names, part.names[i])
    space = cast(Any, ax)
    space.computed_zorder = False  # curves on a surface are hidden by it otherwise
    for curve, shade, dashes in ((part.exact(i), GREEN, "-"), (part.fitted(i), ORANGE, (0, (4, 1.5)))):
        space.plot(*curve.T, color=shade, lw=1.4, ls=dashes, zorder=5)
    return ax


@dataclass(frozen=True, slots=True, eq=False)
class SeparablePart:
    """A piece with a separable fit, and what the exact map says in its region."""

    name: str
    map: PolyMap
    fit: SeparableFit  #: with the values that each coordinate's line is held at
    surface: Surface  #: M states of its family, in its region
    mesh: Mesh  #: the same as triangles
    start: Floats  #: (M, n), angles on one stretch
    target: Floats  #: (M, n), as the polynomials have them

    @property
    def names(self) -> Coordinates:
        """The names of the coordinates."""
        return self.surface.coordinates

    def exact(self, i: int) -> Floats:
        """The line of coordinate i: states and then that coordinate's image, shape (m, n + 1), NaN where the line has a gap."""
        rows = self.fit.data(self.surface, self.names[i])
        line = np.column_stack([self.start[rows], self.target[rows, i]])
        axis = list(self.surface.grid.axes.values())[i]
        gaps = np.flatnonzero(np.diff(line[:, i]) > 1.5 * axis.step)
        return np.insert(line, gaps + 1, np.nan, axis=0)

    def fitted(self, i: int) -> Floats:
        """The same of the separable map, between the ends of that line."""
        line = self.exact(i)[:, :-1]
        states = np.tile(line[0], (_POINTS, 1))
        states[:, i] = np.linspace(np.nanmin(line[:, i]), np.nanmax(line[:, i]), _POINTS)
        return np.column_stack([states, self.map(states)[:, i]])

    def held(self, i: int) -> str:
        """What the line of coordinate i is held at, such as `phi_k = 0.35`."""
        line = self.exact(i)[0]
        return ", ".join(f"{symbol(name, 'k')} = {line[j]:.4g}" for j, name in enumerate(self.names) if j != i)


def _part(
    piece: SeparablePiece, composite: CompositeMap, surfaces: Mapping[str, Surface], mesh: Callable[..., Mesh]
) -> SeparablePart:
    """What is drawn of one piece of a study."""
    region, whole = composite.piece(piece.name).region, surfaces[piece.family]
    surface = whole.restrict(region.contains(whole.coordinates.wrap(whole.start)))
    facets = mesh(whole, lambda returns: region.contains(returns.coordinates.wrap(returns.start)) - np.int64(1))
    start, target = unwrapped(surface)
    medians = dict(zip(surface.coordinates, np.median(surface.start, axis=0).tolist(), strict=True))
    fit = SeparableFit(degrees=piece.degrees, lines=piece.lines or medians, absolute=())
    return SeparablePart(piece.name, composite.piece(piece.name).map, fit, surface, facets, start, target)
