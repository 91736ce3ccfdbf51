"""Sliding derived from two fields: closed forms in mpmath, the limit of steep smooth laws, and what is not linear."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from messages import message
from nsmaps_belt import Belt
from scipy.integrate import solve_ivp
from systems import Coulomb

from nsmaps import Guard, HybridSystem, PoincareSection, SlidingSurface
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.outcome import Outcome

VALUES = {"zeta": 0.02, "vb": 0.5, "A": 0.3, "w": 1.3}


def test_friction_without_a_static_surplus_is_the_belt() -> None:
    rng = np.random.default_rng(0)
    phi, side = rng.uniform(0, 6.28, 200), rng.choice([-1, 1], 200)
    starts = np.column_stack([side * 0.6 - 2 * 0.02 * 0.5 + 0.3 * np.cos(phi), phi])
    given = Belt(mu_k=0.6, mu_s=0.6, **VALUES).first_return(starts, derivative=True)
    derived = Coulomb(mu=0.6, **VALUES).first_return(starts, derivative=True)
    assert given.valid.sum() > 80
    assert np.array_equal(given.words, derived.words)
    np.testing.assert_allclose(derived.image, given.image, rtol=1e-13)
    np.testing.assert_allclose(derived.derivative, given.derivative, rtol=1e-11, atol=1e-13)
    assert (derived.outcome[derived.valid] == Outcome.returned).all()


class Stop(Coulomb):
    """As its base, taken where sticking begins."""

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection(("slower to stick", "faster to stick"), ("x", "phi"))


def stopped(x: Any, phi: Any, kick: Any) -> tuple[Any, Any]:
    """Place and time where the mass that slips from the belt's speed on has that speed again, by its closed form."""
    zeta, vb, A, w = (mp.mpf(VALUES[name]) for name in ("zeta", "vb", "A", "w"))
    k, stiff, drag = mp.sqrt(1 - zeta**2), 1 - w**2, 2 * zeta * w
    c, s = A * stiff / (stiff**2 + drag**2), A * drag / (stiff**2 + drag**2)

    def steady(t: Any) -> tuple[Any, Any]:
        p = phi + w * t
        return kick + c * mp.cos(p) + s * mp.sin(p), w * (s * mp.cos(p) - c * mp.sin(p))

    z, v = x - steady(0)[0], vb - steady(0)[1]

    def at(t: Any) -> tuple[Any, Any]:
        e, co, si = mp.exp(-zeta * t), mp.cos(k * t), mp.sin(k * t)
        place, velocity = steady(t)
        return place + e * (z * co + (v + zeta * z) / k * si), velocity + e * (v * co - (z + zeta * v) / k * si)

    times = [mp.mpf(j) / 200 for j in range(20, 4000)]
    before = next(t for t, u in ((t, at(t)[1]) for t in times) if (u - vb) * kick > 0)
    t = mp.findroot(lambda t: at(t)[1] - vb, (before - mp.mpf(1) / 200, before), solver="anderson", tol=1e-60)
    return at(t)[0], t


def test_stop_and_release_times_are_those_of_the_closed_form() -> None:
    derived, seen = Coulomb(mu=0.6, **VALUES), 0
    with mp.workdps(40):
        zeta, vb, A, w, mu = (mp.mpf(x) for x in (0.02, 0.5, 0.3, 1.3, 0.6))
        for phi in np.linspace(0.1, 6.2, 12):
            start = np.array([0.6 - 2 * 0.02 * 0.5 + 0.3 * np.cos(phi), phi])
            returns = derived.first_return(start[None])
            if returns.words[0] != "MKM":
                continue
            x, stop = stopped(mp.mpf(start[0]), mp.mpf(phi), mu)
            force = lambda t, x=x, stop=stop, phi=phi: (  # noqa: E731
                2 * zeta * vb + x + vb * t - A * mp.cos(mp.mpf(phi) + w * (stop + t)) - mu
            )
            times = [mp.mpf(j) / 200 for j in range(4000)]
            after = next(t for t in times if force(t) > 0)
            release = mp.findroot(force, (after - mp.mpf(1) / 200, after), solver="anderson", tol=1e-60)
            assert abs(returns.time[0] - (stop + release)) < 1e-13
            assert abs(returns.image[0, 0] - (x + vb * release)) < 1e-13
            stick = Stop(mu=0.6, **VALUES).first_return([[float(x), float((mp.mpf(phi) + w * stop) % (2 * mp.pi))]])
            assert stick.words[0] == "KMK"
            seen += 1
    assert seen >= 3


class Through(Coulomb):
    """As its base, taken where x rises through zero, in any mode."""

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {**super().guards(t, y), "0": Guard(("slower", "faster", "stick"), -y.x)}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("0", ("u", "phi"))


@pytest.mark.parametrize("load", [0.0, 0.4])
def test_sliding_is_the_limit_of_steep_friction(load: float) -> None:
    system = Through(mu=0.6, load=load, **VALUES)
    start = [0.3, 2.0]
    returns = system.first_return([start])
    assert "K" in str(returns.words[0])

    def error(steepness: float) -> float:
        def rates(t: float, y: Any) -> list[float]:
            friction = 0.6 * (1 + load * y[0]) * np.tanh((y[1] - 0.5) * steepness)
            return [y[1], 0.3 * np.cos(2.0 + 1.3 * t) - 0.04 * y[1] - y[0] - friction]

        def crossing(t: float, y: Any) -> float:
            return float(y[0])

        crossing.direction = 1  # type: ignore[attr-defined]
        found = solve_ivp(rates, (0, 15), [0.0, start[0]], method="LSODA", rtol=1e-10, atol=1e-12, events=crossing)
        return abs(min(t for t in found.t_events[0] if t > 1) - returns.time[0])

    errors = [error(steepness) for steepness in (1e3, 1e4, 1e5)]
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(10, rel=0.15)


class Relays(HybridSystem):
    """Mass x'' = -p sgn(c x + v) - q sgn(v) + A cos(w t): a relay that switches on a line, and dry friction."""

    p: float = 1.0
    q: float = 0.2
    c: float = 0.7
    A: float = 0.1
    w: float = 3.0

    states = ("x", "v")

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        signs = {"++": (1, 1), "+-": (1, -1), "-+": (-1, 1), "--": (-1, -1)}
        force = self.A * sp.cos(self.w * t)
        return {name: {"x": y.v, "v": force - a * self.p - b * self.q} for name, (a, b) in signs.items()}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        line = self.c * y.x + y.v
        return {
            "right": SlidingSurface("++", "-+", line),
            "left": SlidingSurface("+-", "--", line),
            "upper": SlidingSurface("++", "+-", y.v),
            "lower": SlidingSurface("-+", "--", y.v),
            "near": Guard("left", y.x - sp.Rational(1, 20), ends=True),
            "S": Guard("left", y.x - sp.Rational(1, 10)),
            "T": Guard("left", y.x - sp.Rational(1, 5)),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection(("T", "S"), ("x", "v", "phi"))


def test_a_surface_may_be_passed_and_passed_again_in_one_mode() -> None:
    """A section of a bilinear spring, upwards: half a turn in either half; starts lie in the mode that admits them."""

    class Spring(HybridSystem):
        """Spring of two stiffnesses, seen at x = place."""

        k: float = 4.0
        place: float = 0.0
        states = ("x", "v")

        def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
            return {"soft": {"x": y.v, "v": -y.x}, "hard": {"x": y.v, "v": -self.k * y.x}}

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return {
                "H": Guard("soft", -y.x, to="hard"),
                "S": Guard("hard", y.x, to="soft"),
                "up": Guard(("soft", "hard"), self.place - y.x),
            }

        def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
            return PoincareSection("up", ("v",))

    whole = np.pi + np.pi / 2
    for place in (-0.3, 0.4):
        returns = Spring(place=place).first_return([[1.0], [2.0]], derivative=True)
        assert list(returns.words) == (["uHSu"] * 2 if place < 0 else ["uSHu"] * 2)
        assert returns.time == pytest.approx(whole, rel=1e-14)
        assert returns.image[:, 0] == pytest.approx([1, 2], rel=1e-14)
        assert returns.derivative is not None
        assert returns.derivative[:, 0, 0] == pytest.approx(1, rel=1e-13)
    assert Spring(place=-0.3).first_return([[-1.0]]).outcome[0] == Outcome.invalid


def test_on_the_line_of_a_relay_the_motion_decays_as_the_line_has_it() -> None:
    returns = Relays().first_return([[0.2, -0.14, 1.0]])
    assert returns.outcome[0] == Outcome.returned
    assert returns.time[0] == pytest.approx(np.log(2) / 0.7, rel=1e-13)
    assert returns.image[0, :2] == pytest.approx([0.1, -0.07], rel=1e-13)


class Relay(HybridSystem):
    """z is driven to h from both sides, and u follows it; seen by a clock, mostly on the surface."""

    h: float = 0.4

    states = ("u", "z")

    def period(self) -> Any:
        return 2 * sp.pi

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {name: {"u": y.z - y.u, "z": sp.cos(t) + drive} for name, drive in {"above": -2, "below": 2}.items()}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
        return {
            "tick": Guard(("above", "below", "line"), -sp.sin(t)),
            "line": SlidingSurface("above", "below", y.z - self.h),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("tick", ("u", "z"))


@pytest.mark.parametrize("many", [1, 40])
def test_a_motion_that_starts_on_the_surface_forgets_its_distance_from_it(many: int) -> None:
    returns = Relay().first_return([[1.0, 0.4]] * many, derivative=True)
    decay = np.exp(-2 * np.pi)
    assert set(returns.words) == {"tt"}
    np.testing.assert_allclose(returns.image, [[0.4 + 0.6 * decay, 0.4]] * many, rtol=1e-14)
    assert returns.derivative is not None
    np.testing.assert_allclose(returns.derivative, [[[decay, 0], [0, 0]]] * many, atol=1e-16)
    np.testing.assert_allclose(Relay().sensitivity([[1.0, 0.4]], {"h": 1.0}), [[1 - decay, 1]], rtol=1e-14)
    beside = Relay().first_return([[1.0, 0.4 + 1e-9], [1.0, 0.3]])
    assert beside.words.tolist() == ["tlt"] * 2


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda y: {"s": SlidingSurface("++", "?", y.v)}, message("exact.sliding-modes", mode="?")),
        (lambda y: {"s": SlidingSurface("++", "+-", y.x)}, message("exact.same-rate", mode="++", other="+-")),
        (lambda y: {"++": SlidingSurface("++", "+-", y.v)}, message("exact.sliding-named-as-mode", name="++")),
        (lambda y: {"s": SlidingSurface("++", "+-", y.v, letters={"t": "T"})}, message("exact.sliding-letter", mode="t")),
    ],
)  # fmt: skip
def test_surfaces_that_are_wrong_are_refused(changed: Any, said: str) -> None:
    class Wrong(Relays):
        """Relays with one surface that cannot be."""

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard | SlidingSurface]:
            return dict(changed(y))

    with pytest.raises(SystemDefinitionError, match=said):
        Wrong().first_return([[0.2, -0.14, 1.0]])
