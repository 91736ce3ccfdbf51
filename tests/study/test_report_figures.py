"""Figures in the report: the key figure first, captions with the numbers of the run, what is folded, what is said to be left."""

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.report.page import write_report
from nsmaps.study.conclusions.headline import headline
from nsmaps.study.conclusions.verdict import verdicts
from nsmaps.study.pictures.catalogue import caption, drawable
from nsmaps.study.study import CATALOGUE

STORED = Path(__file__).parents[1] / "data" / "run-format-4"
RUNS = sorted(path.name for path in STORED.iterdir() if path.is_dir())
IN_DETAILS = re.compile(r"<details[^>]*><summary>(.*?)</summary>(.*?)</details>", re.DOTALL)


Report = Callable[..., str]


@pytest.fixture
def report_of(once: Callable[..., Path]) -> Report:
    """Gives the page of a run of a study by the command line, whose folder is then copied to `out`."""

    def text(study: str, *more: str) -> str:
        shutil.rmtree("out", ignore_errors=True)
        shutil.copytree(once(study, *more), "out")
        return page()

    return text


def page() -> str:
    return Path("out/report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("system", "spoken"),
    [(nsmaps.load_system("hopper"), "integrated map"), (nsmaps.load_system("bouncing_ball", Gamma=2), "exact map")],
    ids=["hopper", "bouncing_ball"],
)
def test_the_map_has_the_name_of_what_was_computed(
    good: str, monkeypatch: pytest.MonkeyPatch, system: nsmaps.System, spoken: str
) -> None:
    Path("s.yaml").write_text(good)
    result = nsmaps.run_study("s.yaml")
    monkeypatch.setattr(type(result.system), "map_name", system.map_name)
    texts = [caption(result, "orbits"), *(f"{each.name} {each.of} {each.text}" for each in verdicts(result)), headline(result)]
    said = {name for name in ("integrated map", "exact map") if name in " ".join(texts).lower()}
    assert said == {spoken}


def test_the_first_figure_of_the_study_is_right_under_the_summary(good: str, report_of: Report) -> None:
    text = report_of(good + "figures: [orbits, words]\n")
    summary, nav, first = text.index('role="status"'), text.index("<nav"), text.index("<figure")
    assert summary < nav < first
    assert text.count("<figure") == 2
    more = text.index("<h2>More figures</h2>")
    assert "<b>orbits. </b>" in text[first:more]
    assert "<b>words. </b>" in text[more:]


def test_captions_say_the_numbers_of_the_run(good: str, report_of: Report) -> None:
    text = report_of(good + "figures: [words, orbits, domain_size]\n")
    result = nsmaps.read_result("out")
    (word, count), *_ = zip(*np.unique(result.returns.words, return_counts=True), strict=True)
    share = 100 * count / len(result.returns)
    assert f"At a = 0.2, r = 0.5: {len(result.returns):,} states in v in [0.01, 0.5]" in text
    assert f"by word {word} {share:.3g} %" in text
    assert f"from (v = 0.3, φ = 1) to {'the fixed point' if result.orbits[0].ends.period == 1 else ''}" in text
    assert f"{'exact from 0.2 × 0.8 to' if result.domain.forward_invariant else 'not forward invariant: exact'}" in text
    other = report_of(good.replace("a: 0.2", "a: 0.3") + "figures: [words]\n")
    assert "At a = 0.3, r = 0.5" in other
    assert "At a = 0.2" not in other


@pytest.mark.parametrize("run", RUNS)
def test_a_caption_of_every_figure_that_a_run_has_the_data_for(run: str) -> None:
    result = nsmaps.read_result(STORED / run)
    assert drawable(result)
    for name in drawable(result):
        text = caption(result, name)
        own, general, units = text.partition(CATALOGUE[name].caption)
        assert general
        assert units in ("", " All quantities but angles are dimensionless.")
        assert "nan" not in own.lower()
        assert own or name in ("sketch", "algorithm"), f"{name} says nothing of the run {run}"
        if own:
            assert re.match(r"(At \w+ = .*|sigma.*|delta.*|\d+ values of .*)\. $", own, re.DOTALL), own


@pytest.mark.parametrize("run", RUNS)
def test_what_is_drawable_is_what_draws(run: str, tmp_path: Path) -> None:
    result = nsmaps.read_result(STORED / run)
    there = drawable(result)
    for name in CATALOGUE:
        if name in there:
            assert CATALOGUE[name].sheets(result)
        else:
            with pytest.raises(nsmaps.NsmapsError):
                CATALOGUE[name].sheets(result)


def test_a_parameter_that_is_swept_is_not_said_to_have_a_value() -> None:
    result = nsmaps.read_result(STORED / "run")
    swept = result.study.bifurcation_diagram.parameter
    assert swept in result.system.parameters
    own = caption(result, "bifurcation_diagram").split(": ")[0]
    assert not re.search(rf"\b{swept} = ", own)
    assert f"values of {swept} from" in caption(result, "bifurcation_diagram")


def test_the_study_and_tables_are_folded(good: str, report_of: Report) -> None:
    text = report_of(good)
    before, *folds = re.split(r'<details id="', text)
    named = {fold.partition('"')[0]: fold for fold in folds}
    assert list(named) == ["verdicts", "numbers", "what-was-asked", "timings", "versions", "how-to-cite"]
    assert "system: ball" in named["what-was-asked"]
    assert named["numbers"].count("<details>") > 3
    assert 'class="verdicts"' in named["verdicts"]
    assert "system: ball" not in before


def test_domains_that_bound_nothing_are_folded(good: str, report_of: Report) -> None:
    """Their figures are not drawn beside those of others; one that an earlier version drew is folded."""
    more = "domains:\n  - {name: held, map: exact, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 1}\n"
    report_of(good.replace("domains:\n", more) + "figures: [envelopes]\n")
    result = nsmaps.read_result("out")
    held = {**result.domains, "held": replace(result.domains["held"], forward_invariant=True)}
    assert not held["exact"].forward_invariant
    write_report(result.with_parts({"domains": held}), Path("out"))
    assert "Domains that bound nothing" not in page()
    shutil.copyfile("out/figures/envelopes.png", "out/figures/envelopes-exact.png")
    write_report(result.with_parts({"domains": held}), Path("out"))
    folds = dict(IN_DETAILS.findall(page()))
    assert "<b>envelopes (exact). </b>" in folds["Domains that bound nothing: 1 figures"]
    assert "no domain: " in folds["Domains that bound nothing: 1 figures"]
    both = {name: replace(domain, forward_invariant=True) for name, domain in result.domains.items()}
    write_report(result.with_parts({"domains": both}), Path("out"))
    assert "Domains that bound nothing" not in page()


def test_drawing_brings_the_report_up_to_date_where_there_is_one(good: str, report_of: Report) -> None:
    assert page_count(report_of(good + "figures: [orbits]\n")) == 1
    assert "Others that this run has the data for: " in page()
    assert re.search(r"Others [^<]*\bwords\b", page())
    assert CliRunner().invoke(app, ["figures", "out", "--only", "words"]).exit_code == 0
    assert page_count(page()) == 2
    assert not re.search(r"Others [^<]*\bwords\b", page())
    assert CliRunner().invoke(app, ["figures", "out", "--only", "impacts", "--out", "elsewhere"]).exit_code in (0, 2)
    assert page_count(page()) == 2
    Path("out/report.html").unlink()
    assert CliRunner().invoke(app, ["figures", "out"]).exit_code == 0
    assert not Path("out/report.html").exists()


def page_count(text: str) -> int:
    return text.count("<img ")


def test_a_run_ends_with_its_key_picture(good: str) -> None:
    Path("s.yaml").write_text(good + "figures: [algorithm, orbits]\n")
    answer = CliRunner().invoke(app, ["run", "s.yaml", "--out", "out"])
    assert "picture out/figures/orbits.png" in answer.stdout.splitlines()


def test_a_page_to_explore_is_linked_where_it_is_there(good: str, report_of: Report) -> None:
    assert "explore.html" not in report_of(good)
    Path("out/explore.html").write_text("<!DOCTYPE html>")
    assert CliRunner().invoke(app, ["report", "out"]).exit_code == 0
    assert '<a href="explore.html">Explore</a>' in page()


@pytest.mark.parametrize("study", ["fp", "pd", "cd"])
def test_a_case_of_the_paper_shows_seven_figures(study: str) -> None:
    assert len(nsmaps.load_study(f"vi_pair/{study}").figures) == 7


def test_a_run_without_figures_says_how_to_draw_them(good: str, report_of: Report) -> None:
    assert "None was drawn. nsmaps figures DIR draws those that the study names." in report_of(good, "--no-figures")
    shutil.rmtree("out")
