"""The impact oscillator drawn."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GREEN, RED, STEEL = "#009E73", "#D55E00", "0.82"  #: the wall in the colour of its impacts in other figures


def sketch(ax: "Axes") -> "Axes":
    """A mass on a spring and a damper, forced, before a wall at a distance from its rest."""
    from matplotlib.patches import Circle, Rectangle

    ax.add_patch(Rectangle((-0.4, -0.1), 0.4, 3.4, fc=STEEL, ec="0.3", lw=0.7))
    ax.add_patch(Rectangle((7.6, -0.1), 0.4, 3.4, fc=STEEL, ec="0.3", lw=0.7))
    ax.plot([7.6, 7.6], [-0.1, 3.3], color=GREEN, lw=2.7, solid_capstyle="butt")
    ax.plot([-0.4, 8.0], [-0.1, -0.1], color="0.3", lw=0.7)
    ax.add_patch(Rectangle((3.6, 0.12), 1.7, 2.5, fc=RED, ec="0.2", lw=0.7))
    coils = [(0.7 + 0.28 * k, 2.0 + 0.28 * (-1) ** k) for k in range(8)]
    ax.plot(*zip((0, 2), (0.5, 2), *coils, (3, 2), (3.6, 2), strict=True), color="0.2", lw=0.8)
    ax.plot([0, 1.9], [0.75, 0.75], color="0.2", lw=0.8)
    ax.plot([2.5, 1.5, 1.5, 2.5], [1.05, 1.05, 0.45, 0.45], color="0.2", lw=0.8)
    ax.plot([1.9, 1.9], [0.52, 0.98], color="0.2", lw=1.8)
    ax.plot([1.9, 3.6], [0.75, 0.75], color="0.2", lw=0.8)
    for wheel in (3.95, 4.95):
        ax.add_patch(Circle((wheel, 0.02), 0.11, fc="white", ec="0.2", lw=0.7))
    arrows = ((5.3, 7.5, 0.9, "<|-|>"), (3.8, 5.1, 3.1, "<|-|>"), (4.45, 5.6, -0.6, "-|>"))
    for left, right, y, style in arrows:
        look = {"arrowstyle": style, "color": "0.2", "lw": 1.0, "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", (right, y), (left, y), arrowprops=look)
    for x, y, text in (
        (1.7, 2.6, "$1$"),
        (1.9, 1.35, r"$2\zeta$"),
        (4.45, 1.4, "$1$"),
        (6.4, 1.25, "wall"),
        (4.45, 3.5, r"$A\,\cos\,wt$"),
        (5.9, -0.6, "$x$"),
        (7.25, 2.9, "$B$"),
    ):
        colour = {"$B$": GREEN}.get(text, "white" if (x, y) == (4.45, 1.4) else "black")
        ax.text(x, y, text, ha="center", va="center", color=colour)
    ax.set(xlim=(-0.6, 8.2), ylim=(-1.0, 3.9), aspect="equal")
    ax.set_axis_off()
    return ax
