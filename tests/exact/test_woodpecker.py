"""The woodpecker toy (R. I. Leine, C. Glocker, D. H. van Campen, J. Vibration and Control 9 (2003) 25): impacts with friction.

A sleeve on a pole with clearance carries a bird on a spring; the beak strikes the pole, and the lower and the upper edge of the
sleeve touch it. The height, of which nothing depends, is left out.
"""

import numpy as np
import pytest
import sympy as sp

import nsmaps
from nsmaps import Guard, HybridSystem, Outcome, Section, Sliding

CYCLE = [0.08940385274225082, -0.1355017900933991, -2.157455769263201, 16.91117736822086]  # and below: in 40 digits, by others


class Woodpecker(HybridSystem):
    """Angles M of the sleeve and S of the bird, the sleeve's speed v and both angular speeds m and s."""

    c: float = 0.0056
    mu: float = 0.3
    e: float = 0.5

    mass = sp.Rational(3, 10000), sp.Rational(45, 10000)  #: of sleeve and bird
    inertia = sp.Rational(5, 10**9), sp.Rational(7, 10**7)
    pole, inner, height = (
        sp.Rational(25, 10**4),
        sp.Rational(31, 10**4),
        sp.Rational(58, 10**4),
    )  #: radii, half of the sleeve's height
    arm, bird = sp.Rational(1, 100), sp.Rational(15, 1000)  #: from the pole to the spring, and on to the bird
    beak, reach = sp.Rational(2, 100), sp.Rational(201, 10**4)

    states = ("M", "S", "v", "m", "s")

    def inverse(self):
        (sleeve, bird), a, b = self.mass, self.arm, self.bird
        rows = [sleeve + bird, bird * a, bird * b], [bird * a, self.inertia[0] + bird * a**2, bird * a * b]
        return sp.Matrix([*rows, [bird * b, bird * a * b, self.inertia[1] + bird * b**2]]).inv()

    def modes(self, t, y):
        (sleeve, bird), twist, g = self.mass, self.c * (y.M - y.S), sp.Rational(981, 100)
        forces = sp.Matrix([-(sleeve + bird) * g, -twist - bird * g * self.arm, twist - bird * g * self.bird])
        return dict.fromkeys("ud", {"M": y.m, "S": y.s} | dict(zip("vms", self.inverse() * forces, strict=True)))

    def slips(self, contact, way, size=None):
        """The velocities after an impulse of friction against a way of slipping; without a size one that stops the approach."""
        normal, tangent, u = contact
        along = self.inverse() * (normal - self.mu * way * tangent)
        size = -normal.dot(u) / normal.dot(along) if size is None else size
        return size, u + along * size

    def stops(self, contact):
        """The velocities after an impulse that stops approach and slip."""
        normal, tangent, u = contact
        both = sp.Matrix.hstack(normal, tangent)
        sizes = -(both.T * self.inverse() * both).inv() * both.T * u
        return sizes[0], u + self.inverse() * both * sizes

    def guards(self, t, y):
        u, edge = sp.Matrix([y.v, y.m, y.s]), sp.Matrix([1, self.inner, 0])
        slide, guards = y.v + self.inner * y.m, {}

        def after(end):
            return dict(zip("vms", map(sp.expand, end), strict=True))

        for name, side in (("2", 1), ("3", -1)):
            contact, gap = (sp.Matrix([0, side * self.height, 0]), edge, u), self.inner - self.pole + side * self.height * y.M
            for mode, other, way in (("u", "d", 1), ("d", "u", -1)):
                (_, own), (_, turned) = self.slips(contact, way), self.slips(contact, -way)
                stays, turns = sp.expand(way * edge.dot(own)), sp.expand(-way * edge.dot(turned))
                guards[name + mode] = Guard(mode, gap, reset=after(own), where=[stays], rests=f"{name} {mode}")
                guards[f"{name} turned {mode}"] = Guard(mode, gap, to=other, reset=after(turned), where=[turns])
                stopped = after(self.stops(contact)[1])
                guards[f"{name} stopped {mode}"] = Guard(mode, gap, reset=stopped, where=[-stays, -turns])
            guards[f"stick at {name}"] = Sliding(f"{name} u", f"{name} d", slide)
        guards["l"], guards["r"] = Guard("u", slide, to="d"), Guard("d", -slide, to="u")
        return guards | self.strikes(y, u, after)

    def strikes(self, y, u, after):
        """Impacts of the beak in compression with slip upwards or none, and expansion with slip upwards or downwards."""
        contact = sp.Matrix([0, 0, -self.beak]), sp.Matrix([1, self.arm, self.bird - self.reach]), u
        gap, guards = self.arm + self.bird - self.reach - self.pole - self.beak * y.S, {}
        slip = self.slips(contact, 1)
        for first, (size, middle), way in (
            ("slip", slip, 1),
            ("stop", self.stops(contact), 1),
            ("halt", self.stops(contact), -1),
        ):
            pressed = contact[1].dot(slip[1]) * (1 if first == "slip" else -1)
            _, end = self.slips((*contact[:2], middle), way, self.e * size)
            for to, sign in (("u", 1), ("d", -1)):
                where = [pressed, way * contact[1].dot(end), sign * (end[0] + self.inner * end[1])]
                guards[f"B {first} {to}"] = Guard(("u", "d"), gap, to=to, reset=after(end), where=list(map(sp.expand, where)))
        return guards

    def section(self, t, y):
        return Section([f"B {first} {to}" for first in ("slip", "stop", "halt") for to in "ud"], ("M", "v", "m", "s"))


def test_the_cycle_of_the_toy_and_its_doubling():
    toy = Woodpecker()
    orbit = nsmaps.periodic_orbit(toy, CYCLE)
    assert orbit.states[0] == pytest.approx(CYCLE, rel=1e-14)
    assert orbit.returns.time == pytest.approx([0.1459760651437518], rel=1e-14)
    assert orbit.multipliers[0] == pytest.approx(-0.839155653047590, abs=1e-12)
    other = toy.at(c=0.005879338637143966)  # where it doubles
    assert nsmaps.periodic_orbit(other, CYCLE).multipliers[0] == pytest.approx(-1, abs=1e-11)


ROWS = np.array([[0.09, -0.14, -2.0, 17.0], [0.08, -0.12, -2.4, 18.0], [0.095, -0.15, -1.9, 15.5], [0.1, -0.13, -2.3, 19.0]])
IMAGES = [  #: and times, of DOP853 between events and the law of impacts by cases, written apart from this class
    [0.089189958089, -0.134565522053, -2.187560814227, 16.934709364936, 0.14579532466505668],
    [0.10341665219, -0.188824091551, 1.700853605664, 16.285638612416, 0.14117274613870437],
    [0.086966124252, -0.112697776614, -2.688039824893, 17.681978277465, 0.1532118142683569],
    [0.101031466452, -0.19593676046, 2.307149609217, 16.010083861517, 0.13796402668407806],
]


def test_returns_through_impacts_that_slip_stop_or_turn_are_those_of_an_integrator():
    returns = Woodpecker().first_return(ROWS)
    assert np.column_stack([returns.image, returns.time]) == pytest.approx(np.array(IMAGES), rel=1e-9)


def test_no_return_is_undecided():
    rows = np.array(CYCLE) * (1 + np.random.default_rng(1).uniform(-0.15, 0.15, (400, 4)))
    rows[:, 0] = np.minimum(rows[:, 0], 0.1034)
    assert Woodpecker().first_return(rows).outcome.tolist() == [Outcome.returned] * 400
