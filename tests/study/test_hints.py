"""What a domain that is not forward invariant says beside the reason: its fit, the words in its start box."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import nsmaps
from nsmaps.auxiliary.bounds import ErrorBound
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.study.conclusions.diagnostics import no_image
from nsmaps.study.conclusions.texts import intervals
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.sets.domain import DomainSection, trapped_text

SECTION = {"name": "half", "map": "half", "box": "diagonal"}
HEAD = """\
system: vi_pair
parameters: {d: 0.35, g_bar: 0.2113275}
grid: {v: {from: 0.02, to: 1, points: 41}, phi: {from: 0, to: 2*pi, points: 63}}
families: {low: [BTB]}
composite:
"""
BASE = (
    HEAD
    + """\
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
)


@pytest.fixture
def result(computed: Callable[..., tuple[nsmaps.StudyResult, Path]]) -> nsmaps.StudyResult:
    """Domains of a constant, of a fit that follows its data, and of the exact map; none is forward invariant."""
    return computed(BASE)[0]


def text(result: nsmaps.StudyResult, name: str) -> str:
    (verdict,) = (v for v in result.verdicts if v.name == f"domain {name}: forward invariant")
    assert not verdict.holds
    return verdict.text


def test_a_fit_that_does_not_follow_its_data_is_said(result: nsmaps.StudyResult) -> None:
    flat, fine = (result.composite.piece(name).map.report for name in ("flat", "fine"))
    assert (flat.r2 < 0.9).all()
    assert (fine.r2 > 0.9).all()
    said = "; the fit of flat is poor: R2 = "
    assert f"{said}{flat.r2[0]:.3g} for v' and {flat.r2[1]:.3g} for phi'" in text(result, "by flat")
    assert "is poor" not in text(result, "by fine") + text(result, "exact")
    assert [warning.partition(":")[0] for warning in flat.warnings if "does not follow" in warning] == ["v'", "phi'"]
    assert not any("does not follow" in warning for warning in fine.warnings)


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (None, "enclosed for the fitted map: outer"),
        (ErrorBound(np.full(1, 1e-3), "certified"), "enclosed for the exact map: inflated by certified error"),
        (ErrorBound(np.full(1, 1e-3), "held-out"), "estimated for the exact map: inflated by held-out error"),
    ],
)
def test_what_rests_on_samples_is_told_as_an_estimate(error: ErrorBound | None, told: str) -> None:
    half = PolyMap.of_monomials(("x",), {"x": {(1,): Fraction(-1, 2)}}, [[-2, 2]])
    domain = nsmaps.attracting_domain(half, [[-1, 1]], error=error)
    assert domain.forward_invariant
    study = nsmaps.Study(system="ball", parameters={"a": 0.2})
    said = trapped_text(StudyResult(study, study.system_object()), DomainSection(**SECTION), domain)
    assert said == f"no worst-case step leaves its box, in {len(domain.updates)} updates ({told})"


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
    result = nsmaps.run_study("s.yaml")
    v, phi = result.returns.start.T
    inside = (v >= 0.05) & (v <= 0.9) & ((phi >= 5) | (phi <= 7 - 2 * np.pi)) & result.returns.valid
    words = result.returns.words[inside].tolist()
    share = 1 - max(words.count(word) for word in set(words)) / len(words)
    assert 0 < share < 1
    assert f"; {100 * share:.2g} % of the grid's states in its start box" in text(result, "exact")


STRAY = (
    HEAD
    + """\
  - {name: flat, box: {v: [0, 0.3], phi: [0, 2*pi]}, family: low, data: v > 0.6, fit: {full: {}}}
  - {name: steep, where: v > SEAM or v < 0, family: low, data: v > 0.6, fit: {full: {v: 9, phi: 0}}}
orbits: [{start: {v: 0.1, phi: 1}, n_returns: 30}]
"""
)


def stray(seam: float) -> tuple[nsmaps.StudyResult, str]:
    """An orbit that a constant leads to v of about 0.8, where a piece begins or not, and what is said of it."""
    Path("s.yaml").write_text(STRAY.replace("SEAM", str(seam)))
    made = nsmaps.run_study("s.yaml")
    (verdict,) = (v for v in made.verdicts if v.name.endswith(": completes all returns") and v.of == "composite map")
    return made, verdict.text


def test_an_orbit_that_leaves_all_pieces_says_where_and_from_which() -> None:
    made, said = stray(2.0)
    v, phi = made.composite.first_return([[0.1, 1.0]]).image[0]
    assert 0.3 < v < 2
    where = f"no: after 1 of 30 returns at (v = {v:.5g}, phi = {phi:.5g})."
    assert said == f"{where} That state lies in no piece; piece flat mapped it there."


def test_a_polynomial_that_overflows_is_named_with_the_return_that_left_the_grid() -> None:
    made, _ = stray(0.3)
    path = nsmaps.orbit(made.composite, [0.31, 1.0], 400)  # far from the data of a polynomial of order nine
    last = int(np.isfinite(path.states).all(axis=1).sum()) - 1
    speeds = path.states[: last + 1, 0]
    left = next(k for k, v in enumerate(speeds) if not 0.02 <= v <= 1)
    assert 1 <= left < last < 400
    said = f"The polynomial of piece steep overflows there; piece steep mapped it out of the grid at return {left}."
    assert no_image(made, path, last) == said
    beyond = nsmaps.orbit(made.composite, [5.0, 1.0], 400)
    assert no_image(made, beyond, int(np.isfinite(beyond.states).all(axis=1).sum()) - 1) == said.partition(";")[0] + "."


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (0.65, 1.0, "v in [0.65, 1]"),
        (0.0033, 0.55, "v in [0.0033, 0.55]"),
        (0.0, 3.141592653589793, "v in [0, 3.142]"),
        (5.44051234561234, 5.44051235411876, "v in [5.44051234561, 5.44051235412]"),
        (-1.00004, -0.5, "v in [-1.001, -0.5]"),
        (2.0, 2.0, "v in [2, 2]"),
        (0.0, 0.0, "v in [0, 0]"),
    ],
)
def test_bounds_are_told_rounded_outwards_and_to_their_width(low: float, high: float, text: str) -> None:
    assert intervals(("v",), np.array([[low, high]])) == text


@pytest.mark.parametrize(("to", "said"), [(1, True), (1.1, False)])
def test_an_attractor_outside_the_grid_is_said_to_be(to: float, said: bool) -> None:
    """At d = 0.5 the fixed point has v = 1.0017, phi = 0.6313."""
    grid = f"grid: {{v: {{from: 0.02, to: {to}, points: 9}}, phi: {{from: 0, to: pi, points: 9}}}}\n"
    orbits = "orbits: [{start: {v: 0.35, phi: 1.5}, n_returns: 200}]\n"
    Path("s.yaml").write_text("system: vi_pair\nparameters: {d: 0.5, g_bar: 0.2113275}\n" + grid + orbits)
    made = nsmaps.run_study("s.yaml")
    assert made.orbits[0].ends.states[0] == pytest.approx([1.0017, 0.6313], abs=1e-4)
    (verdict,) = made.verdicts
    assert verdict.text.endswith("; outside the study's grid") is said
