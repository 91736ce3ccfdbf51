"""Stability diagrams against single bifurcation diagrams, known windows and curves known in closed form."""

from math import acos, pi, sqrt

import numpy as np
import pytest
from toys import BouncingBall

import nsmaps
from nsmaps.dynamics.diagrams.stability import event_curve, stability_diagram
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome


def test_rows_are_bifurcation_diagrams(pair):
    along, across = [0.26, 0.30, 0.35], [0.5, 0.6]
    made = stability_diagram(lambda d, r: pair(d, r), along, across, [0.8, 0.4], max_period=8)
    for k, r in enumerate(across):
        row = nsmaps.bifurcation(lambda d, r=r: pair(d, r), along, [0.8, 0.4], returns=16, discard=1000, direction="down")
        assert np.array_equal(made.period[k], row.period[:, 0])
        assert np.array_equal(made.labels[k], row.labels[:, 0])
    assert made.labels[0].tolist() == ["1:1/C", "1:1/2T", "1:1/T"]
    assert made.share(1) == 2 / 6


def test_points_without_a_map_are_data(pair):
    def of(d, r):
        return pair(0.3).at(d=d, r=r)

    seen = []
    made = stability_diagram(of, [0.35, -0.1], [0.5, 1.5], [0.8, 0.4], jobs=nsmaps.Jobs(progress=seen.append))
    assert made.period.tolist() == [[1, -1], [-1, -1]]
    assert made.labels.tolist() == [["1:1/T", ""], ["", ""]]
    assert made.outcome.tolist() == [[Outcome.returned, Outcome.invalid], [Outcome.invalid] * 2]
    assert "greater than 0" in made.reasons[0]
    assert "less than or equal to 1" in made.reasons[1]
    assert seen == [0.5, 1]
    with pytest.raises(NsmapsError, match="none of 1 rows has a map"):
        stability_diagram(of, [0.35], [1.5], [0.8, 0.4])


@pytest.mark.parametrize("kind", ["period doubling", "fold"])
def test_curves_of_the_bouncing_ball(kind):
    """The doubling and the fold of its fixed points over restitution, in closed form."""
    es = np.linspace(0.5, 0.6, 6)
    folds = pi * (1 - es) / (1 + es)
    fixed = nsmaps.periodic_orbit(BouncingBall(a=1.2, r=0.5), [2 * pi / 1.5, acos(folds[0] / 1.2)])
    toward = "up" if kind == "period doubling" else "down"
    made = event_curve(lambda a, e: BouncingBall(a=a, r=e), fixed, 1.2, es, kind, (0.5, 2.5), toward)
    doublings = [sqrt(fold**2 + (2 * (1 + e**2) / (1 + e) ** 2) ** 2) for e, fold in zip(es, folds, strict=True)]
    assert np.allclose(made.values, doublings if kind == "period doubling" else folds, atol=1e-8)
    assert made.precision.max() < 1e-8
    assert set(made.reasons) == {""}


def test_a_row_without_an_event_says_why(pair):
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    made = event_curve(lambda d, r: pair(0.3).at(d=d, r=r), fixed, 0.35, [0.5, 1.5, 0.51], "period doubling", (0.33, 0.36))
    assert np.isnan(made.values).all()
    assert made.reasons[0] == "the range ends at 0.33"
    assert "less than or equal to 1" in made.reasons[1]
    assert made.reasons[2] == "the range ends at 0.33"


def test_sweeps_of_no_points_are_errors_and_a_curve_of_none_is_empty(pair):
    with pytest.raises(NsmapsError, match="none of 0 rows has a map: no value across"):
        stability_diagram(pair, [0.3], [], [0.8, 0.4])
    with pytest.raises(NsmapsError, match=r"none of 1 rows has a map: the values have shape \(0,\)"):
        stability_diagram(pair, [], [0.5], [0.8, 0.4])
    with pytest.raises(NsmapsError, match=r"the values across have shape \(1, 1\)"):
        stability_diagram(pair, [0.3], [[0.5]], [0.8, 0.4])
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    assert event_curve(pair, fixed, 0.35, [], "period doubling", (0.33, 0.36)).values.shape == (0,)


def test_a_guess_that_leads_nowhere_says_so_in_every_row(pair):
    lost = nsmaps.periodic_orbit(pair(0.35), [np.nan, 0.4])
    made = event_curve(pair, lost, 0.35, [0.5, 0.6], "period doubling", (0.3, 0.36))
    why = "no orbit at 0.35: Newton's method does not converge, and the guess has no image: invalid"
    assert made.reasons == (why, why)
    assert np.isnan(made.values).all()


def test_the_curve_parts_the_diagram(pair):
    """On either side of the curve of doublings iteration alone finds one state and two."""
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    made = event_curve(pair, fixed, 0.35, [0.5, 0.55, 0.6], "period doubling", (0.25, 0.36))
    for r, d in zip(made.across, made.values, strict=True):
        sides = stability_diagram(pair, [d + 2e-3, d - 2e-3], [r], [0.8, 0.31], discard=20_000)
        assert sides.period.tolist() == [[1, 2]]
