"""A section of a study stands in one module and one line of the registry: one is added here through these alone."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nsmaps.study.sections import SECTIONS

FASTEST = '''
"""The section `fastest`: the largest images of the states of the grid."""

from dataclasses import dataclass

import numpy as np
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
LINE = "import nsmaps.study.sections as sections, fastest; sections.SECTIONS += (fastest.SECTION,)\n"
STUDY = """\
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0.1, to: 0.5, points: 5}, phi: {from: 0, to: 1, points: 4}}
fastest: {coordinate: v, below: 0.1}
"""


def nsmaps(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The command line of a nsmaps whose registry has one more line."""
    Path("fastest.py").write_text(FASTEST)
    program = f"{LINE}import sys\nfrom nsmaps.cli.cli import main\nsys.argv[0] = 'nsmaps'\nmain()\n"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([os.getcwd(), *sys.path])}
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def test_a_section_of_one_module_is_read_described_computed_kept_and_shown() -> None:
    Path("s.yaml").write_text(STUDY)
    checked = nsmaps("check", "s.yaml")
    assert "  fastest: of v, below 0.1\n" in checked.stdout, checked.stderr
    ran = nsmaps("run", "s.yaml", "--out", "out")
    assert ran.returncode == 0, ran.stderr
    record = json.loads(Path("out/result.json").read_text())
    (largest,) = record["numbers"]["fastest"]
    assert [verdict["text"] for verdict in record["verdicts"]] == [f"no: {largest:.3g}"]
    assert re.search(rf"Fastest\s+coordinate\s+largest\s+─*\s+v\s+{largest:.3g}\s", ran.stdout), ran.stdout
    with np.load("out/arrays.npz") as arrays:
        assert arrays["fastest"].tolist() == [largest]
    shown = nsmaps("show", "out")
    assert "fastest: below its limit" in shown.stdout, shown.stderr
    assert "fastest: below its limit" in Path("out/report.html").read_text()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (STUDY.replace("coordinate: v", "coordinate: w"), "s.yaml:4:23: unknown coordinate 'w'; expected: v, phi"),
        (STUDY.replace("below", "bellow"), "s.yaml:4:26: unknown key 'bellow'; expected: coordinate, below"),
        (STUDY.replace("grid", "# grid"), "s.yaml:4:10: 'fastest' needs the section 'grid', which is missing"),
    ],
)
def test_its_errors_have_their_place(text: str, says: str) -> None:
    Path("s.yaml").write_text(text)
    told = nsmaps("check", "s.yaml")
    assert (told.returncode, told.stdout) == (2, "")
    assert told.stderr.startswith(says)


def test_every_section_says_what_it_computes_and_what_that_needs() -> None:
    computing = [section for section in SECTIONS if section.compute]
    unknown = [section.key for section in computing if section.size is None]
    assert unknown == ["partition", "second_iterate"], "nobody knows beforehand how many pieces, and terms, there will be"
    assert len({section.key for section in SECTIONS}) == len(SECTIONS)
