"""Sections at which nothing changes: at v = 0, at a phase of the forcing, on half of a plane, beside impacts."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hybrid import reference
from messages import message
from nsmaps_soft_impact import SoftImpact
from scipy.integrate import solve_ivp

import nsmaps
from nsmaps import Guard, HybridSystem, Outcome, PoincareSection
from nsmaps.errors import SystemDefinitionError

SOFT = {"xi": 0.05, "e": 0.3, "a": 0.7, "beta": 29.0}


class Strobe(SoftImpact):
    """Once a period, free or in contact."""

    def guards(self, t, y):
        return {**super().guards(t, y), "strobe": Guard(("free", "contact"), -sp.sin(self.w * t))}

    def section(self, t, y):
        return PoincareSection("strobe", ("x", "v"))


class Lowest(SoftImpact):
    """Where the displacement is least."""

    def guards(self, t, y):
        return {**super().guards(t, y), "lowest": Guard("free", -y.v)}

    def section(self, t, y):
        return PoincareSection("lowest", ("x", "phi"))


class Rising(SoftImpact):
    """Where the mass passes x = -1/2 upwards."""

    def guards(self, t, y):
        return {**super().guards(t, y), "up": Guard("free", -sp.Rational(1, 2) - y.x, where=self.conditions(y))}

    def conditions(self, y):
        return ()

    def section(self, t, y):
        return PoincareSection("up", ("v", "phi"))


class Slowly(Rising):
    """The same at speeds up to 1."""

    def conditions(self, y):
        return [1 - y.v]


def test_once_a_period_it_is_the_flow_of_an_integrator():
    w = 0.79
    system = Strobe(w=w, **SOFT)
    rng = np.random.default_rng(4)
    starts = rng.uniform(-2, 2, (20, 2))
    returns = system.first_return(starts, derivative=True)
    assert returns.valid.all()
    assert np.abs(returns.time - 2 * np.pi / w).max() < 1e-13

    def rates(t, z):
        force = SOFT["a"] * w**2 * np.sin(w * t) - 2 * SOFT["xi"] * z[1] - z[0]
        return [z[1], force - SOFT["beta"] * max(z[0] - SOFT["e"], 0)]

    contacts = 0
    for start, image, word in zip(starts, returns.image, returns.words, strict=True):
        found = solve_ivp(rates, (0, 2 * np.pi / w), start, rtol=1e-11, atol=1e-13, max_step=0.02)
        inside = found.y[0] > SOFT["e"]
        assert np.abs(found.y[:, -1] - image).max() < 1e-6
        assert word.count("C") == np.sum(~inside[:-1] & inside[1:])
        assert word[0] == word[-1] == "s"
        contacts += word.count("C")
    assert contacts > 20
    assert np.allclose(np.linalg.det(returns.derivative), np.exp(-2 * SOFT["xi"] * 2 * np.pi / w), rtol=1e-10)  # Liouville


def test_multipliers_do_not_depend_on_the_section():
    """One orbit of period one: where contact begins, at its lowest place, and once a period."""
    spectra = []
    for cls, start in ((SoftImpact, [0.5, 2.0]), (Strobe, [0.1, 0.1]), (Lowest, [-0.5, 3.0])):
        system = cls(w=1.2, **SOFT)
        orbit = nsmaps.periodic_orbit(system, nsmaps.orbit(system, start, 1000).final)
        assert orbit.returns.time[0] == pytest.approx(2 * np.pi / 1.2, rel=1e-12)
        spectra.append(np.sort_complex(orbit.multipliers))
    assert np.abs(np.diff(spectra, axis=0)).max() < 1e-12


def test_a_condition_leaves_half_of_a_plane():
    """Its first return is the first of the returns to the whole plane at which the condition holds."""
    rng = np.random.default_rng(6)
    starts = np.column_stack([rng.uniform(0.05, 0.95, 40), rng.uniform(0, 6.28, 40)])
    slow, every = (cls(w=1.0, **SOFT) for cls in (Slowly, Rising))
    returns, compared = slow.first_return(starts), 0
    for start, image, word, valid in zip(starts, returns.image, returns.words, returns.valid, strict=True):
        orbit = every.orbits([start], 30)
        met = np.flatnonzero(orbit.image[:, 0] <= 1)
        if len(met):
            assert valid
            assert np.abs(orbit.image[met[0]] - image).max() < 1e-9
            assert word.count("u") == 2
            compared += met[0] > 0
    assert compared > 5


def test_the_first_contact_of_a_motion_without_any():
    """a w^2 = e sqrt((1 - w^2)^2 + (2 xi w)^2): there the forced motion touches the stop."""
    (event,) = [each for each in reference("S2_bilinear")["bifurcations"] if "grazing" in each["kind"]]
    others, value = {k: float(x) for k, x in event["other_parameters"].items()}, float(event["value"])

    def at(w):
        return Strobe(w=w, **others)

    orbit = nsmaps.periodic_orbit(at(0.79), [0.0, 0.9])
    branch = nsmaps.continue_branch(at, "p", orbit, 0.79, (0.78, 0.82))
    (found,) = branch.events
    assert (found.kind, found.detail) == ("grazing", "a clearance is zero")
    assert found.value == pytest.approx(value, rel=1e-12)


class Ball(HybridSystem):
    """A ball on a plate x = A cos(t), gravity 1: a section at the height 1/2, downwards, beside impacts."""

    A: float
    r: float
    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1}}

    def guards(self, t, y):
        plate = self.A * sp.cos(t)
        return {
            "B": Guard("flight", y.x - plate, reset={"x": plate, "v": -self.r * y.v + (1 + self.r) * sp.diff(plate, t)}),
            "down": Guard("flight", y.x - sp.Rational(1, 2)),
        }

    def section(self, t, y):
        return PoincareSection("down", ("v", "phi"))


class AtPlate(Ball):
    """The same at the plate."""

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


def down_again(v, phi):
    """From the plane down to the plate and up to the plane, by parabolas and roots of 30 digits: (v, phi), number of impacts."""
    x, t = mp.mpf("0.5"), mp.mpf(phi)
    v = mp.mpf(v)
    for n in range(20):
        if v > 0 and v * v / 2 + x > 0.5:
            s = v + mp.sqrt(v * v + 2 * x - 1)
            return (v - s, (t + s) % (2 * mp.pi)), n
        gap = lambda s, x=x, v=v, t=t: x + v * s - s * s / 2 - mp.mpf(0.1) * mp.cos(t + s)  # noqa: E731
        s = next(s for s in (mp.mpf(k) / 200 for k in range(1, 2000)) if gap(s) < 0)
        s = mp.findroot(gap, (s - mp.mpf(1) / 200, s), solver="anderson")
        t, v = t + s, v - s
        x, v = mp.mpf(0.1) * mp.cos(t), -mp.mpf(0.9) * v - mp.mpf(1.9) * mp.mpf(0.1) * mp.sin(t)
    raise AssertionError("not up to the plane in 20 impacts")


def test_beside_impacts():
    starts = [[-1.0, 1.0], [-1.4, 4.0], [-0.9, 5.5], [-0.6, 2.5]]
    returns = Ball(A=0.1, r=0.9).first_return(starts)
    with mp.workdps(30):
        for (v, phi), image, word in zip(starts, returns.image, returns.words, strict=True):
            wanted, impacts = down_again(v, phi)
            assert word == "d" + "B" * impacts + "d"
            assert np.abs(image - np.array([float(each) for each in wanted])).max() < 1e-13


def test_at_the_plate_another_section_changes_nothing():
    plain = type("Plain", (AtPlate,), {"guards": lambda self, t, y: {"B": Ball.guards(self, t, y)["B"]}})
    starts = [[-0.6, 0.3], [-1.5, 2.0]]
    crossed, returns = (cls(A=0.1, r=0.9).first_return(starts) for cls in (AtPlate, plain))
    assert np.abs(crossed.image - returns.image).max() < 1e-14
    assert crossed.words.tolist() == ["BB", "BdB"]


def test_a_start_belongs_to_the_mode_whose_guards_it_obeys():
    """Once a period, in contact: x beyond the stop."""
    system = Strobe(w=0.79, **SOFT)
    free, contact = system.first_return([[SOFT["e"] - 0.1, 0.0], [SOFT["e"] + 0.1, 0.0]]).words
    assert free[:2] == "sC"
    assert contact[:2] == "sF"


def test_too_many_crossings_are_refused():
    class Many(Strobe):
        def guards(self, t, y):
            return {**super().guards(t, y), **{f"p{k}": Guard("free", y.x + k) for k in range(1, 7)}}

    with pytest.raises(SystemDefinitionError, match=message("exact.too-many-parts", number=130)):
        Many(w=0.79, **SOFT).first_return([[0.0, 0.0]])


def test_several_planes_in_one_mode():
    class Ladder(Strobe):
        def guards(self, t, y):
            return {**super().guards(t, y), "p": Guard("free", y.x), "q": Guard("free", y.x + sp.Rational(1, 2))}

    rng = np.random.default_rng(5)
    starts = rng.uniform(-2, 2, (50, 2))
    with_planes, without = (cls(w=0.79, **SOFT).first_return(starts) for cls in (Ladder, Strobe))
    assert np.abs(with_planes.image - without.image).max() < 1e-12
    for word, plain in zip(with_planes.words, without.words, strict=True):
        assert word.replace("p", "").replace("q", "") == plain
        assert "qq" not in word.replace("p", "") or "C" not in word
    assert any("pq" in word for word in with_planes.words)


class Jerk(HybridSystem):
    """A place whose third derivative is 1, with a section where its velocity falls through zero, or at a wall far ahead."""

    wall: bool

    states = ("x", "v", "a")
    horizon = 50.0

    def modes(self, t, y):
        return {"free": {"x": y.v, "v": y.a, "a": 1}}

    def guards(self, t, y):
        return {"turn": Guard("free", y.v), "E": Guard("free", 20 - y.x)}

    def section(self, t, y):
        return PoincareSection("E", ("v", "a")) if self.wall else PoincareSection("turn", ("x", "a"))


@pytest.mark.parametrize("wall", [False, True])
def test_a_section_at_rest_that_is_grazed_exactly_is_undecided(wall):
    """From v = 1/2 + d, a = -1 the velocity falls to d and rises again."""
    gaps = np.array([0.0, 1e-17, -1e-16, 2e-16, 1e-12, -1e-12, 1e-8, -1e-8])
    states = np.column_stack([np.zeros(8), 0.5 + gaps, -np.ones(8)])
    found = Jerk(wall=wall).arrivals(states)
    far = Outcome.returned if wall else Outcome.escaped
    assert found.outcome.tolist() == [*[Outcome.undecided] * 4, far, Outcome.returned, far, Outcome.returned]
    words = ["E", "tE", "E", "tE"] if wall else ["E", "t", "E", "t"]
    assert found.words[4:].tolist() == words
