"""The shipped studies of the last figure's setting can be run, and noise finds 2:1 motion from 1:1 as its text says."""

import pytest

from nsmaps import Noise, load_study, load_system, noisy_orbits, periodic_orbit
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.noise.residence import residence
from nsmaps.study.prepare import prepare
from nsmaps.study.steps import steps_of


@pytest.mark.parametrize(
    ("name", "steps"),
    [("bistable", ["system", "surfaces", "bifurcation_diagram", "lyapunov", "basins"]), ("noise", ["system", "noise"])],
)
def test_the_studies_are_whole(name: str, steps: list[str]) -> None:
    study = load_study(f"vi_pair/{name}")
    assert prepare(study).system.g_bar == pytest.approx(0.1245 * 9.8 / 2 / 5)
    assert steps_of(study) == steps


def test_weak_noise_leads_to_two_to_one_and_hardly_back() -> None:
    study = load_study("vi_pair/noise")
    assert study.noise is not None
    start = list(study.noise.start.values())
    made = noisy_orbits(study.system_object(), start, Noise(sigma=0.005, tau=0.5), n_returns=1000, n_realisations=16, rng=3)
    stay = residence(made.words, made.time, study.noise.modes, study.noise.min_returns)
    assert stay.switches[0, 1] > 8
    assert stay.rates[1, 0] < stay.rates[0, 1] / 20


def test_two_to_one_motion_coexists_with_the_papers_own_at_its_own_parameters() -> None:
    """The product of the multipliers of its 3 impacts is r^6."""
    system = load_system("vi_pair", d=0.285, r=0.5, g_bar=0.21132751903147873)
    found = periodic_orbit(system, [[0.6756, 6.2245], [0.5385, 1.7605]], 2)
    assert (found.label, found.stable) == ("2:1/2T", True)
    assert found.multipliers.prod().real == pytest.approx(0.5**6, rel=1e-9)
    up, down = (continue_branch(system, "d", found, 0.285, (0.26, 0.3), direction=way) for way in ("up", "down"))
    assert up.of_kind("fold")[0].value == pytest.approx(0.2894296462, abs=1e-9)
    assert down.of_kind("period doubling")[0].value == pytest.approx(0.2793372761, abs=1e-9)
