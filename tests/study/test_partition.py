"""Studies whose pieces the general algorithm finds: their grammar, their results and what is kept of them."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from messages import message
from typer.testing import CliRunner

from nsmaps.cli.cli import app
from nsmaps.errors import StudyError
from nsmaps.report.page import write_report
from nsmaps.study.reading.reader import load_study
from nsmaps.study.result import StudyResult
from nsmaps.study.run import run_study
from nsmaps.study.store.archive import read_result

AUTO = """\
system: vi_pair
parameters: {d: 0.3, r: 0.5, M: 0.1245, g: 9.8, beta: pi/3, F: 5}
grid:
  v: {from: 0.0033, to: 1, points: 60}
  phi: {from: 0, to: pi, points: 60}
partition: {tolerance: 1e-2}
orbits: [{start: {v: 0.35, phi: pi/2}, n_returns: 100}]
domains:
  - {name: ours, map: attracting, box: {v: [0.7, 0.85], phi: [0.2, 0.42]}, max_updates: 2}
  - {name: all, map: composite, box: {v: [0.7, 0.85], phi: [0.2, 0.42]}, max_updates: 2}
  - {name: first, map: R1, box: {v: [0.7, 0.85], phi: [0.2, 0.42]}, max_updates: 2}
second_iterate: {domain: first}
figures: [words, partition, cobweb]
require: [covered, tolerance]
"""


@pytest.fixture
def made(computed: Callable[..., tuple[StudyResult, Path]]) -> tuple[StudyResult, Path]:
    """The result of the study and its folder."""
    return computed(AUTO, "auto")


def test_a_partition_gives_the_composite_map_and_its_verdicts(made: tuple[StudyResult, Path]) -> None:
    result, _ = made
    assert result.holds
    assert result.composite is result.partition.composite
    assert list(result.surfaces) == ["BB", "BTB"]
    verdicts = {verdict.name: verdict for verdict in result.verdicts}
    tolerance = verdicts["partition: tolerance met in the attracting regions"]
    assert (tolerance.holds, tolerance.required) == (True, True)
    assert f"at {result.partition.points} held-out states" in tolerance.text
    assert not verdicts["partition: orbits arrive in the attracting regions"].required
    assert np.abs(result.orbits[0].composite.final - result.orbits[0].exact.final).max() < 0.02
    assert result.domains["ours"].of == "attracting map"
    assert result.domains["first"].of == "fitted map R1"


def test_a_partition_is_kept_and_read_back(made: tuple[StudyResult, Path]) -> None:
    result, folder = made
    again = read_result(folder)
    assert again.study == result.study
    assert again.partition.log == result.partition.log
    assert again.partition.attracting == result.partition.attracting
    states = result.returns.start
    assert np.array_equal(again.partition.composite.piece_of(states), result.composite.piece_of(states))
    record = json.loads((folder / "result.json").read_text(), parse_constant=pytest.fail)
    table = record["numbers"]["partition"]
    assert (table["tolerance"], table["met"]) == (0.01, True)
    assert [row["name"] for row in table["log"]] == [row.name for row in result.partition.log]
    assert load_study(folder / "study.yaml").partition == result.study.partition


def test_check_and_run_print_it() -> None:
    Path("auto.yaml").write_text(AUTO)
    answer = CliRunner().invoke(app, ["check", "auto.yaml"])
    assert "  partition: closed_form, tolerance 0.01" in answer.stdout.splitlines()
    answer = CliRunner().invoke(app, ["run", "auto.yaml", "--out", "out"])
    assert answer.exit_code == 0, answer.output
    assert "attracting" in answer.stdout
    drawn = {path.stem for path in Path("out/figures").iterdir()}
    assert drawn == {"words", "partition", "cobweb", "speed_error"}, "the last without being named"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("domains:", "composite: [{name: a, where: v > 0, reset: {v: 1}}]\ndomains:", message("study.two-compositions")),
        ("tolerance: 1e-2", "tolerance: 0", message("errors.greater", name="tolerance", value=0.0, bound=0)),
        ("tolerance: 1e-2", "tolerence: 1e-2", message("errors.unknown-near", near="tolerance")),
        ("tolerance: 1e-2", "tolerance: 1e-2, kind: exact", message("errors.unknown", known="closed_form, accurate")),
        ("tolerance: 1e-2", "tolerance: 1e-2, kind: accurate", message("study.figure-of-closed-forms")),
        (
            "tolerance: 1e-2",
            "tolerance: 1e-2, kind: accurate, max_order: 3",
            message("study.of-closed-forms", names="'max_order'"),
        ),
        ("partition: {tolerance: 1e-2}\n", "", message("errors.unknown", known="exact")),
        ("map: R1", "map: R99", message("study.no-piece", name="R99")),
        ("map: R1", "map: attractive", message("errors.unknown-near", near="attracting")),
        ("figures: [words, ", "figures: [words, surfaces, envelops, ", message("errors.unknown-near", near="envelopes")),
    ],
)
def test_what_a_partition_cannot_be(old: str, new: str, said: str) -> None:
    Path("bad.yaml").write_text(AUTO.replace(old, new, 1))
    with pytest.raises(StudyError, match=said):
        run_study("bad.yaml")


def test_a_partition_needs_a_grid() -> None:
    Path("bad.yaml").write_text("system: vi_pair\nparameters: {d: 0.3, g_bar: 0.2}\npartition: {tolerance: 1}\n")
    with pytest.raises(StudyError, match=message("study.needs", what="'partition'", section="grid")):
        run_study("bad.yaml")


def test_the_shipped_study_meets_its_tolerance() -> None:
    study = load_study("vi_pair/auto")
    assert study.partition is not None
    assert run_study(study).holds


def test_the_accurate_kind_is_kept_and_read_back(tmp_path: Path) -> None:
    """Held-out errors, orbits and domains of strips; the folder gives the same map again."""
    Path("strips.yaml").write_text(
        """
system: vi_pair
parameters: {d: 0.3, r: 0.5, M: 0.1245, g: 9.8, beta: pi/3, F: 5}
grid: {v: {from: 0.05, to: 1, points: 50}, phi: {from: 0, to: pi, points: 50}}
partition: {tolerance: 1e-4, kind: accurate}
require: [tolerance]
orbits: [{start: {v: 0.75, phi: 0.3}, n_returns: 100}]
domains: [{name: strips, map: composite, box: {v: [0.7, 0.83], phi: [0.17, 0.58]}, max_updates: 2}]
figures: [words, strips, orbits]
"""
    )
    result = run_study("strips.yaml", tmp_path / "out")
    held = {verdict.name: verdict for verdict in result.verdicts}
    assert held["partition: tolerance met everywhere (held out)"].holds
    assert "uniform" in write_report(result, tmp_path / "out").read_text(encoding="utf-8")
    assert held["partition: tolerance met everywhere (held out)"].required
    assert result.composite is None
    assert result.accurate.uniform.largest < 1e-4
    assert result.orbits[0].composite.states[-1] == pytest.approx(result.orbits[0].exact.states[-1], abs=1e-3)
    again = read_result(tmp_path / "out")
    states = np.random.default_rng(2).uniform((0.05, 0), (1, 3), (1000, 2))
    np.testing.assert_array_equal(again.reduced.first_return(states).image, result.reduced.first_return(states).image)
