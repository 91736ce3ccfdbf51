"""How motions begin in a mode: at pressure zero, on guards, behind guards, at once, and where impacts accumulate."""

import math
import os
import signal
import threading

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from messages import message

import nsmaps
from nsmaps import Guard, HybridSystem, Outcome, PoincareSection
from nsmaps.errors import SystemDefinitionError


class Plate(HybridSystem):
    """x'' = -sin(t + p) above a plate at x = 0 that takes all speed; the section is where the body passes x = h."""

    p: float = 0.0
    h: float = 1.0
    r: float = 0.0

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -sp.sin(t + self.p)}}

    def guards(self, t, y):
        return {"B": Guard("flight", y.x, reset={"v": -self.r * y.v}, rests="plate"), "h": Guard("flight", self.h - y.x)}

    def section(self, t, y):
        return PoincareSection("h", ("v", "phi"))


class FromRest(HybridSystem):
    """A ball under gravity above a floor at x = 1, dropped from x, without a forcing."""

    states = ("x", "v")

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -10}}

    def guards(self, t, y):
        return {"B": Guard("flight", y.x - 1, reset={"v": -y.v / 2}), "A": Guard("flight", y.v)}

    def section(self, t, y):
        return PoincareSection("A", ("x",))


def test_a_ball_at_rest_falls_from_any_height():
    heights = 2.0 ** -np.arange(10, 45, 3)  # down to 3e-14, which rounding over a step of the horizon exceeds
    found = FromRest().first_return(1 + heights[:, None])
    assert found.words.tolist() == ["ABA"] * len(heights)
    assert found.image[:, 0] - 1 == pytest.approx(heights / 4, rel=1e-9, abs=1e-15)
    assert found.time == pytest.approx(1.5 * np.sqrt(heights / 5), rel=1e-9)


@pytest.mark.parametrize("off", [0.0, 1e-9, -1e-9, 1e-4])
def test_contact_that_begins_at_pressure_zero_lasts_until_the_pressure_ends(off):
    """The body comes to the plate near phase 0, is pressed until pi, and lifts off as x = sin t + t - pi."""
    start = [[2 - np.sin(1.0) + off, np.cos(1.0) - 2, -1.0]]  # x = sin t - 2 t, v = cos t - 2 meet the plate at t = 0
    found = Plate().arrivals(start, "flight")
    with mp.workdps(30):
        end = mp.findroot(lambda t: mp.sin(t) + t - mp.pi - 1, 4.5)
    assert found.outcome.tolist() == [Outcome.returned]
    assert found.words[0] in ("B_h", "BB_h")  # a force away from the plate may lift the body for a moment before
    assert found.image[0] == pytest.approx([float(mp.cos(end) + 1), float(end)], rel=1e-13)


class Still(Plate):
    """The same without a force, whose contact has no pressure at all."""

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": 0}}


def test_contact_without_pressure_lasts():
    found = Still().arrivals([[1.0, -1.0, 0.0]], "flight")
    assert found.outcome.tolist() == [Outcome.rests]


class Pressed(HybridSystem):
    """A block held on a plate by hand: the force of the plate is f(t) - f(t) + lift, zero by cancellation until a clock."""

    states = ("x", "v", "c")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        force = sp.cos(t) / 3
        return {"held": {"x": 0, "v": 0, "c": 1}, "free": {"x": y.v, "v": force, "c": 1}}

    def guards(self, t, y):
        force = (1 + y.c) * sp.Rational(1, 3) - sp.Rational(1, 3) - y.c * sp.Rational(1, 3) + (y.x + y.v) / 7
        return {
            "N": Guard("held", force, to="free"),
            "T": Guard("held", 2 - y.c, to="free", reset={"c": 0}),
            "B": Guard("free", y.x, to="held", reset={"x": 0, "v": 0}),
            "U": Guard("free", 1 - y.c),
        }

    def section(self, t, y):
        return PoincareSection("U", ("x", "v", "phi"))


def test_a_force_that_is_zero_by_cancellation_is_no_event():
    """A clock lets the block go at 2.5, 4.5 and 6.5: twice the force pulls it back at once, then it rises."""
    found = Pressed().arrivals([[0.0, 0.0, 0.5, 1.0]], "held")
    assert found.outcome.tolist() == [Outcome.returned]
    assert found.words.tolist() == ["TBTBTU"]
    assert found.time[0] == pytest.approx(6.5, rel=1e-15)
    place = (np.cos(6.5) - np.cos(7.5) - np.sin(6.5)) / 3
    assert found.image[0] == pytest.approx([place, (np.sin(7.5) - np.sin(6.5)) / 3, 7.5 - 2 * np.pi], rel=1e-13)


class Tank(HybridSystem):
    """A level that rises at the rate 2 until it is 1, and falls until a clock opens the inlet once a period."""

    crossed: bool = False
    low: float = 0.25

    states = ("x",)

    def period(self):
        return 1

    def modes(self, t, y):
        return {"fill": {"x": 2}, "drain": {"x": -1}}

    def guards(self, t, y):
        return {
            "H": Guard("fill", 1 - y.x, to="drain"),
            "C": Guard("drain", -sp.sin(2 * sp.pi * t), to="fill"),
            "L": Guard("fill", y.x - self.low, crossing=self.crossed, reset={"x": y.x}, to="fill" if self.crossed else "drain"),
        }

    def section(self, t, y):
        return PoincareSection("C", ("x",))


def test_a_clock_is_a_crossing():
    """The level x0 at the opening is 1 after (1 - x0)/2, and 1 - (1 - (1 - x0)/2) at the next one."""
    x = np.array([0.3, 0.5, 0.8])
    found = Tank().first_return(x[:, None], derivative=True)
    assert found.words.tolist() == ["CHC"] * 3
    assert found.image[:, 0] == pytest.approx((1 - x) / 2, abs=1e-15)
    assert found.time == pytest.approx(np.ones(3), rel=1e-15)
    assert found.derivative[:, 0, 0] == pytest.approx(-0.5, abs=1e-14)
    assert found.certified.all()


@pytest.mark.parametrize("count", [1, 40])
def test_an_invariant_that_is_negative_where_its_mode_begins_blocks_the_motion(count):
    found = Tank().first_return(np.full((count, 1), 0.125))
    assert (found.outcome == Outcome.blocked).all()
    assert not found.valid.any()
    (reason,) = Tank().reasons([[0.125]])
    assert "'L' is negative where the mode 'fill' begins, 0 after the start, at x = 0.125" in reason
    assert "crossing=True" in reason


def test_it_is_an_event_of_its_own_where_it_is_declared_as_a_crossing():
    found = Tank(crossed=True).first_return([[0.125], [0.3]])
    assert found.words.tolist() == ["CHC", "CHC"]
    assert found.image[:, 0] == pytest.approx([0.4375, 0.35], abs=1e-15)


class Relay(HybridSystem):
    """u' = a cos t - sgn(u), without a `SlidingSurface`."""

    a: float = 0.5
    met: str = "U"

    states = ("u", "x")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        force = self.a * sp.cos(t)
        return {"up": {"u": force - 1, "x": y.u}, "down": {"u": force + 1, "x": y.u}}

    def guards(self, t, y):
        return {
            "S": Guard("up", y.u, to="down"),
            "U": Guard("down", -y.u, to="up"),
            "c": Guard(("up", "down"), -sp.sin(t)),
        }

    def section(self, t, y):
        return PoincareSection(self.met, ("x", "phi") if self.met == "U" else ("u", "x"))


@pytest.mark.parametrize("count", [1, 40])
def test_sliding_that_is_not_declared_is_refused_by_name(count):
    at_surface, elsewhere = Relay(), Relay(met="c")
    for system, row in ((at_surface, [0.0, 1.0]), (elsewhere, [1.0, 1.0])):
        found = system.first_return([row] * count, derivative=count == 1)
        assert (found.outcome == Outcome.blocked).all()
        assert not found.valid.any()
        assert not found.certified.any()
        (reason,) = system.reasons([row])
        assert "'S' and 'U'" in reason or "'U' and 'S'" in reason
        assert "SlidingSurface" in reason
    with mp.workdps(30):  # u = 1 + a sin t - t is zero
        meets = mp.findroot(lambda t: 1 + mp.sin(t) / 2 - t, 1.5)
    assert elsewhere.first_return([[1.0, 1.0]]).time[0] == pytest.approx(float(meets), rel=1e-14)


class Bouncing(HybridSystem):
    """A ball above a table that moves as a sin(w t), in units of length L and time T; its place passes zero."""

    r: float = 0.6
    L: float = 1.0
    T: float = 1.0
    a: float = 0.4
    lasting: str = ""

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi * self.T

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -self.L / self.T**2}}

    def guards(self, t, y):
        table = self.a * self.L * sp.sin(t / self.T)
        speed = y.v - self.a * self.L / self.T * sp.cos(t / self.T)
        return {"B": Guard("flight", y.x - table, reset={"v": y.v - (1 + self.r) * speed}, rests=self.lasting)}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


def speeds(system, returns):
    """Speeds towards the table of the starts of returns."""
    v, phi = returns.start.T
    return system.a * system.L / system.T * np.cos(phi) - v


@pytest.mark.parametrize(("L", "T"), [(1.0, 1.0), (1e6, 1e-3), (1e-9, 1e4)])
def test_chatter_without_lasting_contact_accumulates_whatever_the_units(L, T):
    system = Bouncing(L=L, T=T)
    orbit = system.orbits([[-0.5 * L / T, 1.0]], 200)
    n = int(np.argmax(orbit.outcome == Outcome.accumulates))
    assert 30 < n < 100
    assert (orbit.outcome[:n] == Outcome.returned).all()
    assert (orbit.outcome[n:] == Outcome.accumulates).all()
    assert 1e-13 < speeds(system, orbit)[n] * T / L < 1e-11
    (reason,) = system.reasons(orbit.start[n : n + 1])
    assert "'B' in the mode 'flight' accumulate" in reason
    assert "rests=" in reason
    many = system.first_return(np.repeat(orbit.start[n - 1 : n + 1], 30, axis=0))
    assert many.outcome.tolist() == [Outcome.returned] * 30 + [Outcome.accumulates] * 30


def test_slow_impacts_are_followed():
    """After an impact at u where the table presses with a, the next comes at r u after 2 r u/a, but for terms of the square."""
    system, u, phi = Bouncing(), 1e-8, 1.0
    press = 1 - system.a * np.sin(phi)
    found = system.first_return([[system.a * np.cos(phi) - u, phi]])
    assert found.outcome.tolist() == [Outcome.returned]
    assert found.time[0] == pytest.approx(2 * 0.6 * u / press, rel=1e-6)
    after = system.a * np.cos(found.image[0, 1]) - found.image[0, 0]
    assert after == pytest.approx(0.6 * u, rel=1e-6)


def test_what_accumulates_is_no_attractor():
    rng = np.random.default_rng(1)
    rows = np.column_stack([rng.uniform(-1, 0.2, 40), rng.uniform(0, 6.28, 40)])
    basins = nsmaps.basins(Bouncing(), rows, max_returns=400)
    assert len(basins.attractors) == 0
    ended = basins.outcome[basins.label < 0]
    assert set(ended.tolist()) <= {Outcome.accumulates, Outcome.invalid}
    assert (ended == Outcome.accumulates).sum() > 15
    diagram = nsmaps.bifurcation_diagram(lambda a: Bouncing(a=a), "a", np.linspace(0.3, 0.4, 4), rows[:3], direction="down")
    assert not diagram.held.any()


class Jump(HybridSystem):
    """A ball that a force presses to a floor; at the phase q it turns, and at a clock one turn of the phase ends."""

    q: float = 2.0
    up: float = 0.5
    by_hand: bool = False

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"down": {"x": y.v, "v": -1}, "lift": {"x": y.v, "v": self.up}}

    def guards(self, t, y):
        hit = {"v": -y.v / 2}
        here, there = -sp.sin(t - self.q), sp.sin(t - self.q)
        found = {
            "D": Guard("down", y.x, reset=hit, rests="low"),
            "L": Guard("lift", y.x, reset=hit, rests="high"),
            "u": Guard("down", here, to="lift"),
            "d": Guard("lift", there, to="down"),
            "e": Guard("low", here, to="lift" if self.by_hand else "high"),
            "f": Guard("high", there, to="low"),
            "s": Guard(("down", "lift", "low", "high"), -sp.sin(t)),
        }
        return found

    def section(self, t, y):
        return PoincareSection("s", ("x", "v"))


def test_contact_ends_at_a_clock_where_the_force_turns():
    """From the clock at q to the section at 2 pi the ball rises with the force, until that turns at q + pi, and falls then."""
    system, rows = Jump(), np.array([[0.01, 0.0], [0.0, 0.02], [0.02, -0.01]])
    found, other = system.first_return(rows, derivative=True), Jump(by_hand=True).first_return(rows, derivative=True)
    rises, falls = np.pi, 2 * np.pi - 2.0 - np.pi
    v = 0.5 * rises
    x = 0.25 * rises**2 + v * falls - 0.5 * falls**2
    assert found.outcome.tolist() == [Outcome.returned] * 3
    assert found.image == pytest.approx(np.tile([x, v - falls], (3, 1)), rel=1e-14)
    assert abs(found.derivative).max() < 1e-14
    assert found.certified.all()
    assert other.image == pytest.approx(found.image, rel=1e-15)


class Pulled(Jump):
    """The same with a kick at the section, also in contact."""

    def guards(self, t, y):
        kick = Guard(("low", "down", "high", "lift"), -sp.sin(t), reset={"v": y.v + 1})
        return {**super().guards(t, y), "s": kick}


def test_a_kick_in_contact_needs_a_mode_beside_the_surface():
    with pytest.raises(SystemDefinitionError, match=message("exact.leaves-surface", guard="s", mode="low")):
        Pulled().first_return([[0.0, 0.1]])


class Stick(HybridSystem):
    """A block on a belt at rest by friction m: stick is written by hand, and the velocity is not reset where it begins."""

    m: float = 0.6

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        force = sp.cos(t)
        return {
            "right": {"x": y.v, "v": force - self.m},
            "left": {"x": y.v, "v": force + self.m},
            "stick": {"x": 0, "v": 0},
        }

    def guards(self, t, y):
        force = sp.cos(t)
        holds = [self.m - force, self.m + force]
        return {
            "S": Guard("right", y.v, to="stick", where=holds),
            "L": Guard("right", y.v, to="left"),
            "T": Guard("left", -y.v, to="stick", where=holds, letter="S"),
            "R": Guard("left", -y.v, to="right"),
            "r": Guard("stick", self.m - force, to="right"),
            "l": Guard("stick", self.m + force, to="left"),
            "c": Guard(("right", "left", "stick"), -sp.sin(t - 1)),
        }

    def section(self, t, y):
        return PoincareSection("c", ("x", "v", "phi"))


def test_stick_by_hand_is_left_where_the_force_rises():
    """From stick the block slips at the time s where cos t rises to m, with the velocity sin t - sin s - m (t - s)."""
    system = Stick()
    rows = np.column_stack([np.linspace(-1, 1, 60), np.linspace(-0.3, 0.3, 60), np.ones(60)])
    found = system.first_return(rows, derivative=True)
    assert found.outcome.tolist() == [Outcome.returned] * 60
    with mp.workdps(30):
        s = 2 * mp.pi - mp.acos(mp.mpf(0.6))
        v = mp.sin(1) - mp.sin(s) - mp.mpf(0.6) * (2 * mp.pi + 1 - s)
    assert found.image[:, 1] == pytest.approx(float(v), rel=1e-13)
    assert abs(found.derivative[:, 1, 1]).max() < 1e-13


class Alone(HybridSystem):
    """A clock that ticks for ever, and a section that is never met."""

    states = ("c", "x")

    def modes(self, t, y):
        return {"on": {"c": 1, "x": -y.x}}

    def guards(self, t, y):
        return {"T": Guard("on", 1 - y.c, reset={"c": 0}), "S": Guard("on", y.x - 1)}

    def section(self, t, y):
        return PoincareSection("S", ("c",))


@pytest.mark.parametrize("count", [400, 6000])
def test_ctrl_c_is_heard_between_returns(count):
    system, rows = Alone(), np.zeros((count, 2))
    assert system.arrivals(rows[:1]).outcome.tolist() == [Outcome.endless]
    assert system.first_return(rows[:1, :1]).outcome.tolist() == [Outcome.endless]
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)  # also behind a shell that ignores it
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            system.first_return(rows[:, :1]) if count > 1000 else system.arrivals(rows)
    finally:
        timer.join()
        signal.signal(signal.SIGINT, handler)


class Rocking(HybridSystem):
    """A wheel with spokes 2 a apart on a slope, which steps forth and back; a step leaves the share c of its speed."""

    k, a, slope, c = 9.81, 0.39, 0.08, 0.71
    states = ("th", "w")

    def modes(self, t, y):
        return {"roll": {"th": y.w, "w": self.k * y.th}}

    def guards(self, t, y):
        forth, back = self.slope + self.a - y.th, y.th + self.a - self.slope
        return {
            "F": Guard("roll", forth, reset={"th": y.th - 2 * self.a, "w": self.c * y.w}),
            "B": Guard("roll", back, reset={"th": y.th + 2 * self.a, "w": self.c * y.w}),
        }

    def section(self, t, y):
        return PoincareSection("F", ("w",))


def test_steps_forth_and_back_accumulate():
    """A step at speed w from the angle th, which it comes back to, takes 2/sqrt(k) atanh(w/(sqrt(k) |th|))."""
    wheel, w, times = Rocking(), 0.9, []
    orbit = wheel.orbits([[w]], 100)
    n = int(np.argmax(orbit.outcome == Outcome.accumulates))
    assert 30 < n < 50
    assert (orbit.outcome[:n] == Outcome.returned).all()
    assert "'F' in the mode 'roll' accumulate" in wheel.reasons(orbit.start[n : n + 1])[0]
    rate = math.sqrt(wheel.k)
    for _ in range(n):
        for angle in (wheel.a - wheel.slope, wheel.a + wheel.slope):
            w *= wheel.c
            times.append(2 / rate * math.atanh(w / (rate * angle)))
    assert orbit.image[n - 1, 0] == pytest.approx(w, rel=1e-9)
    assert orbit.time[:n].sum() == pytest.approx(sum(times), rel=1e-13)
    many = wheel.first_return(np.repeat(orbit.start[n - 1 : n + 1], 30, axis=0))
    assert many.outcome.tolist() == [Outcome.returned] * 30 + [Outcome.accumulates] * 30
    assert len(nsmaps.basins(wheel, np.linspace(0.1, 1.2, 20)[:, None], max_returns=200).attractors) == 0


class RockingAfter(Rocking):
    """The same wheel, seen after each step forth."""

    def section(self, t, y):
        return PoincareSection("F", ("w",), side="after")


class RockingAtBoth(Rocking):
    """The same wheel, seen at each step."""

    def section(self, t, y):
        return PoincareSection(("F", "B"), ("th", "w"))


@pytest.mark.parametrize("wheel", [RockingAfter(), RockingAtBoth()])
def test_steps_accumulate_on_either_side_of_events_and_at_several(wheel):
    """As above: the speeds and times of all returns until then."""
    after = isinstance(wheel, RockingAfter)
    w, rate, low, high = 0.9, math.sqrt(wheel.k), wheel.a - wheel.slope, wheel.a + wheel.slope
    orbit = wheel.orbits([[w] if after else [high, w]], 100)
    n = int(np.argmax(orbit.outcome == Outcome.accumulates))
    assert (orbit.outcome[:n] == Outcome.returned).all()
    assert (orbit.outcome[n:] == Outcome.accumulates).all()
    steps, times, speeds = (2 * n, [], []) if after else (n, [], [])
    for step in range(steps):
        w *= 1.0 if after else wheel.c
        times.append(2 / rate * math.atanh(w / (rate * (high if step % 2 else low))))
        w *= wheel.c if after else 1.0
        speeds.append(w)
    assert np.abs(orbit.image[:n, -1]) == pytest.approx(speeds[1::2] if after else speeds, rel=1e-9)
    assert orbit.time[:n].sum() == pytest.approx(sum(times), rel=1e-13)
    assert times[-1] < 4e-12
    many = wheel.first_return(np.repeat(orbit.start[n - 1 : n + 1], 30, axis=0))
    assert many.outcome.tolist() == [Outcome.returned] * 30 + [Outcome.accumulates] * 30


class Brakes(HybridSystem):
    """A car that passes two brakes one after the other; each halves its speed, and the second takes it back to the start."""

    gap: float = 2e-13
    states = ("x", "v")

    def modes(self, t, y):
        return {"drive": {"x": y.v, "v": 0}, "braked": {"x": y.v, "v": 0}}

    def guards(self, t, y):
        first = Guard("drive", -y.x, to="braked", reset={"v": y.v / 2})
        second = Guard("braked", self.gap - y.x, to="drive", reset={"x": -1, "v": y.v / 2})
        return {"A": first, "B": second}

    def section(self, t, y):
        return PoincareSection(("A", "B"), ("x", "v"))


def test_two_events_within_rounding_of_a_unit_of_time_do_not_accumulate():
    """From the first brake at speed 1 to the second one at 1/2 it takes 2 gap; the function of the second fell all the time."""
    found = Brakes().first_return([[0.0, 1.0]] * 40)
    assert found.outcome.tolist() == [Outcome.returned] * 40
    assert found.image[:, 1] == pytest.approx(0.5)
    assert found.time == pytest.approx(4e-13)


class Dropped(HybridSystem):
    """A ball that falls on a table, and rests on it for ever."""

    r: float = 0.6
    states = ("x", "v")

    def modes(self, t, y):
        return {"fall": {"x": y.v, "v": -2}}

    def guards(self, t, y):
        return {"B": Guard("fall", y.x, reset={"v": -self.r * y.v}, rests="table"), "T": Guard("fall", 5 - y.x)}

    def section(self, t, y):
        return PoincareSection("T", ("v",))


def test_the_time_at_which_impacts_accumulate_is_that_of_a_motion_which_rests():
    """From x above the table at rest the first impact comes at sqrt(x), and the last one (1 + r)/(1 - r) times as late."""
    arrivals = Dropped().arrivals([[2.25, 0.0]], "fall")
    assert arrivals.outcome.tolist() == [Outcome.rests]
    assert arrivals.time[0] == pytest.approx(1.5 * 1.6 / 0.4, rel=1e-8)
