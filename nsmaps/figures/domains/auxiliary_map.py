"""Cobwebs of the full auxiliary map over its curves and those of the separable pieces: eq. auxM, fig. cobweb12d35 (a)."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from nsmaps.auxiliary.full_map import AuxiliaryOrbit
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.figures.composite.areas import colours_over
from nsmaps.figures.composite.cobweb import draw_pieces, look
from nsmaps.figures.lines import last_tenth, staircase
from nsmaps.figures.page import Sheet
from nsmaps.figures.parts import position
from nsmaps.figures.style import BLUE, HALO, MAGENTA, ORANGE
from nsmaps.reduced.composite.composite import CompositeMap

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.limit_set import OrbitPair


def sheets(
    orbit: AuxiliaryOrbit,
    composite: CompositeMap | None = None,
    grid: Grid | None = None,
    orbits: "Sequence[OrbitPair]" = (),
) -> tuple[Sheet, ...]:
    """One sheet: a panel a coordinate."""
    of = partial(auxiliary_map, orbit, composite=composite, grid=grid, orbits=orbits)
    panels = tuple(partial(of, coordinate=name) for name in orbit.coordinates)
    return (Sheet("auxiliary_map", panels, min(len(panels), 2), 0.85, legend=True),)


def auxiliary_map(
    orbit: AuxiliaryOrbit,
    ax: Axes,
    composite: CompositeMap | None = None,
    grid: Grid | None = None,
    orbits: "Sequence[OrbitPair]" = (),
    coordinate: str = "",
) -> Axes:
    """The generic orbit of the full auxiliary map in one coordinate, with its last tenth in magenta.

    Separable pieces are curves and others the areas of their images; upper (blue) and lower maps (orange) are drawn where they
    replace the map, in A_1 and over the regions of the pieces that the study names.
    """
    i = position(orbit.coordinates, coordinate or orbit.coordinates[0])
    if composite is not None and grid is not None:
        draw_pieces(composite, ax, i, grid, colours_over(composite, grid, orbits))
    else:
        ends = [region.envelopes[i].x[[0, -1]] for region in orbit.regions]
        ax.set_xlim(np.min(ends), np.max(ends))
    for k, region in enumerate(orbit.regions):
        envelope = region.envelopes[i]
        for curve, colour, text in ((envelope.upper, BLUE, "upper map"), (envelope.lower, ORANGE, "lower map")):
            ax.plot(envelope.x, curve, color=colour, lw=1.5, zorder=3.5, path_effects=HALO, label="_" if k else text)
    values = orbit.states[np.isfinite(orbit.states).all(axis=1), i]
    ax.plot(*staircase(values), color="0.2", lw=0.7, zorder=4, label="orbit, both maps in turn")
    ax.plot(*staircase(last_tenth(values)), color=MAGENTA, lw=1.3, zorder=5, label="its last tenth")
    ax.plot(values[:1], values[:1], "o", mfc="white", mec="black", mew=0.8, ms=4.2, zorder=6, label="start")
    return look(ax, values, orbit.coordinates[i])
