"""Images of boxes against exact returns of their states, references in 50 digits, and the arithmetic against mpmath."""

import re
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message
from systems import BouncingBall, DraggedBall, Oscillator, Table

from nsmaps.errors import ProofError, StateError
from nsmaps.exact.compiling.compiled import njit
from nsmaps.exact.enclosure.arithmetic import balls, elementary
from nsmaps.exact.enclosure.arithmetic.formulas import ball_code
from nsmaps.exact.systems.system import ImpactSystem

#: What the VI pair has not: one wall, terms that decay, a law of rebound that is not linear; then what has them one by one.
ONE_BY_ONE: list[ImpactSystem] = [BouncingBall(a=3.0), Table(height=1.0), Oscillator(zeta=1, w=0.8, gap=0.3, damping="critical")]
TOYS = [DraggedBall(a=1.0), DraggedBall(a=3.0, r=0.8), *(pytest.param(toy, marks=pytest.mark.thorough) for toy in ONE_BY_ONE)]
WINDOW = np.array([[0.55, 1.0], [0.05, 1.25]])


def boxes_around(centres, sides):
    """Boxes of given sides, speeds cut off at zero."""
    boxes = np.stack([centres - sides / 2, centres + sides / 2], axis=-1)
    boxes[:, 0] = np.maximum(boxes[:, 0], 0)
    return boxes


def random_boxes(rng, number, size, fastest=1.3):
    centres = np.column_stack([rng.uniform(0, fastest, number), rng.uniform(0, 2 * np.pi, number)])
    return boxes_around(centres, size * rng.random((number, 2)))


def states_in(boxes, rng, number=200):
    """States of each box, shape (N, number, 2): corners, midpoints of sides, and random ones."""
    share = rng.random((len(boxes), number, 2))
    share[:, :9] = [(a, b) for a in (0, 0.5, 1) for b in (0, 0.5, 1)]
    low, high = boxes[:, None, :, 0], boxes[:, None, :, 1]
    return np.clip(low + share * (high - low), low, high)


def missed(system, boxes, rng, rounding=1e-12):
    """The states whose exact image lies in no image box of their word: none but for the rounding of the exact map."""
    found = system.image_boxes(boxes)
    states = states_in(boxes, rng)
    returns = system.first_return(states.reshape(-1, 2))
    shape = states.shape[:2]
    images, words, valid = returns.lifted.reshape(states.shape), returns.words.reshape(shape), returns.valid.reshape(shape)
    held = ~found.bounded[:, None] | (~valid & found.empty[:, None])
    for source, (low, high), word in zip(found.source, found.images.transpose(0, 2, 1), found.words, strict=True):
        inside = ((images[source] >= low - rounding) & (images[source] <= high + rounding)).all(axis=1)
        held[source] |= inside & ((words[source] == word) | (word == ""))
    return states[~held], found


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
@pytest.mark.parametrize("size", [1e-6, 1e-4, 1e-2, 0.2])
def test_exact_images_lie_in_the_image_boxes(pair, d, size):
    rng = np.random.default_rng(int(1e6 * d))
    states, found = missed(pair(d), random_boxes(rng, 250, size), rng)
    assert len(states) == 0
    assert found.bounded.mean() > 0.9


@pytest.mark.parametrize("system", TOYS, ids=lambda system: type(system).__name__)
def test_exact_images_of_other_systems_lie_in_the_image_boxes(system):
    rng = np.random.default_rng(2)
    for size in (1e-5, 1e-2, 0.2):
        states, found = missed(system, random_boxes(rng, 60, size, fastest=3), rng, rounding=1e-11)
        assert len(states) == 0
        assert found.bounded.any()


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
def test_boxes_cut_by_grazes(pair, d):
    """At grazes of both walls, and with the words of both sides."""
    system, rng = pair(d), np.random.default_rng(3)
    curves = system.grazing_curves({"v": (0.05, 1.1), "phi": (0, 2 * np.pi)}, n_lines=150)
    assert {curve.wall for curve in curves} == {"B", "T"}
    for curve in curves:
        points = curve.points[rng.integers(0, len(curve.points), 15)]
        for size in (1e-5, 1e-3, 0.05):
            boxes = boxes_around(points, np.full((15, 2), size))
            states, found = missed(system, boxes, rng, rounding=1e-7)  # a start's rounding comes out as its root
            assert len(states) == 0
        middle = slice(len(curve.points) // 4, -len(curve.points) // 4, 7)
        found = system.image_boxes(boxes_around(curve.points[middle], np.full((len(curve.points[middle]), 2), 1e-4)))
        for source, sides in enumerate(zip(curve.hit[middle], curve.missed[middle], strict=True)):
            words = {side.replace("^", "").replace("v", "") for side in sides}
            assert not found.bounded[source] or words <= set(found.words[found.source == source].tolist())


def test_references_in_50_digits_lie_in_the_images_of_points(pair, reference):
    """At ordinary states to the last bit; the images of points are as wide as rounding."""
    rows = reference("first_returns")
    assert rows
    for row in rows:
        start = [float(row["v"]), float(row["phi"])]
        found = pair(row["d"], row["r"], {"pi/3": np.pi / 3, "pi/6": np.pi / 6}[row["beta"]]).image_boxes([np.c_[start, start]])
        assert found.bounded.all()
        assert found.words.tolist() == [row["word"]]
        (v, phi), turn = found.images[0], 2 * mp.pi
        assert (found.images[0, :, 1] - found.images[0, :, 0]).max() < 1e-11
        with mp.workdps(40):
            slack = mp.mpf(1e-14)  # parameters of the reference are not rounded, those of the system are
            phase = mp.mpf(row["phi1"]) + turn * mp.nint((mp.mpf(float(phi.mean())) - mp.mpf(row["phi1"])) / turn)
            assert v[0] - slack <= mp.mpf(row["v1"]) <= v[1] + slack
            assert phi[0] - slack <= phase <= phi[1] + slack


def test_an_image_that_its_corners_miss(pair):
    """Two corners of four make BB, and yet the image reaches 0.13 in speed and 0.48 in phase beyond those of all corners."""
    box = np.array([[0.65, 0.7], [0.15, 0.25]])
    system = pair(0.35)
    corners = system.first_return([(v, phi) for v in box[0] for phi in box[1]]).lifted
    inner = system.first_return([[0.65, 0.1875]])
    assert inner.words.tolist() == ["BB"]
    assert corners[:, 0].min() - inner.lifted[0, 0] > 0.13
    assert inner.lifted[0, 1] - corners[:, 1].max() > 0.48
    found = system.image_boxes([box])
    (image,) = found.images[found.words == "BB"]
    assert ((image[:, 0] < inner.lifted[0]) & (inner.lifted[0] < image[:, 1])).all()


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
def test_images_are_narrow_away_from_grazes(pair, d):
    """At most 1.3 times the true hull on a grid of 2^10 x 2^10: in the median, and at 99 of 100 boxes that make one word."""
    system, rng = pair(d), np.random.default_rng(4)
    sides = (WINDOW[:, 1] - WINDOW[:, 0]) / 1024
    boxes = boxes_around(rng.uniform(WINDOW[:, 0], WINDOW[:, 1], (600, 2)), np.tile(sides, (600, 1)))
    found = system.image_boxes(boxes)
    returns = system.first_return(states_in(boxes, rng).reshape(-1, 2))
    images, words = returns.lifted.reshape(600, -1, 2), returns.words.reshape(600, -1)
    one = (words == words[:, :1]).all(axis=1)
    hulls = found.hulls()
    wider = ((hulls[:, :, 1] - hulls[:, :, 0]) / np.ptp(images, axis=1))[one]
    assert one.mean() > 0.95
    assert np.median(wider) < 1.01
    assert np.quantile(wider, 0.99, axis=0).max() < 1.3


def test_a_box_beside_a_graze_has_a_narrow_image(pair):
    """Its states meet T slowly, where derivatives of the second order are huge: those of the first, and the box, know more."""
    found = pair(0.35).image_boxes([[[0.6407470703125, 0.640966796875], [0.2017578125, 0.20234375]]])
    assert found.words.tolist() == ["BTB"]
    assert (np.ptp(found.images[0], axis=1) < [0.3, 0.8]).all()


@pytest.mark.parametrize(("d", "most"), [(0.35, 1.5), (0.30, 1.1), (0.26, 1.1)])
def test_images_along_grazes_are_little_larger_than_those_of_2000_states(pair, d, most):
    """In all, of boxes of a grid of 2^8 x 2^8 on the curves in the window and up to three boxes from there."""
    system, rng = pair(d), np.random.default_rng(7)
    sides = (WINDOW[:, 1] - WINDOW[:, 0]) / 256
    curves = system.grazing_curves({"v": tuple(WINDOW[0]), "phi": tuple(WINDOW[1])}, n_lines=150)
    points = np.concatenate([curve.points[::7] for curve in curves])
    boxes = boxes_around(np.concatenate([points + shift * sides for shift in np.ndindex(7, 7)]) - 3 * sides, sides)
    inner = system.first_return(states_in(boxes, rng, 2000).reshape(-1, 2)).lifted.reshape(len(boxes), -1, 2)
    areas = np.ptp(system.image_boxes(boxes).hulls(), axis=-1).prod(axis=1)
    assert areas.sum() < most * np.ptp(inner, axis=1).prod(axis=1).sum()


@pytest.mark.parametrize("d", [0.35, 0.30, 0.26])
def test_an_orbit_stays_in_the_images_of_its_boxes(pair, d):
    """10^5 returns of the attractor, over a grid of 64 x 64 boxes of the window."""
    system = pair(d)
    orbit = system.orbits([[0.7, 0.4]], 101_000)
    start, image = orbit.start[1000:], orbit.lifted[1000:]
    place = np.floor(64 * (start - WINDOW[:, 0]) / (WINDOW[:, 1] - WINDOW[:, 0])).astype(int)
    assert ((place >= 0) & (place < 64)).all()
    cells, which = np.unique(place, axis=0, return_inverse=True)
    steps = (WINDOW[:, 1] - WINDOW[:, 0]) / 64
    boxes = boxes_around(WINDOW[:, 0] + (cells + 0.5) * steps, np.tile(steps * (1 + 1e-12), (len(cells), 1)))
    hulls = system.image_boxes(boxes).hulls()[which.ravel()]
    assert np.isfinite(hulls).all()
    assert ((image >= hulls[:, :, 0] - 1e-12) & (image <= hulls[:, :, 1] + 1e-12)).all()


def test_images_of_smaller_boxes_are_smaller(pair):
    """Not always so for a method that cuts boxes, but wherever no graze is near."""
    system, rng = pair(0.30), np.random.default_rng(5)
    boxes = random_boxes(rng, 500, 1e-4)
    ends = np.sort(rng.random((500, 2, 2)), axis=-1)
    inner = boxes[:, :, :1] + ends * (boxes[:, :, 1:] - boxes[:, :, :1])
    outer, found = system.image_boxes(boxes), system.image_boxes(inner)
    one = (np.bincount(outer.source, minlength=500) == 1) & outer.bounded
    hulls, others = outer.hulls()[one], found.hulls()[one]
    assert one.sum() > 450
    assert (hulls[:, :, 0] - 1e-14 <= others[:, :, 0]).all()
    assert (others[:, :, 1] <= hulls[:, :, 1] + 1e-14).all()


def test_phases_on_any_turn(pair):
    system = pair(0.35)
    box = np.array([[0.8, 0.801], [0.4, 0.401]])
    here, turn = system.image_boxes([box]).images, np.array([[0], [200 * np.pi]])
    there = system.image_boxes([box + turn]).images
    assert there == pytest.approx(here + turn, abs=1e-12)
    across, rng = boxes_around(np.array([[0.3, 2 * np.pi]]), np.array([[0.01, 0.02]])), np.random.default_rng(6)
    assert len(missed(system, across, rng)[0]) == 0


def test_where_nothing_is_known(pair):
    system = pair(0.35)
    found = system.image_boxes([[[0, 0], [0, 0]], [[0, 50], [-30, 30]], [[-1, -0.5], [0, 1]], [[-0.1, 0.001], [3, 3.001]]])
    assert found.bounded.tolist() == [False, False, True, True]  # a rest on B, too much, no states at all, none below zero
    assert found.empty.tolist() == [True, True, True, True]
    assert found.source.tolist() == [0, 1, 3]
    assert np.isinf(found.hulls()[:2]).all()
    assert np.isnan(found.hulls()[2]).all()
    assert system.image_boxes(np.empty((0, 2, 2))).hulls().shape == (0, 2, 2)


@pytest.mark.parametrize(
    ("boxes", "why"),
    [
        ([[1, 2]], message("errors.shape", what="boxes have", shape="(1, 2)")),
        ([[[1, 0], [0, 1]]], message("exact.box")),
        ([[[0, np.nan], [0, 1]]], message("exact.box")),
        ([[[0, 1], [0, np.inf]]], message("exact.box")),
        ([[[0, 1], [0, 1e13]]], message("exact.box")),
    ],
)
def test_what_is_no_box_is_refused(pair, boxes, why):
    with pytest.raises(StateError, match=why):
        pair(0.35).image_boxes(boxes)


def test_what_cannot_be_enclosed_is_refused():
    class Soft(BouncingBall):
        def rebound(self, speed, wall):
            return self.r * sp.atan(speed)

    with pytest.raises(ProofError, match=message("exact.not-enclosed", formula=re.compile("atan.*"))):
        Soft(a=1.0).image_boxes([[[0.5, 0.6], [0, 0.1]]])
    with pytest.raises(ProofError, match=message("exact.not-real")):
        ball_code(sp.I)


NUMBERS = st.floats(-20, 20)
RADII = st.one_of(st.just(0.0), st.floats(0, 2), st.floats(0, 1e-9))
UNARY = SimpleNamespace(
    binv=lambda x: 1 / x,
    bexp=mp.exp,
    bsqrt=mp.sqrt,
    blog=mp.log,
    babs=abs,
    wave_c=lambda x: mp.cos(x) - 1,
    wave_n=mp.sin,
    wave_r=lambda x: mp.sin(x) - x,
    growth_x=mp.expm1,
    growth_e=lambda x: mp.expm1(x) - x,
)
PARTS = {
    "wave_c": ("bwave", 0),
    "wave_n": ("bwave", 1),
    "wave_r": ("bwave", 2),
    "growth_x": ("bgrowth", 0),
    "growth_e": ("bgrowth", 1),
}


FUNCTIONS = {**vars(balls), **vars(elementary)}
OURS = {name: function for name, function in FUNCTIONS.items() if name.startswith("b") and callable(function)}
BALLS = {name: njit(cache=True)(function.py_func) for name, function in OURS.items()}


def held(ball, value):
    """Is a value of 40 digits in a ball, of which a NaN or infinite radius says that anything is."""
    return not np.isfinite(ball).all() or abs(value - mp.mpf(ball[0])) <= mp.mpf(ball[1])


@pytest.mark.thorough
@settings(deadline=None, max_examples=500)
@given(NUMBERS, RADII, NUMBERS, RADII, st.floats(-1, 1), st.floats(-1, 1))
def test_balls_hold_what_they_say(a, ra, b, rb, s, t):
    """Against 400 digits (what is left of exp loses 300 of them), at a place of each operand."""
    one, other = balls.Ball(a, ra), balls.Ball(b, rb)
    with mp.workdps(400):
        x, y = mp.mpf(a) + mp.mpf(s) * mp.mpf(ra), mp.mpf(b) + mp.mpf(t) * mp.mpf(rb)
        pairs = {"badd": x + y, "bsub": x - y, "bmul": x * y, "bmax": max(x, y), "bmin": min(x, y)}
        for name, value in pairs.items():
            assert held(BALLS[name](one, other), value), name
        assert held(BALLS["bplus"](one, other, one), x + y * x)
        assert held(BALLS["bdot"](one, other, other, other), x * y + y * y)
        for name, law in vars(UNARY).items():
            if (name == "binv" and abs(a) <= ra) or (name in ("bsqrt", "blog") and a - ra <= 0):
                continue
            function, part = PARTS.get(name, (name, None))
            ball = BALLS[function](one)
            assert held(ball if part is None else ball[part], law(x)), name
