"""The section `estimate` of a study: its result, verdict, figure and errors."""

from pathlib import Path

import numpy as np
import pytest
from messages import message
from rig import Rig

import nsmaps
from nsmaps.errors import StudyError
from nsmaps.estimation import basin_distance
from nsmaps.study.pictures.draw import draw

TIMES, WALLS, _ = Rig().impacts(11, 0.8, 0.4, 10.0)
HEAD = "system: vi_pair\nparameters: {d: 0.35, r: 0.45, g_bar: 0.2113}\n"


def test_a_study_estimates_from_a_file_beside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [f"{25 * (time + 0.4 / 3.141592653589793):.4f},{wall}" for time, wall in zip(TIMES, WALLS, strict=True)]
    (tmp_path / "rig.csv").write_text("time,wall\n" + "\n".join(rows))
    study = tmp_path / "rig.yaml"
    data = "estimate:\n  data: [{file: rig.csv, noise: 0.05, time_unit: 25, phase: 0}]\n  free: {r: [0.2, 0.9]}\n  n_guesses: 1\n"
    data += "basin_distance: {directions: [[0.1, 0], [0, 1]], n_draws: 1}\n"
    study.write_text(f"{HEAD}{data}figures: [estimate, margin]\n")
    monkeypatch.chdir(Path(__file__).parent)
    result = nsmaps.run_study(nsmaps.load_study(study), out=tmp_path / "run")
    stored = nsmaps.read_result(tmp_path / "run")
    assert stored["estimate"].values.tolist() == result["estimate"].values.tolist()
    drawn = [path.name for path in draw(stored, ["estimate", "margin"], tmp_path / "figures", dpi=40)]
    assert drawn == ["estimate.png", "margin.png"]
    margin = basin_distance(result.system, result["estimate"], directions=[[0.1, 0], [0, 1]], n_draws=1)
    np.testing.assert_array_equal(stored["basin_distance"].distances, margin.distances)
    assert str(margin) in next(result.study.basin_distance.findings(result)).text
    found = result.parts["estimate"]
    assert abs(found.values[0] - 0.5) < 3 * found.errors[0]
    (verdict,) = [one for one in result.verdicts if one.name.startswith("estimate")]
    assert verdict.holds
    assert [panel.name for panel in nsmaps.study.study.CATALOGUE["estimate"].sheets(result)] == ["estimate"]


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ("data: [{file: none.csv}]\n  free: {r: [0, 1]}", message("estimation.unread", file="none.csv", at="rig.yaml:4:10")),
        (
            "data: [{times: [1, 0]}]\n  free: {r: [0, 1]}",
            message("estimation.decreasing", what="times", at="rig.yaml:4:10: the record"),
        ),
        ("data: [{times: [0, 1]}]\n  free: {q: [0, 1]}", message("errors.unknown", kind="parameter", name="q")),
        (
            "data: [{times: [0, 1]}]\n  free: {r: [0, 1]}\nbasin_distance: {record: 1}",
            message("estimation.no-record", number=1, count=1, at="6:26"),
        ),
        (
            "data: [{times: [0, 1]}]\n  free: {r: [0, 1]}\nbasin_distance: {directions: [[1]]}",
            message("errors.shape", what="directions have", shape="(1, 1)", expected="(D, 2)", at="6:30"),
        ),
    ],
)
def test_wrong_data_are_refused_at_their_place(tmp_path: Path, section: str, said: str) -> None:
    study = tmp_path / "rig.yaml"
    study.write_text(f"{HEAD}estimate:\n  {section}\n")
    with pytest.raises(StudyError, match=said):
        nsmaps.run_study(nsmaps.load_study(study))
