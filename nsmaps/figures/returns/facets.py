"""Many small triangles, painted at once: surfaces over a plane with smooth shades, and areas in a plane."""

from typing import Any, cast

import numpy as np
from matplotlib.artist import allow_rasterization
from matplotlib.axes import Axes
from matplotlib.collections import TriMesh
from matplotlib.colors import to_rgb
from matplotlib.transforms import IdentityTransform
from matplotlib.tri import Triangulation
from mpl_toolkits.mplot3d import Axes3D, proj3d
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.sparse import csr_array

from nsmaps.arrays import Floats, Ints

_LIGHT = np.array([-0.40, -0.50, 0.77])  #: where the light comes from
_SMOOTH = 4  #: rounds in which the direction of a surface is averaged with that next to it, so that walls have no streaks


class Facets(Poly3DCollection):  # type: ignore[misc]
    """Triangles (T, 3) between points (P, 3) with colours (P, 3), as pixels in every format.

    What stands over a farther place in the plane is painted first. As no two surfaces stand over one place, this is right
    for steep walls too, which are higher than they are wide.
    """

    def __init__(self, ax: Axes3D, points: Floats, triangles: Ints, colours: Floats) -> None:
        super().__init__([], rasterized=True)
        self.points, self.triangles, self.colours = points, triangles, np.column_stack([colours, np.ones(len(colours))])
        ax.add_collection(self, autolim=False)

    def do_3d_projection(self) -> float:
        """How near the nearest point is, by which axes order what they draw."""
        return float(self._projected(self.points)[2].min())

    @allow_rasterization  # type: ignore[untyped-decorator]
    def draw(self, renderer: Any) -> None:
        """Paint the triangles, if they are visible."""
        if not self.get_visible():
            return
        x, y, _ = self._projected(self.points)
        depth = self._projected(self.points * [1, 1, 0])[2]
        corners = self.triangles[np.argsort(-np.add.reduce(depth[self.triangles.T]))]
        gc = renderer.new_gc()
        self._set_gc_clip(gc)
        page = self.axes.transData.transform(np.column_stack([x, y]))
        renderer.draw_gouraud_triangles(gc, page[corners], self.colours[corners], IdentityTransform())
        gc.restore()

    def _projected(self, points: Floats) -> Floats:
        """Where points (P, 3) are on the axes, and how far from the eye, shape (3, P)."""
        return np.asarray(proj3d.proj_transform(*points.T, self.axes.get_proj()))


def flat(ax: Axes, points: Floats, triangles: Ints, colour: tuple[float, float, float]) -> None:
    """Triangles (T, 3) between points (P, 2) of a plane in one colour, as pixels in every format; limits stay as they are."""
    if not len(triangles):
        return
    area = TriMesh(Triangulation(points[:, 0], points[:, 1], triangles), rasterized=True, zorder=0)
    area.set_facecolor(cast(Any, np.tile(colour, (len(points), 1))))  # a list would be looked through
    area.set_in_layout(False)  # its box would be found from a path a triangle
    ax.add_collection(area, autolim=False)


def shaded(points: Floats, triangles: Ints, colour: str | tuple[float, float, float]) -> Floats:
    """A colour for each point (P, 3) of a surface, lighter where it faces the light, shape (P, 3)."""
    size = np.ptp(points, axis=0)
    a, b, c = np.moveaxis((points / np.where(size > 0, size, 1))[triangles], 1, 0)
    faces = np.cross(b - a, c - a)
    ends = np.arange(0, triangles.size + 1, 3)
    to_corners = csr_array((np.ones(triangles.size), triangles.ravel(), ends), (len(triangles), len(points)))
    normal = to_corners.T @ faces
    for _ in range(_SMOOTH):
        normal = to_corners.T @ (to_corners @ normal)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    light = np.abs(normal @ _LIGHT)[:, None] / np.where(length > 0, length, 1)
    base = np.array(to_rgb(colour))
    return np.clip(base * (0.45 + 0.55 * light) + 0.38 * light**2 * (1 - base), 0, 1)
