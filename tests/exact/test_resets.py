"""Resets that are not affine: against closed forms in mpmath, and against impact systems with the same law."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hybrid import BeforeWall
from messages import message
from nsmaps_impact_oscillator import ImpactOscillator

from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.outcome import Outcome


class SpinningBall(HybridSystem):
    """Ball that falls on a table at A sin t: restitution r |u|^-p of the relative velocity u, friction that changes its spin."""

    A: float = 0.6
    r: float = 0.8
    p: float = 0.2
    mu: float = 0.3

    states = ("x", "v", "spin")

    def period(self) -> Any:
        return 2 * sp.pi

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.v, "v": -1, "spin": -y.spin / 10}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        u = y.v - self.A * sp.cos(t)
        after = self.A * sp.cos(t) + self.r * abs(u) ** (1 - self.p)
        spin = y.spin + self.mu * u * y.spin / sp.sqrt(1 + y.spin**2) * sp.sin(t)
        return {"B": Guard("flight", y.x - self.A * sp.sin(t), reset={"v": after, "spin": spin})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("B", ("v", "spin", "phi"))


def bounced(A: Any, r: Any, p: Any, mu: Any, v: Any, spin: Any, phi: Any) -> list[Any]:
    """The first return of the ball by its closed form, the phase lifted: nothing of the engine is used."""
    u = v - A * mp.cos(phi)
    v, spin = A * mp.cos(phi) + r * abs(u) ** (1 - p), spin + mu * u * spin / mp.sqrt(1 + spin**2) * mp.sin(phi)

    def gap(s: Any) -> Any:
        return A * mp.sin(phi) + v * s - s**2 / 2 - A * mp.sin(phi + s)

    times = np.arange(1, 20_000) / 1000
    start = tuple(float(x) for x in (A, v, phi))
    gaps = start[0] * np.sin(start[2]) + start[1] * times - times**2 / 2 - start[0] * np.sin(start[2] + times)
    k = int(np.argmax(gaps < 0))
    s = mp.findroot(gap, (times[max(k - 1, 0)], times[k]), solver="anderson", tol=1e-60)
    return [v - s, spin * mp.exp(-s / 10), phi + s]


STARTS = np.array([[-1.7, 0.4, 1.0], [-2.3, -1.2, 4.0], [-1.1, 2.0, 5.5], [-3.0, 0.0, 0.3]])


@pytest.mark.parametrize("start", STARTS)
def test_images_and_derivatives_by_states_and_parameters(start: Any) -> None:
    ball = SpinningBall()
    made = ball.first_return([start], derivative=True)
    values = [*ball.parameters.values(), *start]
    with mp.workdps(40):
        image = bounced(*map(mp.mpf, values))
        assert np.abs(made.lifted[0] - [float(x) for x in image]).max() < 1e-13

        def slope(k: int) -> Any:
            h = mp.mpf(10) ** -13
            up, down = (bounced(*(mp.mpf(x) + sign * h * (i == k) for i, x in enumerate(values))) for sign in (1, -1))
            return np.array([float((a - b) / (2 * h)) for a, b in zip(up, down, strict=True)])

        for k, name in enumerate(ball.parameters):
            assert made.valid[0]
            assert ball.sensitivity([start], {name: 1.0})[0] == pytest.approx(slope(k), rel=1e-11, abs=1e-12)
        for c in range(3):
            assert made.derivative[0, :, c] == pytest.approx(slope(4 + c), rel=1e-11, abs=1e-12)


class SoftSteel(ImpactOscillator):
    """An impact oscillator whose restitution falls with the speed, by a power and by cases."""

    def rebound(self, speed: Any, wall: str) -> Any:
        return self.r * speed * sp.Max(1 - speed**2 / 50, sp.Rational(1, 2)) / (1 + speed) ** sp.Rational(1, 5)


class SoftSteelByModes(BeforeWall):
    """The same as a system with modes."""

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        after = self.r * y.v * sp.Max(1 - y.v**2 / 50, sp.Rational(1, 2)) / (1 + abs(y.v)) ** sp.Rational(1, 5)
        return {"B": Guard("free", self.wall - y.x, reset={"v": -after})}


def test_restitution_by_speed_is_that_of_an_impact_system() -> None:
    values = {"zeta": 0.05, "w": 0.9, "A": 1.7, "wall": 0.5, "r": 0.9}
    wall, modes = SoftSteel(**values), SoftSteelByModes(**values)
    rng = np.random.default_rng(3)
    starts = np.column_stack([rng.uniform(0.01, 8, 300), rng.uniform(0, 6.28, 300)])
    expected, made = wall.first_return(starts, derivative=True), modes.first_return(starts, derivative=True)
    good = expected.outcome == Outcome.returned
    assert good.sum() > 290
    assert (made.outcome[good] == Outcome.returned).all()
    assert np.abs(made.lifted - expected.lifted)[good].max() < 2e-13 * np.abs(expected.derivative[good]).max()
    assert made.derivative[good] == pytest.approx(expected.derivative[good], rel=1e-9)
    by = {"r": 1.0, "wall": 0.5, "A": -0.3}
    assert modes.sensitivity(starts[good], by) == pytest.approx(wall.sensitivity(starts[good], by), rel=1e-5, abs=1e-6)


def test_a_reset_that_gives_no_number_ends_the_motion() -> None:
    class Root(SpinningBall):
        """Its restitution is a root that exists below a speed only."""

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
            return {"B": Guard("flight", y.x - self.A * sp.sin(t), reset={"v": sp.sqrt(4 - y.v**2)})}

    made = Root().first_return([[-1.0, 0.0, 1.0], [-3.0, 0.0, 1.0]])
    assert list(made.outcome) == [Outcome.returned, Outcome.escaped]
    assert np.isnan(made.image[1]).all()


def test_a_reset_that_changes_from_period_to_period_is_refused() -> None:
    class Ageing(SpinningBall):
        """Its restitution falls with the time."""

        def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
            return {"B": Guard("flight", y.x - self.A * sp.sin(t), reset={"v": self.r * abs(y.v) * sp.exp(-t)})}

    with pytest.raises(SystemDefinitionError, match=message("exact.reset-not-periodic", state="v")):
        Ageing().first_return(STARTS)
