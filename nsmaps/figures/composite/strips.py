"""The strips of an accurate map over the state space: the degree of its polynomials, and the grazes between which they lie."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap

from nsmaps.figures.data import ACCURATE
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import dress
from nsmaps.reduced.adaptive.kernel import DEGREE

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

POINTS = 200  #: of a drawn edge


def sheets(result: "StudyResult") -> tuple[Sheet, ...]:
    """One sheet with one panel."""
    return (Sheet("strips", (partial(strips, result),), 1, 0.75),)


def strips(result: "StudyResult", ax: Axes) -> Axes:
    """The leaves by the total degree of their polynomials, with white lines between them and the edges of the map in black."""
    strips = ACCURATE.of(result, "strips").strips
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
    names = result.system.coordinates
    return dress(ax, (names[0], "k"), (names[1], "k"))
