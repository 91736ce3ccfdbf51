"""2:1 beside 1:1 motion by BB, BTB and BBTB pieces, against the equations of motion in 30 digits and in SciPy."""

import json
from functools import lru_cache

import mpmath as mp
import numpy as np
import pytest
from numpy.polynomial import Chebyshev
from ruamel.yaml import YAML
from scipy.optimize import brentq

import nsmaps
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.exact.surfaces.sweep import surfaces
from nsmaps.plugins import study_files
from nsmaps.reduced.composite.composite import PieceSpec, build_composite
from nsmaps.reduced.composite.parametric import chebyshev_nodes, parametric_map
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.polyfit import PolynomialFit

D, R = 0.2265, 0.25
G_BAR = 0.1245 * 9.8 * np.sin(np.pi / 6) / 5
SECTIONS = ("system", "parameters", "grid", "families", "composite", "require")


def flight(lib, t, t0, z0, w):
    """Place and velocity at t of the ball relative to the capsule after an impact at t0, eq. relvar: Z'' = cos(pi t) + g_bar."""
    s, pi = t - t0, lib.pi
    drift = w - lib.sin(pi * t0) / pi
    place = z0 + drift * s + G_BAR * s**2 / 2 - (lib.cos(pi * t) - lib.cos(pi * t0)) / pi**2
    return place, drift + G_BAR * s + lib.sin(pi * t) / pi


def closing(d, v, phase, one, two):
    """What a 2:1 motion makes zero: B at `phase`, B after `one`, T after `two` more, B a period of 2 later with the speed v."""
    t0 = phase / mp.pi
    times = [t0, t0 + one, t0 + one + two, t0 + 2]
    walls, w, off = [d / 2, d / 2, -d / 2, d / 2], -R * v, []
    for k in range(3):
        place, velocity = flight(mp, times[k + 1], times[k], walls[k], w)
        off.append(place - walls[k + 1])
        w = -R * velocity
    return [*off, velocity - v]


@lru_cache
def two_to_one():
    """The 2:1 motion at d = 0.2265: v, phase, and the times of its first two flights."""
    guess = [mp.mpf(each) for each in ("0.654", "0.41", "0.45", "0.65")]
    with mp.workdps(30):
        return list(mp.findroot(lambda *each: closing(mp.mpf(D), *each), guess, tol=1e-24))


def d_of(phase):
    """The d at which 2:1 motion has a phase."""
    v, _, one, two = two_to_one()
    return mp.findroot(lambda d, v, a, b: closing(d, v, phase, a, b), [mp.mpf(D), v, one, two], tol=1e-24)[0]


@lru_cache
def fold():
    """The largest d of 2:1 motion, over its phase: of the polynomial through nine of them."""
    phases = 0.4275 + 0.006 * np.cos(np.pi * (np.arange(9) + 0.5) / 9)
    with mp.workdps(20):
        curve = Chebyshev.fit(phases, [float(d_of(mp.mpf(phase))) for phase in phases.tolist()], 8)
    (top,) = (each.real for each in curve.deriv().roots() if abs(each.imag) < 1e-9 and phases.min() < each.real < phases.max())
    return float(curve(top))


def next_impact(d, t0, wall, w):
    """Time, wall and velocity of the next impact, by small steps and Brent's method."""
    times = t0 + np.linspace(1e-4, 3, 3000)
    place = flight(np, times, t0, wall * d / 2, w)[0]
    k = int(np.argmax(np.abs(place) > d / 2))
    there = 1 if place[k] > 0 else -1
    low = times[k - 1] if k else t0 + 1e-9
    t = brentq(lambda t: flight(np, t, t0, wall * d / 2, w)[0] - there * d / 2, low, times[k], xtol=1e-14)
    return t, there, flight(np, t, t0, wall * d / 2, w)[1]


@lru_cache
def chaos(returns=1500):
    """The impacts on B of 1:1 motion, and which of them follow one on B, as the equations of motion have them."""
    t, wall, velocity, found, slow = 0.48 / np.pi, 1, 0.67, [], []
    while len(found) < returns:
        before = wall
        t, wall, velocity = next_impact(D, t, wall, -R * velocity)
        if wall == 1:
            found.append((velocity, np.pi * t % (2 * np.pi)))
            slow.append(before == 1)
    return np.array(found)[100:], np.array(slow)[100:]


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """The run of a part of the study."""
    whole = YAML(typ="safe").load(study_files("vi_pair")["augmented"].read_text())
    part = {name: whole[name] for name in SECTIONS}
    part["orbits"] = whole["orbits"][:2]
    starts = {name: side | {"points": 40} for name, side in whole["basins"]["starts"].items()}
    part["basins"] = whole["basins"] | {"starts": starts}
    part["noise"] = whole["noise"] | {"sigma": [0.005], "n_returns": 400, "n_realisations": 16}
    study = tmp_path_factory.mktemp("augmented") / "part.yaml"
    study.write_text(json.dumps(part))
    return nsmaps.run_study(study)


def test_2_1_motion_is_a_fixed_point_of_the_piece_of_two_returns(result):
    pieces = {piece.name: piece for piece in result.composite.pieces}
    assert {(piece.word, piece.returns) for name, piece in pieces.items() if name.startswith("L")} == {("BBTB", 2)}
    v, phase = map(float, two_to_one()[:2])
    ends = result.orbits[1].composite_ends
    assert (ends.period, ends.label, ends.words, ends.stable) == (2, "2:1, period 2", ("BBTB",), True)
    assert ends.states[0] == pytest.approx([v, phase], abs=1e-4)
    exact = result.orbits[1].ends
    assert exact.states[np.argmax(exact.states[:, 0])] == pytest.approx([v, phase], abs=1e-9)
    assert ends.multipliers.real == pytest.approx(exact.multipliers.real, abs=0.01)
    verdicts = [v for v in result.verdicts if v.name.endswith("same attractor as the exact map")]
    assert [verdict.holds for verdict in verdicts] == [True, True]
    assert "after as many returns as the pieces have" in verdicts[1].text


def test_1_1_motion_is_chaos_of_the_composite_map(result):
    """The share of returns that follow an impact on B, and the hull of the states that the composite map has."""
    states, slow = chaos()
    path = nsmaps.orbit(result.composite, [0.67, 0.48], 4000)
    ours, returns = path.states[100:], path.numbers[100:]
    share = (returns == 2).sum() / returns.sum()
    assert share == pytest.approx(slow.mean(), abs=3 * np.sqrt(slow.mean() / len(slow)))
    fast = states[~slow]
    assert ours.max(axis=0) == pytest.approx(fast.max(axis=0), abs=2e-3)
    assert ours.min(axis=0) == pytest.approx(fast.min(axis=0), abs=2e-3)
    exact = result.orbits[0].ends
    assert result.orbits[0].composite_ends.exponent == pytest.approx(exact.exponent, abs=4 * exact.exponent_error)


def test_basins_and_noise_of_both_maps(result):
    shares = result.basins.fractions, result.reduced_basins.fractions
    assert [each.label for each in result.reduced_basins.attractors] == ["2:1, period 2", "C"]
    assert shares[1] == pytest.approx(shares[0], abs=0.02)
    (counted,), (reduced,) = result.noise.counted, result.noise.reduced
    assert counted.modes == reduced.modes == ("1:1", "2:1")
    assert min(counted.switches[0, 1], reduced.switches[0, 1]) >= 8
    ratio = reduced.rates[0, 1] / counted.rates[0, 1]
    assert 1 / 3 < ratio < 3
    titles = [table.title for section in (result.study.basins, result.study.noise) for table in section.tables(result)]
    assert any(title.startswith("Basins of the composite map") for title in titles)
    assert "Motions under noise" in titles


@pytest.mark.thorough
def test_the_bistable_window_ends_at_a_fold_of_both_maps(pair):
    """2:1 motion of the exact map, and of the piece around it as a function of d."""
    system, start = pair(D, r=R, beta=np.pi / 6), np.array(two_to_one()[:2], float)
    exact = nsmaps.continue_branch(system, "d", nsmaps.periodic_orbit(system, start, 2), D, (D, 0.23), direction="up")
    (event,) = (event for event in exact.events if event.kind == "fold")
    assert event.value == pytest.approx(fold(), abs=1e-9)
    assert fold() == pytest.approx(0.227713761, abs=1e-9)
    where = next(
        p["where"]
        for p in YAML(typ="safe").load(study_files("vi_pair")["augmented"].read_text())["composite"]
        if p["name"] == "L5"
    )
    region = ConditionRegion(text=where, coordinates=system.coordinates)
    piece = PieceSpec(name="L5", region=region, family="BBTB", fit=PolynomialFit(degrees={"v": 4, "phi": 4}))
    grid = Grid(axes={"v": Axis(low=0.62, high=0.7, points=40), "phi": Axis(low=0.28, high=0.48, points=80)})
    family = nsmaps.WordFamily(name="BBTB", words=("BBTB",))

    def fitted(d):
        there = system.at(d=d)
        return build_composite(there.coordinates, there.letters, surfaces(there, grid, [family]), [piece])

    ends = (0.226, 0.23)
    fits = {d: fitted(d) for d in chebyshev_nodes(ends, 5).tolist()}
    along = parametric_map(fits, "d", ends, 3).at
    orbit = nsmaps.periodic_orbit(along(D), start)
    assert (orbit.period, orbit.label) == (2, "2:1, period 2")
    branch = nsmaps.continue_branch(along, "p", orbit, D, (D, 0.23), direction="up")
    (event,) = (event for event in branch.events if event.kind == "fold")
    assert event.value == pytest.approx(fold(), abs=3e-5)
