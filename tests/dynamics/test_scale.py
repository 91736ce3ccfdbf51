"""No result depends on where a coordinate is measured from, or in which units: of a system with modes and of a formula."""

from dataclasses import dataclass, replace
from math import exp, pi, sqrt
from typing import Any, ClassVar

import numpy as np
import pytest
import sympy as sp
from boxmaps import plain_returns

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.dynamics.attractors.limit_set import limit_set
from nsmaps.dynamics.design.conditions import margins
from nsmaps.dynamics.diagrams.windows import windows
from nsmaps.dynamics.scale import scale_of
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.trajectory import track

Z = 0.3  #: share of critical damping


class Resonator(HybridSystem):
    """x'' + 2 Z x' + x = F cos(w t) in units of length and time, x from an origin, seen where sin(w t) falls through zero.

    There x = -F (1 - w^2)/D and v = -F 2 Z w^2/D with D = (1 - w^2)^2 + (2 Z w)^2: x passes zero at w = 1.
    """

    w: float = 1.2
    F: float = 1.0
    length: float = 1.0
    time: float = 1.0
    origin: float = 0.0

    states = ("x", "v")

    def period(self) -> Any:
        return 2 * sp.pi / self.w * self.time

    def modes(self, t: Any, y: Any) -> Any:
        pull = self.F * self.length * sp.cos(self.w * t / self.time) - (y.x - self.origin)
        return {"free": {"x": y.v, "v": pull / self.time**2 - 2 * Z / self.time * y.v}}

    def guards(self, t: Any, y: Any) -> Any:
        return {"S": Guard("free", sp.sin(self.w * t / self.time), letter="")}

    def section(self, t: Any, y: Any) -> Any:
        return PoincareSection("S", ("x", "v"))

    def state(self) -> np.ndarray:
        """The fixed point in closed form."""
        size = (1 - self.w**2) ** 2 + (2 * Z * self.w) ** 2
        x, v = -self.F * (1 - self.w**2) / size, -self.F * 2 * Z * self.w**2 / size
        return np.array([self.origin + self.length * x, self.length / self.time * v])


PLACES = [(1.0, 1.0, 0.0), (1.0, 1.0, -50.0), (1e-9, 1e-3, 0.0), (1e6, 1.0, 3e5)]  #: lengths, times, origins
everywhere = pytest.mark.parametrize(
    ("length", "time", "origin"), [pytest.param(*place, marks=[pytest.mark.thorough] * (place[2] == -50)) for place in PLACES]
)


@everywhere
def test_an_optimum_beyond_a_zero_of_a_coordinate_has_the_closed_form(length: float, time: float, origin: float) -> None:
    """The mean of x^2 is F^2/(2 D), at most F^2/(8 Z^2 (1 - Z^2)) at w^2 = 1 - 2 Z^2; the start is beyond x = 0."""
    system = Resonator(w=1.3, length=length, time=time, origin=origin)
    square = {"name": "square", "formula": f"(x - ({origin!r}))**2", "of": "flights"}
    found = nsmaps.optimize(system.at, square, {"w": (0.5, 1.4)}, guess={"w": 1.3}, start=system.state(), per="time", n_guesses=1)
    assert found.parameters["w"] == pytest.approx(sqrt(1 - 2 * Z**2), rel=1e-6)
    assert found.value == pytest.approx(length**2 / (8 * Z**2 * (1 - Z**2)), rel=1e-9)
    assert found.residual < 1e-5
    assert found.attempts[0].optimal
    assert found.active == ()
    assert found.orbit.states[0] == pytest.approx(system.at(**found.parameters).state(), rel=1e-9)


@everywhere
def test_a_branch_begins_where_a_coordinate_is_zero(length: float, time: float, origin: float) -> None:
    """It takes as many steps from any place, and each orbit is that of the closed form; the multipliers have size exp(-Z T)."""
    system = Resonator(w=1.0 + 1e-12, length=length, time=time, origin=origin)
    orbit = nsmaps.periodic_orbit(system, system.state())
    units = np.array([length, length / time])
    branch = nsmaps.continue_branch(system, "w", orbit, system.w, (0.5, 1.4), direction="down", step=0.05)
    assert branch.ended == "the range ends at 0.5"
    assert 8 < len(branch.values) < 25
    exact = np.array([system.at(w=w).state() for w in branch.values.tolist()])
    assert np.abs((branch.points[:, 0] - exact) / units).max() < 1e-9 + 4e-15 * abs(origin) / length
    assert np.abs(branch.multipliers) == pytest.approx(np.exp(-Z * 2 * pi / branch.values)[:, None] * np.ones(2), rel=1e-6)
    assert exp(-Z * 2 * pi) == pytest.approx(abs(branch.multipliers[0, 0]), rel=1e-6)
    some = nsmaps.continue_branch(system, "w", orbit, system.w, (0.5, 1.4), direction="down", max_points=5)
    assert some.ended.startswith("5 orbits, before the range was covered: followed to 0.")


@everywhere
def test_the_scale_is_the_extent_of_the_motion(length: float, time: float, origin: float) -> None:
    """Twice the amplitudes F/sqrt(D) and w F/sqrt(D), but for what is missed between nine instants of a flight."""
    for w in (0.7, 1.0, 1.3):
        system = Resonator(w=w, length=length, time=time, origin=origin)
        amplitude = 1 / sqrt((1 - w**2) ** 2 + (2 * Z * w) ** 2)
        expected = 2 * amplitude * length * np.array([1.0, w / time])
        found = scale_of(system, system.state())
        assert (found <= expected * (1 + 1e-12)).all()
        assert (found > 0.9 * expected).all()


class Box(HybridSystem):
    """A ball on a damped spring between walls at 1 and -1 of a shaken, tilted box, beside a filter u that it does not concern."""

    tilt: float = 0.3
    r: float = 0.5
    unit: float = 1.0

    states = ("x", "v", "u")
    order: ClassVar[tuple[str, ...]] = ("u", "v", "phi")

    def period(self) -> Any:
        return 2 * sp.pi

    def modes(self, t: Any, y: Any) -> Any:
        return {"free": {"x": y.v, "v": self.unit * (2 * sp.cos(t) + self.tilt) - y.x - y.v / 5, "u": sp.cos(t) - y.u}}

    def guards(self, t: Any, y: Any) -> Any:
        return {name: Guard("free", self.unit - side * y.x, reset={"v": -self.r * y.v}) for name, side in (("R", 1), ("L", -1))}

    def section(self, t: Any, y: Any) -> Any:
        return PoincareSection("R", self.order)


class Turned(Box):
    """With the coordinates in another order."""

    order: ClassVar[tuple[str, ...]] = ("phi", "v", "u")


@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_margins_are_shares_of_the_largest_impact_speed_whatever_the_first_coordinate_is(unit: float) -> None:
    """Against the velocities just before the impacts on the way."""
    found = []
    for box, start in ((Box(unit=unit), [0.5, 2.0 * unit, 0.5]), (Turned(unit=unit), [0.5, 2.0 * unit, 0.5])):
        orbit = nsmaps.periodic_orbit(box, nsmaps.orbit(box, start, 400).states[-2:], 2)
        assert orbit.converged
        k = orbit.words.index("RR")
        speeds = np.abs(track(box, orbit.states[k], 4).events.before[1:, 1])  # at R, then at L and R
        expected = np.array([speeds[0], speeds[1:].min()]) / speeds.max()
        assert expected.min() < 0.6
        assert np.roll(margins(box, orbit)[1], -k) == pytest.approx(expected, rel=1e-9)
        found.append(np.roll(margins(box, orbit), -k, axis=1))
    assert found[0] == pytest.approx(found[1], rel=1e-8)


@dataclass(frozen=True)
class Henon(ReturnMap):
    """(x, y) to (1 - a x^2 + y, b x) in a unit, x from an origin: a fixed point doubles its period at a = 3 (1 - b)^2/4."""

    a: float = 0.3
    b: float = 0.3
    unit: float = 1.0
    origin: float = 0.0
    coordinates: tuple[str, ...] = ("x", "y")

    def at(self, **changes: float) -> "Henon":
        return replace(self, **changes)

    def states(self, rows: Any) -> np.ndarray:
        return self.unit * np.asarray(rows, float) + [self.origin, 0.0]

    def first_return(self, states: Any, derivative: bool = False) -> Any:
        x, y = ((np.asarray(states, float) - [self.origin, 0.0]) / self.unit).T
        image = self.states(np.column_stack([1 - self.a * x**2 + y, self.b * x]))
        slopes = np.column_stack([-2 * self.a * x, np.ones_like(x), self.b * np.ones_like(x), np.zeros_like(x)])
        return plain_returns(self.coordinates, states, image, slopes.reshape(-1, 2, 2))


@pytest.mark.parametrize(("unit", "origin"), [(1.0, 40.0), (1e-9, -1e-9), (1e6, -1e6)])
def test_a_formula_has_the_same_events_and_attractors_in_any_unit_and_from_any_origin(unit: float, origin: float) -> None:
    """At a = b = 0.3 the fixed point is (1, 0.3), so that x is zero there from an origin of -1 unit."""
    return_map = Henon(unit=unit, origin=origin)
    orbit = nsmaps.periodic_orbit(return_map, return_map.states([0.9, 0.25]))
    assert orbit.states == pytest.approx(return_map.states([[1.0, 0.3]]), abs=1e-12 * unit + 1e-15 * abs(origin))
    on_it = nsmaps.periodic_orbit(return_map, orbit.states[0])
    assert on_it.converged

    def along(a: float, b: float = 0.3) -> Henon:
        return return_map.at(a=a, b=b)

    branch = nsmaps.continue_branch(along, "p", on_it, 0.3, (0.1, 1.0), step=0.05)
    (event,) = branch.events
    assert (event.kind, event.value) == ("period doubling", pytest.approx(0.75 * 0.7**2, abs=1e-10))
    assert len(branch.values) < 30
    doubled = nsmaps.switch_branch(along, "p", event, (0.1, 0.6), step=0.05)
    assert doubled.ended == "the range ends at 0.6"
    curve = nsmaps.bifurcation_curve(along, event, {"p": (0.1, 1.0), "q": (0.2, 0.4)}, 0.3, step=0.1)
    assert curve.parameters[:, 0] == pytest.approx(0.75 * (1 - curve.parameters[:, 1]) ** 2, abs=1e-9)
    two = nsmaps.periodic_orbits(return_map.at(a=0.5), return_map.states(np.random.default_rng(0).uniform(-1, 1, (10, 2))), 2)
    assert len(two) == 1
    assert two[0].states[:, 1].sum() / unit == pytest.approx(0.3 * 0.7 / 0.5, rel=1e-9)  # x + x' = (1 - b)/a
    found = limit_set(return_map, nsmaps.orbit(return_map, on_it.states[0], 100))
    assert found is not None
    assert found.period == 1
    basins = nsmaps.basins(return_map.at(a=0.5), return_map.states(np.random.default_rng(0).uniform(-1, 1, (20, 2))))
    assert [(attractor.period, share) for attractor, share in zip(basins.attractors, basins.fractions, strict=False)] == [
        (2, 1.0)
    ]
    values = np.linspace(0.2, 0.6, 17)
    diagram = nsmaps.bifurcation_diagram(along, "p", values, on_it.states[0], direction="up", transient=500)
    first, *_ = windows(diagram, along, on_it.states[0], 500, "up")
    assert (first.high.value, first.high.kind) == (pytest.approx(0.3675, abs=1e-6), "period doubling")
