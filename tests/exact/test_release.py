"""When a ball at rest is released: where the acceleration of a ball held at the wall changes sign, whatever it depends on."""

from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from pydantic import Field

from nsmaps import ImpactSystem, Wall, load_system
from nsmaps.dynamics.noise.orbits import Noise, noisy_orbits
from nsmaps.exact.outcome import Outcome


class Spring(ImpactSystem):
    """x'' = k^2 x + cos t + b cos 2t between two walls: an unstable spring under two harmonics."""

    k: float = Field(0.8, gt=0)
    b: float = 0.0
    r: float = Field(0.5, ge=0, le=1)
    horizon = 3.0

    def walls(self) -> dict[str, Wall]:
        return {"R": Wall(at=0.3, side=1), "L": Wall(at=-0.3, side=-1)}

    def period(self) -> sp.Expr:
        return 2 * sp.pi

    def displacement(self, t: sp.Expr, hit: SimpleNamespace) -> sp.Expr:
        s, k = t - hit.t, self.k
        first, second = -1 / (1 + k**2), -self.b / (4 + k**2)

        def steady(q: sp.Expr) -> sp.Expr:
            return first * sp.cos(q) + second * sp.cos(2 * q)

        rate = -first * sp.sin(hit.t) - 2 * second * sp.sin(2 * hit.t)
        return steady(t) + (hit.z - steady(hit.t)) * sp.cosh(k * s) + (hit.w - rate) / k * sp.sinh(k * s)


def first_lift(b: float, phase: float) -> float:
    """The first phase from here on at which the spring's force no longer presses: small steps in doubles, a root in 40 digits."""

    def press(x: Any, cos: Any = mpmath.cos, number: Any = mpmath.mpf) -> Any:
        return number("0.8") ** 2 * number("0.3") + cos(x) + number(b) * cos(2 * x)

    steps = phase + 1e-3 * np.arange(7000)
    k = int(np.argmax(press(steps, np.cos, float) <= 0))
    with mpmath.workdps(40):
        return float(mpmath.findroot(press, (steps[k - 1], steps[k]), solver="anderson", tol=1e-60) % (2 * mpmath.pi))


@pytest.mark.parametrize(("zeta", "damping"), [(0.02, "under"), (0.3, "under"), (1.0, "critical"), (1.4, "over")])
def test_release_from_a_spring(zeta: float, damping: str) -> None:
    """x'' + 2 zeta x' + x = A cos wt at rest at the wall is released where A cos phi = wall."""
    system = load_system("impact_oscillator", w=0.81, A=0.7, wall=0.3, zeta=zeta, damping=damping)
    phases = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    made = system.first_return(np.column_stack([0 * phases, phases]))
    stuck = np.cos(phases) > 0.3 / 0.7
    assert (made.outcome == np.where(stuck, Outcome.stuck, Outcome.returned)).all()
    assert set(made.words[stuck]) == {"B_"}
    np.testing.assert_allclose(made.image[stuck, 1], np.arccos(0.3 / 0.7), rtol=0, atol=4e-15)


@pytest.mark.parametrize("b", [0.0, 0.4, 0.7, 1.2, -1.5])
def test_release_from_an_unstable_spring_under_two_harmonics(b: float) -> None:
    system = Spring(b=b)
    phases = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    stuck = phases[0.8**2 * 0.3 + np.cos(phases) + b * np.cos(2 * phases) > 0]
    made = system.first_return([[0.0, phase] for phase in stuck])
    assert (made.outcome == Outcome.stuck).all()
    expected = [first_lift(b, phase) for phase in stuck]
    np.testing.assert_allclose(made.image[:, 1], expected, rtol=0, atol=1e-13)
    assert len(set(np.round(expected, 6))) == (2 if abs(b) > 1 else 1)


def test_rest_and_release_are_told_once() -> None:
    """The orbit goes on from the release in flight, and noise without strength is released there too."""
    system = load_system("impact_oscillator", w=0.81, A=0.7, wall=0.3, zeta=0.02)
    orbit = system.orbits([[0.0, 0.5]], 3)
    assert orbit.words.tolist()[0] == "B_"
    assert "B_" not in orbit.words.tolist()[1:]
    quiet = noisy_orbits(system, [0.0, 0.5], Noise(sigma=0.0, tau=1.0), n_returns=1)
    assert abs(quiet.states[1, 0, 1] - orbit.image[0, 1]) < 1e-9
