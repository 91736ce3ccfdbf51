"""A section of a study stands in one module and one line of the registry: one is added here through these alone."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from commands import told

from nsmaps.study.sections.registry import SECTIONS

FASTEST = '''
"""The section `fastest`: the largest images of the states of the grid."""

from dataclasses import dataclass

import numpy as np
import pytest
from commands import told
from pydantic import BaseModel

from nsmaps.study.estimates import RETURN, Size, states
from nsmaps.study.reading.values import SPEC
from nsmaps.study.sections.base import Section, Table, Verdict
from nsmaps.study.conclusions.texts import yes


class FastestSection(BaseModel):
    """The largest images of the states of the grid, below a limit."""

    model_config = SPEC
    coordinate: str
    below: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Stored:
    """What a run keeps of it."""

    fastest: np.ndarray | None = None  #: shape (n,)


def needs(spec):
    yield ("fastest",), "'fastest'", "grid"


def bind(spec, binding):
    names = binding.system.coordinates
    return names.index(binding.study.source.known(("fastest", "coordinate"), spec.coordinate, names, "coordinate"))


def compute(spec, plan, result):
    return {"fastest": np.nanmax(result.returns.image[:, [plan.bound["fastest"]]], axis=0)}


def verdicts(result):
    if result.fastest is not None:
        holds = bool(result.fastest[0] < result.study.fastest.below)
        yield Verdict("fastest: below its limit", "exact map", holds, False, f"{yes(holds)}: {result.fastest[0]:.3g}")


def tables(result):
    if result.fastest is not None:
        yield Table("Fastest", ("coordinate", "largest"), ((result.study.fastest.coordinate, f"{result.fastest[0]:.3g}"),))


SECTION = Section(
    key="fastest",
    type=FastestSection | None,
    stored=Stored,
    needs=needs,
    bind=bind,
    compute=compute,
    describe=lambda spec, study: f"of {spec.coordinate}, below {spec.below:g}",
    size=lambda spec, study, system: Size(RETURN * states(study.grid)),
    numbers=lambda result: {} if result.fastest is None else {"fastest": result.fastest.tolist()},
    verdicts=verdicts,
    tables=tables,
)
'''
LINE = "import nsmaps.study.sections.registry as registry, fastest; registry.SECTIONS += (fastest.SECTION,)\n"
STUDY = """\
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0.1, to: 0.5, points: 5}, phi: {from: 0, to: 1, points: 4}}
fastest: {coordinate: v, below: 0.1}
"""


WRONG = {
    STUDY.replace("coordinate: v", "coordinate: w"): "4:23: unknown coordinate 'w'; expected: v, phi",
    STUDY.replace("below", "bellow"): "4:26: unknown key 'bellow'; expected: coordinate, below",
    STUDY.replace("grid", "# grid"): "4:10: 'fastest' needs the section 'grid', which is missing",
}


@pytest.fixture(scope="module")
def answers(site: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[int, str, str]]]:
    """A folder, and what commands of a nsmaps whose registry has one more line end with and print there."""
    folder = tmp_path_factory.mktemp("fastest")
    (folder / "fastest.py").write_text(FASTEST)
    for name, text in zip(("s", "s0", "s1", "s2"), (STUDY, *WRONG), strict=True):
        (folder / f"{name}.yaml").write_text(text)
    commands = ["check", "s.yaml"], ["run", "s.yaml", "--out", "out"], ["show", "out"]
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(site))
        return folder, told(folder, *commands, *(["check", f"s{number}.yaml"] for number in range(len(WRONG))), first=LINE)


def test_a_section_of_one_module_is_read_described_computed_kept_and_shown(
    answers: tuple[Path, list[tuple[int, str, str]]],
) -> None:
    folder, (checked, ran, shown, *_) = answers
    assert "  fastest: of v, below 0.1\n" in checked[1], checked
    assert ran[0] == 0, ran
    record = json.loads((folder / "out/result.json").read_text())
    (largest,) = record["numbers"]["fastest"]
    assert [verdict["text"] for verdict in record["verdicts"]] == [f"no: {largest:.3g}"]
    assert re.search(rf"Fastest\s+coordinate\s+largest\s+─*\s+v\s+{largest:.3g}\s", ran[1]), ran
    with np.load(folder / "out/arrays.npz") as arrays:
        assert arrays["fastest"].tolist() == [largest]
    assert "fastest: below its limit" in shown[1], shown
    assert "fastest: below its limit" in (folder / "out/report.html").read_text()


def test_its_errors_have_their_place(answers: tuple[Path, list[tuple[int, str, str]]]) -> None:
    for number, (answer, says) in enumerate(zip(answers[1][3:], WRONG.values(), strict=True)):
        assert answer[:2] == [2, ""]
        assert answer[2].startswith(f"s{number}.yaml:{says}")


def test_every_section_says_what_it_computes_and_what_that_needs() -> None:
    computing = [section for section in SECTIONS if section.compute]
    unknown = [section.key for section in computing if section.size is None]
    assert unknown == ["partition", "second_iterate"], "nobody knows beforehand how many pieces, and terms, there will be"
    assert len({section.key for section in SECTIONS}) == len(SECTIONS)
