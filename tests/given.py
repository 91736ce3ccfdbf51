"""Maps given by formulas, for the tests of what encloses and exports them."""

import sympy as sp
from systems import Logistic, Lozi

from nsmaps import PiecewiseMap
from nsmaps.coordinates import Angle


class Root(PiecewiseMap):
    """Nordmark's map in one coordinate: x' = a x + mu, and with a root on the other side of the border."""

    a: float = 0.3
    mu: float = 0.01
    coordinates = ("x",)

    def pieces(self, x):
        return {
            "L": (x.x <= 0, {"x": self.a * x.x + self.mu}),
            "R": (True, {"x": self.mu - sp.sqrt(x.x)}),
        }


class Circle(PiecewiseMap):
    """A circle map with a plateau."""

    omega: float = 0.7
    k: float = 1.6
    coordinates = (Angle("phi"),)

    def pieces(self, x):
        return {
            "P": ((x.phi > 2.5) & (x.phi < 2.5 + self.omega), {"phi": 4 + self.k * sp.sin(2.5)}),
            "S": (True, {"phi": x.phi + self.omega + self.k * sp.sin(x.phi) ** 3}),
        }


class Kinked(PiecewiseMap):
    """Kinks within a piece, and a step."""

    s: float = 0.4
    coordinates = ("x", "y")

    def pieces(self, x):
        return {
            "A": (x.x + self.s * x.y**2 <= 0.3, {"x": sp.Max(x.x, self.s * x.y) - sp.Abs(x.y), "y": sp.Min(x.x / 2, 0.1)}),
            "B": (x.y > sp.exp(-x.x), {"x": x.x / 3 - sp.floor(2 * x.y) / 5, "y": sp.tanh(x.x * x.y)}),
            "C": (x.x < 2, {"x": sp.sign(x.y) * x.x / 2, "y": x.y / (1 + x.x**2)}),
        }


class Space(PiecewiseMap):
    """Three coordinates, one of them an angle, in more than twenty pieces with borders that depend on a parameter."""

    d: float = 0.1
    coordinates = ("x", Angle("phi"), "y")

    def pieces(self, x):
        letters = "ABCDEFGHIJKLMNOPQRSTUVW"
        image = {"y": x.x / 2, "phi": x.phi + x.y + self.d}
        inner = {letter: (x.x < k * self.d - 1, image | {"x": x.x * k / 30 + self.d}) for k, letter in enumerate(letters)}
        return inner | {"Z": ((x.x < 3) & (x.phi < 6), image | {"x": sp.cos(x.phi) * x.y})}


MAPS = {  # the box of the states that are tried, by map
    Lozi(): [[-2, 2], [-1, 1]],
    Logistic(): [[-0.2, 1.2]],
    Root(): [[-0.5, 0.5]],
    Circle(): [[-4.0, 9.0]],
    Kinked(): [[-1.5, 2.5], [-1, 2]],
    Space(): [[-2, 3.5], [-3, 9], [-1, 1]],
}
