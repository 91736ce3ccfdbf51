"""A study with `exit_times:` from the shell to its files: which part of the paper's regions is left, and what stays in them."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from nsmaps import read_result
from nsmaps.cli.cli import app

# Of the regions of the appendix only the borders count here, so that nothing is fitted.
STUDY = """\
title: "Transient regions at d = 0.35"
system: vi_pair
parameters: {d: 0.35, r: 0.5, M: 0.1245, g: 9.8, beta: pi/3, F: 5}
composite:
  - {name: reset, where: phi > pi or phi < 0, reset: {phi: 1.2}}
  - {name: R1, box: {v: [0.63, 0.94], phi: [0.15, 0.45]}, reset: {phi: 1.2}}
  - {name: R2, where: v > 0.63 - 0.53*phi and v > 0.55, reset: {phi: 1.2}}
  - {name: R4, where: v > 0.63 - 0.53*phi and 1.1 < phi < 2.5 and v < 0.55, reset: {phi: 1.2}}
  - {name: R5, where: 2.5 < phi < pi and v < 0.55, reset: {phi: 1.2}}
  - {name: R3, where: v < 0.63 - 0.53*phi, reset: {phi: 1.2}}
exit_times: {box: {v: [0.12, 1.0], phi: [0, 2*pi]}, depth: 2, n_cells: 12, max_period: 1}
figures: [exit_times]
"""
SADDLES = [(0.281770025375305, 2.91844362963194), (0.343255510718990, 2.87685171619735)]  # in 50 digits, rounded
SINK = (0.833385990208561, 0.363611564551622)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The folder of the run, and what the program printed."""
    work = tmp_path_factory.mktemp("left")
    (work / "left.yaml").write_text(STUDY, encoding="utf-8")
    answer = CliRunner().invoke(app, ["run", str(work / "left.yaml"), "--out", str(work / "made")])
    assert answer.exit_code == 0, answer.output
    return work / "made", CliRunner().invoke(app, ["show", str(work / "made")]).output


def test_both_saddles_are_in_cells_that_stay(ran):
    made = read_result(ran[0]).exit_times
    numbers = made.cells.numbers_of(SADDLES)
    assert [made.regions[k] for k in made.region[numbers]] == ["R5", "R5"]
    assert (made.left[numbers] == -1).all()
    held = (made.boxes[:, :, 0] <= np.array(SADDLES)[:, None]) & (np.array(SADDLES)[:, None] <= made.boxes[:, :, 1])
    assert held.all(axis=2).any(axis=1).all()
    (row,) = [row for row in made.rows if row.region == "R5"]
    assert np.array(row.points) == pytest.approx(np.array(SADDLES), abs=1e-12)


def test_the_table_is_printed_and_sums_up(ran):
    folder, said = ran
    lines = said.splitlines()
    first = next(k for k, line in enumerate(lines) if line.split()[:3] == ["region", "area", "left"])
    names = ["reset", "R1", "R2", "R4", "R5", "R3", "all"]
    assert [line.split()[0] for line in lines[first + 2 : first + 9]] == names
    assert "stays in R5: periodic point (0.281770025375, 2.918443629632)" in said
    assert "stays in R5: periodic point (0.343255510719, 2.876851716197)" in said
    assert "exact map: no state of a cycle up to period 1 lies in the window outside" in said
    rows = json.loads((folder / "result.json").read_text(encoding="utf-8"))["numbers"]["exit_times"]
    *parts, total = rows
    assert [row["region"] for row in rows] == names
    assert total["area"] == pytest.approx(sum(row["area"] for row in parts))
    assert total["stays"] == sum(row["stays"] for row in parts)
    assert total["left"] == pytest.approx(sum(row["area"] * row["left"] for row in parts) / total["area"])
    assert total["left_steps"] == max(row["left_steps"] or 0 for row in parts)
    assert [row["periodic"] for row in rows] == [0, 1, 0, 0, 2, 0, 3]
    assert parts[1]["points"] == [pytest.approx(SINK, abs=1e-12)]
    assert [row["arrives"] for row in rows] == [None] * 7
    assert [row["arrives_steps"] for row in rows] == [None] * 7


def test_shares_are_those_of_the_cells_and_states_do_as_is_shown(ran, pair):
    """5000 random states, followed by the exact map: each has left its region within the steps of its cell."""
    made, return_map = read_result(ran[0]).exit_times, pair(0.35)
    x = np.random.default_rng(3).uniform(*made.cells.box.T, (5000, 2))
    number = made.cells.numbers_of(x)
    region, left = made.region[number], made.left[number]
    gone = np.zeros(len(x), bool)
    for step in range(1, left.max() + 1):
        x = return_map.first_return(x).image
        here = made.cells.numbers_of(x)
        gone |= np.where(here >= 0, made.region[here], -1) != region
        assert gone[(left > 0) & (left <= step)].all()
    for k, row in enumerate(made.rows[:-1]):
        assert row.left == pytest.approx((made.left[made.region == k] >= 0).mean())


def test_the_run_reports_the_exit_times_of_the_exact_map(ran):
    folder, said = ran
    names = sorted(path.name for path in folder.rglob("*") if path.is_file())
    assert {"study.yaml", "result.json", "arrays.npz", "report.html", "exit_times.png"} <= set(names)
    assert "Exit times of the regions of the exact map, by enclosure" in " ".join(said.split())
    printed = [line.split() for line in said.splitlines()]
    assert all(row.split() in printed for row in read_result(folder).exit_times.table().splitlines())
