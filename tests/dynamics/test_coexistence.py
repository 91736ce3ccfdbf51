"""Coexisting attractors against the ends of their branches and made-up diagrams."""

from math import pi

import numpy as np
import pytest

import nsmaps
from nsmaps.dynamics.bifurcation import Bifurcation
from nsmaps.dynamics.coexistence import coexistence
from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Angle

FOLD, GRAZE, DOUBLING = 0.227713761, 0.230488317, 0.234583791  #: of 2:1/T, 1:1/2T and 1:1/T; see test_branch.py


def test_bistable_window_of_the_pair(pair):
    def of(d):
        return pair(d, r=0.25, beta=pi / 6)

    values = np.linspace(0.222, 0.238, 33)
    sweeps = [nsmaps.bifurcation(of, values, [0.6, 0.3], 200, 3000, way) for way in ("up", "down")]
    made = coexistence(sweeps)
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
    return Bifurcation(
        (Angle("phi"),), ("B", "T"), np.asarray(values, float), states, blank, codes, outcome, ("",) * len(values), period
    )


def test_attractors_are_told_apart_and_matched():
    made = coexistence([
        diagram([1, 2, 3], [[0.01, 2.0], [6.28, 2.05], [np.nan, 2.1]], np.ones((3, 2), int)),
        diagram([3, 2, 1], [[5.0], [0.02], [0.0]], np.ones((3, 1), int)),
    ])  # fmt: skip
    assert made.attractor.tolist() == [[0, 1, 0], [0, 1, 0], [-1, 1, 2]]  # the circle is counted
    assert made.counts.tolist() == [2, 2, 2]
    assert [(span.attractor, span.low, span.high) for span in made.spans] == [(0, 1, 2), (1, 1, 3), (2, 3, 3)]


def test_wrong_calls_are_errors():
    one, other = diagram([1], [[0.0]], [[1]]), diagram([2], [[0.0]], [[1]])
    for wrong in ([], [one, other]):
        with pytest.raises(NsmapsError, match="not the same values"):
            coexistence(wrong)
