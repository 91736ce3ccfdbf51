"""User-defined maps: a class with `coordinates` and `first_return`, by a formula."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import nsmaps
from nsmaps import Along, Angle, Coordinates, Returns
from nsmaps.dynamics.diagrams.windows import windows
from nsmaps.errors import NsmapsError, StateError


@dataclass(frozen=True)
class Sine:
    """x -> a sin(pi x), with a derivative or without."""

    a: float = 0.6
    smooth: bool = True
    coordinates = Coordinates(("x",))

    def at(self, **parameters):
        return replace(self, **parameters)

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        slopes = (np.pi * self.a * np.cos(np.pi * x))[:, :, None]
        return Returns.of_map(self.coordinates, x, self.a * np.sin(np.pi * x), slopes if derivative and self.smooth else None)


@dataclass(frozen=True)
class Rotor:
    """The circle map with a tongue of rotation number 0 up to tau = b / (2 pi)."""

    tau: float
    b: float = 0.4
    coordinates = Coordinates((Angle("angle"),))

    def at(self, **parameters):
        return replace(self, **parameters)

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        slopes = (1 - self.b * np.cos(x))[:, :, None]
        image = x + 2 * np.pi * self.tau - self.b * np.sin(x)
        return Returns.of_map(self.coordinates, x, image, slopes if derivative else None)


class Bare:
    """A map that returns an array."""

    coordinates = Coordinates(("x",))

    def first_return(self, states, derivative=False):
        return np.asarray(states) / 2


def test_a_map_in_a_few_lines_is_a_return_map():
    returns = Rotor(0.3).first_return([[6.0], [np.nan]], derivative=True)
    assert returns.turns.ravel().tolist() == [1, 0]
    assert returns.image[0, 0] == pytest.approx(6.0 + 0.6 * np.pi - 0.4 * np.sin(6.0) - 2 * np.pi, abs=1e-14)
    assert returns.counts() == {"returned": 1, "invalid": 1}
    assert nsmaps.bifurcation(Along(Sine(), "a"), [0.6, 0.8], [0.3]).labels.tolist() == [["period 1"], ["period 2"]]


def test_what_a_map_lacks_is_named():
    for call in (nsmaps.periodic_orbit, lambda map, state: nsmaps.lyapunov(map, state, 100)):
        with pytest.raises(NsmapsError, match=r"the map has no derivative; expected: .*of_map"):
            call(Sine(0.6, smooth=False), [0.4])
    with pytest.raises(NsmapsError, match=r"a Bare has no `at`; expected: a system, or a map whose `at`.*stability_diagram"):
        nsmaps.chart(Bare(), {"a": [0.5, 0.6], "b": [0.1, 0.2]}, [0.3])
    with pytest.raises(NsmapsError, match=r"a ndarray: `first_return` of a Bare gives what `Returns.of_map` makes"):
        nsmaps.orbit(Bare(), [0.3], 3)
    with pytest.raises(StateError, match="have the shapes"):
        Returns.of_map(("x",), [[0.1]], [0.1])


class Shifted:
    """x -> a x (1 - x) + b, whose period doublings at b = 0 lie at a = 3 and 1 + sqrt(6)."""

    coordinates = ("x",)

    def __init__(self, a=2.5, b=0.0):
        self.a, self.b = a, b

    def at(self, **values):
        return Shifted(**{"a": self.a, "b": self.b} | values)

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float).reshape(-1, 1)
        return Returns.of_map(("x",), x, self.a * x * (1 - x) + self.b, (self.a * (1 - 2 * x))[..., None] if derivative else None)


def test_a_map_with_parameters_has_a_chart():
    chart = nsmaps.chart(Shifted(), {"a": [2.5, 3.2, 3.5, 4.0], "b": [-0.05, 0.0]}, [0.3], 500, 500)
    assert [chart.motions[k].label for k in chart.motion[1, :, 0]] == ["period 1", "period 2", "period 4", "C"]
    assert chart.exponent[1, :2, 0] == pytest.approx([np.log(0.5), np.log(0.16) / 2], abs=1e-9)  # 2 - a; 4 + 2 a - a^2
    assert chart.exponent[1, 3, 0] == pytest.approx(np.log(2), abs=0.02)


@pytest.mark.parametrize(("count", "direction"), [(66, "up"), (71, "down")])
def test_the_windows_of_the_quadratic_map_end_at_its_doublings(count, direction):
    values = np.linspace(2.5, 3.52, count)
    made = nsmaps.bifurcation(Shifted, values, [0.3], discard=1000, direction=direction)
    one, two, *_ = windows(made, Shifted, np.array([0.3]), 1000, direction)
    for border, value, kind in (
        (one.high, 3.0, "period doubling"),
        (two.low, 3.0, "period halving"),
        (two.high, 1 + np.sqrt(6), "period doubling"),
    ):
        assert (border.kind, border.value) == (kind, pytest.approx(value, abs=border.precision + 1e-12))
        assert border.precision < 1e-8


def test_a_domain_names_its_map():
    assert nsmaps.attracting_domain(Sine(), [[0.1, 0.9]]).of == "map Sine"


@pytest.mark.parametrize(("count", "direction"), [(24, "up"), (41, "down")])
def test_the_windows_of_a_map_without_words(count, direction):
    """The sine map doubles where -1 is the derivative, a cos(pi x) pi = -1 with x = a sin(pi x): tan(pi x) = -pi x."""
    from scipy.optimize import brentq

    x = brentq(lambda x: np.tan(np.pi * x) + np.pi * x, 0.55, 0.9)
    doubling = x / np.sin(np.pi * x)
    map_of = Along(Sine(), "a")
    made = nsmaps.bifurcation(map_of, np.linspace(0.65, 0.8, count), [0.3], 40, 300, direction)
    first, second = windows(made, map_of, np.array([0.3]), 300, direction)
    for border, kind in ((first.high, "period doubling"), (second.low, "period halving")):
        assert (border.kind, abs(border.value - doubling) <= border.precision + 1e-14, border.precision < 1e-9) == (
            kind,
            True,
            True,
        )


def test_a_tongue_in_which_the_cycle_moves_far_between_two_values():
    map_of = Along(Rotor(0.0), "tau")
    made = nsmaps.bifurcation(map_of, np.linspace(0.0, 0.11, 12), [0.1], 40, 300, "up")
    tongue = windows(made, map_of, np.array([0.1]), 300, "up")[0]
    assert (tongue.high.kind, tongue.high.precision < 1e-9) == ("fold", True)
    assert abs(tongue.high.value - 0.4 / (2 * np.pi)) <= tongue.high.precision + 1e-15
