"""Minima beside the best one, and descriptions by other units of time, of records that share nothing with the engine."""

from types import SimpleNamespace

import numpy as np
import pytest
from estimates import CASES, model_of, record_of
from nsmaps_vi_pair import VIPair
from rig import Rig
from scipy.integrate import solve_ivp

import nsmaps
from nsmaps.estimation import Record
from nsmaps.study.sections.parameters.estimate import EstimateSection

SEED = 117  #: of a record whose first fit from these guesses ends at chi2 18.2


def impacts_of_oscillator(speed: float, begin: float, phase: float, count: int) -> np.ndarray:
    """The times of impacts of the Duffing oscillator with a stop, from the first; the phase is that at time zero."""
    c, a, b, f, w, d, r = CASES["duffing"][0].values()

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], f * np.cos(w * t + phase) - c * y[1] - a * y[0] - b * y[0] ** 3]

    def stop(t: float, y: np.ndarray) -> float:
        return y[0] - d

    stop.terminal, stop.direction = True, 1  # type: ignore[attr-defined]
    times = [begin]
    while len(times) < count:
        found = solve_ivp(rates, (times[-1], times[-1] + 200), [d, -r * speed], "DOP853", events=stop, rtol=1e-11, atol=1e-13)
        times.append(float(found.t[-1]))
        speed = float(found.y[1, -1])
    return np.array(times)


@pytest.mark.thorough
def test_a_better_minimum_beside_that_of_the_first_fit_is_found() -> None:
    """The least sum of squares is below that at the true motion."""
    _, free, ranges, count = CASES["duffing"]
    model, first = model_of("duffing"), np.random.default_rng(SEED)
    record = record_of(model, ranges, count, np.random.default_rng(SEED))
    times = impacts_of_oscillator(first.uniform(*ranges[0]), first.uniform(0, 2), float(record.phase or 0.0), count)
    truth = np.sum(((record.times - times) / record.noise) ** 2)
    assert 15 < truth < 16
    guess = {"r": 0.79, "f": 0.71}
    found = nsmaps.estimate(model.system, record, free=free, guess=guess, n_guesses=1, n_returns=100, profile=False)
    assert found.chi2 < truth < found.minima.chi2[1]
    assert np.all(np.abs(found.values - [0.8, 0.7]) < 3 * found.errors)


@pytest.mark.thorough
@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_a_unit_of_time_with_which_the_model_describes_the_record_is_named(factor: float) -> None:
    times, walls, _ = Rig().impacts(16, 0.8, 0.4, 30.0)
    noisy = factor * (times + 2e-3 * np.random.default_rng(1).standard_normal(16))
    record = Record.of(noisy, walls.tolist(), noise=factor * 2e-3, phase=0.4)
    pair, guess = VIPair(d=0.35, r=0.5, g_bar=0.2113), {"r": 0.49, "d": 0.355}
    found = nsmaps.estimate(pair, record, free=["r", "d"], guess=guess, n_guesses=1, n_returns=100)
    assert not found.describes
    assert found.unit_factor == factor
    assert f"the model does not describe the data, but with a `time_unit` {factor:g} times as large" in str(found)
    (verdict,) = EstimateSection.verdicts(EstimateSection, SimpleNamespace(estimate=found, system=pair))
    assert verdict.text.endswith(f"degrees of freedom, but with a `time_unit` {factor:g} times as large")
