"""Border collisions: piecewise-linear maps whose orbits on either side are known, and grazes of impact systems."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import sympy as sp
from boxmaps import plain_returns
from normal_form import NormalForm
from nsmaps_soft_impact import SoftImpact

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.dynamics.continuation.border import GAP, NONSMOOTH_FOLD, PERSISTENCE, WITH_DOUBLING
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.exact.returnmap import ReturnMap

CASES = {  #: trace and determinant for x < 0 and for x > 0, and what happens at mu = 0
    "persistence": ((0.5, 0.3), (-0.5, 0.3), PERSISTENCE),
    "persistence of a focus and a saddle": ((0.5, 0.9), (-1.5, -0.6), PERSISTENCE + WITH_DOUBLING),
    "fold": ((0.5, 0.3), (2.0, 0.3), NONSMOOTH_FOLD),
    "doubling": ((0.5, 0.3), (-2.0, 0.3), PERSISTENCE + WITH_DOUBLING),
    "fold and doubling": ((-2.0, 0.3), (2.0, 0.3), NONSMOOTH_FOLD + WITH_DOUBLING),
    "two saddles": ((2.0, 0.3), (3.0, 0.4), PERSISTENCE),
}


class Ticks(HybridSystem):
    """The same as a system with modes: at each tick of a clock the states jump, by the sign of x."""

    tl: float
    dl: float
    tr: float
    dr: float
    mu: float

    states = ("x", "y", "c")

    def modes(self, t, y):
        return {"run": {"x": 0, "y": 0, "c": 1}}

    def guards(self, t, y):
        def tick(tau, delta, side):
            reset = {"x": tau * y.x + y.y + self.mu, "y": -delta * y.x, "c": 0}
            return Guard("run", 1 - y.c, reset=reset, where=(side * y.x,))

        return {"L": tick(self.tl, self.dl, -1), "R": tick(self.tr, self.dr, 1)}

    def section(self, t, y):
        return PoincareSection(("L", "R"), ("x", "y"))


def maps(case, kind):
    """The map at a value of mu."""
    left, right, _ = CASES[case]
    if kind is NormalForm:
        return lambda mu: NormalForm(left, right, mu)
    return lambda mu: Ticks(tl=left[0], dl=left[1], tr=right[0], dr=right[1], mu=mu)


def fixed(side, mu):
    """The fixed point of the linear map of a side, whether or not it is on that side."""
    tau, delta = side
    x = mu / (1 - tau + delta)
    return np.array([x, -delta * x])


def two_cycle(left, right, mu):
    """Points of the cycle of period two with one on either side, if it exists."""
    a, b = NormalForm(left, right, mu).matrices()
    push = np.array([mu, 0.0])
    x = np.linalg.solve(np.eye(2) - b @ a, b @ push + push)
    other = a @ x + push
    return x[0] < 0 < other[0]


@pytest.mark.parametrize(
    ("case", "kind"),
    [
        *((case, NormalForm) for case in CASES),
        *(pytest.param(case, Ticks, marks=[] if "doubling" in case else [pytest.mark.thorough]) for case in CASES),
    ],
)
def test_a_branch_ends_at_the_border_with_what_is_known_to_happen(case, kind):
    left, right, expected = CASES[case]
    sign = 1.0 if fixed(right, 1.0)[0] > 0 else -1.0
    map_of = maps(case, kind)
    start = nsmaps.periodic_orbit(map_of(sign), fixed(right, sign))
    branch = continue_branch(map_of, "p", start, sign, (-1.0, 1.0), direction="down" if sign > 0 else "up")
    assert branch.ended == "border collision"
    (event,) = branch.of_kind("border collision")
    assert abs(event.value) < 1e-7
    assert event.border == expected
    both = fixed(left, sign)[0] < 0
    assert both == expected.startswith(NONSMOOTH_FOLD)
    doubled = two_cycle(left, right, 1.0) or two_cycle(left, right, -1.0)
    assert doubled == expected.endswith(WITH_DOUBLING)


@pytest.mark.thorough
def test_from_the_other_side_it_is_the_same():
    for case, (left, _, expected) in CASES.items():
        sign = 1.0 if fixed(left, 1.0)[0] < 0 else -1.0
        map_of = maps(case, NormalForm)
        start = nsmaps.periodic_orbit(map_of(sign), fixed(left, sign))
        branch = continue_branch(map_of, "p", start, sign, (-1.0, 1.0), direction="down" if sign > 0 else "up")
        assert branch.events[-1].border == expected


class Pair(HybridSystem):
    """The vibro-impact pair as a system with modes."""

    d: float

    states = ("x", "v")

    def period(self):
        return 2

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": sp.cos(sp.pi * t) + 0.1245 * 9.8 * float(np.sin(np.pi / 3)) / 5}}

    def guards(self, t, y):
        reset = {"v": -y.v / 2}
        return {"B": Guard("flight", self.d / 2 - y.x, reset=reset), "T": Guard("flight", self.d / 2 + y.x, reset=reset)}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


@pytest.mark.thorough
def test_saddles_of_the_pair_as_a_system_with_modes():
    """BB and BTB end on one another at d = 0.3053538150, which `test_branch.py` has in 40 digits."""
    for guess in ([0.28177, 2.91844], [0.34325, 2.87685]):
        orbit = nsmaps.periodic_orbit(Pair(d=0.35), guess)
        branch = continue_branch(lambda d: Pair(d=d), "d", orbit, 0.35, (0.1, 0.4), direction="down")
        (event,) = branch.of_kind("grazing")
        assert event.value == pytest.approx(0.3053538150428635, abs=1e-8)
        assert event.border == NONSMOOTH_FOLD


class Strobe(SoftImpact):
    """The soft impact oscillator at the phase zero of its forcing."""

    def guards(self, t, y):
        return {**super().guards(t, y), "strobe": Guard(("free", "contact"), -sp.sin(self.w * t))}

    def section(self, t, y):
        return PoincareSection("strobe", ("x", "v"))


def test_a_motion_that_begins_to_touch_an_elastic_stop_persists():
    """The free motion touches it where its amplitude a w^2/sqrt((1 - w^2)^2 + (2 xi w)^2) is e; beyond, it dips into the stop."""
    w, xi, e = 0.79, 0.05, 1.26
    touching = e * np.hypot(1 - w**2, 2 * xi * w) / w**2
    free, beyond = (Strobe(xi=xi, e=e, a=a, beta=29.0, w=w) for a in (0.9 * touching, touching * (1 + 1e-4)))
    start = nsmaps.periodic_orbit(free, nsmaps.orbit(free, [0.0, 0.9], 300).final)
    branch = continue_branch(free, "a", start, free.a, (0.5 * touching, 1.5 * touching))
    (event,) = branch.of_kind("grazing")
    assert event.value == pytest.approx(touching, rel=1e-9)
    assert event.border == PERSISTENCE
    after = nsmaps.periodic_orbit(beyond, event.orbit.states)
    assert (after.converged, after.words) == (True, ("sCFs",))


@dataclass(frozen=True)
class Switching(ReturnMap):
    """A ball above a table, in its frame: weight 1 - k for the time `part` of a period of 2, then 1 + k; impact to impact.

    Words have two letters: B for an impact in the light part, T for one in the heavy part.
    """

    k: float
    e: float
    part: float
    coordinates = ("v", nsmaps.Angle("phi"))

    def first_return(self, states, derivative=False):
        rows = [self.follow(*row) for row in np.asarray(states, float)]
        image, slopes, codes = (np.array([row[i] for row in rows]) for i in range(3))
        found = plain_returns(self.coordinates, np.asarray(states, float), image, slopes if derivative else None)
        found.codes[:] = codes
        return replace(found, walls=("B", "T"), time=np.full(len(rows), 2.0))

    def follow(self, v, phi):
        """Speed and phase of the next impact, their derivatives, and the code of the word."""
        start = now = phi / np.pi % 2
        light, z, w = now < self.part, 0.0, self.e * v
        first, weight = light, 1 - self.k if light else 1 + self.k
        before = weight
        while True:
            length = (self.part if light else 2) - now % 2
            s = (w + np.sqrt(max(w * w + 2 * weight * z, 0))) / weight
            if s <= length:
                break
            z, w, now = z + w * length - weight * length**2 / 2, w - weight * length, now + length
            light, weight = not light, 2 - weight
        now, w = now + s, w - weight * s
        there = np.array([self.e * (now - start), before * (now - start) - self.e * v]) / -w  # of the time of the impact
        speeds = -np.array([self.e, before]) + weight * there
        slopes = [[speeds[0], speeds[1] / np.pi], [there[0] * np.pi, there[1]]]
        return (-w, now * np.pi), slopes, 1 + (not first) + 5 * (1 + (not light))


@pytest.mark.parametrize(("e", "part"), [(0.6, 0.9), (0.7, 1.1)])
def test_four_pieces_meet_where_an_impact_meets_a_clock(e, part):
    """Start and end of a return are at the border at once: the impact is just before the switch or just after, for the same k.

    With the impact at the switch and the speed v: v (1 + e) = part (1 - k) + rest (1 + k), and the flight ends at its start.
    """
    rest = 2 - part
    k = (2 - 4 * e / (1 + e)) / (2 * e * (rest - part) / (1 + e) - (rest**2 / 2 - part * rest - part**2 / 2))
    speed = (2 + k * (rest - part)) / (1 + e)
    for phase, word in ((0.07, "BB"), (6.18, "TT")):
        start = nsmaps.periodic_orbit(Switching(k + 0.03, e, part), [speed, phase])
        assert start.words == (word,)
        branch = continue_branch(
            lambda k: Switching(k, e, part), "k", start, k + 0.03, (k / 2, 2 * k), direction="down", step=0.1
        )
        (event,) = branch.of_kind("border collision")
        assert event.value == pytest.approx(k, abs=1e-7)
        assert event.border == NONSMOOTH_FOLD


@dataclass(frozen=True)
class Bounces(ReturnMap):
    """A ball that loses half its speed at a floor at rest: v' = v/2, after the time v."""

    coordinates = ("v",)

    def first_return(self, states, derivative=False):
        v = np.asarray(states, float)
        found = plain_returns(self.coordinates, v, v / 2, np.full((len(v), 1, 1), 0.5) if derivative else None)
        return replace(found, time=np.abs(v[:, 0]))


def test_what_returns_at_once_is_no_orbit():
    """At speed zero the ball comes down where it started before it moves."""
    found = nsmaps.periodic_orbit(Bounces(), [0.3])
    assert found.converged
    assert not found.exists
    assert nsmaps.periodic_orbits(Bounces(), [[0.3], [0.01]]) == ()


class Jumping(ReturnMap):
    """x' = 0.3 x + mu for x < 0 and a x + mu - 0.7 beyond; the pieces have letters, or none."""

    coordinates = ("x",)

    def __init__(self, mu, a, letters=False):
        self.mu, self.a, self.letters = mu, a, letters

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        right = x > 0
        slopes = np.where(right, self.a, 0.3)[:, :, None]
        made = plain_returns(self.coordinates, x, slopes[..., 0] * x + self.mu - 0.7 * right, slopes if derivative else None)
        made.codes[:] -= 4 * self.letters * right[:, 0]  # B in place of BB
        return made


class JumpingTicks(HybridSystem):
    """The same at the ticks of a clock."""

    mu: float
    a: float

    states = ("x", "c")

    def modes(self, t, y):
        return {"run": {"x": 0, "c": 1}}

    def guards(self, t, y):
        left = Guard("run", 1 - y.c, reset={"x": 0.3 * y.x + self.mu, "c": 0}, where=(-y.x,))
        right = Guard("run", 1 - y.c, reset={"x": self.a * y.x + self.mu - 0.7, "c": 0}, where=(y.x,))
        return {"L": left, "R": right}

    def section(self, t, y):
        return PoincareSection(("L", "R"), ("x",))


@pytest.mark.parametrize("kind", ["letters", "no letters", "modes"])
def test_a_cycle_ends_where_the_map_jumps_and_the_curve_of_such_ends_is_followed(kind):
    """The cycle of a state on either side ends at x = 0: there mu (1 + a) = 0.7 on one side, and 1.3 mu = 0.21 on the other."""

    def of(mu, a):
        return JumpingTicks(mu=mu, a=a) if kind == "modes" else Jumping(mu, a, kind == "letters")

    start = nsmaps.periodic_orbit(of(0.3, 0.6), [-0.2], 2)
    assert start.converged
    for way, end in (("up", 0.7 / 1.6), ("down", 0.21 / 1.3))[: 1 if kind == "modes" else 2]:
        branch = continue_branch(lambda mu: of(mu, 0.6), "mu", start, 0.3, (0, 1), direction=way)
        (event,) = branch.of_kind("border collision")
        assert event.value == pytest.approx(end, abs=2e-8)
        assert event.border == GAP
        curve = nsmaps.bifurcation_curve(of, event, {"a": (0, 1), "b": (0.5, 0.7)}, 0.6, step=0.5)
        mu, a = curve.parameters.T
        assert np.ptp(a) > 0.19
        assert np.abs(mu - (0.7 / (1 + a) if way == "up" else 0.21 / 1.3)).max() < 1e-12


class Switched(HybridSystem):
    """y' = 2 - y on, -(y + 3/10) off: on below 1, off above `high`."""

    high: float

    states = ("y",)

    def modes(self, t, y):
        return {"on": {"y": 2 - y.y}, "off": {"y": -(y.y + sp.Rational(3, 10))}}

    def guards(self, t, y):
        return {"F": Guard("on", self.high - y.y, to="off"), "N": Guard("off", y.y - 1, to="on")}

    def section(self, t, y):
        return PoincareSection("N", ("y",))


class Clocked(Switched):
    """The same, on at a clock q."""

    states = ("y", "q")

    def modes(self, t, y):
        return {mode: {**rates, "q": 1} for mode, rates in super().modes(t, y).items()}

    def guards(self, t, y):
        return {**super().guards(t, y), "N": Guard("off", 1 - y.q, to="on", reset={"q": 0})}


def test_a_branch_ends_where_thresholds_meet_or_nothing_is_on():
    """Two thresholds that become one, at 1; an input that is on for no time, where y is at rest at -3/10."""
    for kind, start, value, detail in (
        (Switched, 1.0, 1.0, "the time of the orbit falls to zero"),
        (Clocked, 0.4, -0.3, "beyond it there is no image: N blocked"),
    ):
        orbit = nsmaps.periodic_orbit(kind(high=1.4), [start])
        branch = nsmaps.continue_branch(
            lambda high, kind=kind: kind(high=high), "high", orbit, 1.4, (-1.0, 1.5), direction="down", step=0.2
        )
        event = branch.events[-1]
        assert (branch.ended, event.kind, event.border, event.detail) == ("border collision", "border collision", "", detail)
        assert abs(event.value - value) < event.precision < 1e-7


def test_a_contact_that_is_lost_is_a_graze_after_which_its_section_has_no_orbit():
    """At the same amplitude, from above: the motion that touches no more never meets the section where contact begins."""
    w, xi, e = 0.79, 0.05, 1.26
    touching = e * np.hypot(1 - w**2, 2 * xi * w) / w**2
    system = SoftImpact(xi=xi, e=e, a=1.0013 * touching, beta=29.0, w=w)
    start = nsmaps.periodic_orbit(system, [0.0386, 1.74])
    assert start.label == "1:1/T"  # beside it a cycle of two periods has the same word
    branch = continue_branch(system, "a", start, system.a, (0.5 * touching, 1.5 * touching), direction="down")
    (event,) = branch.of_kind("grazing")
    assert event.value == pytest.approx(touching, rel=1e-12)
    assert event.border == ""


class Stop(HybridSystem):
    """A forced oscillator that is stiffer above x = place, seen where it rises through x = 0."""

    place: float

    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        force = sp.cos(t) - y.x - y.v / 2
        return {"soft": {"x": y.v, "v": force}, "stiff": {"x": y.v, "v": force - 3 * (y.x - self.place)}}

    def guards(self, t, y):
        up, down = Guard("soft", self.place - y.x, to="stiff"), Guard("stiff", y.x - self.place, to="soft")
        return {"U": up, "D": down, "S": Guard(("soft", "stiff"), -y.x)}

    def section(self, t, y):
        return PoincareSection("S", ("v", "phi"))


@pytest.mark.parametrize(("value", "way", "word"), [(0.2, "down", "SUDS"), (-0.2, "up", "SDUS")])
def test_a_threshold_that_passes_the_section_is_a_border_of_all_states_at_once(value, way, word):
    """At place = 0 the threshold is the section: states at one value of the parameter all have the same words."""
    system = Stop(place=value)
    start = nsmaps.periodic_orbit(system, nsmaps.orbit(system, [1.0, 0.5], 60).final)
    assert start.words == (word,)
    branch = continue_branch(lambda place: Stop(place=place), "place", start, value, (-0.3, 0.3), direction=way, step=0.1)
    (event,) = branch.events
    assert (event.kind, event.detail, event.border) == ("border collision", "the words change", PERSISTENCE)
    assert abs(event.value) <= event.precision < 1e-8


class Struck(HybridSystem):
    """x'' + x/10 + x = cos(8 t/5 + ahead) before a wall at 1/2, at each period of a strobe or at each impact."""

    ahead: float
    strobed: bool = True
    states = ("x", "v")

    def period(self):
        return 2 * sp.pi / sp.Rational(8, 5)

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": sp.cos(1.6 * t + self.ahead) - y.x - 0.1 * y.v}}

    def guards(self, t, y):
        impact = {"B": Guard("flight", 0.5 - y.x, reset={"v": -0.7 * y.v})}
        return impact | ({"s": Guard("flight", -sp.sin(1.6 * t))} if self.strobed else {})

    def section(self, t, y):
        return PoincareSection("s", ("x", "v")) if self.strobed else PoincareSection("B", ("v", "phi"))


def test_an_impact_that_passes_the_instant_of_a_strobe_does_not_end_the_motion():
    """The strobe is at the impact where the forcing is ahead by its phase at impacts, of which the section at these knows."""
    impact = nsmaps.orbit(Struck(ahead=0.0, strobed=False), [2.0, 0.0], 300).final[1]
    start = nsmaps.periodic_orbit(Struck(ahead=0.0), nsmaps.orbit(Struck(ahead=0.0), [0.0, 0.0], 300).final)
    for direction, expected in (("up", impact), ("down", impact - 2 * np.pi)):
        branch = continue_branch(lambda ahead: Struck(ahead=ahead), "ahead", start, 0.0, (-6.5, 6.5), direction=direction)
        (event,) = branch.of_kind("border collision")
        assert event.value == pytest.approx(expected, abs=event.precision)
        assert event.border == PERSISTENCE
        assert event.detail.startswith("an event passes the instant of the section")
