"""Several sections of one kind in a study, each under a name of its own."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from messages import message
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import StudyError

STUDY = """\
system: border_collision
parameters: {tau_L: 0.5, delta_L: 0.3, tau_R: -1.2, delta_R: 0.5, mu: 1}
basins: {starts: {x: {from: -1, to: 1, points: 4}, y: {from: 0, to: 1, points: 2}}, max_returns: 60}
coarse: {analysis: basins, starts: {x: {from: -1, to: 1, points: 3}, y: {from: 0, to: 1, points: 3}}, max_returns: 80}
short:
  {analysis: bifurcation_diagram, parameter: tau_L, from: 0.4, to: 0.6, points: 3, starts: [{x: 0.1, y: 0}], n_returns: 8}
figures: [coarse, short]
"""


def test_two_basins_and_a_diagram_are_computed_stored_drawn_and_reported(tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(STUDY)
    ran = CliRunner().invoke(app, ["run", str(tmp_path / "two.yaml"), "--out", str(tmp_path / "out")])
    assert ran.exit_code == 0, ran.output
    result = nsmaps.read_result(tmp_path / "out")
    system, starts = result.system, [[x, y] for x in (-1, 0, 1) for y in (0, 0.5, 1)]
    assert np.array_equal(result["coarse"].label, nsmaps.basins(system, starts, max_returns=80).label)
    assert (len(result["basins"].label), len(result["coarse"].label)) == (8, 9)
    alone = nsmaps.bifurcation_diagram(system, "tau_L", [0.4, 0.5, 0.6], [0.1, 0], n_returns=8)
    assert np.array_equal(result["short"]["exact"].states, alone.states)
    record = json.loads((tmp_path / "out" / "result.json").read_text())
    assert {"basins", "coarse", "short"} <= set(record["numbers"])
    assert {"basins", "coarse", "short"} <= set(record["timings"])
    assert "9 states, of which reach" in (tmp_path / "out" / "report.html").read_text()
    assert {"coarse.png", "short.png"} <= {file.name for file in (tmp_path / "out" / "figures").iterdir()}
    assert "coarse: Basins of the" in CliRunner().invoke(app, ["show", str(tmp_path / "out")]).output


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("max_returns: 80", "max_return: 80", message("errors.unknown-near", kind="key", name="max_return", at="two.yaml:4:103")),
        ("80", "80, map: [exact, composite]", message("study.needs", section="composite", at=re.compile(r"two\.yaml:4:\d+"))),
        (
            "3}}, max",
            "3}, z: {from: 0, to: 1, points: 2}}, max",
            message("errors.unknown", kind="coordinate", name="z", at=re.compile(r"two.yaml:4:\d+")),
        ),
        (
            "analysis: basins",
            "analysis: basin",
            message("plugins.not-installed", kind="analysis", name="basin", at="two.yaml:4:20"),
        ),
    ],
)
def test_errors_name_the_place_of_the_section(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in STUDY
    (tmp_path / "two.yaml").write_text(STUDY.replace(old, new))
    with pytest.raises(StudyError, match=said):
        nsmaps.load_study(tmp_path / "two.yaml")
