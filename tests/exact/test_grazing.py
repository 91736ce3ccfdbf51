"""Grazing curves against 60 digits, against closed forms, and against fine grids: none is missed, all are where they are said."""

from functools import cache, partial
from math import pi, sqrt
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from digits import in_balls, number, root
from flint import arb, ctx
from messages import message
from scipy.spatial import cKDTree
from systems import BouncingBall, Oscillator, Table

from nsmaps.coordinates import TWO_PI, nearest_turn
from nsmaps.errors import StateError

BOXES = {"paper": {"v": (0.01, 1), "phi": (0, pi)}, "whole": {"v": (0.001, 1.07), "phi": (0, TWO_PI)}}
CASES = [(d, box) for d in (0.26, 0.30, 0.35) for box in BOXES]


@pytest.fixture(scope="module")
def curves(pair):
    """The grazing curves of the VI pair by d and the name of the box, each computed once."""
    known = {}

    def of(d, box):
        if (d, box) not in known:
            known[d, box] = pair(d).grazing_curves(BOXES[box], spacing=0.002)
        return known[d, box]

    return of


in_mpmath = partial(sp.lambdify, modules="mpmath", cse=True)


@cache
def formula(system, function_of=in_mpmath):
    """The user's displacement and its rate as functions of (t, t0, z0, w0), in mpmath or in balls."""
    t, t0, z0, w0 = sp.symbols("t t0 z0 w0", real=True)
    expr = system.displacement(t, SimpleNamespace(t=t0, z=z0, w=w0))
    return tuple(function_of((t, t0, z0, w0), each) for each in (expr, sp.diff(expr, t)))


def touching(system, curve, phi, v, times):
    """The speed v, near that given, at which the flight from phase phi touches the curve's wall, and the times of its impacts.

    Newton's method in 60 digits on the formulas: every impact of the word lies on its wall, and the touch is one of speed zero.
    """
    place, velocity = formula(system, in_balls)
    walls = system.walls()
    r = number(system.r)

    def equations(v, *times):
        base = walls[curve.word[0]]
        start = number(phi) / arb.pi(), number(base.at), -base.side * r * v
        off = []
        for t, letter in zip(times, [*curve.word[1:], curve.wall], strict=True):
            wall = walls[letter]
            off.append(place(t, *start) - number(wall.at))
            rate = velocity(t, *start)
            start = t, number(wall.at), -r * rate
        return [*off, rate]

    return root(equations, (v, *times))


@pytest.mark.parametrize("d", [0.26, 0.30, 0.35])
def test_points_against_sixty_digits(pair, curves, d):
    """At some 10 phases on each curve: the speed by an independent solution, and the flights on both sides of it differ."""
    system = pair(d)
    assert {curve.word for curve in curves(d, "whole")} == {"B", "BT"}
    with ctx.workdps(60):
        for curve in curves(d, "whole"):
            slopes = np.gradient(curve.points[:, 0], curve.points[:, 1])
            for k in range(2, len(curve.points) - 2, max(1, len(curve.points) // 10)):
                v, phi = curve.points[k]
                hits = system.impacts([v, phi], len(curve.word))
                times = [phi / pi + t for t in (*hits.time[1:], hits.time[-1] + curve.touch[k])]
                speed, *_, touch = touching(system, curve, phi, v * (1 + 1e-7), [t * (1 + 1e-7) for t in times])
                assert abs(speed - number(v)) < 1e-12 * (1 + abs(slopes[k])), (curve.wall, curve.word, v, phi)
                assert abs(touch - number(times[-1])) < 1e-8
                sides = system.itineraries([[v - 1e-9, phi], [v + 1e-9, phi], [v, phi - 1e-9], [v, phi + 1e-9]]).words
                assert sides[0] != sides[1] or sides[2] != sides[3]
                assert curve.hit[k] != curve.missed[k]


@pytest.mark.parametrize("d", [0.26, 0.30, 0.35])
def test_the_sides_and_what_the_image_does(pair, curves, d):
    """On one side the wall is hit at the time of the touch, on the other it is not; a graze of the base wall is a jump."""
    system = pair(d)
    found = curves(d, "whole")
    assert found
    for curve in found:
        k = np.arange(6, len(curve.points) - 6, 10)
        states, normal = curve.points[k], np.gradient(curve.points, axis=0)[k][:, ::-1] * [1, -1]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        near, far = ([system.first_return(states + side * eps * normal) for side in (-1, 1)] for eps in (1e-11, 1e-9))
        leaps = [np.abs(one.time - other.time) for one, other in (near, far)]
        words = [{str(word) for word in pair} for pair in zip(*(side.words for side in near), strict=True)]
        assert curve.jumps == (curve.wall == "B")
        if curve.wall == "B":
            assert leaps[0].min() > 0.01
            assert np.median(np.abs(leaps[0] / leaps[1] - 1)) < 0.3
        else:
            assert np.median(np.abs(leaps[0] / leaps[1] - 0.1)) < 0.01  # a square root
            assert all(pair == {curve.word + "B", curve.word + "TB"} for pair in words)
        assert {frozenset(pair) for pair in curve.words} == set(map(frozenset, words))


@pytest.mark.thorough
def test_ends(curves):
    """A curve ends on the box, or where another one passes; its two sides are told along it."""
    for d, name in CASES:
        found = curves(d, name)
        assert found
        box = np.array([*BOXES[name].values()])
        for curve in found:
            others = [other.points for other in found if other is not curve]
            for end, point in zip(curve.ends, curve.points[[0, -1]], strict=True):
                assert end in ("box", "graze")
                if end == "box":
                    assert np.abs(point[:, None] - box).min() < 1e-11
                else:
                    assert min(distance(point, points) for points in others) < 3e-5


def distance(point, points):
    """From a state to a polyline, whatever the turn."""
    start = points[:-1] - np.array([0, TWO_PI]) * np.round((points[:-1, 1:] - point[1]) / TWO_PI)
    step = np.diff(points, axis=0)
    share = np.clip(((point - start) * step).sum(axis=1) / (step**2).sum(axis=1), 0, 1)
    return np.linalg.norm(start + share[:, None] * step - point, axis=1).min()


def test_each_is_traced_once(curves):
    for d, name in CASES:
        found = curves(d, name)
        assert found
        for i, curve in enumerate(found):
            middle = curve.points[len(curve.points) // 2]
            for other in found[i + 1 :]:
                same = (other.wall, other.word) == (curve.wall, curve.word)
                assert not same or distance(middle, other.points) > 1e-3


def edges(system, box, n, differ):
    """Where neighbours of a fine grid differ: states within 1e-10 of each place where they still do, by halving."""
    low, high = np.array([*box.values()]).T
    mesh = np.stack(np.meshgrid(*np.linspace(low, high, n).T, indexing="ij"), axis=-1).reshape(-1, 2)
    number, returns = np.arange(n * n).reshape(n, n), system.first_return(mesh)
    a = np.concatenate([number[:-1].ravel(), number[:, :-1].ravel()])
    b = np.concatenate([number[1:].ravel(), number[:, 1:].ravel()])
    keep = differ(returns.select(a), returns.select(b))
    a, b = mesh[a[keep]], mesh[b[keep]]
    for _ in range(30):
        middle = (a + b) / 2
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        keep = differ(system.first_return(a), system.first_return(b))
        a, b = a[keep], b[keep]
    return a


def other_word(one, other):
    return one.codes != other.codes


def jumped(one, other):
    leap = np.abs(one.image[:, 1] - nearest_turn(other.image[:, 1], one.image[:, 1]))
    return np.maximum(leap, np.abs(one.image[:, 0] - other.image[:, 0])) > 0.1


@pytest.mark.parametrize(("d", "name"), CASES)
@pytest.mark.parametrize("differ", [other_word, jumped])
def test_no_edge_of_a_fine_grid_is_missed(pair, curves, d, name, differ):
    """Every change of word, and every jump of the image that stays when it is halved down, lies on a curve."""
    states = edges(pair(d), BOXES[name], 501, differ)
    assert len(states) > 500
    off = np.min([distances(states, curve.points) for curve in curves(d, name)], axis=0)
    assert off.max() < 2e-5  # what chords are off by


def distances(states, points):
    """From states to the segments of a polyline beside the vertices that are next to them, whatever the turn, or farther."""
    nearest = cKDTree(points % [np.inf, TWO_PI], boxsize=[0, TWO_PI]).query(states % [np.inf, TWO_PI])[1]
    ends = points[np.clip(nearest[:, None] + [-1, 0, 1], 0, len(points) - 1)]
    start, step = ends[:, :-1], np.diff(ends, axis=1)
    off = states[:, None] - start
    off[..., 1] -= TWO_PI * np.round(off[..., 1] / TWO_PI)
    share = np.clip((off * step).sum(axis=2) / np.maximum((step**2).sum(axis=2), np.finfo(float).tiny), 0, 1)
    return np.linalg.norm(off - share[..., None] * step, axis=2).min(axis=1)


def test_births_of_turns_are_no_edges(pair, curves):
    """Where a pair of turns appears away from every wall there is no curve, and the map is smooth."""
    system = pair(0.30)
    low, high = np.array([0.4, 0.6]), np.array([0.7, 0.6])
    before, behind = system.itineraries([low, high]).words
    assert (before, behind) == ("Bv^TB", "BTB")
    for _ in range(45):
        middle = (low + high) / 2
        low, high = (middle, high) if system.itineraries([middle]).words[0] == before else (low, middle)
    assert min(distance(low, curve.points) for curve in curves(0.30, "paper")) > 0.05
    one, other = system.first_return(low + np.array([[-1e-6, 0], [1e-6, 0]])).image
    assert np.abs(one - other).max() < 1e-4


def test_parabolas_touch_the_ceiling_at_one_speed():
    """A ball thrown up at 0.9 v reaches the ceiling at height h for v = sqrt(2 h)/0.9, at every phase: one closed curve."""
    (curve,) = Table(height=0.6).grazing_curves({"v": (0, 2), "phi": (0, TWO_PI)})
    assert (curve.wall, curve.word, curve.closed, curve.jumps) == ("C", "F", True, False)
    assert curve.words == (("FCF", "FF"),)
    assert np.abs(curve.points[:, 0] - sqrt(1.2) / 0.9).max() < 1e-15
    assert np.abs(curve.touch - sqrt(1.2)).max() < 1e-14
    assert curve.length[-1] == pytest.approx(TWO_PI, rel=1e-14)
    assert (np.diff(curve.length) > 0).all()


def oscillator_touch(system, s, wall, near):
    """The state (v, phi), of phase nearest to that given, whose flight touches a wall after a time s: in closed form.

    Displacement and velocity at s are linear in the velocity w after the impact and in cos and sin of the phase.
    """
    place, velocity = formula(system)
    s, turn = mp.mpf(s), 2 * mp.pi / mp.mpf(system.w)
    gap = mp.mpf(system.gap)

    def at(share, w):
        return mp.matrix([f(share * turn + s, share * turn, gap, w) for f in (place, velocity)])

    middle, quarter = at(mp.mpf(0), 0), at(mp.mpf(1) / 4, 0)
    opposite = at(mp.mpf(1) / 2, 0)
    by_w, rest = at(mp.mpf(0), 1) - middle, (middle + opposite) / 2
    cosine, sine = middle - rest, quarter - rest
    target = mp.matrix([mp.mpf(system.walls()[wall].at), 0]) - rest
    a, b, c = (by_w[1] * x[0] - by_w[0] * x[1] for x in (cosine, sine, target))  # a cos phi + b sin phi = c
    both = [mp.atan2(b, a) + sign * mp.acos(c / mp.hypot(a, b)) for sign in (1, -1)]
    phi = min((x + 2 * mp.pi * mp.nint((mp.mpf(near) - x) / (2 * mp.pi)) for x in both), key=lambda x: abs(x - near))
    k = 0 if abs(by_w[0]) > abs(by_w[1]) else 1
    w = (target[k] - cosine[k] * mp.cos(phi) - sine[k] * mp.sin(phi)) / by_w[k]
    return -w / mp.mpf(system.r), phi


def test_an_oscillator_in_closed_form():
    system = Oscillator(zeta=0.05, w=0.81, gap=0.7)
    curves = system.grazing_curves({"v": (0.05, 2), "phi": (0, TWO_PI)}, n_lines=200)
    assert {(curve.wall, curve.word) for curve in curves} >= {("R", "R"), ("L", "R"), ("L", "RL"), ("R", "RL")}
    with mp.workdps(30):
        for curve in (curve for curve in curves if curve.word == "R"):
            for k in range(0, len(curve.points), 10):
                v, phi = oscillator_touch(system, curve.touch[k], curve.wall, curve.points[k, 1])
                bend = np.abs(np.gradient(curve.points, curve.touch, axis=0)[k]).max()  # of the state by the time given
                assert max(abs(v - curve.points[k, 0]), abs(phi - curve.points[k, 1])) < 1e-12 * (1 + bend)
    ends = {(curve.wall, curve.word): curve.ends for curve in curves}
    assert "inflection" in ends["R", "RL"]


def test_one_wall_and_a_curve_that_comes_to_rest():
    """The bouncing ball: from v = 0 at the phase of release, cos... a sin phi = 1, to the flight without a turn at the table."""
    (curve,) = BouncingBall(a=1.3).grazing_curves({"v": (0, 4), "phi": (0, TWO_PI)})
    assert (curve.wall, curve.word, curve.ends) == ("B", "B", ("rest", "inflection"))
    assert curve.points[0] == pytest.approx([0, np.arcsin(1 / 1.3)], abs=1e-5)
    assert BouncingBall(a=1.3).grazing_curves({"v": (0, 4), "phi": (1, 5)}) == ()


@pytest.mark.parametrize(
    ("box", "how", "said"),
    [
        ({"v": (0, 1)}, {}, message("coordinates.box-lacks", name="phi")),
        ({"v": (0, 1), "psi": (0, 1)}, {}, message("coordinates.foreign-near", name="psi", near="phi")),
        ({"v": (-1, 1), "phi": (0, 1)}, {}, message("exact.speeds", low=-1, high=1)),
        ({"v": (1, 1), "phi": (0, 1)}, {}, message("coordinates.box-with-angles", box="v from 1.0 to 1.0")),
        ({"v": (0, 1), "phi": (0, 7)}, {}, message("coordinates.box-with-angles", box="phi from 0.0 to 7.0")),
        ({"v": (0, float("inf")), "phi": (0, 1)}, {}, message("coordinates.box-with-angles", box="v from 0.0 to inf")),
        ({"v": (0, 1), "phi": (0, 1)}, {"n_lines": 1}, message("exact.lines", number=1)),
        ({"v": (0, 1), "phi": (0, 1)}, {"spacing": 0}, message("exact.lines", spacing=0)),
    ],
)
def test_what_is_no_box_is_refused(pair, box, how, said):
    with pytest.raises(StateError, match=said):
        pair(0.3).grazing_curves(box, **how)
