"""A new plugin installs, is found, passes its own tests; a bad name is told and nothing is overwritten."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from messages import message
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.cli.newplugin import Kind, new_plugin
from nsmaps.errors import NsmapsError
from nsmaps.testing import check_system


def python(folder: Path, site: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A python that sees what is installed in a folder of its own, beside everything else."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), *sys.path]), "PYTEST_ADDOPTS": ""}
    return subprocess.run([sys.executable, *arguments], cwd=folder, env=env, capture_output=True, text=True)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "said", "figures"),
    [
        ("impacts", "my_ball: Ball on a table that moves as a sin t", {"orbits.png", "domain_size.png"}),
        ("hybrid", "my_ball: Oscillator x'' + 2 zeta x' + x = A cos(w t)", {"bifurcation_diagram.png"}),
        ("map", "my_ball: Normal form of a border collision in the plane", {"bifurcation_diagram.png", "branches.png"}),
    ],
)
def test_it_installs_and_passes_at_once(kind: Kind, said: str, figures: set[str], tmp_path: Path) -> None:
    project = new_plugin("my_ball", tmp_path, kind)
    site = tmp_path / "site"
    pip = ["-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--no-build-isolation", "--target", str(site)]
    installed = python(tmp_path, site, *pip, str(project))
    assert installed.returncode == 0, installed.stderr
    listed = python(tmp_path, site, "-m", "nsmaps", "systems")
    assert said in listed.stdout
    assert "studies: my_ball/first" in listed.stdout
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\naddopts = '-n 2 --no-such-option'\n")  # as of a clone
    tested = python(tmp_path, site, "-m", "pytest", "-q", "-p", "no:cacheprovider", "my_ball")
    assert tested.returncode == 0, tested.stdout
    assert "3 passed" in tested.stdout
    run = python(tmp_path, site, "-m", "nsmaps", "run", "my_ball/first", "--out", str(tmp_path / "run"))
    assert run.returncode == 0, run.stderr
    assert {file.name for file in (tmp_path / "run" / "figures").iterdir()} >= figures


def test_what_comes_next_is_what_the_page_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The test extra is asked for, and is there; the project's own pyproject is where pytest stops to look for settings."""
    monkeypatch.chdir(tmp_path)
    made = CliRunner().invoke(app, ["new-plugin", "my_ball"])
    line = 'pip install -e "my_ball[test]" && nsmaps run my_ball/first && pytest'
    assert made.stdout.strip() == f'written to my_ball; next: {line} "my_ball"'
    assert f"{line} my_ball\n" in (Path(__file__).parents[1] / "docs" / "reference" / "impact-systems.md").read_text()
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\naddopts = '--no-such-option'\n")
    listed = python(tmp_path, tmp_path, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", "my_ball")
    assert "::test_the_study_holds" in listed.stdout, listed.stderr
    project = tomllib.loads((tmp_path / "my_ball" / "pyproject.toml").read_text())["project"]
    assert [need.partition(">")[0] for need in project["optional-dependencies"]["test"]] == ["pytest"]


def test_its_class_serves_from_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = new_plugin("other_ball", tmp_path)
    study = tmp_path / "mine.yaml"
    study.write_text("system: other_ball/nsmaps_other_ball/system.py:OtherBall\nparameters: {a: 1.2}\n")
    monkeypatch.chdir(project)
    checked = CliRunner().invoke(app, ["check", str(study)])
    assert f"system: {tmp_path}/other_ball/nsmaps_other_ball/system.py:OtherBall (a = 1.2" in checked.stdout, checked.stderr


def test_a_map_serves_from_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["new-plugin", "kinked", "--map", "--hybrid"])
    assert (told.exit_code, told.stderr.strip()) == (
        2,
        "--hybrid and --map name two kinds of systems; expected: one of them",
    )
    assert CliRunner().invoke(app, ["new-plugin", "kinked", "--map"]).exit_code == 0
    system = nsmaps.load_system("kinked/nsmaps_kinked/system.py:Kinked", tau_L=0.9, delta_L=0.3, tau_R=-1.2, delta_R=0.4)
    check_system(system)
    text = (tmp_path / "kinked" / "nsmaps_kinked" / "studies" / "first.yaml").read_text()
    (tmp_path / "first.yaml").write_text(text.replace("system: kinked", "system: kinked/nsmaps_kinked/system.py:Kinked"))
    branches = nsmaps.run_study(nsmaps.load_study(tmp_path / "first.yaml")).branches["fixed"]
    assert {(event.kind, round(event.value, 10)) for each in branches for event in each.events} == {("period doubling", -1.4)}


@pytest.mark.parametrize("name", ["", "Ball", "my-ball", "2balls", "class", "../ball", "bäll", "ball "])
def test_a_name_that_is_none_is_told(name: str, tmp_path: Path) -> None:
    with pytest.raises(NsmapsError, match=message("cli.bad-name")):
        new_plugin(name, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_overwritten_and_no_name_given_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_ball").mkdir()
    with pytest.raises(NsmapsError, match=message("cli.folder-there", folder=re.compile(r".*my_ball"))):
        new_plugin("my_ball", tmp_path)
    with pytest.raises(NsmapsError, match=message("cli.name-taken", name="vi_pair")):
        new_plugin("vi_pair", tmp_path)
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["new-plugin", "My-Ball"])
    assert told.exit_code == 2
    assert told.stderr.strip() == (
        "the name 'My-Ball' is not a valid system name; expected: small letters, digits and _, as in bouncing_ball"
    )
    made = CliRunner().invoke(app, ["new-plugin", "a_ball", "--into", "projects"])
    assert made.exit_code == 0, made.stderr
    assert (tmp_path / "projects" / "a_ball" / "pyproject.toml").is_file()
