"""Proofs in units far from those of the numbers 1: of one ball the same is proved, and its orbits do what is claimed."""

import numpy as np
import pytest
from units import Ball

pytest.importorskip("flint")

from nsmaps.proof.prove import prove
from nsmaps.verify.certificate import Certificate, statement, verify

R = 0.5


def certificate_in(length: float, time: float) -> tuple[Certificate, float]:
    """A proof for the ball with Gamma = 1.2 and r = 1/2 in units of length and time, and that of speed."""
    unit = length / time
    ball = Ball(a=1.2 * length, w=1 / time, g=length / time**2, r=R)
    return prove(ball, [4.2 * unit, 0.5], top=6 * unit, side=128, depth=0, cycles=[([4.1 * unit, 0.5], 1)]), unit


def returned(phase: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The next impacts in the units of Gamma: the first sign change of the gap on a grid of times, bisected."""
    lift, times = R * speed + 1.2 * np.cos(phase), np.linspace(1e-3, 12, 1500)

    def gap(s: np.ndarray) -> np.ndarray:
        return lift[:, None] * s - s**2 / 2 - 1.2 * (np.sin(phase[:, None] + s) - np.sin(phase)[:, None])

    first = np.argmax(gap(times) < 0, axis=1)
    low, high = times[first - 1][:, None], times[first][:, None]
    for _ in range(50):
        middle = (low + high) / 2
        below = gap(middle) < 0
        low, high = np.where(below, low, middle), np.where(below, middle, high)
    s = high[:, 0]
    return (phase + s) % (2 * np.pi), s + 1.2 * np.cos(phase + s) - lift


@pytest.mark.parametrize(("length", "time"), [(1e6, 1e-3), (1e-12, 30.0)])
def test_the_same_is_proved(length, time):
    certificate, unit = certificate_in(length, time)
    found = verify(certificate)
    assert 6 <= certificate.grid["top"] / unit < 6.01
    assert found.shares[0] == pytest.approx(0.167, abs=1e-3)
    assert float(found.cycles[0].states[0][1]) / unit == pytest.approx(4 * np.pi / 3, rel=1e-12)
    assert "a cycle exists, the only one" in statement(found, certificate)
    side, rng = certificate.grid["side"], np.random.default_rng(0)
    whole = np.argwhere(certificate.codes[: side**2].reshape(side, side) < 65533)
    column, row = (whole[rng.integers(len(whole), size=100)] + rng.random((100, 2))).T
    phase, speed = column * (2 * np.pi / side), row * (certificate.grid["top"] / unit / side)
    for _ in range(40):
        phase, speed = returned(phase, speed)
    assert np.abs(speed - 4 * np.pi / 3).max() < 1e-9
