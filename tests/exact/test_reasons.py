"""Why returns and arrivals of systems with modes ended: sentences that name what is true of each state."""

import math
import re

import pytest
import sympy as sp

from nsmaps import Guard, HybridSystem, ImpactSystem, Outcome, PoincareSection, Wall


class Shaft(HybridSystem):
    """A ball under gravity between a floor, where it may rest, and a lid at 5; at 7 to the side it leaves."""

    states = ("x", "v", "z")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"fly": {"x": y.v, "v": -1, "z": 1}}

    def guards(self, t, y):
        return {
            "F": Guard("fly", y.x, reset={"v": -y.v / 2}, rests="floor"),
            "lid": Guard("fly", 5 - y.x, reset={"v": -y.v}, where=[3 - y.z]),
            "through": Guard("fly", 5 - y.x),
            "out": Guard("fly", 20 - y.z, ends=True),
        }

    def section(self, t, y):
        return PoincareSection("lid", ("v", "z", "phi"))


class Closed(Shaft):
    """Without a way out."""

    def guards(self, t, y):
        return {name: guard for name, guard in super().guards(t, y).items() if name != "out"}


@pytest.mark.parametrize(
    ("row", "why"),
    [
        ((1.0, 0.0, math.inf), r"^phi is inf; expected: a finite number\.$"),
        ((math.nan, 0.0, 0.0), r"^v is nan; expected"),
        ((1.0, 0.0, 1e11), r"^The phase is 1e\+11; expected: at most 1e\+10"),
        ((-2.0, 1.0, 0.0), r"'lid' has a function that rises, at the rate 2 in the mode 'fly', at x = 5, v = -2, z = 1\.$"),
        ((2.0, 4.5, 0.0), r"'lid' has a condition that is -1\.5, and expected not to be negative, at x = 5, v = 2, z = 4\.5\.$"),
        ((1.0, 0.0, 0.0), r"after the event 'F', the motion stays in contact, in the mode 'floor'"),
    ],
)
def test_of_first_returns(row, why):
    (reason,) = Closed().reasons([row])
    assert re.search(why, reason), reason


@pytest.mark.parametrize(
    ("state", "mode", "why"),
    [
        ((1.0, 0.0, 0.0, math.nan), None, r"^phase is nan"),
        ((-0.5, 0.0, 0.0, 0.0), None, r"does not belong to any mode: in the mode 'fly' the guard 'F' is -0\.5"),
        ((1.0, 0.0, 21.0, 0.0), "fly", r"does not belong to the mode 'fly': in the mode 'fly' the guard 'out' is -1"),
        ((4.0, 0.0, 19.0, 0.0), None, r"^The guard 'out' ends the motion, 1 after the start\.$"),
        ((4.0, 3.0, 0.0, 0.0), None, r"^The motion returned"),
    ],
)
def test_of_arrivals(state, mode, why):
    (reason,) = Shaft().arrival_reasons([state], mode)
    assert re.search(why, reason), reason


def test_of_motions_without_an_end():
    class Free(Shaft):
        """Without gravity."""

        def modes(self, t, y):
            return {"fly": {"x": y.v, "v": 0, "z": 0}}

    (reason,) = Free().arrival_reasons([[1.0, 0.0, 0.0, 0.0]])
    assert reason.startswith("From the start on, no guard of the mode 'fly' is met: within the horizon of 6283.19")


class Soft(ImpactSystem):
    """x'' = 4 (1 - x) over a wall at zero, left with half of the square of the speed, which lasts until the next impact."""

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi

    def rebound(self, speed, wall):
        return speed**2 / 2

    def displacement(self, t, hit):
        s = 2 * (t - hit.t)
        return 1 + (hit.z - 1) * sp.cos(s) + hit.w / 2 * sp.sin(s)


def test_what_is_undecided_may_have_bounds():
    system, v = Soft(), 8e-6
    (reason,) = system.reasons([[v, 1.0]])
    assert system.first_return([[v, 1.0]]).outcome.tolist() == [Outcome.undecided]
    assert "`image_boxes` of the state, as a box without width" in reason
    found = system.image_boxes([[[v, v], [1.0, 1.0]]])
    assert found.bounded.all()
    assert found.images[0, 0, 0] < v**2 / 2 < found.images[0, 0, 1] < 1.1 * v**2 / 2
