"""What a domain that is not trapped says beside the reason: its fit, the words in its start box."""

from pathlib import Path

import numpy as np
import pytest

import nsmaps

BASE = """\
system: vi_pair
parameters: {d: 0.35, g_bar: 0.2113275}
grid: {v: {from: 0.02, to: 1, points: 41}, phi: {from: 0, to: 2*pi, points: 63}}
families: {low: [BTB]}
composite:
  - {name: flat, box: {v: [0, 1.5], phi: [0, 2*pi]}, family: low, fit: {full: {}}}
  - name: fine
    box: {v: [0, 2], phi: [0, 2*pi]}
    family: low
    data: 0.65 < v < 0.95 and 0.1 < phi < 0.6
    fit: {full: {v: 3, phi: 3}}
domains:
  - {name: by flat, map: flat, box: {v: [0.2, 0.3], phi: [0.2, 0.4]}}
  - {name: by fine, map: fine, box: {v: [0.7, 0.76], phi: [0.2, 0.31]}}
  - {name: exact, map: exact, box: {v: [0.05, 0.9], phi: [0.2, 3]}}
"""


@pytest.fixture
def result() -> nsmaps.StudyResult:
    """Domains of a constant, of a fit that follows its data, and of the exact map; none is trapped."""
    Path("s.yaml").write_text(BASE)
    return nsmaps.run("s.yaml")


def text(result: nsmaps.StudyResult, name: str) -> str:
    (verdict,) = (v for v in result.verdicts if v.name == f"domain {name}: trapped")
    assert not verdict.holds
    return verdict.text


def test_a_fit_that_does_not_follow_its_data_is_said(result: nsmaps.StudyResult) -> None:
    flat, fine = (result.composite.piece(name).map.report for name in ("flat", "fine"))
    assert (flat.r2 < 0.9).all()
    assert (fine.r2 > 0.9).all()
    said = "; the fit of flat follows its data badly: R2 = "
    assert f"{said}{flat.r2[0]:.3g} for v' and {flat.r2[1]:.3g} for phi'" in text(result, "by flat")
    assert "follows its data badly" not in text(result, "by fine") + text(result, "exact")
    assert [warning.partition(":")[0] for warning in flat.warnings if "does not follow" in warning] == ["v'", "phi'"]
    assert not any("does not follow" in warning for warning in fine.warnings)


def test_other_words_in_the_start_box_are_counted(result: nsmaps.StudyResult) -> None:
    counts: dict[str, int] = {}
    for (v, phi), word, valid in zip(result.returns.start, result.returns.words, result.returns.valid, strict=True):
        if 0.05 <= v <= 0.9 and 0.2 <= phi <= 3 and valid:
            counts[str(word)] = counts.get(str(word), 0) + 1
    assert len(counts) > 1
    share = 1 - max(counts.values()) / sum(counts.values())
    most = max(counts, key=counts.get)
    assert f"; {100 * share:.2g} % of the grid's states in its start box have another word than {most}" in text(result, "exact")
    assert "another word" not in text(result, "by fine")


def test_the_same_across_phase_zero() -> None:
    Path("s.yaml").write_text(BASE.replace("box: {v: [0.05, 0.9], phi: [0.2, 3]}", "box: {v: [0.05, 0.9], phi: [5, 7]}"))
    result = nsmaps.run("s.yaml")
    v, phi = result.returns.start.T
    inside = (v >= 0.05) & (v <= 0.9) & ((phi >= 5) | (phi <= 7 - 2 * np.pi)) & result.returns.valid
    words = result.returns.words[inside].tolist()
    share = 1 - max(words.count(word) for word in set(words)) / len(words)
    assert 0 < share < 1
    assert f"; {100 * share:.2g} % of the grid's states in its start box" in text(result, "exact")
