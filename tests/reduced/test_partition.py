"""The general algorithm by itself, against maps whose pieces are known and against the exact vibro-impact pair."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
import sympy as sp
from messages import message
from pydantic import ValidationError
from systems import BouncingBall

from nsmaps.coordinates import TWO_PI, Angle, wrap
from nsmaps.dynamics.orbit import orbit
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.exact.surfaces.family import ReturnFamily
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.exact.words import encode
from nsmaps.reduced.adaptive.accurate import AccurateResult
from nsmaps.reduced.conditions.region import ConditionRegion, Region
from nsmaps.reduced.fit.filter import NearDiagonal
from nsmaps.reduced.fit.polyfit import PolyFit
from nsmaps.reduced.partition.candidates import attracting_boxes
from nsmaps.reduced.partition.cell import Cell, Cut, roots, sample
from nsmaps.reduced.partition.orders import Demand, choose_order, orders_of
from nsmaps.reduced.partition.partition import partition
from nsmaps.reduced.partition.separators import best_separator, sheets
from nsmaps.reduced.partition.spec import Partition

NAMES, WALLS = ("v", Angle("phi")), ("B", "T")


@dataclass(frozen=True)
class Known(ReturnMap):
    """A map of two words: a contraction to (0.7, 1) above a curve, a push towards it below; both quadratic, with a jump."""

    lost: float = -1.0  #: below this speed nothing returns
    coordinates = NAMES
    letters = WALLS

    def curve(self, phi):
        return 0.4 - 0.2 * phi + 0.05 * phi**2

    def above(self, states):
        return states[:, 0] > self.curve(states[:, 1])

    def first_return(self, states, derivative=False, chatter=0.0):
        x = np.asarray(states, float)
        v, phi = x.T
        up = np.column_stack([0.7 + 0.3 * (v - 0.7) - 0.1 * (phi - 1) ** 2, 1 - 0.4 * (v - 0.7) + 0.2 * (phi - 1)])
        down = np.column_stack([0.6 + 0.1 * v * phi, 1.5 - 0.1 * phi + 0 * v])
        lifted = np.where(self.above(x)[:, None], up, down)
        lifted[v < self.lost] = np.nan
        image = np.where([False, True], wrap(lifted), lifted)
        turns = np.nan_to_num(np.round((lifted - image) / TWO_PI)).astype(np.int32)
        outcome = np.where(v < self.lost, Outcome.escaped, Outcome.returned).astype(np.int8)
        return Returns(NAMES, WALLS, x, image, turns, self.codes(x), outcome, np.zeros(len(x)))

    def codes(self, x):
        return np.where(self.above(x), encode("BTB", WALLS), encode("BB", WALLS))

    def itineraries(self, states, chatter=0.0):
        x = np.asarray(states, float)
        outcome = np.where(x[:, 0] < self.lost, Outcome.escaped, Outcome.returned).astype(np.int8)
        return Itineraries(WALLS, self.codes(x), np.zeros(len(x), np.int32), np.ones(len(x)), np.ones(len(x)), outcome)


def grid(v=(0.0, 1.0), phi=(0.0, 3.0), points=100):
    return Grid(axes={"v": Axis(low=v[0], high=v[1], points=points), "phi": Axis(low=phi[0], high=phi[1], points=points)})


def apart(a, b):
    """The largest difference of images in each coordinate, angles the short way round, shape (N,)."""
    difference = np.abs(a - b)
    difference[:, 1] = np.minimum(difference[:, 1], TWO_PI - difference[:, 1])
    return difference.max(axis=1)


def test_a_cell_is_what_its_text_says_and_its_parts_make_it_up():
    cell = Cell(NAMES, ((0.1, 0.9), (0.0, 3.0)))
    cut = Cut(0, (0.4, -0.2, 0.05), above=False)
    below, above = (cell.cut(side) for side in cut.sides())
    assert above.text == "0.1 <= v <= 0.9 and phi <= 3.0 and v > 0.4 - 0.2*phi + 0.05*phi**2"
    x = np.random.default_rng(0).uniform([0, 0], [1, 3.2], (5000, 2))
    expected = (x[:, 0] >= 0.1) & (x[:, 0] <= 0.9) & (x[:, 1] <= 3) & (x[:, 0] > 0.4 - 0.2 * x[:, 1] + 0.05 * x[:, 1] ** 2)
    assert np.array_equal(above.region.contains(x), expected)
    assert np.array_equal(above.region.contains(x) ^ below.region.contains(x), cell.region.contains(x))
    left, right = (cell.cut(side) for side in Cut(0, (0.5,), above=False).sides())
    assert (left.text, right.text) == ("0.1 <= v <= 0.5 and phi <= 3.0", "0.5 < v <= 0.9 and phi <= 3.0")
    inner = above.cut(Cut(0, (0.45, -0.2, 0.05), above=True))
    assert inner.cuts == (Cut(0, (0.45, -0.2, 0.05), above=True),)


def test_the_edge_between_two_words_is_found_as_the_curve_it_is():
    known = Known()
    drawn = sample(known, Cell(NAMES, ((0.0, 1.0), (0.0, 3.0))))
    found = sheets(known, drawn, jump=1e-3)
    assert np.allclose(found.points[:, 0], known.curve(found.points[:, 1]), atol=1e-9)
    assert found.number.max() == 1
    cut = best_separator(drawn, found)
    x = np.random.default_rng(1).uniform([0, 0], [1, 3], (20_000, 2))
    assert np.mean(cut.beyond(x) == known.above(x)) in (pytest.approx(1, abs=5e-3), pytest.approx(0, abs=5e-3))


@dataclass(frozen=True)
class Slit(Known):
    """One word throughout, and a jump of the image across the curve: a graze of the base wall."""

    def codes(self, x):
        return np.full(len(x), encode("BB", WALLS))

    def itineraries(self, states, chatter=0.0):
        found = super().itineraries(states)
        return Itineraries(
            WALLS,
            1 + self.above(np.asarray(states)),
            found.turns,
            found.clearance,
            found.slowest,
            found.outcome,
        )


@dataclass(frozen=True)
class Born(Slit):
    """One smooth map whose itinerary changes: the birth of turning points is no edge."""

    def first_return(self, states, derivative=False, chatter=0.0):
        x = np.asarray(states, float)
        zeros = np.zeros(len(x))
        image = np.column_stack([0.5 + 0.1 * x[:, 0], 1 + 0.1 * x[:, 1]])
        return Returns(NAMES, WALLS, x, image, 0 * x.astype(np.int32), self.codes(x), zeros.astype(np.int8), zeros)


@pytest.mark.parametrize(("return_map", "count"), [(Slit(), 2), (Born(), 1)])
def test_a_jump_within_a_word_is_an_edge_and_a_birth_of_turning_points_is_none(return_map, count):
    found = sheets(return_map, sample(return_map, Cell(NAMES, ((0.0, 1.0), (0.0, 3.0)))), jump=1e-3)
    assert found.number.max() + 1 == count
    assert (len(found.points) > 0) == (count == 2)


def test_the_lowest_order_that_meets_the_demand_is_chosen():
    drawn = sample(Known(), Cell(NAMES, ((0.6, 0.9), (0.5, 1.5))))
    known = partial(orders_of, Partition(tolerance=1, separable=False), coordinates=NAMES)
    exactly = choose_order(drawn, Demand(np.full(2, 1e-10), 0.0), known("transient"))
    assert (exactly.order, exactly.met, exactly.word) == ("full v:1 phi:2", True, "BTB")
    assert exactly.max_error.max() < 1e-12
    constant = choose_order(drawn, Demand(np.full(2, 0.3), 0.0), known("transient"))
    assert constant.order == "constant"
    assert choose_order(drawn, Demand(np.full(2, 0.3), 0.0), known("attracting")).order == "full v:1 phi:1"
    few = orders_of(Partition(tolerance=1, max_order=1), "transient", NAMES)
    none = choose_order(drawn, Demand(np.full(2, 1e-10), 0.0), few)
    assert not none.met
    assert none.missed > 0.9


def test_known_pieces_are_found_again():
    known = Known()
    result = partition(known, grid(), Partition(tolerance=1e-6))
    assert result.met
    assert {piece.word for piece in result.composite.pieces} == {"BB", "BTB", ""}
    assert len([piece for piece in result.composite.pieces if piece.word]) <= 4
    x = np.random.default_rng(2).uniform([0, 0], [1, 3], (20_000, 2))
    inside = result.attracting_map.piece_of(x) >= 0
    assert inside.any()
    assert result.attracting_map.piece_of([[0.7, 1.0]]) == 0
    assert apart(result.composite.first_return(x[inside]).image, known.first_return(x[inside]).image).max() < 1e-6
    assert np.allclose(orbit(result.composite, x[:200], 80).final, [0.7, 1.0], atol=1e-5)
    assert result.composite.coverage(x).covered


def test_states_that_never_return_are_left_uncovered_and_counted():
    result = partition(Known(lost=0.2), grid(), Partition(tolerance=1e-3))
    x = np.random.default_rng(3).uniform([0, 0], [1, 3], (5000, 2))
    assert result.met
    assert np.mean((result.composite.piece_of(x) < 0) == (x[:, 0] < 0.2)) > 0.99
    assert result.uncovered["escaped"] == pytest.approx(0.2, abs=0.02)
    assert any(row.became == "left uncovered: nothing returns (escaped)" for row in result.log)


@pytest.mark.parametrize("top", [np.pi, pytest.param(TWO_PI, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("d", [*(pytest.param(d, marks=pytest.mark.thorough) for d in (0.35, 0.3)), 0.26])
def test_the_vibro_impact_pair_arrives_where_the_exact_map_does(pair: Callable, d, top):
    system = pair(d)
    result = partition(system, grid((0.0033, 1), (0, top), 150), Partition(tolerance=1e-3))
    assert result.met
    assert len(result.composite.pieces) <= 20
    x = np.random.default_rng(4).uniform([0.6, 0.05], [1, 0.7], (30_000, 2))
    x = x[result.attracting_map.piece_of(x) >= 0]
    assert len(x) > 3000
    assert apart(result.composite.first_return(x).image, system.first_return(x).image).max() < 1e-3
    exact, ours = (orbit(formulas, [0.35, np.pi / 2], 800).states[-500:] for formulas in (system, result.composite))
    far = 0.01 if d == 0.26 else 2e-3 if d == 0.3 else 1e-3
    assert np.abs(ours.min(axis=0) - exact.min(axis=0)).max() < far
    assert np.abs(ours.max(axis=0) - exact.max(axis=0)).max() < far
    starts = np.random.default_rng(5).uniform([0.0033, 0], [1, top], (200, 2))
    ends = orbit(result.composite, starts, 200).states[-32:]
    assert (result.attracting_map.piece_of(ends.reshape(-1, 2)).reshape(32, 200) >= 0).any(axis=0).mean() > 0.98


@pytest.mark.thorough
def test_one_tolerance_everywhere_makes_transient_pieces_accurate_too(pair: Callable):
    system, over = pair(0.3), grid((0.0033, 1), (0, np.pi), 100)
    x = np.random.default_rng(6).uniform([0.0033, 0], [1, np.pi], (20_000, 2))
    shares = []
    for everywhere in (False, True):
        result = partition(system, over, Partition(tolerance=1e-2, everywhere=everywhere))
        shares.append(np.mean(apart(result.composite.first_return(x).image, system.first_return(x).image) <= 1e-2))
    assert shares[0] < 0.5
    assert shares[1] > 0.9


@pytest.mark.thorough
def test_the_log_names_every_region_once_and_tells_what_became_of_it(pair: Callable):
    result = partition(pair(0.3), grid((0.0033, 1), (0, np.pi), 100), Partition(tolerance=1e-3))
    names = [row.name for row in result.log]
    assert len(set(names)) == len(names)
    assert all(row.became.startswith(("accepted", "split at", "tightened", "given up", "left")) for row in result.log)
    kept = {row.name.partition(".")[0] for row in result.table()}
    assert kept == {piece.name for piece in result.composite.pieces if piece.word}
    assert {name for name in kept if name in result.unmet} == {r.name.partition(".")[0] for r in result.table() if not r.met}
    assert sum(row.share for row in result.table()) == pytest.approx(1, abs=0.05)


def test_resets_lead_to_states_from_which_the_exact_map_stays_in_the_box(pair: Callable):
    system = pair(0.35)
    result = partition(system, grid((0.0033, 1), (0, np.pi), 100), Partition(tolerance=1e-2))
    resets = [piece for piece in result.composite.pieces if not piece.word]
    assert [piece.name for piece in resets] == ["reset v below", "reset v above", "reset phi beside"]
    assert result.composite.coverage([[0.001, 1.0], [2.0, 1.0], [0.5, 4.0]]).covered
    for piece in resets:
        path = orbit(system, piece.map([[0.5, 0.5]])[0], 50).states
        assert (path[:, 0] >= 0.0033).all()
        assert (path[:, 1] <= np.pi).all()


def test_attracting_boxes_hold_the_attractor(pair: Callable):
    system, over = pair(0.26), grid((0.0033, 1), (0, np.pi), 100)
    (box,), states = attracting_boxes(system, system.first_return(over.states()), over, NearDiagonal(delta=1.2, slope=2.0))
    path = orbit(system, [0.7, 0.2], 3000).states[500:]
    assert ((path >= box[:, 0]) & (path <= box[:, 1])).all()
    assert ((states >= box[:, 0]) & (states <= box[:, 1])).all()


class Unnamed(Known):
    """The same map with one word, which does not say that it jumps."""

    def codes(self, x):
        return np.full(len(x), encode("BB", WALLS))


class Upper(ReturnFamily):
    """The returns from above the curve."""

    def contains(self, returns):
        return Known().above(returns.start)


class Even(PolyFit):
    """Monomials v^i phi^(2j)."""

    order: int

    def exponents(self, coordinates, output):
        return np.array([[i, j] for i in range(self.order + 1) for j in (0, 1, 2)])

    def data(self, surface, output):
        return np.ones(len(surface.start), bool)


def test_families_sort_the_returns_of_a_partition():
    known, how = Unnamed(), {"tolerance": 1e-6, "everywhere": True, "max_pieces": 4}
    result = partition(known, grid(), Partition(**how, families=(Upper(name="upper"),)))
    assert result.met
    assert not result.unmet
    x = np.random.default_rng(2).uniform([0, 0], [1, 3], (20_000, 2))
    off = apart(result.composite.first_return(x).image, known.first_return(x).image)
    assert np.quantile(off, 0.99) < 1e-6
    assert partition(known, grid(), Partition(**how)).unmet  # it does not find the jump
    with pytest.raises(ValidationError, match=message("reduced.first-returns", family="upper", number=2)):
        Partition(tolerance=1, families=(Upper(name="upper", max_returns=2),))


def test_given_fits_are_tried_in_turn():
    fits = {"one": Even(order=0), "two": Even(order=1), "three": Even(order=2)}
    result = partition(Known(), grid(), Partition(tolerance=1e-6, orders=fits))
    assert result.met
    assert {row.order for row in result.table() if row.role == "attracting"} == {"two"}
    assert {row.order for row in result.table()} <= {"one", "two", "three", "constant"}


def test_no_piece_lies_across_a_given_region():
    corner = ConditionRegion(text="v > 0.5 and phi < 1.2", coordinates=NAMES)
    result = partition(Known(), grid(), Partition(tolerance=1e-6, regions=(corner,)))
    assert result.met
    assert result.composite.coverage(grid()).covered
    x = np.random.default_rng(2).uniform([0, 0], [1, 3], (20_000, 2))
    number, inside = result.composite.piece_of(x), corner.contains(x)
    assert not set(number[inside]) & set(number[~inside])
    assert set(number[inside]) & {result.composite.pieces.index(each) for each in result.attracting_map.pieces}


class Disc(Region):
    """States near (0.7, 1)."""

    def contains(self, states):
        return ((np.asarray(states) - [0.7, 1]) ** 2).sum(axis=1) <= 0.04

    def condition(self):
        v, phi = sp.symbols("v phi", real=True)
        return (v - 0.7) ** 2 + (phi - 1) ** 2 <= 0.04


def test_an_attracting_region_may_be_of_any_class():
    disc = Disc(coordinates=NAMES)
    result = partition(Known(), grid(), Partition(tolerance=1e-6, attracting=(disc,)))
    x = np.random.default_rng(3).uniform([0.4, 0.7], [1, 1.3], (5000, 2))
    assert result.met
    assert ((result.attracting_map.piece_of(x) >= 0) == disc.contains(x)).all()


@pytest.mark.thorough
def test_attracting_boxes_can_be_given_by_hand(pair: Callable):
    box = {"v": (0.7, 1.0), "phi": (0.2, 1.14)}
    result = partition(pair(0.35), grid((0.0033, 1), (0, np.pi), 60), Partition(tolerance=1e-2, attracting=(box,)))
    x = np.random.default_rng(9).uniform([0.7, 0.2], [1, 1.14], (5000, 2))
    assert result.met
    assert (result.attracting_map.piece_of(x) >= 0).all()
    assert apart(result.composite.first_return(x).image, pair(0.35).first_return(x).image).max() < 1e-2


def test_a_box_over_the_seam_is_two_cells():
    cells = roots(NAMES, np.array([[0.0, 1.0], [-0.5, 0.5]]))
    assert [cell.bounds[1] for cell in cells] == [(TWO_PI - 0.5, TWO_PI), (0.0, 0.5)]
    assert [cell.bounds[1] for cell in roots(NAMES, np.array([[0.0, 1.0], [0.0, TWO_PI]]))] == [(0.0, TWO_PI)]


def test_a_grid_over_the_seam_is_covered(pair: Callable):
    result = partition(pair(0.35), grid((0.0033, 1), (-0.6, 0.9), 60), Partition(tolerance=1e-2))
    x = np.random.default_rng(8).uniform([0.0033, -0.6], [1, 0.9], (5000, 2))
    assert result.met
    assert result.composite.coverage(x).covered


@pytest.mark.parametrize(
    ("v", "phi", "spec"),
    [
        ((0.7, 1), (0.2, 0.5), {"tolerance": 1e-14, "max_pieces": 6}),
        ((0.0033, 1), (0, np.pi), {"tolerance": 1e-12, "max_pieces": 4, "everywhere": True}),
        ((0.0033, 1), (0, np.pi), {"tolerance": 1e-3, "max_order": 0, "max_pieces": 8}),
    ],
)
def test_what_cannot_be_reached_ends_and_is_said(pair: Callable, v, phi, spec):
    result = partition(pair(0.35), grid(v, phi, 40), Partition(**spec))
    assert not result.met
    assert set(result.attracting) <= set(result.unmet)
    assert "given up" in result.reason
    assert any(row.became == f"given up: max_pieces = {spec['max_pieces']}" for row in result.log)
    assert len([piece for piece in result.composite.pieces if piece.word]) <= spec["max_pieces"] + 1


def test_a_box_of_width_1e_9(pair: Callable):
    low = np.array([0.8333859, 0.3636115])
    over = grid((low[0], low[0] + 1e-9), (low[1], low[1] + 1e-9), 10)
    result = partition(pair(0.35), over, Partition(tolerance=1e-12))
    x = over.states()
    assert apart(result.composite.first_return(x).image, pair(0.35).first_return(x).image).max() < 1e-9
    assert (result.attracting, result.met) == ((), False)
    assert result.reason.startswith("no region of the grid attracts")


def test_a_grid_where_nothing_returns():
    result = partition(BouncingBall(a=0.2, r=0.0), grid((0, 1), (0, 6.2), 30), Partition(tolerance=1e-2))
    assert (result.composite.pieces, result.covered, result.uncovered) == ((), 0.0, {"rests": 1.0})
    assert not result.met


@pytest.mark.thorough
def test_a_cycle_through_chatter_is_followed_down_to_the_edge_of_the_grid():
    ball = BouncingBall(a=1.2, r=0.5)  # chatters, rests and is thrown up again, for ever
    result = partition(ball, grid((0.01, 3), (0, TWO_PI), 100), Partition(tolerance=1e-2))
    assert result.met
    exact = orbit(ball, [1.5, 2.0], 120, chatter=np.inf).states[-60:]
    ours = orbit(result.composite, [1.5, 2.0], 60).states[-20:]
    assert np.abs(ours[:, 0].max() - exact[:, 0].max()) < 0.02


def test_an_accurate_map_is_made_by_the_same_call(pair: Callable):
    seen: list[float] = []
    spec = Partition(tolerance=1e-2, kind="accurate")
    result = partition(pair(0.35), grid((0.6, 0.9), (0.1, 0.5), 30), spec, progress=seen.append)
    assert isinstance(result, AccurateResult)
    assert result.met
    assert sorted(seen) == seen
    assert len(seen) > 2
    assert seen[-1] == 1


def test_what_is_asked_wrongly(pair: Callable):
    with pytest.raises(NsmapsError, match=message("exact.grid-axes", axes="v", names="v, phi")):
        partition(pair(0.3), Grid(axes={"v": Axis(low=0, high=1, points=5)}), Partition(tolerance=1))
    for wrong in ({"tolerance": 0}, {"tolerance": 1, "delta": 1}, {"tolerance": 1, "max_pieces": 1}, {}):
        with pytest.raises(ValidationError):
            Partition(**wrong)
