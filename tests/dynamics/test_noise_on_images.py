"""Noise on the images of maps, against the laws of linear maps and of rotations."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps import Angle, Noise, PiecewiseMap, Returns, System
from nsmaps.errors import NsmapsError


class Linear(PiecewiseMap):
    """x -> a x + mu, with the letter of the side on which x is, and an angle that turns."""

    a: float = 0.8
    mu: float = 0.3
    turn: float = 1.0
    coordinates = ("x", Angle("phi"))

    def pieces(self, x):
        image = {"x": self.a * x.x + self.mu, "phi": x.phi + self.turn}
        return {"L": (x.x < 0, image), "R": (x.x <= 40, image)}


class Program(System):
    """The same in Python."""

    a: float = 0.8
    mu: float = 0.3
    turn: float = 1.0
    coordinates = ("x", Angle("phi"))

    def first_return(self, states, derivative=False):
        x, phi = states.T
        image = np.stack([np.where(x <= 40, self.a * x + self.mu, np.nan), phi + self.turn], axis=1)
        return Returns.of_map(self.coordinates, states, image, words=np.where(x < 0, "L", "R").tolist(), walls=("L", "R"))


NOISE = Noise(sigma=0.1, scale={"x": 2.0, "phi": 0.5})
START = [1.5, 6.0]  #: the fixed point of x


def test_stationary_law_of_a_linear_map():
    """x is an autoregression of order one: variance s^2 / (1 - a^2), correlation a^k; its mean is mu / (1 - a)."""
    made = nsmaps.noisy_orbits(Linear(), START, NOISE, n_returns=1000, n_realisations=200, rng=3)
    assert made.ended() == {}
    x = made.states[100:, :, 0] - 1.5
    s, count = 0.2, x.size * (1 - 0.8) / (1 + 0.8)  #: of independent values, about
    assert abs(x.mean()) < 5 * s / (1 - 0.8**2) ** 0.5 / count**0.5
    assert x.var() == pytest.approx(s**2 / (1 - 0.8**2), rel=5 * (2 / count) ** 0.5)
    for k in (1, 3):
        assert (x[k:] * x[:-k]).mean() / x.var() == pytest.approx(0.8**k, abs=0.02)
    below = made.words[100:] == "L"
    assert np.array_equal(below, made.states[100:-1, :, 0] < 0)


def test_a_turned_angle_has_the_wrapped_normal_law():
    """After n turns phi is normal, of variance n s^2: exp(i k phi) has the mean exp(i k (6 + n) - k^2 n s^2 / 2)."""
    count, n = 4000, 400
    made = nsmaps.noisy_orbits(Linear(), START, NOISE, n_returns=n, n_realisations=count, rng=1)
    phi = made.states[-1, :, 1]
    assert ((phi >= 0) & (phi < 2 * np.pi)).all()
    for k in (1, 2):
        law = np.exp(1j * k * (6.0 + n) - k**2 * n * 0.05**2 / 2)
        assert abs(np.exp(1j * k * phi).mean() - law) < 4 / count**0.5
    lifted = phi + 2 * np.pi * made.turns[:, :, 1].sum(axis=0) - 6.0
    assert lifted == pytest.approx(n + made.eta[:, :, 1].sum(axis=0), abs=1e-10)
    assert lifted.mean() == pytest.approx(n, abs=4 * 0.05 * (n / count) ** 0.5)


def test_noise_is_added_to_the_images_of_the_map():
    made = nsmaps.noisy_orbits(Linear(), START, NOISE, n_returns=50, n_realisations=3, rng=2)
    states = made.states[:-1].reshape(-1, 2)
    images = Linear().first_return(states)
    moved = made.coordinates.difference(made.states[1:].reshape(-1, 2), images.image)
    assert moved == pytest.approx(made.eta[1:].reshape(-1, 2), abs=1e-13)
    assert np.array_equal(made.codes.ravel(), images.codes)
    assert not made.eta[0].any()
    one = nsmaps.noisy_orbits(Linear(), START, Noise(sigma=0.2, scale={"x": 1.0}), n_returns=50, n_realisations=3, rng=2)
    assert np.array_equal(one.eta[1:, :, 1], np.zeros((50, 3)))
    quiet = nsmaps.noisy_orbits(Linear(), START, Noise(sigma=0), n_returns=9)
    assert np.array_equal(quiet.states[:, 0], nsmaps.orbit(Linear(), START, 9).states)


def test_realisations_depend_on_the_seed_alone():
    first = nsmaps.noisy_orbits(Linear(), START, NOISE, n_returns=300, n_realisations=20, rng=5)
    with ThreadPoolExecutor(2) as pool:
        others = (
            nsmaps.noisy_orbits(
                Linear(), START, NOISE, n_returns=300, n_realisations=20, rng=5, parallel=nsmaps.Parallel(pool, part=3)
            ),
            nsmaps.noisy_orbits(Program(), START, NOISE, n_returns=300, n_realisations=20, rng=5),
        )
    for other in others:
        assert other.states == pytest.approx(first.states, abs=1e-12)
        for name in ("codes", "outcome", "turns", "time", "eta"):
            assert np.array_equal(getattr(other, name), getattr(first, name)), name
    assert not np.array_equal(
        nsmaps.noisy_orbits(Linear(), START, NOISE, n_returns=300, n_realisations=20, rng=6).states, first.states
    )


@pytest.mark.parametrize("return_map", [Linear(a=1.2), Program(a=1.2)], ids=["formula", "program"])
def test_an_orbit_that_leaves_the_map_ends(return_map):
    made = nsmaps.noisy_orbits(return_map, START, NOISE, n_returns=60, n_realisations=5, rng=1)
    assert sum(made.ended().values()) == 5
    assert np.isnan(made.states[-1]).all()
    assert np.isnan(made.eta[-1]).all()
    assert (made.words[-1] == "").all()
    ends = np.isnan(made.states).all(axis=-1).argmax(axis=0)
    assert all((made.outcome[end - 1 :, k] == made.outcome[end - 1, k]).all() for k, end in enumerate(ends))


@pytest.mark.parametrize(
    ("noise", "how", "text"),
    [
        (Noise(sigma=0.1, tau=1.0), {}, message("dynamics.no-motion-for-noise")),
        (Noise(sigma=0.1, scale={"y": 1.0}), {}, message("dynamics.foreign-scale", name="y", names="x, phi")),
        (Noise(sigma=0.1), {"step": 0.1}, message("dynamics.noise-on-images")),
        (Noise(sigma=0.1), {"max_impacts": 3}, message("dynamics.noise-on-images")),
    ],
)
def test_what_noise_on_images_lacks_is_refused(noise, how, text):
    with pytest.raises(NsmapsError, match=text):
        nsmaps.noisy_orbits(Linear(), START, noise, n_returns=5, **how)


def test_noise_on_the_images_of_an_impact_system():
    """It needs a scale of its coordinates, as sigma alone would be that of a forcing."""
    system = nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113)
    with pytest.raises(NsmapsError, match=message("dynamics.no-noise-given")):
        nsmaps.noisy_orbits(system, [0.83, 0.36], Noise(sigma=0.01), n_returns=5)
    made = nsmaps.noisy_orbits(system, [0.83, 0.36], Noise(sigma=0.01, scale={"phi": 1.0}), n_returns=20, n_realisations=2)
    images = system.first_return(made.states[:-1].reshape(-1, 2)).image
    assert made.states[1:, :, 0].ravel() == pytest.approx(images[:, 0], abs=1e-12)
    assert np.abs(made.states[1:, :, 1].ravel() - images[:, 1]).max() > 1e-3
