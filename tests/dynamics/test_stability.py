"""Stability diagrams against single bifurcation diagrams, and on either side of a bifurcation curve."""

import numpy as np
import pytest

import nsmaps
from nsmaps.dynamics.diagrams.stability import stability_diagram
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import Outcome


def test_rows_are_bifurcation_diagrams(pair):
    along, across = [0.26, 0.30, 0.35], [0.5, 0.6]
    made = stability_diagram(lambda d, r: pair(d, r), {"d": along, "r": across}, [0.8, 0.4], max_period=8)
    for k, r in enumerate(across):
        row = nsmaps.bifurcation_diagram(
            lambda d, r=r: pair(d, r), "d", along, [0.8, 0.4], n_returns=16, transient=1000, direction="down"
        )
        assert np.array_equal(made.period[k], row.period[:, 0])
        assert np.array_equal(made.labels[k], row.labels[:, 0])
    assert made.labels[0].tolist() == ["1:1/C", "1:1/2T", "1:1/T"]
    assert made.share(1) == 2 / 6


def test_points_without_a_map_are_data(pair):
    def of(d, r):
        return pair(0.3).at(d=d, r=r)

    seen = []
    made = stability_diagram(of, {"d": [0.35, -0.1], "r": [0.5, 1.5]}, [0.8, 0.4], parallel=nsmaps.Parallel(progress=seen.append))
    assert made.period.tolist() == [[1, -1], [-1, -1]]
    assert made.labels.tolist() == [["1:1/T", ""], ["", ""]]
    assert made.outcome.tolist() == [[Outcome.returned, Outcome.invalid], [Outcome.invalid] * 2]
    assert "greater than 0" in made.reasons[0]
    assert "less than or equal to 1" in made.reasons[1]
    assert seen == [0.5, 1]
    with pytest.raises(NsmapsError, match="none of 1 rows has a map"):
        stability_diagram(of, {"d": [0.35], "r": [1.5]}, [0.8, 0.4])


def test_sweeps_of_no_points_are_errors_and_a_curve_of_none_is_empty(pair):
    with pytest.raises(NsmapsError, match="there is no value across"):
        stability_diagram(pair, {"d": [0.3], "r": []}, [0.8, 0.4])
    with pytest.raises(NsmapsError, match=r"none of 1 rows has a map: the values have shape \(0,\)"):
        stability_diagram(pair, {"d": [], "r": [0.5]}, [0.8, 0.4])
    with pytest.raises(NsmapsError, match=r"the values across have shape \(1, 1\)"):
        stability_diagram(pair, {"d": [0.3], "r": [[0.5]]}, [0.8, 0.4])


def test_the_curve_parts_the_diagram(pair):
    """On either side of the curve of doublings iteration alone finds one state and two."""
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    branch = nsmaps.continue_branch(
        lambda d: pair(d, 0.5), "d", fixed, 0.35, (0.25, 0.36), direction="down", until=("period doubling",)
    )
    made = nsmaps.bifurcation_curve(pair, {"d": (0.25, 0.36), "r": (0.45, 0.6)}, branch.events[-1], 0.5, step=0.2)
    assert np.ptp(made.parameters[:, 1]) == pytest.approx(0.15)
    for d, r in made.parameters[:: max(len(made.parameters) // 3, 1)]:
        sides = stability_diagram(pair, {"d": [d + 2e-3, d - 2e-3], "r": [r]}, [0.8, 0.31], transient=20_000)
        assert sides.period.tolist() == [[1, 2]]
