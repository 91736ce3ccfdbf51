"""The vibro-impact pair drawn: fig. model:abc, panel (a)."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TILT = 30.0  #: degrees; flatter than the paper's 60, so that the picture is wide
BLUE, GREEN, RED, STEEL = "#0072B2", "#009E73", "#D55E00", "0.82"  #: B and T in the colours of their impacts in other figures


def sketch(ax: "Axes") -> "Axes":
    """A ball in a shaken capsule between two membranes, tilted by beta, with masses, length, places and forcing."""
    from matplotlib.patches import Arc, Circle, Rectangle
    from matplotlib.transforms import Affine2D

    turned = Affine2D().rotate_deg(TILT)
    look: dict[str, Any] = {"transform": turned + ax.transData}
    ax.plot([-0.3, 9.3], [0, 0], color="0.4", lw=0.6, ls=(0, (5, 3)))
    ax.plot([0, 9.6], [0, 0], color="0.35", lw=1, **look)
    ax.add_patch(Arc((0, 0), 4.4, 4.4, theta2=TILT, color="0.25", lw=0.8))
    ax.text(2.55, 0.66, r"$\beta$", ha="center", va="center")
    frame = ((1.32, 4.2, 7.76, 0.28), (1.32, 0.92, 7.76, 0.28), (1.32, 0.92, 0.28, 3.56), (8.8, 0.92, 0.28, 3.56))
    for edge, grow in (("0.3", 0.02), (STEEL, 0.0)):  # the outline of the whole first, so that no seam shows
        for x, y, wide, high in frame:
            ax.add_patch(
                Rectangle((x - grow, y - grow), wide + 2 * grow, high + 2 * grow, color=edge, lw=0.7 * (grow > 0), **look)
            )
    for place, colour in ((2.0, GREEN), (8.4, BLUE)):
        ax.plot([place] * 2, [1.2, 4.2], color=colour, lw=2.7, solid_capstyle="butt", **look)
    ax.add_patch(Circle((4.6, 2.7), 0.62, fc=RED, ec="0.2", lw=0.7, **look))
    _letters(ax, look["transform"])
    _arrows(ax, turned)
    ax.set(xlim=(-1.5, 10.8), ylim=(-0.4, 8.7), aspect="equal")
    ax.set_axis_off()
    return ax


def _letters(ax: "Axes", turned: Any) -> None:
    """The names of the parts, where they are along the capsule, and of gravity."""
    for x, y, text, colour in (
        (4.6, 2.7, "$m$", "white"),
        (6.6, 1.65, "$M$", "black"),
        (2.5, 3.75, r"$\partial B$", GREEN),
        (7.9, 3.75, r"$\partial T$", BLUE),
        (5.2, 5.4, "$s$", "black"),
        (6.0, 3.2, "$x$", RED),
        (10.9, 1.45, r"$\hat{F}(\omega\tau + \psi)$", "black"),
        (5.6, 0.45, "$X$", "black"),
    ):
        ax.text(x, y, text, color=colour, transform=turned, ha="center", va="center")
    ax.text(9.15, 1.9, "$g$", ha="left", va="center")


def _arrows(ax: "Axes", turned: Any) -> None:
    """Length, places and forcing along the capsule, and gravity."""
    along = turned.transform
    for tail, tip, style, colour in (
        (*along([(2.0, 5.0), (8.4, 5.0)]), "<|-|>", "0.2"),
        (*along([(5.22, 2.7), (6.4, 2.7)]), "-|>", RED),
        (*along([(9.2, 2.7), (10.5, 2.7)]), "<|-|>", "black"),
        (*along([(3.7, 0.45), (5.2, 0.45)]), "-|>", "0.2"),
        ((8.9, 2.5), (8.9, 1.3), "-|>", "0.2"),
    ):
        look = {"arrowstyle": style, "color": colour, "lw": 1.0, "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", tip, tail, arrowprops=look)
    for end in (2.0, 8.4):
        ax.plot(*along([(end, 4.58), (end, 5.2)]).T, color="0.4", lw=0.5)
