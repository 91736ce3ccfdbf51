"""The section `optimum` of a study: against the function, in numbers, tables, captions and the figure of a plane."""

import re
from pathlib import Path
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.dynamics.design.optimum import Attempt
from nsmaps.errors import StudyError
from nsmaps.study.pictures.catalogue import caption
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.parameters.optimum import same
from nsmaps.study.store.archive import FORMAT, read_result
from nsmaps.study.study import CATALOGUE

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}" / "optimum"
ENERGY = {"name": "energy", "formula": "(v**2 - v_after**2)/2", "scale": 2.0, "unit": "J"}
HEAD = "system: vi_pair\nparameters: {d: 0.7, g_bar: 0.1}\n"


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return nsmaps.run_study(nsmaps.load_study(STORED / "study.yaml"))


def test_it_is_what_the_functions_give(result: StudyResult) -> None:
    found, noisy = result.optimize, result.noisy_optimum
    assert found is not None
    assert noisy is not None
    bounds = {"d": (0.5, 0.8), "g_bar": (0.05, 0.15)}
    direct = nsmaps.optimize(result.system, ENERGY, bounds, [1.08, 1.0], guess={"d": 0.7, "g_bar": 0.1}, n_guesses=1)
    assert found.value == pytest.approx(direct.value, rel=1e-12)
    assert found.active == direct.active == ("d", "g_bar")
    system = result.system.at(**found.parameters)
    orbits = nsmaps.noisy_orbits(
        system,
        found.orbit.states[0],
        nsmaps.Noise(sigma=0.05, tau=0.5),
        n_returns=50,
        n_realisations=4,
        rng=3,
        max_impacts=2000,
    )
    mean = nsmaps.observe(system, orbits, [ENERGY]).per_period
    assert (noisy.value[1], noisy.error[1]) == (mean.value[0], mean.error[0])
    assert noisy.value[0] == pytest.approx(found.value, rel=1e-12)


def test_a_stored_run_is_read_back(result: StudyResult) -> None:
    stored = read_result(STORED)
    assert stored.optimize is not None
    assert stored.optimize.parameters == pytest.approx(result.optimize.parameters)
    assert stored.optimize.conditions[-1].name == "share"
    assert stored.optimize.basins.fractions.tolist() == result.optimize.basins.fractions.tolist()
    assert stored.optimize.attempts[1].start == pytest.approx({"d": 0.65, "g_bar": 0.05 + 0.1 / 3})


def test_numbers_verdict_tables_and_caption_say_what_was_found(result: StudyResult) -> None:
    section = result.study.optimize
    numbers = section.numbers(result)["optimize"]
    assert (numbers["unit"], numbers["per"], numbers["motion"], numbers["word"]) == ("J", "period", "1:1/T", "BTB")
    by_name = {row["name"]: row for row in numbers["conditions"]}
    assert by_name["d"]["active"]
    assert by_name["d"]["gain"] == pytest.approx(numbers["gradient"]["d"])
    assert by_name["share"]["low"] == 0.2
    assert numbers["coexisting"] == [{"label": "1:1/T", "share": 1.0, "error": 0.0}]
    (verdict,) = [each for each in result.verdicts if each.name == "optimize: the same from every start"]
    assert verdict.holds
    assert verdict.text == "yes: 2 of 2 starts within 1e-06 of its value, 2 of 2 within 0.001 of the bounds of its parameters"
    conditions, beside, under = section.tables(result)
    assert conditions.title == "Maximum of energy of 1:1/T: 2.06391 J per period"
    assert conditions.rows[3][:3] == ("d", "0.8", "0.5 to 0.8")
    assert beside.rows == (("1:1/T", "100 %", "0 %"),)
    assert [row[0] for row in under.rows] == ["0", "0.05"]
    assert "maximum of energy of 1:1/T: 2.0639 J per period at d = 0.8, g_bar = 0.15" in caption(result, "parameter_plane")
    about = section.describe(result.study)
    assert about == "max of energy over d, g_bar, 2 guesses; basins of 6 x 6 states; 400 returns under noise"
    assert section.size(result.study, result.system).seconds > 0


@pytest.mark.parametrize(
    ("formula", "places"),
    [("(d + g_bar - 0.75)**2", 1), ("1 + (d + g_bar - 0.75)**2", 1), ("(d - 0.6)**2 + (g_bar - 0.1)**2", 3)],
)
def test_the_verdict_tells_one_value_from_one_place(tmp_path: Path, formula: str, places: int) -> None:
    """The least value is known, that of a zero only up to rounding; a square of a sum has it along a line, a sum at a point."""
    entry = f"observable: {{name: q, formula: {formula}}}, sense: min, start: {{v: 1.08, phi: 1}}, n_guesses: 3"
    bounds = "bounds: {d: [0.5, 0.8], g_bar: [0.05, 0.15]}"
    (tmp_path / "study.yaml").write_text(f"{HEAD}optimize: {{{entry}, {bounds}}}")
    (verdict,) = [each for each in nsmaps.run_study(tmp_path / "study.yaml").verdicts if each.name.startswith("optimize")]
    assert verdict.holds == (places == 3)
    assert "3 of 3 starts within 1e-06 of its value, " in verdict.text
    assert f", {places} of 3 within 0.001 of the bounds" in verdict.text


def test_places_agree_where_values_do_not() -> None:
    """At the edge of a fold a value has the root of the error of its place."""
    ends = [{"d": 0.5 + 1e-8}, {"d": 0.5 + 4e-8}, {"d": 0.7}]
    attempts = [Attempt(end, end, (end["d"] - 0.5) ** 0.5, True, "", 1, 1.0) for end in ends]
    assert same(SimpleNamespace(attempts=attempts, sense="min", size=1.0), {"d": (0.0, 1.0)}) == (1, 2)


def test_the_plane_has_a_star_at_the_optimum(result: StudyResult) -> None:
    panels = [panel for sheet in CATALOGUE["parameter_plane"].sheets(result) for panel in sheet.panels]
    assert len(panels) == 3
    for panel in panels:
        _, ax = plt.subplots()
        panel(ax)
        (star,) = [line for line in ax.lines if line.get_marker() == "*"]
        assert np.allclose(star.get_xydata(), [[0.8, 0.15]])
        plt.close()


@pytest.mark.parametrize(
    ("entry", "place", "told"),
    [
        (
            "observable: los, bounds: {d: [0.5, 0.8]}",
            "los",
            message("exact.observable-near", name="los", map="VIPair", near="loss"),
        ),
        (
            "observable: loss, bounds: {q: [0.5, 0.8]}",
            "q",
            message("errors.unknown", kind="parameter", name="q", known="d, r, g_bar"),
        ),
        (
            "observable: loss, bounds: {d: [0.8, 0.9]}",
            "{d",
            message("dynamics.start-outside", name="d", start=0.7, low=0.8, high=0.9),
        ),
        ("observable: loss, share: 0.5, bounds: {d: [0.5, 0.8]}", "{obs", message("dynamics.share", share=0.5)),
        (
            "observable: loss, multiplier: 2, bounds: {d: [0.5, 0.8]}",
            "2",
            message("errors.value", name="multiplier", value=2, expected="less than or equal to 1"),
        ),
        (
            "observable: work, noisy: {sigma: [0], tau: 1}, bounds: {d: [0.5, 0.8]}",
            "{sigma",
            message("study.noisy-flights", name="work"),
        ),
        (
            "observable: loss, motion: 2:1/T, bounds: {d: [0.5, 0.8]}",
            "{obs",
            message("dynamics.other-motion", place="d = 0.7", motion="1:1/T"),
        ),
    ],
)
def test_an_entry_that_is_not_one_is_answered_with_its_place(tmp_path: Path, entry: str, place: str, told: str) -> None:
    line = f"optimize: {{{entry}, start: {{v: 1.08, phi: 1.0}}}}"
    (tmp_path / "study.yaml").write_text(HEAD + line)
    with pytest.raises(StudyError, match=message("study.at", place=re.compile(r"study\.yaml:3:\d+"))) as error:
        nsmaps.run_study(tmp_path / "study.yaml")
    assert re.search(told, str(error.value))
    assert f"study.yaml:3:{line.index(place) + 1}: " in str(error.value)
