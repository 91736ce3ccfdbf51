"""Studies, run folders and exported files of strangers: each is answered by a line before anything is computed or written."""

import inspect
import json
import shutil
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli import app
from nsmaps.errors import NsmapsError, StudyError

STORED = Path(__file__).parents[1] / "data" / "run-format-3"
MARK = "from pathlib import Path\nPath('mark').write_text('was run')\n"  #: what a stranger's file does when it is run


def refused(*command: str) -> str:
    """The one line with which a command refuses, nothing of it on standard output and nothing written."""
    before = sorted(path for path in Path().rglob("*"))
    answer = CliRunner().invoke(app, list(command))
    assert (answer.exit_code, answer.stdout) == (2, ""), answer.output
    assert answer.stderr.count("\n") == 1, answer.stderr
    assert sorted(path for path in Path().rglob("*")) == before
    return answer.stderr.strip()


@pytest.fixture
def stranger() -> None:
    """A study whose system is a file that leaves a mark where it is run."""
    from nsmaps.plugins import system_class

    source = inspect.getsource(sys.modules[system_class("ball").__module__])
    Path("mine.py").write_text(MARK + source)
    Path("s.yaml").write_text("# mine\nsystem: mine.py:Ball\nparameters: {a: 1}\n")


def test_check_says_that_a_file_is_run_before_it_is(stranger: None, monkeypatch: pytest.MonkeyPatch) -> None:
    import nsmaps.plugins

    said: list[str] = []
    monkeypatch.setattr("typer.echo", lambda text="", **how: said.append(str(text)))
    run_file = nsmaps.plugins.run_file
    monkeypatch.setattr(nsmaps.plugins, "run_file", lambda *file: (said.append("RUN"), run_file(*file)))
    assert CliRunner().invoke(app, ["check", "s.yaml"]).exit_code == 0
    first = f"runs the file of the system, {Path('mine.py').resolve()}:Ball, which can do what you can; not with --installed-only"
    assert said[:2] == [first, "RUN"]
    assert Path("mark").exists()


def test_a_file_is_not_run_with_installed_only(stranger: None) -> None:
    line = f"s.yaml:2:9: the system is the file '{Path('mine.py').resolve()}:Ball', which would be run; accepted: a system that"
    for command in ("check", "run"):
        assert refused(command, "s.yaml", "--installed-only").startswith(line)
    for call in (nsmaps.load_study, nsmaps.run):
        with pytest.raises(StudyError, match="which would be run"):
            call("s.yaml", installed_only=True)
    assert not Path("mark").exists()
    study = nsmaps.load_study("s.yaml")
    with pytest.raises(StudyError, match="which would be run"):
        nsmaps.run(study, installed_only=True)


@pytest.mark.parametrize(
    "command", [("figures",), ("animate", "--", "cobweb"), ("report",), ("export", "--to", "c"), ("cite",)], ids=lambda c: c[0]
)
def test_nor_is_the_file_of_a_run_folder(command: tuple[str, ...], stranger: None) -> None:
    name, *options = command
    shutil.copytree(STORED / "run", "out")
    text = Path("out/study.yaml").read_text()
    Path("out/study.yaml").write_text(text.replace("system: vi_pair", f"system: {Path('mine.py').resolve()}:Ball"))
    positional = [option for option in options if option == "cobweb"]
    rest = [option for option in options if option not in ("--", "cobweb")]
    assert "which would be run" in refused(name, "out", *positional, *rest, "--installed-only")
    with pytest.raises(StudyError, match="which would be run"):
        nsmaps.read_result("out", installed_only=True)
    assert not Path("mark").exists()


def test_a_run_that_goes_on_runs_no_file_that_its_study_does_not_name(stranger: None) -> None:
    shutil.copytree(STORED / "run", "out")
    Path("mine.yaml").write_text(Path("out/study.yaml").read_text())
    text = Path("out/study.yaml").read_text()
    Path("out/study.yaml").write_text(text.replace("system: vi_pair", f"system: {Path('mine.py').resolve()}:Ball"))
    with pytest.raises(NsmapsError, match="which would be run"):
        nsmaps.run("mine.yaml", out="out", resume=True)
    assert not Path("mark").exists()


def test_installed_systems_are_accepted_with_installed_only() -> None:
    assert nsmaps.load_study("ball/drop", installed_only=True).system == "ball"
    assert nsmaps.read_result(STORED / "run", installed_only=True).finished
    assert json.loads((STORED / "run" / "result.json").read_text())["system"]["name"] == "vi_pair"
