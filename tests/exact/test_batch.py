"""Returns computed side by side are those computed one by one, bit for bit, whatever stands beside them; 50-digit references."""

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import TILT
from systems import BouncingBall, Oscillator, Table

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.blocks import batch
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.engine.kernel import flow_of
from nsmaps.exact.engine.observers import Rows
from nsmaps.exact.outcome import Outcome

SYSTEMS = {
    "bouncing ball": BouncingBall(a=1.3),
    "elastic ball": BouncingBall(a=0.4, r=1.0),
    "parabolas": Table(height=0.6),
    "elastic parabolas": Table(height=0.6, floor=1.0, ceiling=1.0),
    "damped": Oscillator(zeta=0.05, w=0.81, gap=0.7),
}
ODD = [
    *([v, 1.0] for v in (0.0, 5e-324, 1e-301, 1e-300, 1e-150, 1e-15, -0.1, 1e6, 1e150, 1e308, np.nan, np.inf)),
    *([0.3, phi] for phi in (np.nan, np.inf, -np.inf, 1e11, 1e13, -7.0, TWO_PI, np.nextafter(TWO_PI, 0.0), 5e-324, -5e-324)),
]
#: as in test_returns: the map's square root next to a graze turns a rounding of the start into its root
TOLERANCE = {"ordinary": 1e-13, "tiny": 1e-13, "graze": 1e-8}


def computed(system, how, states, chatter=0.0):
    """What the engine writes for a batch: "one_by_one", "side_by_side", or as the table has it, "as_it_is"."""
    n, table = len(states), system._kernel().table.copy()
    assert how != "side_by_side" or (table[layout.WIDE] > 0 and n >= batch.FEW)
    table[layout.WIDE] *= how != "one_by_one"
    shapes = {"states": (n, 2), "turns": (n, 2), "codes": (n,), "outcome": (n,), "time": (n,), "tangents": (n, 2, 2)}
    types = {"turns": np.int32, "codes": np.int64, "outcome": np.int8}
    rows = Rows(**{name: np.empty((1, *shape), types.get(name, float)) for name, shape in shapes.items()})
    batch.orbits(flow_of(table), chatter, np.ascontiguousarray(states, dtype=float), rows)
    return {name: getattr(rows, name)[0] for name in shapes}


def assert_same(one, other, rows=slice(None)):
    for name in one:
        assert np.array_equal(one[name][rows], other[name], equal_nan=True), name


def mixed(seed, n, top):
    """Ordinary states, slow ones of all sizes and odd ones, in a random order."""
    rng = np.random.default_rng(seed)
    plain = np.column_stack([rng.uniform(0.0, top, n), rng.uniform(0.0, TWO_PI, n)])
    slow = np.column_stack([10 ** rng.uniform(-16, 0.5, n), rng.uniform(-7.0, 20.0, n)])
    return rng.permutation(np.concatenate([plain, slow, *[ODD] * 4]))


@pytest.mark.parametrize("chatter", [0.0, 0.05, np.inf])
@pytest.mark.parametrize("r", [0.0, 0.02, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("d", [0.05, 0.26, 0.30, 0.35, 3.0])
def test_the_pair_side_by_side_and_one_by_one(pair, d, r, chatter):
    states = mixed(1, 2000, 1.5)
    assert_same(computed(pair(d, r), "one_by_one", states, chatter), computed(pair(d, r), "side_by_side", states, chatter))


@pytest.mark.parametrize("kind", SYSTEMS)
def test_other_systems_side_by_side_and_one_by_one(kind):
    states = mixed(2, 2000, 3.0)
    assert_same(computed(SYSTEMS[kind], "one_by_one", states), computed(SYSTEMS[kind], "as_it_is", states))


def test_the_states_of_these_tests_end_in_every_way(pair):
    heavy = type(pair(0.35))(d=0.35, r=0.5, g_bar=1.5)
    cases = [(pair(0.26), 0.0), (pair(0.35, 0.0), 0.0), (pair(0.35), np.inf), (heavy, 0.0)]
    found = set()
    for system, chatter in cases:
        states = mixed(3, 2000, 1.5)
        one = computed(system, "one_by_one", states, chatter)
        assert_same(one, computed(system, "side_by_side", states, chatter))
        found |= set(one["outcome"].tolist())
    assert found >= {Outcome.returned, Outcome.stuck, Outcome.rests, Outcome.invalid}


def test_grazes_within_rounding_are_undecided_side_by_side_as_well():
    """A parabola whose top is the ceiling: a start at speed sqrt(2 height)/floor, and those next to it."""
    system = Table(height=0.6)
    speed = np.sqrt(2 * system.height) / system.floor
    states = np.column_stack([speed * (1 + np.arange(-300, 300) * 2.0**-53), np.zeros(600)])
    one = computed(system, "one_by_one", states)
    assert {Outcome.returned, Outcome.undecided} == set(one["outcome"].tolist())
    assert_same(one, computed(system, "side_by_side", states))


def test_returns_of_more_flights_than_a_block_follows(pair):
    """Chatter on the other wall at r = 0.7: dozens of impacts before the rest of them can be summed up."""
    system = pair(0.15, 0.7)
    rng = np.random.default_rng(4)
    states = np.column_stack([rng.uniform(0.1, 4.0, 20_000), rng.uniform(0.0, TWO_PI, 20_000)])
    long = system.first_return(states).has_word("BT~B")
    flights = [list(system.impacts(state, 100, chatter=np.inf).mark).index("~") for state in states[long]]
    assert max(flights) > batch.MOST_FLIGHTS
    assert_same(computed(system, "one_by_one", states), computed(system, "side_by_side", states))


@pytest.mark.parametrize("n", [1, 7, 8, 9, 15, 16, 17, 511, 512, 513, 1025])
def test_neighbours_do_not_matter(pair, n):
    """The same states in other places of the block, and in batches of every size, have the same returns."""
    states = mixed(4, 1000, 1.5)
    whole = computed(pair(0.3), "as_it_is", states)
    rng = np.random.default_rng(n)
    for _ in range(5):
        chosen = rng.choice(len(states), n, replace=False)
        assert_same(whole, computed(pair(0.3), "as_it_is", states[chosen]), chosen)


@pytest.mark.parametrize("odd", ODD[:4] + ODD[10:13])
def test_one_odd_state_at_every_place(pair, odd):
    rng = np.random.default_rng(5)
    plain = np.column_stack([rng.uniform(0.01, 1.2, 600), rng.uniform(0.0, TWO_PI, 600)])
    alone, rest = computed(pair(0.3), "one_by_one", [odd]), computed(pair(0.3), "one_by_one", plain)
    for place in [*range(20), *range(495, 530), 599]:
        states = plain.copy()
        states[place] = odd
        expected = {name: rest[name].copy() for name in rest}
        for name in rest:
            expected[name][place] = alone[name][0]
        assert_same(expected, computed(pair(0.3), "side_by_side", states))


@pytest.mark.parametrize("name", ["first_returns", "hard_returns"])
def test_every_reference_in_a_crowd(pair, reference, name):
    """The 50-digit references, each system's rows in a random order among themselves, many times over."""
    rows = reference(name)
    rng = np.random.default_rng(6)
    assert rows
    for kind in sorted({(row["d"], row["r"], row["beta"]) for row in rows}):
        own = [row for row in rows if (row["d"], row["r"], row["beta"]) == kind]
        order = rng.permutation(np.repeat(np.arange(len(own)), 1 + 600 // len(own)))
        got = pair(kind[0], kind[1], TILT[kind[2]]).first_return([[own[i]["v"], own[i]["phi"]] for i in order])
        exact = np.array([[float(row["v1"]), float(row["phi1"])] for row in own])[order]
        tolerance = np.array([TOLERANCE[row.get("kind", "ordinary")] for row in own])[order]
        assert got.words.tolist() == [own[i]["word"] for i in order]
        assert (np.abs(got.image - exact) <= tolerance[:, None]).all()


def test_without_a_compiler_the_answers_are_the_same_to_the_last_bit(pair, reference):
    """NUMBA_DISABLE_JIT=1: the arithmetic is that which is written, fused or reordered nowhere, of a batch and of few states."""
    states = mixed(7, 40, 1.5)
    few = np.array([[row["v"], row["phi"]] for row in reference("first_returns") if row["d"] == 0.3][:8])
    code = (
        "import sys; sys.path[:0] = sys.argv[1:];"
        "import numpy as np; nan = np.nan; inf = np.inf;"
        "from conftest import vi_pair;"
        f"made = [vi_pair(0.3).first_return(states, derivative=True) for states in ({states.tolist()}, {few.tolist()})];"
        "print([[of.image.tolist(), of.derivative.tolist(), of.codes.tolist(), of.outcome.tolist()] for of in made])"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, *sys.path], env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert len(few) < batch.FEW <= len(states)
    for starts, (image, derivative, codes, outcome) in zip(
        (states, few), eval(run.stdout, {"nan": np.nan, "inf": np.inf}), strict=True
    ):
        compiled = pair(0.3).first_return(starts, derivative=True)
        assert np.array_equal(image, compiled.image, equal_nan=True)
        assert np.array_equal(derivative, compiled.derivative, equal_nan=True)
        assert codes == compiled.codes.tolist()
        assert outcome == compiled.outcome.tolist()


def test_which_systems_go_side_by_side(pair):
    """All but those whose bounds depend on the time: flights that grow, rates that are equal or nearly so."""
    others = {
        "critical": Oscillator(zeta=1.0, w=1.7, gap=0.1, damping="critical"),
        "nearly critical": Oscillator(zeta=1 - 1e-9, w=1.7, gap=0.1),
    }
    wide = {kind: system._kernel().table[layout.WIDE] > 0 for kind, system in {**SYSTEMS, **others, "pair": pair(0.3)}.items()}
    assert wide == {kind: kind not in others for kind in wide}
