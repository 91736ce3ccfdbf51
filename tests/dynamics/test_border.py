"""Border collisions: piecewise-linear maps whose orbits on either side are known, and grazes of impact systems."""

import numpy as np
import pytest
import sympy as sp
from normal_form import NormalForm
from nsmaps_soft_impact import SoftImpact

import nsmaps
from nsmaps import Guard, HybridSystem, Section
from nsmaps.dynamics.continuation.border import NONSMOOTH_FOLD, PERSISTENCE, WITH_DOUBLING
from nsmaps.dynamics.continuation.follow import continue_branch

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
        return Section(("L", "R"), ("x", "y"))


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


@pytest.mark.parametrize("kind", [NormalForm, Ticks])
@pytest.mark.parametrize("case", CASES)
def test_a_branch_ends_at_the_border_with_what_is_known_to_happen(case, kind):
    left, right, expected = CASES[case]
    sign = 1.0 if fixed(right, 1.0)[0] > 0 else -1.0
    map_of = maps(case, kind)
    start = nsmaps.periodic_orbit(map_of(sign), fixed(right, sign))
    branch = continue_branch(map_of, start, sign, (-1.0, 1.0), "down" if sign > 0 else "up")
    assert branch.ended == "border collision"
    (event,) = branch.of_kind("border collision")
    assert abs(event.parameter) < 1e-7
    assert event.border == expected
    both = fixed(left, sign)[0] < 0
    assert both == expected.startswith(NONSMOOTH_FOLD)
    doubled = two_cycle(left, right, 1.0) or two_cycle(left, right, -1.0)
    assert doubled == expected.endswith(WITH_DOUBLING)


def test_from_the_other_side_it_is_the_same():
    for case, (left, _, expected) in CASES.items():
        sign = 1.0 if fixed(left, 1.0)[0] < 0 else -1.0
        map_of = maps(case, NormalForm)
        start = nsmaps.periodic_orbit(map_of(sign), fixed(left, sign))
        branch = continue_branch(map_of, start, sign, (-1.0, 1.0), "down" if sign > 0 else "up")
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
        return Section("B", ("v", "phi"))


def test_saddles_of_the_pair_as_a_system_with_modes():
    """BB and BTB end on one another at d = 0.3053538150, which `test_branch.py` has in 40 digits."""
    for guess in ([0.28177, 2.91844], [0.34325, 2.87685]):
        orbit = nsmaps.periodic_orbit(Pair(d=0.35), guess)
        branch = continue_branch(lambda d: Pair(d=d), orbit, 0.35, (0.1, 0.4), "down")
        (event,) = branch.of_kind("grazing")
        assert event.parameter == pytest.approx(0.3053538150428635, abs=1e-8)
        assert event.border == NONSMOOTH_FOLD


class Strobe(SoftImpact):
    """The soft impact oscillator at the phase zero of its forcing."""

    def guards(self, t, y):
        return {**super().guards(t, y), "strobe": Guard(("free", "contact"), -sp.sin(self.w * t))}

    def section(self, t, y):
        return Section("strobe", ("x", "v"))


def test_a_motion_that_begins_to_touch_an_elastic_stop_persists():
    """The free motion touches it where its amplitude a w^2/sqrt((1 - w^2)^2 + (2 xi w)^2) is e; beyond, it dips into the stop."""
    w, xi, e = 0.79, 0.05, 1.26
    touching = e * np.hypot(1 - w**2, 2 * xi * w) / w**2
    free, beyond = (Strobe(xi=xi, e=e, a=a, beta=29.0, w=w) for a in (0.9 * touching, touching * (1 + 1e-4)))
    start = nsmaps.periodic_orbit(free, nsmaps.orbit(free, [0.0, 0.9], 300).final)
    branch = continue_branch(lambda a: free.at(a=a), start, free.a, (0.5 * touching, 1.5 * touching))
    (event,) = branch.of_kind("grazing")
    assert event.parameter == pytest.approx(touching, rel=1e-9)
    assert event.border == PERSISTENCE
    after = nsmaps.periodic_orbit(beyond, event.orbit.states)
    assert (after.converged, after.words) == (True, ("sCFs",))
