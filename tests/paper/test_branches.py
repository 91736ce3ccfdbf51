"""The shipped study of branches at the paper's parameters: its doublings, and the curve that parts its diagram."""

import json
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from nsmaps import run_study
from nsmaps.plugins import study_files

FIRST = 0.3241885434273126  #: by Newton's method on the implicit equations in 40 digits: tests/dynamics/test_branch.py


@pytest.mark.thorough
def test_the_cascade_of_the_motion_one_to_one_and_where_it_begins_over_restitution(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A part of the diagram: on either side of the curve one state and two, by iteration alone."""
    monkeypatch.chdir(tmp_path)
    study = YAML(typ="safe").load(study_files("vi_pair")["branches"].read_text())
    study["parameter_plane"]["axes"]["d"]["points"] = 41
    study["parameter_plane"]["axes"]["r"] |= {"from": 0.45, "to": 0.55, "points": 3}
    Path("part.yaml").write_text(json.dumps(study))
    made = run_study("part.yaml")
    up, down, *doubled = made.branches["1:1"]
    assert (up.values[-1], down.values[-1]) == (0.4, 0.2)
    assert [branch.period for branch in doubled] == [2, 4, 8, 16]
    at = np.array([branch.of_kind("period doubling")[0].value for branch in (down, *doubled)])
    assert abs(at[0] - FIRST) < 1e-12
    ratios = np.diff(at)[:-1] / np.diff(at)[1:]
    assert abs(ratios[-1] - 4.669201609) < 0.1
    assert abs(ratios[-1] - 4.669201609) < abs(ratios[-2] - 4.669201609)
    assert np.array_equal(down.stable, down.values > FIRST)
    curve = made.plane_curves["period doubling of 1:1"]
    d, r = curve.parameters[np.argsort(curve.parameters[:, 1])].T
    assert abs(np.interp(0.5, r, d) - FIRST) < 1e-10  # where the curve begins
    for row, value in zip(made.parameter_plane.period[..., 0], np.interp(made.parameter_plane.across, r, d), strict=True):
        far = np.abs(made.parameter_plane.along - value) > 2e-3
        assert set(row[far & (made.parameter_plane.along > value)]) == {1}
        assert set(row[far & (made.parameter_plane.along < value) & (made.parameter_plane.along > 0.29)]) == {2}
