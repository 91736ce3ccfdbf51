"""The section `observables` of a study: against the functions, in numbers, tables, captions and the figure."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import StudyError
from nsmaps.figures.longrun.observe import observe, sheets
from nsmaps.study.pictures.catalogue import caption
from nsmaps.study.result import StudyResult
from nsmaps.study.store.archive import FORMAT

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}" / "observables" / "study.yaml"
CHOSEN = [
    "loss",
    "work",
    "speed",
    {"name": "energy at B", "formula": "(1 - r**2)*v**2/2", "at": "B", "scale": 2.5, "unit": "J"},
    {"name": "sway", "formula": "abs(place)", "of": "flights", "per": "1"},
    {"name": "hardest", "formula": "v", "largest": True},
]


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return nsmaps.run_study(nsmaps.load_study(STORED))


def test_it_is_what_the_functions_give(result: StudyResult) -> None:
    means, along = result.observe, nsmaps.exact.Along(result.system, "d")
    diagram = nsmaps.observe(along, result.bifurcation_diagram["exact"], CHOSEN, n_returns=64)
    branch = nsmaps.observe(along, result.branches["1:1"][0], CHOSEN)
    basins = nsmaps.observe(result.system, result.basins.attractors, CHOSEN, n_returns=64)
    (stored,) = result.branch_observables["1:1"]
    for one, other in ((means["bifurcation_diagram"], diagram), (stored, branch), (means["basins"], basins)):
        assert np.array_equal(one.per_period.value, other.per_period.value, equal_nan=True)
    assert np.array_equal(stored.per_time.derivative, branch.per_time.derivative, equal_nan=True)
    assert np.allclose(means["orbits"].per_period.value[0], means["basins"].per_period.value[0], rtol=1e-6)
    assert result.branch_observables["nothing"] == ()


def test_numbers_tables_and_caption_say_what_was_found(result: StudyResult) -> None:
    section = result.study.observe
    numbers = section.numbers(result)["observe"]
    assert numbers["orbits"]["loss"]["value"] == pytest.approx([0.374532], rel=1e-3)
    assert len(numbers["branches"]["1:1"][0]["loss"]["derivative"]) == len(result.branches["1:1"][0].values)
    assert (numbers["basins"]["per"], numbers["basins"]["energy at B"]["unit"]) == ("per period", "J")
    (table,) = section.tables(result)
    assert [row[1] for row in table.rows[:6]] == [
        "loss per period",
        "work per period",
        "speed",
        "energy at B J per period",
        "sway",
        "hardest",
    ]
    assert "loss, work, speed, energy at B, sway, hardest" in caption(result, "observe")
    assert section.describe(result.study).startswith("loss, work, speed, energy at B, sway, hardest; 64")


def test_the_figure_has_the_means_and_their_branches(result: StudyResult) -> None:
    found = {"bifurcation_diagram": result.observe["bifurcation_diagram"], **result.branch_observables}
    (sheet,) = sheets(found)
    assert len(sheet.panels) == 6
    _, ax = plt.subplots()
    observe(found, ax, "d", 3)
    curve = next(line for line in ax.lines if len(line.get_xdata()) == len(result.branches["1:1"][0].values))
    assert np.array_equal(curve.get_ydata(), result.branch_observables["1:1"][0].per_period.value[:, 3])
    dots = next(line for line in ax.lines if len(line.get_xdata()) == 4)
    assert np.array_equal(dots.get_ydata(), result.observe["bifurcation_diagram"].per_period.value[:, 0, 3])
    assert ax.get_ylabel() == "energy at B (J) per period"
    plt.close()


@pytest.mark.parametrize(
    ("entry", "place", "said"),
    [
        ("{observables: [los]}", "los", message("exact.observable-near", name="los", map="VIPair", near="loss")),
        ("{observables: []}", "[]", message("errors.value", name="observables", value="[]", expected="1 entry or more")),
        (
            "{observables: [{name: a, formula: v*q}]}",
            "q}",
            message("errors.unknown", kind="name", name="q", known="d, r, g_bar, phi, t, v, v_after, place"),
        ),
        ('{observables: [{name: a, formula: v, per: "1 +"}]}', "+", message("reduced.unread")),
        (
            "{observables: [{name: a, formula: v, at: X}]}",
            "X",
            message("exact.observable-at", event="an impact", letter="X", letters="B, T"),
        ),
        ("{observables: [{name: a, formul: v}]}", "formul: v", message("errors.unknown", kind="key", name="formul")),
        ("{observables: [loss, loss]}", "{", message("exact.two-observables", name="loss")),
        ("{observables: [loss], n_returns: 0}", "0", message("errors.value", name="n_returns", value=0)),
    ],
)
def test_an_entry_that_is_not_one_is_answered_with_its_place(tmp_path: Path, entry: str, place: str, said: str) -> None:
    line = f"observe: {entry}"
    text = "system: vi_pair\nparameters: {d: 0.35, g_bar: 0.2}\norbits: [{start: {v: 0.8, phi: 0.3}, n_returns: 5}]\n"
    (tmp_path / "study.yaml").write_text(text + line)
    with pytest.raises(StudyError, match=message("study.at", place=re.compile(r"study\.yaml:4:\d+"))) as error:
        nsmaps.run_study(tmp_path / "study.yaml")
    assert re.search(said, str(error.value))
    assert f"study.yaml:4:{line.index(place) + 1}: " in str(error.value)


def test_a_study_with_nothing_to_observe_is_refused(tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text("system: vi_pair\nparameters: {d: 0.35, g_bar: 0.2}\nobserve: {observables: [loss]}\n")
    with pytest.raises(StudyError, match=message("study.nothing-to-observe")):
        nsmaps.run_study(tmp_path / "study.yaml")
