"""Whose the folder of a run is: no figure, export or report of another run stays in it, and no file of anybody else goes."""

import json
import re
from pathlib import Path

import pytest
from messages import message
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import NsmapsError

ORBIT = "system: ball\nparameters: {a: 0.2}\norbits: [{start: {v: 0.3, phi: 1}, n_returns: 20}]\nfigures: [orbits]\n"


def invoke(*words: str) -> str:
    answer = CliRunner().invoke(app, list(words))
    assert answer.exit_code in (0, 1), answer.output
    return answer.output


def content(folder: str) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def test_a_folder_with_a_run_of_another_study_is_refused_and_left_alone() -> None:
    Path("a.yaml").write_text(ORBIT)
    Path("b.yaml").write_text(ORBIT.replace("0.2", "0.3"))
    invoke("run", "a.yaml", "--out", "D")
    before = content("D")
    answer = CliRunner().invoke(app, ["run", "b.yaml", "--no-figures", "--out", "D"])
    assert answer.exit_code == 2
    assert answer.stderr.startswith("refusing to overwrite a run of 'a' in D with 'b'; expected: ")
    assert content("D") == before


def test_running_an_edited_study_again_leaves_no_figure_of_the_first(good: str) -> None:
    Path("s.yaml").write_text(good + "figures: [orbits, envelopes]\n")
    invoke("run", "s.yaml")
    invoke("figures", "runs/s", "--format", "svg")
    invoke("export", "runs/s", "--to", "json")
    folder = Path("runs/s")
    assert {path.suffix for path in (folder / "figures").iterdir()} == {".png", ".svg"}
    assert list((folder / "export").iterdir())
    Path("s.yaml").write_text(good.replace("r: 1/2", "r: 0.45") + "figures: [orbits, envelopes]\n")
    invoke("run", "s.yaml", "--no-figures")
    assert not (folder / "figures").exists()
    assert not (folder / "export").exists()
    page = (folder / "report.html").read_text()
    assert "<img" not in page
    assert "None was drawn." in page
    assert nsmaps.read_result(folder).system.parameters["r"] == 0.45


def test_exports_are_told_from_others_however_their_folder_is_named(good: str) -> None:
    Path("s.yaml").write_text(good)
    invoke("run", "s.yaml")
    invoke("export", "runs/s", "--to", "json", "--out", str(Path("runs/s/code").resolve()))
    invoke("export", "runs/s", "--to", "json", "--out", "elsewhere")
    assert list(Path("runs/s/code").iterdir())
    invoke("run", "s.yaml")
    assert not Path("runs/s/code").exists()
    assert list(Path("elsewhere").iterdir())


def test_files_of_others_are_never_removed(good: str) -> None:
    Path("s.yaml").write_text(good + "figures: [orbits]\n")
    invoke("run", "s.yaml")
    invoke("export", "runs/s", "--to", "json")
    folder = Path("runs/s")
    mine = [folder / path for path in ("notes.txt", "figures/orbits-mine.png", "export/main.c", "figures/a/b")]
    mine[-1].parent.mkdir()
    for path in mine:
        path.write_text("mine")
    invoke("run", "s.yaml", "--no-figures", "--no-report")
    left = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert left == {"study.yaml", "result.json", "arrays.npz", *(str(path.relative_to(folder)) for path in mine)}


def test_a_path_that_leads_out_of_the_folder_is_not_followed() -> None:
    Path("s.yaml").write_text(ORBIT)
    Path("precious").write_text("mine")
    invoke("run", "s.yaml")
    with (Path("runs/s") / "written.txt").open("a") as file:
        file.write(f"../../precious\n{Path('precious').resolve()}\n")
    invoke("run", "s.yaml")
    assert Path("precious").read_text() == "mine"


def test_a_study_of_ones_own_is_not_written_over() -> None:
    Path("study.yaml").write_text(ORBIT + "# mine\n")
    answer = CliRunner().invoke(app, ["run", "study.yaml", "--out", "."])
    assert answer.exit_code == 2
    assert "study.yaml exists, and no run wrote it" in answer.stderr
    assert Path("study.yaml").read_text() == ORBIT + "# mine\n"
    assert sorted(path.name for path in Path().iterdir()) == ["study.yaml"]


@pytest.mark.parametrize("record", ["{}", "[1]", "not json", '{"study": 3}'])
def test_a_record_that_no_run_wrote_is_not_replaced(record: str) -> None:
    Path("s.yaml").write_text(ORBIT)
    Path("out").mkdir()
    Path("out/result.json").write_text(record)
    with pytest.raises(NsmapsError, match=message("study.no-run", file=re.compile(r".*result\.json"))):
        nsmaps.run_study("s.yaml", out="out")
    assert Path("out/result.json").read_text() == record


def test_figures_drawn_again_are_those_of_the_results_and_stay_with_a_report() -> None:
    Path("s.yaml").write_text(ORBIT)
    invoke("run", "s.yaml", "--no-figures")
    invoke("figures", "runs/s")
    invoke("report", "runs/s")
    assert Path("runs/s/written.txt").read_text() == "figures/orbits.png\n"
    assert Path("runs/s/report.html").read_text().count("<img") == 1


def test_the_time_of_figures_is_kept_and_on_the_page() -> None:
    Path("s.yaml").write_text(ORBIT)
    invoke("run", "s.yaml")
    kept = json.loads(Path("runs/s/result.json").read_text())["timings"]
    assert list(kept) == ["system", "orbits", "figures"]
    assert kept["figures"] > 0
    page = Path("runs/s/report.html").read_text()
    assert f'<th scope="row">figures</th><td data-label="seconds">{kept["figures"]:.2f}</td>' in page
    assert nsmaps.read_result("runs/s").timings == kept
    invoke("run", "s.yaml", "--no-figures")
    assert "figures" not in json.loads(Path("runs/s/result.json").read_text())["timings"]
