"""Composite maps in compiled loops: the same pieces, images, derivatives and ends as in NumPy, whatever the regions say."""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from exported import Disc
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message
from numba import njit
from numpy.typing import ArrayLike, NDArray

from nsmaps.coordinates import Angle, Coordinates, nearest_turn, wrap
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.dynamics.orbit import orbit
from nsmaps.errors import ConditionError
from nsmaps.exact.outcome import Outcome
from nsmaps.files.expressions import FUNCTIONS
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.bytecode import code_of, depth_of
from nsmaps.reduced.conditions.condition import read_condition
from nsmaps.reduced.conditions.interpreter import evaluate_condition
from nsmaps.reduced.conditions.region import Box, ConditionRegion, Region
from nsmaps.reduced.fit.polymap import PolyMap

NAMES = ("v", Angle("phi"))
PLACES = (-1.0, 0.0, 0.5, 1.0, 2.0, 7.0)


evaluate = njit(error_model="numpy")(evaluate_condition.py_func)


def numbers(region: Region, states: Sequence[Sequence[float]]) -> list[bool]:
    """What the code of a region says of states: the same one by one and side by side."""
    code = code_of(region)
    assert code is not None
    operation, number = (np.array(column) for column in zip(*code, strict=True))
    columns, stack = np.array(states, float).T.copy(), np.full((depth_of(code), len(states)), np.nan)
    arguments = operation, number.astype(float), 0, len(code)
    evaluate(*arguments, columns, len(states), stack)
    found = (stack[0] != 0).tolist()
    for k, one in enumerate(found):
        evaluate(*arguments, columns[:, k : k + 1].copy(), 1, own := np.full((depth_of(code), 1), np.nan))
        assert (own[0, 0] != 0) == one
    return list(found)


terms = st.recursive(
    st.sampled_from(["v", "phi", "0.5", "2", "pi/3", "-1"]),
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, st.sampled_from("+-*"), inner),
        st.builds("({} / {})".format, inner, st.sampled_from(["v", "phi", "4"])),
        st.builds("({})**{}".format, inner, st.sampled_from(["2", "3", "0.5", "-1", "(-2)"])),
        st.builds("{}({})".format, st.sampled_from(["sin", "cos", "sqrt", "exp", "log", "-", "+"]), inner),
        st.builds("{}({})".format, st.sampled_from(list(FUNCTIONS)[5:-2]), inner),
        st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), inner, inner),
    ),
    max_leaves=5,
)
compared = st.builds("{} {} {}".format, terms, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), terms)
chained = st.builds("{} {} {}".format, compared, st.sampled_from(["<", "<=", "!="]), terms)
conditions = st.recursive(
    compared | chained,
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, st.sampled_from(["and", "or"]), inner), st.builds("not ({})".format, inner)
    ),
    max_leaves=4,
)


@pytest.mark.thorough
@settings(max_examples=150, deadline=None)
@given(conditions)
def test_any_condition_says_the_same_as_in_numpy(text: str) -> None:
    states = np.array([(v, phi) for v in PLACES for phi in PLACES])
    try:
        asked = read_condition(text, NAMES)
        region = ConditionRegion(text=text, coordinates=NAMES)
    except ValueError:  # a constant without a real value, a division by zero
        return
    moved = 1e-9 * np.array([[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
    told, beside = asked(states), asked((states[:, None] + moved).reshape(-1, 2)).reshape(-1, len(moved))
    firm = (beside == told[:, None]).all(axis=1)
    assert np.array(numbers(region, states.tolist()))[firm].tolist() == told[firm].tolist()


EDGES = """\
v == 0.5
v != 0.5 or phi == 2
0 < v <= 1 and not phi >= 2
v**2 == 1 and v**3 == 1
sqrt(v) >= 0
1/v > 1e300
+v > -phi
phi**0.5 == sqrt(phi)
v**-1 == 1/v
sign(v) == v or floor(phi) == phi
abs(v) == max(v, -v)
min(sqrt(v), 1) <= 1
max(1, sqrt(v)) >= 1
asin(v) >= acos(phi)
not min(1/v, log(v)) < max(phi, -1/v, 0)"""


@pytest.mark.parametrize("text", EDGES.splitlines())
def test_conditions_at_their_edges(text: str) -> None:
    states = [(v, phi) for v in PLACES for phi in PLACES]
    assert numbers(ConditionRegion(text=text, coordinates=NAMES), states) == read_condition(text, NAMES)(states).tolist()


@given(st.tuples(st.floats(-7, 7), st.floats(0.1, 6.0)), st.lists(st.floats(-7, 14), min_size=1, max_size=5))
def test_boxes_on_the_circle(side: tuple[float, float], angles: list[float]) -> None:
    box = Box(coordinates=NAMES, bounds={"v": (0.0, 1.0), "phi": (side[0], side[0] + side[1])})
    states = [(v, wrap(angle).item()) for v in (0.0, 1.0, 1.1) for angle in (*angles, side[0], side[0] + side[1])]
    assert numbers(box, states) == box.contains(states).tolist()


def polymap(names: Sequence[str], rng: np.random.Generator, absolute: tuple[str, ...] = (), degree: int = 3) -> PolyMap:
    """A map of random polynomials in a box."""
    n = len(names)
    box = np.column_stack([-rng.uniform(0.5, 1, n), rng.uniform(0.5, 2, n)])
    exponents = tuple(rng.integers(0, degree + 1, (rng.integers(1, 6), n)) for _ in names)
    coefficients = tuple(rng.normal(0, 0.4, len(each)) for each in exponents)
    return PolyMap(tuple(names), exponents, coefficients, box.mean(axis=1), np.ptp(box, axis=1) / 2, box, absolute)


def random_map(names: Sequence[str], seed: int) -> CompositeMap:
    """A map of pieces of every kind: boxes, conditions, resets, absolute values, an overflow."""
    rng, first, last = np.random.default_rng(seed), names[0], names[-1]
    regions: list[Region] = [
        Box(coordinates=names, bounds=dict.fromkeys(names, (-0.3, 0.4))),
        ConditionRegion(coordinates=names, text=f"{first} > 0.9 and {last} > 1"),
        ConditionRegion(coordinates=names, text=f"{first} < -0.8 or ({last} > 5 and {first} > 0)"),
        ConditionRegion(coordinates=names, text=f"{first} < 0.8 and {last}**2 < 30"),
    ]
    maps = [polymap(names, rng), PolyMap.reset(names, {last: 0.3}), polymap(names, rng, (first,)), polymap(names, rng)]
    high = tuple(np.where(np.arange(len(names)) == 0, 300, 0)[None] for _ in names)
    huge = PolyMap(tuple(names), high, (np.ones(1),) * len(names), *(np.full(len(names), x) for x in (0.0, 1e-3)), maps[0].domain)
    regions.append(ConditionRegion(coordinates=names, text=f"{last} < 5.5"))
    words = ("BTB", "BB", "", "BTB", "BB")
    pieces = zip(regions, [*maps, huge], words, strict=True)
    return CompositeMap(tuple(names), ("B", "T"), tuple(Piece(str(k), *piece) for k, piece in enumerate(pieces)))


SPACES = [("x",), (Angle("phi"),), NAMES, ("v", "x", Angle("phi"))]


def by_numpy(return_map: CompositeMap, state: NDArray[np.float64]) -> tuple[Outcome, str, NDArray[np.float64]]:
    """The outcome, the word and the image, angles not wrapped, of one state, by the regions' and polynomials' own NumPy."""
    angles, nowhere = return_map.coordinates.angles, np.full(len(state), np.nan)
    if not np.isfinite(state).all():
        return Outcome.invalid, "", nowhere
    for piece in return_map.pieces:
        if piece.region.contains(np.where(angles, wrap(state), state)[None])[0]:
            bounded = np.isfinite(piece.map.domain).all(axis=1)
            near = np.where(angles & bounded, nearest_turn(state, piece.map.centre), state)
            lifted = piece.map(near[None])[0] + np.where(angles, state - near, 0.0)
            fine = np.isfinite(lifted).all()
            return (Outcome.returned, piece.word, lifted) if fine else (Outcome.escaped, piece.word, nowhere)
    return Outcome.uncovered, "", nowhere


@pytest.mark.parametrize("names", SPACES, ids=[" ".join(names) for names in SPACES])
@pytest.mark.parametrize("seed", range(4))
def test_a_return_is_that_of_the_regions_and_polynomials(names: tuple[str, ...], seed: int) -> None:
    return_map, rng, angles = random_map(names, seed), np.random.default_rng(seed), Coordinates(names).angles
    states = np.concatenate([rng.uniform(-2, 7, (400, len(names))), rng.uniform(-0.3, 0.4, (20, len(names)))])
    states[0], states[1, 0], states[2:9, -1] = np.nan, np.inf, [-1e-20, 2 * np.pi, -2 * np.pi, 12.6, -6.3, 4 * np.pi, 100.0]
    outcomes, words, lifted = zip(*(by_numpy(return_map, state) for state in states), strict=True)
    made = return_map.first_return(states, derivative=True)
    assert made.outcome.tolist() == list(outcomes)
    assert len(set(outcomes)) >= 3
    assert made.words.tolist() == list(words)
    assert np.allclose(made.lifted, lifted, rtol=1e-9, atol=1e-9, equal_nan=True)
    inside = made.image[made.valid][:, angles]
    assert ((inside >= 0) & (inside < 2 * np.pi)).all()
    assert np.array_equal(made.image[:, ~angles], made.lifted[:, ~angles], equal_nan=True)
    assert made.derivative is not None
    assert np.isnan(made.derivative[~made.valid]).all()


def test_an_orbit_is_a_chain_of_first_returns_to_the_last_bit() -> None:
    return_map = random_map(NAMES, 1)
    start = np.random.default_rng(5).uniform(-1, 3, (50, 2))
    start[0], start[1, 0], start[2, 1] = np.nan, -np.inf, -0.0
    made = orbit(return_map, start, 12)
    now, ended = start, np.full(50, Outcome.invalid, np.int8)
    for k in range(12):
        asked = return_map.first_return(now)
        ended = np.where(np.isnan(now).any(axis=1), ended, asked.outcome).astype(np.int8)
        assert np.array_equal(made.outcome[k], ended)
        assert np.array_equal(made.states[k + 1], asked.image, equal_nan=True)
        assert np.array_equal(made.codes[k], asked.codes)
        now = made.states[k + 1]
    assert (made.outcome[-1] == Outcome.escaped).any()
    assert (made.outcome[-1] == Outcome.returned).any()


def test_exponents_of_a_map_known_by_hand() -> None:
    domain = np.array([[0.0, 1.0], [0.0, 1.0]])
    quarter = {(0, 1): Fraction(1, 4)}
    line = PolyMap.of_monomials(("x", "y"), {"x": {(1, 0): Fraction(2)}, "y": quarter}, domain)
    back = PolyMap.of_monomials(("x", "y"), {"x": {(1, 0): Fraction(2), (0, 0): Fraction(-1)}, "y": quarter}, domain)
    low = Piece("low", ConditionRegion(coordinates=("x", "y"), text="x < 0.5"), line)
    return_map = CompositeMap(
        ("x", "y"), ("B",), (low, Piece("high", ConditionRegion(coordinates=("x", "y"), text="x >= 0.5"), back))
    )
    found = lyapunov(return_map, starts=(0.2137, 0.6), n_returns=40, transient=0)
    assert np.allclose(found.exponents, [math.log(2), -math.log(4)], rtol=1e-12)
    assert np.isclose(found.log_det, math.log(0.5))


def test_a_region_of_a_class_is_compiled_by_its_condition() -> None:
    disc = Disc(coordinates=NAMES, centre=(0.4, 1.0), radius=0.6)
    states = np.random.default_rng(1).uniform([-0.5, -7], [1.5, 7], (4000, 2))
    states[0] = np.nan
    assert numbers(disc, Coordinates(NAMES).wrap(states[1:]).tolist()) == disc.contains(states[1:]).tolist()
    pieces = Piece("disc", disc, polymap(NAMES, rng := np.random.default_rng(0))), Piece("rest", LOW, polymap(NAMES, rng))
    return_map = CompositeMap(NAMES, ("B",), pieces)
    found = return_map.piece_of(states)
    assert set(found.tolist()) == {-1, 0, 1}
    assert np.array_equal(found == 0, disc.contains(states))
    assert np.array_equal(found, return_map.piece_once(states))
    assert return_map.orbits(states, 3).outcome.shape == (12000,)
    with pytest.raises(ConditionError, match=message("reduced.function", function="gamma", at="the region Unknown")):
        CompositeMap(NAMES, ("B",), (Piece("x", Unknown(coordinates=NAMES), pieces[0].map),)).piece_of(states)


LOW = ConditionRegion(coordinates=NAMES, text="v < 1.2")


class Unknown(Region):
    """A region whose condition has a function that conditions do not have."""

    def contains(self, states: ArrayLike) -> NDArray[np.bool_]:
        return np.asarray(states)[:, 0] > 0

    def condition(self) -> sp.Basic:
        return sp.gamma(sp.Symbol("v", real=True)) > 0


def test_regions_of_a_class_in_orbits() -> None:
    rng = np.random.default_rng(0)
    made = polymap(NAMES, rng)
    disc = Disc(coordinates=NAMES, centre=(0.4, 1.0), radius=0.6)
    own, same = (
        CompositeMap(NAMES, ("B",), (Piece("half", region, made),))
        for region in (disc, ConditionRegion(coordinates=NAMES, text="(v - 0.4)**2 + (phi - 1)**2 < 0.6**2"))
    )
    assert own.has_orbits
    assert same.has_orbits
    assert np.array_equal(
        lyapunov(own, starts=[0.5, 0.5], n_returns=64, transient=0).outcome,
        lyapunov(same, starts=[0.5, 0.5], n_returns=64, transient=0).outcome,
    )
    start = rng.uniform(0, 1, (5, 2))
    assert np.array_equal(orbit(own, start, 6).states, orbit(same, start, 6).states, equal_nan=True)
    empty = CompositeMap(NAMES, ("B",), ())
    assert orbit(empty, start, 2).outcome.tolist() == [[Outcome.uncovered] * 5] * 2
    assert empty.first_return(start, derivative=True).outcome.tolist() == [Outcome.uncovered] * 5
    assert orbit(own, start[:0], 3).states.shape == (4, 0, 2)
