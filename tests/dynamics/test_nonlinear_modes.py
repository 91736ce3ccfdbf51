"""What users compute of a nonlinear system with modes: of the rimless wheel, whose map has a closed form, and of others."""

import numpy as np
import pytest
from messages import message
from nonlinear import BallWithDrag, PendulumBeforeStop
from nsmaps_rimless_wheel import RimlessWheel

import nsmaps
from nsmaps.errors import NsmapsError, ProofError
from nsmaps.exact.outcome import Outcome

pytest.importorskip("heyoka")

WHEEL = RimlessWheel(alpha=np.pi / 8, gamma=0.08)


def kept(wheel):
    """The share of the angular speed that an impact leaves."""
    return np.cos(2 * wheel.alpha)


def rolling(wheel):
    """The speed of rolling, and the least speed from which the next step passes the upright."""
    gained = 4 * np.sin(wheel.gamma) * np.sin(wheel.alpha)
    return np.sqrt(gained) / np.sin(2 * wheel.alpha), np.sqrt(2 * (1 - np.cos(wheel.gamma - wheel.alpha))) / kept(wheel)


def test_returns_orbits_and_exponents_have_the_closed_form():
    speeds, (steady, least) = np.linspace(0.05, 2, 40), rolling(WHEEL)
    rolls = speeds > least
    assert 5 < rolls.sum() < 35
    found = WHEEL.first_return(speeds[:, None], derivative=True)
    image = np.where(
        rolls, np.sqrt((kept(WHEEL) * speeds) ** 2 + 4 * np.sin(WHEEL.gamma) * np.sin(WHEEL.alpha)), kept(WHEEL) ** 2 * speeds
    )
    assert found.image[:, 0] == pytest.approx(image, rel=1e-13)
    assert found.words.tolist() == np.where(rolls, "FF", "FBF").tolist()
    slopes = np.where(rolls, kept(WHEEL) ** 2 * speeds / image, kept(WHEEL) ** 2)
    assert found.derivative[:, 0, 0] == pytest.approx(slopes, rel=1e-11)
    by_slope = WHEEL.sensitivity(speeds[rolls, None], {"gamma": 1.0})[:, 0]
    assert by_slope == pytest.approx(2 * np.cos(WHEEL.gamma) * np.sin(WHEEL.alpha) / image[rolls], rel=1e-10)
    orbit = nsmaps.orbit(WHEEL, [1.5], 200)
    assert orbit.final == pytest.approx([steady], rel=1e-13)
    exponent = nsmaps.lyapunov(WHEEL, starts=[steady], n_returns=200, transient=10).exponents
    assert exponent == pytest.approx([2 * np.log(kept(WHEEL))], rel=1e-9)


def test_basins_are_divided_by_the_speed_that_passes_the_upright():
    steady, least = rolling(WHEEL)
    found = nsmaps.basins(WHEEL, nsmaps.Grid(axes={"w": nsmaps.Axis(low=0.1, high=2, points=39)}), max_returns=200)
    assert len(found.attractors) == 1
    assert found.attractors[0].states == pytest.approx(np.array([[steady]]), rel=1e-9)
    assert (found.label == 0).tolist() == (found.start[:, 0] > least).tolist()


def test_impacts_of_a_wheel_that_rocks_accumulate():
    assert Outcome.accumulates in nsmaps.orbit(WHEEL, [0.2], 400).outcome


def test_a_chart_has_rolling_where_the_closed_form_has_it():
    plane = {"gamma": np.linspace(0.02, 0.2, 7), "alpha": np.linspace(0.25, 0.45, 5)}
    found = nsmaps.parameter_plane(WHEEL, plane, [1.5], n_returns=64, transient=100)
    expected = [
        [np.greater(*rolling(WHEEL.at(gamma=gamma, alpha=alpha))) for gamma in plane["gamma"]] for alpha in plane["alpha"]
    ]
    assert (found.labels[:, :, 0] == "1:0, period 1").tolist() == expected
    assert 5 < np.sum(expected) < 30


def test_observables_and_their_derivatives_have_the_closed_form():
    steady, _ = rolling(WHEEL)
    energy = kept(WHEEL) ** 2 * steady**2 / 2 + np.cos(WHEEL.gamma - WHEEL.alpha)
    wanted = [
        "loss",
        {"name": "energy", "formula": "w**2/2 + cos(th)", "of": "flights", "per": "1"},
        {"name": "fastest", "formula": "w", "of": "flights", "largest": True},
        {"name": "upright", "formula": "-w", "of": "flights", "largest": True},
    ]
    loss = 2 * np.sin(WHEEL.gamma) * np.sin(WHEEL.alpha)
    found = nsmaps.observe(WHEEL, [steady], wanted, n_returns=64).per_return.value
    assert found == pytest.approx([loss, energy, steady, -np.sqrt(2 * (energy - 1))], rel=1e-9)
    orbit = nsmaps.periodic_orbit(WHEEL, [steady])
    slope = nsmaps.observe(WHEEL, orbit, ["loss"], rates={"gamma": 1.0}).per_return
    assert slope.derivative == pytest.approx([2 * np.cos(WHEEL.gamma) * np.sin(WHEEL.alpha)], rel=1e-10)


def test_tracks_and_arrivals_keep_the_energy():
    track = nsmaps.track(WHEEL, [1.0], 6, n_samples=20)
    energy = track.states[..., 1] ** 2 / 2 + np.cos(track.states[..., 0])
    assert energy == pytest.approx(np.repeat(energy[:, :1], 20, axis=1), rel=1e-14)
    assert track.events.name.tolist() == ["F"] * 6
    starts = np.array([[0.0, 0.5], [-0.2, 1.0], [0.1, -0.3]])
    arrivals = WHEEL.arrivals(starts, derivative=True)
    assert arrivals.words.tolist() == ["F", "F", "BF"]
    direct = np.sqrt(starts[:2, 1] ** 2 + 2 * np.cos(starts[:2, 0]) - 2 * np.cos(WHEEL.gamma + WHEEL.alpha))
    assert arrivals.image[:2, 0] == pytest.approx(direct, rel=1e-14)
    slopes = np.column_stack([-np.sin(starts[:2, 0]), starts[:2, 1]]) / direct[:, None]
    assert arrivals.derivative[:2, 0] == pytest.approx(slopes, rel=1e-11)


def test_a_diagram_doubles_where_30_digits_have_it():
    ball = BallWithDrag(Gamma=1.2, r=0.8, k=0.05)
    found = nsmaps.bifurcation_diagram(
        ball, "Gamma", [1.40, 1.45, 1.46, 1.5], [3.57, 1.0], n_returns=32, transient=2000, direction="up"
    )
    assert found.labels[:, 0].tolist() == ["1:0/T", "1:0/T", "1:0/2T", "1:0/2T"]


def test_exponents_have_the_sum_of_liouville():
    pendulum = PendulumBeforeStop(zeta=0.05, F=0.8, omega=1.0, stop=0.3, r=0.8)
    orbit = nsmaps.orbit(pendulum, [1.0, 0.0], 600)
    exponents = nsmaps.lyapunov(pendulum, starts=orbit.states[200], n_returns=400, transient=0).exponents
    assert exponents.sum() == pytest.approx(np.mean(2 * np.log(0.8) - 0.1 * orbit.time[200:600]), rel=1e-6)


def test_noise_without_a_name_and_boxes_are_refused():
    with pytest.raises(NsmapsError, match=message("exact.no-noise", system="RimlessWheel")):
        nsmaps.noisy_orbits(WHEEL, [1.0], nsmaps.Noise(sigma=0.01, tau=0.1), n_returns=10)
    with pytest.raises(ProofError, match=message("exact.nonlinear-not-enclosed", system="RimlessWheel")):
        WHEEL.image_boxes([[[1.0, 1.01]]])
