"""The catalogue: a figure is its module and one row, and everything else follows from these two."""

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from inspect import isfunction, signature
from pathlib import Path

import pytest

import nsmaps
from nsmaps.figures.animate import FILMS
from nsmaps.figures.catalogue import CATALOGUE
from nsmaps.study.study import Study

SENTENCES = re.compile(r"[A-Z].*\.")
MODULE = '''"""The images of the first family."""

from functools import partial

from nsmaps.figures.data import SURFACES
from nsmaps.figures.page import Sheet


def sheets(result):
    """One sheet with one panel."""
    return (Sheet("toy", (partial(toy, result),), 1),)


def toy(result, ax):
    """The second coordinate of the images against the first."""
    surface = next(iter(SURFACES.of(result, "toy").values()))
    ax.plot(*surface.image.T, ".")
    ax.set(xlabel="$v$", ylabel="$\\\\phi$")
    return ax
'''
ROW = '    Row("returns.toy", "Dots in a plane.", "The images of the first family.", (data.SURFACES,)),\n'
STUDY = """system: vi_pair
parameters: {d: 0.35, r: 0.5, g_bar: 0.2113}
grid: {v: {from: 0.8, to: 1.0, points: 5}, phi: {from: 0.2, to: 0.5, points: 5}}
families: {BTB: [BTB]}
figures: [toy]
"""


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_row_is_a_module_that_draws_and_whole_sentences(name):
    row = CATALOGUE[name]
    module = import_module(f"nsmaps.figures.{row.module}")
    assert list(signature(module.sheets).parameters) == ["result"]
    drawn = [each for key, each in vars(module).items() if isfunction(each) and not key.startswith("_")]
    assert any("ax" in signature(each).parameters for each in drawn)
    assert SENTENCES.fullmatch(row.alt)
    assert SENTENCES.fullmatch(row.caption)
    assert set(row.sections) <= set(Study.model_fields)


def test_the_figures_that_move_are_those_that_say_so():
    assert {name for name, row in CATALOGUE.items() if row.animated} == set(FILMS)


def test_a_module_and_a_row_make_a_figure(tmp_path):
    """In a copy of the package: studies name it, it is drawn, reported and listed, and an error says what it needs."""
    source = Path(nsmaps.__file__).parent
    package = tmp_path / "nsmaps"
    shutil.copytree(source, package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "figures" / "returns" / "toy.py").write_text(MODULE)
    catalogue = package / "figures" / "catalogue.py"
    text = catalogue.read_text()
    catalogue.write_text(text.replace("_ROWS = (\n", "_ROWS = (\n" + ROW))
    (tmp_path / "toy.yaml").write_text(STUDY)
    (tmp_path / "bare.yaml").write_text(STUDY.replace("families: {BTB: [BTB]}\n", ""))
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        words = (sys.executable, "-m", "nsmaps", *words)
        return subprocess.run(words, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)

    done = run("run", "toy.yaml", "--out", "out", "--quiet")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "figures" / "toy.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert 'alt="Dots in a plane."' in page
    assert "The images of the first family." in page
    bare = run("run", "bare.yaml")
    assert bare.returncode == 2
    assert "the figure 'toy' needs the section 'families', which is missing" in " ".join(bare.stderr.split())
