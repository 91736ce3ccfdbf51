"""Estimates from records of rigs that share nothing with the engine, and their errors."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from messages import message
from nsmaps_vi_pair import VIPair
from pydantic import Field
from rig import Rig, sensed
from unforced import Drop

import nsmaps
from nsmaps import ImpactSystem, Wall, load_system
from nsmaps.errors import DataError, ParameterError
from nsmaps.estimation import Record

PAIR = VIPair(d=0.35, r=0.5, g_bar=0.2113)
NOISE = 2e-3
TIMES, WALLS, SPEEDS = Rig().impacts(31, 0.8, 0.4, 30.0)
FREE = {"r": (0.2, 0.9), "d": (0.2, 0.6)}


def noisy(seed: int) -> np.ndarray:
    return TIMES + 0.4 / np.pi + NOISE * np.random.default_rng(seed).standard_normal(len(TIMES))


def test_a_record_of_times_gives_the_parameters_within_their_errors() -> None:
    record = Record.of(noisy(1), WALLS.tolist(), noise=NOISE, phase=0.0)
    found = nsmaps.estimate(PAIR, record, free=FREE, guess={"r": 0.45, "d": 0.4}, n_guesses=1)
    assert found.converged
    assert found.describes
    assert np.all(np.abs(found.values - [0.5, 0.35]) < 3 * found.errors)
    assert np.all(found.errors < 0.002)
    assert found.words == (("".join(WALLS),) * 2,)
    assert found.rank == 2
    assert found.defect < 1e-2
    np.testing.assert_allclose(found.chi2, np.nansum(found.pairs.residual**2), rtol=1e-6)
    assert found.dof == 31 - 4
    assert str(found).startswith("r = 0.")


@pytest.mark.parametrize(("speed", "phase"), [(0.66, 6.19), pytest.param(1.11, 4.46, marks=pytest.mark.thorough)])
def test_records_that_begin_in_a_transient_lead_to_the_true_minimum_from_guesses_near_it(speed: float, phase: float) -> None:
    """Other starts lead to the same periodic motion, with an impact more or less before it."""
    times, walls, _ = Rig().impacts(30, speed, phase, 60.0)
    noisy_times = times + NOISE * np.random.default_rng(0).standard_normal(30)
    record = Record.of(noisy_times, walls.tolist(), noise=NOISE, phase=phase)
    found = nsmaps.estimate(PAIR, record, free=["r", "d"], guess={"r": 0.508, "d": 0.344}, n_guesses=1, n_returns=100)
    assert found.describes
    assert found.minima.unpaired[0] == 0
    assert np.all(np.abs(found.values - [0.5, 0.35]) < 3 * found.errors)


def test_missed_doubled_quantised_impacts_of_a_drifting_rig_in_seconds_are_fitted() -> None:
    """Units of the system are 5 ms; the noise is unknown, as drift and the clock's resolution add to it."""
    unit, rng = 5e-3, np.random.default_rng(4)
    times, walls, _ = Rig(drift=2e-4).impacts(45, 0.8, 0.4, 45.0)
    seen, letters = sensed(times + 0.4 / np.pi, walls, rng, NOISE, 1e-3)
    record = Record.of(seen * unit, letters.tolist(), phase=0.0, time_unit=unit)
    found = nsmaps.estimate(PAIR, record, free=FREE, guess={"r": 0.45, "d": 0.4}, n_guesses=1)
    assert found.minima.unpaired[0] == 6  # five missed, one doubled
    data, model = found.words[0]
    assert data.count("-") == 5
    assert model.count("-") == 1
    assert np.all(np.abs(found.values - [0.5, 0.35]) < 4 * found.errors)
    assert np.all(found.errors < 0.004)
    assert np.isnan(found.probability)
    residuals = found.pairs.model_time - found.pairs.time
    assert 0.5 * NOISE * unit < np.nanstd(residuals) < 3 * NOISE * unit


@pytest.mark.thorough
def test_speeds_alone_determine_what_times_leave_open_and_samples_count_too() -> None:
    rng = np.random.default_rng(5)
    at = TIMES[2:9] + 0.2
    states = np.array([_place(time) for time in at])
    record = Record.of(
        TIMES + 0.4 / np.pi,
        WALLS.tolist(),
        SPEEDS + 0.01 * rng.standard_normal(31),
        noise=NOISE,
        speed_noise=0.01,
        sample_times=at + 0.4 / np.pi,
        samples={"place": states + 0.005 * rng.standard_normal(7)},
        sample_noise=0.005,
    )
    found = nsmaps.estimate(PAIR, record, free=["r"], guess={"r": 0.45}, n_guesses=1)
    assert abs(found.values[0] - 0.5) < 3 * found.errors[0]
    assert len(found.speed_residuals) == 31
    assert len(found.sample_residuals) == 7
    assert abs(found.phases[0]) < 0.1 or abs(found.phases[0] - 2 * np.pi) < 0.1


def _place(time: float) -> float:
    """The place at a time after the first impact, by the polynomial and the cosine of the flight."""
    k = int(np.searchsorted(TIMES, time)) - 1
    s, phase = time - TIMES[k], np.pi * TIMES[k] + 0.4
    side = 1 if WALLS[k] == "B" else -1
    start, velocity = side * 0.175, -side * 0.5 * SPEEDS[k]
    forced = (np.cos(phase) - np.cos(phase + np.pi * s)) / np.pi**2 - np.sin(phase) * s / np.pi
    return float(start + velocity * s + 0.2113 * s**2 / 2 + forced)


def test_parameters_that_the_data_cannot_distinguish_are_named() -> None:
    """Of a ball without forcing the times depend on v/g alone."""
    times = np.array([0.25 + sum(2 * 0.8 ** (j + 1) * 3.0 / 9.81 for j in range(n)) for n in range(7)])
    record = Record.of(times, noise=1e-4)
    found = nsmaps.estimate(
        Drop(g=9.0, e=0.78), record, free={"g": (5.0, 15.0), "e": (0.5, 0.95)}, guess={"v": -3.0}, n_guesses=1
    )
    assert found.rank == 1
    assert found.undetermined == ("g",)
    assert abs(found.parameters["e"] - 0.8) < 1e-6


class Follower(ImpactSystem):
    """A follower that a preload P (N/kg) presses on a cam of lift a cos(w t); its place is that above the cam."""

    r: float = Field(ge=0, le=1)
    P: float = Field(gt=0)
    w: float
    a: float

    def walls(self) -> Mapping[str, Wall]:
        return {"C": Wall(at=0, side=-1)}

    def period(self) -> Any:
        from sympy import pi

        return 2 * pi / self.w

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        from sympy import cos, sin

        s, lift = t - hit.t, self.a * (cos(self.w * t) - cos(self.w * hit.t))
        return hit.z + (hit.w - self.a * self.w * sin(self.w * hit.t)) * s - self.P * s**2 / 2 - lift


CAM = Follower(r=0.4, P=40.0, w=150.0, a=0.005)
BOUNDS = {"r": (0.05, 0.95), "P": (10.0, 100.0)}


def cam_record(count: int) -> Record:
    """Impact times of the follower with 0.2 ms of noise."""
    times = CAM.impacts([2.6, 4.8], count).time + 4.8 / CAM.w
    return Record.of(times + 2e-4 * np.random.default_rng(0).standard_normal(count), "C" * count, noise=2e-4, phase=0.0)


def test_a_false_minimum_is_named_as_such() -> None:
    alone = nsmaps.estimate(CAM, cam_record(16), free=BOUNDS, guess={"r": 0.8, "P": 25.0}, n_guesses=1)
    assert alone.chi2 > 1e3
    assert not alone.describes
    assert "the model does not describe the data" in str(alone)


@pytest.mark.thorough
def test_a_search_finds_the_other_minimum_and_lists_the_false_ones() -> None:
    found = nsmaps.estimate(CAM, cam_record(40), free=BOUNDS, guess={"r": 0.8, "P": 25.0})
    assert found.describes
    assert found.chi2 < 60
    assert np.all(np.abs(found.values - [0.4, 40.0]) < 3 * found.errors)
    false = found.minima.chi2 > 1e4
    assert false.any()
    assert found.minima.weights[false].sum() < 1e-12
    assert found.minima.weights.sum() == pytest.approx(1.0)


@pytest.mark.thorough
def test_intervals_have_their_nominal_coverage_within_what_sixty_records_say() -> None:
    rng, inside = np.random.default_rng(8), []
    for _ in range(60):
        times = np.array([sum(2 * 0.8 ** (j + 1) * 3.0 / 9.81 for j in range(n)) for n in range(7)])
        noise = np.diff(times).std() * np.exp(rng.uniform(*np.log([0.001, 0.05])))
        record = Record.of(np.sort(times + noise * rng.standard_normal(7)), noise=noise)
        found = nsmaps.estimate(Drop(g=9.81, e=0.79), record, free=["e"], guess={"v": -3.0}, n_guesses=1)
        inside.append((found.intervals[0, :, 0] <= 0.8) & (found.intervals[0, :, 1] >= 0.8))
    shares = np.mean(inside, axis=0)
    assert len(inside) == 60
    assert np.all(np.abs(shares - [0.6827, 0.9545]) < [0.18, 0.081])  # three standard deviations of the shares


def test_records_of_other_systems_and_units_are_refused_in_one_line() -> None:
    with pytest.raises(DataError, match=message("estimation.not-of-system", system="VIPair", kind="wall", name="C")) as error:
        nsmaps.estimate(PAIR, Record.of([0.0, 1.0], "BC"), free=["r"])
    assert "\n" not in str(error.value)
    for factor in (1e-4, 2 * np.pi, 25.0):
        with pytest.raises(DataError, match=message("estimation.wrong-unit")):
            nsmaps.estimate(PAIR, Record.of(TIMES * factor, WALLS.tolist(), noise=1e-7), free=["r"])
    with pytest.raises(DataError, match=message("estimation.not-of-system", kind="state", name="X")):
        nsmaps.estimate(PAIR, Record.of(sample_times=[0.0, 1.0], samples={"X": [0.0, 1.0]}, sample_noise=0.1), free=["r"])
    with pytest.raises(DataError, match=message("estimation.too-few-numbers", known=1, unknown=4, names="r")):
        nsmaps.estimate(PAIR, [0.0], free=["r"])
    with pytest.raises(ParameterError, match=message("estimation.guess", name="q")):
        nsmaps.estimate(PAIR, [0.0, 1.0], free=["r"], guess={"q": 1.0})
    for wrong in ({"r": 2.0}, {"r": "half"}, {"r": float("nan")}):
        with pytest.raises(ParameterError, match=message("estimation.guess-outside", name="r", least=0)):
            nsmaps.estimate(PAIR, TIMES, free=["r"], guess=wrong)
    for bounds in ((0.9, 0.2), (0.2, float("nan")), 0.5, "0.2-0.9", (0.2, 0.5, 0.9)):
        with pytest.raises(ParameterError, match=message("estimation.guess-outside", name="r", least=0)):
            nsmaps.estimate(PAIR, TIMES, free={"r": bounds})
    with pytest.raises(nsmaps.NsmapsError, match=message("exact.no-motion", what="an estimate from impacts and samples")):
        nsmaps.estimate(load_system("square_root", a=0.5, mu=0.1), [0.0, 1.0], free=["r"])
