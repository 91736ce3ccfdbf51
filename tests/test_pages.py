"""Pages name what exists, state times on one page alone, and hold no diary; the front page is short."""

import builtins
import re
from functools import cache
from pathlib import Path

import pytest
from test_docs import DOCS, FENCE, PAGES, ROOT, blocks
from test_notation import resolved

import nsmaps

READMES = sorted(ROOT.glob("plugins/*/README.md"))
HISTORY = (DOCS / "changelog.md", DOCS / "explanation" / "architecture.md")  #: names of earlier versions; names within nsmaps
DIARY = re.compile(
    r"\b(busy|quiet) (machine|cores?|runs?)\b|\bshared with other(s| programs)\b|\bother programs (running|on both)\b"
    r"|\bin alternating runs\b|\bthe (code|version) before\b|\bas it once did\b|\bearlier code\b|\([\d.]+ before\)"
    r"|\bbefore this change\b"
    r"|\b(code|time) of that time\b|\bthen took\b|\binstead of [\d.]+ s\b|\bwas (then )?made faster\b|\bthere and gone\b",
    re.IGNORECASE,
)  #: what belongs to the history of the project; of times to the page of benchmarks
GROUPS = {
    f"nsmaps.{group}" for group in ("NAME", "systems", "regions", "fits", "families", "quantifiers", "analyses", "sketches")
}
OTHERS = {
    "tree",
    "math",
    "np",
    "numpy",
    "sp",
    "sympy",
    "scipy",
    "sin",
    "cos",
    "exp",
    "sqrt",
    "tanh",
    "abs",
    "min",
    "max",
    "floor",
    "sign",
    "log",
}
everywhere = pytest.mark.parametrize("page", [*PAGES, *READMES], ids=lambda page: str(page.relative_to(ROOT)))


def inline(page: Path) -> list[str]:
    """The inline code of a page."""
    return re.findall(r"(?<!`)`([^`\n]+)`(?!`)", FENCE.sub("", page.read_text(encoding="utf-8")))


@cache
def members() -> frozenset[str]:
    """The names of public things, of the methods and fields of public classes, and of parameters of commands."""
    found = set(dir(builtins))
    for room in (nsmaps, *(getattr(nsmaps, name) for name in dir(nsmaps) if name not in nsmaps.__all__)):
        for name in getattr(room, "__all__", ()):
            thing = getattr(room, name)
            fields = getattr(thing, "model_fields", {}) | getattr(thing, "__dataclass_fields__", {})
            found |= {name, *(dir(thing) if isinstance(thing, type) else ()), *fields}
    return frozenset(found)


def unknown(code: str, own: str) -> bool:
    """Whether inline code names a part of nsmaps, or calls something, that exists neither there nor in the blocks of its page."""
    if (dotted := re.match(r"nsmaps(?:\.\w+)+(?!\.?(?:py|yaml)\b)", code)) and dotted[0] not in GROUPS:
        try:
            resolved(dotted[0])
        except (AttributeError, KeyError, StopIteration):
            return True
        return False
    call = re.match(r"(?:(\w+)\.)*(\w+)\(", code)
    return bool(call and call[1] not in OTHERS and call[2] not in members() | OTHERS and not re.search(rf"\b{call[2]}\b", own))


@everywhere
def test_inline_code_names_what_exists(page: Path) -> None:
    if page in HISTORY:
        return
    own = " ".join(block.text for block in blocks(page.read_text(encoding="utf-8")))
    own += " ".join(file.read_text(encoding="utf-8") for file in page.parent.glob("*.py"))
    assert [code for code in inline(page) if unknown(code, own)] == []


def test_names_that_do_not_exist_are_found() -> None:
    assert unknown("nsmaps.no_such_name", "")
    assert unknown("no_such_call(1)", "")
    assert not unknown("no_such_call(1)", "def no_such_call(x): ...")
    assert not unknown("nsmaps.dynamics.Orbit", "")
    assert not unknown("system.at(d=0.3)", "")
    assert not unknown("nsmaps.reduced.composite.noise.KickedMap", "")


@everywhere
def test_a_page_is_no_diary(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert page.name in ("changelog.md", "benchmarks.md") or [match[0] for match in DIARY.finditer(text)] == []
    assert DIARY.search("on a busy machine")


def test_every_table_of_times_has_a_date_and_its_machine() -> None:
    page = (DOCS / "explanation" / "benchmarks.md").read_text(encoding="utf-8")
    assert "AMD EPYC" in page
    sections = re.split(r"^## ", page, flags=re.MULTILINE)[1:]
    timed = [part for part in sections if "µs" in part or "rocessor time" in part or "times faster" in part]
    assert len(timed) >= 5
    assert [part.partition("\n")[0] for part in timed if not re.search(r"\b20\d\d\b", part)] == []


def test_the_front_page_is_short() -> None:
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(page.encode()) <= 5000
    assert len([block for block in blocks(page) if block.language == "sh"]) == 2
    (python,) = [block for block in blocks(page) if block.language == "python"]
    assert len(python.text.strip().splitlines()) <= 10


def test_every_formula_of_the_site_is_mathml() -> None:
    convert = pytest.importorskip("latex2mathml.converter").convert
    pages = [FENCE.sub("", page.read_text(encoding="utf-8")) for page in PAGES]
    found = [
        match[0].strip("$")
        for page in pages
        for match in re.finditer(r"\$\$.+?\$\$|\$[^$\n]+\$", re.sub(r"`[^`\n]*`", "", page), re.DOTALL)
    ]
    assert len(found) > 100
    assert [formula for formula in found if "\\" in convert(formula)] == []
