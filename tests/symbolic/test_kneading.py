"""Topological entropies by kneading series, against closed forms, and cycles by words, which are counted."""

import math

import pytest
from messages import message

from nsmaps import Angle, PiecewiseMap
from nsmaps.dynamics.search import periodic_orbits_by_word
from nsmaps.errors import NsmapsError
from nsmaps.symbolic.kneading import topological_entropy


class Slopes(PiecewiseMap):
    """Of slopes s, -s and s, odd: an interval is mapped onto all three laps for s = 3."""

    s: float
    coordinates = ("x",)

    def pieces(self, x):
        return {
            "L": (x.x < -1, {"x": self.s * (x.x + 2)}),
            "M": (x.x < 1, {"x": -self.s * x.x}),
            "R": (True, {"x": self.s * (x.x - 2)}),
        }


class Tent(PiecewiseMap):
    """Of slopes a and b."""

    a: float
    b: float
    coordinates = ("x",)

    def pieces(self, x):
        return {"L": (x.x <= 0, {"x": self.a * x.x + 1}), "R": (True, {"x": self.b * x.x + 1})}


class Flat(PiecewiseMap):
    """The tent of slope two on [0, 1], no higher than `top`."""

    top: float
    coordinates = ("x",)

    def pieces(self, x):
        return {
            "L": (2 * x.x < self.top, {"x": 2 * x.x}),
            "F": (2 * (1 - x.x) > self.top, {"x": self.top}),
            "R": (True, {"x": 2 * (1 - x.x)}),
        }


class Switched(PiecewiseMap):
    """Of a current-mode converter: x - 1 from 1 on, a (1 - x) below."""

    a: float
    coordinates = ("x",)

    def pieces(self, x):
        return {"N": (x.x >= 1, {"x": x.x - 1}), "S": (True, {"x": self.a * (1 - x.x)})}


class Turned(PiecewiseMap):
    b: float = 0.5
    coordinates = (Angle("phi"),)

    def pieces(self, x):
        return {"S": (True, {"phi": 2 * x.phi + self.b})}


class Bent(PiecewiseMap):
    b: float = 0.0
    coordinates = ("x",)

    def pieces(self, x):
        return {"S": ((x.x > -1) & (x.x < 1), {"x": 1 - x.x**2}), "C": (True, {"x": self.b * x.x})}


class Hole(PiecewiseMap):
    coordinates = ("x",)

    def pieces(self, x):
        return {"L": (x.x < -1, {"x": x.x + 2}), "R": (x.x > 1, {"x": x.x - 2})}


class Pair(PiecewiseMap):
    coordinates = ("x", "y")

    def pieces(self, x):
        return {"S": (True, {"x": x.y, "y": x.x})}


@pytest.mark.parametrize("slope", [1.1, 1.3, 2**0.5, 1.8, 2.0, 2.5])
def test_of_a_constant_slope_it_is_its_logarithm(slope):
    assert topological_entropy(Tent(a=slope, b=-slope)) == pytest.approx(math.log(min(slope, 2)), abs=1e-13)


@pytest.mark.parametrize("slope", [1.5, 2.0, 3.0, 4.0])
def test_with_three_laps(slope):
    """A double zero of the determinant, at slopes at which both halves are invariant, costs half of the digits."""
    assert topological_entropy(Slopes(s=slope)) == pytest.approx(math.log(min(slope, 3)), abs=1e-7)


@pytest.mark.parametrize(("a", "growth"), [(2, (1 + 5**0.5) / 2), (3, 1.839286755214161)])
def test_of_a_markov_partition_it_is_the_largest_root(a, growth):
    """Of t^2 = t + 1 and t^3 = t^2 + t + 1."""
    assert topological_entropy(Switched(a=a)) == pytest.approx(math.log(growth), abs=1e-14)


def test_without_chaos_it_is_zero():
    assert topological_entropy(Tent(a=0.5, b=-1.5)) == 0
    assert topological_entropy(Tent(a=0.5, b=0.3)) == 0
    assert topological_entropy(Tent(a=0, b=-2)) == 0


@pytest.mark.parametrize("top", [0.9, 0.95])
def test_a_plateau_on_a_tent_of_slope_two(top):
    """Its kneading sequence, of the image of the plateau, is that of the tent whose slope is the exponential of the entropy."""
    entropy = topological_entropy(Flat(top=top))
    slope = math.exp(entropy)
    one, other = top, slope / 2  # images of the tips, under the tent of slope two on [0, 1] and that of this slope
    for _ in range(12):
        assert (one < 0.5) == (other < 0.5)
        one, other = (2 * min(one, 1 - one), slope * min(other, 1 - other))
    assert slope < 2


def test_cycles_are_as_many_as_words():
    """All words of the full tent are those of a cycle: of the lengths 1 to 6 Moebius' formula counts 2, 1, 2, 3, 6, 9."""
    found = periodic_orbits_by_word(Tent(a=2, b=-2), 6)
    assert [sum(orbit.period == q for orbit in found) for q in range(1, 7)] == [2, 1, 2, 3, 6, 9]
    assert all(orbit.converged and orbit.exists for orbit in found)
    three = periodic_orbits_by_word(Slopes(s=4), 3)
    assert [sum(orbit.period == q for orbit in three) for q in range(1, 4)] == [3, 3, 8]
    assert all(orbit.multipliers[0].real == (-1) ** orbit.word.count("R") * 2**orbit.period for orbit in found)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: topological_entropy(Turned()), message("exact.linear-with-angle", map="Turned")),
        (lambda: topological_entropy(Pair()), message("symbolic.several-coordinates", map="Pair", number=2)),
        (lambda: topological_entropy(Bent()), message("exact.not-affine", what="an image", map="Bent", formula="1 - x**2")),
        (lambda: topological_entropy(Hole()), message("symbolic.hole-at-border", map="Hole")),
        (lambda: topological_entropy(Units()), message("symbolic.several-coordinates", number=3)),
        (
            lambda: periodic_orbits_by_word(Bent(), 2),
            message("exact.not-affine", what="an image", map="Bent", formula="1 - x**2"),
        ),
    ],
)
def test_what_is_refused(call, text):
    with pytest.raises(NsmapsError, match=text):
        call()


class Units(PiecewiseMap):
    """A skew tent map of [-1, 1] that drives coordinates of the sizes 1e-9 and 1e6."""

    coordinates = ("x", "y", "z")

    def pieces(self, x):
        left = {"x": (x.x + 1) / 0.3 - 1, "y": 0.4 * x.y + 1e-9 * x.x, "z": -0.25 * x.z + 1e6 * x.x + 1e14 * x.y}
        right = {"x": (1 - x.x) / 0.7 - 1, "y": 0.4 * x.y + 1e-9 * (1 - x.x), "z": -0.25 * x.z - 1e6}
        return {"L": (x.x < -0.4, left), "R": (True, right)}


def test_the_cycles_of_a_full_shift_are_found_in_any_units():
    """As many as there are primitive words: 2, 1, 2, 3 and 6 of the periods 1 to 5."""
    assert [len(orbit.word) for orbit in periodic_orbits_by_word(Units(), 5)] == [1] * 2 + [2] + [3] * 2 + [4] * 3 + [5] * 6
