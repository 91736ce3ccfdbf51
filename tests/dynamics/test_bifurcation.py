"""Bifurcation diagrams against loops of single returns and maps whose long run is known in closed form."""

from dataclasses import dataclass

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.coordinates import Angle, Coordinates
from nsmaps.dynamics.motion import label, repetition
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

PHASE = Angle("phi")
X_PHASE = Coordinates(("x", PHASE))


@dataclass(frozen=True)
class Logistic(ReturnMap):
    """x -> a x (1 - x) beside a phase that turns a quarter; x beyond [0, 1] escapes."""

    a: float
    coordinates: Coordinates = X_PHASE

    def first_return(self, states, derivative=False):
        x, phi = np.asarray(states, float).T
        inside = (x >= 0) & (x <= 1)
        image = np.where(inside[:, None], np.column_stack([self.a * x * (1 - x), (phi + np.pi / 2) % (2 * np.pi)]), np.nan)
        turns = np.column_stack([np.zeros(len(x)), phi + np.pi / 2 >= 2 * np.pi]).astype(np.int32)
        outcome = np.select([np.isnan(x), ~inside], [Outcome.invalid, Outcome.escaped], Outcome.returned).astype(np.int8)
        codes = np.where(inside, 1 + 5 * 2 + 25, 0)  # BTB
        return Returns(self.coordinates, ("B", "T"), np.asarray(states), image, turns, codes, outcome, np.full(len(x), np.nan))


def looped(system, state, n):
    """The states of an orbit, one call of first_return each."""
    path = []
    for _ in range(n):
        state = system.first_return([state]).image[0]
        path.append(state)
    return np.array(path)


@pytest.mark.parametrize("follow", ["up", "down", None])
def test_diagram_is_that_of_single_returns(pair, follow):
    values = [0.30, 0.26, 0.35]
    made = nsmaps.bifurcation_diagram(lambda d: pair(d), "d", values, [0.8, 0.4], n_returns=20, transient=30, direction=follow)
    assert made.states.shape == (3, 1, 20, 2)
    order = {"up": [1, 0, 2], "down": [2, 0, 1], None: [0, 1, 2]}[follow]
    state = np.array([0.8, 0.4])
    for k in order:
        path = looped(pair(values[k]), state if follow else [0.8, 0.4], 50)
        assert np.array_equal(made.states[k, 0], path[30:])
        state = path[-1]


def test_both_ways_are_beside_each_other(pair):
    values, starts = [0.30, 0.26, 0.35], [[0.8, 0.4], [0.7, 0.3]]
    up, down, both = (
        nsmaps.bifurcation_diagram(pair, "d", values, starts, n_returns=5, transient=30, direction=way)
        for way in ("up", "down", "both")
    )
    assert np.array_equal(both.states[:, :2], up.states)
    assert np.array_equal(both.states[:, 2:], down.states)
    assert both.labels.tolist() == np.concatenate([up.labels, down.labels], axis=1).tolist()


@pytest.mark.parametrize("count", [1, 3, 40])
def test_starts_run_as_a_batch(pair, count):
    starts = np.random.default_rng(0).uniform([0.01, 0], [1, 2 * np.pi], (count, 2))
    made = nsmaps.bifurcation_diagram(lambda d: pair(d), "d", [0.28], starts, n_returns=5, transient=45)
    for k, start in enumerate(starts):
        assert np.array_equal(made.states[0, k], looped(pair(0.28), start, 50)[45:])


def test_periods_and_labels_of_the_paper(pair):
    values = [0.35, 0.30, 0.27, 0.268, 0.26]
    made = nsmaps.bifurcation_diagram(lambda d: pair(d), "d", values, [0.83, 0.36], direction="down")
    assert made.labels[:, 0].tolist() == ["1:1/T", "1:1/2T", "1:1/4T", "1:1/8T", "1:1/C"]
    assert made.period[:, 0].tolist() == [1, 2, 4, 8, 0]
    assert np.allclose(made.states[0, 0], [0.83338599, 0.36361156], atol=1e-8)
    assert np.allclose(np.sort(made.states[1, 0, -2:], axis=0), [[0.730550, 0.222750], [0.810226, 0.412905]], atol=1e-6)


def test_a_wall_hit_every_other_time_is_counted(pair):
    made = nsmaps.bifurcation_diagram(lambda d: pair(d, r=0.25, beta=np.pi / 6), "d", [0.21], [0.6, 0.3], transient=400)
    assert set(made.words.ravel()) == {"BB", "BTB"}
    assert made.labels.item() == "2:1/T"


def test_periods_of_the_logistic_map():
    """Its cycles have known windows: 1 to 3, 2 to 1 + sqrt 6, 4 to 3.54409, and 3 from 1 + sqrt 8."""
    values = [2.8, 3.2, 3.5, 3.55, 3.84, 4.0]
    made = nsmaps.bifurcation_diagram(Logistic, "a", values, [[0.3, 0.0]], n_returns=64)
    assert made.period[:, 0].tolist() == [4, 4, 4, 8, 12, 0]  # with the quarter turns of the phase
    assert made.labels[:, 0].tolist() == ["4:4/T", "4:4/T", "4:4/T", "4:4/2T", "4:4/3T", "1:1/C"]


def test_orbits_that_end_and_maps_that_cannot_be_made_are_data(pair):
    made = nsmaps.bifurcation_diagram(
        Logistic, "a", [4.5, 3.2, 2.8], [[0.3, 0.0], [2.0, 0.0], [np.nan, 0.0]], n_returns=8, transient=20, direction="down"
    )
    assert made.held.tolist() == [[False] * 3, [True, False, False], [True, False, False]]
    assert made.outcome[:, 1].tolist() == [Outcome.escaped] * 3
    assert made.outcome[:, 2].tolist() == [Outcome.invalid] * 3
    assert made.outcome[:, 0].tolist() == [Outcome.escaped, Outcome.returned, Outcome.returned]
    assert made.reasons == ("", "", "")
    assert made.labels[0].tolist() == ["escapes", "escapes", ""]

    made = nsmaps.bifurcation_diagram(pair(0.3), "d", [0.3, -1.0, 0.35], [0.8, 0.4], n_returns=5, transient=300, direction="up")
    assert made.held[:, 0].tolist() == [True, False, True]
    assert "greater than 0" in made.reasons[1]
    assert made.labels[:, 0].tolist() == ["1:1/2T", "", "1:1/T"]


def test_wrong_calls_are_errors(pair):
    def of(d):
        return pair(0.3).at(d=d)

    with pytest.raises(NsmapsError, match=message("dynamics.no-map-greater", number=2, value=-1, bound=0)):
        nsmaps.bifurcation_diagram(of, "p", [-1, -2], [0.8, 0.4])
    with pytest.raises(NsmapsError, match=message("errors.value", name="direction", value="'left'")):
        nsmaps.bifurcation_diagram(of, "p", [0.3], [0.8, 0.4], direction="left")
    with pytest.raises(NsmapsError, match=message("dynamics.returns-after", number=0, transient=2000)):
        nsmaps.bifurcation_diagram(of, "p", [0.3], [0.8, 0.4], n_returns=0)
    with pytest.raises(NsmapsError, match=message("errors.shape", what="the values have", shape="(0,)")):
        nsmaps.bifurcation_diagram(of, "p", [], [0.8, 0.4])
    with pytest.raises(StateError):
        nsmaps.bifurcation_diagram(of, "p", [0.3], [0.8, 0.4, 0.1])


def test_progress_is_the_share_of_values():
    seen = []
    nsmaps.bifurcation_diagram(
        Logistic, "a", [2.8, 3.2], [0.3, 0.0], n_returns=2, transient=2, parallel=nsmaps.Parallel(progress=seen.append)
    )
    assert seen == [0.5, 1]


@pytest.mark.parametrize("kept", [False, True])
def test_progress_both_ways_is_one_count(kept, tmp_path):
    seen = []
    parallel = nsmaps.Parallel(checkpoint=tmp_path if kept else None, part=1, progress=seen.append)
    nsmaps.bifurcation_diagram(
        Logistic, "a", [2.8, 3.0, 3.2], [0.3, 0.0], n_returns=2, transient=2, direction="both", parallel=parallel
    )
    assert seen == sorted(seen)
    assert seen[-1] == 1


def test_angles_repeat_over_the_cut():
    states = np.array([[1.0, 1e-9], [1.0, 2 * np.pi - 1e-9], [1.0, 1e-9], [1.0, 0.0]])
    assert repetition(states, np.zeros(4, int), Coordinates(("v", PHASE)), 1e-6) == 1
    assert repetition(states, np.zeros(4, int), Coordinates(("v", "phi")), 1e-6) == 0
    assert repetition(states, np.array([1, 2, 1, 2]), Coordinates(("v", PHASE)), 1e-6) == 2


def plainly(states, codes, tolerance):
    """The same by trying every number of returns at every state."""
    for q in range(1, len(states) // 2 + 1):
        if all((abs(states[k] - states[k % q]) <= tolerance).all() and codes[k] == codes[k % q] for k in range(len(states))):
            return q
    return 0


@pytest.mark.parametrize("count", [1, 2, 3, 40, 41])
def test_periods_are_those_of_every_number_tried(count):
    rng = np.random.default_rng(count)
    cycles = [np.resize(rng.uniform(0, 1, (q, 2)), (count, 2)) for q in (1, 2, 3, 7, 19, 20)]
    states = np.concatenate([cycles, np.round(rng.uniform(0, 0.8, (60, count, 2)))])  # of few values: many that nearly repeat
    states[3, -1] += 2e-6
    ended = np.where(np.arange(count)[:, None] > 30, np.nan, [0.5, 0.5])
    states = np.concatenate([states, [0.9 ** np.arange(count)[:, None] * [4e-6, 1e-6], ended]])
    codes = np.where(rng.uniform(0, 1, states.shape[:2]) < 1e-3, 3, 7)
    found = [repetition(*each, Coordinates(("v", "w")), 1e-6) for each in zip(states, codes, strict=True)]
    assert found == [plainly(*each, 1e-6) for each in zip(states, codes, strict=True)]
    assert count < 40 or len(set(found)) > 3


def test_periods_of_long_runs():
    """Of so many returns that to compare every number of them at every state, 2e9 comparisons, would not end in a minute."""
    long, codes = np.random.default_rng(0).uniform(0, 1, (50_000, 2)), np.zeros(50_000, int)
    assert repetition(long, codes, Coordinates(("v", "w")), 1e-6) == 0
    assert repetition(np.resize(long[:7], (50_000, 2)), codes, Coordinates(("v", "w")), 1e-6) == 7


@pytest.mark.parametrize(
    ("words", "turns", "period", "text"),
    [
        (["BTB"] * 4, [1] * 4, 1, "1:1/T"),
        (["BTB"] * 4, [1] * 4, 2, "1:1/2T"),
        (["BTB"] * 4, [0, 1, 0, 1], 2, "2:2/T"),
        (["BB", "BTB"] * 2, [0, 1, 0, 1], 2, "2:1/T"),
        (["BB", "BTB"] * 4, [0, 1] * 4, 4, "2:1/2T"),
        (["BTTB"] * 4, [1] * 4, 1, "1:2/T"),
        (["BTB"] * 4, [0] * 4, 2, "1:1, period 2"),
        (["BB"] * 4, [-1] * 4, 1, "1:0, period 1"),  # of a fitted map, whose phase may run back
        (["BTB"] * 4, [1] * 4, 0, "1:1/C"),
        (["BB", "BTB"] * 2, [0, 1] * 2, 0, "C"),  # the ratio of a sample is none of the attractor
        ((["BTB"] * 8 + ["BB"] * 3) * 5, [1] * 55, 0, "C"),
        (["BB", "BB", "BTB", "BTB", "BTB"], [1] * 5, 0, "C"),
        (["BB", "B~", "BTB"] * 2, [1] * 6, 3, "B~TB/3T"),
        (["B~", "BTB", "BB"] * 2, [1] * 6, 3, "B~TB/3T"),  # wherever on the cycle the orbit was met
        (["BB", "B~", "BB", "BB"] * 2, [0, 1, 0, 0] * 2, 4, "B~B/T"),  # however many impacts there are before they are summed
        ((["BB"] * 30 + ["B~", "BB"]) * 2, ([0] * 30 + [1, 0]) * 2, 32, "B~B/T"),
        (["BTB", "BB", "B~", "BB", "BTB"] * 2, [1, 0, 1, 0, 1] * 2, 5, "BTB BTB B~B/3T"),
        (["BB", "B_"] * 2, [0, 1] * 2, 2, "B_B/T"),
        (["BB", "B_", "BB"] * 2, [1, 1, 0] * 2, 3, "BB B_B/2T"),  # without restitution nothing is summed before a rest
        (["BB", "B~", "BB", "BTB"], [1] * 4, 0, "C"),
        ([""] * 4, [0] * 4, 1, "period 1"),
    ],
)
def test_labels(words, turns, period, text):
    assert label(words, turns, period) == text
