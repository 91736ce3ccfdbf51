"""The documentation is run: Python blocks, doctests, studies and links of README.md and every page of docs/.

`pytest` runs the blocks of README.md, `pytest -m documentation` those of all other pages.
"""

import doctest
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from messages import message
from ruamel.yaml import YAML

from nsmaps import Outcome, load_study

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *(page for page in sorted(DOCS.rglob("*.md")) if page.parent.name[0] != "_")]
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```[ ]*$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# file: (\S+)\n")
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
LINK = re.compile(r"\[[^\]\[]*\]\(([^)\s]+)\)")
INCLUDE = re.compile(r"```\{include\} \.\./_generated/(\S+)\n```\n")
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS

WRITTEN = [PAGES[0], *(pytest.param(page, marks=pytest.mark.documentation) for page in PAGES[1:])]

every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@dataclass(frozen=True)
class Block:
    """One fenced block of a page."""

    language: str
    text: str
    line: int  #: of the page, from zero, on which the text begins


def blocks(page: str) -> Iterator[Block]:
    """The fenced blocks of a page, in order."""
    for match in FENCE.finditer(page):
        yield Block(match[1].strip(), match[2], page.count("\n", 0, match.start(2)))


def prose(page: str) -> str:
    """A page without its blocks and inline code."""
    return re.sub(r"`[^`\n]*`", "", FENCE.sub("", page))


def run_python(block: Block, page: Path, namespace: dict[str, Any]) -> None:
    """Execute a block so that a traceback shows the page's line."""
    exec(compile("\n" * block.line + block.text, str(page), "exec", dont_inherit=True), namespace)


def run_doctest(block: Block, page: Path, namespace: dict[str, Any]) -> None:
    """Compare what a block's examples print with what it says that they print."""
    test = doctest.DocTestParser().get_doctest(block.text, namespace, page.name, str(page), block.line)
    told: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS)
    runner.run(test, out=told.append, clear_globs=False)
    assert runner.failures == 0, "".join(told)
    namespace.update(test.globs)


def read_yaml(block: Block) -> None:
    """Read a block as YAML and, if it is a study, as a study; it is kept under its name, or as study.yaml."""
    data = YAML(typ="safe").load(block.text)
    if isinstance(data, dict) and "system" in data:
        named = FILE.match(block.text)
        file = Path(named[1] if named else "study.yaml")
        file.write_text(block.text)
        load_study(file)


@cache
def generated() -> dict[str, str]:
    """The pages that are made from the package, by name."""
    sys.path.insert(0, str(DOCS))
    try:
        pages: dict[str, str] = import_module("generated").pages()
    finally:
        sys.path.remove(str(DOCS))
    return pages


def whole(page: Path) -> str:
    """A page with the generated pages that it includes."""
    return INCLUDE.sub(lambda found: generated()[found[1]], page.read_text())


def slug(heading: str) -> str:
    """The anchor of a heading, as GitHub and MyST make it."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings."""
    return {slug(match[1]) for match in re.finditer(r"^#+ (.*)$", FENCE.sub("", whole(page)), re.MULTILINE)}


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(ROOT)))
def test_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    namespace: dict[str, Any] = {"__name__": f"page_{slug(page.stem)}"}
    for block in blocks(page.read_text()):
        if block.language == "yaml":
            read_yaml(block)
        elif block.language == "python" and ">>>" in block.text:
            run_doctest(block, page, namespace)
        elif block.language == "python":
            named = FILE.match(block.text)
            if named:
                monkeypatch.delitem(sys.modules, Path(named[1]).stem, raising=False)
                Path(named[1]).parent.mkdir(parents=True, exist_ok=True)
                Path(named[1]).write_text(block.text)
            run_python(
                block, page, {"__name__": Path(named[1]).stem} if named else namespace
            )  # a file's names are to be imported


@every_page
def test_links_resolve(page: Path) -> None:
    for target in LINK.findall(prose(whole(page))):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), f"{page.name} links to {target}, which is not there"
        assert not anchor or anchor in anchors(file), f"{page.name} links to {target}, which has no such heading"


@every_page
def test_pages_import_public_names_alone(page: Path) -> None:
    """Pages for users; that on the architecture says how nsmaps itself is extended."""
    inner = re.compile(r"\b(?:from|import) +nsmaps\.\w+\.\w+")
    assert page.name == "architecture.md" or inner.findall(page.read_text()) == []
    assert inner.findall(">>> from nsmaps.reduced.fit import x") != []


def test_every_page_is_on_the_map() -> None:
    linked = set(LINK.findall((DOCS / "index.md").read_text()))
    assert {str(page.relative_to(DOCS)) for page in PAGES[1:]} - {"index.md"} <= linked


def test_the_front_page_begins_with_a_picture_the_install_line_and_cards() -> None:
    page = (DOCS / "index.md").read_text()
    places = [
        page.index(part) for part in ("![", "pip install -e . && nsmaps run vi_pair/fp", "{grid-item-card}", "## All pages")
    ]
    assert places == sorted(places)
    cards = re.findall(r"\{grid-item-card\} (.+)\n:img-top: (.+)\n:link: (.+)\n:link-type: doc\n(.+)\n", page)
    assert len(cards) == page.count("{grid-item-card}") >= 6
    for _, picture, linked, _ in cards:
        assert (DOCS / picture).is_file()
        assert (DOCS / f"{linked}.md").is_file()


def test_every_page_stands_once_in_the_sidebar_under_a_caption() -> None:
    trees = re.findall(r"```\{toctree\}\n:hidden:\n:caption: [^\n]+\n(.*?)```", (DOCS / "index.md").read_text(), re.DOTALL)
    named = [name for tree in trees for name in tree.split()]
    assert len(trees) >= 4
    assert len(named) == len(set(named))
    there = {str(page.relative_to(DOCS).with_suffix("")) for page in PAGES[1:]} - {"index"}
    assert there <= set(named)


@pytest.mark.documentation
def test_pictures_of_the_site_open_in_full_size() -> None:
    from importlib.util import module_from_spec, spec_from_file_location

    nodes = pytest.importorskip("docutils.nodes")
    spec = spec_from_file_location("conf", DOCS / "conf.py")
    conf = module_from_spec(spec)
    spec.loader.exec_module(conf)
    plain, card = nodes.image(uri="a.png"), nodes.image(uri="b.png", classes=["sd-card-img-top"])
    conf.open_in_full(None, nodes.container("", plain, card))
    assert ("scale" in plain, "scale" in card) == (True, False)  # Sphinx links those with a scale to their files


@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_no_picture_is_a_white_slab_on_a_dark_page(tmp_path: Path) -> None:
    pictures = '<article><a class="reference"><img></a></article><div class="sd-card"><img class="sd-card-img-top"></div>'
    measure = (
        "for (const at of ['a', '.sd-card img']) { const look = getComputedStyle(document.querySelector(at));"
        "document.body.append(`seen ${look.backgroundColor} ${look.filter};`) }"
    )
    style = f"<style>{(DOCS / '_static' / 'pictures.css').read_text()}</style>"
    (tmp_path / "page.html").write_text(f'{style}<body data-theme="dark">{pictures}<script>{measure}</script>')
    command = [str(BROWSER), "--headless=new", "--no-sandbox", "--disable-gpu", "--dump-dom", (tmp_path / "page.html").as_uri()]
    page = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    seen = re.findall(r"seen rgb\((\d+), \d+, \d+\) (?:none|brightness\(([\d.]+)\));", page)
    light = [int(red) / 255 * float(share or 1) for red, share in seen]
    assert len(light) == 2
    assert max(light) < 0.85


def test_every_outcome_is_told() -> None:
    page = (DOCS / "reference" / "words.md").read_text()
    assert [outcome.name for outcome in Outcome if f"`{outcome.name}`" not in page] == []


def test_the_citation_is_of_this_version() -> None:
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text())
    assert (citation["cff-version"], citation["title"], citation["license"]) == ("1.2.0", "nsmaps", "MIT")
    project = (ROOT / "pyproject.toml").read_text()
    assert f'version = "{citation["version"]}"' in project
    assert citation["version"] == version("nsmaps")
    assert [author["family-names"] for author in citation["preferred-citation"]["authors"]] == [
        "Bao",
        "Kuske",
        "Yurchenko",
        "Belykh",
    ]
    assert f"## {citation['version']}" in (DOCS / "changelog.md").read_text()


def test_blocks_are_found_and_failures_are_seen(tmp_path: Path) -> None:
    page = "text\n```python\n>>> 1 + 1\n3\n```\n[a](b.md) `[c](d.md)`\n```yaml\nx: [e](f.md)\n```\n"
    first, second = blocks(page)
    assert (first.language, first.line, second.language) == ("python", 2, "yaml")
    assert LINK.findall(prose(page)) == ["b.md"]
    with pytest.raises(AssertionError, match=message("others.doctest", expected=3, got=2)):
        run_doctest(first, tmp_path / "page.md", {})
    with pytest.raises(ZeroDivisionError) as told:
        run_python(Block("python", "1 / 0\n", 6), tmp_path / "page.md", {})
    assert told.traceback[-1].lineno == 6
