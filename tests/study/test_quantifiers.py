"""Quantifiers of attractors in a study: functions of a file, checked, run, stored, reported and drawn."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import StudyError

CODE = """
import nsmaps

class Logistic(nsmaps.PiecewiseMap):
    r: float = 3.2
    height: float = 1.0
    coordinates = ("x",)

    def pieces(self, x):
        return {"A": (True, {"x": self.r * x.x * (1 - x.x / self.height)})}

def mean(states, return_map):
    return states[:, 0].mean()
"""
STUDY = """\
system: mine.py:Logistic
grid: {x: {from: 0.2, to: 0.8, points: 4}}
basins: {quantifiers: {mean: "mine.py:mean"}}
parameter_plane:
  axes:
    r: {from: 3.2, to: 3.4, points: 2}
    height: {from: 1, to: 2, points: 2}
  starts: [{x: 0.3}]
  n_returns: 64
  max_period: 4
  quantifiers: {mean: "mine.py:mean"}
global_continuation:
  {parameter: r, from: 3.2, to: 3.4, points: 2, box: {x: [0.1, 0.9]}, n_samples: 4, n_kicks: 2, step: 1,
   quantifiers: {mean: "mine.py:mean"}}
figures: [parameter_plane, global_continuation]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(CODE)
    (tmp_path / "s.yaml").write_text(STUDY)
    return tmp_path


def test_a_study_computes_stores_and_reports_quantifiers(folder: Path) -> None:
    study = nsmaps.load_study(folder / "s.yaml")
    nsmaps.run_study(study, folder / "out")
    numbers = json.loads((folder / "out" / "result.json").read_text())["numbers"]
    assert numbers["basins"]["attractors"][0]["quantifiers"]["mean"] == pytest.approx(4.2 / 6.4)
    assert numbers["parameter_plane"]["quantifiers"]["mean"] == pytest.approx([4.4 / 6.8, 2 * 4.2 / 6.4])
    assert np.ravel(numbers["global_continuation"]["quantifiers"]["mean"]) == pytest.approx([4.2 / 6.4, 4.4 / 6.8])
    kept = nsmaps.read_result(folder / "out")
    assert kept.basins.quantifiers["mean"] == pytest.approx([4.2 / 6.4])
    assert kept.parameter_plane.quantifiers["mean"].shape == (2, 2, 1)
    assert "mine.py:mean" in (folder / "out" / "study.yaml").read_text()
    (folder / "mine.py").write_text(CODE.replace("mean()", "max()"))
    with pytest.raises(nsmaps.NsmapsError, match=message("study.other-run", what="versions")):
        nsmaps.run_study(study, folder / "out", resume=True)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        (
            'basins: {quantifiers: {mean: "mine.py:mean"',
            'basins: {quantifiers: {mean: "mine.py:men"',
            message("plugins.no-function", name="men"),
        ),
        (
            'basins: {quantifiers: {mean: "mine.py:mean"',
            'basins: {quantifiers: {label: "mine.py:mean"',
            message("dynamics.quantifier-taken", name="label", result="Basins"),
        ),
        (
            'basins: {quantifiers: {mean: "mine.py:mean"',
            'basins: {quantifiers: {mean: "no.py:mean"',
            message("plugins.no-file", name="mean", form="function"),
        ),
        (
            'basins: {quantifiers: {mean: "mine.py:mean"',
            'basins: {quantifiers: {mean: "mine.py:nsmaps"',
            message("plugins.not-a-quantifier"),
        ),
    ],
)
def test_what_is_not_a_function_is_refused_at_its_place(folder: Path, before: str, after: str, says: str) -> None:
    (folder / "s.yaml").write_text(STUDY.replace(before, after))
    with pytest.raises(StudyError, match=says) as caught:
        nsmaps.load_study(folder / "s.yaml")
    assert "s.yaml:3:3" in str(caught.value)


def test_its_file_is_not_run_with_installed_only(folder: Path) -> None:
    (folder / "s.yaml").write_text(STUDY.replace("mine.py:Logistic", "circle_map"))
    with pytest.raises(StudyError, match=message("study.executed", kind="function", what="file", path=re.compile(".*mean"))):
        nsmaps.load_study(folder / "s.yaml", installed_only=True)
