"""Integrated flights through steep and narrow forces: against energy and quadrature in 30 digits, and what is not followed."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from pydantic import Field

import nsmaps
from nsmaps import ImpactSystem, Wall
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.trajectory import track

pytest.importorskip("heyoka")

PLACE = 0.15


class Floor(ImpactSystem):
    """A ball over a floor, in gravity and in a force whose steep part has the width `eps`."""

    eps: float = Field(0.01, description="width")
    r: float = Field(0.8, description="restitution")

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi


class Well(Floor):
    def acceleration(self, t, place, velocity):
        x = (place - PLACE) / self.eps
        return -1 - x * sp.exp(-(x**2))


class Step(Floor):
    def acceleration(self, t, place, velocity):
        return -1 - 1 / (1 + sp.exp((PLACE - place) / self.eps))


class Spring(Floor):
    """A one-sided spring from a place on, whose kink is smoothed."""

    def acceleration(self, t, place, velocity):
        x = place - PLACE
        return -1 - 3 * (x + sp.sqrt(x**2 + self.eps**2))


POTENTIALS = {
    Well: lambda x, e: x - e * mp.exp(-(((x - PLACE) / e) ** 2)) / 2,
    Step: lambda x, e: x + e * mp.log1p(mp.exp((x - PLACE) / e)),
    Spring: lambda x, e: (
        x + 3 * ((x - PLACE) ** 2 / 2 + ((x - PLACE) * mp.hypot(x - PLACE, e) + e**2 * mp.asinh((x - PLACE) / e)) / 2)
    ),
}


def time_of_flight(system, speed):
    """From the energy, by quadrature to the turning point, with the square of the way left to it as the variable."""
    with mp.workdps(25):
        eps = mp.mpf(system.eps)
        left = lambda x: speed**2 - 2 * (POTENTIALS[type(system)](x, eps) - POTENTIALS[type(system)](mp.mpf(0), eps))  # noqa: E731
        top = mp.findroot(left, (mp.mpf("0.05"), speed**2 / 2), solver="anderson")
        near = [top - PLACE - k * eps for k in (-32, -16, -8, -4, -2, -1, 0, 1, 2, 4, 8, 16, 32)]
        places = [mp.mpf(0), *sorted(mp.sqrt(d) for d in near if 0 < d < top), mp.sqrt(top)]
        return 2 * mp.quad(lambda s: 2 * s / mp.sqrt(left(top - s * s)), places, method="gauss-legendre")


@pytest.mark.parametrize(
    ("system", "eps"), [(Well, 1e-1), (Well, 1e-3), (Well, 1e-6), (Step, 1e-2), (Step, 1e-3), (Spring, 1e-1), (Spring, 1e-5)]
)
def test_forces_of_the_place_keep_the_energy_and_take_the_time_of_the_quadrature(system, eps):
    ball = system(eps=eps)
    found = ball.first_return([[1.0, 0.3], [0.8, 5.0]])
    assert found.image[:, 0] == pytest.approx([0.8, 0.64], abs=2e-14)
    times = [float(time_of_flight(ball, mp.mpf(0.8) * mp.mpf(v))) for v in (1.0, 0.8)]
    assert found.time == pytest.approx(times, abs=1e-13)


class Friction(Floor):
    """Friction of arctan of the velocity."""

    mu: float = Field(0.3, description="friction")

    def acceleration(self, t, place, velocity):
        return -1 - self.mu * 2 / sp.pi * sp.atan(velocity / self.eps)


@pytest.mark.parametrize("eps", [1e-2, 1e-4, 1e-8])
def test_smoothed_friction_takes_the_energy_of_the_quadrature(eps):
    with mp.workdps(20):
        friction = lambda v: mp.mpf(0.3) * 2 / mp.pi * mp.atan(v / eps)  # noqa: E731
        cuts = [0, *(mp.mpf(10) ** k for k in range(-9, 0))]
        top = mp.quad(lambda v: v / (1 + friction(v)), [*cuts, 0.8])
        way = lambda w: mp.quad(lambda v: v / (1 - friction(v)), [*cuts, w])  # noqa: E731
        down = float(mp.findroot(lambda w: way(w) - top, mp.mpf("0.58")))
    ball = Friction(eps=eps)
    assert ball.first_return([[1.0, 0.0]]).image[0, 0] == pytest.approx(down, abs=1e-13)
    followed = track(ball, [1.0, 0.0], 2, n_samples=200)
    assert followed.velocity[0, -1] == pytest.approx(-down, abs=1e-13)
    rates = np.diff(followed.velocity[0]) / np.diff(followed.time[0])
    assert rates[[0, -1]] == pytest.approx([-1.3, -0.7], abs=0.01)
    lost = nsmaps.observe(ball, [1.0, 0.0], ["damping"], n_returns=1, n_batches=1).totals[0, 0]
    assert lost == pytest.approx((0.8**2 - down**2) / 2, rel=1e-11)
    limit = 0.8 * np.sqrt(0.7 / 1.3)  # of friction that is a step
    assert abs(down - limit) < 2 * eps


class Square(Floor):
    """Forced by a smoothed square wave; the ball leaves at once and lands in the same half of it."""

    def acceleration(self, t, place, velocity):
        return -1 + sp.tanh(sp.sin(t) / self.eps) / 2


def test_square_waves_are_met_where_they_change():
    """Launched late in the first half, at -1/2, the ball comes down at -3/2."""
    v, left = 0.5, 0.25
    up = v - left / 2
    height = v * left - left**2 / 4
    down = np.sqrt(up**2 + 3 * height)
    found = Square(eps=1e-9).first_return([[v / 0.8, np.pi - left]])
    assert found.image[0, 0] == pytest.approx(down, abs=1e-8)
    assert found.time[0] == pytest.approx(left + (up + down) / 1.5, abs=1e-8)


class Pulsed(Floor):
    """A ball that a floor lets go for a short pulse once in a turn."""

    def acceleration(self, t, place, velocity):
        return -1 + 2 * sp.exp((sp.cos(t - 1) - 1) / self.eps**2)


@pytest.mark.parametrize("width", [0.2, 0.1, 0.02, 0.001])
def test_pulses_of_the_force_are_seen_by_a_ball_at_rest(width):
    away = np.arccos(1 - width**2 * np.log(2))
    found = Pulsed(eps=width).first_return([[0.0, 1.0 + 1.5 * away]])
    assert found.words[0] == "B_"
    assert found.lifted[0, 1] == pytest.approx(2 * np.pi + 1 - away, abs=1e-9)


class Drag(Floor):
    """Drag by the square of the speed, whose sign changes where the ball turns."""

    def acceleration(self, t, place, velocity):
        return -1 - self.eps * velocity * sp.Abs(velocity)


def test_a_kink_of_the_force_divides_the_flight():
    """The speed u becomes u/sqrt(1 + k u^2), in closed form, after the time arctan(su)/s + artanh(sw)/s with s^2 = k."""
    k, speeds = 0.3, np.linspace(0.05, 4, 9)
    found, u = Drag(eps=k).first_return(np.column_stack([speeds, speeds]), derivative=True), 0.8 * speeds
    assert found.words.tolist() == ["BB"] * 9
    down, s = u / np.sqrt(1 + k * u**2), np.sqrt(k)
    assert found.image[:, 0] == pytest.approx(down, rel=1e-14)
    assert found.time == pytest.approx(np.arctan(s * u) / s + np.arctanh(s * down) / s, rel=1e-14)
    assert found.derivative[:, 0, 0] == pytest.approx(0.8 / (1 + k * u**2) ** 1.5, rel=1e-13)


class Root(Floor):
    def acceleration(self, t, place, velocity):
        return -1 + sp.sqrt(PLACE - place) / 2


class Held(Floor):
    """Smoothed friction that is larger than the weight holds the ball in its flight."""

    def acceleration(self, t, place, velocity):
        return -1 - 2 * sp.tanh(velocity / self.eps)


@pytest.mark.parametrize(
    ("ball", "reason"),
    [
        (Friction(eps=1e-18), "is so steep that no Taylor series"),
        (Root(), "or has no value"),
        (Held(eps=1e-6), "more than 100,000 steps"),
    ],
)
def test_what_is_not_followed_is_undecided_with_a_reason(ball, reason):
    found = ball.first_return([[1.0, 0.3]])
    assert found.outcome[0] == Outcome.undecided
    assert np.isnan(found.image).all()
    assert reason in ball.reasons([[1.0, 0.3]])[0]


class Fading(Floor):
    """A linear spring about a place above the floor, and impacts that leave the square of their speed: nearly a graze."""

    def rebound(self, speed, wall):
        return speed**2 / 2

    def acceleration(self, t, place, velocity):
        return 1 - place + 1e-40 * place**3  # not affine


def test_a_speed_beside_a_graze_is_right_to_3e_5_or_undecided():
    """Without damping the ball comes back at the speed with which it left."""
    speeds = 10 ** np.linspace(0, -4, 30)
    found = Fading().first_return(np.column_stack([speeds, 0 * speeds]))
    returned = found.outcome == Outcome.returned
    assert found.image[returned, 0] == pytest.approx(speeds[returned] ** 2 / 2, rel=3e-5)
    assert 10 < returned.sum() < 30
    slow = int(np.argmin(returned))
    assert "graze" in Fading().reasons([[speeds[slow], 0.0]])[0]
