"""Returns of nonlinear systems with modes against closed forms: another choice of states, elliptic functions, parabolas."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

from nsmaps import Guard, HybridSystem, PoincareSection, SlidingSurface
from nsmaps.arrays import Floats
from nsmaps.exact.observables.formulas import plan_of
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.observables.totals import slopes_of, totals_of
from nsmaps.exact.trajectory import track

pytest.importorskip("heyoka")

CLOSE = 1e-12


class Straight(HybridSystem):
    """A forced linear oscillator before a wall at x = 1, in its own states."""

    r: float = 0.8
    k: float = 1.0
    f: float = 5.0
    omega: float = 2.1
    states = ("x", "v")

    def period(self) -> Any:
        return 2 * sp.pi / self.omega

    def force(self, t: Any, x: Any, v: Any) -> Any:
        return self.f * sp.cos(self.omega * t) - self.k * x - v / 10

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"free": {"x": y.v, "v": self.force(t, y.x, y.v)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"hit": Guard("free", 1 - y.x, reset={"v": -self.r * y.v}), "middle": Guard("free", y.x, crossing=True)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("hit", ("v", "phi"))


class Bent(Straight):
    """The same motion in states u and w, with x = u + u**3 and v = w + u**2: nonlinear rates, guards and resets."""

    states = ("u", "w")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        x, v = y.u + y.u**3, y.w + y.u**2
        rate = v / (1 + 3 * y.u**2)
        return {"free": {"u": rate, "w": self.force(t, x, v) - 2 * y.u * rate}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        x, v = y.u + y.u**3, y.w + y.u**2
        return {"hit": Guard("free", 1 - x, reset={"w": -self.r * v - y.u**2}), "middle": Guard("free", x, crossing=True)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("hit", ("w", "phi"), states={"u": PLACE})


PLACE = 0.6823278038280193  #: where u + u**3 = 1


class Cubic(HybridSystem):
    """x'' = -x**3 above a wall at x = 0."""

    r: float = 0.9
    states = ("x", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"free": {"x": y.v, "v": -(y.x**3)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"hit": Guard("free", y.x, reset={"v": -self.r * y.v})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("hit", ("v",))


class Cup(HybridSystem):
    """A ball that falls into the parabola y = a x**2 with losses along the normal."""

    r: float = 0.9
    a: float = 1.0
    states = ("x", "y", "u", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"free": {"x": y.u, "y": y.v, "u": 0, "v": -1}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        slope = 2 * self.a * y.x
        jump = (1 + self.r) * (y.v - slope * y.u) / (1 + slope**2)
        return {"hit": Guard("free", y.y - self.a * y.x**2, reset={"u": y.u + slope * jump, "v": y.v - jump})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("hit", ("x", "u", "v"), side="after", states={"y": self.a * y.x**2})


@pytest.fixture(scope="module")
def starts() -> Floats:
    """States before the impact, in the straight states, shape (40, 2)."""
    rng = np.random.default_rng(5)
    return np.column_stack([rng.uniform(0.5, 3.0, 40), rng.uniform(0.0, 2 * np.pi, 40)])


def bent(rows: Floats) -> Floats:
    """The same states in the bent ones."""
    return rows - [PLACE**2, 0.0]


def test_a_smooth_change_of_the_states_changes_nothing(starts: Floats) -> None:
    one, other = (system.first_return(rows, derivative=True) for system, rows in ((Straight(), starts), (Bent(), bent(starts))))
    assert one.valid.all()
    assert len(set(one.words)) > 1
    np.testing.assert_array_equal(other.words, one.words)
    np.testing.assert_allclose(other.image, bent(one.image), rtol=0, atol=CLOSE)
    np.testing.assert_allclose(other.time, one.time, rtol=CLOSE)
    np.testing.assert_allclose(other.derivative, one.derivative, rtol=CLOSE, atol=CLOSE)


def test_margins_are_those_in_other_states(starts: Floats) -> None:
    one, other = Straight().itineraries(starts), Bent().itineraries(bent(starts))
    assert np.isfinite(one.clearance).any()
    np.testing.assert_array_equal(other.codes, one.codes)
    np.testing.assert_allclose(other.clearance, one.clearance, rtol=CLOSE, atol=CLOSE)
    np.testing.assert_allclose(other.slowest, one.slowest, rtol=CLOSE)


def test_derivatives_by_parameters_are_those_in_other_states(starts: Floats) -> None:
    for name in ("r", "k", "f", "omega"):
        one, other = (system.sensitivity(rows, {name: 1.0}) for system, rows in ((Straight(), starts), (Bent(), bent(starts))))
        np.testing.assert_allclose(other, one, rtol=CLOSE, atol=CLOSE)


def test_flights_of_a_cubic_spring_are_elliptic_functions() -> None:
    speeds = np.array([[-1e-3], [-0.3], [-2.0], [-40.0]])
    found = Cubic().first_return(speeds, derivative=True)
    with mp.workdps(30):
        after = [mp.mpf(0.9) * -mp.mpf(v) for v in speeds[:, 0].tolist()]
        times = [2 * mp.ellipk(mp.mpf(1) / 2) / mp.root(2 * v**2, 4) for v in after]
    np.testing.assert_allclose(found.image[:, 0], [-float(v) for v in after], rtol=1e-14)
    np.testing.assert_allclose(found.time, [float(t) for t in times], rtol=1e-14)
    np.testing.assert_allclose(found.derivative[:, 0, 0], 0.9, rtol=1e-13)


def test_arrivals_and_motions_of_a_cubic_spring() -> None:
    system, height = Cubic(), 1.7
    found = system.arrivals([[height, 0.0]], derivative=True)
    assert found.image[0, 0] == pytest.approx(-(height**2) / np.sqrt(2), rel=1e-14)
    assert found.time[0] == pytest.approx(float(mp.ellipk(0.5)) / height, rel=1e-14)
    np.testing.assert_allclose(found.derivative[0, 0], [-np.sqrt(2) * height, 0.0], rtol=1e-13, atol=1e-13)
    motion = track(system, [-2.0], 3, n_samples=40)
    x, v = np.moveaxis(motion.states, -1, 0)
    energy = v**2 / 2 + x**4 / 4
    np.testing.assert_allclose(energy, np.repeat(energy[:, :1], 40, axis=1), rtol=1e-13)
    np.testing.assert_allclose(energy[:, 0], 2.0 * 0.81 ** np.arange(1, 3), rtol=1e-13)


class Lift(HybridSystem):
    """x'' = -(x - 1)**power from one maximum to the next, above a wall at x = 0."""

    power: int = 3
    states = ("x", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"free": {"x": y.v, "v": -((y.x - 1) ** self.power)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {"wall": Guard("free", y.x, reset={"v": -y.v}), "top": Guard("free", y.v, crossing=True)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("top", ("x",))


@pytest.mark.parametrize("power", [1, 3])
def test_the_least_distance_is_met_where_the_function_of_the_section_rises(power: int) -> None:
    """There the speed is zero but for rounding, on either side of the border of two parts of the mode."""
    amplitudes = np.linspace(0.1, 0.99, 60)
    found = Lift(power=power).itineraries(1 + amplitudes[:, None])
    np.testing.assert_allclose(found.clearance, 1 - amplitudes, rtol=0, atol=1e-14)
    assert (found.turns == 1).all()


def cup(x: Any, u: Any, v: Any, r: Any, a: Any) -> list[Any]:
    """The state just after the next impact in the cup, from one just after an impact."""
    time = (v - 2 * a * x * u) / (mp.mpf(1) / 2 + a * u**2)
    x, v = x + u * time, v - time
    jump = (1 + r) * (v - 2 * a * x * u) / (1 + 4 * a**2 * x**2)
    return [x, u + 2 * a * x * jump, v - jump]


def by(i: int, j: int, known: list[Any]) -> Any:
    """The derivative of a coordinate of the image in the cup by one of the numbers that give it."""
    return mp.diff(lambda x: cup(*known[:j], x, *known[j + 1 :])[i], known[j])


def test_bounces_in_a_parabola_are_formulas() -> None:
    rng, system, values = np.random.default_rng(2), Cup(r=0.85, a=0.7), (0.85, 0.7)
    rows = np.column_stack([rng.uniform(-1, 1, 25), rng.uniform(-2, 2, 25), rng.uniform(-1, 3, 25)])
    rows = rows[rows[:, 2] - 1.4 * rows[:, 0] * rows[:, 1] > 0.05]
    assert len(rows) > 10
    found = system.first_return(rows, derivative=True)
    by_place = system.sensitivity(rows, {"a": 1.0})
    for k, row in enumerate(rows.tolist()):
        with mp.workdps(30):
            known = [mp.mpf(x) for x in (*row, *values)]
            image = cup(*known)
            slopes = [[by(i, j, known) for j in (0, 1, 2, 4)] for i in range(3)]
        np.testing.assert_allclose(found.image[k], np.array(image, float), rtol=1e-13, atol=1e-13)
        np.testing.assert_allclose(found.derivative[k], np.array(slopes, float)[:, :3], rtol=CLOSE, atol=CLOSE)
        np.testing.assert_allclose(by_place[k], np.array(slopes, float)[:, 3], rtol=CLOSE, atol=CLOSE)


def test_observables_of_a_cubic_spring_are_beta_integrals() -> None:
    """Over a flight with speed v after the impact the integral of the speed's square is c v**(3/2), and that of x**2 x' zero."""
    system, starts = Cubic(), np.array([[-2.0], [-0.1]])
    plan = plan_of(system, (Observable(name="action", formula="v**2 + x**2*v", of="flights"),))
    with mp.workdps(30):
        c = float(mp.root(2, 4) * mp.beta(mp.mpf(1) / 4, mp.mpf(3) / 2) / 2)  # twice the integral of v dx, x^4 = 2 v^2 at its end
    after = -0.9 * starts[:, 0]
    totals = totals_of(system, plan, starts, 1)
    np.testing.assert_allclose(totals.totals[0, :, 0], c * after**1.5, rtol=CLOSE)
    slopes = slopes_of(system, plan, starts, np.array([1.0]))[:, 0]
    np.testing.assert_allclose(slopes, 1.5 * c * after[:, None] ** 0.5 * np.column_stack([[-0.9] * 2, -starts[:, 0]]), rtol=1e-11)
