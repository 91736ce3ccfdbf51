"""The strips of an accurate map over the state space: the degree of its polynomials, and the grazes between which they lie."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap

from nsmaps.coordinates import Angle
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import dress
from nsmaps.reduced.adaptive.accurate import AccurateResult
from nsmaps.reduced.adaptive.kernel import DEGREE

POINTS = 200  #: of a drawn edge
NAMES = "v", Angle("phi")  #: of the speed and the phase of every map of strips


def sheets(result: AccurateResult, names: Sequence[str] = NAMES) -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("strips", (partial(strips, result, names=names),), 1, 0.75),)


def strips(result: AccurateResult, ax: Axes, names: Sequence[str] = NAMES) -> Axes:
    """The leaves by the total degree of their polynomials, with white lines between them and the edges of the map in black."""
    strips = result.strips
    (v0, v1), (phi0, phi1) = strips.bounds
    degrees = sorted(strips.report.degrees)
    degree = np.array([*strips.tables.leaf[:, DEGREE], np.nan])[strips.tables.raster]
    shades = ListedColormap(colormaps["cividis_r"](np.linspace(0.1, 0.75, len(degrees))))
    norm = BoundaryNorm([degrees[0] - 1, *(np.add(degrees[1:], degrees[:-1]) / 2), degrees[-1] + 1], len(degrees))
    image = ax.imshow(degree.T, extent=(v0, v1, phi0, phi1), origin="lower", aspect="auto", cmap=shades, norm=norm)
    for slab in strips.slabs:
        s = np.linspace(-1, 1, POINTS)
        for phi in slab.phases(s)[1:-1]:
            ax.plot(slab.speeds(s), phi, color="k", lw=0.7)
    figure = ax.figure
    bar = figure.colorbar(image, ax=ax, ticks=[(a + b) / 2 for a, b in zip(norm.boundaries, norm.boundaries[1:], strict=False)])
    bar.ax.set_yticklabels([str(each) for each in degrees])
    bar.set_label("total degree")
    ax.set(xlim=(v0, v1), ylim=(phi0, phi1))
    return dress(ax, (names[0], "k"), (names[1], "k"))
