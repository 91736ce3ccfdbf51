"""The bouncing ball drawn."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GREEN, RED, STEEL = "#009E73", "#D55E00", "0.82"  #: the table in the colour of its impacts in other figures


def sketch(ax: "Axes") -> "Axes":
    """A ball above a table that is shaken upwards and downwards, with the gap x between them and gravity."""
    from matplotlib.patches import Circle, Rectangle

    ax.add_patch(Rectangle((0, 0), 6.0, 0.45, fc=STEEL, ec="0.3", lw=0.7))
    ax.plot([0, 6.0], [0.45, 0.45], color=GREEN, lw=2.7, solid_capstyle="butt")
    ax.plot([-0.6, 6.9], [-1.0, -1.0], color="0.4", lw=0.6, ls=(0, (5, 3)))
    ax.add_patch(Circle((3.0, 3.2), 0.55, fc=RED, ec="0.2", lw=0.7))
    arrows = ((3.0, 0.5, 2.62, "<|-|>"), (6.5, -0.55, 0.85, "<|-|>"), (0.6, 3.6, 2.4, "-|>"))
    for x, low, high, style in arrows:
        look = {"arrowstyle": style, "color": "0.2", "lw": 1.0, "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", (x, high), (x, low), arrowprops=look)
    for x, y, text in ((3.2, 1.5, "$x$"), (0.8, 3.0, "$g$"), (6.85, 0.15, r"$A\,\sin\,\omega t$"), (0.2, 0.95, "$B$")):
        ax.text(x, y, text, va="center", color=GREEN if text == "$B$" else "black")
    ax.set(xlim=(-0.7, 9.4), ylim=(-1.2, 4.0), aspect="equal")
    ax.set_axis_off()
    return ax
