"""What a certificate proves: cells by their order of arrival, and what is left open, on each wall."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, to_rgb
from matplotlib.patches import Patch

from nsmaps.coordinates import TWO_PI
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLACK, BLUE, GREEN
from nsmaps.figures.ticks import angle_ticks

if TYPE_CHECKING:
    from nsmaps.cells.certified import Orders, Shares

    Impacts = list[tuple[int, float, float, bool]]

SHAPE = (540, 640)  #: pixels of a panel along the phase and the speed
SCALE = ListedColormap(colormaps["YlOrBr"](np.linspace(0.03, 0.5, 256)))  #: light, so that thin sets stand out


def sheet(orders: "Orders", impacts: "Impacts", name: str, zero: str = "trap") -> Sheet:
    """A panel for each wall of a certificate.

    Args:
        impacts: of cycles that are marked: wall, phase, speed, and whether the cycle is stable.
        name: of the file.
        zero: what cells of order zero are, `trap` or `closed set`.
    """
    pixels = [orders.pixels(wall, SHAPE) for wall in range(len(orders.letters))]
    highest = max(float(np.nanmax(each.order, initial=1.0)) for each in pixels)

    def panel(wall: int, ax: Axes) -> Axes:
        proved(ax, pixels[wall], highest, [each[1:] for each in impacts if each[0] == wall], zero)
        ax.set_title(f"wall {orders.letters[wall]}")
        return ax

    panels = tuple(lambda ax, wall=wall: panel(wall, ax) for wall in range(len(pixels)))
    return Sheet(name, panels, len(panels), 0.92 if len(panels) > 1 else 0.7, legend=True)


def proved(ax: Axes, pixels: "Shares", highest: float, impacts: "list[tuple[float, float, bool]]", zero: str) -> Axes:
    """Pixels in the shade of the order of their cells, of order zero in green, mixed with blue where a part is left open.

    The share of blue is the square root of that part, so that sets much thinner than a pixel are seen.
    """
    norm = LogNorm(1, max(highest, 2.0))
    order = np.where(np.isnan(pixels.order), 1.0, pixels.order)
    shade = SCALE(norm(np.maximum(order, 1.0)))[..., :3]
    shade[order == 0] = to_rgb(GREEN)
    colour = shade + np.sqrt(pixels.left)[..., None] * (np.array(to_rgb(BLUE)) - shade)
    ax.imshow(colour, origin="lower", extent=(0, pixels.top, 0, TWO_PI), aspect="auto", interpolation="nearest")
    ax.figure.colorbar(ScalarMappable(norm, SCALE), ax=ax, label="order of arrival")
    patches = [Patch(color=BLUE, label="left open"), Patch(color=GREEN, label=zero)]
    looks = {True: ("o", "white", BLACK, "stable cycle"), False: ("X", BLACK, "white", "saddle")}
    for stable in dict.fromkeys(stable for _, _, stable in impacts):
        marker, face, edge, text = looks[stable]
        places = np.array([(speed, phase) for phase, speed, kind in impacts if kind == stable])
        ax.plot(*places.T, marker, color=face, mec=edge, mew=0.6, label=text)
    ax.legend(handles=[*patches, *ax.lines])
    ax.set(xlabel="impact speed", ylabel="phase (rad)", xlim=(0, pixels.top), ylim=(0, TWO_PI))
    angle_ticks(ax.yaxis, TWO_PI)
    return ax
