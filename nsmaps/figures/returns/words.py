"""The state space by word and by piece: fig. regions, panels (a) and (b)."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from nsmaps.exact.surfaces.mesh import grid_mesh
from nsmaps.figures.composite.regions import regions
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import plane
from nsmaps.figures.returns.facets import flat
from nsmaps.figures.returns.surfaces import Meshing, Surfaces, by_name
from nsmaps.figures.style import BLUE, GREY, dress, family_colours, tint
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.fit.filter import DiagonalRegion

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.limit_set import OrbitPair


def sheets(
    named: Surfaces,
    mesh: Meshing = grid_mesh,
    diagonal: DiagonalRegion | None = None,
    composite: CompositeMap | None = None,
    orbits: "Sequence[OrbitPair]" = (),
) -> tuple[Sheet, ...]:
    """One sheet: the words, and beside them the pieces where there is a composite map."""
    panels = [partial(words, named, mesh=mesh, diagonal=diagonal)]
    if composite is not None:
        panels.append(partial(regions, composite, grid=next(iter(by_name(named).values())).grid, orbits=orbits, shares=False))
    alone = len(panels) == 1
    return (Sheet("words", tuple(panels), len(panels), 0.8 if alone else 0.85, legend=True, share=0.65 if alone else 1.0),)


def words(named: Surfaces, ax: Axes, mesh: Meshing = grid_mesh, diagonal: DiagonalRegion | None = None) -> Axes:
    """The state space by the family of each start's return, grey from the ninth on; starts in no family stay white.

    The hull of the states near the diagonals, over all values of the swept parameter, is outlined (eq. r1uniond).
    """
    surfaces = by_name(named)
    first = next(iter(surfaces.values()))
    grid, seen = first.grid, plane(first.grid)
    colours = family_colours(list(surfaces))
    for name, colour in colours.items():
        facets = mesh(surfaces[name])
        flat(ax, facets.returns.start[:, seen], facets.triangles, tint(colour, 0.25))
    ends = [(axis.low, axis.high) for axis in grid.varying.values()]
    ax.set(xlim=ends[0], ylim=ends[1])
    handles: list[Patch] = [Patch(color=tint(c, 0.25), label=name) for name, c in colours.items() if c != GREY]
    if more := len(colours) - len(handles):
        handles.append(Patch(color=tint(GREY, 0.25), label=f"{more} more words"))
    if diagonal is not None and len(diagonal.start):
        (left, right), (low, high) = diagonal.box
        outline = Rectangle((left, low), right - left, high - low, fill=False, ec=BLUE, lw=1.3, label="near both diagonals")
        ax.add_patch(outline)
        handles.append(outline)
    if not np.logical_or.reduce([surface.member for surface in surfaces.values()]).all():
        handles.append(Patch(fc="white", ec="0.7", lw=0.5, label="other"))
    ax.legend(handles=handles)
    across, up = (first.coordinates[k] for k in seen)
    return dress(ax, (across, "k"), (up, "k"))
