"""All pictures of the project: in one list, named by pages, not stale; those of the gallery in three formats on its page."""

import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from ruamel.yaml import YAML
from typer.testing import CliRunner

from nsmaps import load_study
from nsmaps.cli.cli import app
from nsmaps.study.pictures.animate import FILMS
from nsmaps.study.study import CATALOGUE

ROOT = Path(__file__).parents[1]
GALLERY = ROOT / "docs" / "gallery"
sys.path.insert(0, str(GALLERY))
LIST = YAML(typ="safe").load((GALLERY / "figures.yaml").read_text(encoding="utf-8"))
FIGURES, ANIMATIONS = LIST["figures"], LIST["animations"]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md")), *sorted((ROOT / "plugins").glob("*/README.md"))]
QUICK = {"vi_pair/motion", "impact_oscillator/grazing", "bouncing_ball/doubling"}  #: runs of some seconds, made anew here
ALSO_TESTED = QUICK - {"vi_pair/motion"}  #: of these the runs are those of other tests
COARSE, FAR, ALIKE = 8, 40, 0.01  #: pixels that count as one, grey levels that are another, share of those that may be
FILES = [entry["file"] for part in ("pages", "saved", "tables") for entry in LIST[part]]
EVERY = [f"docs/gallery/{one['file']}.png" for one in FIGURES] + [f"docs/gallery/{one['file']}.gif" for one in ANIMATIONS] + FILES
MEGABYTE = 1024 * 1024
PAPER = """model:abc bifexact bifapprox regions impact-time 2d-1phi 3d 2Dpi-2pi 2D0-2pi flochart 3d-area r2approx test glosmallic
fig:illauximaps cobweb12d35 cobweb12d35_updates Auximapsd30 Auximapsd30_updates Auximapsd26 highorderiterate comp_stoch ICPP02pi
R1compared comparert TableDeltaErr r5approx"""  #: labels there
V, PHI = (r"$v_{k}$", r"$v_{k+1}$"), (r"$\phi_{k}$", r"$\phi_{k+1}$")
STATES = r"$v_{k}$", r"$\phi_{k}$"
PLANES = {letter: (V, PHI)[k % 2] for k, letter in enumerate("abcdef")}
AGAIN = {letter: (axes[0], axes[1].replace("k+1", "k+2")) for letter, axes in PLANES.items()}
PANELS = {
    "bifexact": {"a": ("exact map", "$v_{k}$"), "b": (r"$\phi_{k}$",)},
    "bifapprox": {
        "a": ("parametric map", "$v_{k}$"),
        "b": ("exact map", "$v_{k}$"),
        **dict.fromkeys("cd", (r"$\phi_{k}$",)),
    },
    "model:abc": {"a": (r"$\beta$",), "b": ("time $t$", "absolute displacement"), "c": ("relative displacement $Z$",)},
    "regions": {"a": STATES, "b": STATES},
    "2d-1phi": {"a": V, "b": PHI},
    "3d": {"a": V[1:], "b": PHI[1:]},
    "2Dpi-2pi": {letter: PLANES[letter] for letter in "abcd"},
    "2D0-2pi": {letter: PLANES[letter] for letter in "abcd"},
    "3d-area": {"a": V[1:], "b": PHI[1:]},
    "R1compared": {
        letter: (*PLANES[letter], f"$d$ = {d}") for letter, d in zip("abcdef", (0.35, 0.35, 0.3, 0.3, 0.26, 0.26), strict=True)
    },
    "r2approx": {"a": V, "b": PHI, "c": (r"$v_{k+1}$",), "d": V, "e": PHI, "f": (r"$v_{k+1}$",)},
    "r5approx": {"a": V, "b": PHI, "c": (r"$v_{k+1}$",)},
    "comparert": dict.fromkeys("abcdef", STATES),
    "test": dict.fromkeys("abcd", STATES),
    "glosmallic": PLANES,
    "fig:illauximaps": {"a": V, "b": PHI, "c": (*V, "$P$", "$Q$"), "d": (*PHI, "$R$", "$O$")},
    "cobweb12d35": {
        letter: (*axes, f"update {n}:") for (letter, axes), n in zip(PLANES.items(), (1, 1, 2, 2, 11, 11), strict=True)
    },
    "Auximapsd30": {
        letter: (*axes, f"update {n}:") for (letter, axes), n in zip(PLANES.items(), (1, 1, 2, 2, 11, 11), strict=True)
    },
    "Auximapsd26": {letter: PLANES[letter] for letter in "abcd"} | dict.fromkeys("ef", ("update $N$", "width in ")),
    "highorderiterate": AGAIN,
}  #: by figure of the paper that has lettered panels, what each shows: names of its axes and in it
BELOW = {
    "regions": ("BB", "BTB", "near both diagonals"),
    "2d-1phi": ("BB", "BTB"),
    "R1compared": ("37 values of $d$ in [0.26, 0.35]", "one value of $d$"),
    "glosmallic-fp": tuple(rf"$\mathcal{{R}}_{{{k}}}$" for k in (2, 3, 4, 5)),
    "glosmallic-pd": tuple(rf"$\mathcal{{R}}_{{{k}}}$" for k in (2, 3, 4, 5)),
    "glosmallic-cd": tuple(rf"$\mathcal{{R}}_{{{k}}}$" for k in (2, 3, 4, 5)),
    "illauximaps": ("the other at its least", "upper map", "lower map", "first interval", "worst case"),
    "highorderiterate-fp": ("$N = 2$", "$N = 11$", "polynomial, degree 9", "$p$, $q$"),
    "highorderiterate-pd": ("$N = 2$", "$N = 11$", "polynomial, degree 9", "$p$, $q$"),
    "highorderiterate-cd": ("$p$, $q$",),
    "comp_stoch": ("B, no noise", "T, no noise", r"B, $\sigma = 0.0447$", r"T, $\sigma = 0.0447$"),
}  #: by file, what its legend names
SIGNATURES = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


def test_every_figure_of_the_paper_is_listed():
    assert {entry["label"] for entry in FIGURES} == set(PAPER.split())


def panels(file: str) -> dict[str, set[str]]:
    """What stands in each part of a drawing, a set of texts: of a panel by its letter, of the page by an empty one."""
    text = (GALLERY / f"{file}.svg").read_text(encoding="utf-8")
    found = {}
    for part in re.split(r'<g id="(?=axes_|legend_)', text)[1:]:
        told = set(re.findall(r"<!-- (.+?) -->", part)) | set(re.findall(r"<text[^>]*>([^<]+)</text>", part))
        letters = [each[1:-1] for each in told if re.fullmatch(r"\([a-z]\)", each)]
        found.setdefault(letters[0] if letters else "", set()).update(told)
    return found


@pytest.mark.parametrize("label", PANELS)
def test_the_panels_of_a_figure_are_those_of_the_paper_and_show_what_they_do_there(label):
    files = [entry for entry in FIGURES if entry["label"] == label]
    told = {}
    for entry in files:
        for letter, texts in panels(entry["file"]).items():
            told.setdefault(letter, []).append(texts)
    letters = set(told) - {""}
    assert set(PANELS[label]) <= letters
    for letter in letters - set(PANELS[label]):
        assert any(re.search(rf"[Pp]anels? \({letter}\)[^.]* ours", entry["says"]) for entry in files), (
            f"({letter}) is not said to be ours"
        )
    for letter, wanted in PANELS[label].items():
        for texts in told[letter]:
            missing = [each for each in wanted if not any(text.startswith(each) for text in texts)]
            assert not missing, f"({letter}) lacks {missing}"


@pytest.mark.parametrize("file", BELOW)
def test_the_legend_of_a_figure_names_what_the_paper_shows(file):
    told = set.union(*panels(file).values())
    assert set(BELOW[file]) <= told


def test_states_near_the_diagonals_leave_no_stripes():
    """White between blue or green ones a few pixels to both sides, or above and below: less than a thousandth of these."""
    with Image.open(GALLERY / "R1compared.png") as picture:
        pixels = np.asarray(picture.convert("RGB"), int)
    full = (pixels.max(axis=2) - pixels.min(axis=2) > 60) & (pixels[..., 0] < 160)
    white = pixels.min(axis=2) > 240
    reach = 6
    beside = [
        np.logical_or.reduce([np.roll(full, sign * k, axis) for k in range(1, reach + 1)]) for axis in (0, 1) for sign in (1, -1)
    ]
    stripes = white & ((beside[0] & beside[1]) | (beside[2] & beside[3]))
    assert full.sum() > 50_000
    assert stripes.sum() < 1e-3 * full.sum()


def test_the_table_of_noise_is_of_the_run_of_the_picture():
    """The shares of 2:1 motion in the table are an affine function of the heights of the points in panel (c)."""
    page = (ROOT / "docs" / "explanation" / "dynamics.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\d.]+) \| ([\d.]+) \| [^|]+ \| [^|]* \| \d+, \d+ \|$", page, re.MULTILINE)
    sigma, share = np.array(rows, float).T
    svg = (GALLERY / "comp_stoch.svg").read_text(encoding="utf-8")
    (panel,) = re.findall(r'<g id="axes_3">.*?<g id="axes_4">', svg, re.DOTALL)
    lines = [
        np.array(re.findall(r"[ML] ([\d.]+) ([\d.]+)", path), float)
        for path in re.findall(r'<path d="([^"]+)" clip-path[^>]*stroke: #e69f00', panel)
    ]
    (points,) = [line for line in lines if len(line) == len(rows)]
    for measured, drawn in zip((sigma, share), points.T, strict=True):
        fitted = np.polynomial.Polynomial.fit(drawn, measured, 1)
        assert fitted(drawn) == pytest.approx(measured, abs=2e-3 * np.ptp(measured))


def test_files_are_named_once():
    files = [entry["file"] for entry in FIGURES + ANIMATIONS]
    assert len(files) == len(set(files))


@pytest.mark.parametrize("entry", FIGURES, ids=lambda entry: entry["file"])
def test_a_figure_is_there_in_three_formats_and_on_the_page(entry):
    page = (GALLERY / "index.md").read_text(encoding="utf-8")
    assert entry["says"] in page
    assert f"]({entry['file']}.png)" in page
    for kind, begins in SIGNATURES.items():
        assert f"]({entry['file']}.{kind})" in page
        assert (GALLERY / f"{entry['file']}.{kind}").read_bytes().startswith(begins)


@pytest.mark.parametrize("entry", FIGURES, ids=lambda entry: entry["file"])
def test_its_study_is_shipped_and_has_what_the_figure_shows(entry):
    study = load_study(entry["study"])
    assert entry["figure"] in CATALOGUE
    assert all(study.names(section) for section in CATALOGUE[entry["figure"]].sections)


@pytest.mark.parametrize("entry", ANIMATIONS, ids=lambda entry: entry["file"])
def test_an_animation_moves_and_is_small(entry):
    load_study(entry["study"])
    assert entry["name"] in FILMS
    assert f"]({entry['file']}.gif)" in (GALLERY / "index.md").read_text(encoding="utf-8")
    path = GALLERY / f"{entry['file']}.gif"
    assert path.stat().st_size < 1.5 * MEGABYTE
    with Image.open(path) as film:
        assert film.n_frames == entry["options"]["frames"]


def test_nothing_else_is_in_the_folder_and_it_is_small():
    files = [path for path in GALLERY.iterdir() if path.suffix[1:] in (*SIGNATURES, "gif")]
    listed = {f"{entry['file']}.{kind}" for entry in FIGURES for kind in SIGNATURES} | {f"{a['file']}.gif" for a in ANIMATIONS}
    assert {path.name for path in files} == listed
    assert sum(path.stat().st_size for path in GALLERY.iterdir() if path.is_file()) < 12 * MEGABYTE


def test_pictures_are_named_in_the_page_only_where_they_are_listed():
    page = (GALLERY / "index.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page))
    assert shown == {f"{entry['file']}.png" for entry in FIGURES} | {f"{entry['file']}.gif" for entry in ANIMATIONS}


def shown(page: Path) -> list[Path]:
    """The pictures of a page, those on its cards too."""
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"!\[[^\]]*\]\(([^)\s]+)\)", text) + re.findall(r":img-top: (\S+)", text)
    return [(page.parent / name).resolve() for name in named if "://" not in name]


def test_every_picture_of_a_page_is_of_the_list_and_every_one_of_the_list_on_a_page():
    listed = {(ROOT / file).resolve() for file in EVERY}
    named = {path for page in PAGES for path in shown(page) if "_build" not in path.parts}
    assert named <= listed
    assert listed <= named


@pytest.mark.parametrize("file", EVERY)
def test_no_picture_is_stale(file):
    from pictures import pictures

    (picture,) = [each for each in pictures() if each.file.as_posix() == file]
    assert not picture.is_stale, f"{file} is of an earlier study, figure or style: python docs/gallery/make.py"


def test_what_a_picture_is_drawn_from_is_seen_to_change(monkeypatch, tmp_path):
    import pictures
    import tables

    by_name = {each.file.name: each for each in pictures.pictures()}
    one, film, table = by_name["grazing.png"], by_name["video2.gif"], by_name["bench.png"]
    before = {each: pictures.digest(each) for each in (one, film, table)}
    assert len(set(before.values())) == 3
    used = {path.name for path in pictures.sources(one)}
    assert {"bifurcation_diagram.py", "page.py", "style.py", "system.py"} <= used
    assert "cobweb.py" in {path.name for path in pictures.sources(film)}
    style = next(path for path in pictures.sources(one) if path.name == "style.py")
    changed = tmp_path / "style.py"
    changed.write_text(style.read_text() + "#")
    sources = pictures.sources
    with monkeypatch.context() as patch:
        patch.setattr(pictures, "sources", lambda each: [changed if path == style else path for path in sources(each)])
        assert all(pictures.digest(each) != before[each] for each in (one, film, table))
    with monkeypatch.context() as patch:
        other = load_study("impact_oscillator/grazing").model_copy(update={"parameters": {"A": 0.36}})
        patch.setattr(pictures, "loaded", lambda name: other)
        assert pictures.digest(one) != before[one]
    with monkeypatch.context() as patch:
        patch.setattr(tables, "MEASURED", tmp_path)
        (tmp_path / "bench.txt").write_text(
            (ROOT / "docs" / "benchmarks" / "bench.txt").read_text().replace("| 0.0549 |", "| 0.0548 |")
        )
        assert pictures.digest(table) != before[table]
    assert replace(one, file=Path("nowhere.png")).is_stale
    assert {each: pictures.digest(each) for each in before} == before


def test_figures_that_a_study_names_are_no_reason_to_draw_a_picture_again():
    import pictures

    study = load_study("vi_pair/fp")
    assert pictures.asked(study) == pictures.asked(study.model_copy(update={"figures": ("words",), "title": "another"}))
    assert pictures.asked(study) != pictures.asked(load_study("vi_pair/pd"))


def grey(path: Path) -> np.ndarray:
    """A picture in grey levels, few pixels."""
    with Image.open(path) as picture:
        plain = picture.convert("L")
        return np.asarray(plain.resize((plain.width // COARSE, plain.height // COARSE), Image.Resampling.BOX), float)


def command(*arguments: object) -> None:
    """As `nsmaps` of `make`, within this process."""
    answer = CliRunner().invoke(app, [*map(str, arguments)])
    assert answer.exit_code in (0, 1), answer.output


@pytest.mark.documentation
@pytest.mark.parametrize("study", [*sorted(QUICK), ""], ids=lambda study: study or "tables")
def test_pictures_of_quick_runs_are_those_of_a_run_made_now(study, tmp_path, shipped, monkeypatch):
    """With the code that computes, of which the digest knows nothing."""
    import make
    import pictures

    monkeypatch.setattr(make, "nsmaps", command)
    wanted = [each for each in pictures.pictures() if each.study == study and not each.is_animated]
    assert wanted
    there = {each: grey(each.path) for each in wanted}
    kept = [replace(each, file=tmp_path / "made" / each.file.name) for each in wanted]
    (tmp_path / "made").mkdir()
    if study in ALSO_TESTED:
        shutil.copytree(shipped(study), tmp_path / "runs" / study)
    make.make(tmp_path / "runs", tmp_path / "drawn", kept, accept=study in ALSO_TESTED)
    for each, made in zip(wanted, kept, strict=True):
        now = grey(made.path)
        assert now.shape == there[each].shape, each.file
        assert (np.abs(now - there[each]) > FAR).mean() < ALIKE, each.file
        assert (np.abs(np.fliplr(now) - now) > FAR).mean() > ALIKE, "another picture is told apart"


@pytest.mark.thorough
@pytest.mark.parametrize("study", sorted({one["study"] for part in ("figures", "pages") for one in LIST[part]} - QUICK))
def test_pictures_of_all_runs_are_those_of_a_run_made_now(study, tmp_path, shipped, monkeypatch):
    test_pictures_of_quick_runs_are_those_of_a_run_made_now(study, tmp_path, shipped, monkeypatch)


def test_tables_are_read_as_they_stand():
    import tables

    found = tables.bench()
    assert found.row("nsmaps two cores").microseconds == pytest.approx(0.0549)
    assert found.row("diffrax Dopri8 1e-09").wrong == 119
    assert found.row("scipy DOP853 1e-06").family == "scipy DOP853"
    assert round(found.ratio("nsmaps one core"), 2) == 0.18
    assert {name for name, _ in tables.surrogates()} == {"accurate", "closed form", "exact"}
    assert sum(map(len, tables.surrogates().values())) == len(tables.rows_of("surrogates")) == 30


def test_the_method_in_pictures_shows_the_case_of_which_it_speaks():
    import pictures

    page = ROOT / "docs" / "explanation" / "method.md"
    assert "The numbers are those of the case FP, a capsule of dimensionless length d = 0.35." in page.read_text()
    by_path = {each.path.resolve(): each for each in pictures.pictures()}
    of = [by_path[path] for path in shown(page)]
    assert len(of) >= 10
    assert {pictures.loaded(each.study).parameters["d"] for each in of} == {0.35}
