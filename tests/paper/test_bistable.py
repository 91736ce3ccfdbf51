"""The shipped studies of the last figure's setting can be run, and noise finds 2:1 motion from 1:1 as its text says."""

import pytest

from nsmaps import Noise, load_study, noisy_orbits
from nsmaps.dynamics.residence import residence
from nsmaps.study.plan import prepare
from nsmaps.study.steps import steps_of


@pytest.mark.parametrize(
    ("name", "steps"), [("bistable", ["system", "surfaces", "bifurcation", "lyapunov", "basins"]), ("noise", ["system", "noise"])]
)
def test_the_studies_are_whole(name: str, steps: list[str]) -> None:
    study = load_study(f"vi_pair/{name}")
    assert prepare(study).system.g_bar == pytest.approx(0.1245 * 9.8 / 2 / 5)
    assert steps_of(study) == steps


def test_weak_noise_leads_to_two_to_one_and_hardly_back() -> None:
    study = load_study("vi_pair/noise")
    assert study.noise is not None
    start = list(study.noise.start.values())
    made = noisy_orbits(study.system_object(), start, 1000, Noise(sigma=0.005, tau=0.5), 16, seed=3)
    stay = residence(made.words, made.time, study.noise.modes, study.noise.hold)
    assert stay.switches[0, 1] > 8
    assert stay.rates[1, 0] < stay.rates[0, 1] / 20
