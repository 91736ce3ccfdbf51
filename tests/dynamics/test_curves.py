"""Bifurcation curves in two parameters against closed forms, and points of codimension two where they are known."""

from dataclasses import dataclass

import mpmath as mp
import numpy as np
import pytest
from boxmaps import Henon, plain_returns
from messages import message

import nsmaps
from nsmaps.dynamics.continuation.events import BifurcationPoint
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap

WITHIN = {"a": (-1.5, 4), "b": (0.2, 0.5)}


def event_of(map_of, guess, value, bounds, kind, way, period=1):
    """The first event of a kind on the branch of an orbit."""
    orbit = nsmaps.periodic_orbit(map_of(value), guess, period)
    return nsmaps.continue_branch(map_of, "p", orbit, value, bounds, direction=way, step=0.05, until=(kind,)).of_kind(kind)[0]


HENON = {  #: of x' = 1 - a x^2 + y, y' = b x: the value of a over b, a start, and where a second condition holds, at b = -1
    "fold": (lambda b: -((1 - b) ** 2) / 4, 0.1, "down", ("1:1 resonance", -1.0)),
    "period doubling": (lambda b: 3 * (1 - b) ** 2 / 4, 0.1, "up", ("1:2 resonance", 3.0)),
}


@pytest.mark.parametrize("kind", HENON)
def test_the_henon_map(kind):
    form, a, way, (special, at) = HENON[kind]
    x = (-0.7 + np.sqrt(0.49 + 4 * a)) / (2 * a)
    event = event_of(lambda a: Henon(a, 0.3), [x, 0.3 * x], a, (-1.5, 4), kind, way)
    found = nsmaps.bifurcation_curve(Henon, event, {"a": (-1.5, 4), "b": (-1.3, 0.5)}, 0.3, step=0.1)
    a, b = found.parameters.T
    assert np.abs(a - form(b)).max() < 1e-12
    assert (b[0], b[-1]) == pytest.approx((-1.3, 0.5), abs=1e-14)
    assert (np.diff(b) > 0).all()
    assert found.ended == ("the range of the second parameter ends at -1.3", "the range of the second parameter ends at 0.5")
    assert np.abs(found.multipliers.prod(axis=1) + b).max() < 1e-12
    critical = 1 if kind == "fold" else -1
    away = np.abs(b + 1) > 0.05  # where both are critical, each is known to the root of rounding
    assert np.abs(found.multipliers - critical).min(axis=1)[away].max() < 1e-9
    (point,) = found.special
    assert found.everywhere == ()
    assert point.kind == special
    assert point.parameters == pytest.approx((at, -1.0), abs=1e-10)
    assert np.abs(np.subtract(point.parameters, (at, -1.0))).max() <= 10 * max(point.precision)


def test_the_second_doubling_of_the_henon_map():
    """Of the cycle of two: a = (1 - b)^2 + (1 + b)^2/4."""
    orbit = nsmaps.periodic_orbit(Henon(0.5, 0.3), [0.9, -0.1], 2)
    assert len(np.unique(orbit.states[:, 0].round(6))) == 2
    branch = nsmaps.continue_branch(lambda a: Henon(a, 0.3), "a", orbit, 0.5, (0.4, 2), step=0.05, until=("period doubling",))
    found = nsmaps.bifurcation_curve(Henon, branch.of_kind("period doubling")[0], {"a": (0, 4), "b": (0.2, 0.5)}, 0.3, step=0.1)
    a, b = found.parameters.T
    assert found.points.shape[1:] == (2, 2)
    assert np.abs(a - (1 - b) ** 2 - (1 + b) ** 2 / 4).max() < 1e-12


@dataclass
class Cubic(ReturnMap):
    """x' = p + q x - x^3: folds at p = 2 ((q - 1)/3)^(3/2) and minus that, which meet in a cusp at (0, 1)."""

    p: float
    q: float
    coordinates: tuple[str, ...] = ("x",)

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        slopes = (self.q - 3 * x**2)[:, :, None]
        return plain_returns(self.coordinates, x, self.p + self.q * x - x**3, slopes if derivative else None)


def test_two_folds_meet_in_a_cusp():
    event = event_of(lambda p: Cubic(p, 1.6), [0.8], 0.1, (-1, 1), "fold", "down")
    found = nsmaps.bifurcation_curve(Cubic, event, {"a": (-1, 1), "b": (0.5, 2.0)}, 1.6, step=0.05)
    p, q = found.parameters.T
    assert np.abs(p**2 - 4 * ((q - 1) / 3) ** 3).max() < 1e-12
    assert p.min() < -0.1
    assert p.max() > 0.1
    (cusp,) = found.special
    assert cusp.kind == "cusp"
    assert cusp.parameters == pytest.approx((0, 1), abs=1e-7)  # beside which p is of third order in the arclength


@pytest.mark.parametrize(("kind", "way"), [("fold", "down"), ("period doubling", "up")])
def test_the_bouncing_ball(kind, way):
    """The closed forms that its class states."""
    system = nsmaps.load_system("bouncing_ball", Gamma=1.3, r=0.5)
    event = event_of(nsmaps.exact.Along(system, "Gamma"), [4.18879, 0.634], 1.3, (0.2, 3), kind, way)
    found = nsmaps.bifurcation_curve(system, event, {"Gamma": (0.2, 3), "r": (0.45, 0.55)}, step=0.5)
    gamma, r = found.parameters.T
    least = np.pi * (1 - r) / (1 + r)
    exact = least if kind == "fold" else np.hypot(least, 2 * (1 + r**2) / (1 + r) ** 2)
    assert np.abs(gamma - exact).max() < 1e-12
    assert found.words == ("BB",)


def graze_of(r, g):
    """The length d at which the motion BB, once a period, touches T: v = 2 g/(1 + r), sin phi = pi g (1 - r)/(1 + r)."""
    r, g = mp.mpf(r), mp.mpf(g)
    v, phi = 2 * g / (1 + r), mp.pi - mp.asin(mp.pi * g * (1 - r) / (1 + r))
    turn = mp.findroot(lambda s: -r * v + g * s + (mp.sin(mp.pi * s + phi) - mp.sin(phi)) / mp.pi, 0.7)
    drift = -r * v - mp.sin(phi) / mp.pi
    return v, phi, -(drift * turn + g * turn**2 / 2 - (mp.cos(mp.pi * turn + phi) - mp.cos(phi)) / mp.pi**2)


@pytest.mark.parametrize(("beside", "word"), [(1e-6, "BB"), (3e-4, "BTB")])
def test_a_graze_of_the_pair_from_either_orbit(beside, word, pair):
    """Both that begins to touch T and that whose impact on T fades lead to the curve of the first."""
    system = pair(0.35)
    v, phi, d = map(float, graze_of(0.5, system.g_bar))
    guess = [v, phi] if word == "BB" else [0.28218104, 2.9181708]
    orbit = nsmaps.periodic_orbit(system.at(d=d + beside), guess)
    assert orbit.words == (word,)
    event = BifurcationPoint("grazing", d, 1e-9, orbit)
    found = nsmaps.bifurcation_curve(system, event, {"d": (0.2, 0.9), "r": (0.49, 0.52)}, 0.5, step=0.5)
    assert found.words == ("BB",)
    for length, r in found.parameters:
        assert length == pytest.approx(float(graze_of(r, system.g_bar)[2]), abs=1e-11)


@dataclass
class Areas(ReturnMap):
    """x' = a - c x^2 - y, y' = x: it preserves area, so that both multipliers are -1 at a = 3/c, and 1 at a = -1/c."""

    a: float
    c: float
    coordinates: tuple[str, ...] = ("x", "y")

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        (x, y), one = start.T, np.ones(len(start))
        slopes = np.array([[-2 * self.c * x, -one], [one, 0 * one]]).transpose(2, 0, 1)
        image = np.column_stack([self.a - self.c * x**2 - y, x])
        return plain_returns(self.coordinates, start, image, slopes if derivative else None)


@pytest.mark.parametrize(("kind", "way", "form", "both"), [("period doubling", "up", 3, "1:2"), ("fold", "down", -1, "1:1")])
def test_a_condition_that_always_holds_makes_no_points(kind, way, form, both):
    event = event_of(lambda a: Areas(a, 0.8), [0.15, 0.15], 0.3, (-3, 6), kind, way)
    found = nsmaps.bifurcation_curve(Areas, event, {"a": (-8, 20), "b": (0.3, 1.5)}, 0.8, step=0.1)
    a, c = found.parameters.T
    assert np.abs(a * c - form).max() < 1e-11
    assert (found.special, found.everywhere) == ((), (f"{both} resonance",))


def test_what_has_no_curve_is_refused(pair):
    event = event_of(lambda a: Henon(a, 0.3), [0.9, 0.27], 0.1, (-1.5, 4), "fold", "down")
    with pytest.raises(NsmapsError, match=message("dynamics.value-outside", value=0.7, low=0.2, high=0.5)):
        nsmaps.bifurcation_curve(Henon, event, WITHIN, 0.7)
    with pytest.raises(NsmapsError, match=message("dynamics.orbits", number=0, step=0.02)):
        nsmaps.bifurcation_curve(Henon, event, WITHIN, 0.3, max_points=0)
    with pytest.raises(NsmapsError, match=message("dynamics.no-event-near", event="fold", place="-0.1225, 0.45")):
        nsmaps.bifurcation_curve(lambda a, b: Henon(a + 10, b), event, WITHIN, 0.45)
    with pytest.raises(NsmapsError, match=message("errors.curve-from-no-event", given="str")):
        nsmaps.bifurcation_curve(Henon, "fold", WITHIN, 0.3)
