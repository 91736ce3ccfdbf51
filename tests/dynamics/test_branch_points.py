"""Branches that cross, and orbits of families, on maps and systems whose orbits are known in closed form."""

from dataclasses import dataclass, replace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from boxmaps import plain_returns
from messages import message
from systems import Oscillator

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.dynamics.continuation.follow import continue_branch, switch_branch
from nsmaps.dynamics.continuation.problem import derivative_of
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap

BOUNDS = (-1.0, 1.5)


@dataclass(frozen=True)
class Pitchfork(ReturnMap):
    """z' = (1 + a) z - 2 z^3 + y/5 of z = x - 3 a, y' = y/2: fixed points z = 0, and z^2 = a/2, which double at a = 1."""

    a: float
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        z, y, one = start[:, 0] - 3 * self.a, start[:, 1], np.ones(len(start))
        image = np.column_stack([(1 + self.a) * z - 2 * z**3 + y / 5 + 3 * self.a, y / 2])
        slopes = np.array([[1 + self.a - 6 * z**2, one / 5], [0 * one, one / 2]]).transpose(2, 0, 1)
        return plain_returns(self.coordinates, start, image, slopes if derivative else None)


def test_a_pitchfork_is_one_from_either_branch_and_leads_to_the_other():
    start = nsmaps.periodic_orbit(Pitchfork(0.5), [1.5, 0.0])
    (event,) = continue_branch(Pitchfork, "p", start, 0.5, BOUNDS, direction="down").events
    assert event.kind == "branch point"
    assert abs(event.value) < event.precision < 1e-12
    assert np.abs(event.orbit.states).max() < 1e-9  # on both branches
    halves = [switch_branch(Pitchfork, "p", event, BOUNDS, side=side) for side in (1, -1)]
    for half in halves:
        z = half.points[:, 0, 0] - 3 * half.values
        assert np.abs(2 * z**2 - half.values).max() < 1e-9
        assert half.values[-1] == 1.5
        (doubling,) = half.events
        assert doubling.kind == "period doubling"
        assert doubling.value == pytest.approx(1, abs=1e-10)
    assert np.sign([half.points[-1, 0, 0] - 4.5 for half in halves]).sum() == 0
    for k in (2, 3, 5, 8):  # whatever the steps next to it
        orbit, value = halves[0].orbits[k], halves[0].values[k]
        back = continue_branch(Pitchfork, "p", orbit, value, BOUNDS, direction="down", until=("branch point",))
        (again,) = back.events
        assert (again.kind, abs(again.value) < again.precision < 1e-12) == ("branch point", True)
    through = switch_branch(Pitchfork, "p", again, BOUNDS, step=0.1)
    assert np.abs(through.points[:, 0, 0] - 3 * through.values).max() < 1e-9


@pytest.mark.thorough
def test_the_pitchforks_of_a_map_are_a_curve_in_two_parameters():
    """Of 1 + a - b^2/2 in place of 1 + a: a = b^2/2, which turns back in a; a term that breaks the symmetry leaves one point."""
    for broken in (0, 1):

        def of(a, b, broken=broken):
            return Shifted(a - b**2 / 2, broken * (b - 0.4))

        (event,) = continue_branch(
            lambda a, of=of: of(a, 0.4), "a", nsmaps.periodic_orbit(of(0.5, 0.4), [1.3, 0.0]), 0.5, BOUNDS, direction="down"
        ).events
        curve = nsmaps.bifurcation_curve(of, event, {"p": BOUNDS, "q": (-1.2, 1.0)}, 0.4, step=0.3)
        a, b = curve.parameters.T
        assert np.abs(a - b**2 / 2).max() < 1e-12
        assert (b[0], b[-1]) == ((0.4, 0.4) if broken else (-1.2, 1.0))
        assert ["lost" in end for end in curve.ended] == 2 * [bool(broken)]


@dataclass(frozen=True)
class Shifted(Pitchfork):
    """The same with another constant in the first image."""

    shift: float = 0.0

    def first_return(self, states, derivative=False):
        found = super().first_return(states, derivative)
        return replace(found, image=found.image + np.array([self.shift, 0.0]))


@dataclass(frozen=True)
class Coupled(ReturnMap):
    """x' = a x - x^3 + k (y - x), and so y': x = y = (a - 1)^(1/2) loses its symmetry at a = 1 - k."""

    a: float
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        start, k = np.asarray(states, float), -0.3
        slopes = (self.a - k - 3 * start**2)[:, :, None] * np.eye(2) + k * np.array([[0, 1], [1, 0]])
        image = (self.a - k) * start - start**3 + k * start[:, ::-1]
        return plain_returns(self.coordinates, start, image, slopes if derivative else None)


def test_two_equal_maps_lose_their_symmetry_at_one_place_seen_from_either_branch():
    first = continue_branch(
        Coupled, "p", nsmaps.periodic_orbit(Coupled(2.0), [1.0, 1.0]), 2.0, (1.1, 3.0), direction="down"
    ).events[0]
    half = switch_branch(Coupled, "p", first, (1.1, 3.0))
    middle = len(half.orbits) // 2
    back = continue_branch(
        Coupled, "p", half.orbits[middle], half.values[middle], (1.1, 3.0), direction="down", until=("branch point",)
    )
    for event in (first, back.events[-1]):
        assert event.kind == "branch point"
        assert abs(event.value - 1.3) < event.precision < 1e-12


@dataclass(frozen=True)
class Delayed(ReturnMap):
    """The delayed logistic map: x' = a x (1 - y), y' = x."""

    a: float
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        (x, y), one = start.T, np.ones(len(start))
        slopes = np.array([[self.a * (1 - y), -self.a * x], [one, 0 * one]]).transpose(2, 0, 1)
        image = np.column_stack([self.a * x * (1 - y), x])
        return plain_returns(self.coordinates, start, image, slopes if derivative else None)


def test_the_branches_of_the_delayed_logistic_map_cross():
    """0 and 1 - 1/a, at a = 1."""
    start = nsmaps.periodic_orbit(Delayed(1.5), [0.33, 0.33])
    (event,) = continue_branch(Delayed, "p", start, 1.5, (0.5, 1.8), direction="down").of_kind("branch point")
    for side in (1, -1):
        other = switch_branch(Delayed, "p", event, (0.5, 1.8), side=side, step=0.1)
        assert np.abs(other.points).max() < 1e-9
        assert other.values[-1] in (0.5, 1.8)
    with pytest.raises(NsmapsError, match=message("dynamics.no-branch-from")):
        switch_branch(Delayed, "p", replace(event, kind="fold"), (0.5, 1.8))


def half_turn(v, phi, gap, r):
    """From an impact on one wall to the next on the other, of x'' + x'/10 + x = cos(1.7 t): speed, and phase less pi."""
    z, w = mp.mpf(0.05), mp.mpf(1.7)
    k, size = mp.sqrt(1 - z**2), (1 - w**2) ** 2 + (2 * z * w) ** 2

    def forced(t):
        return ((1 - w**2) * mp.cos(w * t) + 2 * z * w * mp.sin(w * t)) / size

    def rate(t):
        return w * ((w**2 - 1) * mp.sin(w * t) + 2 * z * w * mp.cos(w * t)) / size

    t, a = phi / w, gap - forced(phi / w)
    b = (-r * v - rate(t) + z * a) / k
    s = mp.findroot(lambda s: mp.exp(-z * s) * (a * mp.cos(k * s) + b * mp.sin(k * s)) + forced(t + s) + gap, mp.pi / w)
    speed = mp.exp(-z * s) * ((k * b - z * a) * mp.cos(k * s) - (z * b + k * a) * mp.sin(k * s)) + rate(t + s)
    return -speed, phi + w * s - mp.pi


def symmetry_lost(v, phi, gap, r):
    """Half a turn leads to the mirror image, and has the multiplier -1."""
    image = half_turn(v, phi, gap, r)
    columns = [mp.diff(lambda v: half_turn(v, phi, gap, r)[0], v), mp.diff(lambda x: half_turn(v, x, gap, r)[0], phi)]
    others = [mp.diff(lambda v: half_turn(v, phi, gap, r)[1], v), mp.diff(lambda x: half_turn(v, x, gap, r)[1], phi)]
    slopes = mp.matrix([columns, others])
    return [image[0] - v, image[1] - phi, mp.det(slopes + mp.eye(2))]


@pytest.mark.parametrize("bounds", [(1.5, 6.0), (2.0, 9.0)])
def test_an_oscillator_between_two_walls_loses_its_symmetry_at_one_place(bounds):
    """Whatever the range, and so the steps: of walls at 1/a, by mpmath."""

    def of(a, r=0.7):
        return Oscillator(zeta=0.05, w=1.7, gap=1 / a, r=r)

    def lost(a, r, state):
        with mp.workdps(25):
            start = [*map(mp.mpf, state), 1 / mp.mpf(a)]
            return float(1 / mp.findroot(lambda v, phi, gap: symmetry_lost(v, phi, gap, mp.mpf(r)), start, tol=1e-20)[2])

    orbit = nsmaps.periodic_orbit(of(5.0), [0.7775, 0.4251])
    assert orbit.word == "RLR"
    (event,) = continue_branch(of, "p", orbit, 5.0, bounds, direction="down").of_kind("branch point")
    assert abs(event.value - lost(2.48, 0.7, [0.8127, 0.1984])) < event.precision < 1e-11
    curve = nsmaps.bifurcation_curve(of, event, {"p": bounds, "q": (0.6, 0.8)}, 0.7, step=0.3)
    assert curve.ended == ("the range of the second parameter ends at 0.6", "the range of the second parameter ends at 0.8")
    for k in (0, -1):
        (a, r), state = curve.parameters[k], curve.points[k, 0]
        assert abs(a - lost(a, r, state)) < 1e-12


@dataclass(frozen=True)
class Sliding(ReturnMap):
    """x' = x + y, y' = y/2 + a (x - x): every state with y = 0 is fixed."""

    a: float
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        slopes = np.tile([[1.0, 1.0], [0.0, 0.5]], (len(start), 1, 1))
        return plain_returns(self.coordinates, start, np.einsum("kij,kj->ki", slopes, start), slopes if derivative else None)


class Wedge(HybridSystem):
    """A ball in a wedge of two slopes y = abs(x)/tan(theta), elastic, with gravity 1."""

    theta: float

    states = ("x", "y", "u", "v")

    def modes(self, t, y):
        return {"flight": {"x": y.u, "y": y.v, "u": 0, "v": -1}}

    def guards(self, t, y):
        c, s = sp.cos(self.theta), sp.sin(self.theta)

        def mirror(side):
            into = 2 * (s * y.v - side * c * y.u)
            return {"u": y.u + side * c * into, "v": y.v - s * into}

        return {side: Guard("flight", s * y.y - sign * c * y.x, reset=mirror(sign)) for side, sign in (("R", 1), ("L", -1))}

    def section(self, t, y):
        return PoincareSection("R", ("x", "u", "v"))


def test_an_orbit_of_a_family_is_found_and_has_no_branch():
    """The nearest member: where a ball meets both slopes at right angles, u^2 + v^2 = x/(sin cos)."""
    for system, guess, parameter, value in (
        (Sliding(1.0), [0.3, 0.2], "a", 1.0),
        (Wedge(theta=1.0), [0.2, 0.3, -0.5], "theta", 1.0),
    ):
        orbit = nsmaps.periodic_orbit(system, guess)
        assert orbit.converged
        assert np.abs(orbit.multipliers - 1).min() < 1e-9
        branch = continue_branch(
            lambda a, system=system, parameter=parameter: replace_in(system, parameter, a), "a", orbit, value, (0.5, 1.5)
        )
        assert branch.ended.startswith("no branch from the orbit at 1: it is one of a family")
    x, u, v = orbit.states[0]
    assert u**2 + v**2 == pytest.approx(x / (np.sin(1) * np.cos(1)), rel=1e-9)
    assert u / v == pytest.approx(-1 / np.tan(1), rel=1e-9)


def replace_in(system, parameter, value):
    """A system with another value of a parameter."""
    return system.at(**{parameter: value}) if isinstance(system, HybridSystem) else replace(system, **{parameter: value})


def test_a_derivative_is_not_sought_by_steps_below_rounding():
    """Of a jump no steps agree, and 1e-17 beside 1 is none: dividing by it would be a warning."""
    with np.errstate(all="raise"):
        slopes = derivative_of(lambda value: np.array([float(value > 1), 3 * value]), 1.0, 1e-9, np.ones(2))
    assert np.isnan(slopes).all()
    assert derivative_of(lambda value: np.array([3 * value]), 1.0, 1e-9, np.ones(1)) == pytest.approx(3, rel=1e-3)
