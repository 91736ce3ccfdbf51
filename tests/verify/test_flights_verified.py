"""Impacts in balls against flights of mpmath in 60 digits, from the roots of the characteristic equation, for three systems."""

from collections.abc import Callable
from functools import partial
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from flint import arb, ctx
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_impact_oscillator import ImpactOscillator

from nsmaps.proof.formula import equation_of
from nsmaps.verify.flights import next_impact, next_impacts
from nsmaps.verify.formula import UnprovedError, system_of

SAMPLES = 200  #: places of a flight at which no wall may have been passed


def falling(force: Any, gravity: Any, w: Any, t0: Any, z0: Any, w0: Any, s: Any) -> Any:
    """z and z' where z'' = gravity + Re(force exp(i w t))."""
    wave = lambda t: -force * mp.expj(w * t) / w**2  # noqa: E731
    start, end = wave(t0), wave(t0 + s)
    drift = w0 - mp.re(1j * w * start)
    return z0 + drift * s + gravity * s**2 / 2 + mp.re(end - start), drift + gravity * s + mp.re(1j * w * end)


def swinging(zeta: Any, amplitude: Any, w: Any, t0: Any, z0: Any, w0: Any, s: Any) -> Any:
    """z and z' where z'' = -2 zeta z' - z + amplitude cos(w t)."""
    root, gain = mp.sqrt(mp.mpc(zeta**2 - 1)), amplitude / (1 - w**2 + 2j * zeta * w)
    fast, slow = -zeta - root, -zeta + root
    start, end = gain * mp.expj(w * t0), gain * mp.expj(w * (t0 + s))
    x, u = z0 - mp.re(start), w0 - mp.re(1j * w * start)
    a, b = (u - fast * x) / (slow - fast) * mp.exp(slow * s), (slow * x - u) / (slow - fast) * mp.exp(fast * s)
    return mp.re(a + b + end), mp.re(slow * a + fast * b + 1j * w * end)


def cases(pair: Callable[..., Any]) -> dict[str, Any]:
    """System, flight, frequency, walls with their sides, restitution, largest speed."""
    bar = mp.mpf("0.1245") * mp.mpf("9.8") * mp.sin(mp.pi / 3) / 5
    w, half = mp.mpf("0.81"), mp.mpf("0.175")
    swing = partial(swinging, mp.mpf("0.05"), mp.mpf("0.7"), w)
    return {
        "pair": (pair(0.35), partial(falling, 1, bar, mp.pi), mp.pi, [(half, 1), (-half, -1)], mp.mpf("0.5"), 1.06),
        "ball": (BouncingBall(Gamma=1.2), partial(falling, mp.mpc(0, "-1.2"), -1, 1), 1, [(0, -1)], mp.mpf("0.5"), 9.0),
        "oscillator": (ImpactOscillator(zeta=0.05, w=0.81, A=0.7, wall=0.6), swing, w, [(mp.mpf("0.6"), 1)], mp.mpf("0.9"), 2.0),
    }


def landed(
    case: Any, wall: int, phase: Any, speed: Any, hit: int, guess: Any, left: Any = 0, met: Any = 0
) -> tuple[Any, Any, Any]:
    """Phase and speed of the impact near a guessed phase, and the flight; walls that are left and met are moved by so much."""
    _, flight, w, walls, r, _ = case
    (at, side), (there, face) = walls[wall], walls[hit]
    at, there = at + left, there + met
    path = partial(flight, phase / w, at, -side * r * speed)
    s = mp.findroot(lambda s: path(s)[0] - there, (guess - phase) / w, tol=1e-100)
    return phase + w * s, face * path(s)[1], path


@pytest.mark.parametrize("name", ["pair", "ball", "oscillator"])
def test_impacts_hold_those_of_sixty_digits(name: str, pair: Callable[..., Any]) -> None:
    rng, shown = np.random.default_rng(4), 0
    with mp.workdps(60), ctx.workprec(96):
        case = cases(pair)[name]
        system, _, w, walls, _, top = case
        equation, step = system_of(equation_of(system)), mp.mpf(10) ** -25
        assert [wall["side"] for wall in equation_of(system)["walls"]] == [side for _, side in walls]
        for _ in range(12):
            wall, phase, speed = int(rng.integers(len(walls))), float(rng.uniform(0, 6.28)), float(rng.uniform(0.2, top))
            try:
                impact = next_impact(equation, wall, arb(phase), arb(speed))
            except UnprovedError:
                continue
            shown += 1
            start, guess = (mp.mpf(phase), mp.mpf(speed)), mp.mpf(float(impact.phase.mid()))
            met, fast, path = landed(case, wall, *start, impact.wall, guess)
            assert impact.phase.overlaps(arb(mp.nstr(met, 40)))
            assert impact.speed.overlaps(arb(mp.nstr(fast, 40)))
            assert impact.speed.rad() < 1e-11
            for k in range(1, SAMPLES):
                place = path((met - start[0]) / w * k / SAMPLES)[0]
                assert all(side * (place - at) < 0 for at, side in walls)
            for column, by in enumerate([(step, 0, 0, 0), (0, step, 0, 0), (0, 0, step, 0), (0, 0, 0, step)]):
                other = landed(case, wall, start[0] + by[0], start[1] + by[1], impact.wall, guess, *by[2:])
                for row, change in enumerate((other[0] - met, other[1] - fast)):
                    found = (*impact.derivative[row], *impact.by_walls[row])[column]
                    assert found.overlaps(arb(mp.nstr(change / step, 18)) * (1 + arb(0, 1e-17)))
    assert shown >= 10


def test_walls_within_a_ball_shift_impacts_as_the_ball_of_the_last_one_says(pair: Callable[..., Any]) -> None:
    """The fourth impacts for capsules of lengths within 1e-3 lie in the ball, which is not much wider."""
    point, matrix = (arb(0.363611564551622), arb(0.833385990208561)), ((arb(1), arb(0)), (arb(0), arb(1)))
    none = arb(0), arb(0)
    walls, ball, _ = next_impacts(system_of(equation_of(pair(0.35), {"d": 1e-3})), 0, point, matrix, none, 4)
    ends = []
    for shift in np.linspace(-1e-3, 1e-3, 9):
        found = next_impacts(system_of(equation_of(pair(0.35 + shift))), 0, point, matrix, none, 4)
        assert found[0] == walls
        ends.append([float(x.mid()) for x in found[1]])
    spread = np.ptp(ends, axis=0)
    for x, column, wide in zip(ball, np.transpose(ends), spread, strict=True):
        assert all(x.contains(arb(each)) for each in column)
        assert float(2 * x.rad()) < 2 * wide


def test_a_box_across_a_graze_is_not_decided(pair: Callable[..., Any]) -> None:
    with pytest.raises(UnprovedError, match=message("verify.impact-not-shown")):
        next_impact(system_of(equation_of(pair(0.35))), 0, arb(0, 4), arb(0.4, 0.3))
