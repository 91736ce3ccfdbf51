"""Units and states of very different size: every coordinate keeps its own relative accuracy."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

from nsmaps import Guard, HybridSystem, PoincareSection


class Units(HybridSystem):
    """A forced oscillator before a wall, in other units, with a second one of its own units that the wall does not concern."""

    time: float = 1.0
    length: float = 1.0
    small: float = 1.0  #: unit of the second one
    pull: float = 0.0  #: of the first on the second, in the second's unit

    states = ("x", "v", "y", "u")

    def period(self):
        return 2 * sp.pi * self.time

    def modes(self, t, y):
        x, v = y.x / self.length, y.v * self.time / self.length
        force = sp.cos(t / self.time) - sp.Rational(1, 10) * v - x * sp.Rational(7, 10)
        other = self.pull * x - sp.Rational(13, 10) * y.y / self.small - sp.Rational(1, 20) * y.u * self.time / self.small
        unit = self.time**2
        return {"free": {"x": y.v, "v": self.length / unit * force, "y": y.u, "u": self.small / unit * other}}

    def guards(self, t, y):
        return {"B": Guard("free", self.length / 2 - y.x, reset={"v": -sp.Rational(4, 5) * y.v})}

    def section(self, t, y):
        return PoincareSection("B", ("v", "y", "u", "phi"))

    def scale(self):
        """The units of the coordinates."""
        return np.array([self.length / self.time, self.small, self.small / self.time, 1.0])


UNITS = [
    {"time": 1e4},
    {"length": 1e-6},
    {"time": 1e4, "length": 1e-6},
    {"small": 1e-8},
    {"time": 1e-5, "length": 1e3, "small": 1e-9},
]


def starts(count):
    rng = np.random.default_rng(4)
    return np.column_stack([rng.uniform(0.2, 2, count), *rng.uniform(-1, 1, (2, count)), rng.uniform(0, 6.28, count)])


@pytest.mark.parametrize("units", UNITS, ids=str)
@pytest.mark.parametrize("pull", [0.0, 0.3])
def test_returns_in_other_units_are_the_same(units, pull):
    rows, plain, scaled = starts(60), Units(pull=pull), Units(pull=pull, **units)
    one, other = plain.first_return(rows, derivative=True), scaled.first_return(rows * scaled.scale(), derivative=True)
    assert one.valid.all()
    assert other.words.tolist() == one.words.tolist()
    assert other.outcome.tolist() == one.outcome.tolist()
    off = np.abs(plain.coordinates.difference(other.image / scaled.scale(), one.image))
    size = np.abs(one.image) + (np.abs(one.derivative) * np.abs(rows)[:, None]).sum(axis=2)
    assert (off / size).max() < 2e-14
    slopes = other.derivative * scaled.scale() / scaled.scale()[:, None]
    assert np.abs(slopes - one.derivative).max() < 1e-12 * np.abs(one.derivative).max()
    many = scaled.first_return(rows * scaled.scale())
    assert (np.abs(plain.coordinates.difference(many.image / scaled.scale(), one.image)) / size).max() < 2e-14


@pytest.mark.parametrize("small", [1e-8, 1e-30, 1e8])
def test_a_small_state_beside_a_large_one_keeps_its_digits(small):
    system, rows = Units(small=small), starts(40)
    returns = system.first_return(rows * system.scale())
    with mp.workdps(40):
        flow = mp.matrix([[0, 1], [-mp.mpf(13) / 10, -mp.mpf(1) / 20]])
        for start, image, time in zip(rows * system.scale(), returns.image, returns.time, strict=True):
            wanted = mp.expm(flow * mp.mpf(float(time))) * mp.matrix([mp.mpf(float(start[1])), mp.mpf(float(start[2]))])
            size = abs(start[1]) + abs(start[2])
            assert abs(image[1] - wanted[0]) < 2e-15 * size * (1 + time)
            assert abs(image[2] - wanted[1]) < 2e-15 * size * (1 + time)
