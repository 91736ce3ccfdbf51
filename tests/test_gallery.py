"""The gallery: every figure of the list is on the page, there in three formats, and named as nsmaps names it."""

import re
from pathlib import Path

import pytest
from PIL import Image
from ruamel.yaml import YAML

from nsmaps import load_study
from nsmaps.figures import NAMES
from nsmaps.figures.animate import FILMS
from nsmaps.figures.catalogue import CATALOGUE

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
LIST = YAML(typ="safe").load((GALLERY / "figures.yaml").read_text(encoding="utf-8"))
FIGURES, ANIMATIONS = LIST["figures"], LIST["animations"]
MEGABYTE = 1024 * 1024
PAPER = """model:abc bifexact regions impact-time 2d-1phi 3d 2Dpi-2pi 2D0-2pi flochart 3d-area r2approx test glosmallic
fig:illauximaps cobweb12d35 cobweb12d35_updates Auximapsd30 Auximapsd30_updates Auximapsd26 highorderiterate comp_stoch ICPP02pi
R1compared comparert TableDeltaErr r5approx"""  #: labels there
BESIDE = {"bifapprox": "bifexact"}  #: figures that share a picture with another, which its sentence says
SIGNATURES = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


def test_every_figure_of_the_paper_is_listed():
    assert {entry["label"] for entry in FIGURES} == set(PAPER.split())
    for label, other in BESIDE.items():
        assert any(label in entry["says"] for entry in FIGURES if entry["label"] == other)


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
    assert entry["figure"] in NAMES
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
