"""Sections at a guard with kinks, whose states follow from the coordinates in each part."""

import numpy as np
import pytest
import sympy as sp

from nsmaps import Guard, HybridSystem, PoincareSection


class Roof(HybridSystem):
    """A ball under gravity above a roof, which rises to c = 1 and then falls; the clock c ends at 2, and the roof with it."""

    states = ("y", "v", "c")

    def modes(self, t, y):
        return {"air": {"y": y.v, "v": -1, "c": 1}}

    def guards(self, t, y):
        roof = sp.Piecewise((y.c / 4, y.c < 1), ((2 - y.c) / 4, True))
        return {
            "B": Guard("air", y.y - roof, reset={"v": -y.v / 2}),
            "turn": Guard("air", 2 - y.c, reset={"c": 0}, letter=""),
        }

    def section(self, t, y):
        return PoincareSection("B", ("v", "c"))


def flight(v: float, c: float) -> tuple[float, float]:
    """The next impact, by the roots of a parabola over each edge of the roof, of flights that stay within one turn."""
    found = []
    for slope, low, high in ((0.25, 0, 1), (-0.25, 1, 2)):
        above = min(c, 2 - c) / 4 - (slope * c if low == 0 else 0.5 + slope * c)  # of the start over the line of this edge
        times = np.roots([-0.5, -v / 2 - slope, above])
        found += [s.real for s in times if s.real > 1e-9 and low <= c + s.real <= high]
    return v / -2 - min(found), c + min(found)


@pytest.mark.thorough
def test_a_guard_with_kinks_is_a_section_in_each_part():
    starts = np.array([[-0.8, 0.1], [-1.1, 0.6], [-0.3, 1.1], [-0.26, 1.2]])
    returns = Roof().first_return(starts)
    assert np.abs(returns.image - [flight(*start) for start in starts]).max() < 1e-13
    assert (starts[:, 1] < 1).tolist() == [True, True, False, False]
    assert (returns.image[:, 1] < 1).tolist() == [True, False, False, False]
