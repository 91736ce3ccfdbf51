"""Estimates from samples at returns: strobed states, simulated by closed forms and scipy, not by the engine."""

from pathlib import Path

import numpy as np
import pytest
from messages import message
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import nsmaps
from nsmaps import load_system
from nsmaps.errors import DataError
from nsmaps.estimation import Record

OSCILLATOR = {"zeta": 0.05, "w": 0.9, "A": 0.8, "wall": 1.0, "r": 0.8}
PHASE = 0.7


def strobed_oscillator(count: int) -> np.ndarray:
    """Place and velocity of the impact oscillator once a period, after 10 periods, by scipy."""
    w, period = OSCILLATOR["w"], 2 * np.pi / OSCILLATOR["w"]

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], OSCILLATOR["A"] * np.cos(w * t) - 2 * OSCILLATOR["zeta"] * y[1] - y[0]]

    def wall(t: float, y: np.ndarray) -> float:
        return float(OSCILLATOR["wall"] - y[0])

    wall.terminal, wall.direction = True, -1.0  # type: ignore[attr-defined]
    time, state, found = PHASE / w, np.array([0.0, 1.0]), []
    for k in range(10 + count):
        end = (PHASE + 2 * np.pi * (k + 1)) / w
        while time < end:
            flight = solve_ivp(rates, (time, end), state, events=wall, rtol=1e-11, atol=1e-12, max_step=period / 20)
            time, state = flight.t[-1], flight.y[:, -1]
            if flight.status == 1:
                state = np.array([OSCILLATOR["wall"] * (1 - 1e-13), -OSCILLATOR["r"] * state[1]])
        found.append(state)
    return np.array(found[10:])


def test_strobed_states_of_a_forced_system_give_its_parameters_in_units_of_the_record() -> None:
    """Lengths in mm of which 2 are one, time in ms of which 5 are one; the true values are within 4 standard errors."""
    system, rng = load_system("impact_oscillator", **OSCILLATOR), np.random.default_rng(1)
    states = strobed_oscillator(12) * [2.0, 0.4]
    noise = 0.02 * states.std(axis=0)
    samples = states + noise * rng.standard_normal(states.shape)
    samples[4, 1] = np.nan
    given = dict(zip(("place", "v"), samples.T, strict=True)), dict(zip(("place", "v"), noise, strict=True))
    record = Record.of(samples=given[0], sample_noise=given[1], phase=PHASE, length_unit=2.0, time_unit=5.0)
    found = nsmaps.estimate(
        system, record, free={"r": (0.5, 1.0), "zeta": (0.01, 0.2)}, guess={"r": 0.77, "zeta": 0.06}, n_guesses=1
    )
    assert str(record) == "12 returns with place, v"
    assert found.converged
    assert found.describes
    assert found.dof == 24 - 1 - 4
    assert found.defect < 1e-2
    assert np.all(np.abs(found.values - [0.8, 0.05]) < 4 * found.errors)
    assert np.all(found.errors < 0.05)
    hit = system.first_return(found.last_states)
    assert hit.valid.all()
    assert found.plot() is not None


def buck_states(count: int, e: float, load: float) -> np.ndarray:
    """Voltage and current of the buck converter at each fall of its ramp, after 20 periods, by exponentials of matrices."""
    c, inductance, gain, reference, low, high, period = 47e-6, 20e-3, 8.4, 11.3, 3.8, 8.2, 400e-6
    flow = np.array([[-1 / (load * c), 1 / c, 0], [-1 / inductance, 0, 1 / inductance], [0, 0, 0]])

    def after(time: float, state: np.ndarray, u: float) -> np.ndarray:
        return np.asarray(expm(flow * time) @ [*state, u * e])[:2]

    def above(time: float, begin: float, state: np.ndarray, u: float) -> float:
        return float(gain * (after(time - begin, state, u)[0] - reference) - low - (high - low) * time / period)

    state, found = np.array([12.0, 0.5]), []
    for _ in range(20 + count):
        begin, u = 0.0, float(gain * (state[0] - reference) < low)
        for end in np.linspace(0, period, 41)[1:]:
            sign = 1.0 if u else -1.0  # on ends where the control rises above the ramp, off where it falls below
            if sign * above(end, begin, state, u) > 0:
                hit = brentq(above, max(begin, end - period / 40), end, (begin, state, u), xtol=1e-18)
                state, begin, u = after(hit - begin, state, u), hit, 1 - u
        state = after(period - begin, state, u)
        found.append(state)
    return np.array(found[20:])


def test_samples_at_the_clock_of_a_converter_give_source_and_load(tmp_path: Path) -> None:
    states, rng = buck_states(16, 32.0, 22.0), np.random.default_rng(2)
    noise = 0.02 * states.std(axis=0)
    samples = states + noise * rng.standard_normal(states.shape)
    lines = [f"{k},{v},{i},{noise[0]},{noise[1]}" for k, (v, i) in enumerate(samples) if k != 5]
    path = tmp_path / "strobe.csv"
    path.write_text("\n".join(["return,v,i,v_noise,i_noise", *lines]))
    system = load_system("buck_converter", E=31.8, R=21.8)
    found = nsmaps.estimate(system, path, free={"E": (28.0, 36.0), "R": (18.0, 26.0)}, n_guesses=1)
    assert found.describes
    assert found.dof == 2 * 15 - 4
    assert np.all(np.abs(found.values - [32.0, 22.0]) < 4 * found.errors)
    assert np.all(found.errors < 0.1)


def test_samples_at_returns_of_an_angle_are_compared_on_the_circle() -> None:
    """Of the ball on a table of r = 1/2 in a motion of one impact a period the phase is cos(phi) = pi (1 - r)/(Gamma (1 + r))."""
    ball = load_system("bouncing_ball", Gamma=1.2, r=0.5)
    truth = nsmaps.orbit(ball, [3.0, 0.5], 300).final
    rng, shift = np.random.default_rng(3), 2 * np.pi * np.arange(8)
    noise = {"v": 0.01, "phi": 0.01}
    samples = {"v": truth[0] + 0.01 * rng.standard_normal(8), "phi": truth[1] + shift + 0.01 * rng.standard_normal(8)}
    found = nsmaps.estimate(ball, Record.of(samples=samples, sample_noise=noise), free=["Gamma"], n_guesses=1)
    assert abs(found.values[0] - 1.2) < 4 * found.errors[0]
    assert found.chi2 < 40


def test_samples_without_times_that_cannot_be_used_are_refused_in_one_line() -> None:
    system, free = load_system("impact_oscillator", **OSCILLATOR), ["r"]
    both = {"place": [0.1, 0.2, 0.3], "v": [0.1, 0.2, 0.3]}
    with pytest.raises(DataError, match=message("estimation.no-phase")):
        nsmaps.estimate(system, Record.of(samples=both, sample_noise=0.1), free=free)
    with pytest.raises(DataError, match=message("estimation.incomplete", missing="v", names="place, v")):
        nsmaps.estimate(system, Record.of(samples={"place": [0.1, 0.2]}, sample_noise=0.1, phase=0.0), free=free)
    with pytest.raises(DataError, match=message("estimation.foreign-coordinate", name="x", names="place, v")):
        nsmaps.estimate(system, Record.of(samples={"x": [0.1, 0.2]}, sample_noise=0.1, phase=0.0), free=free)
    with pytest.raises(DataError, match=message("estimation.mixed-times")):
        nsmaps.estimate(system, [Record.of(samples=both, sample_noise=0.1, phase=0.0), [1.0, 2.0]], free=free)
    with pytest.raises(DataError, match=message("estimation.return-numbers")):
        Record.read({"return": [0, 2, 1], "x": [0.0, 1.0, 2.0], "x_noise": [0.1] * 3})
