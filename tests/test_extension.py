"""A section, a verdict, a figure and a language, added to a copy of the package as the page on the architecture shows."""

import json
import re
import shutil
from pathlib import Path

import pytest
from commands import told

import nsmaps

PAGE = Path(__file__).parents[1] / "docs" / "explanation" / "architecture.md"
MODULE = re.compile(r"^```python\n# file: (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
CHANGE = re.compile(r"^```diff\n\+\+\+ (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
STUDY = """\
system: vi_pair
parameters: {d: 0.35, r: 0.5, g_bar: 0.2113}
grid: {v: {from: 0.8, to: 1.0, points: 5}, phi: {from: 0.2, to: 0.5, points: 5}}
families: {BTB: [BTB]}
composite:
  - {name: R1, where: v > 0, family: BTB, fit: {full: {v: 1, phi: 1}}}
fastest: {coordinate: v}
figures: [images]
"""


def changed(text: str, change: str) -> str:
    """A text with the lines of a change that begin with +, each behind the line before it, which the text must have."""
    end = 0
    for line in change.splitlines(keepends=True):
        added, content = line.startswith("+"), line[1:]
        start = end if added else text.index(content, end)
        end = start + len(content)
        text = text[:start] + content + text[start:] if added else text
    return text


def without(*starts: str) -> str:
    """The study without the lines that begin so."""
    return "".join(line for line in STUDY.splitlines(keepends=True) if not line.startswith(starts))


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a copy of the package to which everything on the page was added."""
    folder = tmp_path_factory.mktemp("extended")
    shutil.copytree(Path(nsmaps.__file__).parent, folder / "nsmaps")
    page = PAGE.read_text()
    for name, text in MODULE.findall(page):
        assert not (folder / name).exists(), f"{name} is in the package already"
        (folder / name).write_text(text)
    for name, change in CHANGE.findall(page):
        (folder / name).write_text(changed((folder / name).read_text(), change))
    (folder / "toy.yaml").write_text(STUDY)
    return folder


@pytest.mark.parametrize("kind", ["study section", "verdict", "figure", "export language"])
def test_each_kind_is_shown_in_about_ten_lines(kind: str) -> None:
    section = re.search(rf"^## To add an? {kind}\n(.*?)(?=^## )", PAGE.read_text(), re.MULTILINE | re.DOTALL)[1]
    lines = [line for _, text in [*MODULE.findall(section), *CHANGE.findall(section)] for line in text.splitlines()]
    code = [line for line in lines if line.strip(" +") and not re.match(r'[ +]*(from|import|""")', line)]
    assert 3 <= len(code) <= 12


WRONG = {
    without("families", "composite", "  -"): "the figure 'images' needs the section 'families', which is missing",
    without("grid", "families", "composite", "  -", "figures"): "'fastest' needs the section 'grid', which is missing",
    STUDY.replace("fastest", "fastet"): "unknown key 'fastet'",
}


@pytest.fixture(scope="module")
def answers(extended: Path) -> list[tuple[int, str, str]]:
    """What three commands of a run end with and print, and checks of the studies that are wrong."""
    for number, text in enumerate(WRONG):
        (extended / f"bad{number}.yaml").write_text(text)
    commands = ["run", "toy.yaml", "--out", "out", "--quiet"], ["show", "out", "--verdicts"], ["export", "out", "--to", "listing"]
    return told(extended, *commands, *(["check", f"bad{number}.yaml"] for number in range(len(WRONG))))


def test_a_run_computes_judges_draws_exports_and_reads_them_back(extended: Path, answers: list[tuple[int, str, str]]) -> None:
    ran, shown, exported = answers[:3]
    assert ran[0] == 0, ran
    record = json.loads((extended / "out" / "result.json").read_text())
    largest = record["objects"]["fastest"]
    (verdict,) = [each for each in record["verdicts"] if each["name"] == "fastest: below one"]
    assert (verdict["holds"], verdict["text"]) == (largest < 1, f"{'yes' if largest < 1 else 'no'}: {largest:.3g}")
    assert (extended / "out" / "figures" / "images.png").read_bytes().startswith(b"\x89PNG")
    page = (extended / "out" / "report.html").read_text()
    for part in ('alt="Dots in a plane."', "The images of the first family.", "fastest: below one"):
        assert part in page
    assert "fastest: below one" in shown[1], shown
    assert exported[0] == 0, exported
    assert "R1: [" in (extended / "out" / "export" / "composite_map.txt").read_text()


def test_errors_name_them(answers: list[tuple[int, str, str]]) -> None:
    for (code, _, complaint), says in zip(answers[3:], WRONG.values(), strict=True):
        assert code == 2
        assert says in " ".join(complaint.split())
