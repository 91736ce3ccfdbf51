"""Observables of maps: means on cycles in exact numbers, on chaos by its law, derivatives by implicit differentiation."""

from fractions import Fraction
from typing import ClassVar

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from messages import message

import nsmaps
from nsmaps import Angle, Noise, PiecewiseMap, Returns, System
from nsmaps.errors import NsmapsError
from nsmaps.exact import Along


class Gap(PiecewiseMap):
    """x -> a x + mu, and less by one on the right, with the cycle LLR."""

    a: float = 0.5
    mu: float = 0.25
    coordinates = ("x",)
    observables: ClassVar = {"square": {"formula": "x**2"}}

    def pieces(self, x):
        return {"L": (x.x < 0, {"x": self.a * x.x + self.mu}), "R": (True, {"x": self.a * x.x + self.mu - 1})}


class Logistic(PiecewiseMap):
    """x -> r x (1 - x), by the letters of both branches."""

    r: float = 4.0
    coordinates = ("x",)

    def pieces(self, x):
        image = {"x": self.r * x.x * (1 - x.x)}
        return {"L": (x.x < 0.5, image), "R": (True, image)}


class Program(System):
    """The same in Python."""

    r: float = 4.0
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        x = states[:, 0]
        slopes = (self.r * (1 - 2 * x))[:, None, None]
        letters = np.where(x < 0.5, "L", "R").tolist()
        return Returns.of_map(self.coordinates, states, self.r * states * (1 - states), slopes, letters, ("L", "R"))


class Turned(PiecewiseMap):
    """The circle map."""

    turn: float = 2 * np.pi / 5
    b: float = 0.0
    coordinates = (Angle("phi"),)

    def pieces(self, x):
        return {"S": (True, {"phi": x.phi + self.turn - self.b * sp.sin(x.phi)})}


LEFT = {"name": "left", "formula": "1", "at": "L"}
HEIGHT = {"name": "height", "formula": "x_after + a*x", "at": "R", "per": "1"}


def cycle_of_fractions(a, mu, word):
    """The states of the cycle of a word, in rational numbers: x = sum of offsets a^k over 1 - a^q."""
    b = [mu - (letter == "R") for letter in word]
    q = len(b)
    return [sum(a ** (q - 1 - k) * b[(start + k) % q] for k in range(q)) / (1 - a**q) for start in range(q)]


def test_means_on_a_cycle_are_those_of_its_states():
    return_map, a, mu = Gap(), Fraction(1, 2), Fraction(1, 4)
    orbit = nsmaps.periodic_orbit(return_map, nsmaps.orbit(return_map, [0.1], 200).final, 3)
    x = cycle_of_fractions(a, mu, orbit.words)
    right = [k for k in range(3) if orbit.words[k] == "R"]
    assert len(right) == 1
    exact = [
        sum(x) / 3,
        sum(each**2 for each in x) / 3,
        Fraction(2, 3),
        x[(right[0] + 1) % 3] + a * x[right[0]],
        max(x),
    ]
    names = ["x", "square", LEFT, HEIGHT, {"name": "top", "formula": "x", "largest": True}]
    on_cycle = nsmaps.observe(return_map, orbit, names)
    assert on_cycle.names == ("x", "square", "left", "height", "top")
    assert on_cycle.per_return.value == pytest.approx([float(each) for each in exact], abs=1e-15)
    assert on_cycle.per_time.value == pytest.approx(on_cycle.per_return.value, abs=1e-15)
    assert on_cycle.per_period is None
    found = nsmaps.observe(return_map, orbit.states[0], names, n_returns=3 * 4000, transient=3, n_batches=4)
    assert found.per_return.value == pytest.approx(on_cycle.per_return.value, abs=1e-12)
    assert (found.per_return.error[:4] < 1e-12).all()


def test_derivatives_are_those_of_the_cycle_of_fractions():
    """Every observable of the cycle is a rational function of a and mu, whose differences are computed in 60 digits."""
    return_map = Gap(a=0.6, mu=0.3)
    orbit = nsmaps.periodic_orbit(return_map, nsmaps.orbit(return_map, [0.1], 200).final, 3)
    right = list(orbit.words).index("R")

    def means(a, mu):
        x = cycle_of_fractions(a, mu, orbit.words)
        return [sum(x) / 3, sum(each**2 for each in x) / 3, x[(right + 1) % 3] + a * x[right]]

    with mp.workdps(60):
        at = mp.mpf(0.6), mp.mpf(0.3)
        for name, k in (("a", 0), ("mu", 1)):
            slopes = [mp.diff(lambda t, i=i, k=k: means(*(t if j == k else at[j] for j in (0, 1)))[i], at[k]) for i in range(3)]
            found = nsmaps.observe(return_map, orbit, ["x", "square", HEIGHT], rates={name: 1.0}).per_return
            assert found.derivative == pytest.approx([float(each) for each in slopes], rel=1e-12)


@pytest.mark.parametrize("return_map", [Logistic(r=3.2), Program(r=3.2)], ids=["formula", "program"])
def test_derivatives_on_a_branch_of_the_logistic_map(return_map):
    """The cycle of period two has the sum (r + 1)/r and the product (r + 1)/r^2."""
    orbit = nsmaps.periodic_orbit(return_map, [0.5130], 2)
    branch = nsmaps.continue_branch(return_map, "r", orbit, 3.2, (3.1, 3.4))
    square = {"name": "square", "formula": "x**2"}
    found = nsmaps.observe(Along(return_map, "r"), branch, ["x", square]).per_return
    r = branch.values
    assert len(r) > 3
    s, p = (r + 1) / r, (r + 1) / r**2
    ds, dp = -1 / r**2, -1 / r**2 - 2 / r**3
    assert found.value == pytest.approx(np.stack([s / 2, s**2 / 2 - p], axis=1), rel=1e-10)
    assert found.derivative == pytest.approx(np.stack([ds / 2, s * ds - dp], axis=1), rel=1e-6)


@pytest.mark.parametrize("return_map", [Logistic(), Program()], ids=["formula", "program"])
def test_means_on_chaos_have_the_law_of_the_map(return_map):
    """At r = 4 the density is 1/(pi sqrt(x (1 - x))): x has the mean 1/2, x^2 3/8, either letter 1/2; x by letter 1/2 -+ 1/pi."""
    n = 40_000 if isinstance(return_map, Logistic) else 4000
    left = {"name": "on the left", "formula": "x", "at": "L", "per": "1"}
    found = nsmaps.observe(
        return_map, [0.2345], ["x", {"name": "square", "formula": "x**2"}, LEFT, left], n_returns=n, transient=50
    ).per_return
    exact = np.array([1 / 2, 3 / 8, 1 / 2, 1 / 2 - 1 / np.pi])
    assert (np.abs(found.value - exact) < 5 * found.error).all()
    assert (found.error < 10 / n**0.5).all()


def test_turns_of_an_angle_are_the_rotation_number():
    cosine = {"name": "c", "formula": "cos(phi_after) - cos(phi)"}
    found = nsmaps.observe(Turned(), [[0.3], [6.0], [-50.0]], ["phi_turns", cosine], n_returns=50, n_batches=10)
    assert found.per_return.value[:, 0] == pytest.approx([0.2] * 3, abs=1e-14)
    assert found.per_return.value[:, 1] == pytest.approx([0.0] * 3, abs=1e-13)
    locked = Turned(turn=0.1, b=0.5)
    assert nsmaps.observe(locked, [1.0], ["phi_turns"], n_returns=100, transient=200).per_return.value[0] == pytest.approx(
        0, abs=1e-12
    )


def test_diagrams_have_means():
    along = Along(Gap(), "mu")
    diagram = nsmaps.bifurcation_diagram(along, "p", [0.25, 0.5], [0.1], n_returns=60, transient=500)
    found = nsmaps.observe(along, diagram, [LEFT], n_returns=60).per_return
    assert found.value[:, 0, 0] == pytest.approx([2 / 3, 1 / 2], abs=1e-14)


def test_batches_do_not_depend_on_blocks(monkeypatch):
    from nsmaps.dynamics.observables import maps

    names = ["x", {"name": "top", "formula": "x", "largest": True}, LEFT]
    starts = np.linspace(-0.4, 0.6, 7)[:, None]
    whole = nsmaps.observe(Gap(), starts, names, n_returns=101, transient=5, n_batches=10)
    monkeypatch.setattr(maps, "BLOCK", 20)
    parts = nsmaps.observe(Gap(), starts, names, n_returns=101, transient=5, n_batches=10)
    assert parts.totals == pytest.approx(whole.totals, abs=1e-13)
    assert whole.totals.shape == (10, 7, 3)
    assert np.array_equal(parts.time, whole.time)
    assert np.array_equal(parts.final, whole.final)


def test_means_under_noise():
    """An autoregression has the mean mu/(1 - a) and, of its images, the same variance as of its states."""
    return_map = Gap(a=0.5, mu=-2.0)
    made = nsmaps.noisy_orbits(return_map, [-4.0], Noise(sigma=0.1), n_returns=400, n_realisations=100, rng=1)
    found = nsmaps.observe(return_map, made, ["x", {"name": "v", "formula": "(x_after + 4)**2"}, LEFT]).per_return
    assert (np.abs(found.value - [-4, 0.01 / 0.75, 1]) <= 5 * found.error + 2e-4).all()
    assert (found.error < 2e-3).all()


def test_an_optimum_of_a_cycle():
    """The mean of x^2 over the fixed point mu/(1 - a) on the left is least at the largest mu < 0."""
    found = nsmaps.optimize(
        Gap().at,
        "square",
        {"mu": (-1.0, -0.1), "a": (-0.5, 0.5)},
        guess={"mu": -0.5, "a": 0.2},
        start=[-0.6],
        sense="min",
        multiplier=0.4,
    )
    assert found.parameters == pytest.approx({"mu": -0.1, "a": -0.4}, abs=1e-7)
    assert found.value == pytest.approx((0.1 / 1.4) ** 2, rel=1e-6)


class Fold(nsmaps.PiecewiseMap):
    """Lozi's map in units of u: its fixed point on the right is u/(1 + a - b), with multipliers of sum -a and product -b."""

    a: float = 0.7
    b: float = 0.2
    left: float = 0.7
    u: float = 1.0
    coordinates = ("x", "y")

    def pieces(self, x):
        y = {"y": self.b * x.x}
        return {"L": (x.x < 0, {"x": self.u + self.left * x.x + x.y} | y), "R": (True, {"x": self.u - self.a * x.x + x.y} | y)}


@pytest.mark.parametrize("u", [1e-6, 1e6])
def test_an_optimum_follows_a_change_of_units_through_zeros_and_steep_values(u):
    """The cycle's y passes zero with b, x grows tenfold towards its bound, and the last formula is zero at the guess."""
    system, bounds = Fold(u=u), {"a": (-0.5, 1.5), "b": (-0.9, 0.9)}
    start = nsmaps.periodic_orbit(system, [0.7 * u, 0.1 * u]).states
    least = nsmaps.optimize(system, "x", bounds, start, sense="min", n_guesses=1)
    assert least.value == pytest.approx(u / 3.4, rel=1e-9)
    assert least.active == ("a", "b")
    most = nsmaps.optimize(system, "x", bounds, start, n_guesses=1)  # with 0.95 and 0.45 as multipliers
    assert most.value == pytest.approx(u / 0.0725, rel=1e-6)
    assert most.parameters == pytest.approx({"a": -0.5, "b": 0.4275}, abs=1e-8)
    first = u / 1.5
    parabola = {"name": "parabola", "formula": f"(x - {first!r})*(x - {first + 0.1 * u!r})"}
    found = nsmaps.optimize(system, parabola, {"a": bounds["a"]}, start, sense="min", n_guesses=1)
    assert found.value == pytest.approx(-(u**2) / 400, rel=1e-9)
    assert u / (0.8 + found.parameters["a"]) == pytest.approx(first + 0.05 * u, rel=1e-6)
    assert not found.flat


def test_an_optimum_of_a_parameter_without_effect_is_flat():
    found = nsmaps.optimize(Fold(), "x", {"left": (-1.0, 1.0)}, [0.7, 0.1], n_guesses=1)
    assert found.flat
    assert "flat" in found.summary()


@pytest.mark.parametrize(
    ("one", "text"),
    [
        ("work", message("exact.observable", name="work", map="Gap", known="x, square")),
        (
            {"name": "w", "formula": "1", "of": "flights"},
            message("exact.observable-of", name="w", given="flights", expected="returns"),
        ),
        ({"name": "w", "formula": "1", "at": "Q"}, message("exact.observable-at", event="a return", letter="Q", letters="L, R")),
        ({"name": "w", "formula": "v"}, message("errors.unknown", kind="name", name="v")),
    ],
)
def test_what_a_map_does_not_observe_is_refused(one, text):
    with pytest.raises(NsmapsError, match=text):
        nsmaps.observe(Gap(), [0.1], [one], n_returns=10)
    system = nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113)
    with pytest.raises(NsmapsError, match=message("exact.observable-of", given="returns")):
        nsmaps.observe(system, [0.8, 0.4], [{"name": "w", "formula": "1", "of": "returns"}], n_returns=10)
