"""Studies with other parameters than their own, and copies of shipped ones: neither pretends to be the original."""

import re
from pathlib import Path

import pytest
from messages import message
from ruamel.yaml import YAML
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import NsmapsError, StudyError
from nsmaps.study.reading.overrides import assignments
from nsmaps.study.reading.shipped import MODELINE, copy_study
from nsmaps.study.sections.longrun.orbits import Orbits


def test_a_set_parameter_is_in_the_name_the_title_the_folder_and_the_study() -> None:
    answer = CliRunner().invoke(app, ["run", "ball/drop", "--set", "r=0.45"])
    assert answer.exit_code == 0, answer.output
    assert "data    runs/ball/drop-r=0.45/result.json" in answer.output
    assert not Path("runs/ball/drop").exists()
    written = YAML(typ="safe").load(Path("runs/ball/drop-r=0.45/study.yaml").read_text())
    assert written["name"] == "ball/drop-r=0.45"
    assert written["title"] == "The ball; with r = 0.45 instead of 0.5"
    assert written["parameters"] == {"a": 0.2, "r": 0.45}
    again = nsmaps.read_result("runs/ball/drop-r=0.45")
    assert again.system.parameters == {"a": 0.2, "r": 0.45}
    assert nsmaps.load_study("runs/ball/drop-r=0.45/study.yaml") == again.study


def test_check_takes_the_same_and_several() -> None:
    answer = CliRunner().invoke(app, ["check", "ball/drop", "--set", "r=9/20", "--set", "a=0.25"])
    assert answer.exit_code == 0, answer.output
    assert answer.stdout.splitlines()[:2] == [
        "ball/drop-r=0.45-a=0.25: The ball; with r = 0.45 instead of 0.5, a = 0.25 instead of 0.2",
        "  system: ball (a = 0.25, r = 0.45); states (v, phi)",
    ]


def test_python_has_the_same() -> None:
    study = nsmaps.load_study("ball/drop", parameters={"r": 0.45, "mode": "other"})
    assert (study.name, study.parameters) == ("ball/drop-r=0.45-mode=other", {"a": 0.2, "r": 0.45, "mode": "other"})
    assert study.system_object().parameters["r"] == 0.45
    assert nsmaps.load_study("ball/drop", parameters={}) == nsmaps.load_study("ball/drop")


def test_a_value_that_is_the_studys_own_changes_no_title() -> None:
    study = nsmaps.load_study("ball/drop", parameters={"r": 0.5})
    assert (study.title, study.source.changed) == ("The ball", {})


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("R=1", "ball/drop with R = 1: unknown parameter 'R', did you mean 'r'?; expected: a, r, mode"),
        ("r=2", "ball/drop with r = 2: Ball: r is 2.0; expected: less than or equal to 1"),
        ("r", "'r' is not an assignment; expected: NAME=VALUE, such as r=0.45 or beta=pi/3"),
        ("=1", "'=1' is not an assignment; expected: NAME=VALUE, such as r=0.45 or beta=pi/3"),
    ],
)
def test_what_cannot_be_set_is_said(setting: str, says: str) -> None:
    for command in ("check", "run"):
        answer = CliRunner().invoke(app, [command, "ball/drop", "--set", setting])
        assert (answer.exit_code, answer.stderr) == (2, says + "\n")
    assert list(Path().iterdir()) == []


def test_a_parameter_is_set_once() -> None:
    with pytest.raises(StudyError, match=message("study.set-twice", name="r")):
        assignments(["r=1", "r = 2"])
    assert assignments(["r = 1", "beta=pi/3"]) == {"r": "1", "beta": "pi/3"}


@pytest.mark.parametrize("options", ["", "--no-figures --no-report --quiet --max-hours 2.0 --max-memory 3.5 --style journal"])
def test_a_stopped_run_says_how_to_go_on_with_the_same_options(monkeypatch: pytest.MonkeyPatch, options: str) -> None:
    def stop(*given: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Orbits, "compute", stop)
        answer = CliRunner().invoke(app, ["run", "ball/drop", "--set", "r=0.45", *options.split()])
    assert answer.exit_code == 130
    again = answer.stderr.splitlines()[-1].removeprefix("to resume: nsmaps ")
    expected = f"run ball/drop --set r=0.45 --out runs/ball/drop-r=0.45 --resume {options}"
    assert set(again.split()) == set(expected.split())
    answer = CliRunner().invoke(app, again.split())
    assert answer.exit_code == 0, answer.output
    assert nsmaps.read_result("runs/ball/drop-r=0.45").finished


def test_what_fails_says_that_pieces_were_given_for_other_parameters(good: str) -> None:
    text = (
        good.replace("where: v > 0.2,", "where: v > 0.3,")
        .replace("map: exact", "map: slow")
        .replace("max_updates: 2", "max_updates: 2\n    require: [forward_invariant]")
    )
    Path("s.yaml").write_text(text)
    hint = (
        "the pieces are those of the study at r = 0.5; `partition: {tolerance: 1e-3}` instead of `composite` determines them at "
    )
    hint += "these parameters"
    for parameters, told in (({}, False), ({"r": 0.45}, True)):
        verdicts = {
            verdict.name: verdict for verdict in nsmaps.run_study(nsmaps.load_study("s.yaml", parameters=parameters)).verdicts
        }
        for name in ("covered", "domain exact: forward invariant"):
            assert not verdicts[name].holds
            assert (hint in verdicts[name].text) is told
        assert ("its start box is that of the study at r = 0.5" in verdicts["domain exact: forward invariant"].text) is told


def test_a_copy_runs_names_a_schema_that_is_there_and_refuses_to_overwrite() -> None:
    (path,) = copy_study("vi_pair/pd")
    assert path == Path("pd.yaml")
    first, *rest = path.read_text().splitlines()
    assert first.startswith(MODELINE + "file://")
    assert Path(first.removeprefix(MODELINE + "file://")).is_file()
    original = nsmaps.plugins.study_files("vi_pair")["pd"].read_text().splitlines()
    assert rest == [line for line in original if not line.startswith(MODELINE)]
    study = nsmaps.load_study(path)
    assert study.name == "pd"
    assert study.model_copy(update={"name": "vi_pair/pd"}) == nsmaps.load_study("vi_pair/pd")
    path.write_text("mine")
    with pytest.raises(NsmapsError, match=message("study.file-there", file="pd.yaml")):
        copy_study("vi_pair/pd")
    assert path.read_text() == "mine"


def test_what_a_study_refers_to_is_copied_beside_it() -> None:
    answer = CliRunner().invoke(app, ["copy", "vi_pair/published", "deep/mine.yaml"])
    assert answer.exit_code == 0, answer.output
    assert answer.stdout == "written to deep/mine.yaml, deep/published.json\nto run it: nsmaps run deep/mine.yaml\n"
    assert nsmaps.load_study("deep/mine.yaml").composite == nsmaps.load_study("vi_pair/published").composite
    assert copy_study("vi_pair/published", Path("deep")) == [Path("deep/published.yaml"), Path("deep/published.json")]
    Path("deep/published.json").write_text("{}")
    with pytest.raises(NsmapsError, match=message("study.file-there", file=re.compile(r".*published\.json"))):
        copy_study("vi_pair/published", Path("deep/third.yaml"))
    assert not Path("deep/third.yaml").exists()


def test_no_such_study_has_a_near_match() -> None:
    answer = CliRunner().invoke(app, ["copy", "ball/drip"])
    assert answer.exit_code == 2
    assert answer.stderr.startswith("no study 'ball/drip', did you mean 'ball/drop'?; expected: ")


@pytest.mark.parametrize(
    ("beta", "told"), [("pi/4", "0.785398 instead of 1.0472"), ("pi/3 + 1e-9", "1.0471975521966 instead of 1.0471975511966")]
)
def test_a_title_has_no_more_digits_than_tell_the_values_apart(beta: str, told: str) -> None:
    study = nsmaps.load_study("vi_pair/pd", parameters={"beta": beta})
    assert study.title == f"Case PD: the stable two-cycle at d = 0.30; with beta = {told}"


def test_sections_are_left_out_by_name() -> None:
    study = nsmaps.load_study("vi_pair/fp")
    bare = study.without("domains", "second_iterate", "auxiliary_map", "figures")
    assert list(bare.analyses()) == [key for key in study.analyses() if key not in ("domains", "second_iterate", "auxiliary_map")]
    assert (len(bare.domains), bare.figures) == (0, ())
    for key in ("system", "domain"):
        with pytest.raises(nsmaps.NsmapsError, match=message("study.needed-section", name=key)):
            study.without(key)
