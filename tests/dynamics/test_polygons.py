"""Inverses of maps given by formulas, and manifolds of affine pieces as polygons: Lozi's map by closed forms."""

import numpy as np
import pytest
from messages import message
from nsmaps_border_collision import Lozi
from nsmaps_square_root import SquareRootPlane

import nsmaps
from nsmaps import PiecewiseMap
from nsmaps.errors import SystemDefinitionError


class Torn(PiecewiseMap):
    """Lozi's map, to the right of x = 0 a little higher: it jumps there."""

    a: float = 1.7
    b: float = 0.5
    up: float = 0.05
    coordinates = ("x", "y")

    def pieces(self, x):
        return {
            "L": (x.x < 0, {"x": 1 + self.a * x.x + x.y, "y": self.b * x.x}),
            "R": (True, {"x": 1 - self.a * x.x + x.y, "y": self.b * x.x + self.up}),
        }


class Parabola(PiecewiseMap):
    """Henon's map; `told` gives its preimages, one of two where b is divided by."""

    a: float = 1.4
    b: float = 0.3
    told: bool = False
    coordinates = ("x", "y")

    def pieces(self, x):
        return {"P": (True, {"x": 1 - self.a * x.x**2 + x.y, "y": self.b * x.x})}

    def preimages(self, x):
        return {"P": {"x": x.y / self.b, "y": x.x - 1 + self.a * (x.y / self.b) ** 2}} if self.told else None


class Cubed(PiecewiseMap):
    """A piece with three preimages."""

    coordinates = ("x", "y")

    def pieces(self, x):
        return {"C": (True, {"x": x.x**3 - x.x, "y": x.y})}


@pytest.mark.parametrize(
    "return_map",
    [Lozi(), Parabola(), Parabola(told=True),
     SquareRootPlane(alpha=0.65, gamma=0.05, tau2=0.25, rho=0.1)],
    ids=lambda return_map: type(return_map).__name__,
)  # fmt: skip
def test_an_inverse_leads_back(return_map):
    states = np.random.default_rng(0).uniform(-1, 1, (500, 2))
    images = return_map.first_return(states, derivative=True)
    back = return_map.inverse().first_return(images.image, derivative=True)
    assert np.abs(back.image - states).max() < 1e-13
    assert back.words.tolist() == images.words.tolist()
    assert np.abs(back.derivative @ images.derivative - np.eye(2)).max() < 1e-11


def test_an_inverse_that_is_not_one_function_is_refused():
    with pytest.raises(SystemDefinitionError, match=message("exact.several-inverses", letter="C", cls="Cubed")):
        Cubed().inverse()

    class Wrong(Lozi):
        def preimages(self, x):
            return {"L": {"x": x.y}}

    with pytest.raises(SystemDefinitionError, match=message("exact.preimages", cls="Wrong", letters="L, R", names="x, y")):
        Wrong().inverse()


def test_inverses_of_maps_of_the_circle_are_to_be_given():
    class Turned(nsmaps.PiecewiseMap):
        coordinates = (nsmaps.Angle("phi"),)

        def pieces(self, x):
            return {"S": (True, {"phi": x.phi + 1})}

    with pytest.raises(SystemDefinitionError, match=message("exact.angles-in-inverse", cls="Turned")):
        Turned().inverse()


def test_the_manifolds_of_lozi_are_polygons():
    """The unstable one of R has the corner (Z, 0) and its images; its inverse leads back to R, the map along the other."""
    return_map = Lozi(a=1.7, b=0.5)
    saddle = nsmaps.periodic_orbit(return_map, [0.45, 0.22])
    unstable, stable = (nsmaps.manifold(return_map, saddle, which, length=25) for which in ("unstable", "stable"))
    corner = np.array(
        [(2 + return_map.a + np.sqrt(return_map.a**2 + 4 * return_map.b)) / (2 * (1 + return_map.a - return_map.b)), 0.0]
    )
    path = nsmaps.orbit(return_map, corner, 4).states
    for state in path:
        assert np.abs(unstable.states - state).max(axis=1).min() < 1e-14
    assert (unstable.gap, unstable.ended, len(unstable.lines)) == (np.inf, ("length 25", "length 25"), 2)
    assert max(unstable.error, stable.error) < 1e-14
    assert len(unstable.states) < 40
    for manifold, towards in ((unstable, return_map.inverse()), (stable, return_map)):
        sides = [manifold.states[manifold.side == k] for k in (0, 1)]
        middles = np.concatenate([(side[1:] + side[:-1]) / 2 for side in sides])
        ends = nsmaps.orbit(towards, middles, 12).final
        assert np.abs(ends - saddle.states[0]).max() < (0.05 if manifold is unstable else 1e-3)
        off = nsmaps.orbit(towards, middles + 1e-3, 12).final
        assert np.abs(off - saddle.states[0]).max() > 0.1
    curve = nsmaps.manifold(_Hidden(return_map), saddle, "unstable", length=5, gap=0.01)
    for state in curve.states[::20]:
        assert distance(unstable.lines, state) < 1e-9


class _Hidden(nsmaps.exact.ReturnMap):
    """A map of which no formulas are known."""

    def __init__(self, return_map):
        self.map, self.coordinates = return_map, return_map.coordinates

    def first_return(self, states, derivative=False):
        return self.map.first_return(states, derivative)


def distance(lines, state):
    """From a polygon to a state."""
    starts, steps = (np.concatenate([each(line) for line in lines]) for each in (lambda x: x[:-1], lambda x: np.diff(x, axis=0)))
    share = np.clip(((state - starts) * steps).sum(axis=1) / (steps**2).sum(axis=1), 0, 1)
    return np.linalg.norm(starts + share[:, None] * steps - state, axis=1).min()


def test_a_polygon_is_torn_where_the_map_jumps():
    return_map = Torn()
    saddle = nsmaps.periodic_orbit(return_map, [0.45, 0.22])
    assert saddle.words == ("R",)
    found = nsmaps.manifold(return_map, saddle, "unstable", length=20)
    assert len(found.lines) > 4
    middles = np.concatenate([(line[1:] + line[:-1]) / 2 for line in found.lines])
    back = nsmaps.orbit(return_map.inverse(), middles, 12).final
    assert np.abs(back - saddle.states[0]).max() < 0.05
