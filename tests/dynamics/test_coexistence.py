"""Coexisting attractors against the ends of their branches and made-up diagrams."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np
import pytest
from messages import message
from systems import GearRattle

import nsmaps
from nsmaps.coordinates import Angle
from nsmaps.dynamics.attractors.coexistence import match_attractors
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

FOLD, GRAZE, DOUBLING = 0.227713761, 0.230488317, 0.234583791  #: of 2:1/T, 1:1/2T and 1:1/T; see test_branch.py


def test_bistable_window_of_the_pair(pair):
    def of(d):
        return pair(d, r=0.25, beta=pi / 6)

    values = np.linspace(0.222, 0.238, 33)
    sweeps = [
        nsmaps.bifurcation_diagram(of, "p", values, [0.6, 0.3], n_returns=200, transient=3000, direction=way)
        for way in ("up", "down")
    ]
    made = match_attractors(sweeps)
    h = values[1] - values[0]
    spans = {span.label: span for span in made.spans}
    assert spans["2:1/T"].low == values[0]
    assert FOLD - h < spans["2:1/T"].high < FOLD
    assert abs(spans["C"].low - 0.22505) <= h
    assert GRAZE < spans["1:1/2T"].low < GRAZE + h
    assert DOUBLING < spans["1:1/T"].low < DOUBLING + 2 * h
    assert spans["1:1/2T"].attractor == spans["1:1/T"].attractor != spans["C"].attractor
    both = made.values[made.counts == 2]
    assert both.min() == spans["C"].low
    assert both.max() == spans["2:1/T"].high
    assert made.counts.max() == 2


def diagram(values, places, period):
    """A diagram of orbits that stay at places (V, S) of one angle; NaN where they ended."""
    places, period = np.asarray(places, float), np.asarray(period)
    shape = (*places.shape, 2)
    states = np.broadcast_to(places[..., None, None], (*shape, 1)).copy()
    codes = np.where(np.isfinite(states[..., 0]), 6, 0)
    blank = np.zeros((*shape, 1), np.int32)
    outcome = np.zeros(places.shape, np.int8)
    labels = np.where(np.isnan(places), "", np.where(period > 0, "1:0, period 1", "1:0/C"))
    about = states, blank, codes, outcome, ("",) * len(values), period, np.ones(1), labels, period
    return BifurcationDiagram((Angle("phi"),), ("B", "T"), "p", np.asarray(values, float), *about)


def test_attractors_are_told_apart_and_matched():
    made = match_attractors([
        diagram([1, 2, 3], [[0.01, 2.0], [6.28, 2.05], [np.nan, 2.1]], np.ones((3, 2), int)),
        diagram([3, 2, 1], [[5.0], [0.02], [0.0]], np.ones((3, 1), int)),
    ])  # fmt: skip
    assert made.attractor.tolist() == [[0, 1, 0], [0, 1, 0], [-1, 1, 2]]  # the circle is counted
    assert made.counts.tolist() == [2, 2, 2]
    assert [(span.attractor, span.low, span.high) for span in made.spans] == [(0, 1, 2), (1, 1, 3), (2, 3, 3)]


@pytest.fixture(scope="module")
def rattle():
    """The gear rattle up and down through chaos, and through its one window with two attractors."""
    values = np.unique([*np.linspace(0.22, 0.25, 7), 0.265, 0.3, 0.35, 0.4, *np.linspace(0.43, 0.48, 11), 0.85])
    return nsmaps.bifurcation_diagram(rattle_at, "p", values, [3.0, 1.0], direction="both")


def rattle_at(eps):
    return GearRattle(eps=eps)


STARTS = np.column_stack([np.random.default_rng(0).uniform(0.05, 15, 60), np.random.default_rng(1).uniform(0, 2 * pi, 60)])


def test_the_rattle_has_as_many_attractors_as_basins_finds(rattle):
    made = match_attractors([rattle])
    for eps, count in [(0.265, 1), (0.3, 1), (0.35, 1), (0.4, 1), (0.43, 1), (0.445, 2), (0.45, 2), (0.48, 1), (0.85, 1)]:
        k = int(np.abs(made.values - eps).argmin())
        assert made.counts[k] == count, eps
        found = nsmaps.basins(rattle_at(float(made.values[k])), STARTS)
        assert (len(found.attractors), found.fractions[:-2].sum()) == (count, 1)
        if count == 2:
            assert {one.label for one in found.attractors} == set(made.labels[k].tolist()) == {"2:1/4T", "1:1/T"}


def test_a_motion_of_the_rattle_that_moves_fast_is_one_span(rattle):
    (span,) = (span for span in match_attractors([rattle]).spans if span.label == "1:0/2T")
    assert (round(span.low, 9), round(span.high, 9)) == (0.225, 0.25)


@pytest.mark.parametrize("unit", [1e-6, 1e4])
def test_the_unit_of_speed_does_not_count(rattle, unit):
    made, other = (match_attractors([each]) for each in (rattle, replace(rattle, states=rattle.states * [unit, 1])))
    assert np.array_equal(made.attractor, other.attractor)
    assert np.array_equal(made.labels, other.labels)


@dataclass(frozen=True)
class Line(ReturnMap):
    """A map of the line, every return a BTB."""

    image: object
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        n = len(x)
        codes, time = np.full(n, 1 + 5 * 2 + 25), np.full(n, np.nan)
        return Returns(("x",), ("B", "T"), x, self.image(x), np.zeros((n, 1), np.int32), codes, np.zeros(n, np.int8), time)


@pytest.mark.parametrize(("a", "count"), [(2.4, 2), (2.55, 2), (2.59, 2), (2.602, 1), (2.65, 1), (2.8, 1)])
@pytest.mark.parametrize("returns", [60, 400])
def test_two_chaotic_attractors_of_the_cubic_map_until_they_merge(a, count, returns):
    """x -> a x - x^3 maps x > 0 into itself as long as its maximum 2 (a/3)^(3/2) is below sqrt(a): up to 3 sqrt(3)/2 = 2.598."""
    starts = np.random.default_rng(0).uniform(0.1, 1.5, (6, 1)) * np.array([[1], [-1]] * 3)
    made = match_attractors(
        [nsmaps.bifurcation_diagram(lambda a: Line(lambda x: a * x - x**3), "a", [a], starts, n_returns=returns)]
    )
    assert made.attractor[0].tolist() == [0, count - 1] * 3
    assert set(made.labels[0].tolist()) == {"1:1/C"}


def test_intermittent_samples_of_one_attractor_are_not_told_as_two():
    """Just below 1 + sqrt 8 the logistic map is chaotic and stays by the period three to come for hundreds of returns."""
    starts = np.random.default_rng(0).uniform(0.1, 0.9, (100, 1))
    made = nsmaps.bifurcation_diagram(lambda a: Line(lambda x: a * x * (1 - x)), "a", [1 + 8**0.5 - 1e-5], starts, n_returns=200)
    names = "states", "turns", "codes", "outcome", "period", "labels", "length"
    for k in range(0, 100, 2):
        two = replace(made, **{name: getattr(made, name)[:, k : k + 2] for name in names})
        assert match_attractors([two]).counts.tolist() == [1]


def test_a_sample_of_less_than_fifty_states_tells_nothing_apart():
    starts = [[0.5], [-0.5]]
    short, long = (
        nsmaps.bifurcation_diagram(lambda a: Line(lambda x: a * x - x**3), "a", [2.55], starts, n_returns=n) for n in (49, 50)
    )
    assert (match_attractors([short]).counts.tolist(), match_attractors([long]).counts.tolist()) == ([1], [2])


def test_an_attractor_has_one_name_at_a_value(pair):
    """One sample may show impacts that another does not: the more general name is the attractor's."""
    one = nsmaps.bifurcation_diagram(pair, "d", [0.26], [[0.8, 0.4], [0.7, 0.3]], n_returns=60)
    assert one.labels.tolist() == [["1:1/C", "1:1/C"]]
    other = replace(one, labels=np.array([["1:1/C", "C"]]))
    assert match_attractors([other]).labels.tolist() == [["C", "C"]]


def test_wrong_calls_are_errors():
    one, other = diagram([1], [[0.0]], [[1]]), diagram([2], [[0.0]], [[1]])
    for wrong in ([], [one, other]):
        with pytest.raises(NsmapsError, match=message("dynamics.different-values")):
            match_attractors(wrong)
    with pytest.raises(NsmapsError, match=message("dynamics.coexistence", tolerance=0, step=0.1)):
        match_attractors([one], tolerance=0)
