"""The general algorithm in three and four coordinates, some of which are negative, and against a map whose pieces are known."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest
from messages import message
from nsmaps_recoil_pair import RecoilPair

from nsmaps import Axis, Grid, orbit, partition
from nsmaps.coordinates import TWO_PI, Angle, wrap
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Itineraries, Returns
from nsmaps.exact.words import encode
from nsmaps.reduced.partition.cell import Cell, Cut, powers, roots, sample, side_of
from nsmaps.reduced.partition.separators import best_separator, sheets
from nsmaps.reduced.partition.spec import Partition

NAMES, WALLS = ("v", "u", Angle("phi")), ("B", "T")
BOX = {"v": (0.0, 1.0), "u": (-1.0, 1.0), "phi": (0.0, 3.0)}


@dataclass(frozen=True)
class Known(ReturnMap):
    """A map of two words: a contraction to (0.7, -0.2, 1) above a surface, a push towards it below; quadratic, with a jump."""

    coordinates = NAMES
    letters = WALLS

    def surface(self, x):
        return 0.4 - 0.2 * x[:, 1] - 0.1 * x[:, 2] + 0.05 * x[:, 1] * x[:, 2]

    def codes(self, x):
        return np.where(x[:, 0] > self.surface(x), encode("BTB", WALLS), encode("BB", WALLS))

    def first_return(self, states, derivative=False, chatter=0.0):
        x = np.asarray(states, float)
        a, b, c = (x - [0.7, -0.2, 1.0]).T
        up = np.column_stack([0.7 + 0.3 * a - 0.1 * c**2, -0.2 - 0.4 * b + 0.1 * a * c, 1 - 0.4 * a + 0.2 * c])
        down = np.column_stack([0.8 + 0.1 * a * c, -0.1 + 0.1 * b, 1.2 - 0.1 * c])
        lifted = np.where((x[:, 0] > self.surface(x))[:, None], up, down)
        image = np.where([False, False, True], wrap(lifted), lifted)
        turns = np.round((lifted - image) / TWO_PI).astype(np.int32)
        return Returns(NAMES, WALLS, x, image, turns, self.codes(x), np.zeros(len(x), np.int8), np.zeros(len(x)))

    def itineraries(self, states, chatter=0.0):
        x = np.asarray(states, float)
        ones, outcome = np.ones(len(x)), np.full(len(x), Outcome.returned, np.int8)
        return Itineraries(WALLS, self.codes(x), np.zeros(len(x), np.int32), ones, ones, outcome)


def states(count, seed):
    low, high = np.array(list(BOX.values())).T
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


def test_powers_are_all_monomials_by_degree():
    assert powers(1, 4) == ((0,), (1,), (2,), (3,))
    assert powers(2, 6) == ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    every = {each for each in product(range(4), repeat=3) if sum(each) <= 3}
    assert set(powers(3, 20)) == every


def test_a_grid_in_more_coordinates_has_as_many_states_as_it_says():
    assert side_of(2, 40) == 40
    assert side_of(3, 40) ** 3 == pytest.approx(2 * 1600, rel=0.3)
    assert side_of(4, 80) ** 4 == pytest.approx(4 * 6400, rel=0.3)


def test_a_cut_is_what_its_text_says():
    cell = Cell(NAMES, tuple(BOX.values()))
    cut = Cut(0, (0.4, -0.2, -0.1, 0.0, 0.05), above=True)
    part, rest = (cell.cut(side) for side in reversed(cut.sides()))
    assert part.text.endswith("v > 0.4 - 0.2*u - 0.1*phi + 0.0*u**2 + 0.05*u*phi")
    x = states(5000, 0)
    assert np.array_equal(part.region.contains(x), Known().codes(x) == encode("BTB", WALLS))
    assert np.array_equal(part.region.contains(x), cut.beyond(x))
    assert not (part.region.contains(x) & rest.region.contains(x)).any()


def test_a_box_across_phase_zero_is_two_cells():
    found = roots(NAMES, np.array([[0.1, 0.2], [-1, 1], [6.0, 6.5]]))
    assert [cell.bounds[2] for cell in found] == [(6.0, TWO_PI), (0.0, 6.5 - TWO_PI)]


def test_the_surface_between_two_words_is_found():
    known = Known()
    drawn = sample(known, Cell(NAMES, tuple(BOX.values())))
    found = sheets(known, drawn, jump=1e-3)
    assert np.abs(found.points[:, 0] - known.surface(found.points)).max() < 1e-9
    cut = best_separator(drawn, found)
    x = states(20_000, 1)
    assert np.mean(cut.beyond(x) == (x[:, 0] > known.surface(x))) in (pytest.approx(1, abs=5e-3), pytest.approx(0, abs=5e-3))


def test_known_pieces_are_found_again():
    known = Known()
    grid = Grid(axes={name: Axis(low=low, high=high, points=20) for name, (low, high) in BOX.items()})
    result = partition(known, grid, Partition(tolerance=1e-6))
    assert result.met
    assert {piece.word for piece in result.composite.pieces} == {"BB", "BTB", ""}
    x = np.array([0.7, -0.2, 1.0]) + 0.02 * (states(20_000, 2) - [0.5, 0.0, 1.5])
    inside = result.attracting_map.piece_of(x) >= 0
    assert inside.mean() > 0.5
    image, exact = result.composite.first_return(x[inside]).image, known.first_return(x[inside]).image
    assert np.abs(image - exact).max() < 1e-6
    assert exact[:, 1].min() < 0  # a negative coordinate keeps its sign
    assert np.allclose(orbit(result.composite, states(200, 3), 80).final, [0.7, -0.2, 1.0], atol=1e-5)


def test_states_below_a_coordinate_that_may_be_negative_are_reset():
    known = Known()
    axes = {name: Axis(low=low / 4, high=high / 4 if name == "u" else high, points=16) for name, (low, high) in BOX.items()}
    result = partition(known, Grid(axes=axes), Partition(tolerance=1e-3))
    assert result.composite.piece_of([[0.5, -0.9, 1.0], [0.5, 0.9, 1.0]]).min() >= 0
    assert {"reset u below", "reset u above"} <= {piece.name for piece in result.composite.pieces}
    assert "reset v below" not in {piece.name for piece in result.composite.pieces}


def test_strips_are_for_two_coordinates():
    grid = Grid(axes={name: Axis(low=low, high=high, points=5) for name, (low, high) in BOX.items()})
    with pytest.raises(NsmapsError, match=message("reduced.plane-of-pieces")):
        partition(Known(), grid, Partition(tolerance=1e-3, kind="accurate"))


@pytest.mark.thorough
def test_the_recoil_pair_has_a_map_of_few_pieces():
    system = RecoilPair(eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, r=0.5, g_bar=0.2113)
    centre, reach = np.array([0.8389, -0.3458, 0.1482, 0.3093]), np.array([0.2, 0.1, 0.2, 0.4])
    spans = {name: (x - h, x + h) for name, x, h in zip(system.coordinates, centre, reach, strict=True)}
    box = {name: (float(x - 0.4 * h), float(x + 0.4 * h)) for name, x, h in zip(system.coordinates, centre, reach, strict=True)}
    grid = Grid(axes={name: Axis(low=float(low), high=float(high), points=9) for name, (low, high) in spans.items()})
    result = partition(system, grid, Partition(tolerance=1e-3, attracting=(box,)))
    assert len(result.attracting) <= 4
    assert result.max_error < 1e-3
    fixed = orbit(system, [[0.84, -0.35, 0.15, 0.31]], 400).final[0]
    assert np.abs(orbit(result.composite, [[0.84, -0.35, 0.15, 0.31]], 400).final[0] - fixed).max() < 1e-3
