"""A small installed system, `ball`, with one study: a package on the path and its metadata, as pip would leave them."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from ball import BALL
from typer import testing
from typer.testing import CliRunner

from nsmaps import StudyResult, run_study
from nsmaps.cli.cli import app

testing._get_command = cache(testing._get_command)  # which builds a command line anew for each call

STUDY = """\
# a ball on a table
title: The ball
system: ball
parameters: {a: 0.2, r: 1/2}
grid:
  v: {from: 0.01, to: 0.5, points: 31}
  phi: {from: 0, to: 2*pi, points: 41}
families:
  low: [BB]
composite:
  - name: slow
    where: "v <= 0.2"
    family: low
    fit: {full: {v: 2, phi: 3}}
  - {name: fast, where: v > 0.2, reset: {phi: pi/2}}
orbits:
  - start: {v: 0.3, phi: 1}
    n_returns: 5
domains:
  - name: exact
    map: exact
    box: {v: [0.1, 0.3], phi: [0.2, 1]}
    max_updates: 2
require: [covered]
"""


def install(folder: Path, package: str, points: dict[str, str], sources: dict[str, str]) -> None:
    """Put a package's files and the metadata of its entry points into a folder that stands on the path."""
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    lines = "\n".join(f"{name} = {value}" for name, value in points.items())
    (info / "entry_points.txt").write_text(f"[nsmaps.systems]\n{lines}\n")
    for name, text in sources.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which the package of `ball` is installed."""
    folder = tmp_path_factory.mktemp("site")
    sources = {"balls/__init__.py": "", "balls/table.py": BALL, "balls/studies/drop.yaml": STUDY}
    install(folder, "balls", {"ball": "balls.table:Ball"}, sources)
    return folder


@pytest.fixture(autouse=True)
def installed(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """`ball` is installed, and the working folder is empty."""
    monkeypatch.syspath_prepend(str(site))
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    return work


@pytest.fixture
def good() -> str:
    """The text of a study that can be run."""
    return STUDY


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The folder in which the command line runs a study's text when a test first asks for it: to be read, or copied."""

    @cache
    def folder(text: str, *more: str) -> Path:
        out, file = tmp_path_factory.mktemp("once") / "out", tmp_path_factory.mktemp("once") / "s.yaml"
        file.write_text(text)
        answer = CliRunner().invoke(app, ["run", str(file), "--out", str(out), *more])
        assert answer.exit_code in (0, 1) or "cannot be drawn" in answer.stderr, answer.output
        return out

    return folder


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., tuple[StudyResult, Path]]:
    """The result of a study's text, and its folder, computed when a test of a file first asks for it: to be read, or copied."""

    @cache
    def result(text: str, name: str = "s") -> tuple[StudyResult, Path]:
        folder = tmp_path_factory.mktemp("computed")
        Path(folder, f"{name}.yaml").write_text(text)
        return run_study(folder / f"{name}.yaml", out=folder / "out"), folder / "out"

    return result
