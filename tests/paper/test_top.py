"""The top membrane as base: returns by TT, TBT and TBBT against 40 digits, the symmetry of the pair, and the motions on B."""

import mpmath as mp
import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import ParameterError

GIVEN = {"M": 0.1245, "g": 9.8, "beta": np.pi / 3, "F": 5}
STARTS = (
    [0.5, 3.0],
    [0.55161596, 4.22765816],
    [0.2, 0.1],
    [0.9, 4.0],
    [0.05, 2.5],
    [0.7, 5.5],
    [1.1, 0.4],
    [0.35, 6.1],
)

HALF = np.array([0, np.pi])  #: half a period of the forcing


def at(d, base="T", **others):
    return nsmaps.load_system("vi_pair", **{"d": d, "base": base, **GIVEN, **others})


GRID = np.linspace(0, 4, 40001)  #: times after an impact, in floats, at which the next is looked for


def returned(speed, phase, d, g_bar):
    """The first return to T in 40 digits, from Z'' = g_bar + cos(pi t): the first wall that each flight meets."""
    g, wall = mp.mpf(g_bar), mp.mpf(d) / 2
    time, place, velocity, word = mp.mpf(phase) / mp.pi, -wall, mp.mpf(speed) / 2, "T"
    while len(word) < 2 or word[-1] != "T":
        drift = velocity - mp.sin(mp.pi * time) / mp.pi

        def displacement(s, start=(time, place, drift), of=mp):
            t, z, c = start if of is mp else [float(each) for each in start]
            return z + c * s + (g if of is mp else g_bar) * s * s / 2 + (of.cos(of.pi * t) - of.cos(of.pi * (t + s))) / of.pi**2

        beyond = np.abs(displacement(GRID, of=np)) > d / 2
        k = int(np.argmax(beyond))
        assert k > 1
        place = wall if displacement(GRID[k], of=np) > 0 else -wall
        s = mp.findroot(lambda s, wall=place: displacement(s) - wall, (GRID[k - 1], GRID[k]), solver="anderson")
        time, letter = time + s, "B" if place > 0 else "T"
        speed = abs(drift + g * s + mp.sin(mp.pi * time) / mp.pi)
        velocity, word = (-speed / 2 if letter == "B" else speed / 2), word + letter
    return speed, mp.fmod(mp.pi * time, 2 * mp.pi), word


def test_first_returns_to_the_top_agree_with_40_digits():
    words = set()
    with mp.workdps(40):
        for d in (0.35, 0.26):
            system = at(d)
            made = system.first_return(STARTS)
            for k, start in enumerate(STARTS):
                speed, phase, word = returned(*start, d, system.g_bar)
                assert made.words[k] == word
                assert made.image[k] == pytest.approx([float(speed), float(phase)], abs=1e-13)
            words |= set(made.words)
    assert {"TT", "TBT", "TBBT"} <= words


@pytest.mark.parametrize(("d", "r"), [(0.35, 0.5), (0.2265, 0.25)])
def test_the_pair_is_its_mirror_image_half_a_period_later_with_the_other_gravity(d, r):
    """-Z(t - 1) obeys the equation with -g_bar: P_T(v, phi; g_bar) is P_B(v, phi + pi; -g_bar), its phase less pi."""
    rng = np.random.default_rng(1)
    states = np.column_stack([rng.uniform(0, 1.2, 3000), rng.uniform(0, 2 * np.pi, 3000)])
    top = at(d, r=r)
    bottom = nsmaps.load_system("vi_pair", d=d, r=r, g_bar=-top.g_bar)
    ours, mirrored = top.first_return(states), bottom.first_return(states + HALF)
    assert np.array_equal(ours.outcome, mirrored.outcome)
    assert ours.words.tolist() == [word.translate(str.maketrans("BT", "TB")) for word in mirrored.words]
    apart = np.abs(top.coordinates.difference(ours.image + HALF, mirrored.image))
    assert np.nanmax(apart) < 1e-7, "as far as rounding is amplified next to grazes"
    assert np.nanmedian(apart) < 1e-14


@pytest.mark.parametrize(
    ("d", "cycle", "multipliers"),
    [
        (0.35, [[0.83338599021, 0.36361156455]], [-0.82672902, -0.07559914]),
        (0.30, [[0.8102255, 0.4129054], [0.7305496, 0.2227505]], None),
    ],
)
def test_cycles_on_the_top_are_those_on_the_bottom_with_the_same_multipliers(d, cycle, multipliers):
    bottom, top = at(d, "B"), at(d)
    at_bottom = nsmaps.periodic_orbit(bottom, cycle[0], len(cycle))
    hits = bottom.impacts(at_bottom.states[0], 2)
    assert hits.walls[hits.wall[1]] == "T"
    at_top = nsmaps.periodic_orbit(top, [hits.speed[1], hits.phase[1]], len(cycle))
    assert at_top.states[0] == pytest.approx([hits.speed[1], hits.phase[1]], abs=1e-12)
    assert set(at_top.returns.words) == {"TBT"}
    ours = np.sort(np.linalg.eigvals(at_top.derivative).real)
    assert ours == pytest.approx(np.sort(np.linalg.eigvals(at_bottom.derivative).real), abs=1e-9)
    if multipliers:
        assert ours == pytest.approx(multipliers, abs=1e-8)


def test_two_to_one_motion_is_a_fixed_point_on_the_top():
    """At d = 0.2265, r = 0.25, beta = pi/6 the 2:1 motion BB BTB of two returns to B is one return TBBT to T, named 1:2 there."""
    top = at(0.2265, r=0.25, beta=np.pi / 6)
    end = nsmaps.periodic_orbit(top, nsmaps.orbit(top, [0.6, 0.3], 500).final)
    assert (end.label, end.returns.words.tolist()) == ("1:2/T", ["TBBT"])
    hits = top.impacts(end.states[0], 3)
    bottom = at(0.2265, "B", r=0.25, beta=np.pi / 6)
    there = nsmaps.periodic_orbit(bottom, [hits.speed[1], hits.phase[1]], 2)
    assert there.label == "2:1/T"
    assert np.prod(np.linalg.eigvals(end.derivative)).real == pytest.approx(0.25**6, rel=1e-6), "r^2 for each of three impacts"


def test_rest_on_the_top_ends_where_the_acceleration_turns_away():
    """Z'' = g_bar + cos(phi) is below zero, into T, for phi from arccos(-g_bar) to 2 pi - arccos(-g_bar)."""
    top = at(0.35)
    orbit = nsmaps.orbit(top, [1e-4, 3.0], 60)
    rests = [word[1] == "~" for word in orbit.words]
    assert any(rests)
    release = [0, 2 * np.pi - np.arccos(-top.g_bar)]
    assert orbit.states[1:][rests][0] == pytest.approx(release, abs=1e-12)
    rest = top.first_return([[0.0, 2.0]])
    assert (rest.words.tolist(), rest.image[0]) == (["T_"], pytest.approx(release, abs=1e-12))


def test_a_membrane_that_is_neither_is_an_error():
    with pytest.raises(ParameterError, match=message("errors.unknown", known="B, T")):
        at(0.35, base="L")
