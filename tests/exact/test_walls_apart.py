"""Walls that move apart from each other, a shaken floor under a ceiling that stands still, against returns of 40 digits."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from proved import first

from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.coordinates import TWO_PI
from nsmaps.testing import check_system

VALUES = {"a": 0.3, "w": 2.5, "h": 1.1, "r": 0.8}
ROUNDING = 4e-15


class Shaft(HybridSystem):
    """Ball with x'' = -1 between a floor at a (sin w t + sin(2 w t)/4) and a ceiling at h."""

    a: float
    w: float
    h: float
    r: float

    contact: bool = False

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi / self.w

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1}}

    def guards(self, t, y):
        floor = self.a * (sp.sin(self.w * t) + sp.sin(2 * self.w * t) / 4)
        speed = y.v - self.a * self.w * (sp.cos(self.w * t) + sp.cos(2 * self.w * t) / 2)
        return {
            "F": Guard("flight", y.x - floor, reset={"v": y.v - (1 + self.r) * speed}, rests="floor" * self.contact),
            "C": Guard("flight", self.h - y.x, reset={"v": -self.r * y.v}),
        }

    def section(self, t, y):
        return PoincareSection("F", ("v", "phi"))


def floor(t):
    """Place, velocity and acceleration of the floor in mpmath."""
    a, w = mp.mpf(VALUES["a"]), mp.mpf(VALUES["w"])
    place = a * (mp.sin(w * t) + mp.sin(2 * w * t) / 4)
    rate = a * w * (mp.cos(w * t) + mp.cos(2 * w * t) / 2)
    return place, rate, -a * w**2 * (mp.sin(w * t) + mp.sin(2 * w * t))


def first_return(v, phi):
    """Word, velocity and phase just before the next impact on the floor, and time."""
    w, r, h = (mp.mpf(VALUES[name]) for name in ("w", "r", "h"))
    start = mp.mpf(phi) / w
    t, word, (x, speed, _) = start, "F", floor(start)
    u = v - (1 + r) * (v - speed)
    bend = 1 + 2 * mp.mpf(VALUES["a"]) * w**2
    for _ in range(40):
        moves = {
            "F": lambda s, t=t, x=x, u=u: (x + u * s - s**2 / 2 - floor(t + s)[0], u - s - floor(t + s)[1]),
            "C": lambda s, x=x, u=u: (h - x - u * s + s**2 / 2, s - u),
        }
        s, name = first(moves, lambda _: bend, mp.mpf(1) / 8)
        t, x, u, word = t + s, x + u * s - s**2 / 2, u - s, word + name
        if name == "F":
            return word, u, w * t, t - start
        u = -r * u
    raise ValueError("too many impacts")


@pytest.fixture(scope="module")
def starts():
    """Velocities and phases just before impacts."""
    rng = np.random.default_rng(7)
    phases = rng.uniform(0, TWO_PI, 60)
    speeds = rng.uniform(0.05, 3, 60)
    return np.column_stack([[float(floor(mp.mpf(phi) / VALUES["w"])[1]) for phi in phases] - speeds, phases])


def test_first_returns_are_those_of_forty_digits(starts):
    returns = Shaft(**VALUES).first_return(starts, derivative=True)
    assert returns.valid.all()
    words = set()
    with mp.workdps(40):
        for (v, phi), word, image, time, slope in zip(
            starts, returns.words, returns.lifted, returns.time, returns.derivative, strict=True
        ):
            expected = first_return(mp.mpf(v), mp.mpf(phi))
            assert word == expected[0]
            for a, b in zip((*image, time), expected[1:], strict=True):
                assert abs(a - b) < ROUNDING * (1 + np.abs(slope).max()) * (1 + abs(b))
            words.add(word)
    assert words == {"FF", "FCF"}


def test_derivatives_are_those_of_differences_in_forty_digits(starts):
    slopes = Shaft(**VALUES).first_return(starts[:12], derivative=True).derivative
    with mp.workdps(60):
        h = mp.mpf("1e-25")
        for (v, phi), slope in zip(starts[:12], slopes, strict=True):
            for j, (dv, dphi) in enumerate(((h, 0), (0, h))):
                up, down = (first_return(mp.mpf(v) + k * dv, mp.mpf(phi) + k * dphi) for k in (1, -1))
                found = [float((a - b) / (2 * h)) for a, b in zip(up[1:3], down[1:3], strict=True)]
                assert slope[:, j] == pytest.approx(found, rel=1e-12, abs=1e-12 * np.abs(slope).max())


def test_contact_with_the_floor_ends_where_it_falls_faster_than_the_ball():
    """The release from rest: where the floor's acceleration falls through -1."""
    shaft = Shaft(**VALUES, contact=True)
    phase = 4.7
    speed = float(floor(mp.mpf(phase) / VALUES["w"])[1])
    returns = shaft.first_return([[speed, phase]])
    assert returns.words[0].startswith("F_")
    with mp.workdps(40):
        w = mp.mpf(VALUES["w"])
        release = first({"release": lambda s: (floor(phase / w + s)[2] + 1, jerk(phase / w + s))}, lambda _: 60, mp.mpf(1) / 8)[0]
        expected = floor(phase / w + release)[1], phase + w * release
    assert returns.lifted[0] == pytest.approx([float(x) for x in expected], abs=1e-13)


def jerk(t):
    """The rate of the floor's acceleration."""
    a, w = mp.mpf(VALUES["a"]), mp.mpf(VALUES["w"])
    return -a * w**3 * (mp.cos(w * t) + 2 * mp.cos(2 * w * t))


def test_its_class_passes_the_conformance_test(starts):
    check_system(Shaft(**VALUES), states=starts)
