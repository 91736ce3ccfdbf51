"""Steps until a region is left and a closed set is reached, against orbits of many states and against a closed form."""

from dataclasses import replace

import numpy as np
import pytest
from boxmaps import Henon, one_each
from messages import message

from nsmaps.cells.grid import Cells
from nsmaps.cells.morse import forward_invariant_box, forward_invariant_set, morse_sets
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.cells.times import exit_times
from nsmaps.errors import NsmapsError
from nsmaps.reduced.conditions.region import Box, ConditionRegion

WINDOW = [[-5.5, 2.5], [-2, 2]]
REGIONS = {
    "inner": Box(coordinates=("x", "y"), bounds={"x": (0.5, 2), "y": (-1, 1)}),
    "below": ConditionRegion(text="y < -0.5", coordinates=("x", "y")),
    "rest": Box(coordinates=("x", "y"), bounds={"x": (-6, 6), "y": (-2, 2)}),
}


@pytest.fixture(scope="module")
def found():
    return_map = Henon(0.2)
    cover = morse_sets(return_map, WINDOW, depth=5)
    cycles = find_cycles(return_map, WINDOW, max_period=2, depth=6).cycles
    return exit_times(
        return_map,
        REGIONS,
        WINDOW,
        depth=3,
        n_cells=32,
        target=forward_invariant_set(return_map, cover, cover.minimal[0]),
        cycles=cycles,
    )


def test_every_state_does_what_is_shown_of_its_cell(found):
    """10^5 random states followed: each has left its region within the steps of its cell, and arrived within those."""
    return_map, rng = Henon(0.2), np.random.default_rng(7)
    start = rng.uniform(*np.array(WINDOW).T, (100_000, 2))
    number = found.cells.numbers_of(start)
    region, left, arrived = found.region[number], found.left[number], found.arrived[number]
    cover = morse_sets(return_map, WINDOW, depth=5)
    target = forward_invariant_set(return_map, cover, cover.minimal[0])
    x = start
    gone = np.zeros(len(x), bool)
    for step in range(1, max(left.max(), arrived.max()) + 1):
        x = np.clip(return_map.first_return(x).image, -1e50, 1e50)
        here = found.cells.numbers_of(x)
        gone |= np.where(here >= 0, found.region[here], -1) != region
        assert gone[(left >= 0) & (left <= step)].all()
        assert target.contains(x[(arrived >= 0) & (arrived <= step)]).all()
    assert (left[region >= 0] != 0).all()
    assert {1, 2, 3} < set(left.tolist())


def test_what_stays_holds_the_fixed_points(found):
    """The saddle's cell in `below` and the sink's in `inner` never leave; the saddle's never arrives."""
    for cycle in found.cycles:
        number = found.cells.numbers_of(cycle.states)[0]
        assert found.left[number] == -1
        assert (found.arrived[number] >= 0) == cycle.stable
    assert [row.periodic for row in found.rows] == [1, 1, 0, 2]
    assert found.points.shape == (2, 2)


def test_what_has_arrived_at_the_start_is_told_as_no_returns(found):
    """A region all of whose cells are in the closed set already: after 0 returns, which is not the dash of what is not shown."""
    row = next(row for row in found.rows if row.region == "inner")
    assert replace(row, left_steps=None, arrives_steps=0).texts()[3::3] == ("-", "0")
    cells = Cells.over(("x", "y"), [[0.5, 1.5], [0, 0.5]], 16)
    held = forward_invariant_box(Henon(0.2), cells.box, n_cells=16)
    made = exit_times(
        Henon(0.2), {"all": Box.of(("x", "y"), [(0.5, 1.5), (0, 0.5)])}, cells.box, depth=0, n_cells=16, target=held
    )
    assert made.rows[0].arrives_steps == 0
    assert made.table().splitlines()[1].split()[-3] == "0"


def test_the_table_says_shares_steps_and_what_stays(found):
    rows = {row.region: row for row in found.rows}
    mask = found.region == 2
    assert rows["rest"].area == mask.mean()
    assert rows["rest"].left == pytest.approx((found.left[mask] >= 0).mean())
    assert rows["rest"].left_steps == found.left[mask].max()
    assert rows["rest"].stays == (found.left[mask] == -1).sum()
    assert rows["all"].stays == (found.left[found.region >= 0] == -1).sum()
    text = found.table()
    assert text.splitlines()[0].split()[:3] == ["region", "area", "left"]
    assert [line.split()[0] for line in text.splitlines()[1 : 1 + len(found.rows)]] == [row.region for row in found.rows]
    assert f"{rows['rest'].stays} cells" in text


class Fall:
    """x' = 0.45 x: [0.25, 1] is left in one return below 0.5555, in two above."""

    coordinates = ("x",)

    def image_boxes(self, boxes):
        return one_each(0.45 * boxes, empty=boxes[:, 0, 1] > 1.4)


def test_steps_of_a_map_in_closed_form():
    regions = {"near": Box.of(("x",), [(0.25, 1)]), "far": Box.of(("x",), [(1, 2)])}
    made = exit_times(Fall(), regions, [[0, 2]], depth=2, n_cells=16)
    x = made.cells.centres(np.arange(64))[:, 0]
    assert set(made.left[(x > 0.63) & (x < 1)]) == {2}
    assert set(made.left[(x > 0.25) & (x < 0.48)]) == {1}
    assert set(made.left[(x > 1) & (x < 1.37)]) == {1}
    assert set(made.left[x > 1.45]) == {-1}
    assert made.arrived is None
    assert made.rows[0].texts()[5:7] == ("-", "-")


def test_a_target_that_is_not_closed_is_refused():
    cover = morse_sets(Henon(), [[-1.2, 1.2], [-0.3, 0.3]], depth=3)
    held = forward_invariant_set(Henon(), cover)
    assert not held.forward_invariant
    with pytest.raises(NsmapsError, match=message("cells.not-closed")):
        exit_times(Henon(), REGIONS, WINDOW, target=held)
