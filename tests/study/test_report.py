"""The page of a run: whole, closed, escaped, asking nobody for anything; and how to cite."""

import re
import shutil
import subprocess
from base64 import b64encode
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from xml.etree.ElementTree import tostring

import numpy as np
import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.interrupts import Interrupted
from nsmaps.progress import outermost
from nsmaps.report.cite import citation, run_citation
from nsmaps.report.html import formatted, tables, tag
from nsmaps.study.study import CATALOGUE

ROOT = Path(__file__).parents[2]
VOID = {"meta", "img", "br"}
ADDRESSES = ("src", "href", "srcset", "action", "data", "poster")
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
HOSTILE = """<script>alert("1")</script> & 'co'"""


def printed(text: str) -> str:
    """A text as it is set on the page."""
    return text.replace("phi", "φ").replace("] x ", "] × ")


class Page(HTMLParser):
    """What a page holds; tags that do not close in order are an error."""

    def __init__(self, text: str) -> None:
        HTMLParser.__init__(self)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert self.open == [], "every tag is closed"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {key: value or "" for key, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data

    def of(self, name: str) -> list[dict[str, str]]:
        """The attributes of every tag of this name."""
        return [attributes for tag, attributes in self.tags if tag == name]


Ran = Callable[..., Path]


@pytest.fixture
def ran(once: Callable[..., Path]) -> Ran:
    """Gives the folder of a run by the command line, a copy of its own for each test."""
    return lambda study, *more: Path(shutil.copytree(once(study, *more), "out"))


def page_of(folder: Path) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_a_run_leaves_one_closed_page_that_asks_nobody(good: str, ran: Ran) -> None:
    folder = ran(good + "figures: [words, orbits, domain_size]\n")
    page = page_of(folder)
    links = {attributes["href"].removeprefix("#") for attributes in page.of("a")}
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert links == set(ids)
    assert len(ids) == len(set(ids)) == 8
    addresses = [attributes[key] for _, attributes in page.tags for key in ADDRESSES if key in attributes]
    assert all(address.startswith(("#", "data:image/png;base64,")) for address in addresses)
    assert page.of("link") == page.of("script") == page.of("iframe") == []
    source = (folder / "report.html").read_text()
    assert "url(" not in source
    assert "@import" not in source
    assert page.of("html") == [{"lang": "en"}]
    assert {"name": "viewport", "content": "width=device-width, initial-scale=1"} in page.of("meta")


def test_every_figure_is_within_with_a_text_in_its_place(good: str, ran: Ran) -> None:
    folder = ran(good + "figures: [words, orbits, domain_size]\n")
    images = page_of(folder).of("img")
    drawn = sorted((folder / "figures").glob("*.png"))
    assert len(images) == len(drawn) == 3
    inside = {image["src"].partition(",")[2] for image in images}
    assert inside == {b64encode(path.read_bytes()).decode() for path in drawn}
    assert all(len(image["alt"]) > 20 and int(image["width"]) > 100 for image in images)


def test_a_page_has_what_fails_open_and_all_verdicts_folded(good: str, ran: Ran) -> None:
    folder = ran(good)
    page, result = page_of(folder), nsmaps.read_result(folder)
    assert len(result.verdicts) == 7
    failing = [verdict for verdict in result.verdicts if not verdict.holds]
    assert failing
    for verdict in result.verdicts:
        assert page.text.count(printed(verdict.name)) >= 1 + (verdict in failing)
        assert printed(verdict.text.partition(": ")[2]) in page.text
    text = (folder / "report.html").read_text()
    assert re.findall(r"<h2>(.*?)</h2>", text) == ["More figures", "What fails"]
    folds = re.findall(r"<details id=[^>]*><summary>(.*?)</summary>", text)
    assert folds == ["Verdicts (7)", "Numbers", "What was asked", "Timings", "Versions", "How to cite"]
    assert 'class="status warn"' in text, "none required fails"
    numbers = dict(re.findall(r"<dt>([^<]*)</dt><dd>([^<]*)</dd>", text.partition('<dl class="key">')[2].partition("</dl>")[0]))
    assert numbers["100 %"] == "of the grid lies in a piece of the composite map"
    held = sum(verdict.holds for verdict in result.verdicts[1:])
    told = f"The one required verdict holds. Of 6 that are not required, {held} hold, {6 - held} fail: "
    assert told + printed(failing[0].name) in page.text
    assert (folder / "study.yaml").read_text() in page.text
    for name, seconds in result.timings.items():
        assert f"{name}{seconds:.2f}" in page.text.replace("\n", "")
    assert all(f"{name}{version}" in page.text for name, version in result.versions.items())
    assert "@article{bao2025computer," in page.text


def test_terms_of_the_verdicts_are_explained_and_no_others(good: str, ran: Ran) -> None:
    page = page_of(ran(good.replace("map: exact", "map: exact\n    bounds_kind: sampled"))).text
    for part in (
        "coveredevery state of the study's grid",
        "completes all returnsthe orbit has an image",
        "same attractorthe orbits of both maps",
        "forward invariantthe worst case",
        "sampledsampled on grids of states: not a bound",
        "domain exactof the exact map, from the study's box",
    ):
        assert part in page
    assert "boxes that contain the images of all states" not in page
    assert "moved out by the error of its fit" not in page
    assert [tag for tag, _ in page_of(Path("out")).tags].count("dt") == [tag for tag, _ in page_of(Path("out")).tags].count("dd")


def test_a_required_verdict_that_fails_is_said_in_the_first_sentence(good: str, ran: Ran) -> None:
    folder = ran(good.replace("where: v > 0.2,", "where: v > 0.3,"))
    assert "1 of 1 required verdicts fails: covered (composite map)." in page_of(folder).text


def test_hostile_names_are_text(good: str, ran: Ran) -> None:
    study = YAML(typ="safe").load(good)
    study["title"] = HOSTILE
    study["families"] = {HOSTILE: ["BB"]}
    study["composite"][0] |= {"name": HOSTILE, "family": HOSTILE}
    study["domains"][0]["name"] = HOSTILE
    Path("made.yaml").unlink(missing_ok=True)
    YAML().dump(study, Path("made.yaml"))
    folder = ran(Path("made.yaml").read_text() + "figures: [envelopes]\n")
    page = page_of(folder)
    assert page.of("script") == []
    assert HOSTILE in page.text
    assert f"domain {HOSTILE}: forward invariant" in page.text
    assert page.text.count(HOSTILE) >= 5
    assert "<script" not in (folder / "report.html").read_text()


def test_without_a_report_none_is_left_of_an_earlier_run(good: str) -> None:
    Path("s.yaml").write_text(good)
    for options, left in (((), True), (("--no-report",), False)):
        assert CliRunner().invoke(app, ["run", "s.yaml", "--out", "out", "--no-figures", *options]).exit_code == 0
        assert Path("out/report.html").exists() is left


def test_report_makes_it_again_with_the_figures_that_are_there(good: str, ran: Ran) -> None:
    folder = ran(good + "figures: [orbits]\n", "--no-figures")
    assert page_of(folder).of("img") == []
    assert "None was drawn." in page_of(folder).text
    assert CliRunner().invoke(app, ["figures", "out"]).exit_code == 0
    (folder / "figures" / "cobweb.png").write_bytes(b"of an earlier run")
    answer = CliRunner().invoke(app, ["report", "out"])
    assert (answer.exit_code, answer.stdout) == (0, "out/report.html\n")
    assert len(page_of(folder).of("img")) == 1
    assert CliRunner().invoke(app, ["report", "nowhere"]).exit_code == 2


def test_an_unfinished_run_is_said_to_be_one(good: str) -> None:
    def stop(share: float) -> None:
        if outermost().step == "orbits":
            raise KeyboardInterrupt

    Path("s.yaml").write_text(good)
    with pytest.raises(Interrupted):
        nsmaps.run_study("s.yaml", out="out", progress=stop)
    assert CliRunner().invoke(app, ["report", "out"]).exit_code == 0
    text = page_of(Path("out")).text
    assert "Unfinished: the run was stopped, and this is what it had computed. The one required verdict holds." in text


def test_a_run_with_a_speed_has_its_figure_without_naming_it() -> None:
    stored = ROOT / "tests" / "data" / "run-format-4" / "partition"
    folder = shutil.copytree(stored, "out")
    answer = CliRunner().invoke(app, ["figures", "out"])
    assert answer.stdout.split() == ["out/figures/speed_error.png"]
    assert CliRunner().invoke(app, ["report", "out"]).exit_code == 0
    (image,) = page_of(Path(folder)).of("img")
    assert image["alt"].startswith("The error of the reduced map against its processor time")


def test_plain_data_become_tables() -> None:
    made = tables(
        {"states": 4, "none": None, "fits": {"R1": {"r2": 0.123456}, "R2": {"r2": 1.0}}, "log": [{"a": True}]}, name="of"
    )
    text = [tostring(part, encoding="unicode", method="html") for part in made]
    page = Page("".join(text))
    assert [page.text.count(part) for part in ("states4", "none–", "R10.1235", "R21", "1yes")] == [1, 1, 1, 1, 1]
    (windows,) = tables([{"label": "1:1/T", "low": {"value": 0.25, "kind": "fold"}}] * 2)
    assert [cell.text for cell in windows.iter("th")][:4] == ["", "label", "low value", "low kind"]
    assert formatted([[0.0, 1.0]] * 12) == "12 values, the last 0, 1"
    assert (formatted([1.0, 0.25]), formatted([[1, 2], [3, 4]])) == ("1, 0.25", "(1, 2), (3, 4)")
    assert formatted([0.5, 3, 1, 2, 0.75]) == "5 values, 0.5 to 3"
    assert formatted(np.float64(0.5)) == "0.5", "as the numbers of a run are before they are read back"
    assert tostring(tag("a", "x<", tag("b"), " & y", href='"')) == b'<a href="&quot;">x&lt;<b /> &amp; y</a>'


@pytest.fixture(scope="module")
def cff() -> dict:
    """What the citation file says."""
    return YAML(typ="safe").load((ROOT / "CITATION.cff").read_text())


def test_bibtex_says_what_the_citation_file_says(cff: dict) -> None:
    paper = cff["preferred-citation"]
    text = citation(cff["version"])
    entries = dict(re.findall(r"^@(\w+)\{\w+,\n(.*?)^\}", text, re.MULTILINE | re.DOTALL))
    fields = {kind: dict(re.findall(r"^  (\w+) = \{(.*)\},$", body, re.MULTILINE)) for kind, body in entries.items()}
    authors = " and ".join(f"{author['family-names']}, {author['given-names']}" for author in paper["authors"])
    said = {key: fields["article"][key] for key in ("author", "title", "journal", "volume", "year")}
    assert said == {
        "author": authors,
        "title": paper["title"],
        "journal": paper["journal"],
        "volume": str(paper["volume"]),
        "year": str(paper["year"]),
    }
    assert fields["article"]["pages"] == str(paper["start"])
    assert (fields["software"]["version"], fields["software"]["author"]) == (cff["version"], f"{{{cff['authors'][0]['name']}}}")


def test_a_run_is_cited_by_its_study_and_what_it_computed(good: str, ran: Ran) -> None:
    folder = ran(good.replace("title: The ball", "title: 100 % of {this} & that_one"))
    answer = CliRunner().invoke(app, ["cite", "out"])
    assert answer.exit_code == 0
    assert r"title = {100 \% of \{this\} \& that\_one}" in answer.stdout
    assert answer.stdout.count("@") == 3
    before = run_citation("s", "", {}, folder)
    (folder / "arrays.npz").write_bytes(b"other")
    assert run_citation("s", "", {}, folder) != before
    assert CliRunner().invoke(app, ["cite"]).stdout.count("@") == 2
    assert CliRunner().invoke(app, ["cite", "nowhere"]).exit_code == 2


def browse(*arguments: str) -> str:
    """What a headless browser prints."""
    assert BROWSER
    command = [BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_a_browser_lays_the_page_out_within_its_width(good: str, ran: Ran) -> None:
    folder = ran(good + "figures: [words, orbits, domain_size]\n")
    measure = (
        "const page = this.contentDocument;"
        "const seen = [...page.images].every(image => image.complete && image.naturalWidth > 0 && image.width > 100);"
        "const {scrollWidth, clientWidth} = page.documentElement;"
        "document.body.append(`of ${this.width} beyond ${scrollWidth - clientWidth} images ${page.images.length} ${seen}; `)"
    )
    frame = '<iframe src="report.html" width="{}" height="800" style="border:0" onload="{}"></iframe>'
    frames = "".join(frame.format(width, measure) for width in (390, 1200))
    Path(folder, "frame.html").write_text(f"<!DOCTYPE html><body>{frames}</body>")
    seen = browse("--virtual-time-budget=10000", "--dump-dom", (folder / "frame.html").resolve().as_uri())
    for width in (390, 1200):
        assert f"of {width} beyond 0 images 3 true; " in seen


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_a_browser_prints_the_page(good: str, ran: Ran) -> None:
    folder = ran(good + "figures: [orbits]\n")
    browse("--no-pdf-header-footer", "--print-to-pdf=page.pdf", (folder / "report.html").resolve().as_uri())
    printed = Path("page.pdf").read_bytes()
    assert printed.startswith(b"%PDF")
    assert printed.count(b"/Type /Page\n") + printed.count(b"/Type /Page ") >= 2


def test_a_number_next_to_one_is_not_told_as_one() -> None:
    assert formatted(1 - 4.2e-8) == "1 - 4.2e-08"
    assert formatted(1.0001) == "1 + 0.0001"
    assert (formatted(1.0), formatted(0.9991), formatted(1.002)) == ("1", "0.9991", "1.002")


def test_warnings_stand_below_their_table_and_nothing_is_told_as_such() -> None:
    long = "v': R2 is 0.395, below 0.9: the polynomial does not follow the data"
    fits = {"R1": {"r2": [0.5], "warnings": []}, "R7": {"r2": [0.395], "warnings": [long, long]}}
    text = "".join(tostring(part, encoding="unicode") for part in tables({"uncovered": {}, "fits": fits}))
    assert text.count(f"R7: {long}; {long}</p>") == 1
    assert "warnings" not in text
    assert "R1: " not in text
    assert ">uncovered</h4><p>none</p>" in text


HELD = """\
system: vi_pair
parameters: {d: 0.35, r: 0.5, g_bar: 0.21132751903147873}
domains:
  - {name: low, map: exact, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 1}
  - {name: held, map: exact, box: {v: [0.7, 1], phi: [0.2, 1.14]}, max_updates: 1}
  - {name: inner, map: exact, box: {v: [0.72, 1], phi: [0.2, 1.14]}, max_updates: 1}
figures: [envelopes]
"""


def test_the_first_domain_s_figure_comes_first(ran: Ran) -> None:
    folder = ran(HELD)
    result = nsmaps.read_result(folder)
    assert [domain.forward_invariant for domain in result.domains.values()] == [False, True, True]
    assert "Of envelopes one domain is shown; nsmaps figures DIR --only NAME draws all." in page_of(folder).text
    assert CliRunner().invoke(app, ["figures", "out", "--only", "envelopes"]).exit_code == 0
    assert "one domain is shown" not in page_of(folder).text
    captions = re.findall(r"<b>(envelopes[^<]*?)\. </b>([^<]*)", (folder / "report.html").read_text(encoding="utf-8"))
    assert [name for name, _ in captions] == ["envelopes", "envelopes (inner)"]
    assert "domain held, " in captions[0][1]
    assert "domain inner, " in captions[1][1]


NOWHERE = """\
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0.01, to: 0.5, points: 11}, phi: {from: 0, to: 2*pi, points: 11}}
families: {low: [BB]}
composite: [{name: slow, box: {v: [0, 0.2], phi: [0, 2*pi]}, family: low, fit: {full: {v: 2, phi: 3}}}]
orbits: [{start: {v: 0.3, phi: 1}, n_returns: 20}]
domains: [{name: beyond, map: composite, box: {v: [0.5, 0.6], phi: [0.2, 1]}, max_updates: 1, bounds_kind: sampled}]
figures: [orbits, envelopes]
"""


def test_what_could_not_be_drawn_and_why_is_on_the_page_until_it_is_drawn(ran: Ran) -> None:
    folder = ran(NOWHERE)
    reason = f"no auxiliary map has a value (domain 'beyond': {printed(nsmaps.read_result(folder).domain.reason)})"
    assert f"envelopes could not be drawn: the figure 'envelopes' has nothing to show: {reason}" in page_of(folder).text
    assert len(page_of(folder).of("img")) == 1
    answer = CliRunner().invoke(app, ["figures", "out", "--only", "envelopes"])
    assert answer.exit_code == 2
    assert answer.stderr.startswith("the figure 'envelopes' cannot be drawn: ")
    assert answer.stderr.count("\n") == 1
    assert CliRunner().invoke(app, ["figures", "out", "--only", "envelops"]).exit_code == 2
    result = nsmaps.read_result(folder)
    assert list(result.undrawn) == ["envelopes"]
    (folder / "figures" / "envelopes.png").write_bytes((folder / "figures" / "orbits.png").read_bytes())
    assert CliRunner().invoke(app, ["report", "out"]).exit_code == 0
    assert "could not be drawn" not in page_of(folder).text


def test_figures_drawn_later_are_on_the_page_after_those_of_the_study(ran: Ran) -> None:
    folder = ran(NOWHERE.replace("figures: [orbits, envelopes]", "figures: [orbits]"))
    (folder / "figures" / "impacts.png").write_bytes((folder / "figures" / "orbits.png").read_bytes())  # of nobody knows what
    for words in (["figures", "out", "--only", "domain_size", "--only", "words"], ["report", "out"]):
        assert CliRunner().invoke(app, words).exit_code == 0
    found = [image["alt"] for image in page_of(folder).of("img")]
    expected = ["orbits", *(name for name in CATALOGUE if name in ("domain_size", "words"))]
    assert found == [CATALOGUE[name].alt for name in expected]


@pytest.mark.parametrize("cut", [0, 20, 1000, -13])
def test_a_picture_that_is_cut_off_is_left_out_and_named(cut: int, ran: Ran) -> None:
    folder = ran(NOWHERE.replace("figures: [orbits, envelopes]", "figures: [orbits, words]"))
    file = folder / "figures" / "words.png"
    file.write_bytes(file.read_bytes()[:cut])
    assert CliRunner().invoke(app, ["report", "out"]).exit_code == 0
    page = page_of(folder)
    assert len(page.of("img")) == 1
    assert "words.png is incomplete; nsmaps figures DIR --only words draws it again" in page.text
