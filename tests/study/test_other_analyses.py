"""An analysis of another package, or of a file: read, checked, estimated, run, resumed, stored, drawn and reported like ours."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import told

import nsmaps

FASTEST = '''
"""The analysis `fastest`: the largest images of the states of the grid."""

from dataclasses import dataclass, field

import numpy as np

import nsmaps
from nsmaps.study.estimates import RETURN, Size, states


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Largest(nsmaps.results.Result):
    """The largest image in each coordinate."""

    coordinates: nsmaps.exact.Coordinates
    largest: np.ndarray = field(metadata=nsmaps.results.array("coordinate", "largest image"))

    def plot(self, ax=None, **options):
        """One bar for each coordinate."""
        ax.bar(range(len(self.largest)), self.largest)
        return ax


class Fastest(nsmaps.Analysis):
    """The largest images of the states of the grid, below a limit."""

    coordinate: str
    below: float = 1.0

    def needs(self):
        yield (self.key,), f"{self.key!r}", "grid"

    def bind(self, binding):
        names = binding.system.coordinates
        return names.index(binding.study.source.known((self.key, "coordinate"), self.coordinate, names, "coordinate"))

    def compute(self, plan, result):
        plan.parallel.progress and plan.parallel.progress(0.5)
        return Largest(result.system.coordinates, np.nanmax(result.returns.image, axis=0))

    def describe(self, study):
        return f"of {self.coordinate}, below {self.below:g}"

    def size(self, study, system):
        return Size(RETURN * states(study.grid))

    def numbers(self, result):
        return {self.key: result[self.key].largest.tolist()} if self.key in result else {}

    def verdicts(self, result):
        if self.key in result:
            largest = result[self.key].largest[result.system.coordinates.index(self.coordinate)]
            holds = bool(largest < self.below)
            text = f"{'yes' if holds else 'no'}: {largest:.3g}"
            yield nsmaps.study.Verdict(f"{self.key}: below its limit", "exact map", holds, False, text)

    def findings(self, result):
        for largest in [result[self.key].largest] if self.key in result else []:
            text = f"the images are at most {largest.max():.3g}"
            yield nsmaps.study.Finding("exact map", text, ((f"{largest[0]:.3g}", "the fastest"),))

    def tables(self, result):
        if self.key in result:
            row = self.coordinate, f"{result[self.key].largest[0]:.3g}"
            yield nsmaps.study.Table("Fastest", ("coordinate", "largest"), (row,))
'''
HEAD = """\
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0.1, to: 0.5, points: 5}, phi: {from: 0, to: 1, points: 4}}
"""
INSTALLED = HEAD + "fastest: {coordinate: v, below: 0.1}\nfigures: [fastest]\n"
OF_A_FILE = HEAD + "mine: {analysis: 'mine.py:Fastest', coordinate: v, below: 0.1}\nfigures: [mine]\n"
WRONG = {
    INSTALLED.replace("coordinate: v", "coordinate: w"): "4:23: unknown coordinate 'w'; expected: v, phi",
    INSTALLED.replace("below", "bellow"): "4:26: unknown key 'bellow', did you mean 'below'?; expected: coordinate, below",
    INSTALLED.replace("grid", "# grid"): "4:10: 'fastest' needs the section 'grid', which is missing",
    HEAD + "fastes: {coordinate: v}\n": (
        "4:1: unknown section 'fastes', did you mean 'fastest'?; expected: a section that `nsmaps schema` lists, or the analysis "
        "of an installed package: fastest"
    ),
    HEAD + "sprung: {}\norbits: 1\n": "4:1: unknown section 'sprung'; expected: a section that",
    OF_A_FILE.replace("mine.py:Fastest", "mine.py:Largest"): "4:18: ",
}


@pytest.fixture(scope="module")
def answers(site: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[int, str, str]]]:
    """A folder, and what commands end with and print there, where a package has installed the analysis."""
    folder = tmp_path_factory.mktemp("fastest")
    (folder / "nsmaps_fastest.py").write_text(FASTEST)
    (folder / "mine.py").write_text(FASTEST)
    info = folder / "nsmaps_fastest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: nsmaps_fastest\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[nsmaps.analyses]\nfastest = nsmaps_fastest:Fastest\n")
    texts = {"s": INSTALLED, "f": OF_A_FILE} | {f"s{number}": text for number, text in enumerate(WRONG)}
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(text)
    commands = [["check", "s.yaml"], ["schema"], ["check", "f.yaml", "--installed-only"]]
    commands += [[*words.split(), f"{name}.yaml", "--out", name] for name in "sf" for words in ("run", "run --resume")]
    commands += [
        ["show", "s", "--verdicts"],
        ["show", "f", "--verdicts"],
        ["schema", "fastest"],
        *(["check", f"s{number}.yaml"] for number in range(len(WRONG))),
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(site))
        return folder, told(folder, *commands)


@pytest.mark.parametrize(("name", "key"), [("s", "fastest"), ("f", "mine")])
def test_an_analysis_of_others_is_computed_stored_drawn_and_reported(
    answers: tuple[Path, list[tuple[int, str, str]]], name: str, key: str
) -> None:
    folder, (_, _, _, *ran, shown, other, _) = answers[0], answers[1][: -len(WRONG)]
    first, again = ran[:2] if name == "s" else ran[2:]
    assert first[0] == again[0] == 0, (first, again)
    record = json.loads((folder / name / "result.json").read_text())
    largest = record["numbers"][key]
    assert len(largest) == 2
    assert [verdict["text"] for verdict in record["verdicts"]] == [f"no: {largest[0]:.3g}"]
    assert key in record["timings"]
    assert "Fastest" in first[1]
    assert f"Exact map: the images are at most {max(largest):.3g}" in first[1]
    assert f"  {largest[0]:.3g}" in first[1]
    with np.load(folder / name / "arrays.npz") as arrays:
        assert arrays[f"{key}/largest"].tolist() == largest
    assert (folder / name / "figures" / f"{key}.png").stat().st_size > 1000
    page = (folder / name / "report.html").read_text()
    assert f"{key}: below its limit" in page
    assert "The largest images of the states of the grid, below a limit." in page
    assert f"{key}: below its limit" in (shown if name == "s" else other)[1]


def test_it_is_described_checked_and_in_the_schema(answers: tuple[Path, list[tuple[int, str, str]]]) -> None:
    checked, schema, refused = answers[1][:3]
    assert "  fastest: of v, below 0.1\n" in checked[1], checked
    assert json.loads(schema[1])["properties"]["fastest"]["properties"]["below"]["default"] == 1.0
    assert answers[1][-len(WRONG) - 1][1].startswith("fastest: The largest images of the states of the grid, below a limit.\n  ")
    assert refused[0] == 2
    assert "which would be executed; expected: an installed one" in refused[2]


def test_its_errors_have_their_place(answers: tuple[Path, list[tuple[int, str, str]]]) -> None:
    for number, (answer, says) in enumerate(zip(answers[1][-len(WRONG) :], WRONG.values(), strict=True)):
        assert answer[:2] == (2, "") or answer[:2] == [2, ""]
        assert answer[2].startswith(f"s{number}.yaml:{says}"), answer


def test_its_result_is_read_with_its_axes(
    answers: tuple[Path, list[tuple[int, str, str]]], site: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    xarray = pytest.importorskip("xarray")
    folder, _ = answers
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.chdir(folder)
    result = nsmaps.read_result("f")
    tree = result.to_xarray()
    assert isinstance(tree, xarray.DataTree)
    assert tree["mine"].largest.dims == ("coordinate",)
    assert tree["mine"].largest.values.tolist() == result["mine"].largest.tolist()
