"""Manifolds of saddles against closed forms, series in 50 digits, and orbits of the map itself."""

from dataclasses import dataclass

import mpmath as mp
import numpy as np
import pytest
from boxmaps import Henon, plain_returns
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.reversed import reversed_system


@dataclass
class Bent(ReturnMap):
    """(x, y) to (2 x, y/2 + 7 x^2/2), as (x, y - x^2) to (2 x, (y - x^2)/2): the manifolds of 0 are y = x^2 and x = 0.

    With a jump at x = 1: beyond, the image is (2 x - 3, y/2 - 5). `back` is the inverse of the first piece.
    """

    jump: bool = False
    back: bool = False
    flip: float = 1.0
    coordinates: tuple[str, ...] = ("x", "y")

    def first_return(self, states, derivative=False):
        x, y = np.asarray(states, float).T
        k, zero, one = 2.0 * self.flip, np.zeros_like(x), np.ones_like(x)
        if self.back:
            image, slopes = [x / k, 2 * (y - 3.5 * (x / k) ** 2)], [one / k, zero, -14 * x / k**2, 2 * one]
        else:
            image, slopes = [k * x, y / 2 + 3.5 * x**2], [k * one, zero, 7 * x, one / 2]
        if self.jump:
            far = x >= 1
            image = [np.where(far, 2 * x - 3, image[0]), np.where(far, y / 2 - 5, image[1])]
        return plain_returns(self.coordinates, states, np.column_stack(image), np.column_stack(slopes).reshape(-1, 2, 2))


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_a_closed_form(flip):
    """Also where the map turns the sides over."""
    return_map = Bent(flip=flip)
    saddle = nsmaps.periodic_orbit(return_map, [0.1, 0.1], scale=[1.0, 1.0])
    found = nsmaps.manifold(return_map, saddle, length=8.0, gap=0.05)
    x, y = found.states.T
    assert np.abs(y - x**2).max() < 1e-9 * 8
    assert found.ended == ("length 8", "length 8")
    assert found.multiplier == pytest.approx(2 * flip)
    for side in (0, 1):
        own = found.side == side
        assert len(np.unique(np.sign(x[own][1:]))) == 1
        assert np.abs(np.diff(found.states[own], axis=0)).max() <= 0.05
        exact = [float(mp.quad(lambda t: mp.sqrt(1 + 4 * t * t), [0, abs(float(end))])) for end in x[own][[100, -1]]]
        assert found.arclength[own][[100, -1]] == pytest.approx(exact, rel=1e-4)  # of chords
    assert x.max() > 2.5
    assert x.min() < -2.5
    stable = nsmaps.manifold(return_map, saddle, "stable", length=3.0, gap=0.05, inverse=Bent(back=True, flip=flip))
    assert np.abs(stable.states[:, 0]).max() < 1e-9
    assert stable.states[:, 1].min() < -2.9
    assert stable.states[:, 1].max() > 2.9
    assert stable.multiplier == pytest.approx(0.5)


def test_a_manifold_that_is_folded_within_the_gap_ends():
    """In a unit of a thousand the whole attractor, three long, is within the gap: it never gets longer than that."""
    return_map = Henon()
    saddle = nsmaps.periodic_orbit(return_map, [0.63, 0.19], scale=[1e3, 1e3])
    found = nsmaps.manifold(return_map, saddle, length=3.0)
    assert found.ended == ("images shorter than the gap",) * 2
    assert np.abs(found.states).max() < 1.5


def test_a_jump_is_cut_where_it_is():
    """The side to the right is y = x^2 up to x = 2, then the image of [1, 2]: from (-1, -4.5) to (1, -3)."""
    return_map = Bent(jump=True)
    found = nsmaps.manifold(return_map, nsmaps.periodic_orbit(return_map, [0.1, 0.1], scale=[1.0, 1.0]), length=8.0, gap=0.05)
    first, second, *_ = (line for line in found.lines if line[0, 0] > 0 or line[-1, 0] > 0)
    assert first[-1] == pytest.approx([2, 4], abs=1e-9)
    assert second[0] == pytest.approx([-1, -4.5], abs=1e-9)
    assert np.abs(np.diff(first, axis=0)).max() <= 0.05
    beyond = (second[:, 0] + 3) / 2
    assert second[:, 1] == pytest.approx(beyond**2 / 2 - 5, abs=1e-8)
    assert found.piece[found.side == 0].max() + found.piece[found.side == 1].max() > 0


def henon_series(multiplier, x0, terms=60, a=1.4, b=0.3):
    """The coefficients of X with X(m t) = 1 - a X(t)^2 + b X(t/m), in 50 digits: the manifold is (X(t), b X(t/m))."""
    m, x = mp.mpf(multiplier), [mp.mpf(x0), mp.mpf(1)]
    for n in range(2, terms):
        products = sum(x[k] * x[n - k] for k in range(1, n))
        x.append(-a * products / (m**n + 2 * a * x[0] - b / m**n))
    return x


def test_the_henon_map_against_a_series():
    """Each of 14 states is within 1e-9 of the manifold's own curve, wherever on it."""
    return_map = Henon()
    with mp.workdps(50):
        a, b = mp.mpf("1.4"), mp.mpf("0.3")
        x0 = (b - 1 + mp.sqrt((1 - b) ** 2 + 4 * a)) / (2 * a)
        m = -a * x0 - mp.sqrt((a * x0) ** 2 + b)
        x = henon_series(m, x0, a=a, b=b)
        saddle = nsmaps.periodic_orbit(return_map, [float(x0), float(b * x0)])
        found = nsmaps.manifold(return_map, saddle, length=4.0, gap=0.02)

        def curve(t):
            return mp.polyval(x[::-1], t), b * mp.polyval(x[::-1], t / m)

        def point(t):  # of the whole manifold: the series near the saddle, mapped on
            times = 0
            while abs(t) > mp.mpf("0.1"):
                t, times = t / m, times + 1
            p, q = curve(t)
            for _ in range(times):
                p, q = 1 - a * p * p + q, b * p
            return p, q

        for side in (0, 1):
            own = found.states[found.side == side]
            shares = np.geomspace(1e-4, 60, 1200) * np.sign(own[1, 0] - own[0, 0])
            known = np.array([[float(v) for v in point(mp.mpf(t))] for t in shares])
            for state in own[10 :: len(own) // 6]:
                far = np.linalg.norm(known - state, axis=1)
                least = np.flatnonzero((far[1:-1] <= far[:-2]) & (far[1:-1] <= far[2:]) & (far[1:-1] < 0.03)) + 1
                assert min(distance(point, state.tolist(), shares[k]) for k in least) < 1e-9
    assert found.ended == ("length 4", "length 4")


def distance(point, state, near):
    """The distance of a state from a curve, by the foot of the perpendicular near a parameter."""

    def tangent(t):
        h = abs(t) * mp.mpf(10) ** -20
        return [(u - v) / (2 * h) for u, v in zip(point(t + h), point(t - h), strict=True)]

    def along(t):
        return sum((u - v) * w for u, v, w in zip(point(t), state, tangent(t), strict=True))

    t = mp.findroot(along, near, tol=1e-30, verify=False)
    return mp.hypot(*(u - v for u, v in zip(point(t), state, strict=True)))


SADDLES = {
    "bouncing_ball": (lambda: nsmaps.load_system("bouncing_ball", Gamma=1.3, r=0.5), [4.18879, 5.64897]),
    "vi_pair": (lambda: nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113), [0.34, 2.87]),
}


@pytest.mark.parametrize("name", SADDLES)
def test_the_stable_manifold_leads_to_the_saddle(name):
    """By the map itself, of which the reversed one knows nothing."""
    make, guess = SADDLES[name]
    system = make()
    saddle = nsmaps.periodic_orbit(system, guess)
    found = nsmaps.manifold(system, saddle, "stable", length=5.0, gap=0.02)
    assert set(found.ended) == {"length 5"}
    states = found.states
    for _ in range(6 if name == "bouncing_ball" else 2):  # which multiply a distance from the manifold by 590, and by 17,000
        states = system.first_return(states).image
    off = np.linalg.norm(system.coordinates.difference(states, saddle.states) / found.scale, axis=1)
    start = np.linalg.norm(system.coordinates.difference(found.states, saddle.states) / found.scale, axis=1)
    assert off.max() < 1e-4
    assert start.max() > 3


@pytest.mark.parametrize("name", SADDLES)
def test_the_unstable_manifold_is_mapped_to_itself(name):
    """The images of its states lie between neighbours of it, and its other end is where orbits from the saddle go."""
    make, guess = SADDLES[name]
    system = make()
    saddle = nsmaps.periodic_orbit(system, guess)
    found = nsmaps.manifold(system, saddle, length=6.0, gap=0.01)
    inner = found.arclength < (0.5 if name == "bouncing_ball" else 0.01)
    images = system.first_return(found.states[inner]).image
    for image in images[::5]:
        off = np.linalg.norm(system.coordinates.difference(found.states, image) / found.scale, axis=1)
        assert off.min() <= 0.01
    assert found.error < 1e-9


@pytest.mark.parametrize("which", ["unstable", "stable"])
def test_neighbours_are_close_but_for_jumps_of_the_map(pair, which):
    """The sides of a cut differ in a word of the map, or of the reversed one, within a few returns: one flight grazes."""
    system = pair(0.35)
    found = nsmaps.manifold(system, nsmaps.periodic_orbit(system, [0.34, 2.87]), which, length=6.0, gap=0.02)
    steps = system.coordinates.difference(found.states[1:], found.states[:-1]) / found.scale
    far, inside = np.linalg.norm(steps, axis=1), np.diff(found.side) == 0
    cut = inside & (np.diff(found.piece) != 0)
    assert far[inside & ~cut].max() <= 0.02
    assert far[cut].min() > 0.02
    assert cut.sum() > 0
    assert len(found.lines) == 2 + cut.sum()
    assert {"BB", "BTB"} <= set(system.first_return(found.states).words)


def test_a_side_that_ends_at_an_attractor_says_so():
    make, guess = SADDLES["bouncing_ball"]
    system = make()
    found = nsmaps.manifold(system, nsmaps.periodic_orbit(system, guess), length=8.0)
    side = found.ended.index("an attractor")
    sink = nsmaps.periodic_orbit(system, [guess[0], 2 * np.pi - guess[1]])
    assert found.states[found.side == side][-1] == pytest.approx(sink.states[0], abs=1e-6)


class Line(ReturnMap):
    """A map of one coordinate."""

    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        return plain_returns(self.coordinates, states, states / 2)


def test_what_has_no_manifold_is_refused(pair):
    system = pair(0.35)
    fixed = nsmaps.periodic_orbit(system, [0.8, 0.4])
    with pytest.raises(NsmapsError, match=message("dynamics.no-saddle")):
        nsmaps.manifold(system, fixed)
    saddle = nsmaps.periodic_orbit(system, [0.34, 2.87])
    with pytest.raises(
        NsmapsError,
        match=message("errors.value", name="which", value="'both'", expected="'unstable' or 'stable', as in manifold"),
    ):
        nsmaps.manifold(system, saddle, "both")
    with pytest.raises(NsmapsError, match=message("dynamics.lengths", length=0, gap=0.02)):
        nsmaps.manifold(system, saddle, length=0)
    with pytest.raises(NsmapsError, match=message("dynamics.no-inverse", map="Bent")):
        nsmaps.manifold(Bent(), nsmaps.periodic_orbit(Bent(), [0.1, 0.1]), "stable")
    with pytest.raises(NsmapsError, match=message("dynamics.wrong-inverse")):
        nsmaps.manifold(Bent(), nsmaps.periodic_orbit(Bent(), [0.1, 0.1]), "stable", inverse=Henon())
    with pytest.raises(NsmapsError, match=message("dynamics.manifold-of-plane", number=1)):
        nsmaps.manifold(Line(), fixed)
    lost = system.at(r=0.0)
    with pytest.raises(NsmapsError, match=message("exact.no-speed-left", system="VIPair", wall="B")):
        reversed_system(lost)


def test_the_reversed_system_leads_back(pair):
    """Images of 2,000 states, back by the reversed system, words backwards."""
    for system, speed in ((pair(0.35), 1.2), (SADDLES["bouncing_ball"][0](), 3.0)):
        rng = np.random.default_rng(0)
        states = np.column_stack([rng.uniform(0.05, speed, 2000), rng.uniform(0, 2 * np.pi, 2000)])
        there = system.first_return(states)
        moving = there.outcome == 0
        back = system.inverse().first_return(there.image[moving])
        off = system.coordinates.difference(back.image, states[moving])
        assert np.abs(off).max() < 1e-10
        assert [word[::-1] for word in back.words] == there.words[moving].tolist()
