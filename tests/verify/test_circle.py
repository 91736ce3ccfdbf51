"""Every function that decides on the circle: sets that wrap, that are nearly full, and that hold the cut at phase zero."""

from math import pi
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message

pytest.importorskip("flint")

from flint import arb
from motion import Equation, landed, seen

from nsmaps.verify.arrivals import NONE, UNKNOWN, Arrival, Tree, below_limit, speeds
from nsmaps.verify.cells import CUT, SPLIT, Grid, tree_of
from nsmaps.verify.cycles import Cycle, distinct
from nsmaps.verify.formula import UnprovedError, lifts, may_meet, nearest_turn, only_turn, system_of, tables_of
from nsmaps.verify.horseshoe import Parallelogram, horseshoe_of, meeting
from nsmaps.verify.images import covered, frame_of
from nsmaps.verify.trap import Trap, holds, trap_of

LEFT = 65535
SEEDS = st.integers(0, 2**32 - 1)
TURNS = st.integers(-3, 3) | st.sampled_from([10**6, -(10**12), 10**17])


@given(st.floats(0, 6.3), TURNS, st.floats(0, 3.2), st.floats(0, 3.2), st.floats(-1, 1))
@settings(max_examples=100, deadline=None)
def test_balls_with_a_common_phase_may_meet(phase: float, turns: int, one: float, other: float, share: float) -> None:
    """Two balls around a common phase, whole turns apart, however far and wide."""
    with mp.workdps(60):
        near = mp.mpf(phase) + mp.mpf(share) * mp.mpf(other) + turns * 2 * mp.pi
        a, b = arb(phase, one), arb(mp.nstr(near, 50)) + arb(0, other)
        gap = b - a
        nearest = nearest_turn(gap)
        off = abs(mp.mpf(float((gap - 2 * nearest * arb.pi()).mid())))
    assert may_meet(a, b)
    assert may_meet(b, a)
    assert abs(turns) > 10**15 or off <= pi + 1e-3
    assert only_turn(gap) in (None, nearest)
    if abs(turns) < 10**7 and one + other < 3 and abs(share * other) < 1e-3:
        assert only_turn(gap) == turns


@given(st.floats(0, 6.2), st.integers(-5, 5), st.floats(0, 1.5), st.floats(0, 1.5))
@settings(max_examples=50, deadline=None)
def test_balls_without_a_common_phase_do_not_meet(phase: float, turns: int, one: float, other: float) -> None:
    gap = one + other + (2 * pi - 2 * one - 2 * other) / 2
    assert not may_meet(arb(phase, one), arb(phase + gap + 2 * pi * turns, other))


@pytest.mark.parametrize(
    ("low", "high", "turns"), [(-0.1, 0.1, 0), (6.0, 6.5, 1), (3.0, 9.5, 1), (-0.1, 6.3, None), (0.0, 12.6, None)]
)
def test_the_only_turn_of_a_ball_is_known_where_it_holds_no_other(low: float, high: float, turns: int | None) -> None:
    assert only_turn(arb((low + high) / 2, (high - low) / 2)) == turns


def trap_like(rng: np.random.Generator) -> Trap:
    """A parallelogram, narrow, nearly a turn wide or wider, often sheared, often across the cut."""
    wide = float(rng.choice([0.05, 1.0, pi - 0.05, pi - 1e-6, pi, 4.0, 6.0]))
    matrix = ((1.0, float(rng.choice([0, 0.3]))), (float(rng.choice([0, 0.05, -0.05])), 1.0))
    tall = float(rng.uniform(0.1, 0.4))
    wide = min(wide, 2 * pi - tall * matrix[0][1])
    return Trap(0, (float(rng.choice([0.0, 0.1, 3.0, 6.2, rng.uniform(0, 6.28)])), 1.0), matrix, (wide, tall), 1, (1, 1))


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_boxes_that_a_trap_holds_lie_in_it(seed: int) -> None:
    """Boxes at both ends of the trap and across its gap, on any turn: held exactly where all of one lift is inside."""
    rng = np.random.default_rng(seed)
    trap, n = trap_like(rng), int(rng.choice([32, 256, 4096]))
    ends = [trap.centre[0] + x for x in (-trap.half[0], trap.half[0], pi, 0.0, float(rng.uniform(-pi, pi)))]
    first = np.array([round(x / (2 * pi) * n) - int(rng.integers(0, 3)) + n * int(rng.integers(-2, 3)) for x in ends])
    phases = np.stack([first, first + rng.integers(1, max(n // 16, 2), len(first))], 1)
    low = rng.uniform(0.8, 1.1, len(first))
    boxes = np.stack([low, low + rng.uniform(0, 0.1, len(first))], 1)
    found = holds(trap, 0, phases, n, boxes)
    with mp.workdps(60):
        inverse = mp.matrix(trap.matrix) ** -1
        for held, (start, end), (slow, fast) in zip(found, phases.tolist(), boxes.tolist(), strict=True):
            inside = [
                all(
                    abs(x) <= half
                    for phase in (start, end)
                    for speed in (slow, fast)
                    for x, half in zip(
                        inverse
                        * mp.matrix([2 * mp.pi * (mp.mpf(phase) / n + k) - trap.centre[0], speed - mp.mpf(trap.centre[1])]),
                        trap.half,
                        strict=True,
                    )
                )
                for k in range(-6, 7)
            ]
            assert held == any(inside)
    assert not holds(trap, 1, phases, n, boxes).any()


@given(st.floats(-20, 20), st.floats(0, 3), st.floats(-20, 20), st.floats(0, 6.3))
@settings(max_examples=60, deadline=None)
def test_no_lift_of_an_arc_is_missing(first: float, length: float, centre: float, reach: float) -> None:
    found = lifts(first, first + length, centre, reach)
    for turns in range(-12, 13):
        low, high = first - 2 * pi * turns, first + length - 2 * pi * turns
        if centre - reach <= low and high <= centre + reach:
            assert turns in found


def test_a_trap_that_covers_nearly_the_circle_does_not_prove_the_gap() -> None:
    """Cells of order zero all around, of an over-damped oscillator whose orbits from the gap need not converge as claimed."""
    trap = Trap(0, (0.1, 1.0), ((1.0, 0.0), (0.0, 1.0)), (pi - 0.05, 0.5), 1, (1, 1))
    n, cells = 256, np.stack([np.arange(0, 256, 8), np.arange(8, 257, 8)], 1)
    held = holds(trap, 0, cells, n, np.tile([0.9, 1.1], (32, 1)))
    gap = (0.1 + pi) / (2 * pi) * n
    assert held.tolist() == [not any(x <= gap + k * n + w <= y for k in (-1, 0, 1) for w in (-2.03, 0, 2.03)) for x, y in cells]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"half": [4.0, 0.1]}, message("verify.trap-width")),
        ({"half": [float("nan"), 0.1]}, message("verify.trap-numbers")),
        ({"centre": [float("inf"), 1.0]}, message("verify.trap-numbers")),
        ({"wall": 0.5}, message("verify.trap-numbers")),
    ],
)
def test_traps_that_make_no_sense_are_refused(change: dict[str, Any], said: str) -> None:
    data = {
        "wall": 0,
        "centre": [0.0, 1.0],
        "matrix": [[2.0, 0.0], [0.0, 1.0]],
        "half": [0.1, 0.1],
        "impacts": 1,
        "pieces": [1, 1],
    }
    assert trap_of(data).impacts == 1
    with pytest.raises(ValueError, match=said):
        trap_of(data | change)


def cycle(phase: arb, speed: arb, walls: tuple[int, ...] = (0,)) -> Cycle:
    """A cycle with one state of these balls, and others beside it."""
    states = tuple((phase + 0.5 * i, speed) for i in range(len(walls)))
    return Cycle(walls, states, 1, arb(0), arb(0), None, "open")


@given(st.floats(0, 6.3), TURNS, st.floats(1e-12, 1e-3))
@settings(max_examples=40, deadline=None)
def test_one_cycle_on_two_turns_is_not_counted_twice(phase: float, turns: int, radius: float) -> None:
    with mp.workdps(60):
        far = arb(mp.nstr(mp.mpf(phase) + 2 * turns * mp.pi, 50)) + arb(0, radius)
    with pytest.raises(UnprovedError, match=message("verify.not-different")):
        distinct([cycle(arb(phase, radius), arb(1, 1e-9)), cycle(far, arb(1, 1e-9))])
    distinct([cycle(arb(phase, radius), arb(1, 1e-9)), cycle(arb(phase + 0.1, radius), arb(1, 1e-9))])


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_sets_with_a_common_state_are_not_disjoint(seed: int) -> None:
    """Parallelograms around a common state, on the same turn or on two sides of the cut."""
    rng = np.random.default_rng(seed)
    state, sets = np.array([float(rng.choice([0.0, 0.01, 6.27, rng.uniform(0, 6.28)])), 3.0]), []
    for _ in range(2):
        matrix = rng.normal(size=(2, 2)) * float(rng.choice([1e-8, 1e-3, 0.2]))
        if not (np.abs(matrix).sum(axis=1) < [1, 3]).all():
            return
        centre = state - matrix @ rng.uniform(-1 + 1e-6, 1 - 1e-6, 2) + [2 * pi * int(rng.integers(-1, 1)), 0]
        sets.append(Parallelogram(tuple(centre.tolist()), tuple(map(tuple, matrix.tolist())), (0,)))  # type: ignore[arg-type]
    assert meeting(sets) == [(0, 1)]
    apart = sets[1]._replace(centre=(sets[1].centre[0] + 3.0, sets[1].centre[1]))
    assert meeting([sets[0], apart]) == []


def test_sets_far_from_the_first_turn_are_refused() -> None:
    """Differences of phases of 10^11 in doubles would not show that sets are disjoint."""
    one = {"centre": [1e11, 3.0], "matrix": [[0.1, 0.0], [0.0, 0.1]], "walls": [0]}
    with pytest.raises(ValueError, match=message("verify.horseshoe-set")):
        horseshoe_of({"wall": 0, "returns": 1, "sets": [one], "relations": [[0, 0]]}, 1)


def some_cells(rng: np.random.Generator, walls: int, cut: bool, top: float) -> Tree:
    """Cells of 64 x 64 on each wall with random orders, many of them cut into strips."""
    grid = Grid(side=32, depth=1, top=top, periods=3, closed=True)
    count = walls * 32 * 32
    base, squares = np.full(count, SPLIT, np.uint16), rng.integers(0, 5, 4 * count).astype(np.uint16)
    if not cut:
        return tree_of(grid, walls, np.concatenate([base, squares]))
    row = 2 * (np.arange(count) % 32)[:, None] + np.array([0, 1, 0, 1])
    squares[(row.ravel() > 0) & (rng.random(4 * count) < 0.7)] = CUT
    number = int((squares == CUT).sum())
    strips, slopes = rng.integers(0, 5, 2 * number).astype(np.uint16), rng.integers(1, 30, number) * rng.choice([-1, 1], number)
    return tree_of(grid, walls, np.concatenate([base, squares, strips]), slopes.astype(np.int8))


def leaf_at(tree: Tree, wall: int, place: Any, speed: float) -> int:
    """The cell of a state, the phase in parts of a turn over n."""
    at = float(place % tree.n)
    node = (wall * tree.side + int(at * tree.side / tree.n)) * tree.side + int(speed / tree.top * tree.side)
    while tree.child[node] >= 0:
        child = int(tree.child[node])
        if tree.slope[child] == 0:
            part = 2 * int(at >= tree.first[child + 2]) + int(speed >= tree.high[child])
        else:
            part = int(speed - tree.slope[child] * (at - tree.first[child] - tree.width[child] / 2) >= tree.high[child])
        node = child + part
    return node


@given(st.booleans(), SEEDS)
@settings(max_examples=6, deadline=None)
def test_arrivals_that_are_below_a_limit_are_in_cells_below_it(cut: bool, seed: int) -> None:
    """Boxes of phases that begin before the cut, end after it, or go round more than once."""
    rng = np.random.default_rng(seed)
    tree = some_cells(rng, 1, cut, 1.0)
    tables = tables_of(system_of(STATED), tree.n, tree.n // tree.side, 1, 2.0)
    frame, shown = frame_of(tables), 0
    for _ in range(40):
        first = int(rng.choice([0, tree.n - 3, tree.n, 2 * tree.n - 1, rng.integers(0, 3 * tree.n)]))
        end = first + int(rng.choice([1, 5, 30, tree.n - 1, tree.n, tree.n + 40], p=[0.3, 0.3, 0.2, 0.1, 0.05, 0.05]))
        low = float(rng.uniform(0, 0.9))
        high, limit = low + float(rng.choice([0, 0.004, 0.02])), int(rng.integers(3, 6))
        if below_limit(frame, tree, NONE, 0, first, end, low, high, UNKNOWN, limit):
            shown += 1
            places = [first + 1e-9, end - 1e-9, *rng.uniform(first, end, 30)]
            assert all(tree.order[leaf_at(tree, 0, place, rng.uniform(low, high))] < limit for place in places)
    assert shown > 0


@given(st.booleans(), SEEDS)
@settings(max_examples=6, deadline=None)
def test_arrivals_along_a_curve_are_in_cells_below_a_limit(cut: bool, seed: int) -> None:
    """Arrivals whose place and speed are quadratic in departure, speed and time, with remainders, also across the cut."""
    rng = np.random.default_rng(seed)
    tree = some_cells(rng, 1, cut, 1.0)
    frame, shown = frame_of(tables_of(system_of(STATED), tree.n, tree.n // tree.side, 1, 2.0)), 0
    for _ in range(40):
        block = int(rng.choice([2, 8, 16]))
        start, limit = int(rng.choice([0, tree.n - block, tree.n, tree.n // 2])), int(rng.integers(3, 6))
        radii = frame.step * float(rng.uniform(0, 4)), 0.01 * float(rng.uniform(0, 1)), 0.5 * block * frame.step
        df, du, f, u = rng.normal(size=3), 0.3 * rng.normal(size=3), 0.01 * float(rng.normal()), float(rng.uniform(0.1, 0.8))
        off, off_v = (float(x) for x in rng.uniform(0, 1e-3, 2))
        at = Arrival(True, f, u, (tuple(df.tolist()), tuple(du.tolist())), radii, off, off_v, start + block // 2)  # type: ignore[arg-type]
        low, high = speeds(at, 0.0)
        states = []
        for _ in range(200):
            way, rest = rng.uniform(-1, 1, 3) * radii, float(rng.uniform(-1, 1)) * off
            way[2] = -(f + rest + df[:2] @ way[:2]) / df[2]
            if abs(way[2]) <= radii[2]:
                speed = u + du @ way + float(rng.uniform(-1, 1)) * off_v
                assert low <= speed <= high
                states.append((start + block / 2 + way[2] / frame.step, speed))
        if low < 0 or high >= 1 or not below_limit(frame, tree, NONE, 0, start, start + block, low, high, at, limit):
            continue
        shown += len(states)
        assert all(tree.order[leaf_at(tree, 0, place, speed)] < limit for place, speed in states)


STATED: dict[str, Any] = {
    "damping": ["0.1", "0"],
    "stiffness": ["1", "0"],
    "force": ["0", "0"],
    "cosine": ["1", "0"],
    "sine": ["0", "0"],
    "frequency": ["0.8", "0", 0],
    "restitution": ["0.6", "0"],
    "walls": [{"letter": "B", "at": ["0.4", "0"], "side": 1}],
}
SYSTEMS: dict[str, dict[str, Any]] = {
    "under-damped": {},
    "two walls": {"walls": [*STATED["walls"], {"letter": "T", "at": ["-0.4", "1e-15"], "side": -1}]},
    "critical": {"damping": ["2", "0"], "frequency": ["1.5", "0", 0], "walls": [{"letter": "B", "at": ["0.1", "0"], "side": 1}]},
    "stiffness across zero": {"damping": ["0.5", "0"], "stiffness": ["0", "1e-15"], "force": ["0.4", "0"]},
    "falling": {
        "damping": ["0", "0"],
        "stiffness": ["0", "0"],
        "force": ["0.7", "0"],
        "walls": [{"letter": "B", "at": ["0", "1e-6"], "side": 1}],
    },
}


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_cell_is_not_covered_where_a_state_of_it_hits_an_open_cell(name: str, cut: bool) -> None:
    """All other cells are allowed; states are often next to the cut of the circle. With that cell allowed, most are covered."""
    rng, data, top, tested, shown = np.random.default_rng(8), STATED | SYSTEMS[name], 4.0, 0, 0
    tree = some_cells(rng, len(data["walls"]), cut, top)
    frame = frame_of(tables_of(system_of(data), tree.n, tree.n // tree.side, 3, 2 * top))
    numbers = [mp.mpf(data[key][0]) for key in ("damping", "stiffness", "force", "cosine", "sine", "frequency")]
    walls = tuple((mp.mpf(wall["at"][0]), wall["side"]) for wall in data["walls"])
    one = Equation(*numbers, walls, mp.mpf(data["restitution"][0]))
    for _ in range(12):
        wall, ends = int(rng.integers(len(walls))), [(0, 4), (tree.n - 4, tree.n), (0, tree.n)][rng.integers(3)]
        place, speed = float(rng.uniform(*ends)), float(rng.uniform(*[(0, 0.06), (0.06, 1.5)][rng.integers(2)]))
        leaf, phase = leaf_at(tree, wall, place, speed), 2 * mp.pi * mp.mpf(place) / tree.n
        first = seen(one, wall, phase, mp.mpf(speed))
        if first is None:
            continue
        met, fast = landed(one, wall, phase, mp.mpf(speed), *first)
        if not 0 < fast < top or abs(met - first[1]) > 0.1:  # a graze
            continue
        order = np.zeros_like(tree.order)
        shown += any(covered(frame, tree._replace(order=order), leaf, 1, fine) for fine in (False, True))
        target = leaf_at(tree, first[0], met / (2 * mp.pi) * tree.n, float(fast))
        if target == leaf:
            continue
        order[path_to(tree, target)] = LEFT
        tested += 1
        assert not any(covered(frame, tree._replace(order=order), leaf, 1, fine) for fine in (False, True))
    assert tested >= 5
    assert shown >= 5


def path_to(tree: Tree, node: int) -> list[int]:
    """A cell and the nodes of which it is a part."""
    number = np.where(tree.child < 0, 0, np.where(tree.slope[tree.child] == 0, 4, 2))
    found = [node]
    while len(above := np.flatnonzero((tree.child <= found[-1]) & (found[-1] < tree.child + number))):
        found.append(int(above[0]))
    return found
